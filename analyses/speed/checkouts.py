"""A case computed by the code of another checkout, for comparisons with an earlier commit, and files for both."""

import json
import os
import subprocess
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from analyses.hidden_effects.cases import SIZES, seal, specs


def answered(script: str, arguments: Sequence[str], tree: Path) -> dict[str, Any]:
    """The last line, JSON, that a script prints in a process of its own with the package of a checkout."""
    environment = os.environ | {"PYTHONPATH": str(tree.resolve())}
    environment |= {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, script, *arguments], capture_output=True, text=True, check=True, env=environment
    )
    return dict(json.loads(done.stdout.splitlines()[-1]))


def benchmark_files(numbers: Iterable[int], folder: Path) -> dict[str, tuple[str, int]]:
    """Cases of the benchmark of hidden effects in random order: file and seed of each that a rig was found for."""
    plan = specs(SIZES["small"], 0)
    order, found = np.random.default_rng(0).permutation(len(plan)), {}
    for number in numbers:
        spec = plan[int(order[number])]
        if seal(spec, folder / "cases", folder / "sealed"):
            name = f"benchmark:{number} {'+'.join(spec.names) or spec.kind}"
            found[name] = str(folder / "cases" / spec.key / "experiment.toml"), int(spec.key, 16) % 2**31
    return found

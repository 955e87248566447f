"""Putting one case to the program under test, or to a baseline."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
import traceback
from pathlib import Path
from typing import Any

from .cases import Spec, build

BASELINES = ("bic", "sparse", "flexible")
ANSWERERS = ("api", "apart", "cli", *BASELINES)


def ask(spec: Spec, cases: Path, how: str, simulations: int | None = None) -> dict[str, Any]:
    """The answer to a case: `key`, `seconds`, `answer` (as discovery.json) or `error`.

    Parameters
    ----------
    cases : folder of the experiment files.
    how : `api` (Python), `apart` (Python, each experiment of a file alone), `cli` (command line) or a baseline.
    simulations : refitted data sets behind the p-value, if not as many as usual; not for `cli` and baselines.
    """
    begin = time.perf_counter()
    record: dict[str, Any] = {"key": spec.key, "answer": None, "error": None}
    try:
        without = spec.names if spec.kind == "without" else ()
        record["answer"] = _answer(spec, cases / spec.key / "experiment.toml", how, without, simulations)
    except Exception:  # a judged program that falls over is a result, not the end of the benchmark
        record["error"] = traceback.format_exc()[-2000:]
    record["seconds"] = round(time.perf_counter() - begin, 2)
    return record


def _answer(spec: Spec, file: Path, how: str, without: tuple[str, ...], simulations: int | None) -> dict[str, Any]:
    seed = int(spec.key, 16) % 2**31
    if how in ("api", "apart"):
        from wirebayes.discovery.search import catalogue_without, investigate
        from wirebayes.discovery.settings import SIMULATIONS, Settings
        from wirebayes.io.experiment_file import read_experiments

        # without the posteriors that the command adds: they are not judged here and cost minutes
        settings = Settings(kinds=catalogue_without(without), simulations=simulations or SIMULATIONS)
        experiments = read_experiments(file)
        materials = {e.material: [x for x in experiments if x.material == e.material] for e in experiments}
        groups = [experiments] if how == "api" else list(materials.values())
        answers = [investigate(members, settings, seed).report for members in groups]
        return {**answers[0], "experiments": {k: v for a in answers for k, v in a["experiments"].items()}}
    if how == "cli":
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, "-m", "wirebayes", "discover", str(file), "--output", f"{folder}/out"]
            command += ["--seed", str(seed), *(word for name in without for word in ("--without", name))]
            done = subprocess.run(command, capture_output=True, text=True)
            if done.returncode:
                raise RuntimeError(f"exit {done.returncode}: {done.stderr}")
            return dict(json.loads(Path(folder, "out", "discovery.json").read_text(encoding="utf-8")))
    from . import baselines

    case = build(spec)
    assert case is not None  # only cases within reach are asked
    return baselines.answer(case, how)

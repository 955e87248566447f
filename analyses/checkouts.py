"""A case computed by the code of another checkout, for comparisons with an earlier commit."""

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any


def answered(script: str, arguments: Sequence[str], tree: Path) -> dict[str, Any]:
    """The last line, JSON, that a script prints in a process of its own with the package of a checkout."""
    environment = os.environ | {"PYTHONPATH": str(tree.resolve())}
    environment |= {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, script, *arguments], capture_output=True, text=True, check=True, env=environment
    )
    return dict(json.loads(done.stdout.splitlines()[-1]))

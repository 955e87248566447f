"""The paper's own data, carried by the package."""

import tomllib
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from wirebayes.io.experiment import Experiment
from wirebayes.io.experiment_file import read_experiments

FOLDER = Path(str(files("wirebayes"))) / "data" / "paper"


def experiments() -> list[Experiment]:
    """The four wires of Tables 1 to 3: Roc Line 1 m and 1.71 m, nylon, kite line."""
    return read_experiments(FOLDER / "experiments.toml")


@cache
def published() -> dict[str, Any]:
    """Table 4 and the paper's claims, as printed (``published.toml``)."""
    return tomllib.loads((FOLDER / "published.toml").read_text(encoding="utf-8"))

"""A small `reproduce`: the kite line alone and the robot in one size, with short searches and chains.

They are too short to be believed, but long enough to be looked at.
"""

from pathlib import Path

import pytest

from wirebayes.inference.policy import Policy
from wirebayes.io import paper
from wirebayes.paper import least_squares, run, section_4
from wirebayes.progress import Progress, silent

POLICY = Policy(walkers=32, ess=300.0, rounds=2, round_draws=1024, block=20, most_steps=60, r_hat=1.5)


def reproduce(directory: Path, patch: pytest.MonkeyPatch, seed: int = 0, report: Progress | None = None) -> list[str]:
    """Run it into a folder."""
    kite = [e for e in paper.experiments() if e.name == "kite-1.5m"]
    patch.setattr(run.paper, "experiments", lambda: kite)
    patch.setattr(least_squares, "_STARTS", 2)
    patch.setattr(section_4, "_SIZES", (1.0,))
    return run.reproduce(directory, seed, report or silent, POLICY)

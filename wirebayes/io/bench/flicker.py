"""A measured setting that stays, written now one way, now the other in its last digit: one hold, not several."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from wirebayes.io.bench.recorded import CONTINUOUS, Rows, changes, groups_between, usual_size, wanders
from wirebayes.numeric.typing import Bools, Floats

FLICKER = 1.5  # of the least step between settings: what is written to a digit comes back within one
FINE = 0.05  # of the smallest move: nobody who moves so far sets a wire to a twentieth of it
SHORT = 0.5  # of the usual hold: pieces of one that flickers are shorter
ALONE = 0.25  # of the stretches of a recording that flickers have a single reading: at even odds half of them have


def flickers(x: Floats, groups: Sequence[Rows]) -> bool:
    """Whether groups are those of a recording whose encoder comes and goes between two steps."""
    alone = sum(len(rows) == 1 for rows in groups)
    joined = groups_between(changes(x) & ~_least_steps(x))
    return len(joined) < len(groups) and alone >= ALONE * len(groups) and usual_size(joined) >= CONTINUOUS


def without_flicker(x: Floats, groups: list[Rows], restart: Bools) -> list[Rows]:
    """Groups without borders at which only the last digit of a measured setting changes; the same where none are.

    Beside such a border one of the groups is shorter than a hold, and a move is many times the digit.

    Parameters
    ----------
    x : (r,) array
        What was set.
    groups : list of Rows
        Of one setting each.
    restart : (r,) array of bool
        Where the clock starts again, which is a border whatever the setting does.
    """
    least, usual = _least_steps(x), usual_size(groups)
    border = np.zeros(len(x), bool)
    for before, after in pairwise(groups):
        row = int(after[0])
        short_one = min(len(before), len(after)) < SHORT * usual
        border[row] = restart[row] or not (short_one and least[row])
    joined = groups_between(border)
    return groups if wanders(x, joined, FINE) else joined


def _least_steps(x: Floats) -> Bools:
    """Where a setting changes by the least step between any two, of which there are others."""
    levels = np.unique(x)
    steps = np.concatenate([[0.0], np.abs(np.diff(x))])
    if len(levels) < 3:
        return np.zeros(len(x), bool)
    return (steps > 0) & (steps < FLICKER * np.diff(levels).min())

"""Where creep is taken about next: creep follows from tensions and tensions from creep, each found in turns.

Half the way on each time, since creep that wires slackened by would make them taut again in turns. Where every step is
nearly as long as the last one and in its direction, as of tensions that the readings hardly tell apart, the way is
long, and a jump goes to where steps that shorten like that would end.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from wirebayes.numeric.typing import Floats
from wirebayes.robot.self_calibration.equations import State

_STRAIGHT = 0.97  # cosine of two steps in one direction
_SLOW = 0.5  # of a step, what the next one has: less, and the way is short
_FARTHEST = 30.0  # steps that a jump goes


def onward(passed: Sequence[State], reached: State, sd: Floats, tension_sd_N: float) -> list[State]:
    """The states that creep was taken about, with the next one; after a jump that one alone.

    Parameters
    ----------
    passed : sequence of State
        Those since the last jump; the last three steps count.
    reached : State
        What the creep about the last one of them led to. The next one has its poses.
    sd : (m,) array
        Standard deviations of the robot's unknowns.
    tension_sd_N : float
        Of a tension that is read, or of tensions where none is.
    """
    last = passed[-1]
    white = 0.5 * (last.white + reached.white)
    pull = 0.5 * (last.pull_N + reached.pull_N)
    nearer = [*passed, replace(reached, white=white, pull_N=pull)]
    if len(nearer) < 3:
        return nearer
    farther = _jump(nearer[-3:], sd, tension_sd_N)
    return nearer if farther is None else [farther]


def _jump(passed: Sequence[State], sd: Floats, tension_sd_N: float) -> State | None:
    """Where steps that shorten as two did would end; None where the second turns, or is much shorter than the first."""
    places = []
    for state in passed:
        pull = state.pull_N.ravel() / tension_sd_N
        places.append(np.concatenate([state.white / sd, pull]))
    first, second = np.diff(places, axis=0)
    steps = _steps_on(first, second)
    if not steps:
        return None
    _, before, last = passed
    moved = last.white - before.white
    pulled = last.pull_N - before.pull_N
    return replace(last, white=last.white + steps * moved, pull_N=last.pull_N + steps * pulled)


def _steps_on(first: Floats, second: Floats) -> float:
    """How many steps as long as the second one the way is still, where the next shorten as it did; 0 for no jump."""
    along = float(first @ second)
    if not along > _STRAIGHT * np.linalg.norm(first) * np.linalg.norm(second):
        return 0.0
    ratio = along / float(first @ first)
    if ratio < _SLOW:
        return 0.0
    return min(ratio / max(1.0 - ratio, 1e-9), _FARTHEST)

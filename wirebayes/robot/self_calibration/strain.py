"""How much longer than its zero-tension length before creep a wire of known tension is: creep, then stretch.

Creep follows the tensions of the whole session. Within a hold with fixed joint values it lengthens the wires and so
lowers their tensions (`within_holds`).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from wirebayes.numeric.batches import batch_first
from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics.wires import Wires, stretched_length
from wirebayes.robot.self_calibration.unknowns import Unknowns
from wirebayes.robot.self_calibration.within_holds import Loaded, TensionCourse, crept

_STEP = 1e-3  # of a prior's standard deviation: differences of smooth functions
_LOAD = 1e-2  # relative change of a hold's tensions


@dataclass(frozen=True)
class Grown:
    """Creep strains at the end of every hold, with slopes.

    Attributes
    ----------
    strain : (p, w) array
    by_wires : (p, w, d) array
        By the wires' unknowns in units of their prior.
    by_pull : (p, p, w) array
        Of every hold by its own tension and by those of the holds before it, 1/N.
    course : Course, optional
        How tensions came there.
    """

    strain: Floats
    by_wires: Floats
    by_pull: Floats
    course: TensionCourse | None = None


def differing_wires(unknowns: Unknowns, white: Floats) -> Wires:
    """Wires at a vector of unknowns, then with each of their unknowns a little up, then down.

    A specimen's own parameters belong to its leg alone, so those of all legs change at once: a column for each of
    their names.
    """
    mean, root = unknowns.moments
    at = white[unknowns.slices["wires"]]
    directions = _directions(unknowns)
    moves = np.concatenate([np.zeros((1, len(mean))), directions, -directions])
    values = mean + (at + _STEP * moves) @ root.T
    wires, _ = unknowns.prior.wires(unknowns.robot, values)
    return wires


def _directions(unknowns: Unknowns) -> Floats:
    """(c, d) which unknowns each column of `differing_wires` changes."""
    legs = unknowns.robot.legs
    shared = len(unknowns.prior.names)
    own = len(unknowns.prior.own)
    out = np.zeros((shared + own, unknowns.of_wires))
    for k in range(shared):
        out[k, legs + k] = 1.0
    for k in range(own):
        first = legs + shared + k * legs
        out[shared + k, first : first + legs] = 1.0
    return out


def by_unknown(unknowns: Unknowns, values: Floats) -> Floats:
    """Slopes ``(p, w, d)`` of values ``(p, w, 1 + 2 c)`` at the columns of `differing_wires`."""
    legs = unknowns.robot.legs
    shared = len(unknowns.prior.names)
    up, down = np.split(values[..., 1:], 2, axis=2)
    slope = (up - down) / (2 * _STEP)
    out = np.zeros((*values.shape[:2], unknowns.of_wires))
    first_own = legs + shared
    out[..., legs:first_own] = slope[..., :shared]
    leg = np.arange(legs)
    for k in range(len(unknowns.prior.own)):
        own = first_own + k * legs + leg
        out[:, leg, own] = slope[..., shared + k]
    return out


def grown(
    unknowns: Unknowns,
    white: Floats,
    pull_N: Floats,
    loaded: Callable[[Floats], Loaded],
    known: TensionCourse | None = None,
    each: bool = False,
) -> Grown:
    """Creep of every hold under tensions that ended at known values.

    Parameters
    ----------
    unknowns : Unknowns
    white : (m,) array
    pull_N : (p, w) array
        Tensions when the holds ended; negative ones are slack.
    loaded : function of (p, w, n) array to Loaded
        What tensions of n columns that end so were before.
    known : Course, optional
        Of a state near by.
    each : bool
        Whether slopes by the tension of every hold are wanted. Else those by all tensions together are taken for
        slopes by the hold's own.
    """
    holds = len(pull_N)
    if not unknowns.prior.creeps:
        return no_creep(unknowns, holds)
    wires = differing_wires(unknowns, white)
    columns = _count(wires)
    own_hold = np.eye(holds)
    changes = own_hold if each else np.ones((holds, 1))  # which holds' tensions every further column changes
    rows = np.concatenate([np.arange(columns), np.zeros(changes.shape[1], int)])
    factor = np.ones((holds, 1, len(rows)))
    factor[:, 0, columns:] += _LOAD * changes
    tensions = np.maximum(pull_N[..., None] * factor, 0.0)
    strain, course = crept(wires.part(rows), loaded(tensions), known)
    by_wires = by_unknown(unknowns, strain[..., :columns])
    change = strain[..., columns:] - strain[..., :1]
    if not each:
        change = change * own_hold[:, None]
    return Grown(strain[..., 0], by_wires, _by_pull(change, pull_N), course)


def no_creep(unknowns: Unknowns, holds: int) -> Grown:
    """Wires that do not creep, whatever their tensions."""
    legs = unknowns.robot.legs
    by_wires = np.zeros((holds, legs, unknowns.of_wires))
    return Grown(np.zeros((holds, legs)), by_wires, np.zeros((holds, holds, legs)))


def _by_pull(change: Floats, pull_N: Floats) -> Floats:
    """Slopes ``(p, p, w)`` by every hold's tension, of strains' changes ``(p, w, p)`` when one of them is larger."""
    slope = change.swapaxes(1, 2) / (_LOAD * np.maximum(pull_N, 1e-300))
    return np.where(pull_N > 0, slope, 0.0)


def _count(wires: Wires) -> int:
    return max(np.shape(v)[-1] for v in wires.theta.values())


@dataclass(frozen=True)
class Stretch:
    """Stretched over zero-tension length, ``(p, w)``, with slopes by tension (1/N) and by the wires' unknowns."""

    ratio: Floats
    by_pull: Floats
    by_wires: Floats


def stretch(unknowns: Unknowns, white: Floats, pull_N: Floats) -> Stretch:
    """Elastic stretch of wires under tensions ``(p, w)``; a slack wire's gap is a negative tension by Hooke's law.

    Parameters
    ----------
    unknowns : Unknowns
    white : (m,) array
    pull_N : (p, w) array
        Latent tensions.
    """
    wires = differing_wires(unknowns, white)
    step = 1e-4 * np.abs(pull_N).max() + 1e-9
    here = _ratio(wires, pull_N)
    up = _ratio(wires, pull_N + step)
    by_pull = (up[..., 0] - here[..., 0]) / step
    return Stretch(here[..., 0], by_pull, by_unknown(unknowns, here))


def _ratio(wires: Wires, tension_N: Floats) -> Floats:
    """Stretched over zero-tension length of every column of wires under tensions ``(p, w)``: ``(p, w, c)``."""
    p, legs = tension_N.shape
    columns = _count(wires)
    taut = np.maximum(tension_N, 0.0).T
    load = np.repeat(taut[:, None], columns, 1).reshape(legs, columns * p)  # column by column, hold by hold
    each = wires.part(np.repeat(np.arange(columns), p))
    long = stretched_length(each, np.ones_like(load), load)
    k1 = np.broadcast_to(wires.theta["k1"], (legs, columns))
    gap = np.minimum(tension_N, 0.0).T[:, None] / k1[..., None]
    return batch_first(long.reshape(legs, columns, p) + gap)

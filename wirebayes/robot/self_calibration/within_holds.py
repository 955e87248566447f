"""Creep within the holds of a session whose tensions are known when they end, as fine as the session can tell.

Times of a hold are even in creep's own clock, and the amount of creep changes evenly between them. Tensions before the
end follow from those at the end by the equilibria of wires that have not yet crept so far.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion.creep import CreepState, HoldCreep, fresh

_PASSES, _SAME = 10, 0.01  # of a hold; of what is resolved: creep answers to a part of that
_AHEAD = 4.0  # changes at most, that are taken at once
_BENDS = 3  # corrections of tensions by equilibria: those after the first change little
_COARSE = 4  # times in a hold, at first
_ERROR = 0.03  # of what the session resolves of a tension
# Half the steps of a rule of second order leave a quarter of its error: a third of the change is taken off, and what is
# left then was a tenth of the change at most in drawn sessions.
_TAKEN_OFF, _LEFT = 3.0, 0.1
_POWERS = 0.1, 3.0  # of time; unknowns may have any N


@dataclass(frozen=True)
class TensionCourse:
    """How tensions went on their way to a hold's end: where the next state's search for them begins.

    Attributes
    ----------
    path_N : (p, t, w, n) array
        Tensions of every column at the times of every hold, its beginning first.
    bend_N : (p, t, w) array
        Tensions beyond those of the response.
    """

    path_N: Floats
    bend_N: Floats


@dataclass(frozen=True)
class Loaded:
    """Tensions that ended a session's holds, and what they were before.

    Attributes
    ----------
    end_N : (p, w, n) array
        Tensions of n columns when the holds ended.
    response_N : (p, w, w) array
        Change of the tensions when wires lengthen by a strain, at fixed joint values.
    duration_s : (p,) array
    sd_N : float
        What is to be resolved of a tension.
    finest : int
        Times in a hold at most.
    beyond : function of (p, t, w) array to (p, t, w) array
        What equilibria of wires that are longer by these strains pull, beyond what the response says, N.
    """

    end_N: Floats
    response_N: Floats
    duration_s: Floats
    sd_N: float
    finest: int
    beyond: Callable[[Floats], Floats]


def crept(wires: Wires, loaded: Loaded, known: TensionCourse | None = None) -> tuple[Floats, TensionCourse]:
    """Creep strains at the holds' ends, with as many times in each hold as they need.

    Parameters
    ----------
    wires : Wires
        ``n`` columns.
    loaded : Loaded
    known : Course, optional
        Of a state near by.

    Returns
    -------
    strain : (p, w, n) array
    course : Course
    """
    stiff = float(np.max(wires.theta["k1"]))
    course = _from_end(loaded, _COARSE) if known is None else _shifted(known, loaded)
    while True:
        through, course = _bent(wires, loaded, course)
        count = course.path_N.shape[1] - 1
        left = _LEFT * stiff * float(np.abs(through.off[..., 0]).max())
        # a state whose creep and tensions do not agree is no equilibrium yet: more times would not make it one
        if left < _ERROR * loaded.sd_N or count >= loaded.finest or not through.settled:
            return through.strain + through.off / _TAKEN_OFF, course
        course = _finer(course)


def _from_end(loaded: Loaded, count: int) -> TensionCourse:
    p, legs, _ = loaded.end_N.shape
    path = np.repeat(loaded.end_N[:, None], count + 1, 1)
    return TensionCourse(path, np.zeros((p, count + 1, legs)))


def _shifted(known: TensionCourse, loaded: Loaded) -> TensionCourse:
    """To other tensions at the end, and as many columns as these have: all go the way of the first."""
    first = known.path_N[..., :1]
    way = first - first[:, -1:]
    return TensionCourse(np.maximum(loaded.end_N[:, None] + way, 0.0), known.bend_N)


def _finer(course: TensionCourse) -> TensionCourse:
    """Twice as many times."""

    def between(values: Floats) -> Floats:
        out = np.repeat(values, 2, 1)[:, :-1]
        out[:, 1::2] = 0.5 * (values[:, :-1] + values[:, 1:])
        return out

    return TensionCourse(between(course.path_N), between(course.bend_N))


def _bent(wires: Wires, loaded: Loaded, course: TensionCourse) -> tuple["_Through", TensionCourse]:
    """A session's creep, and the tensions on the way corrected by equilibria."""
    for _ in range(_BENDS):
        through = _through(wires, loaded, course)
        bend = loaded.beyond(through.ahead)
        change = np.abs(bend - course.bend_N).max()
        course = TensionCourse(through.path_N, bend)
        if change < _ERROR * loaded.sd_N or not through.settled:
            break
    return through, course


@dataclass(frozen=True)
class _Through:
    """A session's creep.

    Attributes
    ----------
    strain, off : (p, w, n) arrays
        At the holds' ends, and how much more it is than with every second time alone.
    ahead : (p, t, w) array
        Strains of the first column at a hold's times beyond those at its end, of the lengths there.
    path_N : (p, t, w, n) array
    settled : bool
        Whether creep and tensions agree in every hold.
    """

    strain: Floats
    off: Floats
    ahead: Floats
    path_N: Floats
    settled: bool


def _through(wires: Wires, loaded: Loaded, course: TensionCourse) -> _Through:
    """A session under tensions that the response says, beside a bend."""
    state = fresh(*loaded.end_N.shape[1:])
    held = []
    for k in range(len(loaded.duration_s)):
        hold = _held(wires, state, loaded, course, k)
        held.append(hold)
        state = hold.state
    return _Through(
        strain=np.stack([one.strain for one in held]),
        off=np.stack([one.off for one in held]),
        ahead=np.stack([one.ahead for one in held]),
        path_N=np.stack([one.path_N for one in held]),
        settled=all(one.settled for one in held),
    )


@dataclass(frozen=True)
class _Held:
    """One hold's part of `_Through`, and the `state` of the wires that it leaves to the next."""

    strain: Floats
    off: Floats
    ahead: Floats
    path_N: Floats
    settled: bool
    state: CreepState


def _held(wires: Wires, carried: CreepState, loaded: Loaded, course: TensionCourse, hold: int) -> _Held:
    """Creep and tensions of a hold, one after the other until they agree."""
    path = course.path_N[hold]
    times = _times(wires, float(loaded.duration_s[hold]), len(path) - 1)
    before: Floats | None = None
    for _ in range(_PASSES):
        states = _creeping(wires, carried, times, path)
        strains = np.array([state.strain(wires) for state in states])
        change = _tensions(loaded, course, hold, strains) - path
        largest_N = np.abs(change).max()
        same = bool(largest_N < _SAME * loaded.sd_N)
        further = 0.0
        if before is not None and not same:
            further = _extrapolated(before, change)
        path = np.maximum(path + (1.0 + further) * change, 0.0)
        if same:
            break
        before = change if before is None else None
    coarse = _creeping(wires, carried, times[::2], path[::2])[-1]
    strain = strains[-1]
    off = strain - coarse.strain(wires)
    ahead = _ahead(strains)[..., 0]
    return _Held(strain, off, ahead, path, same, states[-1])


def _ahead(strains: Floats) -> Floats:
    """Strains beyond those at a hold's end, of the lengths there."""
    return (strains - strains[-1]) / (1.0 + strains[-1])


def _tensions(loaded: Loaded, course: TensionCourse, hold: int, strains: Floats) -> Floats:
    """Tensions ``(t, w, n)`` in a hold of wires with creep strains."""
    bend = course.bend_N[hold][..., None]
    tension = loaded.end_N[hold] + loaded.response_N[hold] @ _ahead(strains) + bend
    return np.maximum(tension, 0.0)


def _extrapolated(before: Floats, change: Floats) -> float:
    """How many times a change is to be taken more, where changes go on in the ratio of the last two (Aitken)."""
    squares = float((before * before).sum())
    ratio = float((change * before).sum() / max(squares, 1e-300))
    if not ratio < 1.0:
        return 0.0
    return min(ratio / (1.0 - ratio), _AHEAD)


def _creeping(wires: Wires, state: CreepState, times_s: Floats, tension_N: Floats) -> list[CreepState]:
    """The states at the times of a hold, from its beginning on, as amounts change evenly between their tensions."""
    creep = HoldCreep(wires, state, tension_N[0])
    states = [state]
    for time, tension in zip(times_s[1:], tension_N[1:], strict=True):
        creep = creep.toward(float(time), creep.amount_at(tension))
        states.append(creep.state())
    return states


def _times(wires: Wires, duration_s: float, count: int) -> Floats:
    """Times of a hold from its beginning on, even in the logarithm of one plus creep's clock of the middle wire."""
    power = float(np.clip(np.median(wires.theta["N"]), *_POWERS))
    clock = float(np.median(wires.theta["k2"])) * duration_s**power
    share = np.expm1(np.log1p(clock) * np.arange(count + 1) / count) / clock
    return duration_s * share ** (1 / power)

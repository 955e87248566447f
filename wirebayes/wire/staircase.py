"""Readings of one wire through a sequence of holds, batched over parameter sets.

Arrays end in the batch axis: readings are ``(H, R, n)``, one row of memory per reading, because long inner loops are
what numpy is fast at.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.special import log_ndtr

from wirebayes.numeric.typing import Array, Bools
from wirebayes.wire import compiled
from wirebayes.wire.compiled import FirstReadings
from wirebayes.wire.model import PLAIN, Model
from wirebayes.wire.protocol import Protocol
from wirebayes.wire.walk import ByHand, BySteps, LinearHoldWalked, Sloped, Theta, Walk

if TYPE_CHECKING:
    from wirebayes.wire._kernel import Staircases

FAR = 8.0  # standard deviations of the setting: a wire stretched by more is taut whatever its error, to 1e-15
LEAST_STRETCH = 0.5  # standard deviations of the setting, of the stretch at which a taut hold is expanded
LEAST_READ = 0.1  # the same, where the first reading says at which
MOST_ERROR = 6.0  # standard deviations of the setting, that a first reading may say it is off by


@dataclass(frozen=True)
class Linearised:
    """A staircase and its first derivatives, all at setting error zero.

    Attributes
    ----------
    reading : (H, R, n)
        N, or mm where the tension is set.
    by_setting, by_creep : (H, R, n)
        Derivative of a hold's readings by its own setting error and by the creep carried into it.
    carry_by_setting, carry_by_creep : (H, n)
        Derivative of the creep carried out, by the same two.
    creep : (H + 1, n)
        Creep elongation carried into each hold, and out of the last.
    edges : Edges or None
        Of holds whose setting error decides whether the wire is taut; None where there are none.
    """

    reading: Array
    by_setting: Array
    by_creep: Array
    carry_by_setting: Array
    carry_by_creep: Array
    creep: Array
    edges: "Edges | None" = None


@dataclass(frozen=True)
class Side:
    """Holds whose wire is known to be taut, or known to be slack: expanded there, and written down at error zero.

    Attributes
    ----------
    reading, by_setting, by_creep : (H, R, n)
        As of a staircase.
    carry : (H, n)
        Creep carried out, mm, less what the staircase carries out.
    carry_by_setting, carry_by_creep : (H, n)
    """

    reading: Array
    by_setting: Array
    by_creep: Array
    carry: Array
    carry_by_setting: Array
    carry_by_creep: Array


@dataclass(frozen=True)
class Edges:
    """Holds whose setting error decides whether the wire is taut.

    Attributes
    ----------
    near : (H, n) bool array
        Which these are; the rest of the arrays counts there alone.
    stretch, stretch_by_setting, stretch_by_creep : (H, n)
        Of the wire beyond its zero-tension length when the hold begins, mm.
    taut, slack : Side
    """

    near: Bools
    stretch: Array
    stretch_by_setting: Array
    stretch_by_creep: Array
    taut: Side
    slack: Side


def simulate(protocol: Protocol, theta: Theta, model: Model = PLAIN, setting_error: Array | None = None) -> Array:
    """Noise-free readings, the setting errors entering exactly.

    Parameters
    ----------
    theta : mapping of name to (n,) array
        ``k1 B U k2 N preload`` and ``effect_name.parameter`` of every effect of the model.
    setting_error : (H, n) array, optional
        Of each hold, in the unit of what is set; zero when left out. May be complex (derivatives).

    Returns
    -------
    (H, R, n) array
        N, or mm where the tension is set.
    """
    n = np.shape(theta["k1"])[0]
    exact = np.zeros((len(protocol.setting), 1))
    if setting_error is not None:
        exact = np.asarray(setting_error)
    call = None if np.iscomplexobj(exact) else compiled.call(protocol, theta, model)
    if call is not None:
        return compiled.kernel.simulate(*call, exact.astype(float))
    walk = Walk(protocol, theta, model)
    creep, beside = walk.begin(n)
    readings = []
    for j, setting in enumerate(protocol.setting[:, None] + exact):
        row, creep, beside = walk.hold(j, setting, creep, beside)
        readings.append(row)
    return np.array(readings)


def simulate_alone(protocol: Protocol, theta: Theta, model: Model = PLAIN) -> list[Array]:
    """Noise-free readings (R, n) of each hold as if there had been none before it.

    Parameters
    ----------
    protocol, theta, model
        As for `simulate`.
    """
    uncrept = np.zeros(len(theta["B"]))
    call = compiled.call(protocol, theta, model)
    if call is not None:
        return list(compiled.kernel.simulate(*call, np.zeros((len(protocol.setting), 1)), True))
    walk = Walk(protocol, theta, model)
    out = []
    for j, setting in enumerate(protocol.setting):
        walk.past = []
        readings, _, _ = walk.hold(j, uncrept + setting, uncrept, {})
        out.append(readings)
    return out


def linearise(protocol: Protocol, theta: Theta, model: Model = PLAIN, read: FirstReadings | None = None) -> Linearised:
    """Readings with their derivatives by setting error and carried creep.

    Of a step test without effects the derivatives are in closed form; others come from a complex step through the same
    code that computes the readings. What effects carry beside the creep is held at its nominal value in them.

    Parameters
    ----------
    theta : mapping of name to (n,) array
        ``k1 B U k2 N preload`` and ``effect_name.parameter`` of every effect of the model; with ``setting_sd`` holds
        are looked at on both sides where such an error may leave the wire slack.
    read : FirstReadings, optional
        What such holds are then expanded about.
    """
    call = compiled.call(protocol, theta, model)
    if call is not None:
        parts, edges = compiled.kernel.linearise(*call, *compiled.at_slack(protocol, theta, read))
        line = Linearised(*parts)
        return line if edges is None else replace(line, edges=_edges_of(*edges))
    by_hand = not model.effects and protocol.control == "displacement"
    kind = ByHand if by_hand else BySteps
    return _walked(kind(protocol, theta, model), read)


def _walked(walk: ByHand | BySteps, read: FirstReadings | None) -> Linearised:
    """One hold after another."""
    creep = walk.brought
    spread = walk.theta.get("setting_sd") if walk.protocol.control == "displacement" else None
    holds: list[LinearHoldWalked] = []
    edges: list[_Edge] = []
    for j, setting in enumerate(walk.protocol.setting):
        hold = walk.linearised(j, setting, creep)
        if spread is not None:
            edges.append(_edge(walk, j, creep, hold, np.abs(spread[: len(creep)]), read))
        creep = hold.carried.value
        holds.append(hold)
    reading, by_setting, by_creep = map(np.array, zip(*(hold.readings for hold in holds), strict=True))
    after, carry_by_setting, carry_by_creep = map(np.array, zip(*(hold.carried for hold in holds), strict=True))
    creeps = np.concatenate([walk.brought[None], after])
    known = _joined(edges) if any(edge.near.any() for edge in edges) else None
    return Linearised(reading, by_setting, by_creep, carry_by_setting, carry_by_creep, creeps, known)


def _edges_of(near: Array, stretch: Array, taut: Array, taut_carry: Array, slack: Array, slack_carry: Array) -> Edges:
    """Those that the compiled staircase has found."""
    value, by_setting, by_creep = stretch
    sides = Side(*taut, *taut_carry), Side(*slack, *slack_carry)
    return Edges(near.view(bool), value, by_setting, by_creep, *sides)


class _Edge(NamedTuple):
    """`Edges` of one hold; a side as its readings, (R, n) each, and the creep carried out, (n,) each."""

    near: Bools
    stretch: Sloped
    taut: tuple[Sloped, Sloped]
    slack: tuple[Sloped, Sloped]


def _edge(
    walk: ByHand | BySteps,
    j: int,
    creep: Array,
    hold: LinearHoldWalked,
    spread: Array,
    read: FirstReadings | None,
) -> _Edge:
    """Whether setting errors of a standard deviation (n,) decide whether the wire is taut, and both sides if so."""
    stretch = hold.stretch.value
    near = (stretch < FAR * spread) & (spread > 0.0)
    as_it_is = hold.readings, hold.carried
    if not near.any():
        return _Edge(near, hold.stretch, as_it_is, as_it_is)
    stretch, spread = np.where(near, stretch, 0.0), np.where(near, spread, 1.0)
    to_taut, to_slack = moves_to_sides(stretch, spread)
    taut = _side(walk, j, creep, hold, to_taut)
    if read is not None:
        closer = nearer_as_read(read, j, taut[0], to_taut, stretch, spread)
        taut = _side(walk, j, creep, hold, closer)
    slack = _side(walk, j, creep, hold, to_slack)
    return _Edge(near, hold.stretch, taut, slack)


def moves_to_sides(stretch: Array, spread: Array) -> tuple[Array, Array]:
    """Setting errors (n,) at which a hold is expanded for a wire that is taut, and for one that is slack, mm.

    The first leads to the mean stretch of a taut wire, or to half a standard deviation where that is less, for creep
    may grow with the tension without bounds at an edge; the second to where nothing pulls.

    Parameters
    ----------
    stretch, spread : (n,) arrays
        Of the wire without setting error, and the standard deviation of that, mm.
    """
    ratio = stretch / spread
    hazard = np.exp(-0.5 * ratio**2 - 0.5 * np.log(2.0 * np.pi) - log_ndtr(ratio))
    to_taut = np.maximum(hazard, LEAST_STRETCH - ratio) * spread
    to_slack = -np.maximum(stretch + spread, 0.0)
    return to_taut, to_slack


def nearer_as_read(read: FirstReadings, j: int, line: Sloped, to_taut: Array, stretch: Array, spread: Array) -> Array:
    """Setting errors (n,) at which a taut hold is expanded, by what its first reading says of them, mm.

    Far from the edge, where holds are expanded at none, this fades out.

    Parameters
    ----------
    read : FirstReadings
    j : int
    line : Sloped of (R, n) arrays
        Readings as expanded at `to_taut`, at no error.
    to_taut, stretch, spread : (n,) arrays
        As for `moves_to_sides`, and what it returned.
    """
    ratio = stretch / spread
    slope = line.by_setting[read.column[j]]
    surprise = read.value[j] - line.value[read.column[j]]
    error = spread**2 * slope / (spread**2 * slope**2 + read.variance) * surprise
    error = np.where(error < MOST_ERROR * spread, error, MOST_ERROR * spread)
    error = np.maximum(error, (LEAST_READ - ratio) * spread)
    share = np.clip(FAR - ratio, 0.0, 1.0)
    return np.where(np.isnan(read.value[j]), to_taut, to_taut + share * (error - to_taut))


def _side(walk: ByHand | BySteps, j: int, creep: Array, hold: LinearHoldWalked, moved: Array) -> tuple[Sloped, Sloped]:
    """Readings of a hold, and creep carried out beyond that of the walk, expanded at setting errors (n,)."""
    found = walk.elsewhere(j, walk.protocol.setting[j] + moved, creep)
    readings = _without_error(found.readings, moved)
    carried = _without_error(found.carried, moved)
    return readings, carried._replace(value=carried.value - hold.carried.value)


def _without_error(x: Sloped, moved: Array) -> Sloped:
    """A line through a value at setting errors (n,), by its value at none."""
    return x._replace(value=x.value - x.by_setting * moved)


def _joined(edges: Sequence[_Edge]) -> Edges:
    """Those of all holds."""
    near = np.array([edge.near for edge in edges])
    stretch, by_setting, by_creep = map(np.array, zip(*(edge.stretch for edge in edges), strict=True))
    taut = _joined_side([edge.taut for edge in edges])
    slack = _joined_side([edge.slack for edge in edges])
    return Edges(near, stretch, by_setting, by_creep, taut, slack)


def _joined_side(sides: Sequence[tuple[Sloped, Sloped]]) -> Side:
    readings = map(np.array, zip(*(readings for readings, _ in sides), strict=True))
    carried = map(np.array, zip(*(carried for _, carried in sides), strict=True))
    return Side(*readings, *carried)


def streamed(
    protocol: Protocol, theta: Theta, model: Model = PLAIN, read: FirstReadings | None = None
) -> "Linearised | Staircases":
    """A staircase for one filter alone: compiled, it is filtered as it is computed, and never written to memory.

    Parameters
    ----------
    protocol, theta, model, read
        As for `linearise`.

    Returns
    -------
    Linearised or Staircases
        The latter where the model is compiled.
    """
    call = compiled.call(protocol, theta, model)
    if call is None:
        return linearise(protocol, theta, model, read)
    return compiled.kernel.Computed(*call, *compiled.at_slack(protocol, theta, read))

"""Holds whose setting error decides whether the wire is taut: the readings on either side, each linear in the error."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import log_ndtr

from wirebayes.numeric.typing import Array, Bools, Ints
from wirebayes.wire.walk import ByHand, BySteps, LinearHoldWalked, Sloped

FAR = 8.0  # standard deviations of the setting: a wire stretched by more is taut whatever its error, to 1e-15
LEAST_STRETCH = 0.5  # standard deviations of the setting, of the stretch at which a taut hold is expanded
LEAST_READ = 0.1  # the same, where the first reading says at which
MOST_ERROR = 6.0  # standard deviations of the setting, that a first reading may say it is off by


class FirstReadings(NamedTuple):
    """The first reading of each hold.

    Values (H, n) or (H, 1), NaN where a hold has none, their columns (H,), and the variance (n,) of a reading.
    """

    value: Array
    column: Ints
    variance: Array


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


class EdgeOfHold(NamedTuple):
    """`Edges` of one hold; a side as its readings, (R, n) each, and the creep carried out, (n,) each."""

    near: Bools
    stretch: Sloped
    taut: tuple[Sloped, Sloped]
    slack: tuple[Sloped, Sloped]


def edge_of_hold(
    walk: ByHand | BySteps,
    j: int,
    creep: Array,
    hold: LinearHoldWalked,
    spread: Array,
    read: FirstReadings | None,
) -> EdgeOfHold:
    """Whether setting errors decide whether the wire is taut, and both sides if so.

    Parameters
    ----------
    walk : ByHand or BySteps
        Which has just walked the hold.
    j : int
    creep, spread : (n,) arrays
        Creep carried into the hold, and the standard deviation of its setting error, mm.
    hold : LinearHoldWalked
        As the walk found it.
    read : FirstReadings or None
    """
    stretch = hold.stretch.value
    near = (stretch < FAR * spread) & (spread > 0.0)
    as_it_is = hold.readings, hold.carried
    if not near.any():
        return EdgeOfHold(near, hold.stretch, as_it_is, as_it_is)
    stretch, spread = np.where(near, stretch, 0.0), np.where(near, spread, 1.0)
    to_taut, to_slack = moves_to_sides(stretch, spread)
    taut = _side(walk, j, creep, hold, to_taut)
    if read is not None:
        closer = nearer_as_read(read, j, taut[0], to_taut, stretch, spread)
        taut = _side(walk, j, creep, hold, closer)
    slack = _side(walk, j, creep, hold, to_slack)
    return EdgeOfHold(near, hold.stretch, taut, slack)


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


def joined_edges(edges: Sequence[EdgeOfHold]) -> Edges | None:
    """The edges of all holds, None where there are none."""
    if not any(edge.near.any() for edge in edges):
        return None
    near = np.array([edge.near for edge in edges])
    stretch, by_setting, by_creep = map(np.array, zip(*(edge.stretch for edge in edges), strict=True))
    taut = _joined_side([edge.taut for edge in edges])
    slack = _joined_side([edge.slack for edge in edges])
    return Edges(near, stretch, by_setting, by_creep, taut, slack)


def _joined_side(sides: Sequence[tuple[Sloped, Sloped]]) -> Side:
    readings = map(np.array, zip(*(readings for readings, _ in sides), strict=True))
    carried = map(np.array, zip(*(carried for _, carried in sides), strict=True))
    return Side(*readings, *carried)


def edges_of(near: Array, stretch: Array, taut: Array, taut_carry: Array, slack: Array, slack_carry: Array) -> Edges:
    """The edges that the compiled staircase has found.

    Parameters
    ----------
    near : (H, n) array of 0 and 1
    stretch : (3, H, n) array
        Value, and slopes by setting error and by carried creep.
    taut, slack : (3, H, R, n) arrays
        Readings on either side, likewise.
    taut_carry, slack_carry : (3, H, n) arrays
        What is carried out, likewise.
    """
    value, by_setting, by_creep = stretch
    sides = Side(*taut, *taut_carry), Side(*slack, *slack_carry)
    return Edges(near.view(bool), value, by_setting, by_creep, *sides)


def as_found(edges: Edges) -> tuple[Array, ...]:
    """What `edges_of` was given, for the compiled filters."""
    near = np.ascontiguousarray(edges.near).view(np.uint8)
    stretch = np.array([edges.stretch, edges.stretch_by_setting, edges.stretch_by_creep])
    return near, stretch, *_readings_and_carry(edges.taut), *_readings_and_carry(edges.slack)


def _readings_and_carry(side: Side) -> tuple[Array, Array]:
    """(3, H, R, n) readings and (3, H, n) what is carried out: values, and slopes by setting error and by creep."""
    readings = np.array([side.reading, side.by_setting, side.by_creep])
    return readings, np.array([side.carry, side.carry_by_setting, side.carry_by_creep])

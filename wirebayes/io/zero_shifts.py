"""Another zero from some hold on: readings that step between two holds by what the other moves do not explain.

A sensor that is zeroed anew takes the same from every reading after it, and so does, nearly, a wire that slips. What a
move adds to the readings changes slowly along the test, so that such a step stands out; one that the next move takes
back is an error of a single setting.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from wirebayes.io.checked_test import CheckedTest
from wirebayes.numeric.typing import Bools, Floats, Ints
from wirebayes.sentences import short

FEWEST = 6  # with fewer moves one way nothing shows what a move usually adds
STANDS_OUT = 4.0  # a step is off by so many times what nine in ten of the other moves are off by
# a step is off by more than this share of what its own move should add and of what the usual move adds; the check of
# the model finds smaller ones
OF_A_MOVE = 0.25
TAKEN_BACK = 0.5  # where a neighbouring move undoes more than this share, a single setting was wrong
BESIDE = 0.5  # where the readings beside those two show less than this share of the step, one of the two is wrong
# a wire with less than this share of the largest reading, or so many noise levels, may be slack
SLACK, NOISE = 0.02, 5.0
LATE = 0.5  # a hold first read later than usual, by this share of the time to its second reading, has crept until then


@dataclass(frozen=True)
class _Moves:
    """Moves between neighbouring holds that go on the way of the move before.

    Attributes
    ----------
    hold : (m,) array of int
        The recorded hold that each leads to.
    added, inner : (m,) arrays
        What it adds to the readings: to the first after the last, and to the one next to either.
    moved, middle : (m,) arrays
        By how much the setting changes, and its middle.
    """

    hold: Ints
    added: Floats
    inner: Floats
    moved: Floats
    middle: Floats

    def off(self, added: Floats) -> Floats:
        """What is added beyond the course: of a unit of a move, a straight line by the medians of Theil and Sen."""
        first, second = np.triu_indices(len(added), 1)
        each = added / self.moved
        apart = self.middle[second] != self.middle[first]
        slopes = (each[second] - each[first])[apart] / (self.middle[second] - self.middle[first])[apart]
        slope = float(np.median(slopes)) if slopes.size else 0.0
        return added - self.moved * (slope * self.middle + np.median(each - slope * self.middle))


class _Shift(NamedTuple):
    """A step that stands out, and by how much; the hold that it leads to, what it adds, what was expected of it."""

    excess: float
    hold: int
    added: float
    expected: float


def zero_shift(readings: CheckedTest) -> str:
    """The step between two holds that stands out most from what the moves beside it add, in a sentence."""
    found = []
    for way in (1.0, -1.0):
        one_way = _shift(_moves(readings, way), readings.noise)
        if one_way is not None:
            found.append(one_way)
    if not found:
        return ""
    shift = max(found)
    what = "tension" if readings.protocol.control == "displacement" else "displacement"
    before = readings.number[shift.hold - 1]
    after = readings.number[shift.hold]
    added = f"{short(shift.added, 3)} {readings.unit}"
    expected = f"{short(shift.expected, 3)} {readings.unit}"
    return (
        f"from hold {before} to hold {after} the {what} changes by {added}, where the other "
        f"moves suggest {expected}, and the difference stays: was the sensor zeroed there, "
        "did the wire slip, or is time or a move not recorded? correct the readings from there on, or leave them out"
    )


def _moves(readings: CheckedTest, way: float) -> _Moves:
    """The moves of one way; a move after a reversal shows friction, and one of a slack wire nothing."""
    moved = np.diff(readings.setting)
    middle = readings.setting[:-1] + 0.5 * moved
    before, after = _about_moves(readings, 0)
    used = _of_one_way(readings, moved, way)
    if readings.protocol.control == "displacement":
        used &= np.minimum(after, before) > slack_below(readings)
    added = after - before
    inner_before, inner_after = _about_moves(readings, 1)
    inner = inner_after - inner_before
    at = np.flatnonzero(used)
    return _Moves(at + 1, added[at], inner[at], moved[at], middle[at])


def _about_moves(readings: CheckedTest, between: int) -> tuple[Floats, Floats]:
    """Readings before and after every move, so many others between; where a hold has fewer, its farthest."""
    before = np.array([row[-1 - between :][0] for row in readings.each[:-1]])
    after = np.array([row[: 1 + between][-1] for row in readings.each[1:]])
    return before, after


def _of_one_way(readings: CheckedTest, moved: Floats, way: float) -> Bools:
    """Moves of one way that follow another such, between recorded holds of which the latter is read in time."""
    this_way = np.sign(moved) == way
    after_such = np.concatenate([[True], this_way[:-1]])
    numbers = np.flatnonzero(readings.protocol.recorded)
    adjoining = np.diff(numbers) == 1
    late = _late(readings)[1:]
    return this_way & after_such & adjoining & ~late


def slack_below(readings: CheckedTest) -> float:
    """Tension, N, with no more than which a wire may be slack."""
    first = max(float(row[0]) for row in readings.each)
    return max(SLACK * first, NOISE * readings.noise)


def _late(readings: CheckedTest) -> Bools:
    """Recorded holds that are first read later than usual."""
    first_s = np.array([times[0] for times in readings.times_s])
    until_second_s = np.median([times[1] - times[0] for times in readings.times_s if len(times) > 1] or [0.0])
    return first_s - np.median(first_s) > LATE * until_second_s


def _shift(moves: _Moves, noise: float) -> _Shift | None:
    """The step that stands out most; None where none does."""
    added = moves.added
    if len(added) < FEWEST:
        return None
    off = moves.off(added)
    inner = moves.off(moves.inner)
    sizes = np.abs(off)
    expected = added - off
    scatter = _scatter(added, sizes, noise)
    usual = float(np.median(np.abs(added)))
    of_a_move = np.maximum(usual, np.abs(expected))
    large = sizes > OF_A_MOVE * of_a_move
    found = []
    for i in np.flatnonzero(large).tolist():
        others = float(np.quantile(np.delete(sizes, i), 0.9))
        excess = float(sizes[i] / max(others, scatter))
        if excess > STANDS_OUT and _stays(moves.hold, off, inner, i):
            hold = int(moves.hold[i])
            found.append(_Shift(excess, hold, float(added[i]), float(expected[i])))
    return max(found, default=None)


def _stays(holds: Ints, off: Floats, inner: Floats, i: int) -> bool:
    """Whether a step is neither taken back by the moves beside it nor one of a single reading.

    Parameters
    ----------
    holds : (m,) array of int
        To which the moves lead.
    off, inner : (m,) array
        What each adds beyond the course, by the readings beside it and by those one further on.
    i : int
        The move.
    """
    size, sign = abs(off[i]), np.sign(off[i])
    beside = np.abs(holds - holds[i]) == 1
    taken_back = (-sign * off[beside]).max(initial=0.0)
    return bool(taken_back <= TAKEN_BACK * size and sign * inner[i] >= BESIDE * size)


def _scatter(added: Floats, sizes: Floats, noise: float) -> float:
    """The standard deviation of moves about their course: that of the middle ones, no less than that of the noise."""
    rounding = float(np.finfo(float).eps * np.abs(added).max())
    return max(float(np.median(sizes)) / 0.6745, float(np.sqrt(2.0) * noise), rounding)

"""Readings as a bench recorded them, and as holds: what the steps of an import hand on."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from wirebayes.errors import InputError
from wirebayes.io.bench.quantities import UNITS
from wirebayes.numeric.typing import Array, Bools, Floats, Ints
from wirebayes.result_warnings import Notice

Complain = Callable[[int, str, str, str], InputError]  # row, role, found, expected
Rows = Ints

CONTINUOUS = 30  # readings of the usual hold that nobody writes by hand
PAUSE = 1.5  # of the usual interval between readings: a longer one is a pause in the recording
STEADY = 0.25  # of the smallest step: less scatter in a hold is the encoder's
BEGUN_BEFORE = (
    "if it had begun seconds before, fit with --effect late_clock, which estimates how many: without it k2 and N would "
    "be wrong"
)


@dataclass(frozen=True)
class HoldClock:
    """A clock that starts again with each hold, beside one of the whole test.

    Attributes
    ----------
    time_s : (r,) array
        Since each hold began.
    tick_s : float
        To which the clock of the test is written.
    name, of_test : str
        What the file calls it, and the clock of the test.
    """

    time_s: Floats
    tick_s: float
    name: str
    of_test: str


@dataclass(frozen=True)
class Readings:
    """Columns of numbers as a bench recorded them, in our units.

    Attributes
    ----------
    role : {"displacement", "tension"}
        What was set.
    setting, read, time_s : (r,) array
        What was set, what was read, and when.
    hold : (r,) array of int or None
    of_day : bool
        Whether times are moments of a day, which restart nowhere.
    step, time_name : float, str
        To what the setting was rounded, 0 where it is not known; what the file calls the time.
    complain : function
        Makes the error of a cell.
    hold_clock : HoldClock or None
        Where times of each hold stand beside those of the test.
    """

    role: Literal["displacement", "tension"]
    setting: Floats
    read: Floats
    time_s: Floats
    hold: Ints | None
    of_day: bool
    step: float
    time_name: str
    complain: Complain
    hold_clock: HoldClock | None = None

    @property
    def unit(self) -> str:
        """The unit of the setting."""
        return UNITS[self.role]


@dataclass(frozen=True)
class Cycles:
    """Loading and unloading before a hold.

    Attributes
    ----------
    before_hold : int
    setting : float
        At which a hold as long would have made the wire creep as much.
    begin_s, end_s : float
        On the clock of the recording.
    sentence : str
        What was recorded and what is made of it.
    """

    before_hold: int
    setting: float
    begin_s: float
    end_s: float
    sentence: str


@dataclass(frozen=True)
class Cut:
    """Readings cut into holds.

    Attributes
    ----------
    rows : list of (k,) arrays of int
        Of each hold.
    number : list of int
    setting : list of float
        The displacement or the tension that was set.
    time_s : list of (k,) arrays
        Since the hold began.
    end_s : list of float or None
        When the hold ended, since it began; None where the recording does not say.
    of_test : bool
        Whether the file counts time from the beginning of the test.
    notes : list of str
        What was done, in sentences.
    clock_s : (r,) array
        Times of all rows as they were read, pieces of a recording joined.
    warnings : tuple of Notice
        What of the recording has no place in holds.
    unread : frozenset of int
        Numbers of holds of which no reading is used.
    cycles : tuple of Cycles
    """

    rows: list[Ints]
    number: list[int]
    setting: list[float]
    time_s: list[Floats]
    end_s: list[float | None]
    of_test: bool
    notes: list[str]
    clock_s: Floats
    warnings: tuple[Notice, ...] = ()
    unread: frozenset[int] = frozenset()
    cycles: tuple[Cycles, ...] = ()


def restarts(readings: Readings) -> Bools:
    """Where a clock that counts from a beginning starts again."""
    falls = np.concatenate([[False], np.diff(readings.time_s) < 0])
    return falls & (not readings.of_day)


def changes(values: Array) -> Bools:
    """Where a value is another than the one before."""
    return np.concatenate([[False], np.diff(values) != 0])


def groups_between(border: Bools) -> list[Rows]:
    """The rows between borders; each is the first row of a group."""
    rows = np.arange(len(border))
    ends = [0, *np.flatnonzero(border).tolist(), len(border)]
    return [rows[begin:end] for begin, end in pairwise(ends)]


def is_continuous(groups: Sequence[Rows]) -> bool:
    """Whether groups have more readings than anybody writes by hand."""
    return float(np.median([len(rows) for rows in groups])) >= CONTINUOUS


def usual_size(groups: Sequence[Rows]) -> float:
    """How many readings the hold of the usual reading has."""
    sizes = [len(rows) for rows in groups]
    return float(np.median(np.repeat(sizes, sizes)))


def wanders(x: Floats, groups: Sequence[Rows], steady: float = STEADY) -> bool:
    """Whether a setting changes within a hold by more than a measured one scatters.

    Parameters
    ----------
    x : (r,) array
        What was set.
    groups : sequence of Rows
        Of each hold.
    steady : float
        The share of the smallest step by which it may scatter.
    """
    within = max((float(np.ptp(x[rows])) for rows in groups if len(rows) > 1), default=0.0)
    levels = [float(x[rows[0]] if len(rows) == 1 else np.median(x[rows])) for rows in groups]  # a recording has many
    steps = np.abs(np.diff(levels))
    steps = steps[steps > within]
    return within > 0 and (not len(steps) or within > steady * float(steps.min()))


def level_of(x: Floats) -> float:
    """The median of displacements of one hold, with the digits that its standard error leaves."""
    level, error = float(np.median(x)), float(np.std(x)) / np.sqrt(len(x))
    digits = 6 if error == 0.0 else int(np.clip(1 - np.floor(np.log10(error)), 0, 6))
    return round(level, digits) + 0.0

"""A clock of each hold beside a clock of the test: the one says when holds began, the other when they ended."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wirebayes.errors import InputError
from wirebayes.io.bench.clock import are_moments, is_clock
from wirebayes.io.bench.columns import Column, Columns, column_as
from wirebayes.io.bench.header import is_of
from wirebayes.io.bench.mapping import ignored
from wirebayes.io.bench.recorded import HoldClock, Rows
from wirebayes.io.bench.table import RawTable
from wirebayes.io.bench.two_clocks import Clock, clock_of, parting
from wirebayes.numeric.typing import Floats


@dataclass(frozen=True)
class TwoClocks:
    """What two columns of time say together.

    Attributes
    ----------
    time_s : (r,) array
        By the clock of the test.
    of_day : bool
        Whether they are moments of a day.
    of_holds : HoldClock
    beside : Column
        The one of the two that was not read for the time.
    """

    time_s: Floats
    of_day: bool
    of_holds: HoldClock
    beside: Column


def two_clocks(table: RawTable, columns: Columns, mapping: Sequence[str], *, of_day: bool) -> TwoClocks | None:
    """The clock of the test and that of its holds, where a table has both and they agree within holds; else None.

    Parameters
    ----------
    table : RawTable
    columns : dict of Role to Column
        Those that are read.
    mapping : sequence of str
        What the user says of columns.
    of_day : bool
        Whether the time that is read is one of moments of a day.
    """
    read = columns["time"]
    clock = _clock(table, read)
    if clock is None:
        return None
    taken = {column.index for column in columns.values()} | ignored(table, mapping)
    for i, name in enumerate(table.header):
        if not name or i in taken or not (is_of(table, i, "time") or are_moments(table, i)):
            continue
        column = _column(table, i)
        other = None if column is None else _clock(table, column)
        if column is None or other is None:
            continue
        if clock.restarts and _tell_more_together(clock, other):
            of_holds = HoldClock(clock.time_s, other.tick_s, read.header, column.header)
            return TwoClocks(other.time_s, is_clock(table, i, column.unit), of_holds, column)
        if other.restarts and _tell_more_together(other, clock):
            of_holds = HoldClock(other.time_s, clock.tick_s, column.header, read.header)
            return TwoClocks(clock.time_s, of_day, of_holds, column)
    return None


def _tell_more_together(of_holds: Clock, of_test: Clock) -> bool:
    """Whether a clock that starts again and one that does not agree, each fine enough to show it in every hold."""
    steps = np.diff(of_holds.time_s)
    begins = np.flatnonzero(np.concatenate([[True], steps < 0.0]))
    ends = np.append(begins[1:], len(of_holds.time_s))
    passed = of_holds.time_s[ends - 1] - of_holds.time_s[begins]
    shortest = float(passed[ends - begins > 1].min(initial=np.inf))
    rises = bool((steps != 0.0).all()) and not of_test.restarts
    return rises and of_test.tick_s <= shortest and parting(of_holds, of_test) is None


def _column(table: RawTable, index: int) -> Column | None:
    """A column as one of time; None where its unit is not known."""
    try:
        return column_as(table, index, "time")
    except InputError:
        return None


def _clock(table: RawTable, column: Column) -> Clock | None:
    """The times of a column; None where they leave something open."""
    try:
        return clock_of(table, column.index, column.unit)
    except InputError:
        return None


def by_both(groups: Sequence[Rows], time_s: Floats, clock: HoldClock) -> tuple[list[Floats], list[float]] | None:
    """Times since each hold began, and when it began on the clock of the test; None where the clocks disagree.

    Parameters
    ----------
    groups : sequence of (k,) arrays of int
        The rows of each hold.
    time_s : (r,) array
        By the clock of the test.
    clock : HoldClock
    """
    times, begins = [], []
    last_s = -np.inf
    for rows in groups:
        since = clock.time_s[rows]
        begin = float(time_s[rows[0]] - since[0])
        if since[0] < 0.0 or begin < last_s - clock.tick_s:  # it does not count from the beginning of this hold
            return None
        begin = max(begin, last_s)
        last_s = begin + float(since[-1])
        times.append(since)
        begins.append(begin)
    return times, begins

"""Two columns of time in one file: compared, so that one is read where both tell the same."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wirebayes.errors import InputError
from wirebayes.io.bench.clock import is_clock, seconds
from wirebayes.io.bench.dates import UndecidedDates
from wirebayes.io.bench.quantities import Unit
from wirebayes.io.bench.table import RawTable
from wirebayes.numeric.typing import Floats

TICKS_S = (60.0, 1.0, 0.1, 0.01, 0.001)  # what clocks are written to
ROUNDING_S = 1e-6  # of times over a month
SAME_RATE = 1e-3  # of the time that has passed: a quartz is a hundred times better


@dataclass(frozen=True)
class Clock:
    """A column of times.

    Attributes
    ----------
    time_s : (r,) array
    tick_s : float
        The step to which they are written.
    """

    time_s: Floats
    tick_s: float

    @property
    def restarts(self) -> bool:
        """Whether it starts again somewhere."""
        return bool((np.diff(self.time_s) < 0).any())


def clock_of(table: RawTable, column: int, unit: Unit | None) -> Clock | None:
    """A column as far as it can be read without knowing the file's decimal sign; else None.

    Parameters
    ----------
    unit : Unit or None
        None for clocks and dates.

    Raises
    ------
    UndecidedDates
        Its dates may begin with the day or with the month.
    """
    try:
        if is_clock(table, column, unit):
            time_s, _, _ = seconds(table, column, unit)
            return Clock(time_s, _tick_s(time_s))
        cells = [cell.replace(",", ".") for cell in table.column(column)]
        values = np.array([float(cell) for cell in cells])
    except UndecidedDates:  # to read another column in its place would lose the days
        raise
    except (InputError, ValueError):
        return None
    places = 0
    for cell in cells:
        _, _, fraction = cell.partition(".")
        places = max(places, len(fraction))
    factor = 1.0 if unit is None else unit.factor
    tick_s = abs(factor) * 10.0**-places
    return Clock(values * factor, tick_s)


def _tick_s(time_s: Floats) -> float:
    """The largest step of which all times of a clock are multiples: a minute, a second or a fraction of one."""
    return next((tick for tick in TICKS_S if np.abs(time_s - tick * np.round(time_s / tick)).max() < ROUNDING_S), 0.0)


def parting(first: Clock, second: Clock) -> int | None:
    """The first row at which two clocks have run apart, since one of them started again; None where they agree."""
    a, b = first.time_s, second.time_s
    starts = np.concatenate([[True], (np.diff(a) < 0) | (np.diff(b) < 0)])
    begin = np.maximum.accumulate(np.where(starts, np.arange(len(starts)), 0))
    passed_a, passed_b = a - a[begin], b - b[begin]
    allowed = 1.01 * max(first.tick_s, second.tick_s) + SAME_RATE * np.maximum(passed_a, passed_b)
    rows = np.flatnonzero(np.abs(passed_a - passed_b) > allowed)
    return int(rows[0]) if len(rows) else None


def best_clock(clocks: Sequence[Clock]) -> int:
    """Which of several clocks that agree is read: one that never starts again, then the one of the finest step."""
    return min(range(len(clocks)), key=lambda i: (clocks[i].restarts, clocks[i].tick_s))

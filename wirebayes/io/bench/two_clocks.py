"""Two columns of time in one file: compared, so that one is read where both tell the same."""

from collections.abc import Sequence

import numpy as np

from wirebayes.errors import InputError
from wirebayes.io.bench.clock import has_moments, seconds
from wirebayes.io.bench.quantities import Unit
from wirebayes.io.bench.table import RawTable
from wirebayes.typing import Floats

SAME_RATE = 1e-3  # of the time that has passed: a quartz is a hundred times better, a rounded unit is not


def times_of(table: RawTable, column: int, unit: Unit | None) -> Floats | None:
    """Times of a column in s, as far as they can be read without knowing the file's decimal sign; else None."""
    try:
        if has_moments(table, column):
            return seconds(table, column, unit)[0]
        values = np.array([float(cell.replace(",", ".")) for cell in table.column(column)])
    except (InputError, ValueError):
        return None
    return values * (1.0 if unit is None else unit.factor)


def parting(first: Floats, second: Floats) -> int | None:
    """The first row at which two clocks have run apart, since one of them started again; None where they agree."""
    starts = np.concatenate([[True], (np.diff(first) < 0) | (np.diff(second) < 0)])
    begin = np.maximum.accumulate(np.where(starts, np.arange(len(starts)), 0))
    passed = first - first[begin], second - second[begin]
    ticks = max(_tick(first), _tick(second))
    apart = np.abs(passed[0] - passed[1]) > ticks * (1.0 + 1e-9) + SAME_RATE * np.maximum(*passed)
    rows = np.flatnonzero(apart)
    return int(rows[0]) if len(rows) else None


def finest(clocks: Sequence[Floats]) -> int:
    """Which of several clocks that agree is read: one that never starts again, then the one of the smallest step."""
    return min(range(len(clocks)), key=lambda i: (bool((np.diff(clocks[i]) < 0).any()), _tick(clocks[i])))


def _tick(times: Floats) -> float:
    """The smallest step of a clock."""
    steps = np.diff(times)
    return float(steps[steps > 0].min(initial=np.inf)) if (steps > 0).any() else 0.0

"""Rows that stand in another order than they were read in."""

import numpy as np

from wirebayes.io.bench.recorded import Readings
from wirebayes.numeric.typing import Array, Ints

BACKWARDS = 0.5  # of the steps in time: holds of two readings or more whose times start again fall at fewer
LATE = 3.0  # times the least time between readings: no clock that starts again begins so long after its first beginning
ALIKE = 1.1  # times what is passed in the order of the file: a measured setting scatters in any order


def check_row_order(readings: Readings) -> None:
    """Refuse rows with the newest first, and rows whose times tell another order in which the setting moves no more.

    Raises
    ------
    InputError
        With the first row that does not stand in its place.
    """
    _check_newest_last(readings)
    time = readings.time_s
    steps = np.diff(time, prepend=time[0])
    closest = steps[steps > 0.0].min(initial=np.inf)
    amid = np.flatnonzero((steps < 0.0) & (time > time[0] + LATE * closest))
    if not len(amid):
        return
    order = np.argsort(time, kind="stable")
    if _are_one_clock(readings, order) and _moves_no_more(readings, order):
        row = int(amid[0])
        found = f"{time[row]:g} s after {time[row - 1]:g} s, a time amid those above"
        expected = (
            "rows in the order of time, the oldest first; if a clock was started again, shift times from there on"
        )
        raise readings.complain(row, "time", found, expected)


def _check_newest_last(readings: Readings) -> None:
    """Refuse rows whose newest reading stands first: each would become a hold of its own."""
    time = readings.time_s
    steps = np.arange(1, len(time))
    if readings.hold is not None:  # holds of one reading each may last ever shorter
        steps = steps[np.diff(readings.hold) == 0]
    falling = steps[time[steps] < time[steps - 1]]
    if len(falling) > BACKWARDS * len(steps):
        row = int(falling[0])
        found = f"{time[row]:g} s after {time[row - 1]:g} s, and times that fall in {len(falling)} of {len(steps)} rows"
        raise readings.complain(row, "time", found, "rows in the order of time, the oldest first; turn them round")


def _are_one_clock(readings: Readings, order: Ints) -> bool:
    """Whether no two rows have the same time, other than rows that were written twice."""
    time, x, read = (column[order] for column in (readings.time_s, readings.setting, readings.read))
    same_time = np.diff(time) == 0.0
    same_row = same_time & (np.diff(x) == 0.0) & (np.diff(read) == 0.0)
    return bool(np.all(same_row[same_time]))


def _moves_no_more(readings: Readings, order: Ints) -> bool:
    """Whether settings, and numbers of holds, change no more in an order of the rows than in that of the file."""
    columns: list[Array] = [readings.setting]
    if readings.hold is not None:
        columns.append(readings.hold)
    for column in columns:
        passed = np.abs(np.diff(column)).sum()
        in_order = np.abs(np.diff(column[order])).sum()
        if in_order > ALIKE * passed:
            return False
    return True

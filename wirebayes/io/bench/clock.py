"""Times as seconds: plain numbers in a unit, clocks (m:ss, h:mm:ss), dates with clocks; midnight passes."""

import re
from datetime import date

import numpy as np
from numpy.typing import NDArray

from wirebayes.errors import InputError
from wirebayes.io.bench.quantities import Unit
from wirebayes.io.bench.sheet import is_moment
from wirebayes.io.bench.table import RawTable
from wirebayes.io.bench.undecided import Undecided
from wirebayes.io.readings import shown

_CLOCK = re.compile(r"(\d{1,12}):(\d{1,2})(?::(\d{1,2}))?(?:[.,](\d+))?")
_DAY = 86400.0
_MIDNIGHT = 0.5 * _DAY  # a fall larger than this is a new day


def has_moments(table: RawTable, column: int) -> bool:
    """Whether a column holds clocks or dates."""
    return any(is_moment(cell) for cell in table.column(column))


def seconds(table: RawTable, column: int, unit: Unit | None) -> tuple[NDArray[np.float64], bool]:
    """Times of a column of clocks or dates.

    Parameters
    ----------
    table : RawTable
    column : int
    unit : Unit or None
        Where the header says how clocks are written.

    Returns
    -------
    time_s : (r,) array
    of_day : bool
        Whether they are moments of a calendar or a clock on the wall, so that nothing restarts.

    Raises
    ------
    InputError
        A cell is no clock; `Undecided` where ``a:b`` may be minutes or hours.
    """
    days, clocks = [], []
    for row in table.rows:
        cell = row.cell(column)
        day, _, clock = cell.replace("T", " ").rpartition(" ") if is_moment(cell) and len(cell) > 10 else ("", "", cell)
        days.append(_day(table, row.line, column, day.strip()) if day else 0.0)
        found = _CLOCK.fullmatch(clock)
        if not found:
            raise table.complain(row.line, column, shown(cell), "a time such as 0:01:30, as in the lines before")
        clocks.append(found)
    short = next((i for i, m in enumerate(clocks) if m[3] is None), None)
    leading = 3600.0
    if short is not None:
        leading = _leading(table, column, unit, short, any(m[4] for m in clocks if m[3] is None))
    values = np.array([_value(m, leading) for m in clocks])
    if any(days):
        return np.array(days) + values - days[0], True
    of_day = short is None and values[0] >= 3600.0
    falls = np.concatenate([[False], np.diff(values) < -_MIDNIGHT])
    return values + _DAY * np.cumsum(falls), of_day


def _value(found: re.Match[str], leading: float) -> float:
    fraction = float(f"0.{found[4]}") if found[4] else 0.0
    if found[3] is not None:
        return 3600.0 * int(found[1]) + 60.0 * int(found[2]) + int(found[3]) + fraction
    return leading * int(found[1]) + leading / 60.0 * int(found[2]) + fraction


def _leading(table: RawTable, column: int, unit: Unit | None, row: int, fractions: bool) -> float:
    """Seconds of one of the first part of ``a:b``."""
    if unit is not None and unit.clock in (60.0, 3600.0):
        return unit.clock
    if fractions:
        return 60.0
    name = table.header[column]
    raise Undecided(
        f"{table.sheet.path}, {table.place(table.rows[row].line, column)}: found {table.rows[row].cell(column)!r}, "
        "which is minutes and seconds or hours and minutes",
        "which",
        {f"--map {name}=time [mm:ss]": "minutes and seconds", f"--map {name}=time [hh:mm]": "hours and minutes"},
    )


def _day(table: RawTable, line: int, column: int, text: str) -> float:
    parts = [int(part) for part in re.split(r"[-./]", text)]
    try:
        if "-" in text:
            return date(*parts).toordinal() * _DAY
        if "/" in text and parts[0] <= 12 and parts[1] <= 12 and parts[0] != parts[1]:
            days = {row.cell(column).partition(" ")[0] for row in table.rows}
            if len(days) > 1:
                raise table.complain(line, column, repr(text), "a date such as 2024-05-31, which has one reading only")
        day, month = (parts[0], parts[1]) if "." in text or parts[0] > 12 else (parts[1], parts[0])
        return date(parts[2] if parts[2] > 99 else 2000 + parts[2], month, day).toordinal() * _DAY
    except InputError:
        raise
    except ValueError:
        raise table.complain(line, column, repr(text), "a date such as 2024-05-31") from None

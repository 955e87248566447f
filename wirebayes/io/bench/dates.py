"""Dates as seconds: the day or the month may come first."""

import re
from collections.abc import Sequence
from datetime import date

import numpy as np

from wirebayes.io.bench.quantities import Unit
from wirebayes.io.bench.sheet import MONTHS
from wirebayes.io.bench.table import RawTable
from wirebayes.io.bench.undecided import Undecided
from wirebayes.numeric.typing import Floats

_Moments = Sequence[re.Match[str]]  # the parts of each cell
_DAY = 86400.0
_LAST_MONTH = 12  # a larger number in a date is a day


class UndecidedDates(Undecided):
    """Dates may begin with the day or with the month."""


def days_s(table: RawTable, column: int, moments: _Moments, unit: Unit | None) -> Floats:
    """Seconds from the beginning of the calendar to each date.

    Parameters
    ----------
    table : RawTable
    column : int
    moments : sequence of n matches
        The parts of each cell.
    unit : Unit or None
        What the header says of the column.

    Returns
    -------
    (n,) array

    Raises
    ------
    InputError
        A date is none of the calendar.
    UndecidedDates
        Nothing says whether dates begin with the day or with the month.
    """
    stated = None if unit is None or unit.clock is None else unit.clock.day_first
    day_first = _day_first(table, column, moments) if stated is None else stated
    days = []
    for row, found in zip(table.rows, moments, strict=True):
        year, month, day = _date_parts(found, day_first)
        full_year = year if year > 99 else 2000 + year
        try:
            days.append(date(full_year, month, day).toordinal() * _DAY)
        except ValueError:
            raise table.complain(row.line, column, repr(found["date"]), "a date such as 2024-05-31") from None
    return np.array(days)


def _date_parts(found: re.Match[str], day_first: bool) -> list[int]:
    """Year, month and day of a date."""
    text = found["date"]
    if found["compact"]:
        year, month, day = text[:4], text[4:6], text[6:]
        return [int(year), int(month), int(day)]
    parts = re.split(r"[-./ ]+", text)
    if found["named"]:
        day, name, year = parts
        month_number = MONTHS[name[:3].lower()]
        return [int(year), month_number, int(day)]
    numbers = [int(part) for part in parts]
    if not found["year_last"]:
        return numbers
    if day_first or "." in text:
        return numbers[::-1]
    month, day, year = numbers
    return [year, month, day]


def _day_first(table: RawTable, column: int, moments: _Moments) -> bool:
    """Whether days stand before months between slashes or dashes: a number above 12 decides for the whole column.

    Dates between points are written in countries that begin with the day. Where nothing decides and there are several
    dates, the time between them is not known.
    """
    rows: dict[str, int] = {}
    for i, found in enumerate(moments):
        if found["year_last"] and "." not in found["date"]:
            rows.setdefault(found["date"], i)
    unclear = []
    first_numbers, second_numbers = [], []
    for text, row in rows.items():
        first, second = [int(part) for part in re.split(r"[-/]", text)[:2]]
        first_numbers.append(first)
        second_numbers.append(second)
        if first != second:
            unclear.append(row)
    if max(second_numbers, default=0) > _LAST_MONTH:
        return False
    if max(first_numbers, default=0) > _LAST_MONTH:
        return True
    if unclear and len(rows) > 1:
        row = min(unclear)
        where = table.where(table.rows[row].line, column)
        found_date = f"found {moments[row]['date']!r}, which may begin with the day or with the month"
        map_to = f"--map {table.header[column]}=time"
        answers = {f"{map_to} [dd/mm/yyyy]": "with the day", f"{map_to} [mm/dd/yyyy]": "with the month"}
        raise UndecidedDates(f"{where}: {found_date}", "which", answers)
    return True

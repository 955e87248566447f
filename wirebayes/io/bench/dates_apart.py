"""Dates, or numbers of days, in a column of their own beside clocks: a day that passes is then no guess."""

import re
from collections.abc import Sequence
from dataclasses import replace
from datetime import date, timedelta
from itertools import pairwise

from wirebayes.io.bench.clock import are_moments
from wirebayes.io.bench.compound_times import is_spelt
from wirebayes.io.bench.header import is_of, name_and_unit
from wirebayes.io.bench.quantities import quantity_unit
from wirebayes.io.bench.sheet import moment
from wirebayes.io.bench.table import RawTable
from wirebayes.io.bench.undecided import TimeSince
from wirebayes.io.bench.words import plain_letters

_DAY = {"day", "days", "tag", "jour", "dia", "giorno", "dag", "day no", "tag nr", "jour no"}
_FIRST_DAY = date(2001, 1, 1)  # whatever it was: days are counted
_DIGITS = 3  # of the number of a day: no test lasts for years
_YEAR_LAST = re.compile(r"(\d{1,2})[/-](\d{1,2})[/-](\d{2,4})")
_WITH_POINTS = re.compile(r"(\d{1,2})\.(\d\d)\.(\d\d)(?:[.,]\d+)?")
_HOURS, _MINUTES, _MONTHS = 24, 60, 12
_HALF_A_DAY = 12  # hours: a clock of the day that begins anew has gone beyond
_MIDNIGHT = "00:00:00"  # what spreadsheets add to a date


def with_dates(table: RawTable, time_since: TimeSince | None) -> RawTable:
    """The table with each date before its clock, unless clocks are durations, which no date places.

    Parameters
    ----------
    table : RawTable
    time_since : {"hold", "test"} or None
        What the user says that times count from.
    """
    table = _with_colons(table)
    clocks = [i for i, name in enumerate(table.header) if name and _are_clocks(table, i)]
    dates = [i for i, name in enumerate(table.header) if name and _are_dates(table, i)]
    of_time = [i for i in range(len(table.header)) if _tells_time(table, i)]
    of_days = len(dates) == 1 and 2 * len(set(table.column(dates[0]))) > len(table.rows)
    if of_days and not clocks and set(of_time) <= set(dates):
        return _at_midnight(table, dates[0])
    if time_since == "hold" or any(_count_from_zero(table, i) for i in clocks):
        return table
    return dated(table)


def _with_colons(table: RawTable) -> RawTable:
    """The table with colons in clocks whose parts stand between points, as 11.50.00: no dates have them all."""
    columns = {i for i, name in enumerate(table.header) if name and _have_points(table.column(i))}
    if not columns:
        return table
    rows = []
    for row in table.rows:
        cells = [cell.replace(".", ":", 2) if i in columns else cell for i, cell in enumerate(row.cells)]
        rows.append(replace(row, cells=tuple(cells)))
    return replace(table, rows=tuple(rows))


def _have_points(cells: Sequence[str]) -> bool:
    """Whether cells are clocks with points: one at least has a second number that no month has."""
    found = [_WITH_POINTS.fullmatch(cell) for cell in cells if cell]
    parts = [[int(part) for part in match.groups()] for match in found if match is not None]
    if not parts or len(parts) < len(found):
        return False
    are_clocks = all(hour < _HOURS and max(minute, second) < _MINUTES for hour, minute, second in parts)
    return are_clocks and max(minute for _, minute, _ in parts) > _MONTHS


def _tells_time(table: RawTable, column: int) -> bool:
    """Whether a column may be a time or a part of one, as one of hours beside dates."""
    is_counted = quantity_unit(table.header[column], "time") is not None
    return is_counted or is_of(table, column, "time") or are_moments(table, column)


def _at_midnight(table: RawTable, column: int) -> RawTable:
    """The table with dates as moments, where nothing else tells the time: a reading a day, at the same hour."""
    rows, last = [], ""
    for row in table.rows:
        last = row.cell(column).removesuffix(_MIDNIGHT).strip() or last
        cells = [f"{last} 00:00" if i == column and any(row.filled) else cell for i, cell in enumerate(row.cells)]
        rows.append(replace(row, cells=tuple(cells)))
    sheet = table.sheet.also("dates without times")
    return replace(table, sheet=sheet, rows=tuple(rows))


def dated(table: RawTable) -> RawTable:
    """The table with each date before its clock, if one column holds dates alone and one other clocks alone.

    An empty cell has the date of the line above, as in merged cells.

    Parameters
    ----------
    table : RawTable
    """
    named = [i for i, name in enumerate(table.header) if name]
    clocks = [i for i in named if _are_clocks(table, i)]
    dates = [i for i in named if _are_dates(table, i)]
    are_days = not dates
    if are_days:
        dates = [i for i in named if _are_days(table, i)]
    if len(dates) != 1 or len(clocks) != 1:
        return table
    (of_date,) = dates
    (of_clock,) = clocks
    day_first = _stated_order(table.header[of_date])
    rows = []
    last = ""
    for row in table.rows:
        written = row.cell(of_date).removesuffix(_MIDNIGHT).strip()
        last = _without_doubt(written, day_first=day_first) or last
        of_row = last
        if are_days:
            of_row = str(_FIRST_DAY + timedelta(days=int(last)))
        cells = list(row.cells)
        clock = row.cell(of_clock)
        if clock:
            cells[of_clock] = f"{of_row} {clock}"
        rows.append(replace(row, cells=tuple(cells)))
    header = [*table.header]
    sheet = table.sheet.also(f"{'days' if are_days else 'dates'} from {header[of_date]!r}")
    header[of_date] = ""
    return replace(table, sheet=sheet, header=tuple(header), rows=tuple(rows))


def _stated_order(header: str) -> bool | None:
    """Whether a header says that dates begin with the day; None where it says nothing of it."""
    _, unit = name_and_unit(header, "time")
    return None if unit is None or unit.clock is None else unit.clock.day_first


def _without_doubt(written: str, *, day_first: bool | None) -> str:
    """A date as one that leaves no doubt, where its header says what it begins with."""
    found = _YEAR_LAST.fullmatch(written)
    if found is None or day_first is None:
        return written
    first, second, year = found.groups()
    return f"{first}.{second}.{year}" if day_first else f"{second}.{first}.{year}"


def _are_dates(table: RawTable, column: int) -> bool:
    """Whether a column holds dates without times, the first row one of them."""
    cells = table.column(column)
    return bool(cells and cells[0]) and all(_is_date(cell) for cell in cells if cell)


def _is_date(cell: str) -> bool:
    found = moment(cell.removesuffix(_MIDNIGHT).strip())
    return found is not None and bool(found["date"]) and not found["first"]


def _are_days(table: RawTable, column: int) -> bool:
    """Whether a column numbers days: its name says so, and its numbers rise by a few at a time, if they do."""
    cells = [cell for cell in table.column(column) if cell]
    if plain_letters(table.header[column]) not in _DAY or not table.rows[0].cell(column):
        return False
    if not all(cell.isdecimal() and len(cell) <= _DIGITS for cell in cells):
        return False
    return all(int(after) >= int(before) for before, after in pairwise(cells))


def _count_from_zero(table: RawTable, column: int) -> bool:
    """Whether clocks begin at zero, and anew long before a day is over, as durations of holds do."""
    clocks = [m for cell in table.column(column) if (m := moment(cell)) is not None and m["first"]]
    hours = [int(clock["first"]) for clock in clocks]
    zeros = [_is_zero(clock) for clock in clocks]
    begins = [i for i in range(len(clocks)) if i == 0 or hours[i] < hours[i - 1]]
    return bool(clocks) and max(hours) < _HALF_A_DAY and all(zeros[i] for i in begins) and not all(zeros)


def _is_zero(clock: re.Match[str]) -> bool:
    return not clock[0].strip("0:., ")


def _are_clocks(table: RawTable, column: int) -> bool:
    """Whether a column holds clocks without dates, but for empty cells and words."""
    found = [moment(cell) for cell in table.column(column)]
    clocks = [m for m in found if m is not None and m["first"] and not m["date"]]
    return 2 * len(clocks) > len(found) and not any(map(is_spelt, table.column(column)))

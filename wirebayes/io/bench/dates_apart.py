"""Dates in a column of their own beside clocks: together they are moments, and a day that passes is no guess."""

from dataclasses import replace

from wirebayes.io.bench.compound_times import is_spelt
from wirebayes.io.bench.sheet import moment
from wirebayes.io.bench.table import RawTable

_MIDNIGHT = "00:00:00"  # what spreadsheets add to a date


def with_dates(table: RawTable) -> RawTable:
    """The table with each date before its clock, if one column holds dates alone and one other clocks alone.

    An empty cell has the date of the line above, as in merged cells.

    Parameters
    ----------
    table : RawTable
    """
    named = [i for i, name in enumerate(table.header) if name]
    dates = [i for i in named if _are_dates(table, i)]
    clocks = [i for i in named if _are_clocks(table, i)]
    if len(dates) != 1 or len(clocks) != 1:
        return table
    (of_date,), (of_clock,) = dates, clocks
    rows, date = [], ""
    for row in table.rows:
        date = row.cell(of_date).removesuffix(_MIDNIGHT).strip() or date
        cells = list(row.cells)
        if row.cell(of_clock):
            cells[of_clock] = f"{date} {row.cell(of_clock)}"
        rows.append(replace(row, cells=tuple(cells)))
    header = tuple("" if i == of_date else name for i, name in enumerate(table.header))
    described = f"{table.sheet.described}, dates from {table.header[of_date]!r}"
    sheet = replace(table.sheet, described=described)
    return replace(table, sheet=sheet, header=header, rows=tuple(rows))


def _are_dates(table: RawTable, column: int) -> bool:
    """Whether a column holds dates without times, the first row one of them."""
    cells = table.column(column)
    found = [moment(cell.removesuffix(_MIDNIGHT).strip()) for cell in cells if cell]
    return bool(cells and cells[0]) and all(m is not None and m["date"] and not m["first"] for m in found)


def _are_clocks(table: RawTable, column: int) -> bool:
    """Whether a column holds clocks without dates, but for empty cells and words."""
    found = [moment(cell) for cell in table.column(column)]
    clocks = [m for m in found if m is not None and m["first"] and not m["date"]]
    return 2 * len(clocks) > len(found) and not any(map(is_spelt, table.column(column)))

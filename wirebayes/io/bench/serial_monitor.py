"""Logs of a serial monitor, which writes the time of day before each line: ``23:40:00.125 -> 4811,2.00,231.4``."""

import re
from collections.abc import Sequence
from dataclasses import replace

from wirebayes.io.bench.sheet import Sheet, SheetRow, is_value
from wirebayes.io.bench.table import find_table
from wirebayes.io.bench.words import speaks_of

ARRIVAL = "Time of arrival"  # the name of the column of stamps
_STAMPED = re.compile(r"\s*(\d{1,2}:\d\d:\d\d(?:[.,]\d+)?) -> ?(.*)")


def is_log(lines: Sequence[str]) -> bool:
    """Whether all lines that hold something are stamped."""
    filled = [line for line in lines if line.strip()]
    return bool(filled) and all(map(_STAMPED.match, filled))


def without_stamps(lines: Sequence[str]) -> tuple[list[str], list[str]]:
    """What was sent, line by line, and when each line arrived; empty texts for empty lines."""
    found = [_STAMPED.match(line) for line in lines]
    sent = [match[2] if match else "" for match in found]
    return sent, [match[1] if match else "" for match in found]


def with_arrivals(sheet: Sheet, arrivals: Sequence[str]) -> Sheet:
    """The sheet of what was sent, with a last column of the times of arrival where the device sent no time itself.

    Parameters
    ----------
    sheet : Sheet
    arrivals : sequence of str
        Of each line.
    """
    table = find_table(sheet)
    if any(speaks_of(name, "time") for name in table.header):
        return sheet.also("times of arrival not read")
    head = next(row.cells for row in sheet.rows if row.line == table.header_line)
    width = len(table.header)
    rows = []
    for row in sheet.rows:
        if row.cells == head:
            row = _with_last(row, width, ARRIVAL)
        elif is_value(row.filled[0]):
            row = _with_last(row, width, arrivals[row.line - 1])
        rows.append(row)
    return replace(sheet, rows=tuple(rows))


def _with_last(row: SheetRow, width: int, cell: str) -> SheetRow:
    """A row with one more cell behind a number of columns."""
    return replace(row, cells=(*row.cells, *[""] * (width - len(row.cells)), cell))

"""Whole seconds and what is left of them side by side, as computers stamp readings: ``sec, nsec``."""

import re
from collections.abc import Sequence
from dataclasses import replace

from wirebayes.io.bench.header import header_meant, name_and_unit
from wirebayes.io.bench.table import RawTable

_UNITS = {  # parts of a second in one, by what programs call them
    1: ("s", "sec", "secs", "second", "seconds"),
    10**3: ("ms", "msec", "msecs", "millis", "millisec", "milliseconds"),
    10**6: ("us", "µs", "usec", "usecs", "micros", "microsec", "microseconds"),
    10**9: ("ns", "nsec", "nsecs", "nanos", "nanosec", "nanosecs", "nanoseconds"),
}
_WHOLE = re.compile(r"\d{1,12}")
_DIGITS = 9  # of the fraction that is written
_WITH_COMMA = re.compile(r"-?\d+,\d+")


def with_whole_seconds(table: RawTable, mapping: Sequence[str]) -> RawTable:
    """The table with one column of seconds for the two; itself where there are none.

    Parameters
    ----------
    table : RawTable
    mapping : sequence of str
        What the user says of columns: those that it names stay as they are.
    """
    said = set(map(header_meant, mapping))
    for first in range(len(table.header) - 1):
        second = first + 1
        if not said.isdisjoint(table.header[first : second + 1]):
            continue
        parts = _parts(table, second)
        if _parts(table, first) == 1 and parts > 1 and _count(table, first, second, parts):
            return _joined(table, first, parts)
    return table


def _parts(table: RawTable, column: int) -> int:
    """How many of what a column counts make a second; 0 where it counts something else."""
    header, under = table.header[column].strip(), table.units[column]
    unit = name_and_unit(header, "time").unit
    words = re.split(r"[\s._/()\[\]]+", header.rstrip(")] "))
    for text in (under, unit.text if unit else "", words[-1]):
        for parts, names in _UNITS.items():
            if text.lower() in names:
                return parts
    return 0


def _count(table: RawTable, first: int, second: int, parts: int) -> bool:
    """Whether both columns count in whole numbers, and the second one to less than a second, again and again."""
    seconds, rest = table.column(first), table.column(second)
    if not all(map(_WHOLE.fullmatch, [*seconds, *rest])):
        return False
    counts = list(map(int, rest))
    begins_again = any(b < a for a, b in zip(counts, counts[1:], strict=False))
    return max(counts) < parts and begins_again and len(set(seconds)) > 1


def _joined(table: RawTable, first: int, parts: int) -> RawTable:
    """The table with seconds and their fraction in the first of the two columns."""
    second = first + 1
    sign = _decimal_sign(table)
    smallest_parts = 10**_DIGITS // parts
    rows = []
    for row in table.rows:
        fraction = int(row.cell(second)) * smallest_parts
        cells = [*row.cells]
        cells[first] = f"{row.cell(first)}{sign}{fraction:0{_DIGITS}d}"
        cells[second] = ""
        rows.append(replace(row, cells=tuple(cells)))
    header = [*table.header]
    sheet = table.sheet.also(f"time from {header[first]} and {header[second]}")
    header[first] = "time (s)"
    header[second] = ""
    units = [*table.units]
    units[first] = ""
    units[second] = ""
    return replace(table, sheet=sheet, header=tuple(header), units=tuple(units), rows=tuple(rows))


def _decimal_sign(table: RawTable) -> str:
    """A comma where a number of the table has one."""
    for row in table.rows:
        if any(map(_WITH_COMMA.fullmatch, row.cells)):
            return ","
    return "."

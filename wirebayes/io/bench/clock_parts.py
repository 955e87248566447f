"""Hours, minutes and seconds in columns of their own, or year, month and day: joined to one clock, one date.

Parts stand side by side, the largest first, under one name. Two columns of time that tell the same in two units are no
parts: minutes of a clock count in whole numbers, and seconds to 59.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

from wirebayes.io.bench.compound_times import HOURS, MINUTES, SECONDS
from wirebayes.io.bench.header import NO_UNIT, header_meant, name_and_unit
from wirebayes.io.bench.quantities import quantity_unit
from wirebayes.io.bench.table import RawTable
from wirebayes.io.bench.words import plain_letters

# by the seconds of one: an hour, a minute, a second
_CLOCK = {3600.0: re.compile(HOURS, re.I), 60.0: re.compile(MINUTES, re.I), 1.0: re.compile(SECONDS, re.I)}
_DATE = (
    {"year", "jahr", "annee", "an", "ano", "anno", "jaar"},
    {"month", "monat", "mois", "mes", "mese", "maand"},
    {"day", "tag", "jour", "dia", "giorno", "dag"},
)
_WHOLE, _NUMBER = re.compile(r"\d+"), re.compile(r"\d+([.,]\d+)?")
_BELOW = 60.0  # minutes of an hour, seconds of a minute


@dataclass(frozen=True)
class _Parts:
    """Columns that are parts of one time.

    Attributes
    ----------
    columns : tuple of int
    name : str
        Of the column that they become.
    joint : str
        What stands between two parts of a cell.
    rest : str
        What a cell ends with.
    """

    columns: tuple[int, ...]
    name: str
    joint: str
    rest: str = ""


def with_joined_parts(table: RawTable, mapping: Sequence[str]) -> RawTable:
    """The table with one column for the parts of a date, and one for those of a clock; itself where there are none.

    Parameters
    ----------
    table : RawTable
    mapping : sequence of str
        What the user says of columns: those that it names stay as they are.
    """
    said = set(map(header_meant, mapping))
    free = [i for i, name in enumerate(table.header) if name and name not in said]
    for parts in (_of_date(table, free), _of_clock(table, free)):
        table = table if parts is None else _joined(table, parts)
    return table


def _of_date(table: RawTable, free: Sequence[int]) -> _Parts | None:
    for i in free:
        columns = (i, i + 1, i + 2)
        named = [set(free) >= set(columns) and plain_letters(table.header[k]) in _DATE[k - i] for k in columns]
        if all(named) and all(_WHOLE.fullmatch(cell) for k in columns for cell in table.column(k)):
            return _Parts(columns, "date", "-")
    return None


def _of_clock(table: RawTable, free: Sequence[int]) -> _Parts | None:
    unit_s = {i: _part_s(table, i) for i in free}
    for wanted in ((3600.0, 60.0, 1.0), (3600.0, 60.0), (60.0, 1.0)):
        for i in free:
            columns = tuple(range(i, i + len(wanted)))
            if [unit_s.get(k) for k in columns] != list(wanted) or not _are_of_one_name(table, columns):
                continue
            if _count_to_59(table, columns, wanted[-1] == 1.0):
                written = ", ".join({3600.0: "h", 60.0: "min", 1.0: "s"}[unit] for unit in wanted)
                return _Parts(columns, f"time ({written})", ":", ":00" if wanted[-1] == 60.0 else "")
    return None


def _part_s(table: RawTable, column: int) -> float | None:
    """Seconds of one of what a column counts, by its unit or its whole name: an hour, a minute, a second."""
    header, below = table.header[column], table.units[column]
    _, unit = name_and_unit(header, "time")
    under = quantity_unit(below, "time")
    called = next((unit_s for unit_s, names in _CLOCK.items() if names.fullmatch(header)), None)
    if called and (under or below in NO_UNIT):  # m over kg is a mass
        return called
    return next((u.factor for u in (unit, under) if u is not None and u.clock is None), None)


def _are_of_one_name(table: RawTable, columns: Sequence[int]) -> bool:
    """Whether columns have one name beside their units, where they have one: a duration and a time are no clock.

    Minutes without hours before them have more than one letter: m and mm are lengths, and m a mass.
    """
    headers = [table.header[i] for i in columns]
    bare = {name_and_unit(header, "time").name for header in headers}
    names = {name for name in bare if not any(unit.fullmatch(name) for unit in _CLOCK.values())}
    are_lengths = quantity_unit(headers[0], "displacement") is not None and headers[1].lower() != "ss"
    return len(names) <= 1 and not are_lengths


def _count_to_59(table: RawTable, columns: Sequence[int], to_seconds: bool) -> bool:
    """Whether columns count in whole numbers, but for seconds, and those behind the first to 59."""
    cells = [table.column(i) for i in columns]
    whole = all(_WHOLE.fullmatch(cell) for column in cells[:-1] for cell in column)
    last = _NUMBER if to_seconds else _WHOLE
    numbers = all(last.fullmatch(cell) for cell in cells[-1])
    if not (whole and numbers):
        return False
    counted = any(cell.strip("0") for column in cells[:-1] for cell in column)
    return counted and all(float(cell.replace(",", ".")) < _BELOW for column in cells[1:] for cell in column)


def _joined(table: RawTable, parts: _Parts) -> RawTable:
    """The table with the parts of each row in the first of their columns."""
    first, *others = parts.columns
    rows = []
    for row in table.rows:
        cells = [*row.cells]
        texts = [row.cell(first)]
        for i in others:
            texts.append(_two_digits(row.cell(i)))
            if i < len(cells):
                cells[i] = ""
        cells[first] = parts.joint.join(texts) + parts.rest
        rows.append(replace(row, cells=tuple(cells)))
    header = [*table.header]
    units = [*table.units]
    of_parts = ", ".join(header[i] for i in parts.columns)
    for i in parts.columns:
        header[i] = ""
        units[i] = ""
    header[first] = parts.name
    what = parts.name.partition(" ")[0]
    sheet = table.sheet.also(f"{what} from {of_parts}")
    return replace(table, sheet=sheet, header=tuple(header), units=tuple(units), rows=tuple(rows))


def _two_digits(cell: str) -> str:
    """A part of a clock or a date with its zero in front."""
    return cell if len(re.split("[.,]", cell)[0]) > 1 else f"0{cell}"

"""Cells that bear their unit, ``12.5 N``: the number stays in the cell, and the unit moves to a row of units above.

A column of several units of one quantity, ``500 g`` and ``1 kg``, is written in the smallest of them.
"""

import re
from collections.abc import Sequence
from dataclasses import replace
from decimal import Decimal
from functools import cache

from wirebayes.io.bench.compound_times import is_spelt
from wirebayes.io.bench.quantities import ROLES, Role, Unit, quantity_unit
from wirebayes.io.bench.sheet import Sheet, SheetRow, is_measured, is_number, of_fraction
from wirebayes.io.bench.words import speaks_of

FEWEST = 3  # cells with a unit: one row of them may be the ranges of sensors, or times that run along a header
_AT_END = 100  # lines, more than what programs write below readings
_TWO_SIGNS = re.compile(r"[.,].*[.,]|/")
_MEASURE = re.compile(r"([+\-\u2212]?\d[\d.,'\u2019\s/\-]*(?:[eE][+-]?\d+)?)(?<!\s)\s*([^\W\d_].*|[°%‰].*)")
_APART = re.compile(r"(?<!\S)([+\-\u2212]?\d[\d.,]*)\s+([^\W\d_][^\s\d]*|[°%‰][^\s\d]*)(?!\S)")


def bare(cell: str) -> str:
    """The number of a cell that bears a unit; any other cell as it is."""
    found = _measure(cell)
    return found[0] if found else cell


def joined_measures(line: str) -> str:
    """A line between spaces, if it begins with a number, without the spaces between numbers and their units."""
    if not line[:2].strip("+-\u2212")[:1].isdigit():
        return line

    def joined(found: re.Match[str]) -> str:
        return f"{found[1]}{found[2]}" if _is_unit(found[2]) else found[0]

    return _APART.sub(joined, line)


def with_units_apart(sheet: Sheet) -> Sheet:
    """The sheet with a row of units above its first reading, where cells bear units; else itself."""
    # a column of cells with units has them at its end, too: most long files are known by a glance there
    if not any(_measure(cell) for row in sheet.rows[-_AT_END:] for cell in row.cells):
        return sheet
    readings = [row for row in sheet.rows if not row.comment and is_measured([*map(bare, row.filled)])]
    if not readings:
        return sheet
    first = sheet.rows.index(readings[0])
    head = sheet.rows[first - 1] if first else SheetRow(1, ())
    width = max(len(row.cells) for row in readings)
    units = [""] * width
    numbers = dict[int, dict[str, str]]()
    for column in range(width):
        if speaks_of(head.cell(column), "hold"):
            continue
        found = _numbers([row.cell(column) for row in readings])
        if found is not None:
            units[column], numbers[column] = found
    if not numbers:
        return sheet
    above = sheet.rows[:first]
    rows = list(above)
    if not _bears(head, units):
        in_brackets = [f"[{unit}]" if unit else "" for unit in units]
        rows.append(SheetRow(readings[0].line, tuple(in_brackets)))
    for row in sheet.rows[first:]:
        rows.append(_with_numbers(row, numbers))
    return replace(sheet.also("units in the cells"), rows=tuple(rows))


def _bears(head: SheetRow, units: Sequence[str]) -> bool:
    """Whether a row is one of these units already."""
    return all(head.cell(i).strip("[]() ") == unit for i, unit in enumerate(units) if unit)


def _with_numbers(row: SheetRow, numbers: dict[int, dict[str, str]]) -> SheetRow:
    """A row with the numbers of its measures; a line of one cell may be a title."""
    if row.comment or len(row.filled) < 2:
        return row
    return replace(row, cells=tuple(numbers.get(i, {}).get(cell, cell) for i, cell in enumerate(row.cells)))


def _numbers(cells: Sequence[str]) -> tuple[str, dict[str, str]] | None:
    """The unit of a column and the number of each of its cells; None where not all of them bear a unit, or are zero."""
    filled = [cell for cell in dict.fromkeys(cells) if any(c.isdigit() for c in cell)]
    measures = {cell: found for cell in filled if (found := _measure(cell))}
    others = [cell for cell in filled if cell not in measures]
    if sum(cell in measures for cell in cells) < FEWEST or any(cell.strip("0.,") for cell in others):
        return None
    if any(map(is_spelt, filled)):  # times in two units, which are read as such
        return None
    alike = next((same for role in ROLES if (same := in_one_unit([*measures.values()], role))), None)
    return None if alike is None else (alike[0], dict(zip(measures, alike[1], strict=True)))


def in_one_unit(measures: Sequence[tuple[str, str]], role: Role) -> tuple[str, list[str]] | None:
    """The smallest unit of some measures of a quantity, and their numbers in it; None where they are of several.

    Parameters
    ----------
    measures : sequence of (str, str)
        Number and unit of each.
    role : str
        The quantity.
    """
    names = list(dict.fromkeys(name for _, name in measures))
    units: dict[str, Unit] = {}
    for name in names:
        unit = quantity_unit(name, role)
        if unit is None:
            return None
        units[name] = unit
    given = [number for number, _ in measures]
    if len(names) == 1:
        return names[0], given
    if not _are_multiples(list(units.values())):
        return None
    if any(map(_TWO_SIGNS.search, given)):
        return None
    smallest = min(names, key=lambda name: units[name].factor)
    factor = units[smallest].factor
    has_comma = any("," in number for number in given)
    sign = "," if has_comma else "."
    numbers = []
    for number, name in measures:
        times = Decimal(f"{units[name].factor / factor:.12g}")
        plain = "".join(number.split()).replace("\u2212", "-").replace(",", ".")
        value = times * Decimal(plain)
        numbers.append(f"{value:f}".replace(".", sign))
    return smallest, numbers


def _are_multiples(units: Sequence[Unit]) -> bool:
    """Whether each of some units is so many of another: none has its own zero, and all or none are the sample's."""
    if any(unit.offset for unit in units):
        return False
    return len({unit.of_sample for unit in units}) == 1


def _measure(cell: str) -> tuple[str, str] | None:
    """Number and unit of a cell that bears one."""
    found = _MEASURE.fullmatch(cell)
    if found is None or not _is_unit(found[2]):
        return None
    number, unit = found[1], found[2]
    return (number, unit) if is_number(number) or of_fraction(number) else None


@cache
def _is_unit(text: str) -> bool:
    return any(quantity_unit(text, role) for role in ROLES)

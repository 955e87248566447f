"""Tables with a column for each time or each hold, as people write them on paper, as rows of one reading each.

``Weg [mm]; 0 s; 30 s; 60 s`` has a hold in each row, ``Zeit [s]; 1 mm; 2 mm; 3 mm`` one in each column. The headers of
three columns or more then are numbers with units of one quantity, and one other column is what these leave open. Or
each hold has columns of its own, ``Zeit [s]; Kraft [N]``, side by side under the row ``1 mm;; 2 mm;; 3 mm;``.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from wirebayes.io.bench.block_titles import may_state_a_setting
from wirebayes.io.bench.cell_units import in_one_unit
from wirebayes.io.bench.header import is_of, name_and_unit
from wirebayes.io.bench.joined import lacking
from wirebayes.io.bench.quantities import Role, quantity_unit
from wirebayes.io.bench.sheet import SheetRow, is_number
from wirebayes.io.bench.table import RawTable
from wirebayes.io.bench.words import words_in

FEWEST = 3  # columns: two may be two sensors, with a number in their names
_NUMBER = r"[+\-\u2212]?\d+(?:[.,]\d+)?"
_MEASURE = re.compile(
    rf"(?P<before>.*?)(?<![\w.,])(?P<number>{_NUMBER})\s*(?P<unit>[^\W\d_°]+\.?|\")(?!\w)(?P<after>.*)"
)
_AT = re.compile(r"(?<!\w)(after|nach|apr[eè]s|dopo|despu[eé]s de|at|bei)(?!\w)", re.IGNORECASE)
_EMPTY = re.compile(r"\(\s*\)|\[\s*\]")
_ALONG: tuple[Role, ...] = ("time", "displacement", "tension")  # what may run along the header


@dataclass(frozen=True)
class _Across:
    """Columns whose headers are values of one quantity.

    Attributes
    ----------
    role : str
        The quantity.
    unit : str
    values : dict of int to str
        The number in the header of each of these columns.
    cells : str
        What is left of the headers: name and unit of what stands under them, as far as they say.
    """

    role: Role
    unit: str
    values: dict[int, str]
    cells: str


def row_for_each_reading(table: RawTable) -> RawTable:
    """The table with a row for each reading; itself where it has one already.

    Parameters
    ----------
    table : RawTable

    Raises
    ------
    InputError
        A cell is no number.
    """
    across = _across(table)
    if across is None:
        return _one_below_the_other(table)
    by_row = across.role == "time"
    roles: tuple[Role, ...] = ("displacement", "tension") if by_row else ("time",)
    beside = []
    for i, name in enumerate(table.header):
        if name and i not in across.values:
            beside += [(i, role) for role in roles if is_of(table, i, role)]
    if len(beside) != 1:
        return table
    ((column, role),) = beside
    read: Role = "displacement" if "tension" in (across.role, role) else "tension"
    if by_row:
        where = "row"
        rows = _by_row(table, across, column)
    else:
        where = "column"
        rows = _by_column(table, across, column)
    name, unit = _name_of_cells(table, across, read)
    header = ("hold", table.header[column], f"{across.role} [{across.unit}]", name)
    units = ("", table.units[column], across.unit, unit)
    sheet = table.sheet.also(f"a hold in each {where}")
    return RawTable(sheet, header, units, tuple(rows), table.header_line, turned=True)


def _one_below_the_other(table: RawTable) -> RawTable:
    """Holds that stand side by side under what was set in them, below each other; else the table itself."""
    labels, columns = _under_labels(table)
    if len(columns) < 2 or not all(map(may_state_a_setting, labels)):
        return table
    names = {tuple((_without_numbers(table.header[i]), table.units[i]) for i in own) for own in columns}
    if len(names) > 1:
        return table
    header = tuple(table.header[i] for i in columns[0])
    units = tuple(table.units[i] for i in columns[0])
    of_one = replace(table, header=header, units=units)
    missing = lacking(of_one, ())
    if len(missing) != 1:
        return table
    (set_role,) = missing
    settings = _settings_of(labels, set_role)
    if settings is None:
        return table
    unit, numbers = settings
    if len(set(numbers)) < len(numbers) and not _go_back(set_role, numbers):
        return table
    rows = _rows_under(table, columns, numbers)
    sheet = table.sheet.also("holds side by side")
    all_names = ("hold", set_role, *header)
    all_units = ("", unit, *units)
    return RawTable(sheet, all_names, all_units, rows, table.header_line, turned=True)


def _settings_of(labels: list[str], role: Role) -> tuple[str, list[str]] | None:
    """The unit and the numbers of settings in labels; None where a label has none of the quantity."""
    settings = []
    for label in labels:
        measure = _MEASURE.fullmatch(label)
        if measure is None:
            return None
        settings.append((measure["number"], measure["unit"]))
    return in_one_unit(settings, role)


def _under_labels(table: RawTable) -> tuple[list[str], list[list[int]]]:
    """The labels of the row above the header, each over the first of its columns or over all; and these columns."""
    labels: list[str] = []
    columns: list[list[int]] = []
    last = ""
    for i, (label, name) in enumerate(zip(table.above, table.header, strict=False)):
        if label and (label != last or _is_named(table, name, columns[-1])):
            labels.append(label)
            columns.append([])
            last = label
        if last and name:
            columns[-1].append(i)
    return labels, columns


def _is_named(table: RawTable, name: str, columns: Sequence[int]) -> bool:
    """Whether one of some columns has a name, but for its numbers."""
    return any(_without_numbers(table.header[i]) == _without_numbers(name) for i in columns)


def _without_numbers(name: str) -> str:
    return re.sub(r"\d+", "#", name)


def _rows_under(table: RawTable, columns: list[list[int]], settings: list[str]) -> tuple[SheetRow, ...]:
    """A row for each reading, with the number of its hold and what was set in it before its cells."""
    return tuple(
        SheetRow(row.line, (str(hold), setting, *(row.cell(i) for i in own)))
        for hold, (own, setting) in enumerate(zip(columns, settings, strict=True), start=1)
        for row in table.rows
        if any(row.cell(i) for i in own)
    )


def _across(table: RawTable) -> _Across | None:
    """The columns whose headers are different values of one quantity in one unit; None where they are few."""
    found: dict[tuple[Role, str], dict[int, tuple[str, str]]] = {}
    for i, name in enumerate(table.header):
        measure = _MEASURE.fullmatch(name)
        if measure is None:
            continue
        number, unit = measure["number"], measure["unit"]
        role = _along_header(unit)
        if role is None:
            continue
        left = _EMPTY.sub("", f"{measure['before']} {measure['after']}")
        words = _AT.sub("", left).split()
        cells = " ".join(words).strip("@=,;: ")
        found.setdefault((role, cells), {})[i] = number, unit
    if not found:
        return None
    role, cells = max(found, key=lambda kind: len(found[kind]))
    measures = found[role, cells]
    one_unit = in_one_unit([*measures.values()], role)
    if one_unit is None:
        return None
    unit, numbers = one_unit
    if len(set(numbers)) < FEWEST or not (len(set(numbers)) == len(numbers) or _go_back(role, numbers)):
        return None
    values = dict(zip(measures, numbers, strict=True))
    return _Across(role, unit, values, cells)


def _go_back(role: Role, settings: Sequence[str]) -> bool:
    """Whether settings that stand twice are those of a way back: again in the same order they may be a specimen's."""
    first: list[str] = []
    again: list[str] = []
    for setting in settings:
        (again if setting in first else first).append(setting)
    if role == "time" or len(set(again)) < len(again) or any(a == b for a, b in pairwise(settings)):
        return False
    forth = [setting for setting in first if setting in again]
    return again == forth[::-1]


def _along_header(unit: str) -> Role | None:
    """The quantity of a unit that may run along the header."""
    for role in _ALONG:
        if quantity_unit(unit, role):
            return role
    return None


def _name_of_cells(table: RawTable, across: _Across, read: Role) -> tuple[str, str]:
    """What the cells are called, and their unit where a row of units states one for all of them."""
    units = {table.units[i] for i in across.values}
    stated = units.pop() if len(units) == 1 else ""
    above = {table.above[i] for i in across.values if i < len(table.above)} - {""}
    of_quantity = (text for text in (across.cells, *above) if name_and_unit(text, read).unit)
    name = next(of_quantity, read)
    if not words_in(name_and_unit(name, read).name):  # nothing but a unit: 0 min [N], 1 min [N]
        name = f"{read} {name}"
    return name, stated if quantity_unit(stated, read) else ""


def _by_row(table: RawTable, across: _Across, column: int) -> list[SheetRow]:
    """A hold in each row."""
    return [
        SheetRow(row.line, (str(hold), row.cell(column), time, _reading(table, row, i)))
        for hold, row in enumerate(table.rows, start=1)
        for i, time in across.values.items()
        if row.cell(i)
    ]


def _by_column(table: RawTable, across: _Across, column: int) -> list[SheetRow]:
    """A hold in each column."""
    return [
        SheetRow(row.line, (str(hold), row.cell(column), setting, _reading(table, row, i)))
        for hold, (i, setting) in enumerate(across.values.items(), start=1)
        for row in table.rows
        if row.cell(i)
    ]


def _reading(table: RawTable, row: SheetRow, column: int) -> str:
    cell = row.cell(column)
    if not is_number(cell):
        raise table.complain(row.line, column, repr(cell), "a number, or nothing where nothing was read")
    return cell

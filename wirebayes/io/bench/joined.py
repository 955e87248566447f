"""Files that are holds of one test, as loggers write one after each start: joined as the rows of one table.

They follow each other in the order of their dates where they have dates, else of their names as people count: hold 2
before hold 10. Where no column holds what was set, it is what the names of the files say (``2mm.csv``), or the user.
"""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from functools import reduce
from operator import and_
from pathlib import Path

import numpy as np

from wirebayes.errors import InputError
from wirebayes.io.bench import clock
from wirebayes.io.bench.dates_apart import dated
from wirebayes.io.bench.header import header_meant, is_called_of_sample, is_of, name_and_unit
from wirebayes.io.bench.mapping import mapped_columns
from wirebayes.io.bench.quantities import Role, Unit, quantity_unit
from wirebayes.io.bench.sheet import SheetRow, moment
from wirebayes.io.bench.table import RawTable
from wirebayes.numeric.typing import Floats
from wirebayes.sentences import listed

HOLD = "hold"  # what says that each file is one, and the name of the column that numbers them
TEST = "test"
_SETTINGS: tuple[Role, ...] = ("displacement", "tension")
_DIGITS = re.compile(r"(\d+)")
_MEASURE = re.compile(r"(?<![\d.,])(\d+(?:[.,]\d+)?)[ _]?([^\W\d_]+)(?![^\W\d_])")


def in_natural_order(paths: Sequence[Path]) -> list[Path]:
    """Files by their names, numbers in these as numbers.

    Parameters
    ----------
    paths : sequence of Path
    """
    return sorted(paths, key=_as_people_count)


def _as_people_count(path: Path) -> list[tuple[bool, int | str]]:
    parts = [part for part in _DIGITS.split(str(path).casefold()) if part]
    return [(part.isdigit(), int(part) if part.isdigit() else part) for part in parts]


def one_table(tables: Sequence[RawTable], each_file: str, mapping: Sequence[str]) -> tuple[RawTable, list[str]]:
    """The table of a test, and what was understood of its files, in sentences.

    Parameters
    ----------
    tables : sequence of RawTable
        Of each file, in the order in which they were given.
    each_file : str
        `HOLD`, or what was set in each, with units: ``1 mm, 2 mm``.
    mapping : sequence of str
        What the user says of columns.

    Raises
    ------
    InputError
        Files differ in their columns, or do not say what was set, or what was is listed in another order than theirs.
    """
    _check_alike(tables)
    given = list(tables)
    tables, by = _in_order(given, mapping)
    order = f"the order of their {by}: {_names(tables)}"
    notes = [f"holds of one test in {order}"]
    settings, role, source = _settings(tables, each_file, mapping)
    if each_file != HOLD and tables != given:  # which setting is whose may be meant either way
        raise InputError(f"--each-file: found a list, and files in the order {_names(given)}, expected both in {order}")
    first = tables[0]
    header = (*_without_numbers(first), HOLD)
    units = (*first.units, "")
    of_files: list[tuple[str, ...]] = [(str(number),) for number in range(1, len(tables) + 1)]
    if role:
        header = (*header, role)
        units = (*units, settings[0][1])
        of_files = [(*cells, setting[0]) for cells, setting in zip(of_files, settings, strict=True)]
        told = listed([" ".join(setting) for setting in settings])
        notes.append(f"the {role} of each hold from {source}: {told}")
    return replace(_together(tables, of_files), header=header, units=units), notes


def _names(tables: Sequence[RawTable]) -> str:
    return listed([table.sheet.path.name for table in tables])


def _in_order(tables: Sequence[RawTable], mapping: Sequence[str]) -> tuple[list[RawTable], str]:
    """The tables as the holds followed each other, and by what of them that is known.

    Dates are read in all files together: whether they begin with the day may be evident in one of them only.
    """
    tables = sorted(tables, key=lambda table: _as_people_count(table.sheet.path))
    with_dates = [dated(table) for table in tables]
    together = _together(with_dates, [()] * len(tables))
    calendar = _calendar_s(together, mapping)
    if calendar is None:
        return tables, "names"
    lengths = [len(table.rows) for table in tables]
    begins = np.cumsum([0, *lengths[:-1]])
    in_order = np.argsort(calendar[begins], kind="stable")
    return [tables[i] for i in in_order], "dates"


def _together(tables: Sequence[RawTable], of_files: Sequence[tuple[str, ...]]) -> RawTable:
    """The rows of all files in one table, each with more cells, those of its file."""
    rows: list[SheetRow] = []
    pieces: list[tuple[int, str]] = []  # the line after which each file begins
    for table, of_file in zip(tables, of_files, strict=True):
        begin = rows[-1].line if rows else 0
        pieces.append((begin, table.sheet.path.name))
        for row in table.rows:
            cells = tuple(row.cell(i) for i in range(len(table.header)))
            rows.append(replace(row, line=begin + row.line, cells=(*cells, *of_file)))
    first = tables[0]
    sheet = replace(first.sheet, path=path_of_all([table.sheet.path for table in tables]))
    return replace(first, sheet=sheet, rows=tuple(rows), pieces=tuple(pieces))


def path_of_all(paths: Sequence[Path]) -> Path:
    """What messages call several files."""
    return paths[0].with_name(f"{paths[0].name} to {paths[-1].name}")


def name_settings(paths: Sequence[Path]) -> list[tuple[str, str]]:
    """What was set in each file by its name, number and unit; empty where names do not say it.

    The only measure that is not the same in all of them, in one unit: ``rope 6 mm, hold at 2 mm`` is at 2 mm.

    Parameters
    ----------
    paths : sequence of Path
    """
    known = [_measures_of_settings(path.stem) for path in paths]
    shared = reduce(and_, known)
    settings = []
    for each in known:
        own = [*(each - shared).elements()]
        if len(own) != 1:
            return []
        settings += own
    units = {unit for _, unit in settings}
    return settings if len(units) <= 1 else []


def _measures_of_settings(text: str) -> Counter[tuple[str, str]]:
    """Numbers and units in a text that may be those of settings, and how often each stands there."""
    known: Counter[tuple[str, str]] = Counter()
    for number, unit in _MEASURE.findall(text):
        if any(quantity_unit(unit, role) for role in _SETTINGS):
            known[number, unit] += 1
    return known


def lacking(table: RawTable, mapping: Sequence[str]) -> list[Role]:
    """Displacement or tension, where no column is one by its name or by what the user says.

    Parameters
    ----------
    table : RawTable
    mapping : sequence of str
    """
    said = {text.rpartition("=")[2].split(" ")[0] for text in mapping}
    lacks: list[Role] = []
    for role in _SETTINGS:
        of_role = (is_of(table, i, role) or is_called_of_sample(table, i, role) for i in range(len(table.header)))
        if role not in said and not any(of_role):
            lacks.append(role)
    return lacks


def _settings(
    tables: Sequence[RawTable], each_file: str, mapping: Sequence[str]
) -> tuple[list[tuple[str, str]], Role | None, str]:
    """What was set in each file, where no column says it: number and unit; the quantity; and who says so."""
    missing = lacking(tables[0], mapping)
    paths = [table.sheet.path for table in tables]
    stated = []
    if each_file != HOLD:
        stated = _stated(each_file, len(tables))
    if not missing and stated:
        found = f"{each_file!r} and columns of displacement and tension in {paths[0].name}"
        raise InputError(f"--each-file: found {found}, expected {HOLD}")
    if len(missing) != 1:
        return [], None, ""
    (role,) = missing
    settings = stated or name_settings(paths)
    if not settings or not quantity_unit(settings[0][1], role):
        example = "1 mm, 2 mm, …" if role == "displacement" else "5 kg, 10 kg, …"
        found = f"found no {role} in the columns or in the names of the files"
        files = listed([path.name for path in paths])
        expected = f'--each-file "{example}", one for each of {files}'
        raise InputError(f"{path_of_all(paths)}: {found}, expected {expected}")
    source = "--each-file" if stated else "the names of the files"
    return settings, role, source


def _stated(each_file: str, count: int) -> list[tuple[str, str]]:
    """Settings that a user lists."""
    parts = each_file.split(",")
    settings = []
    for part in parts:
        match = re.fullmatch(r"\s*([-+]?\d+(?:\.\d+)?)\s*(\S+)\s*", part)
        if match:
            number, unit = match.groups()
            settings.append((number, unit))
    units = {unit for _, unit in settings}
    if len(settings) != len(parts) or len(settings) != count or len(units) > 1:
        expected = f"{HOLD}, {TEST} or what was set in each of the {count} files, in one unit, as 1 mm, 2 mm"
        raise InputError(f"--each-file: found {each_file!r}, expected {expected}")
    return settings


def _check_alike(tables: Sequence[RawTable]) -> None:
    first = tables[0]
    for table in tables[1:]:
        if (table.header, table.units) != (first.header, first.units):
            raise InputError(
                f"{table.sheet.path}, line {table.header_line}: found the columns {', '.join(table.header)}, expected "
                f"those of {first.sheet.path.name}, {', '.join(first.header)}: holds of one test are written alike"
            )


def _without_numbers(table: RawTable) -> tuple[str, ...]:
    """The header without a column that numbers holds, since each file is one."""
    return tuple("" if is_of(table, i, "hold") else name for i, name in enumerate(table.header))


def _calendar_s(table: RawTable, mapping: Sequence[str]) -> Floats | None:
    """When each reading was taken, in seconds of the calendar, where a column has dates with times."""
    for column in range(len(table.header)):
        found = [moment(cell) for cell in table.column(column)]
        if all(m is not None and m["date"] and m["first"] for m in found):
            return clock.calendar_s(table, column, _form_of_dates(table, column, mapping))
    return None


def _form_of_dates(table: RawTable, column: int, mapping: Sequence[str]) -> Unit | None:
    """How dates are written, by what the user says of their column or by its header; None where neither says it."""
    header = table.header[column]
    about = [text for text in mapping if header_meant(text) == header]
    for _, role, stated in mapped_columns(table, about):
        if role == "time" and stated:
            return quantity_unit(stated, "time")
    return name_and_unit(header, "time").unit

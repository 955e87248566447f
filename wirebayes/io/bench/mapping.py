"""What the user says with ``--map`` of a table's columns: which quantity each holds, and in which unit."""

from collections.abc import Sequence

from wirebayes.errors import InputError
from wirebayes.io.bench.header import name_and_unit
from wirebayes.io.bench.quantities import ROLES, UNITS
from wirebayes.io.bench.table import RawTable
from wirebayes.strict.hint import hint

IGNORE = "ignore"
_SAYABLE = (*ROLES, IGNORE)


def ignored(table: RawTable, mapping: Sequence[str]) -> set[int]:
    """The columns that the user leaves out."""
    return {index for index, role, _ in mapped_columns(table, mapping) if role == IGNORE}


def mapped_columns(table: RawTable, mapping: Sequence[str]) -> list[tuple[int, str, str]]:
    """Column, role and unit of each thing the user says; what is said later of a column stands."""
    out: dict[int, tuple[int, str, str]] = {}
    for text in mapping:
        header, equals, rest = text.rpartition("=")
        if not equals:
            raise _no_mapping(text, "")
        header = header.strip()
        role, _, stated = rest.strip().partition(" ")
        unit = stated.strip("[]() ")
        bears_no_unit = role in (IGNORE, "hold")
        if role not in _SAYABLE or (unit and bears_no_unit):
            raise _no_mapping(text, hint(role, _SAYABLE))
        index, unit_in_header = _named(table, header, role)
        out[index] = index, role, unit or unit_in_header
    return list(out.values())


def _no_mapping(text: str, meant: str) -> InputError:
    expected = f"HEADER=COLUMN or HEADER=COLUMN [UNIT], COLUMN one of {', '.join(_SAYABLE)}"
    return InputError(f"--map: found {text!r}{meant}, expected {expected}")


def _named(table: RawTable, header: str, role: str) -> tuple[int, str]:
    """The column of a header as the user writes it, perhaps with the unit that the file leaves out."""
    if header in table.header:
        return table.header.index(header), ""
    if role in UNITS:
        bare, unit = name_and_unit(header, role)
        if unit and bare in table.header:
            return table.header.index(bare), unit.text
    names = [name for name in table.header if name]
    found = f"no column {header!r}{hint(header, names)}"
    raise InputError(f"{table.sheet.path}, line {table.header_line}: found {found}, expected one of {', '.join(names)}")

"""What a column's header and unit say of the quantity in it."""

import re
from typing import NamedTuple

from wirebayes.io.bench.compound_times import announced
from wirebayes.io.bench.multiples import unit_in_header
from wirebayes.io.bench.quantities import ROLES, Role, Unit, is_foreign, quantity_unit
from wirebayes.io.bench.table import RawTable
from wirebayes.io.bench.words import (
    LETTERS,
    RIG_LETTERS,
    RIG_WORDS,
    SAMPLE_WORDS,
    last_named,
    plain_letters,
    speaks_of,
    words_in,
)

NO_UNIT = ("", "-", "–", "1")  # what stands in a row of units where there is none
UNIT_IN_BRACKETS = re.compile(r"(.*?)\s*[\[(]\s*([^\[\]()]*?)\s*[\])]\s*$")
_UNIT_FIRST = re.compile(
    r"(days?|tage?|jours?|dias?|giorn[oi]|dag|dagen|weeks?|wochen?|millis|micros|seconds|minutes|hours|sekunden|minuten|stunden|secondes|heures|segundos|minutos)(?!\S)",
    re.I,
)
_BRACKET = re.compile(r"[\[(]([^\[\]()]*)[\])]")
_OPERATOR = re.compile(r"\s*[/*·×^:]")  # what stands behind a unit of which another one is made: Force (N)/Area (mm2)
_BEFORE_UNIT = re.compile(r"\s*/\s*|,\s*|\s+in\s+|[_\s.]+")
_DIVIDED = re.compile(r"/\s*\d+$")  # what stands before a unit that may be a share of it: Weg/10 mm
# what a unit in brackets may begin with: durations in minutes
_IN = re.compile(r"(?:.*\s)?(?:in|en|em)\s+", re.IGNORECASE)


def is_of_sample(table: RawTable, index: int, role: Role) -> bool:
    """Whether a column's unit is one of a strain or a stress.

    Parameters
    ----------
    index : int
        Of the column.
    role : str
        The quantity.
    """
    unit = unit_in_header(table.units[index], role) or name_and_unit(table.header[index], role).unit
    return unit is not None and unit.of_sample


def is_copy(table: RawTable, column: int, other: int) -> bool:
    """Whether two columns hold the same cells under the same unit.

    Parameters
    ----------
    column, other : int
    """
    units = [
        table.units[i] or next(iter(UNIT_IN_BRACKETS.findall(table.header[i])), ("", ""))[1] for i in (column, other)
    ]
    return units[0] == units[1] and table.column(column) == table.column(other)


def header_meant(mapping: str) -> str:
    """The header of a user's ``HEADER=COLUMN``."""
    return mapping.rpartition("=")[0].strip()


class NameAndUnit(NamedTuple):
    """A header taken apart; None where it holds no unit."""

    name: str
    unit: Unit | None


def name_and_unit(header: str, role: Role) -> NameAndUnit:
    """A header without its unit, and the unit: in brackets, after a slash, a comma, ``in``, ``_``, a point or a space.

    A time may begin with its unit in full: hours at load.
    """
    bracket = UNIT_IN_BRACKETS.match(header)
    in_brackets = unit_in_header(_IN.sub("", bracket[2]), role) if bracket else None
    if bracket and in_brackets:
        return NameAndUnit(bracket[1], in_brackets)
    found = _unit_in_a_bracket(header, role)
    if found is not None:
        return found
    if bracket and not any(unit_in_header(bracket[2], other) for other in ROLES):  # Force, N (serial number 7)
        name, unit = name_and_unit(bracket[1], role)
        if unit:
            return NameAndUnit(f"{name} ({bracket[2]})", unit)
    for sign in _BEFORE_UNIT.finditer(header):
        unit = unit_in_header(header[sign.end() :], role)
        name = header[: sign.start()]
        if unit and name and not _DIVIDED.search(name):
            return NameAndUnit(name, unit)
    if role != "time":
        return NameAndUnit(header, None)
    clock = announced(header)
    if clock:
        return NameAndUnit(header, Unit(header, clock=clock))
    first = _UNIT_FIRST.match(header)
    unit = quantity_unit(first[1], role) if first else None
    return NameAndUnit(header, unit)


def _unit_in_a_bracket(header: str, role: Role) -> NameAndUnit | None:
    """A header without the first of its brackets that holds a unit, and the unit: ``Force (N) run 1``."""
    for inside in _BRACKET.finditer(header):
        unit = unit_in_header(inside[1].strip(), role)
        before = header[: inside.start()]
        behind = header[inside.end() :]
        if unit and before and not _OPERATOR.match(behind):
            name = f"{before.strip()} {behind.strip()}".strip()
            return NameAndUnit(name, unit)
    return None


def is_of(table: RawTable, index: int, role: Role) -> bool:
    """Whether a column seems to be of a quantity, by its name and its unit.

    Parameters
    ----------
    role : str
    """
    return may_be(table, index, role) or is_of_rig(table, index, role)


def may_be(table: RawTable, index: int, role: Role) -> bool:
    """Whether a header's words and unit fit a quantity.

    Parameters
    ----------
    index : int
        Of the column.
    role : str
        The quantity.
    """
    header = table.header[index]
    row_unit = table.units[index]
    units = _units_of(header, row_unit)
    if units and role not in units:
        return False
    if not units:
        if _has_foreign_unit(header, row_unit):
            return False
        if role not in ("hold", "time") and _speaks_of_others(header, role):
            return last_named(header) == role
    if role not in units:
        return speaks_of(header, role)
    name = name_and_unit(header, role).name
    if speaks_of(name, role):
        return True
    if units[role].of_sample and not words_in(name).isdisjoint(SAMPLE_WORDS[role]):
        return True
    return plain_letters(name) in LETTERS.get(role, ())


def _speaks_of_others(header: str, role: Role) -> bool:
    """Whether a header has words of other quantities."""
    return any(speaks_of(header, other) for other in ROLES if other != role)


def _units_of(header: str, row_unit: str) -> dict[Role, Unit]:
    """The unit of a column by each quantity that has it, in a row of units or in the header."""
    units: dict[Role, Unit] = {}
    for role in ROLES:
        in_row = unit_in_header(row_unit, role) if row_unit else None
        unit = in_row or name_and_unit(header, role).unit
        if unit:
            units[role] = unit
    return units


def is_of_rig(table: RawTable, index: int, role: Role) -> bool:
    """Whether a column with a unit of the quantity has a name of `RIG_WORDS`, or a letter of `RIG_LETTERS`.

    Parameters
    ----------
    index : int
        Of the column.
    role : str
        The quantity.
    """
    name, unit = name_and_unit(table.header[index], role)
    unit = unit_in_header(table.units[index], role) or unit
    named = words_in(name) & {word for known in RIG_WORDS.get(role, ()) for word in (known, known + "s")}
    return unit is not None and (bool(named) or plain_letters(name) in RIG_LETTERS.get(role, ()))


def is_called_of_sample(table: RawTable, index: int, role: Role) -> bool:
    """Whether a column without a unit has the name, not the letter, of a strain or a stress.

    Parameters
    ----------
    index : int
        Of the column.
    role : str
        The quantity.
    """
    header = table.header[index]
    bracket = UNIT_IN_BRACKETS.match(header)
    if table.units[index] not in NO_UNIT or (bracket and bracket[2] not in NO_UNIT):
        return False
    names = {name for name in SAMPLE_WORDS.get(role, ()) if len(name) > 1 or not name.isascii()}
    return bool(words_in(header) & names)


def _has_foreign_unit(header: str, row_unit: str) -> bool:
    """Whether a column is said to be in a unit that no quantity of a test has."""
    if row_unit not in NO_UNIT:
        return True
    bracket = UNIT_IN_BRACKETS.match(header)
    return bracket is not None and is_foreign(bracket[2])

"""Columns that a unit alone names, under names of specimens: ``Rope A;;Rope B;`` over ``mm;N;mm;N``.

A unit under the name of a specimen says which quantity of it the column holds. Elsewhere it does so only where no other
column has a unit of the quantity, and where millimetres change: the same in every row, they may be a diameter.
"""

from collections.abc import Collection, Sequence
from dataclasses import replace

from wirebayes.io.bench.header import NO_UNIT, name_and_unit
from wirebayes.io.bench.multiples import unit_in_header
from wirebayes.io.bench.quantities import ROLES, Role, quantity_unit
from wirebayes.io.bench.table import RawTable
from wirebayes.io.bench.words import plain_letters, speaks_of_a_quantity

_UNIT = {"unit", "units", "einheit", "unite", "unidad", "unita", "unidade", "eenheid", "enhet", "enhed"}
_NAMED_AS_OFTEN = {"m", "d", "p", "g"}  # a mass or minutes, a diameter, a pressure: letters that are units, too


def with_quantities(table: RawTable) -> RawTable:
    """The table with the quantity of each column as its name, and the specimens in the row above.

    Parameters
    ----------
    table : RawTable
        Its header holds the units, and the row above the specimens; or the header holds the specimens, each over all
        columns of its own, and the units stand below.

    Returns
    -------
    RawTable
        The same where columns have names of their own.
    """
    header = table.header
    cells = tuple(cell.strip("[]() ") for cell in header)
    labels = {label for label in table.above if label}
    if len(labels) > 1 and _are_named_by_units(cells):
        quantities = _quantities(cells, cells)
        return replace(table, header=quantities, units=cells, header_line=table.header_line - 1)
    repeated = {name for name in header if name and header.count(name) > 1}
    if len(repeated) < 2 or any(map(speaks_of_a_quantity, repeated)):
        return table
    columns = zip(header, table.units, strict=True)
    units = tuple(unit if name in repeated else "" for name, unit in columns)
    if not _are_named_by_units(units):
        return table
    return replace(table, header=_quantities(header, units), above=header)


def with_units_beside(table: RawTable) -> RawTable:
    """The table without columns that hold a unit alone, each of which is the unit of the column before it.

    Parameters
    ----------
    table : RawTable
        As displays write it: ``12.5;N;2.0;mm``, under headers such as ``Force;Unit`` or ``Force;``.
    """
    header, units = list(table.header), list(table.units)
    for i in range(1, len(header)):
        cells = {cell for cell in table.column(i) if cell}
        called = header[i] == "" or plain_letters(header[i]) in _UNIT
        if len(cells) == 1 and called and not units[i - 1] and header[i - 1]:
            (unit,) = cells
            if any(quantity_unit(unit, role) for role in ROLES):
                header[i], units[i - 1] = "", unit
    return replace(table, header=tuple(header), units=tuple(units))


def units_alone(table: RawTable, needed: Sequence[Role], columns: Collection[int]) -> dict[Role, int]:
    """The columns of quantities where nothing names one but its unit, as ``s,mm,N`` does; none where that leaves doubt.

    Parameters
    ----------
    table : RawTable
        In which no column is named after a quantity that is needed.
    needed : sequence of str
        The quantities.
    columns : collection of int
        Those that the user does not leave out.

    Returns
    -------
    dict of Role to int
        For each quantity the only column with a unit of it.
    """
    found: dict[Role, int] = {}
    for role in needed:
        with_unit = [index for index in columns if _has_unit_of(table, index, role)]
        if len(with_unit) != 1:
            return {}
        (only,) = with_unit
        if not _is_named_by_unit_alone(table, only, role):
            return {}
        if role == "displacement" and len(set(table.column(only))) == 1:
            return {}
        found[role] = only
    return found


def _has_unit_of(table: RawTable, index: int, role: Role) -> bool:
    """Whether a column's name is, holds or stands above a unit of a quantity."""
    header = table.header[index]
    in_name = quantity_unit(header.strip("[]() "), role) or name_and_unit(header, role).unit
    return bool(in_name or unit_in_header(table.units[index], role))


def _is_named_by_unit_alone(table: RawTable, index: int, role: Role) -> bool:
    """Whether a column's name is a unit of a length, a time or a force, and can hardly be anything else."""
    name = table.header[index].strip("[]() ")
    unit = quantity_unit(name, role)
    if unit is None or unit.is_mass or unit.of_sample:
        return False
    return name.casefold() not in _NAMED_AS_OFTEN and table.units[index] in NO_UNIT


def _are_named_by_units(cells: tuple[str, ...]) -> bool:
    """Whether all cells but empty ones are units, each of one quantity."""
    filled = [cell for cell in cells if cell not in NO_UNIT]
    return len(filled) > 1 and all(_quantity(cell) for cell in filled)


def _quantities(names: tuple[str, ...], units: tuple[str, ...]) -> tuple[str, ...]:
    """The quantities of units, and the names of columns without one."""
    return tuple(_quantity(unit) or name for name, unit in zip(names, units, strict=True))


def _quantity(unit: str) -> Role | None:
    """The only quantity that has a unit."""
    of = [role for role in ROLES if quantity_unit(unit, role)]
    return of[0] if len(of) == 1 else None

"""Which column is which: by the words of several languages, by its unit, or by what the user says."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from wirebayes.errors import InputError, shown
from wirebayes.io.bench.clock import UNDERSTOOD, are_moments, has_moments, looks_like_a_moment
from wirebayes.io.bench.derived import check_itself
from wirebayes.io.bench.header import (
    NO_UNIT,
    UNIT_IN_BRACKETS,
    is_called_of_sample,
    is_copy,
    is_of_rig,
    is_of_sample,
    may_be,
    name_and_unit,
)
from wirebayes.io.bench.mapping import IGNORE, mapped_columns
from wirebayes.io.bench.missing import check_settings_of_runs, missing_columns, what_is_counted
from wirebayes.io.bench.multiples import multiple_of_unit, unit_in_header
from wirebayes.io.bench.numerals import is_count
from wirebayes.io.bench.quantities import COMMON, OF_SAMPLE, ROLES, TONS, UNITS, Role, Unit, is_ton, quantity_unit
from wirebayes.io.bench.sheet import SheetRow, is_number
from wirebayes.io.bench.table import RawTable
from wirebayes.io.bench.two_clocks import best_clock, clock_of, parting
from wirebayes.io.bench.two_units import finest_of_same
from wirebayes.io.bench.undecided import Undecided, quoted
from wirebayes.io.bench.unit_names import units_alone
from wirebayes.io.bench.words import COUNTED, ERRORS, last_named, speaks_of, words_in
from wirebayes.sentences import listed

_NEEDED: tuple[Role, ...] = ("displacement", "time", "tension")


@dataclass(frozen=True)
class Column:
    """One column that is read.

    Attributes
    ----------
    role : str
    index : int
        From 0.
    header : str
    unit : Unit or None
        None for hold numbers and clocks.
    by_unit_alone : bool
        Whether nothing but its unit names it.
    """

    role: Role
    index: int
    header: str
    unit: Unit | None
    by_unit_alone: bool = False


Columns = dict[Role, Column]  # by what each holds


def understand(table: RawTable, mapping: Sequence[str]) -> Columns:
    """The columns that are read.

    Parameters
    ----------
    mapping : sequence of str
        What the user says: ``HEADER=COLUMN`` or ``HEADER=COLUMN [UNIT]``; ``HEADER=ignore`` leaves a column out.

    Raises
    ------
    InputError
        A mapping names no column, a needed column is missing or in a unit of another quantity; `Undecided` where two
        columns could be it, or its unit is not said.
    """
    mapped = mapped_columns(table, mapping)
    roles, open_questions = _said(table, mapped)
    taken = {index for index, _, _ in mapped}
    free = [i for i, name in enumerate(table.header) if name and i not in taken]
    for role in ROLES:
        if role in roles or role in open_questions:
            continue
        likely = _likely(table, free, role)
        if not likely:
            continue
        try:
            roles[role] = _one(table, likely, role)
        except Undecided as question:
            open_questions[role] = question
    if open_questions:
        if "tension" in open_questions and "displacement" not in (*roles, *open_questions):
            check_settings_of_runs(table, [i for i in free if may_be(table, i, "tension")])
        first, *others = open_questions.values()
        raise Undecided(first.found, first.question, first.answers, others)
    return _complete(table, roles, free)


def _said(table: RawTable, mapped: Sequence[tuple[int, str, str]]) -> tuple[Columns, dict[Role, Undecided]]:
    """The columns that the user names, and the questions that are left about others of them."""
    roles: Columns = {}
    open_questions: dict[Role, Undecided] = {}
    for index, role, unit in mapped:
        if role == IGNORE:
            continue
        known: Role = role  # type: ignore[assignment]
        if known in roles:
            found = f"{roles[known].header} and {table.header[index]} both as {known}"
            raise InputError(f"--map: found {found}, expected one column for it")
        try:
            roles[known] = column_as(table, index, known, unit)
        except Undecided as question:
            open_questions[known] = question
    return roles, open_questions


def _likely(table: RawTable, free: Sequence[int], role: Role) -> list[int]:
    """The columns that may be a quantity's: by its name, else by one of a rig's parts, of a strain or of a clock."""
    for fits in (may_be, is_of_rig, is_called_of_sample):
        likely = [i for i in free if fits(table, i, role)]
        if likely:
            return likely
    if role != "time":
        return []
    return [i for i in free if are_moments(table, i)]


def _complete(table: RawTable, roles: Columns, free: Sequence[int]) -> Columns:
    """The columns of quantities, with those that units alone name; all that are needed are among them."""
    missing = [role for role in _NEEDED if role not in roles]
    if not missing:
        return roles
    used = {column.index for column in roles.values() if not _may_count(column, missing)}
    if missing == list(_NEEDED):
        by_units = units_alone(table, _NEEDED, used.union(free))
        if by_units:
            return roles | {role: _by_unit_alone(table, index, role) for role, index in by_units.items()}
    for index in free:
        if last_named(table.header[index]) == missing[0]:
            column_as(table, index, missing[0])  # its unit is another quantity's, which is said
    unread = [i for i in free if i not in used]
    raise missing_columns(table, unread, missing)


def _may_count(column: Column, missing: Sequence[Role]) -> bool:
    """Whether a column taken for numbers of holds may be the missing displacement, counted in steps of a motor."""
    return "displacement" in missing and column.role == "hold" and not words_in(column.header).isdisjoint(COUNTED)


def _one(table: RawTable, likely: Sequence[int], role: Role) -> Column:
    """The column of a quantity among those that may be it."""
    of_wire = [i for i in likely if not is_of_sample(table, i, role)]  # a force before a stress
    different = _without_copies(table, of_wire or likely)
    if role == "hold" and len(different) > 1:
        different = _that_divide(table, different)
    if role == "tension" and len(different) > 1:
        different = _only_varying(table, different)
    if len(different) > 1:
        different = _without_errors(table, different, role)
    is_measured = role in ("tension", "displacement")
    if is_measured and len(different) > 1:
        different = finest_of_same(table, different, role)
    if len(different) == 1:
        (only,) = different
        return column_as(table, only, role)
    if role == "time":
        return _one_clock(table, different)
    raise _several(table, different, role)


def _only_varying(table: RawTable, likely: list[int]) -> list[int]:
    """The only column that changes, beside a breaking load or a preload; all columns where it is not the only one."""
    varying = [i for i in likely if len(set(table.column(i))) > 1]
    return varying if len(varying) == 1 else likely


def _that_divide(table: RawTable, likely: list[int]) -> list[int]:
    """The columns that divide the readings, without those that divide them as one before; all where none does.

    Machines count several things beside each other, such as steps and cycles, most of them the same throughout.
    """
    columns = [table.column(i) for i in likely]
    changes = [tuple(a != b for a, b in pairwise(cells)) for cells in columns]
    dividing = {change: i for change, i in reversed([*zip(changes, likely, strict=True)]) if any(change)}
    return sorted(dividing.values()) or likely


def _without_copies(table: RawTable, likely: Sequence[int]) -> list[int]:
    """The columns without those that repeat the numbers of one before them, in one unit."""
    out: list[int] = []
    for index in likely:
        if not any(is_copy(table, index, other) for other in out):
            out.append(index)
    return out


def _without_errors(table: RawTable, likely: Sequence[int], role: Role) -> list[int]:
    """The columns without those that say the error of another one: ``Force error (N)`` beside ``Force (N)``."""
    words = {i: words_in(name_and_unit(table.header[i], role).name) for i in likely}
    of_error = [i for i in likely if any(words[k] < words[i] and words[i] - words[k] <= ERRORS for k in likely)]
    return [i for i in likely if i not in of_error]


def _one_clock(table: RawTable, likely: Sequence[int]) -> Column:
    """The best of several columns of time that agree; a question where they do not."""
    of_time = [i for i in likely if not _counts_elapsed(table, i)] or likely
    columns = [column_as(table, index, "time") for index in of_time]
    found = [clock_of(table, column.index, column.unit) for column in columns]
    clocks = [clock for clock in found if clock is not None]
    if len(clocks) < len(columns):
        raise _several(table, likely, "time")
    if len(clocks) == 1:
        return columns[0]
    for clock in clocks[1:]:
        row = parting(clocks[0], clock)
        if row is not None:
            raise _several(
                table,
                likely,
                "time",
                f", which tell different times from line {table.line_text(table.rows[row].line)} on",
            )
    return columns[best_clock(clocks)]


def _counts_elapsed(table: RawTable, index: int) -> bool:
    """Whether a column without a unit names something else than a time last: ``Elapsed Cycles``."""
    header = table.header[index]
    has_unit = name_and_unit(header, "time").unit is not None or bool(table.units[index])
    return not has_unit and not has_moments(table, index) and last_named(header) != "time"


def column_as(table: RawTable, index: int, role: Role, stated: str | None = None) -> Column:
    """A column as one of a quantity, in the unit that the user states, else in that of the file.

    Parameters
    ----------
    index : int
        Of the column.
    role : str
        The quantity.
    stated : str, optional
        The unit that the user states.

    Raises
    ------
    InputError
        It has no unit of the quantity.
    """
    header = table.header[index]
    if role == "hold":
        return Column(role, index, header, None)
    if stated:
        unit = quantity_unit(stated, role) or multiple_of_unit(stated, role)
        if unit is None:
            expected = f"one of {role}{_units(role)}"
            raise InputError(f"--map: found the unit {stated!r} for {header}, expected {expected}")
        return Column(role, index, header, unit)
    moments = role == "time" and has_moments(table, index)
    unit = _unit_in_table(table, index, role, stated, moments)
    if unit is None:
        if not moments:
            raise _no_unit(table, index, role)
        return Column(role, index, header, None)
    if unit.multiple != 1.0:
        _check_counts(table, index, role, unit)
    check_itself(table, index, role, unit)
    return Column(role, index, header, unit)


def _unit_in_table(table: RawTable, index: int, role: Role, stated: str | None, moments: bool) -> Unit | None:
    """The unit in a column's header or in the row under it, which must not contradict each other."""
    header = table.header[index]
    _, from_header = name_and_unit(header, role)
    if from_header is None and stated is not None and not speaks_of(header, role):
        from_header = quantity_unit(header, role)  # --map "kg=tension": the name is nothing but a unit
    text = table.units[index]
    if not text:
        return from_header
    from_row = unit_in_header(text, role)
    if text not in NO_UNIT and from_row is None and not moments:
        expected = f"one of {role}{_units(role)}"
        raise table.complain(table.header_line + 1, index, f"the unit {text!r}", expected)
    if from_header and from_row and not _are_alike(from_header, from_row):
        found = f"the units {from_header.text} in the header and {from_row.text} under it"
        raise table.complain(table.header_line, index, found, "one unit")
    return from_row or from_header


def _are_alike(unit: Unit, other: Unit) -> bool:
    """Whether numbers mean the same in two units."""
    return unit.factor == other.factor and unit.offset == other.offset


def _by_unit_alone(table: RawTable, index: int, role: Role) -> Column:
    """The column of a quantity whose header is a unit of it and nothing else."""
    unit = table.header[index].strip("[]() ")
    return replace(column_as(table, index, role, unit), by_unit_alone=True)


def _no_unit(table: RawTable, index: int, role: Role) -> InputError:
    """What is wrong with a column that says no unit of its quantity: another unit, odd clocks, or none at all."""
    header = table.header[index]
    usual = UNITS[role]
    map_to = f"--map {header}={role}"
    bracket = UNIT_IN_BRACKETS.match(header)
    foreign = bracket[2] if bracket else ""
    where = table.where(table.header_line, index)
    counted = what_is_counted(table, index, role)
    if counted:
        found, instead = counted
        expected = f"{quoted(f'{map_to} [0.5 {usual}]')}, with {instead} in place of 0.5 {usual}"
        return InputError(f"{where}: found {found}, expected {expected}")
    if role == "tension" and (is_ton(foreign) or is_ton(table.units[index])):
        tons = {f"{map_to} [{name}]": meaning for name, meaning in TONS.items()}
        return Undecided(f"{where}: found tons, which may be of 2000 lb, of 2240 lb or of 1000 kg", "which", tons)
    if foreign not in NO_UNIT and not foreign.isdigit():
        found = f"the unit {foreign!r}"
        as_usual = f"{quoted(f'{map_to} [{usual}]')} if that is what it means"
        expected = f"one of {role}{_units(role)}; or {as_usual}, or [0.5 {usual}] if one {foreign} is 0.5 {usual}"
        return table.complain(table.header_line, index, found, expected)
    first = table.rows[0]
    cell = first.cell(index)
    if role == "time" and looks_like_a_moment(cell):
        return table.complain(first.line, index, shown(cell), UNDERSTOOD)
    answers = {f"{map_to} [{name}]": name for name in _usual(table, index, role)}
    return Undecided(f"{where}: found no unit", f"the unit of {role}", answers)


def _check_counts(table: RawTable, index: int, role: Role, unit: Unit) -> None:
    """Ask what a graduation in the header means where numbers are no counts of it: it may be the step of the gauge."""
    odd = _first_no_count(table, index)
    if odd is None:
        return
    place = table.where(odd.line, index)
    whole = re.sub(r"[\d.,/·×*\s]", "", unit.text)
    map_to = f"--map {table.header[index]}={role}"
    found = f"found {odd.cell(index)!r} under {unit.text!r}, which may be the unit or the step of the gauge"
    answers = {f"{map_to} [{whole}]": f"{unit.text} is the step", f"{map_to} [{unit.text}]": f"{unit.text} is the unit"}
    raise Undecided(f"{place}: {found}", "which", answers)


def _first_no_count(table: RawTable, index: int) -> SheetRow | None:
    """The first row with a number in a column that is no count."""
    for row in table.rows:
        cell = row.cell(index)
        if is_number(cell) and not is_count(cell):
            return row
    return None


def _usual(table: RawTable, index: int, role: Role) -> tuple[str, ...]:
    """The units that a column without one is most likely in."""
    return OF_SAMPLE[role] if is_called_of_sample(table, index, role) else COMMON[role]


def _units(role: Role) -> str:
    return f" ({listed(COMMON[role], 'or')})"


def _several(table: RawTable, likely: Sequence[int], role: Role, how: str = "") -> Undecided:
    names = [table.header[i] for i in likely]
    how = how or f", each of which may be the {role}"
    answers = {f"--map {name}={role}": name for name in names}
    if role in ("tension", "displacement") and not table.specimen:
        answers["--specimens several"] = "each, as a specimen of its own"
    return Undecided(
        f"{table.sheet.path}, line {table.header_line}: found {listed(names)}{how}", "which one to read", answers
    )

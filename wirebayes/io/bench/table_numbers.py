"""The numbers of a table: holds, settings, times and readings, converted to mm, N and s."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from wirebayes.errors import InputError, shown
from wirebayes.io.bench import clock
from wirebayes.io.bench.about import About
from wirebayes.io.bench.columns import Column, Columns, understand
from wirebayes.io.bench.complete_rows import WHERE_MISSING, complete_rows
from wirebayes.io.bench.hold_clock import two_clocks
from wirebayes.io.bench.marks import without_marks
from wirebayes.io.bench.numerals import check_signs, decimal_sign, plain_number
from wirebayes.io.bench.quantities import UNITS, Role, quantity_unit
from wirebayes.io.bench.recorded import HoldClock, Readings
from wirebayes.io.bench.resolution import evident_step
from wirebayes.io.bench.sheet import is_number, of_fraction
from wirebayes.io.bench.stamps import is_coarse, spread
from wirebayes.io.bench.table import RawTable
from wirebayes.io.bench.undecided import Choices, Decimal, Undecided
from wirebayes.io.bench.unread import unread
from wirebayes.numeric.typing import Floats, Ints
from wirebayes.sentences import listed
from wirebayes.strict.table import LARGEST
from wirebayes.wire.protocol import Control

COLUMN_ROLES: dict[str, Role] = {
    "hold": "hold",
    "displacement_mm": "displacement",
    "time_s": "time",
    "tension_N": "tension",
    "temperature_C": "temperature",
}
_SIZE: dict[Role, str] = {"displacement": "length", "tension": "area"}  # what a strain and a stress are times of
READS: dict[Control, Role] = {"displacement": "tension", "force": "displacement"}  # by what is set
INCH = 25.4  # mm: rulers in inches are read in halves, quarters and so on
FAR = 0.1  # of the length: a preload stretches a wire by less, so such a first displacement is a machine's position
FAR_STEPS = 2.0  # and this many times the range of the test
_AFTER_NUMBER = re.compile(r"^[-+−\d.,\s]+")
MOST_HOLDS = 1e9  # numbers of holds stay below, as in the files that are written


@dataclass(frozen=True)
class Recorded:
    """What a file records, before it is known what was set.

    Attributes
    ----------
    table : RawTable
    columns : dict of Role to Column
    texts : dict of Role to list of str
        Numbers as they were written.
    values : dict of Role to (r,) array
    hold : (r,) array of int or None
    of_day : bool
        Whether times are moments of a day.
    numbering : list of str
        How holds that have names were numbered, in a sentence.
    not_read : int or None
        The first line without a displacement, which has that of the line above.
    hold_clock : HoldClock or None
        Where a clock of holds stands beside one of the test.
    """

    table: RawTable
    columns: Columns
    texts: dict[Role, list[str]]
    values: dict[Role, Floats]
    hold: NDArray[np.int64] | None
    of_day: bool
    numbering: list[str]
    not_read: int | None
    hold_clock: HoldClock | None = None

    def complain(self, row: int, role: str, found: str, expected: str) -> InputError:
        """The error of a cell.

        Parameters
        ----------
        row : int
            Of the table, from 0.
        role : str
            Of the column.
        found, expected : str
            As the message shows them.
        """
        return self.table.complain(self.table.rows[row].line, self.columns[role].index, found, expected)  # type: ignore[index]

    def of_rows(self, kept: Ints) -> "Recorded":
        """The same of some rows."""
        rows = tuple(self.table.rows[i] for i in kept)
        texts = {role: [cells[i] for i in kept] for role, cells in self.texts.items()}
        values = {role: numbers[kept] for role, numbers in self.values.items()}
        hold = None if self.hold is None else self.hold[kept]
        clock = self.hold_clock
        if clock is not None:
            clock = replace(clock, time_s=clock.time_s[kept])
        table = replace(self.table, rows=rows)
        return replace(self, table=table, texts=texts, values=values, hold=hold, hold_clock=clock)

    def check_zero(self, length_mm: float) -> None:
        """Refuse steps of a machine's position: how far they stretch the wire is not known. Weights pull from any zero.

        Raises
        ------
        Undecided
        """
        x = self.values["displacement"]
        nearest = float(np.abs(x).min())
        if nearest > FAR * length_mm and nearest > FAR_STEPS * float(np.ptp(x)):
            found = f"found displacements from {x.min():g} to {x.max():g} mm of a wire of {length_mm:g} mm"
            answers = {f"--zero-mm {x[0]:g}": "counted from the first reading", "--zero-mm 0": "as they stand"}
            if np.abs(x - length_mm).min() < FAR * length_mm:
                answers |= {f"--zero-mm {length_mm:g}": "lengths of the wire"}
            where = self.table.where(self.table.rows[0].line, self.columns["displacement"].index)
            raise Undecided(f"{where}: {found}", "where the wire begins to pull", answers)

    def readings(self, control: Control) -> Readings:
        """The same, by what was set."""
        role: Literal["displacement", "tension"] = "displacement" if control == "displacement" else "tension"
        unit = self.columns[role].unit
        step = (evident_step(self.texts[role]) or 0.0) * abs(unit.factor if unit else 1.0)
        return Readings(
            role,
            self.values[role],
            self.values[READS[control]],
            self.values["time"],
            self.hold,
            self.of_day,
            step,
            self.columns["time"].header,
            self.complain,
            self.hold_clock,
        )


def recorded_in(table: RawTable, about: About, choices: Choices) -> tuple[Recorded, list[str]]:
    """The numbers of a table, with what was understood on the way.

    Parameters
    ----------
    about : About
        The sample, whose length and area strains and stresses are multiplied by.
    choices : Choices
        What the user decided.
    """
    columns = understand(table, choices.mapping)
    columns = _of_sample(table, columns, about)
    not_read = _first_not_read(table, columns["displacement"])
    table, about_rows = complete_rows(table, columns, choices.drop_breaks)
    not_read = _among_readings(table, not_read)
    numbers = _plain_columns(table, columns)
    indices = [column.index for column in numbers.values()]
    decimal = decimal_sign(table, indices, choices.decimal)
    check_signs(table, indices, decimal)
    table, left_out = without_marks(table, numbers, decimal, choices.drop_breaks)
    _check_some_rows(table)

    notes = _whose(table, columns)
    notes.append(_read_as(table, columns, decimal))
    notes += _by_units_alone(columns)
    notes += about_rows
    notes += left_out

    texts = _texts(table, numbers, decimal)
    values = {role: _converted(columns[role], text) for role, text in texts.items()}
    of_holds = choices.time_since == "hold"
    values["time"], of_day = _times(table, columns["time"], values.get("time"), notes, durations=of_holds)
    _check_sizes(table, columns, values)
    values["displacement"] = _from_zero(values["displacement"], choices.zero_mm)
    hold, numbering = _hold_numbers(table, columns.get("hold"), decimal)
    recorded = Recorded(table, columns, texts, values, hold, of_day, numbering, not_read)
    recorded, used = _with_hold_clock(recorded, choices)
    notes += unread(table, used)
    return _from_zero_on(recorded, notes)


def _with_hold_clock(recorded: Recorded, choices: Choices) -> tuple[Recorded, list[Column]]:
    """Times of the test with those of its holds beside them, where the file has both, and the columns that are used."""
    used = [*recorded.columns.values()]
    if choices.time_since is not None:
        return recorded, used
    both = two_clocks(recorded.table, recorded.columns, choices.mapping, of_day=recorded.of_day)
    if both is None:
        return recorded, used
    values = recorded.values | {"time": both.time_s}
    return replace(recorded, values=values, of_day=both.of_day, hold_clock=both.of_holds), [*used, both.beside]


def _check_some_rows(table: RawTable) -> None:
    if not table.rows:
        found = "no row with a time, a displacement and a tension, all of them numbers"
        raise InputError(f"{table.sheet.path}: found {found}, expected readings")


def _first_not_read(table: RawTable, displacement: Column) -> int | None:
    """The first line without a displacement."""
    for row in table.rows:
        if not row.cell(displacement.index):
            return row.line
    return None


def _among_readings(table: RawTable, line: int | None) -> int | None:
    """A line, unless it stands below the readings."""
    return line if line in {row.line for row in table.rows} else None


def _from_zero_on(recorded: Recorded, notes: list[str]) -> tuple[Recorded, list[str]]:
    """Without the readings that a trigger keeps of the time before each hold, counted below zero."""
    time = recorded.values["time"]
    before = time < 0.0
    if not before.any() or before.all() or not (np.diff(time) < 0.0).any():
        return recorded, notes
    return recorded.of_rows(np.flatnonzero(~before)), [
        *notes,
        f"readings before time zero left out: {int(before.sum())}",
    ]


def _of_sample(table: RawTable, columns: Columns, about: About) -> Columns:
    """Columns whose units are those of this sample: strains times its length, stresses times its area."""
    size = {"displacement": about.length_mm, "tension": about.area_mm2}
    out = dict(columns)
    for role, column in columns.items():
        unit = column.unit
        if unit is None or not unit.of_sample:
            continue
        times = size[role]
        if times is None:
            found = f"a stress in {unit.text}"
            expected = "--area-mm2 A, the sample's cross-section, or a column of forces"
            raise table.complain(table.header_line, column.index, found, expected)
        absolute = replace(unit, factor=unit.factor * times)
        out[role] = replace(column, unit=absolute)
    return out


def _plain_columns(table: RawTable, columns: Columns) -> Columns:
    """All columns but one of clocks, whose cells are no numbers."""
    plain = dict(columns)
    time = columns["time"]
    if clock.is_clock(table, time.index, time.unit):
        del plain["time"]
    return plain


def _whose(table: RawTable, columns: Columns) -> list[str]:
    """The specimen that these readings are of, where there are several."""
    if not table.specimen:
        return []
    places = [table.sheet.column_name(i) for i in sorted(column.index for column in columns.values())]
    lines = f"lines {table.line_text(table.rows[0].line)} to {table.line_text(table.rows[-1].line)}"
    return [f"one of several specimens: {table.whose} in {lines}, columns {listed(places)}"]


def _read_as(table: RawTable, columns: Columns, decimal: Decimal) -> str:
    parts = []
    for role, column in columns.items():
        if table.turned and role == "hold":
            continue  # the table's own
        parts.append(f"{role} from {column.header!r}{_unit_as_read(column)}")
    comma = ", decimal comma" if decimal == "comma" else ""
    return f"{table.sheet.described}{comma}; {listed(parts)}"


def _unit_as_read(column: Column) -> str:
    """A column's unit where its header does not state it, and what is made of its numbers."""
    unit = column.unit
    if unit is None:
        return ""
    in_header = re.split(r"[\s()\[\]/_,]+", column.header)
    said = "" if unit.text in (UNITS[column.role], *in_header) else f" in {unit.text}"
    if unit.factor < 0:
        said += " (sign turned)"
    if unit.is_mass:
        said += " (its weight)"
    if unit.clock and unit.clock.leading_s:
        said += f" ({clock.CALLED[unit.clock.leading_s]})"
    if unit.of_sample:
        said += f" (times the {_SIZE[column.role]})"
    return said


def _by_units_alone(columns: Mapping[Role, Column]) -> list[str]:
    """Which columns are named by nothing but their units, in a sentence; none where all have names."""
    if not columns["displacement"].by_unit_alone:
        return []
    told = [f"{column.header} is the {role}" for role, column in columns.items() if column.by_unit_alone]
    length = columns["displacement"].header
    unless = f"if {length} is a diameter or a gauge length, say so with --map {length}=ignore"
    return [f"columns named by units alone: {listed(told)}; {unless}"]


def _texts(table: RawTable, columns: Columns, decimal: Decimal) -> dict[Role, list[str]]:
    """The numbers of each column but that of holds."""
    texts: dict[Role, list[str]] = {}
    for role, column in columns.items():
        if role != "hold":
            texts[role] = _numbers(table, column, decimal)
    return texts


def _numbers(table: RawTable, column: Column, decimal: Decimal) -> list[str]:
    in_inches = column.unit is not None and abs(column.unit.factor) == INCH
    out = []
    for row in table.rows:
        cell = row.cell(column.index)
        number = plain_number(cell, decimal)
        if number is None and in_inches:
            number = of_fraction(cell)
        if number is None:
            expected = _expected_number(cell, column.role, decimal)
            raise table.complain(row.line, column.index, shown(cell), expected)
        out.append(number)
    return out


def _expected_number(cell: str, role: Role, decimal: Decimal) -> str:
    """What should stand in place of a cell that is no number."""
    if role == "time" and clock.looks_like_a_moment(cell):
        return clock.UNDERSTOOD
    sign = "comma" if decimal == "comma" else "point"
    expected = f"a number (decimal {sign}, as elsewhere in the file)"
    if not any(c.isdigit() for c in cell):  # NaN, n/a, #N/A, a dash
        return expected + WHERE_MISSING
    if quantity_unit(_AFTER_NUMBER.sub("", cell), role):
        return "a number alone, and its unit in the header"
    return expected


def _converted(column: Column, texts: list[str]) -> Floats:
    assert column.unit is not None
    return column.unit.convert(np.array([float(text) for text in texts]))


def _times(
    table: RawTable, column: Column, numbers: Floats | None, notes: list[str], *, durations: bool
) -> tuple[Floats, bool]:
    """Times in s, of numbers or of clocks, and whether they are moments of a day; what was done joins the notes."""
    if numbers is None:
        time, of_day, passed = clock.seconds(table, column.index, column.unit, durations=durations)
        notes += passed
    else:
        time, of_day = numbers, False
    if is_coarse(table, column.index):
        time, spreading = spread(time)
        notes += spreading
    return time, of_day


def _check_sizes(table: RawTable, columns: Columns, values: Mapping[Any, Floats]) -> None:
    """Refuse numbers that no bench can mean, before anything is computed with them."""
    for name, role in COLUMN_ROLES.items():
        for row in np.flatnonzero(~(np.abs(values[role]) <= LARGEST[name]))[:1] if role in values else ():
            line, index = table.rows[row].line, columns[role].index
            expected = f"at most {LARGEST[name]:.0e} {UNITS[role]} in size"
            raise table.complain(line, index, shown(table.rows[row].cell(index)), expected)


def _from_zero(x: Floats, zero_mm: float | None) -> Floats:
    """Displacements counted from the zero-tension length, where the user says at which it is."""
    return x if zero_mm is None else np.array([float(f"{value:.12g}") for value in x - zero_mm])


def _hold_numbers(
    table: RawTable, column: Column | None, decimal: Decimal
) -> tuple[NDArray[np.int64] | None, list[str]]:
    if column is None:
        return None, []
    index = column.index
    cells = table.column(index)
    plain = [_plain_hold(cell, decimal) for cell in cells]
    if None not in plain:
        return np.array(plain, dtype=np.int64), []
    for row in table.rows:
        cell = row.cell(index)
        if is_number(cell):
            raise table.complain(row.line, index, shown(cell), "a whole number for each hold")
    names = list(dict.fromkeys(cells))
    number_of = {name: i for i, name in enumerate(names, start=1)}
    numbers = np.array([number_of[cell] for cell in cells], dtype=np.int64)
    note = f"holds numbered in order, {names[0]} to {names[-1]}"
    return numbers, [note]


def _plain_hold(cell: str, decimal: Decimal) -> int | None:
    """The number of a hold in a cell; None where it is none."""
    text = plain_number(cell, decimal)
    if text is None:
        return None
    number = float(text)
    if not number.is_integer() or not 0 <= number < MOST_HOLDS:
        return None
    return int(number)

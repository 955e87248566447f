"""A raw bench file as the experiment that it contains, with everything that was understood on the way."""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from wirebayes.errors import InputError, shown
from wirebayes.io.bench import clock, workbook
from wirebayes.io.bench.columns import Column, known_words, understand
from wirebayes.io.bench.control import recognised
from wirebayes.io.bench.decode import decode, read_raw
from wirebayes.io.bench.delimited import sheet_of_text
from wirebayes.io.bench.holds import cut, stretches
from wirebayes.io.bench.numerals import decimal_sign, plain_number
from wirebayes.io.bench.quantities import UNITS, Role
from wirebayes.io.bench.recorded import Cut, Readings
from wirebayes.io.bench.resolution import evident_step
from wirebayes.io.bench.sheet import Sheet, is_number, is_value
from wirebayes.io.bench.specimens import side_by_side
from wirebayes.io.bench.stamps import is_coarse, spread
from wirebayes.io.bench.table import RawTable, find_table
from wirebayes.io.bench.thinning import MOST, thinned
from wirebayes.io.bench.turned import turned
from wirebayes.io.bench.undecided import Choices, Decimal, Undecided
from wirebayes.io.bench.unread import unread
from wirebayes.io.data_checks import falls
from wirebayes.io.experiment import Experiment
from wirebayes.io.experiment_file import experiment_of
from wirebayes.io.readings import OPTIONAL, REQUIRED
from wirebayes.numeric.typing import Floats
from wirebayes.sentences import counted, listed
from wirebayes.strict.table import LARGEST, Table
from wirebayes.strict.toml_keys import Keys
from wirebayes.wire.protocol import Control

_COLUMN_ROLES: dict[str, Role] = {
    "hold": "hold", "displacement_mm": "displacement", "time_s": "time", "tension_N": "tension",
    "temperature_C": "temperature",
}  # fmt: skip
_SIZE: dict[Role, str] = {"displacement": "length", "tension": "area"}  # what a strain and a stress are times of
RESOLUTION: dict[Control, str] = {"displacement": "resolution_N", "force": "resolution_mm"}
READS: dict[Control, Role] = {"displacement": "tension", "force": "displacement"}  # by what is set
FAR = 0.1  # of the length: a preload stretches a wire by less, so such a first displacement is a machine's position
FAR_STEPS = 2.0  # and this many times the range of the test
_MISSING = "; where a reading is missing, delete its row"
MOST_HOLDS = 1e9  # numbers of holds stay below, as in the files that are written


@dataclass(frozen=True)
class About:
    """What a user says of the sample.

    Attributes
    ----------
    name : str
    material : str or None
        The name of each specimen when left out.
    length_mm : float
    area_mm2 : float or None
        Of its cross-section, where it is known: turns stresses into tensions.
    name_is_stated : bool
        Whether the name is the user's, and not the file's.
    """

    name: str
    material: str | None
    length_mm: float
    area_mm2: float | None = None
    name_is_stated: bool = False


@dataclass(frozen=True)
class Converted:
    """An experiment out of a raw file.

    Attributes
    ----------
    experiment : Experiment
    rows : list of list
        Of the readings' CSV, in the order of `header`.
    header : tuple of str
    notes : list of str
        What was understood and done, in sentences.
    recording : Recording or None
        Everything that was recorded, where the file counts time from the beginning of the test.
    """

    experiment: Experiment
    rows: list[list[Any]]
    header: tuple[str, ...]
    notes: list[str]
    recording: "Recording | None"


@dataclass(frozen=True)
class Recording:
    """A whole test as it was recorded, moves included.

    Attributes
    ----------
    time_s, displacement_mm, tension_N : (r,) array
        Time since the first reading.
    start_s : (H,) array
        When each hold begins.
    """

    time_s: Floats
    displacement_mm: Floats
    tension_N: Floats
    start_s: Floats


def convert(path: Path, about: About, choices: Choices) -> list[Converted]:
    """Read a raw file.

    Parameters
    ----------
    path : Path
        Text with columns, or an xlsx workbook.
    about : About
        Specimens side by side are named after what the file calls them, or by a number after this name.
    choices : Choices

    Returns
    -------
    list of Converted
        One for each specimen.

    Raises
    ------
    InputError
        With file, line and column; `Undecided` where the file can be read in several ways.
    """
    table = turned(find_table(_sheet(path, choices)))
    tables = side_by_side(table, choices.mapping, choices.specimens)
    if len(tables) == 1:
        return [_convert(each, about, replace(choices, mapping=said)) for each, said in tables]
    names = _names_of([each.specimen for each, _ in tables], about)
    return [
        _convert(each, replace(about, name=name), replace(choices, mapping=said))
        for (each, said), name in zip(tables, names, strict=True)
    ]


def _names_of(specimens: Sequence[str], about: About) -> list[str]:
    """The names of specimens' experiments: what the file calls them if it does by words, else after the file."""
    names = [name_from(specimen) for specimen in specimens]
    if len({name.casefold() for name in names}) < len(names):  # of letters that no folder's name has
        names = [str(i + 1) for i in range(len(names))]
    in_words = all(re.search("[A-Za-z]{2}", name) for name in names)
    return names if in_words and not about.name_is_stated else [f"{about.name}-{name}" for name in names]


def _convert(table: RawTable, about: About, choices: Choices) -> Converted:
    """The experiment of one specimen."""
    recorded, notes = _recorded(table, about, choices)
    table, columns, values = recorded.table, recorded.columns, recorded.values
    control = choices.control or _control(recorded)
    if control == "force" and recorded.not_read is not None:  # a setting goes on, a reading does not
        raise table.complain(recorded.not_read, columns["displacement"].index, "an empty cell", _NOT_READ)
    holds = cut(recorded.readings(control), choices.time_since)
    holds, thin = _thin(holds)
    notes += _what_was_set(control) + recorded.numbering + holds.notes + thin + _missing_holds(holds)
    resolution = _resolution(columns[READS[control]], recorded.texts[READS[control]])
    if resolution:
        read, unit = READS[control], UNITS[READS[control]]
        notes.append(f"{read}s are written in steps of {resolution:.3g} {unit}: that is their resolution")
    header = (*REQUIRED, *(OPTIONAL if "temperature" in values else ()))
    rows, origin = _rows(holds, values, control)
    experiment = _experiment(table, columns, header, rows, origin, about, resolution, control)
    _check_direction(table, columns["displacement"], experiment)
    recording = None
    if holds.of_test:
        since = holds.clock_s - holds.clock_s[0]
        starts = np.array([since[of_hold[0]] - t[0] for of_hold, t in zip(holds.rows, holds.time_s, strict=True)])
        recording = Recording(since, values["displacement"], values["tension"], starts)
    return Converted(experiment, rows, header, notes, recording)


@dataclass(frozen=True)
class _Recorded:
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
    """

    table: RawTable
    columns: dict[Role, Column]
    texts: dict[Role, list[str]]
    values: dict[Role, Floats]
    hold: NDArray[np.int64] | None
    of_day: bool
    numbering: list[str]
    not_read: int | None

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

    def readings(self, control: Control) -> Readings:
        """The same, by what was set."""
        role: Literal["displacement", "tension"] = "displacement" if control == "displacement" else "tension"
        unit = self.columns[role].unit
        step = (evident_step(self.texts[role]) or 0.0) * abs(unit.factor if unit else 1.0)
        return Readings(
            role, self.values[role], self.values[READS[control]], self.values["time"], self.hold, self.of_day, step,
            self.columns["time"].header, self.complain,
        )  # fmt: skip


def _recorded(table: RawTable, about: About, choices: Choices) -> tuple[_Recorded, list[str]]:
    """The numbers of a table, with what was understood on the way."""
    columns = _of_sample(table, understand(table, choices.mapping), about)
    not_read = next((row.line for row in table.rows if not row.cell(columns["displacement"].index)), None)
    table, notes = _complete(table, columns)
    not_read = not_read if not_read in {row.line for row in table.rows} else None  # below the readings
    decimal = decimal_sign(table, range(len(table.header)), choices.decimal)
    notes = [*_whose(table, columns), _read_as(table, columns, decimal), *notes]
    texts: dict[Role, list[str]] = {
        role: _numbers(table, column, decimal) for role, column in columns.items() if role != "hold"
        and not (role == "time" and clock.has_moments(table, column.index))
    }  # fmt: skip
    values: dict[Role, Floats] = {role: _converted(columns[role], text) for role, text in texts.items()}
    values["time"], of_day = _times(table, columns["time"], values.get("time"), notes)
    _check_sizes(table, columns, values)
    values["displacement"] = _from_zero(table, columns["displacement"], values["displacement"], about, choices.zero_mm)
    notes += unread(table, columns, choices.mapping, values["displacement"], values["time"])
    hold, numbering = _hold_numbers(table, columns.get("hold"), decimal)
    return _Recorded(table, columns, texts, values, hold, of_day, numbering, not_read), notes


def _control(recorded: _Recorded) -> Control:
    """What was set, as the readings show it."""
    unit = recorded.columns["tension"].unit
    is_mass = unit is not None and unit.is_mass
    by_tension, by_displacement = (stretches(recorded.readings(control)) for control in ("force", "displacement"))
    x = recorded.values["displacement"]
    exact = len(by_displacement) > 1 and all(np.ptp(x[rows]) == 0.0 for rows in by_displacement)
    if (exact and not is_mass) or len(by_tension) < min(2, len(by_displacement)):
        return "displacement"
    place = f"{recorded.table.sheet.path}, line {recorded.table.header_line}"
    return recognised(
        by_tension, x, recorded.values["tension"], is_mass, place
    )  # fmt: skip


_NOT_READ = (
    "a reading, or no such line: a hold in which nothing was read stands in the experiment file, as "
    "[[experiment.unrecorded_holds]]"
)


def _what_was_set(control: Control) -> list[str]:
    if control == "displacement":
        return []
    return ["a test under weights or force control: tensions stay within holds while displacements drift"]


def _rows(holds: Cut, values: Mapping[Any, Floats], control: Control) -> tuple[list[list[Any]], list[int]]:
    """Rows of the readings' CSV, and the row of the table that each comes from.

    A hold that went on after its last reading has a row without a reading at its end.
    """
    rows: list[list[Any]] = []
    origin: list[int] = []
    read = values[READS[control]]
    for of_hold, number, level, times, end in zip(
        holds.rows, holds.number, holds.setting, holds.time_s, holds.end_s, strict=True
    ):
        readings: list[tuple[float, float | None, int]] = [
            (_tidy(time), float(read[row]), int(row)) for row, time in zip(of_hold, times, strict=True)
        ]
        if end is not None and _tidy(end) > readings[-1][0]:
            readings.append((_tidy(end), None, readings[-1][2]))
        for time, value, row in readings:
            x, tension = (level, value) if control == "displacement" else (value, level)
            temperature = None if value is None or "temperature" not in values else float(values["temperature"][row])
            rows.append([number, x, time, tension, temperature][: 5 if "temperature" in values else 4])
            origin.append(row)
    return rows, origin


def _of_sample(table: RawTable, columns: dict[Role, Column], about: About) -> dict[Role, Column]:
    """Columns whose units are those of this sample: strains times its length, stresses times its area."""
    size = {"displacement": about.length_mm, "tension": about.area_mm2}
    out = dict(columns)
    for role, column in columns.items():
        if column.unit is None or not column.unit.of_sample:
            continue
        times = size[role]
        if times is None:
            found = f"a stress in {column.unit.text}"
            expected = "--area-mm2 A, the sample's cross-section, or a column of forces"
            raise table.complain(table.header_line, column.index, found, expected)
        out[role] = replace(column, unit=replace(column.unit, factor=column.unit.factor * times))
    return out


def _sheet(path: Path, choices: Choices) -> Sheet:
    raw = read_raw(path)
    if raw.startswith(workbook.SIGNATURE):
        return workbook.sheet_of_workbook(path, raw, choices.sheet)
    if raw.startswith(workbook.OLD_EXCEL):
        raise InputError(f"{path}: found a workbook of Excel 2003 or older, expected xlsx or text; save it as xlsx")
    if choices.sheet is not None:
        raise InputError(f"{path}: found a text file, expected a workbook for --sheet {choices.sheet}")
    text, encoding = decode(path, raw, known_words)
    return sheet_of_text(path, text, encoding)


def _complete(table: RawTable, columns: dict[Role, Column]) -> tuple[RawTable, list[str]]:
    """Without rows that hold nothing of what is read, exact repetitions, and empty cells of a hold's later rows."""
    notes, rows = [], list(table.rows)
    indices = [column.index for column in columns.values()]
    measured = [columns[role].index for role in ("time", "tension")]
    while rows and not any(is_value(rows[-1].cell(i)) for i in indices):
        rows.pop()  # what stands under the readings
    below = len(table.rows) - len(rows)
    rows = [row for row in rows if any(row.cell(i) for i in indices)]
    if below:
        notes.append(f"{counted(below, 'line')} under the readings left out")
    filled = []
    last = dict.fromkeys(indices, "")
    for row in rows:
        cells = list(row.cells) + [""] * (len(table.header) - len(row.cells))
        for role in ("hold", "displacement"):
            if role in columns and not cells[columns[role].index]:
                cells[columns[role].index] = last[columns[role].index]
        last = {index: cells[index] for index in indices}
        filled.append(replace(row, cells=tuple(cells)))
    gaps = sum(a.cells[i] != b.cell(i) for a, b in zip(filled, rows, strict=True) for i in indices)
    if gaps:
        notes.append(f"{gaps} empty cells of hold or displacement filled with the value above them")
    kept = [row for i, row in enumerate(filled) if not i or row.cells != filled[i - 1].cells]
    times = [row.cells[columns["time"].index] for row in kept]
    repeating = any(a == b for a, b in zip(times, times[1:], strict=False))
    if repeating and is_coarse(replace(table, rows=tuple(filled)), columns["time"].index):
        kept = filled  # readings that agree, not copies
    if len(kept) < len(filled):
        notes.append(f"rows that repeat the row above left out: {len(filled) - len(kept)}")
    for row in kept:
        for index in indices:
            if not row.cells[index]:
                missing = f"a number{_MISSING}" if index in measured else "a value here or in a line above"
                raise table.complain(row.line, index, "an empty cell", missing)
    return replace(table, rows=tuple(kept)), notes


def _whose(table: RawTable, columns: dict[Role, Column]) -> list[str]:
    """Of which specimen these columns are, where several stand side by side."""
    if not table.specimen:
        return []
    places = [table.sheet.column_name(i) for i in sorted(column.index for column in columns.values())]
    return [f"specimens side by side: {table.whose} in columns {listed(places)}"]


def _read_as(table: RawTable, columns: dict[Role, Column], decimal: Decimal) -> str:
    parts = []
    for role, column in columns.items():
        if table.turned and role == "hold":
            continue  # the table's own
        stated = column.unit is None or column.unit.text in (UNITS[role], *re.split(r"[\s()\[\]/_,]+", column.header))
        unit = "" if stated or column.unit is None else f" in {column.unit.text}"
        how = " (sign turned)" if column.unit and column.unit.factor < 0 else ""
        how += " (its weight)" if column.unit and column.unit.is_mass else ""
        how += f" (times the {_SIZE[role]})" if column.unit and column.unit.of_sample else ""
        parts.append(f"{role} from {column.header!r}{unit}{how}")
    comma = ", decimal comma" if decimal == "comma" else ""
    return f"{table.sheet.described}{comma}; {listed(parts)}"


def _numbers(table: RawTable, column: Column, decimal: Decimal) -> list[str]:
    out = []
    for row in table.rows:
        number = plain_number(row.cell(column.index), decimal)
        if number is None:
            sign = "comma" if decimal == "comma" else "point"
            expected = f"a number (decimal {sign}, as elsewhere in the file)"
            if not any(c.isdigit() for c in row.cell(column.index)):  # NaN, n/a, #N/A, a dash
                expected += _MISSING
            if column.role == "time" and clock.looks_like_a_moment(row.cell(column.index)):
                expected = clock.UNDERSTOOD
            raise table.complain(row.line, column.index, shown(row.cell(column.index)), expected)
        out.append(number)
    return out


def _converted(column: Column, texts: list[str]) -> Floats:
    assert column.unit is not None
    return column.unit.convert(np.array([float(text) for text in texts]))


def _times(table: RawTable, column: Column, numbers: Floats | None, notes: list[str]) -> tuple[Floats, bool]:
    """Times in s, of numbers or of clocks, and whether they are moments of a day; what was done joins the notes."""
    time, of_day = (numbers, False) if numbers is not None else clock.seconds(table, column.index, column.unit)
    if is_coarse(table, column.index):
        time, spreading = spread(time)
        notes += spreading
    return time, of_day


def _check_sizes(table: RawTable, columns: dict[Role, Column], values: Mapping[Any, Floats]) -> None:
    """Refuse numbers that no bench can mean, before anything is computed with them."""
    for name, role in _COLUMN_ROLES.items():
        for row in np.flatnonzero(~(np.abs(values[role]) <= LARGEST[name]))[:1] if role in values else ():
            line, index = table.rows[row].line, columns[role].index
            expected = f"at most {LARGEST[name]:.0e} {UNITS[role]} in size"
            raise table.complain(line, index, shown(table.rows[row].cell(index)), expected)


def _check_direction(table: RawTable, column: Column, experiment: Experiment) -> None:
    """Refuse a displacement counted downwards: the wire pulls the more, the further it is below zero."""
    holds = experiment.recorded_holds
    place, pull = (
        np.array(v) for v in zip(*((np.mean(h.displacement_mm), np.mean(h.tension_N)) for h in holds), strict=True)
    )
    if place.max() > 0 or not falls(place, pull):
        return
    found = f"displacements down to {place.min():g} mm, the further down the more tension"
    expected = f"what lengthens the wire counted up; change the sign with {_turned(column)}"
    raise table.complain(table.rows[0].line, column.index, found, expected)


def _turned(column: Column) -> str:
    """The option that turns the sign of a column."""
    unit = column.unit.text if column.unit else UNITS[column.role]
    return f'--map "{column.header}={column.role} [{unit[1:] if unit[0] in "-−" else f"-{unit}"}]"'


def _from_zero(table: RawTable, column: Column, x: Floats, about: About, zero_mm: float | None) -> Floats:
    """Displacements counted from the zero-tension length, refused where they are a machine's position."""
    if zero_mm is not None:
        return np.array([float(f"{value:.12g}") for value in x - zero_mm])
    nearest = float(np.abs(x).min())
    if nearest > FAR * about.length_mm and nearest > FAR_STEPS * float(np.ptp(x)):
        found = f"displacements from {x.min():g} to {x.max():g} mm of a wire of {about.length_mm:g} mm"
        answers = {f"--zero-mm {x[0]:g}": "counted from the first reading", "--zero-mm 0": "as they stand"}
        place = f"{table.sheet.path}, {table.place(table.rows[0].line, column.index)}"
        raise Undecided(f"{place}: found {found}", "where the wire begins to pull", answers)
    return x


def _hold_numbers(
    table: RawTable, column: Column | None, decimal: Decimal
) -> tuple[NDArray[np.int64] | None, list[str]]:
    if column is None:
        return None, []
    cells = table.column(column.index)
    plain = [plain_number(cell, decimal) for cell in cells]
    if all(number is not None and float(number).is_integer() and 0 <= float(number) < MOST_HOLDS for number in plain):
        return np.array([int(float(number or 0)) for number in plain], dtype=np.int64), []
    odd = next((row for row in table.rows if is_number(row.cell(column.index))), None)
    if odd is not None:
        raise table.complain(odd.line, column.index, shown(odd.cell(column.index)), "a whole number for each hold")
    names = list(dict.fromkeys(cells))
    number_of = {name: i + 1 for i, name in enumerate(names)}
    numbers = np.array([number_of[cell] for cell in cells], dtype=np.int64)
    return numbers, [f"holds numbered in order, {names[0]} to {names[-1]}"]


def _thin(holds: Cut) -> tuple[Cut, list[str]]:
    kept = [thinned(times) for times in holds.time_s]
    before, after = sum(map(len, holds.rows)), sum(map(len, kept))
    if before == after:
        return holds, []
    rows = [of_hold[k] for of_hold, k in zip(holds.rows, kept, strict=True)]
    times = [of_hold[k] for of_hold, k in zip(holds.time_s, kept, strict=True)]
    note = (
        f"{after} of {before} readings kept: those of holds with more than {MOST} thinned to times spaced evenly in "
        "their logarithm"
    )
    return replace(holds, rows=rows, time_s=times), [note]


def _missing_holds(holds: Cut) -> list[str]:
    missing = sorted(set(range(min(holds.number), max(holds.number))) - set(holds.number))
    if not missing or len(missing) > len(holds.number):
        return []
    one = len(missing) == 1
    return [
        f"hold{'s' * (not one)} {listed([str(n) for n in missing])} {'has' if one else 'have'} no readings: if "
        f"{'it was' if one else 'they were'} held, say how long with unrecorded_holds in the TOML file"
    ]


def _resolution(column: Column, texts: list[str]) -> float | None:
    step = evident_step(texts)
    if step is None or column.unit is None:
        return None
    return float(f"{step * abs(column.unit.factor):.12g}")


def _tidy(time: float) -> float:
    """A difference of times without the binary's last digits."""
    return round(float(time), 9) + 0.0


def _experiment(
    table: RawTable, columns: dict[Role, Column], header: tuple[str, ...], rows: list[list[Any]], origin: list[int],
    about: About, resolution: float | None, control: Control,
) -> Experiment:  # fmt: skip
    """The experiment checked as the reader of files checks its own, blaming the raw file's lines."""
    keys = {"name": about.name, "material": about.material or about.name, "length_mm": about.length_mm}
    extra: dict[str, Any] = {"control": control} if control != "displacement" else {}
    extra |= {RESOLUTION[control]: resolution} if resolution else {}

    def readings() -> Table:
        texts = [["" if value is None else repr(value) for value in row] for row in rows]
        return _RawReadings(table.sheet.path, list(header), texts, table, columns, origin)

    return experiment_of(_Options(table.sheet.path, "", None, keys | extra), readings)


@dataclass(frozen=True)
class _RawReadings(Table):
    """Readings whose complaints name the line and column of the raw file."""

    raw: RawTable
    columns: dict[Role, Column]
    origin: list[int]

    def complain(self, row: int, column: str, found: str, expected: str) -> InputError:
        tension, displacement = (_turned(self.columns[role]) for role in ("tension", "displacement"))
        both = f"the signs with {displacement} {tension}"
        expected = expected.replace("the signs of displacement_mm and of tension_N", both)
        expected = expected.replace("the sign of tension_N", f"the sign with {tension}")
        return super().complain(row, column, found, expected)

    def place(self, row: int, column: str) -> str:
        role = _COLUMN_ROLES[column]
        known = self.columns.get(role) or self.columns["displacement"]
        return self.raw.place(self.raw.rows[self.origin[row]].line, known.index)


class _Options(Keys):
    """Options of a command in place of the keys of a file."""

    def complain(self, key: str, found: str, expected: str) -> InputError:
        if key == "readings":
            return InputError(f"{self.source}: found {found.partition(' in ')[0]}, expected {expected}")
        return InputError(f"--{key.replace('_', '-')}: found {found}, expected {expected}")


def toml_of(experiment: Experiment, comments: Sequence[str] = ()) -> str:
    """The experiment file of a test whose readings stand in ``NAME.csv`` beside it."""
    lines = [f"# {comment}" for comment in comments]
    lines += ["[[experiment]]", f"name = {_string(experiment.name)}", f"material = {_string(experiment.material)}"]
    lines.append(f"length_mm = {experiment.length_mm!r}")
    if experiment.control != "displacement":
        lines.append(f"control = {_string(experiment.control)}")
    if experiment.resolution:
        lines.append(f"{RESOLUTION[experiment.control]} = {experiment.resolution!r}")
    lines.append(f"readings = {_string(experiment.name + '.csv')}")
    return "\n".join(lines) + "\n"


def _string(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def default_name(path: Path) -> str:
    """The name of an experiment from the name of its file: what a folder may be called."""
    return name_from(path.stem) or "experiment"


def name_from(text: str) -> str:
    """The letters, digits, points and dashes of a text, with dashes for what is between them; perhaps none."""
    return "".join(c if c.isascii() and (c.isalnum() or c in "._-") else "-" for c in text).strip("-.")

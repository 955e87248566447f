"""A raw bench file as the experiment that it contains, with everything that was understood on the way."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from wirebayes.errors import InputError
from wirebayes.io.bench import workbook
from wirebayes.io.bench.about import About, name_from
from wirebayes.io.bench.as_experiment import as_experiment, check_direction, entries_of
from wirebayes.io.bench.block_titles import with_titles_as_columns
from wirebayes.io.bench.cell_units import with_units_apart
from wirebayes.io.bench.clock_parts import with_joined_parts
from wirebayes.io.bench.columns import Column
from wirebayes.io.bench.control import recognised, recognised_of_pairs
from wirebayes.io.bench.dates_apart import with_dates
from wirebayes.io.bench.decode import decode, read_raw
from wirebayes.io.bench.delimited import sheet_of_text
from wirebayes.io.bench.glitches import without_glitches
from wirebayes.io.bench.holds import cut, stretches
from wirebayes.io.bench.joined import HOLD, lacking, one_table
from wirebayes.io.bench.no_weight import without_weight
from wirebayes.io.bench.parts_of_seconds import with_whole_seconds
from wirebayes.io.bench.quantities import UNITS
from wirebayes.io.bench.recorded import Cut
from wirebayes.io.bench.resolution import evident_step
from wirebayes.io.bench.sheet import Sheet
from wirebayes.io.bench.specimens import specimen_tables
from wirebayes.io.bench.specimens_below import tests_of_specimens
from wirebayes.io.bench.table import RawTable, find_table
from wirebayes.io.bench.table_numbers import READS, Recorded, recorded_in
from wirebayes.io.bench.thinning import MOST, kept_readings
from wirebayes.io.bench.turned import row_for_each_reading
from wirebayes.io.bench.undecided import Choices
from wirebayes.io.bench.unit_names import with_units_beside
from wirebayes.io.bench.words import known_words
from wirebayes.io.experiment import Experiment
from wirebayes.io.experiment_file import Entry
from wirebayes.io.readings import OPTIONAL, REQUIRED
from wirebayes.numeric.typing import Floats
from wirebayes.result_warnings import Notice
from wirebayes.sentences import holds_in_words, short
from wirebayes.wire.protocol import Control


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
    warnings : tuple of Notice
        What of the recording has no place in the experiment.
    unrecorded : sequence of dict
        Holds without a record, as an experiment file states them.
    """

    experiment: Experiment
    rows: list[list[Any]]
    header: tuple[str, ...]
    notes: list[str]
    recording: "Recording | None"
    warnings: tuple[Notice, ...]
    unrecorded: Sequence[Entry] = ()


@dataclass(frozen=True)
class Recording:
    """A whole test as it was recorded, moves included.

    Attributes
    ----------
    time_s, displacement_mm, tension_N : (r,) array
        Time since the first reading.
    start_s : (H,) array
        When each hold begins, those without a record among them.
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

    Returns
    -------
    list of Converted
        One for each specimen.

    Raises
    ------
    InputError
        With file, line and column; `Undecided` where the file can be read in several ways.
    """
    return _of_table(row_for_each_reading(find_table(_sheet(path, choices))), about, choices)


def convert_joined(paths: Sequence[Path], about: About, choices: Choices) -> Converted:
    """Read raw files that are the holds of one test.

    Parameters
    ----------
    paths : sequence of Path
        In the order in which they were given.
    about : About
    choices : Choices
        `each_file` says what was set, or that the columns or the names of the files do.

    Raises
    ------
    InputError
        As `convert`, and where the files cannot be joined.
    """
    tables = [find_table(_sheet(path, choices)) for path in paths]
    each_file = HOLD if choices.each_file is None else choices.each_file
    table, notes = one_table(tables, each_file, choices.mapping)
    made = _of_table(table, about, choices)
    if len(made) > 1:
        raise InputError(f"{table.sheet.path}: found {len(made)} specimens, expected one whose holds these are")
    return replace(made[0], notes=[*notes, *made[0].notes])


def lacks_a_setting(path: Path, choices: Choices) -> bool:
    """Whether a file has a column of displacement or of tension, and not both."""
    return len(lacking(find_table(_sheet(path, choices)), choices.mapping)) == 1


def _of_table(table: RawTable, about: About, choices: Choices) -> list[Converted]:
    """The experiments of the specimens of a table."""
    table = with_units_beside(table)
    table = with_titles_as_columns(table, choices.mapping)
    table = with_whole_seconds(table, choices.mapping)
    table = with_joined_parts(table, choices.mapping)
    table = with_dates(table, choices.time_since)
    tables = specimen_tables(table, choices.mapping, choices.specimens)
    if len(tables) == 1:
        ((only, mapping),) = tables
        choices = replace(choices, mapping=mapping)
        return _one_below_another(only, about, choices)
    names = _names_of([each.specimen for each, _ in tables], about)
    made = []
    for (each, mapping), name in zip(tables, names, strict=True):
        of_specimen = replace(about, name=name)
        said = replace(choices, mapping=mapping)
        made.append(_of_specimen(each, of_specimen, said))
    return made


def _one_below_another(table: RawTable, about: About, choices: Choices) -> list[Converted]:
    """The experiments of specimens whose tests follow each other; of the only one, where there are not several."""
    recorded, notes = recorded_in(table, about, choices)
    tables = tests_of_specimens(recorded, choices.mapping, choices.specimens)
    if len(tables) == 1:
        return [_convert(recorded, notes, about, choices)]
    names = _names_of([each.specimen for each in tables], about)
    return [_of_specimen(each, replace(about, name=name), choices) for each, name in zip(tables, names, strict=True)]


def _of_specimen(table: RawTable, about: About, choices: Choices) -> Converted:
    """The experiment of a table that holds one specimen."""
    recorded, notes = recorded_in(table, about, choices)
    return _convert(recorded, notes, about, choices)


def _names_of(specimens: Sequence[str], about: About) -> list[str]:
    """The names of specimens' experiments: what the file calls them if it does by words, else after the file."""
    names = [name_from(specimen) for specimen in specimens]
    if len({name.casefold() for name in names}) < len(names):  # of letters that no folder's name has
        names = [str(i + 1) for i in range(len(names))]
    in_words = all(re.search("[A-Za-z]{2}", name) for name in names)
    return names if in_words and not about.name_is_stated else [f"{about.name}-{name}" for name in names]


def _convert(recorded: Recorded, notes: list[str], about: About, choices: Choices) -> Converted:
    """The experiment of one specimen, of which it is known what was recorded and, in sentences, understood."""
    control = choices.control or _control(recorded)
    by_weights = control == "force"
    recorded, left_out = without_glitches(recorded, control, choices.drop_breaks)
    table, columns, values = recorded.table, recorded.columns, recorded.values
    of_displacement = columns["displacement"]
    if not by_weights and choices.zero_mm is None:
        recorded.check_zero(about.length_mm)
    if by_weights and recorded.not_read is not None:  # a setting goes on, a reading does not
        raise table.complain(recorded.not_read, of_displacement.index, "an empty cell", _NOT_READ)
    holds = cut(recorded.readings(control), choices.time_since)
    if by_weights:
        holds = without_weight(holds, values["tension"])
    holds, thinned = _thin(holds)
    read = READS[control]
    resolution = _resolution(columns[read], recorded.texts[read])

    notes += left_out
    notes += _what_was_set(control)
    notes += recorded.numbering
    notes += holds.notes
    notes += thinned
    notes += _missing_holds(holds)
    if resolution:
        step = f"{short(resolution, 3)} {UNITS[read]}"
        notes.append(f"{read}s are written in steps of {step}: that is their resolution")

    header = (*REQUIRED, *OPTIONAL) if "temperature" in values else REQUIRED
    rows, origin = _rows(holds, values, control)
    unrecorded = entries_of(holds.cycles, control)
    experiment = as_experiment(table, columns, header, rows, origin, about, resolution, control, unrecorded)
    check_direction(table, of_displacement, experiment, choices.mapping)
    recording = _recording(holds, values) if holds.of_test else None
    return Converted(experiment, rows, header, notes, recording, holds.warnings, unrecorded)


def _recording(holds: Cut, values: Mapping[Any, Floats]) -> Recording:
    """Everything that was recorded, with the moments at which holds begin."""
    since = holds.clock_s - holds.clock_s[0]
    starts = [since[of_hold[0]] - t[0] for of_hold, t in zip(holds.rows, holds.time_s, strict=True)]
    of_cycles = [cycles.begin_s - holds.clock_s[0] for cycles in holds.cycles]
    return Recording(since, values["displacement"], values["tension"], np.sort([*starts, *of_cycles]))


def _control(recorded: Recorded) -> Control:
    """What was set, as the readings show it."""
    unit = recorded.columns["tension"].unit
    is_mass = unit is not None and unit.is_mass
    by_tension = stretches(recorded.readings("force"))
    by_displacement = stretches(recorded.readings("displacement"))
    x = recorded.values["displacement"]
    tension = recorded.values["tension"]
    stays = all(np.ptp(x[rows]) == 0.0 for rows in by_displacement)
    if stays and len(by_displacement) > 1 and not is_mass:
        return "displacement"
    if len(by_tension) < min(2, len(by_displacement)):
        return "displacement"
    table = recorded.table
    place = f"{table.sheet.path}, line {table.header_line}"
    if by_tension:
        return recognised(by_tension, x, tension, is_mass, place)
    pairs = stretches(recorded.readings("force"), fewest=2)
    return recognised_of_pairs(pairs, x, tension, is_mass, place)


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
    warmth = values.get("temperature")
    for hold, number in enumerate(holds.number):
        level = holds.setting[hold]
        for time, row, is_read in _rows_of_hold(holds, hold):
            value = float(read[row]) if is_read else None
            cells = [level, time, value]
            if control == "force":
                cells.reverse()
            if warmth is not None:
                cells.append(float(warmth[row]) if is_read else None)
            rows.append([number, *cells])
            origin.append(row)
    return rows, origin


def _rows_of_hold(holds: Cut, hold: int) -> list[tuple[float, int, bool]]:
    """Time and row of the table of each reading of a hold, and of its end if that is later; and whether it is read."""
    times = [_tidy(time) for time in holds.time_s[hold]]
    rows = [int(row) for row in holds.rows[hold]]
    last_s, last = times[-1], rows[-1]
    end = holds.end_s[hold]
    end_s = last_s if end is None else _tidy(end)
    if holds.number[hold] in holds.unread:
        return [(max(last_s, end_s), last, False)]
    readings = []
    for time, row in zip(times, rows, strict=True):
        readings.append((time, row, True))
    if end_s > last_s:
        readings.append((end_s, last, False))
    return readings


def _sheet(path: Path, choices: Choices) -> Sheet:
    raw = read_raw(path)
    if raw.startswith(workbook.SIGNATURE):
        return with_units_apart(workbook.sheet_of_workbook(path, raw, choices.sheet, choices.decimal))
    if raw.startswith(workbook.OLD_EXCEL):
        raise InputError(f"{path}: found a workbook of Excel 2003 or older, expected xlsx or text; save it as xlsx")
    if choices.sheet is not None:
        raise InputError(f"{path}: found a text file, expected a workbook for --sheet {choices.sheet}")
    text, encoding = decode(path, raw, known_words)
    return with_units_apart(sheet_of_text(path, text, encoding))


def _thin(holds: Cut) -> tuple[Cut, list[str]]:
    rows, times = [], []
    before, after = 0, 0
    for of_hold, time_s in zip(holds.rows, holds.time_s, strict=True):
        kept = kept_readings(time_s)
        rows.append(of_hold[kept])
        times.append(time_s[kept])
        before += len(of_hold)
        after += len(kept)
    if before == after:
        return holds, []
    note = (
        f"{after} of {before} readings kept: those of holds with more than {MOST} thinned to times spaced evenly in "
        "their logarithm"
    )
    return replace(holds, rows=rows, time_s=times), [note]


def _missing_holds(holds: Cut) -> list[str]:
    missing = sorted(set(range(min(holds.number), max(holds.number))) - set(holds.number))
    if not missing or len(missing) > len(holds.number):
        return []
    have, they_were = ("has", "it was") if len(missing) == 1 else ("have", "they were")
    return [
        f"{holds_in_words(missing)} {have} no readings: if "
        f"{they_were} held, say how long with unrecorded_holds in the TOML file"
    ]


def _resolution(column: Column, texts: list[str]) -> float | None:
    step = evident_step(texts)
    if step is None or column.unit is None:
        return None
    return float(f"{step * abs(column.unit.factor):.12g}")


def _tidy(time: float) -> float:
    """A difference of times without the binary's last digits."""
    return round(float(time), 9) + 0.0

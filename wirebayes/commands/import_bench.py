"""Raw files of benches turned into experiment files."""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TypeVar, get_args

from wirebayes._version import __version__
from wirebayes.commands.options import above_zero, check_choice, names_given, one_number, without_breaks
from wirebayes.errors import InputError
from wirebayes.io import data_checks, gross_events
from wirebayes.io.bench.about import About, common_name, default_name
from wirebayes.io.bench.convert import Converted, convert, convert_joined, lacks_a_setting
from wirebayes.io.bench.joined import HOLD, TEST, in_natural_order, name_settings, path_of_all
from wirebayes.io.bench.undecided import Choices, Decimal, Specimens, TimeSince, Undecided
from wirebayes.io.experiment_file import toml_of
from wirebayes.io.readings import READ
from wirebayes.io.run_folder import open_run, write_csv, write_json, write_text
from wirebayes.json_files.imported import ImportedExperiment, ImportJson
from wirebayes.result_warnings import notices_by_part, to_json
from wirebayes.sentences import listed
from wirebayes.strict.files import PathLike, given_path, read_bytes
from wirebayes.views.imported_tests import IMPORTED, ImportedTests
from wirebayes.views.result import ResultFolder
from wirebayes.wire.protocol import Control

Read = TypeVar("Read")
TOGETHER = "experiments"  # the file of all, where there are several
_WithFiles = tuple[str, Converted]  # and the names of the files that it came from
_Ask = Callable[[Undecided], str]  # which of the possible answers holds


def import_bench(
    raw: PathLike | Sequence[PathLike],
    *,
    length_mm: float,
    material: str | None = None,
    name: str | None = None,
    mapping: str | Sequence[str] = (),
    decimal: Decimal | None = None,
    time_since: TimeSince | None = None,
    sheet: str | None = None,
    zero_mm: float | None = None,
    area_mm2: float | None = None,
    control: Control | None = None,
    specimens: Specimens | None = None,
    each_file: str | None = None,
    drop_breaks: bool = False,
    output: PathLike | None = None,
    ask: Callable[[Undecided], str] | None = None,
) -> ImportedTests:
    """Turn what benches write into experiments.

    Delimiter, decimal sign, encoding, preamble, units and the meaning of the columns are recognised; readings are cut
    into holds. What can be read in two ways is refused.

    Parameters
    ----------
    raw : path, or sequence of paths
        Text with columns (CSV and its kin) or xlsx workbooks, or folders of such: one experiment each, or one for each
        of the specimens in it, side by side or one below another.
    length_mm : float
        Zero-tension length of the samples before the test.
    material : str, optional
        Samples of one material may be fitted together; the name of each experiment when left out.
    name : str, optional
        Of the experiment, where there is one file; else each has the name of its file. Specimens of one file have
        the names that the file gives them, or numbers after this one.
    mapping : sequence of str
        ``HEADER=COLUMN`` with COLUMN one of hold, displacement, time, tension, temperature, or ignore. The unit is
        read from the header, from the row under it, or from here: ``HEADER=tension [N]``. A minus turns the sign:
        ``HEADER=tension [-N]``.
    decimal : {"point", "comma"}, optional
        The decimal sign, where the file leaves it open.
    time_since : {"hold", "test"}, optional
        What times count from, where the file leaves it open.
    sheet : str, optional
        Of a workbook with readings in several sheets.
    zero_mm : float, optional
        Reading of the displacement where the wire has its zero-tension length.
    area_mm2 : float, optional
        Cross-section of the samples, which turns stresses into tensions.
    control : {"displacement", "force"}, optional
        What was set in each hold, where the readings leave it open.
    specimens : {"several", "one"}, optional
        Whether columns side by side, or tests one below another, are of several specimens, where the file leaves it
        open.
    each_file : str, optional
        What each of several files is: ``test``, or a ``hold`` of one test; or what was set in each of these holds:
        ``1 mm, 2 mm, 3 mm``.
    drop_breaks : bool
        Leave out the readings of breaks, of sensors at their limit, and of dropouts, and rows without a number.
    output : path, optional
        Folder for ``NAME.toml``, ``NAME.csv`` and the picture ``NAME.svg``; a temporary one when left out.
    ask : function of an undecided question that returns one of its answers, optional
        Asks a person instead of refusing.

    Returns
    -------
    ImportedTests

    Raises
    ------
    InputError
        With the file, line and column, what was found and what was expected.

    Examples
    --------
    >>> rows = ["Weg [mm];Zeit [s];Kraft [N]", "1,5;0;2,12", "1,5;30;1,91", "1,5;60;1,86", "3,0;0;4,02", "3,0;45;3,88"]
    >>> with open("bench.csv", "w") as file:
    ...     _ = file.write("\\n".join(rows))
    >>> imported = wb.import_bench("bench.csv", length_mm=1000, material="Dyneema 1 mm")
    >>> imported
    ImportedTests(bench: 2 holds, 5 readings)
    >>> imported.experiments[0].tension().shape
    (2, 3)
    """
    _check_options(decimal, time_since, control, specimens)
    above_zero(("--length-mm", length_mm))
    if area_mm2 is not None:
        above_zero(("--area-mm2", area_mm2))
    if isinstance(raw, str) or not isinstance(raw, Sequence):
        raw = [raw]
    paths = raw_files([given_path("raw", path) for path in raw])
    names = _names(paths, name, each_file)
    length = float(length_mm)
    zero = None if zero_mm is None else one_number("--zero-mm", zero_mm, "a displacement in mm")
    area = None if area_mm2 is None else float(area_mm2)
    said = names_given("mapping", mapping)
    choices = Choices(said, decimal, time_since, sheet, zero, control, specimens, each_file, drop_breaks)
    is_stated = name is not None
    samples = [About(own, material, length, area, name_is_stated=is_stated) for own in names]
    tests, choices = _read_all(paths, samples, choices, ask)
    if drop_breaks:
        tests = [(path, _without_breaks(test)) for path, test in tests]
    configuration = {
        "command": "import",
        "version": __version__,
        "raw": {path.name: hashlib.sha256(read_bytes(path)).hexdigest() for path in paths},
        "names": names,
        "length_mm": length,
        "material": material,
        "area_mm2": area,
        **vars(choices),
    }
    place = ResultFolder.at(output)
    with open_run(place.path, configuration) as run:
        if run.state != "done":
            _write(place.path, tests)
            run.finish()
    return ImportedTests(place, computed=run.state != "done")


def _check_options(
    decimal: Decimal | None, time_since: TimeSince | None, control: Control | None, specimens: Specimens | None
) -> None:
    stated = {
        "decimal": (decimal, Decimal),
        "time_since": (time_since, TimeSince),
        "control": (control, Control),
        "specimens": (specimens, Specimens),
    }
    for option, (value, choices) in stated.items():
        if value is not None:
            check_choice(option, value, get_args(choices))


def raw_files(given: Sequence[Path]) -> list[Path]:
    """The files that are given, and those of the folders among them; several by their names, numbers as numbers.

    Parameters
    ----------
    given : sequence of Path
    """
    found: list[Path] = []
    for path in given:
        inside = _files_in(path) if path.is_dir() else [path]
        if not inside:
            raise InputError(f"{path}: found an empty folder, expected files of a bench")
        found += inside
    return in_natural_order(found) if found != list(given) else found


def _files_in(folder: Path) -> list[Path]:
    """The files of a folder, without hidden ones."""
    return [path for path in folder.iterdir() if path.is_file() and not path.name.startswith(".")]


def _names(paths: Sequence[Path], name: str | None, each_file: str | None) -> list[str]:
    if not paths:
        raise InputError("raw: found nothing, expected at least one file")
    of_one_test = _are_of_one_test(each_file)
    if of_one_test and len(paths) == 1:
        raise InputError(f"--each-file: found {each_file!r} for one file, expected several files")
    if name is None:
        return [default_name(path) for path in paths]
    if len(paths) > 1 and not of_one_test:
        expected = f"it with one file only, or with --each-file {HOLD}"
        raise InputError(f"--name: found {name!r} for {len(paths)} files, expected {expected}")
    return [name] * len(paths)


def _check_names(named: Sequence[tuple[Path, str]]) -> None:
    """Refuse files that would overwrite each other."""
    seen = set[str]()
    for path, name in named:
        if name.casefold() in seen:
            raise InputError(f"{path}: found the name {name} a second time, expected files of different names")
        if len(named) > 1 and name == TOGETHER:
            raise InputError(f"{path}: found the name {name}, expected another: that file holds all experiments")
        seen.add(name.casefold())


def _read_all(
    paths: Sequence[Path], samples: Sequence[About], choices: Choices, ask: _Ask | None
) -> tuple[list[_WithFiles], Choices]:
    """The tests of all files, each with the names of its files, and the choices made for them."""
    tests: list[tuple[Path, Converted]] = []
    for path, about in zip(paths, samples, strict=True):
        read = partial(_of_file, path, paths, about)
        found, choices = _decided(read, choices, ask)
        tests += [(path, test) for test in found]
    one_hold_each = all(len(test.experiment.holds) == 1 for _, test in tests)
    if len(paths) > 1 and one_hold_each:
        check = partial(_check_what_files_are, paths)
        _, choices = _decided(check, choices, ask)
    if _are_of_one_test(choices.each_file):
        join = partial(_joined, paths, samples[0])
        joined, choices = _decided(join, choices, ask)
        return [joined], choices
    _check_names([(path, test.experiment.name) for path, test in tests])
    return [(path.name, test) for path, test in tests], choices


def _joined(paths: Sequence[Path], about: About, choices: Choices) -> _WithFiles:
    """The test that several files are holds of, with their names."""
    if not about.name_is_stated:
        about = replace(about, name=common_name(paths))
    names = ", ".join(path.name for path in in_natural_order(paths))
    return names, convert_joined(paths, about, choices)


def _are_of_one_test(each_file: str | None) -> bool:
    """Whether several files are said to be holds of one test."""
    return each_file not in (None, TEST)


def _of_file(path: Path, paths: Sequence[Path], about: About, choices: Choices) -> list[Converted]:
    """The tests of a file; none where it is a hold of the test of all files.

    What no column says of a test may stand in the names of the files: then each may be a hold.
    """
    if _are_of_one_test(choices.each_file):
        return []
    try:
        return convert(path, about, choices)
    except Undecided:
        settings = name_settings(paths) if len(paths) > 1 and choices.each_file is None else []
        if not settings or not lacks_a_setting(path, choices):
            raise
        measures = listed([" ".join(measure) for measure in settings])
        raise _hold_or_test(paths, f"no column of what was set, and {measures} in the names of the files") from None


def _check_what_files_are(paths: Sequence[Path], choices: Choices) -> None:
    """Ask what files of one hold each are, where it is not said."""
    if choices.each_file is None:
        raise _hold_or_test(paths, f"one hold in each of {len(paths)} files")


def _hold_or_test(paths: Sequence[Path], found: str) -> Undecided:
    """The question what each of several files is."""
    answers = {
        f"--each-file {HOLD}": "a hold of one test, in the order of dates, or else of names",
        f"--each-file {TEST}": "a test of a fresh sample",
    }
    return Undecided(f"{path_of_all(in_natural_order(paths))}: found {found}", "what each file is", answers)


def _decided(read: Callable[[Choices], Read], choices: Choices, ask: _Ask | None) -> tuple[Read, Choices]:
    """What was read, and the choices made for it, which hold for what is read after it too."""
    while True:
        try:
            return read(choices), choices
        except Undecided as question:
            if ask is None:
                raise
            choices = choices.with_option(ask(question))


def _without_breaks(test: Converted) -> Converted:
    """A test without the readings of its gross events: their rows say that the hold went on, and no more."""
    experiment = test.experiment
    events = gross_events.gross_events_of(experiment)
    dropped = {int(reading) for event in events for reading in event.readings}
    column = test.header.index(READ[experiment.control])
    rows = [list(row) for row in test.rows]
    with_reading = [row for row in rows if row[column] is not None]
    for reading in dropped:
        with_reading[reading][column] = None
    last = len(with_reading) - 1
    if last in dropped:
        while rows[-1][column] is None:  # such a row at the end would say that the last hold went on
            rows.pop()
    notes = list(test.notes)
    notes += [f"left out: {event.text}" for event in events]
    kept = without_breaks(experiment)
    recording = test.recording
    if recording is not None:  # holds without a reading at the end are gone
        starts = recording.start_s[: len(kept.holds)]
        recording = replace(recording, start_s=starts)
    return replace(test, experiment=kept, rows=rows, notes=notes, recording=recording)


def _write(folder: Path, tests: Sequence[_WithFiles]) -> None:
    from wirebayes.report.pictures.bench import understood  # matplotlib only where it is needed

    tables: list[str] = []
    content: ImportJson = {"experiments": {}, "warnings": []}
    for raw, test in tests:
        experiment = test.experiment
        name = experiment.name
        write_csv(folder / f"{name}.csv", test.header, test.rows)
        notes = [f"from {raw}", *test.notes]
        sentences = [f"{note[:1].upper()}{note[1:]}." for note in notes]
        table = toml_of(experiment, sentences, test.unrecorded)
        picture = folder / f"{name}.svg"
        understood(experiment, picture, test.recording)
        content["experiments"][name] = _imported(raw, test)
        write_text(folder / f"{name}.toml", table)
        tables.append(table)
    if len(tests) > 1:
        every = "\n".join(tables)
        write_text(folder / f"{TOGETHER}.toml", every)
    content["warnings"] = notices_by_part(content["experiments"])
    write_json(folder / IMPORTED, content)


def _imported(raw: str, test: Converted) -> ImportedExperiment:
    """What ``import.json`` says of one test."""
    experiment = test.experiment
    resolution = experiment.resolution or None
    steps = experiment.control == "displacement"
    return {
        "raw": raw,
        "length_mm": experiment.length_mm,
        "material": experiment.material,
        "control": experiment.control,
        "resolution_N": resolution if steps else None,
        "resolution_mm": None if steps else resolution,
        "holds": len(experiment.recorded_holds),
        "readings": sum(hold.time_s.size for hold in experiment.holds),
        "notes": test.notes,
        "warnings": to_json([*test.warnings, *data_checks.of_experiment(experiment)]),
    }

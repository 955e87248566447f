"""Raw files of benches turned into experiment files."""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import get_args

from wirebayes._version import __version__
from wirebayes.commands.options import above_zero, check_choice, names_given, without_breaks
from wirebayes.errors import InputError
from wirebayes.io import data_checks, gross_events
from wirebayes.io.bench.about import About, default_name
from wirebayes.io.bench.as_experiment import toml_of
from wirebayes.io.bench.convert import Converted, convert
from wirebayes.io.bench.undecided import Choices, Decimal, Specimens, TimeSince, Undecided
from wirebayes.io.readings import READ
from wirebayes.io.run_folder import open_run, write_csv, write_json, write_text
from wirebayes.json_files.imported import ImportJson
from wirebayes.notice import notices_by_part, to_json
from wirebayes.strict.files import PathLike, read_bytes
from wirebayes.views.imported_tests import IMPORTED, ImportedTests
from wirebayes.views.result import ResultFolder
from wirebayes.wire.protocol import Control

TOGETHER = "experiments"  # the file of all, where there are several

# where each of several files has one hold, as some loggers write the steps of a test
OWN_SAMPLE = "one hold in each file: each is taken for a fresh sample; holds of one sample belong in one file, in order"


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
        Text with columns (CSV and its kin) or xlsx workbooks: one experiment each, or one for each of the specimens
        that stand side by side in it.
    length_mm : float
        Zero-tension length of the samples before the test.
    material : str, optional
        Samples of one material may be fitted together; the name of each experiment when left out.
    name : str, optional
        Of the experiment, where there is one file; else each has the name of its file. Specimens side by side have
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
        Whether columns of one quantity side by side are of several specimens, where the file leaves it open.
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
    above_zero(("--length-mm", length_mm), *([] if area_mm2 is None else [("--area-mm2", area_mm2)]))
    paths = [Path(raw)] if not isinstance(raw, Sequence) or isinstance(raw, str) else [Path(path) for path in raw]
    names = _names(paths, name)
    zero, area = (None if value is None else float(value) for value in (zero_mm, area_mm2))
    choices = Choices(names_given(mapping), decimal, time_since, sheet, zero, control, specimens, drop_breaks)
    samples = [About(own, material, float(length_mm), area, name_is_stated=name is not None) for own in names]
    tests, choices = _read_all(paths, samples, choices, ask)
    if drop_breaks:
        tests = [(path, _without_breaks(test)) for path, test in tests]
    configuration = {
        "command": "import",
        "version": __version__,
        "raw": {path.name: hashlib.sha256(read_bytes(path)).hexdigest() for path in paths},
        "names": names,
        "length_mm": float(length_mm),
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


def _names(paths: Sequence[Path], name: str | None) -> list[str]:
    if not paths:
        raise InputError("raw: found nothing, expected at least one file")
    if name is not None:
        if len(paths) > 1:
            raise InputError(f"--name: found {name!r} for {len(paths)} files, expected it with one file only")
        return [name]
    return [default_name(path) for path in paths]


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
    paths: Sequence[Path], samples: Sequence[About], choices: Choices, ask: Callable[[Undecided], str] | None
) -> tuple[list[tuple[Path, Converted]], Choices]:
    """The tests of all files, each with its file, and the choices made for them."""
    tests: list[tuple[Path, Converted]] = []
    for path, about in zip(paths, samples, strict=True):
        found, choices = _decided(path, about, choices, ask)
        tests += [(path, test) for test in found]
    _check_names([(path, test.experiment.name) for path, test in tests])
    if len(paths) > 1 and all(len(test.experiment.holds) == 1 for _, test in tests):
        tests = [(path, replace(test, notes=[*test.notes, OWN_SAMPLE])) for path, test in tests]
    return tests, choices


def _decided(
    path: Path, about: About, choices: Choices, ask: Callable[[Undecided], str] | None
) -> tuple[list[Converted], Choices]:
    """A file read, and the choices made for it, which hold for the files after it too."""
    while True:
        try:
            return convert(path, about, choices), choices
        except Undecided as question:
            if ask is None:
                raise
            choices = choices.with_option(ask(question))


def _without_breaks(test: Converted) -> Converted:
    """A test without the readings of its gross events: their rows say that the hold went on, and no more."""
    events = gross_events.gross_events_of(test.experiment)
    kept = without_breaks(test.experiment)
    dropped = {int(i) for event in events for i in event.readings}
    read = test.header.index(READ[test.experiment.control])
    rows, count = [], 0
    for row in test.rows:
        gone = row[read] is not None and count in dropped
        count += row[read] is not None
        rows.append([None if gone and column == read else value for column, value in enumerate(row)])
    while count - 1 in dropped and rows[-1][read] is None:
        rows.pop()
    return replace(test, experiment=kept, rows=rows, notes=[*test.notes, *(f"left out: {e.text}" for e in events)])


def _write(folder: Path, tests: Sequence[tuple[Path, Converted]]) -> None:
    from wirebayes.report.pictures.bench import understood  # matplotlib only where it is needed

    tables: list[str] = []
    content: ImportJson = {"experiments": {}, "warnings": []}
    for path, test in tests:
        experiment = test.experiment
        write_csv(folder / f"{experiment.name}.csv", test.header, test.rows)
        sentences = [f"{note[:1].upper()}{note[1:]}." for note in (f"from {path.name}", *test.notes)]
        tables.append(toml_of(experiment, sentences))
        understood(experiment, folder / f"{experiment.name}.svg", test.recording)
        steps = experiment.control == "displacement"
        content["experiments"][experiment.name] = {
            "raw": path.name,
            "length_mm": experiment.length_mm,
            "material": experiment.material,
            "control": experiment.control,
            "resolution_N": (experiment.resolution or None) if steps else None,
            "resolution_mm": None if steps else (experiment.resolution or None),
            "holds": len(experiment.recorded_holds),
            "readings": sum(h.time_s.size for h in experiment.holds),
            "notes": test.notes,
            "warnings": to_json([*test.warnings, *data_checks.of_experiment(experiment)]),
        }
        write_text(folder / f"{experiment.name}.toml", tables[-1])
    if len(tests) > 1:
        write_text(folder / f"{TOGETHER}.toml", "\n".join(tables))
    content["warnings"] = notices_by_part(content["experiments"])
    write_json(folder / IMPORTED, content)

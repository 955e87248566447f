"""What a process of the app does: one step with one test, by the public functions, and a record of it for the page."""

import shutil
import tomllib
import traceback
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import wirebayes
from wirebayes.app.folders import RAW, READ, ROBOTS, STEPS, Test
from wirebayes.errors import InputError
from wirebayes.io.run_folder import write_json
from wirebayes.progress import Progress


def do_step(send: Connection, folder: Path, step: str, options: dict[str, Any]) -> None:
    """Do a step and say how it goes: ``progress``, and at the end ``done``, ``undecided``, ``refused`` or ``broken``.

    Parameters
    ----------
    folder : Path
        Of the test.
    step : str
        ``read``, ``check``, ``fit``, ``discover`` or ``pose-ROBOT``.
    options : dict
        Of the step's function.
    """
    from wirebayes.io.bench.undecided import Undecided

    test = Test(folder)
    run = _ask
    if step == READ:
        run = _read
    elif step not in STEPS:
        run = _pose
    try:
        record = run(test, step, options, lambda *report: send.send(("progress", report)))
        write_json(folder / f"{step}.json", record)
        send.send(("done", None))
    except Undecided as undecided:
        questions = []
        for question in (undecided, *undecided.others):
            found = _bare(question.found, test)
            questions.append({"question": question.question, "found": found, "answers": question.answers})
        send.send(("undecided", questions))
    except InputError as error:
        send.send(("refused", _bare(str(error), test)))
    except Exception as error:  # a bug: its traceback for the terminal, its name for the page
        traceback.print_exc()
        send.send(("broken", f"{type(error).__name__}: {error}"))


def _read(test: Test, step: str, options: dict[str, Any], progress: Progress) -> dict[str, Any]:
    """Turn what was dropped into an experiment file, or take the one that was dropped, and draw what was understood."""
    folder = test.folder
    for name in test.steps():  # of an earlier reading
        record = folder / f"{name}.json"
        record.unlink(missing_ok=True)
        shutil.rmtree(folder / name, ignore_errors=True)
    target = folder / READ
    shutil.rmtree(target, ignore_errors=True)
    if test.is_experiment_file:
        return _read_experiment_file(test, target)
    given: dict[str, Any] = {key: options[key] or None for key in ("length_mm", "material", "area_mm2")}
    choices = _choices(options)
    imported = wirebayes.import_bench(test.raw, output=target, **given, **choices)
    names = list(imported.summary()["experiments"])
    file = names[0] if len(names) == 1 else "experiments"
    lines = imported.lines()
    warnings = [notice.text for notice in imported.warnings]
    return _understood(f"{file}.toml", names, lines, warnings)


def _ask(test: Test, step: str, options: dict[str, Any], progress: Progress) -> dict[str, Any]:
    """Check, fit or discover."""
    from wirebayes.processes.workers import load_early

    load_early()
    record = test.record(READ) or {}
    run = getattr(wirebayes, step)
    found = run(test.folder / record["file"], output=test.folder / step, progress=progress, **options)
    return _with_page(found)


def _pose(test: Test, step: str, options: dict[str, Any], progress: Progress) -> dict[str, Any]:
    """The drift of a robot on this wire: on the final model of `discover` where it was run, else on the fit."""
    experiment, robot, along = options["experiment"], options["robot"], dict[str, Any]()
    if Path(robot).is_dir():
        robot, along = _own_robot(Path(robot))
    discovered = test.folder / "discover" / experiment / "final"
    wires = discovered if "discover" in test.steps() else test.folder / "fit" / experiment
    shutil.rmtree(test.folder / step, ignore_errors=True)  # perhaps of the fit, before there was a discovery
    found = wirebayes.pose(robot, wires, output=test.folder / step, progress=progress, seed=options["seed"], **along)
    return _with_page(found)


def _own_robot(place: Path) -> tuple[Path, dict[str, Path]]:
    """The robot's file that was dropped, and the table beside it: of joint values, or of commanded poses."""
    files = sorted(place.iterdir())
    robots = [path for path in files if path.suffix.lower() == ".toml"]
    tables = [path for path in files if path.suffix.lower() == ".csv"]
    if len(robots) != 1 or len(tables) > 1:
        found = ", ".join(path.name for path in files)
        raise InputError(f"found {found}; expected one robot's file (TOML), and one table of poses (CSV) or none")
    robot = robots[0]
    if not tables:
        return robot, {}
    table = tables[0]
    text = table.read_text(encoding="utf-8", errors="replace")
    header, _, _ = text.partition("\n")
    are_joints = "joint_1" in header or "motor_1" in header
    kind = "joints" if are_joints else "trajectory"
    return robot, {kind: table}


def _read_experiment_file(test: Test, target: Path) -> dict[str, Any]:
    from wirebayes.io import data_checks
    from wirebayes.report.pictures.bench import understood

    file, *others = [path for path in test.raw if path.suffix.lower() == ".toml"]
    if others:
        raise InputError(f"found {file.name} and {others[0].name}, expected one experiment file at a time")
    _refuse_a_robot(file)
    experiments = wirebayes.read_experiments(file)
    shutil.copytree(file.parent, target)
    warnings = []
    names = []
    for experiment in experiments:
        name = experiment.name
        understood(experiment, target / f"{name}.svg")
        notices = data_checks.of_experiment(experiment)
        warnings += [notice.of(name).text for notice in notices]
        names.append(name)
    lines = [repr(experiment) for experiment in experiments]
    return _understood(file.name, names, lines, warnings)


def _refuse_a_robot(file: Path) -> None:
    """Say where a robot's file belongs; what else is wrong with a file says the reader of experiments."""
    try:
        content = tomllib.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return
    if "leg" in content and "experiment" not in content:
        raise InputError(f"{file.name}: found a robot, expected an experiment; drop it below the results of a fit")


def _understood(file: str, names: list[str], lines: list[str], warnings: list[str]) -> dict[str, Any]:
    """The record of what was read."""
    return {
        "lines": lines,
        "warnings": warnings,
        "file": f"{READ}/{file}",
        "experiments": names,
        "pictures": [f"{READ}/{name}.svg" for name in names],
    }


def _choices(options: dict[str, Any]) -> dict[str, Any]:
    """What the user chose, as arguments of `import_bench`."""
    from wirebayes.io.bench.undecided import Choices

    choices = Choices(control=options.get("control") or None)
    for option in options.get("options", ()):
        choices = choices.with_option(option)
    return vars(choices)


def _with_page(found: Any) -> dict[str, Any]:
    """The result's own page says all; that the record is there says that the step is done."""
    return {"page": str(wirebayes.write_report(found).name)}


def _bare(text: str, test: Test) -> str:
    """A message without the app's own folders before the names of files."""
    for folder in (*(test.folder / ROBOTS).glob("*"), test.folder / RAW, test.folder / READ, test.folder):
        text = text.replace(f"{folder}/", "")
    return text

"""What a command says at its end: the answer in a few lines, where the results lie, and what to do next."""

import csv
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from wirebayes.answers import known_at_the_end
from wirebayes.json_files.plain import plain
from wirebayes.json_files.pose import PoseJson
from wirebayes.json_files.pose_history import PoseHistoryJson
from wirebayes.workflows.results import (
    Batch,
    Calibration,
    Check,
    Comparison,
    Findings,
    ImportedTests,
    Plan,
    Pose,
    Posterior,
    Posteriors,
    Result,
)
from wirebayes.workflows.write_report import write_report

PAGE = "report.html"


@dataclass(frozen=True)
class Given:
    """What the command was given, so that the next one can be written out.

    Attributes
    ----------
    file : str
        The experiment file, or the robot.
    wires : str
        Folder of the wires' posterior.
    """

    file: str = "FILE.toml"
    wires: str = "DIR"


def conclude(result: Result[Any], given: Given = Given(), *, as_json: bool = False, quiet: bool = False) -> None:
    """Write the page of a command's results and print the answer.

    Parameters
    ----------
    result : Result
    given : Given
    as_json : bool
        Print the summary as JSON instead.
    quiet : bool
        Print nothing.
    """
    folder = result.place.path
    if result.computed or not (folder / PAGE).is_file():
        write_report(folder)
    print_answer(result, given, as_json=as_json, quiet=quiet)


def print_answer(
    result: Result[Any], given: Given = Given(), *, as_json: bool = False, quiet: bool = False, kept: bool = True
) -> None:
    """Print the answer of a command, as `conclude` does; for results without a page, or not `kept` in a folder, too."""
    folder = result.place.path
    if as_json:
        print(json.dumps(plain(result.summary()), indent=2, ensure_ascii=False, allow_nan=False))
    elif not quiet:
        look = f" (open {folder / PAGE})" if (folder / PAGE).is_file() else ""
        where = [f"Results: {folder}{look}"] if kept else []
        print("\n".join([*result.lines(), *where, f"Next: {next_step(result, given)}"]))


def next_step(result: Result[Any], given: Given = Given()) -> str:
    """What a person would do with this result.

    Parameters
    ----------
    result : Result
    given : Given
    """
    folder, file = result.place.path, given.file
    if isinstance(result, Posterior | Posteriors):
        if "model-check" in result.kinds:
            return f"wirebayes discover {file}, to find out what the model is missing"
        one = next(iter(result.values())) if isinstance(result, Posteriors) else result
        return f"wirebayes predict {folder} PROTOCOL.csv, or wirebayes pose ROBOT.toml --wires {one.folder}"
    if isinstance(result, Findings):
        return " ".join(f"{name}: {r['next_measurement']}" for name, r in result.report["experiments"].items())
    if isinstance(result, Plan):
        return f"do {result.best['words'] or 'the test ' + result.best['name']}, then wirebayes discover FILE.toml"
    if isinstance(result, Batch):
        predicted = f"wirebayes predict {folder} PROTOCOL.csv --experiment NAME"
        return f"read {folder / 'summary.csv'}; {predicted}"
    if isinstance(result, Comparison):
        return f"wirebayes fit {file} with the options of the best model, or wirebayes discover {file}"
    if isinstance(result, Pose):
        return _after_pose(result.summary(), folder, given)
    if isinstance(result, Calibration):
        if not result.summary()["usable"]:
            return (
                f"wirebayes calibrate {file} with more poses, or once readings, stated errors and --anchor-sd are "
                "checked"
            )
        if (folder / "robot.toml").is_file():
            robot = folder / "robot.toml"
            return (
                f"wirebayes export {robot} --wires {given.wires}, for the controller's settings; references are in "
                f"{folder / 'calibration.json'}"
            )
        return f"set the lengths of {folder / 'calibration.json'} in the controller"
    if isinstance(result, Check):
        then = "once the warnings are settled" if result.warnings else f"then wirebayes discover {file}"
        return f"wirebayes fit {file}, {then}"
    if isinstance(result, ImportedTests):
        names = list(result.summary()["experiments"])
        file = names[0] if len(names) == 1 else "experiments"
        return f"look at {folder / names[0]}.svg, then wirebayes check {folder / file}.toml"
    return f"read {folder}"


def _after_pose(found: PoseJson | PoseHistoryJson, folder: Path, given: Given) -> str:
    """What to do with a pose, or where there is none."""
    lost = "drift" in found and not any(known_at_the_end(drift) for drift in found["drift"])
    corrections = folder / "corrections.csv"
    if corrections.is_file():
        if lost:
            where = f"the column held of {folder / 'poses.csv'} says where the platform is lost"
            return f"check joint values or poses, their units and the payload; {where}"
        if not _has_corrections(corrections):
            return (
                "other commanded poses, or other bounds of the tension in the robot's file: nothing holds these poses"
            )
        return f"give the controller the joint values of {corrections}"
    if lost or not found.get("feasible", True):
        return "another pose or payload, or other bounds of the tension in the robot's file"
    calibrate = f"wirebayes calibrate {given.file} READINGS.csv --wires {given.wires}"
    return f"{calibrate}, once the drift is more than you allow"


def _has_corrections(path: Path) -> bool:
    """Whether any row has one: none has where no tensions hold the poses to which they should lead."""
    with path.open(encoding="utf-8", newline="") as file:
        return any(row["change_1_mm"] for row in csv.DictReader(file))

"""What a command says at its end: the answer in a few lines, where the results lie, and what to do next."""

import csv
import json
from collections import Counter
from pathlib import Path
from textwrap import wrap
from typing import Any, cast

import numpy as np

from wirebayes.io.run_folder import plain
from wirebayes.json_files.batch import BatchJson
from wirebayes.json_files.calibrate import CalibrateJson
from wirebayes.json_files.check import CheckedExperiment, EffectSize, ParameterRange
from wirebayes.json_files.comparison import ComparedModels
from wirebayes.json_files.discovery import ExperimentFindings
from wirebayes.json_files.imported import ImportedExperiment
from wirebayes.json_files.plan import JudgedProtocol
from wirebayes.json_files.pose import Drift, PoseJson
from wirebayes.json_files.pose_history import PoseHistoryJson
from wirebayes.json_files.read_units import read, unit_read
from wirebayes.json_files.summary import SummaryJson
from wirebayes.json_files.values import Quantiles
from wirebayes.sentences import likely
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
_NAMED = {"nothing-missing": "nothing is missing", "unknown": "something is missing that is not in the catalogue"}


def conclude(result: Result[Any], *, as_json: bool = False, quiet: bool = False) -> None:
    """Write the page of a command's results and print the answer.

    Parameters
    ----------
    result : Result
    as_json : bool
        Print the summary as JSON instead.
    quiet : bool
        Print nothing.
    """
    folder = result.place.path
    if result.computed or not (folder / PAGE).is_file():
        write_report(folder)
    print_answer(result, as_json=as_json, quiet=quiet)


def print_answer(result: Result[Any], *, as_json: bool = False, quiet: bool = False, kept: bool = True) -> None:
    """Print the answer of a command, as `conclude` does; for results without a page, or not `kept` in a folder, too."""
    folder = result.place.path
    if as_json:
        print(json.dumps(plain(result.summary()), indent=2, ensure_ascii=False, allow_nan=False))
    elif not quiet:
        look = f" (open {folder / PAGE})" if (folder / PAGE).is_file() else ""
        where = [f"Results: {folder}{look}"] if kept else []
        print("\n".join([*answer(result), *where, f"Next: {next_step(result)}"]))


def answer(result: Result[Any]) -> list[str]:
    """The answer, a line or two for each experiment, model or wire."""
    if isinstance(result, Posteriors):
        return [line for posterior in result.values() for line in answer(posterior)]
    found = result.summary()
    if isinstance(result, Posterior):
        return _posterior(found)
    if isinstance(result, Findings):
        return [line for name, report in found["experiments"].items() for line in _finding(name, report)]
    if isinstance(result, Batch):
        return _batch(found)
    if isinstance(result, Plan):
        return [line for row in found["protocols"] for line in _planned(row)]
    if isinstance(result, Comparison):
        return [_comparison(name, table) for name, table in found["experiments"].items()]
    if isinstance(result, Pose):
        return _pose(found)
    if isinstance(result, Calibration):
        return _calibration(found)
    if isinstance(result, Check):
        return [line for name, test in found["experiments"].items() for line in _checked(name, test)]
    if isinstance(result, ImportedTests):
        return [line for name, test in found["experiments"].items() for line in _imported(name, test)]
    return [repr(result)]


def next_step(result: Result[Any]) -> str:
    """What a person would do with this result."""
    folder = result.place.path
    if isinstance(result, Posterior | Posteriors):
        if "model-check" in result.kinds:
            return "wirebayes discover FILE.toml --output DIR, to find out what the model is missing"
        return f"wirebayes predict {folder} PROTOCOL.csv --output FILE.csv, or wirebayes pose ROBOT.toml --wires DIR"
    if isinstance(result, Findings):
        return " ".join(f"{name}: {r['next_measurement']}" for name, r in result.report["experiments"].items())
    if isinstance(result, Plan):
        return f"do {result.best['words'] or 'the test ' + result.best['name']}, then wirebayes discover FILE.toml"
    if isinstance(result, Batch):
        predicted = f"wirebayes predict {folder} PROTOCOL.csv --experiment NAME --output FILE.csv"
        return f"read {folder / 'summary.csv'}; {predicted}"
    if isinstance(result, Comparison):
        return "wirebayes fit FILE.toml with the options of the best model, or wirebayes discover FILE.toml"
    if isinstance(result, Pose):
        return _after_pose(result.summary(), folder)
    if isinstance(result, Calibration):
        if not result.summary()["usable"]:
            return "wirebayes calibrate with more poses, or once readings, stated errors and --anchor-sd are checked"
        if (folder / "robot.toml").is_file():
            robot = folder / "robot.toml"
            return (
                f"wirebayes export {robot} --wires DIR, for the controller's settings; references are in "
                f"{folder / 'calibration.json'}"
            )
        return f"set the lengths of {folder / 'calibration.json'} in the controller"
    if isinstance(result, Check):
        return "wirebayes fit FILE.toml --output DIR" + (
            ", once the warnings are settled" if result.warnings else ", then wirebayes discover FILE.toml"
        )
    if isinstance(result, ImportedTests):
        names = list(result.summary()["experiments"])
        file = names[0] if len(names) == 1 else "experiments"
        return f"look at {folder / names[0]}.svg, then wirebayes check {folder / file}.toml"
    return f"read {folder}"


def _after_pose(found: PoseJson | PoseHistoryJson, folder: Path) -> str:
    """What to do with a pose, or where there is none."""
    lost = "drift" in found and not any(_known_at_the_end(drift) for drift in found["drift"])
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
    return "wirebayes calibrate ROBOT.toml READINGS.csv --wires DIR, once the drift is more than you allow"


def _known_at_the_end(drift: Drift) -> bool:
    middle = drift["distance_mm"]["q50"]
    return middle is not None and middle[-1] is not None


def _has_corrections(path: Path) -> bool:
    """Whether any row has one: none has where no tensions hold the poses to which they should lead."""
    with path.open(encoding="utf-8", newline="") as file:
        return any(row["change_1_mm"] for row in csv.DictReader(file))


def _posterior(summary: SummaryJson) -> list[str]:
    derived = summary["derived"]
    state = "converged" if summary["converged"] else "NOT CONVERGED"
    passed = summary["model_check"]["passed"] if "model_check" in summary else None
    checked = {True: "model check passed", False: "MODEL CHECK FAILED", None: "model not checked"}[passed]
    names = [n for n in summary["parameters"] if n.split("[")[0].split(".")[0] in (*_SHOWN, *_effects(summary))]
    parameters = ", ".join(f"{name} {_band(summary['parameters'][name])}" for name in names)
    creep = f"creep after 2 min at {derived['tension_N']:g} N {_band(derived['creep_2min_mm'])} mm"
    return [f"{summary['experiment']}: {state}, {checked}", f"  {parameters}", f"  {creep} (medians, 90 % intervals)"]


_SHOWN = ("k1", "B", "U", "k2", "N")


def _effects(summary: SummaryJson) -> list[str]:
    return [key.split("@")[0] for key in summary["effects"]]


def _finding(name: str, report: ExperimentFindings) -> list[str]:
    verdict, effects = report["verdict"], ", ".join(report["effects"])
    finding = _NAMED.get(verdict, f"{verdict}: {effects}")
    if verdict == "ambiguous":
        finding = f"ambiguous: {likely(report)}"
    if verdict == "partial":
        are = "are" if report["effects"][1:] else "is"
        finding = f"{effects} {are} missing, and something that is not in the catalogue"
    lines = [f"{name}: {finding} (p = {report['p_global']:.2g})"]
    if verdict == "unknown" and likely(report):
        lines.append(f"  beside it most likely {likely(report)}; none of these is established")
    for effect, size in report["amplitudes"].items():
        at = "" if size["hold"] is None else f" at hold {size['hold']}"
        unit = "" if size["unit"] == "-" else f" {size['unit']}"
        lines.append(f"  {effect}{at} {size['mean']:.3g} [{size['q05']:.3g}, {size['q95']:.3g}]{unit}")
    like = [other for other in report["group"] if other not in (*report["effects"], "unknown")]
    if like and verdict in ("named", "ambiguous"):
        lines.append(f"  hard to distinguish on this protocol: {', '.join(like)}")
    gain = report["held_out"]
    before, after = (read(gain[model], "rmse") for model in ("plain", "final"))
    if report["effects"] and None not in (before, after):
        lines.append(f"  held-out holds: rmse {before:.3g} -> {after:.3g} {unit_read(gain['plain'])}")
    return lines


def _imported(name: str, test: ImportedExperiment) -> list[str]:
    sample = f"{test['length_mm']:g} mm of {test['material']}"
    return [
        f"{name}: {test['holds']} holds, {test['readings']} readings, {sample}",
        *(f"  {note}" for note in test["notes"]),
    ]


def _batch(found: BatchJson) -> list[str]:
    rows, far = found["experiments"], found["outliers"]
    failed = sum(row["error"] is not None for row in rows)
    converged = sum(bool(row["converged"]) for row in rows)
    lines = [f"{len(rows)} experiments: {converged} converged, {failed} failed"]
    verdicts = Counter(row["verdict"] for row in rows if row["verdict"])
    if verdicts:
        lines.append("  " + ", ".join(f"{count} {verdict}" for verdict, count in verdicts.most_common()))
    lines += [f"  apart: {outlier['sentence']}" for outlier in far[:_MOST_LINES]]
    return lines + ([f"  and {len(far) - _MOST_LINES} more outliers"] if len(far) > _MOST_LINES else [])


def _planned(row: JudgedProtocol) -> list[str]:
    budget = "" if row["within_budget"] else ", longer than the available time"
    lines = [f"{row['rank']}. {row['name']}: {row['duration_min']:.3g} min{budget}, {row['information_bits']:.3g} bits"]
    known = [f"{name} {row['parameters'][name]['sd']:.2g}" for name in _SHOWN if name in row["parameters"]]
    creep = row["creep"]
    known.append(f"creep after 1 h at {creep['tension_N']:.3g} N {creep['creep_1h_mm']['sd']:.2g} mm")
    lines.append(f"  expected sd: {', '.join(known)}")
    if row["robot"] is not None and row["robot"]["drift_sd_mm"] is not None:
        lines.append(f"  drift of the robot after 1 h: sd {row['robot']['drift_sd_mm']:.2g} mm")
    return lines


_MOST_LINES = 10  # of outliers, on a terminal


def _checked(name: str, test: CheckedExperiment) -> list[str]:
    recorded = f"{test['recorded_holds']} holds, {test['readings']} readings in {test['duration_s'] / 60.0:.3g} min"
    unit = unit_read(test, "resolution")
    step = read(test, "resolution")
    steps = f", written in steps of {step:g} {unit}" if step else ""
    lines = [f"{name}: {recorded}{steps}; {test['length_mm']:g} mm of {test['material']}"]
    if test["temperature_C"]:
        lines.append("  temperature from {:.3g} to {:.3g} °C".format(*test["temperature_C"]))
    weights = test["control"] == "force"
    lines.append(f"  {'hold':>4} {'weight' if weights else 'displacement':>13} {'begins':>9} {'lasts':>9}  readings")
    for hold in test["holds"]:
        course = "none: held, not recorded"
        if hold["number"] is not None:
            first, last = read(hold, "first"), read(hold, "last")
            course = f"{hold['readings']} from {hold['first_s']:g} s on, {first:.4g} to {last:.4g} {unit}"
        place = f"{hold['tension_N']:g} N" if weights else f"{hold['displacement_mm']:g} mm"
        begins, lasts = (f"{hold[key]:.6g} s" for key in ("start_s", "duration_s"))
        number = "-" if hold["number"] is None else hold["number"]
        lines.append(f"  {number:>4} {place:>13} {begins:>9} {lasts:>9}  {course}")
    for source in ("data", "data and prior", "prior"):
        ranges = [
            f"{p} {_band(range_)}" for p, range_ in test["parameters"].items() if range_["determined_by"] == source
        ]
        lines += _wrapped(f"parameters from the {source}", ranges)
    for shows, words in _SHOWS.items():
        effects = [(e, found) for e, found in test["effects"].items() if found["shows"] == shows]
        lines += _wrapped(words, [_size(e, found) for e, found in effects])
    count = len(test["warnings"])
    lines.append(f"  {count} warning{'s' * (count > 1)}, on standard error" if count else "  nothing suspicious")
    return lines


_SHOWS = {
    "yes": "effects that would be detected, from this size on",
    "if unusually large": "effects that would be detected if unusually large",
    "no": "effects that it cannot show",
}


def _size(effect: str, found: EffectSize) -> str:
    if found["amplitude_80"] is None:
        return f"{effect} ({found['reason']})"
    return f"{effect} {found['amplitude_80']:.2g}" + (f" {found['unit']}" if found["unit"] != "-" else "")


def _wrapped(title: str, items: list[str]) -> list[str]:
    """A list in lines that a terminal shows whole."""
    if not items:
        return []
    whole = [item.replace(" ", "\u00a0") for item in items]  # no item is broken
    lines = wrap(f"{title}: {', '.join(whole)}", 110, initial_indent="  ", subsequent_indent="    ")
    return [line.replace("\u00a0", " ") for line in lines]


def _comparison(name: str, table: ComparedModels) -> str:
    best, *others = [row["name"] for row in table["models"] if row["failed"] is None] or ["none"]
    return f"{name}: {best} predicts left-out holds best" + (f", then {', '.join(others[:2])}" if others else "")


def _pose(found: PoseJson | PoseHistoryJson) -> list[str]:
    if not found["feasible"]:
        return [f"{found['robot']}: {found['sentence']}"]
    lines = []
    measured = "history" in found and cast(PoseHistoryJson, found)["history"]["kind"] == "measured"
    moved = "is away from where it is meant to be" if measured else "has drifted"
    for drift in found["drift"]:
        far, time = drift["distance_mm"], drift["times_s"][-1]
        if _known_at_the_end(drift):
            lines.append(
                f"{found['robot']}: after {time:g} s the platform {moved} by {far['q50'][-1]:.3g} mm "
                f"[{far['q05'][-1]:.3g}, {far['q95'][-1]:.3g}] (specimen spread {100 * drift['specimen_spread']:g} %)"
            )
    return lines or [f"{found['robot']}: no draw of the wires could be solved"]


def _calibration(found: CalibrateJson) -> list[str]:
    known = found["with_creep_model"]
    if not known["converged"]:
        return [f"{found['robot']}: not converged, no lengths to use"]
    length = known["length_m"]
    rows = zip(length["mean"], length["q05"], length["q95"], strict=True)
    lengths = ", ".join(f"{mean:.5f} [{low:.5f}, {high:.5f}]" for mean, low, high in rows)
    lines = [f"{found['robot']}: zero-tension lengths in m: {lengths}"]
    points = found["exit_points_m"]
    if np.any(np.array(points["sd"]) > 0):
        lines.append("  exit points in mm, ± standard error:")
        for i, (mean, sd) in enumerate(zip(points["mean"], points["sd"], strict=True)):
            place = ", ".join(f"{1e3 * m:.1f} ± {1e3 * s:.2g}" for m, s in zip(mean, sd, strict=True))
            lines.append(f"    wire {i + 1}: ({place})")
    lines += [f"  not determined: {text}" for text in found["identified"]["not_determined"][:_MOST_LINES]]
    return lines


def _band(quantity: Quantiles | ParameterRange | None) -> str:
    return "-" if quantity is None else f"{quantity['q50']:.4g} [{quantity['q05']:.4g}, {quantity['q95']:.4g}]"

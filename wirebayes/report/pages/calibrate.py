"""The page of ``wirebayes calibrate``: lengths with intervals, those by Hooke's law alone, what cannot be observed."""

from pathlib import Path
from typing import Any

import numpy as np

from wirebayes.answers.headline import calibration_in_a_sentence
from wirebayes.answers.robot import drums_in_words
from wirebayes.io.run_folder import read_json
from wirebayes.json_files.calibrate import CalibrateJson, EstimatedLengths, Interval
from wirebayes.report.blocks import (
    Block,
    Columns,
    Configuration,
    Page,
    Picture,
    Pictures,
    Points,
    Section,
    Table,
    Text,
    before_the_answer,
    beside_the_answer,
    files_beside,
    number,
    seed_of_page,
)
from wirebayes.report.cells import NONE
from wirebayes.report.drawn import drawn
from wirebayes.report.glossary import meaning
from wirebayes.report.pages.robot_view import robot_view
from wirebayes.report.pictures.calibrate import reference_errors
from wirebayes.robot.self_calibration.trust import SIGNIFICANT
from wirebayes.sentences import coordinates, counted, from_to


def calibrate_page(folder: Path, configuration: Configuration) -> Page:
    """The content of ``calibration.json``."""
    found: CalibrateJson = read_json(folder / "calibration.json")
    creep = found["with_creep_model"]
    hooke = found["by_hooke_alone"]
    columns = Columns([_done(found), _known(found), _unknown(creep, hooke)])
    first: list[Block] = before_the_answer(found)
    first += _errors(found)
    first += beside_the_answer(found)
    first.append(columns)
    lengths = [_lengths(creep, hooke), *_biases(creep)]
    view = robot_view(folder)
    sections = [Section("Summary", first)]
    sections += _geometry(found)
    sections.append(Section("Lengths", lengths))
    sections.append(Section("What to do", _next(found)))
    if view:
        sections.append(Section("Where the platform is", view))
    sections.append(files_beside(folder, _FILES))
    terms = ("90 % interval", "zero-tension length", "specimen spread")
    sections.append(meaning(terms, model=False))
    title = f"Calibration of {found['robot']}"
    lead = calibration_in_a_sentence(found)
    return Page(title, lead, sections, seed_of_page(configuration))


_FILES = (
    ("calibration.json", "every number of this page as JSON"),
    ("robot.toml", "the robot's file with the calibrated points"),
    ("unknowns.json", "the posterior that pose --calibration starts from"),
    ("scene.json", "points of the view that can be turned"),
    ("configuration.json", "the options of this run, with version and seed"),
)


def _errors(found: CalibrateJson) -> list[Block]:
    """The picture of what was wrong before; none where the search did not converge."""
    creep = found["with_creep_model"]
    hooke = found["by_hooke_alone"]
    if not (creep["converged"] and hooke["converged"]):
        return []
    figure = reference_errors(creep, hooke, found["prior"]["reference_sd_mm"])
    alt = "Error of each wire's reference length with its 90 % interval, by two models of the wires."
    return [Pictures([Picture(drawn(figure), alt, _ERRORS)])]


_ERRORS = (
    "By how much each wire is longer than its joint value said. Where the two models differ by more than their "
    "intervals, creep decides the lengths."
)


_AXES = ("x, mm", "90 %", "y, mm", "90 %", "z, mm", "90 %")


def _geometry(found: CalibrateJson) -> list[Section]:
    """Points that were estimated, what the readings leave open, and where the robot was at each hold."""
    tables = [
        *_points(found["exit_points_m"], "exit point"),
        *_points(found["platform_points_m"], "platform point"),
    ]
    if not tables and "drum_wider_percent" not in found:
        return []
    seen = found["identified"]
    words = [f"The readings determine {seen['determined']} of {seen['of']} combinations of geometry and references."]
    words += [f"{text[0].upper()}{text[1:]}." for text in drums_in_words(found)]
    words += [f"Not determined: {text}." for text in seen["not_determined"]]
    known = Columns([Points("What the readings determine", words)])
    return [Section("Geometry", [*tables, known]), Section("Poses", [_poses(found)])]


def _poses(found: CalibrateJson) -> Table:
    poses = found["poses"]
    rows = []
    for hold, mean, low, high in zip(poses["hold"], poses["mean"], poses["q05"], poses["q95"], strict=True):
        intervals = _intervals(mean[:3], low[:3], high[:3])
        rows.append([f"{hold:g}", *intervals])
    header = ["hold", *_AXES]
    return Table(header, rows, "Where the platform was when each hold ended.")


def _points(points: Any, of: str) -> list[Table]:
    """The table of points that were estimated."""
    if not np.any(np.array(points["sd"], float) > 0):
        return []
    lines = []
    columns = zip(points["mean"], points["q05"], points["q95"], strict=True)
    for wire, (mean, low, high) in enumerate(columns, start=1):
        lines.append([str(wire), *_intervals(mean, low, high)])
    return [Table(["wire", *_AXES], lines, f"The {of} of every wire.")]


def _intervals(mean: Any, low: Any, high: Any) -> list[str]:
    """Thousandths with their intervals."""
    cells = []
    for middle, lower, upper in zip(mean, low, high, strict=True):
        cells += _with_interval(middle, lower, upper)
    return cells


def _with_interval(middle: float | None, low: float | None, high: float | None) -> list[str]:
    """One figure in thousandths and its interval, two cells."""
    return [_milli(middle), f"{_milli(low)} … {_milli(high)}"]


def _done(found: CalibrateJson) -> Points:
    prior = found["prior"]
    points = [f"{counted(found['holds'], 'hold')}, tensions read in {found['read']} of them."]
    stated = {
        "exit points": prior.get("anchor_sd_mm", 0.0),
        "platform points": prior.get("platform_sd_mm", 0.0),
        "poses": prior.get("pose_sd_mm", 0.0),
    }
    known = [f"{name} were known to {sd:g} mm" for name, sd in stated.items() if sd]
    if known:
        points.append(f"Before, {' and '.join(known)}.")
    points.append(
        f"Before, every reference length was known to {prior['reference_sd_mm']:g} mm, and specimens of one line "
        f"were assumed to differ by {100 * prior['specimen_spread']:g} %."
    )
    if "tension_bias_sd_N" in prior:
        kind = "a constant each" if prior["tension_bias_sign"] == "constant" else "against the last motion of the wire"
        points.append(
            f"Biases of the tension sensors were estimated too, {kind}; before, {prior['tension_bias_sd_N']:g} N."
        )
    return Points("What was done", points)


def _known(found: CalibrateJson) -> Points:
    observability = found["observability"]["sentence"]
    if found["pose_now"] is None:
        return Points("What is known", ["Neither the lengths nor the pose.", observability])
    sd_mm = [1e3 * sd_m for sd_m in found["with_creep_model"]["length_m"]["sd"]]
    lengths = f"Every length is known to {from_to(min(sd_mm), max(sd_mm))} mm (standard error)."
    place = coordinates(found["pose_now"]["position_m"])
    return Points("What is known", [lengths, f"The platform is at ({place}) m.", observability])


def _unknown(creep: EstimatedLengths, hooke: EstimatedLengths) -> Points:
    points = []
    for name, result in (("the creep model", creep), ("Hooke's law alone", hooke)):
        if not result["converged"]:
            points.append(f"With {name} the search did not converge: do not use its lengths.")
        if result["misfit"] is None:
            continue
        fits = "explains" if (result["p_joint"] or 0.0) >= SIGNIFICANT else "does not explain"
        points.append(
            f"With {name} the mean squared residual is {number(result['misfit'], 2)} (about 1 or less is expected): it "
            f"{fits} readings and reference lengths (joint test, {_p(result['p_joint'])})."
        )
    return Points("How far it can be trusted", points)


def _p(p: float | None) -> str:
    """A p-value in words: how far below a thousandth it lies says nothing."""
    if p is None:
        return "no p"
    return "p < 0.001" if p < 1e-3 else f"p = {number(p, 2)}"


def _lengths(creep: EstimatedLengths, hooke: EstimatedLengths) -> Table:
    strains = creep["creep_strain"]
    by_creep = _rows(creep["length_m"])
    by_hooke = _rows(hooke["length_m"])
    lines = []
    for wire, (own, strain, plain) in enumerate(zip(by_creep, strains, by_hooke, strict=True), start=1):
        lines.append([str(wire), *own, _milli(strain), *plain])
    header = ["wire", "length now, mm", "90 %", "creep strain, mm per m", "Hooke's law alone, mm", "90 %"]
    return Table(header, lines, "Zero-tension length of every wire when the last hold ended, creep included.")


def _rows(lengths: Interval) -> list[list[str]]:
    """Mean and interval of each wire's length."""
    columns = zip(lengths["mean"], lengths["q05"], lengths["q95"], strict=True)
    return [_with_interval(mean, low, high) for mean, low, high in columns]


def _biases(creep: EstimatedLengths) -> list[Block]:
    if "tension_bias_N" not in creep:
        return []
    bias = creep["tension_bias_N"]
    rows = []
    for wire, (mean, sd) in enumerate(zip(bias["mean"], bias["sd"], strict=True), start=1):
        rows.append([str(wire), _thousandths(mean), _thousandths(sd)])
    header = ["wire", "bias of its sensor, N", "standard error, N"]
    return [Table(header, rows, "By how much each tension sensor reads too high.")]


def _thousandths(value: float | None) -> str:
    return NONE if value is None else f"{value:.3f}"


def _milli(value: float | None) -> str:
    """Thousandths; a search that did not converge may leave none."""
    return "–" if value is None else f"{1e3 * value:z.2f}"


def _next(found: CalibrateJson) -> list[Block]:
    rows = [[f"{coordinate:.3f}" for coordinate in place] for place in found["next_positions_m"]]
    caption = f"Positions whose readings would sharpen what is known most, the most useful first.{_gain(found)}"
    return [Text(_joints(found)), Table(["x, m", "y, m", "z, m"], rows, caption)]


def _joints(found: CalibrateJson) -> str:
    """What to set in the controller."""
    converged = found["with_creep_model"]["converged"]
    if converged and not found["usable"]:
        return "Set nothing in the controller: the warnings say why."
    if found["joint_values_for_home_m"] is not None:
        values = ", ".join(f"{value:.5f}" for value in found["joint_values_for_home_m"])
        return f"Joint values that bring the platform to its home pose now, m: {values}."
    if converged:
        return "No tensions within the bounds hold the platform at its home pose: no joint values lead there."
    return "No joint values are given: read more poses, or check the readings and their stated errors."


def _gain(found: CalibrateJson) -> str:
    """What visiting the proposed poses is worth."""
    sd = found["next_pose_sd_mm"]
    if len(sd) < 2:
        return ""
    return f" They take the error of a commanded position from {number(sd[0], 2)} to {number(sd[-1], 2)} mm (sd)."

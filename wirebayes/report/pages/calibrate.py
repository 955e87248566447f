"""The page of ``wirebayes calibrate``: lengths with intervals, those by Hooke's law alone, what cannot be observed."""

from pathlib import Path
from typing import Any

import numpy as np

from wirebayes.answers.headline import calibration_in_a_sentence
from wirebayes.io.run_folder import read_json
from wirebayes.json_files.calibrate import CalibrateJson, EstimatedLengths
from wirebayes.report.blocks import (
    Block,
    Columns,
    Page,
    Picture,
    Pictures,
    Points,
    Section,
    Table,
    Text,
    before_the_answer,
    beside_the_answer,
    drawn,
    files_beside,
    number,
    seed_of_page,
)
from wirebayes.report.glossary import meaning
from wirebayes.report.pages.robot_view import robot_view
from wirebayes.report.pictures.calibrate import reference_errors
from wirebayes.robot.self_calibration.trust import SIGNIFICANT
from wirebayes.sentences import coordinates, counted, from_to


def calibrate_page(folder: Path, configuration: dict[str, Any]) -> Page:
    """The content of ``calibration.json``."""
    found: CalibrateJson = read_json(folder / "calibration.json")
    creep, hooke = found["with_creep_model"], found["by_hooke_alone"]
    columns = Columns([_done(found), _known(found), _unknown(creep, hooke)])
    first = [*before_the_answer(found), *_errors(found), *beside_the_answer(found), columns]
    sections = [
        Section("Summary", first),
        *_geometry(found),
        Section("Lengths", [_lengths(creep, hooke), *_biases(creep)]),
        Section("What to do", _next(found)),
    ]
    sections += [Section("Where the platform is", view)] if (view := robot_view(folder)) else []
    sections.append(files_beside(folder, _FILES))
    sections.append(meaning(("90 % interval", "zero-tension length", "specimen spread"), model=False))
    lead = calibration_in_a_sentence(found)
    return Page(f"Calibration of {found['robot']}", lead, sections, seed_of_page(configuration))


_FILES = (
    ("calibration.json", "every number of this page as JSON"),
    ("robot.toml", "the robot's file with the calibrated points"),
    ("unknowns.json", "the posterior that pose --calibration starts from"),
    ("scene.json", "points of the view that can be turned"),
    ("configuration.json", "the options of this run, with version and seed"),
)


def _errors(found: CalibrateJson) -> list[Block]:
    """The picture of what was wrong before; none where the search did not converge."""
    creep, hooke = found["with_creep_model"], found["by_hooke_alone"]
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
    blocks: list[Block] = []
    for points, of in ((found["exit_points_m"], "exit point"), (found["platform_points_m"], "platform point")):
        if not np.any(np.array(points["sd"], float) > 0):
            continue
        columns = zip(points["mean"], points["q05"], points["q95"], strict=True)
        lines = [[str(i + 1), *_intervals(mean, low, high)] for i, (mean, low, high) in enumerate(columns)]
        blocks.append(Table(["wire", *_AXES], lines, f"The {of} of every wire."))
    if not blocks:
        return []
    seen = found["identified"]
    words = [f"The readings determine {seen['determined']} of {seen['of']} combinations of geometry and references."]
    words += [f"Not determined: {text}." for text in seen["not_determined"]]
    poses = found["poses"]
    places = zip(poses["hold"], poses["mean"], poses["q05"], poses["q95"], strict=True)
    rows = [[f"{hold:g}", *_intervals(mean[:3], low[:3], high[:3])] for hold, mean, low, high in places]
    return [
        Section("Geometry", [*blocks, Columns([Points("What the readings determine", words)])]),
        Section("Poses", [Table(["hold", *_AXES], rows, "Where the platform was when each hold ended.")]),
    ]


def _intervals(mean: Any, low: Any, high: Any) -> list[str]:
    """Thousandths with their intervals."""
    rows = zip(mean, low, high, strict=True)
    return [cell for m, a, b in rows for cell in (_milli(m), f"{_milli(a)} … {_milli(b)}")]


def _done(found: CalibrateJson) -> Points:
    prior = found["prior"]
    biases = []
    if "tension_bias_sd_N" in prior:
        kind = "a constant each" if prior["tension_bias_sign"] == "constant" else "against the last motion of the wire"
        biases = [
            f"Biases of the tension sensors were estimated too, {kind}; before, {prior['tension_bias_sd_N']:g} N."
        ]
    stated = (
        ("exit points", prior.get("anchor_sd_mm", 0.0)),
        ("platform points", prior.get("platform_sd_mm", 0.0)),
        ("poses", prior.get("pose_sd_mm", 0.0)),
    )
    known = [f"{name} were known to {sd:g} mm" for name, sd in stated if sd]
    return Points(
        "What was done",
        [
            f"{counted(found['holds'], 'hold')}, tensions read in {found['read']} of them.",
            *([f"Before, {' and '.join(known)}."] if known else []),
            f"Before, every reference length was known to {prior['reference_sd_mm']:g} mm, and specimens of one line "
            f"were assumed to differ by {100 * prior['specimen_spread']:g} %.",
            *biases,
        ],
    )


def _known(found: CalibrateJson) -> Points:
    if found["pose_now"] is None:
        return Points("What is known", ["Neither the lengths nor the pose.", found["observability"]["sentence"]])
    sd = [1e3 * v for v in found["with_creep_model"]["length_m"]["sd"]]
    place = coordinates(found["pose_now"]["position_m"])
    text = f"Every length is known to {from_to(min(sd), max(sd))} mm (standard error)."
    return Points("What is known", [text, f"The platform is at ({place}) m.", found["observability"]["sentence"]])


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
    a, b = creep["length_m"], hooke["length_m"]
    lines = [
        [
            str(i + 1),
            _milli(mean),
            f"{_milli(low)} … {_milli(high)}",
            _milli(strain),
            _milli(plain),
            f"{_milli(plain_low)} … {_milli(plain_high)}",
        ]
        for i, (mean, low, high, strain, plain, plain_low, plain_high) in enumerate(
            zip(a["mean"], a["q05"], a["q95"], creep["creep_strain"], b["mean"], b["q05"], b["q95"], strict=True)
        )
    ]
    header = ["wire", "length now, mm", "90 %", "creep strain, mm per m", "Hooke's law alone, mm", "90 %"]
    return Table(header, lines, "Zero-tension length of every wire when the last hold ended, creep included.")


def _biases(creep: EstimatedLengths) -> list[Block]:
    if "tension_bias_N" not in creep:
        return []
    pairs = zip(creep["tension_bias_N"]["mean"], creep["tension_bias_N"]["sd"], strict=True)
    rows = [[str(i + 1), *("–" if v is None else f"{v:.3f}" for v in (mean, sd))] for i, (mean, sd) in enumerate(pairs)]
    return [
        Table(
            ["wire", "bias of its sensor, N", "standard error, N"],
            rows,
            "By how much each tension sensor reads too high.",
        )
    ]


def _milli(value: float | None) -> str:
    """Thousandths; a search that did not converge may leave none."""
    return "–" if value is None else f"{1e3 * value:z.2f}"


def _next(found: CalibrateJson) -> list[Block]:
    joints = "No joint values are given: read more poses, or check the readings and their stated errors."
    if found["with_creep_model"]["converged"]:
        joints = "No tensions within the bounds hold the platform at its home pose: no joint values lead there."
    if found["joint_values_for_home_m"] is not None:
        values = ", ".join(f"{v:.5f}" for v in found["joint_values_for_home_m"])
        joints = f"Joint values that bring the platform to its home pose now, m: {values}."
    rows = [[f"{v:.3f}" for v in place] for place in found["next_positions_m"]]
    caption = "Positions whose readings would sharpen what is known most, the most useful first."
    if found["with_creep_model"]["converged"] and not found["usable"]:
        joints = "Set nothing in the controller: the warnings say why."
    caption += _gain(found)
    return [
        Text(joints),
        Table(["x, m", "y, m", "z, m"], rows, caption),
    ]


def _gain(found: CalibrateJson) -> str:
    """What visiting the proposed poses is worth."""
    sd = found["next_pose_sd_mm"]
    if len(sd) < 2:
        return ""
    return f" They take the error of a commanded position from {number(sd[0], 2)} to {number(sd[-1], 2)} mm (sd)."

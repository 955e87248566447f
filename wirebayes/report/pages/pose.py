"""The page of ``wirebayes pose``: where the platform goes, how sure that is, and where the uncertainty comes from."""

import math
from pathlib import Path
from typing import Any

from wirebayes.answers.headline import pose_in_a_sentence
from wirebayes.io.run_folder import read_json
from wirebayes.json_files.pose import PoseJson, TimeWithin, Tolerances
from wirebayes.json_files.values import INTERVAL
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
    embedded,
    files_beside,
    number,
    picture_file,
    seed_of_page,
    span,
)
from wirebayes.report.glossary import meaning
from wirebayes.report.pages import pose_history
from wirebayes.report.pages.robot_view import robot_view
from wirebayes.report.pages.wires_known import wires_known
from wirebayes.report.pictures.robot import CONTROLLERS
from wirebayes.robot.mechanics.wires_used import specimens_in_words
from wirebayes.sentences import lasting, quantity, specimens_are

_FIRST = 2  # pictures that prove the answer: how far it moves, and how far it turns
_CAPTIONS = {
    "drift": "How far the platform moves while the actuators stand still. Line: median, band: 90 % of the draws.",
    "rotation": "How far it turns. A symmetric pose turns only because specimens of one line differ.",
    "robot": "The robot where it was sent (blue) and, enlarged as the title says, where creep takes it (red).",
    "pose-error": "Distance from the pose, controllers with increasingly complete wire models, identical specimens.",
    "error-budget": "How much each parameter's uncertainty contributes to the variance of the drift.",
    "workspace-drift": "The platform at other positions, new wires: how far it moves within a minute. White with a "
    "cross: no tensions hold it.",
    "workspace-tilt": "The same: how far it tilts.",
}
_TURNED = "The same with the platform turned by the rotation vector that the title names."


def pose_page(folder: Path, configuration: dict[str, Any]) -> Page:
    """The content of ``pose.json`` and the pictures beside it."""
    content = read_json(folder / "pose.json")
    if "history" in content:
        return pose_history.pose_history_page(folder, configuration, content)
    pose: PoseJson = content
    blocks: list[Block] = before_the_answer(pose)
    view = robot_view(folder)
    turned = sorted({file.stem for file in folder.glob("workspace-[0-9]*") if file.suffix in (".svg", ".png")})
    captions = _CAPTIONS | dict.fromkeys(turned, _TURNED)
    files = {name: picture_file(folder, name) for name in captions if not (view and name == "robot")}
    pictures = [Picture(embedded(p), captions[n], captions[n]) for n, p in files.items() if p is not None]
    first, rest = pictures[:_FIRST], pictures[_FIRST:]
    blocks += [Pictures(first)] if first else []
    blocks += [*beside_the_answer(pose), Text(_next(pose)), Columns([_requested(pose), *_answers(pose)])]
    sections = [Section("Summary", blocks), Section("The robot", view)]
    sections += [Section("More pictures", [Pictures(rest)] if rest else [])]
    sections += [Section("Slices of the workspace", _slices(pose))]
    sections += [Section("Drift", _drift(pose)), Section("Pose error", _errors(pose))]
    sections += [
        Section("Between calibrations", _between(pose)),
        Section("Sources of uncertainty", _variance_shares(pose)),
    ]
    sections += [Section("How many equilibria", _equilibria(pose))]
    sections.append(files_beside(folder, _FILES))
    effects = pose.get("wires", {}).get("effects", [])
    sections.append(meaning(_TERMS, effects))
    lead = pose_in_a_sentence(pose)
    return Page(f"Robot {pose['robot']}", lead, [s for s in sections if s.blocks], seed_of_page(configuration))


_FILES = (
    ("pose.json", "every number of this page as JSON"),
    ("workspace.csv", "every point of the mapped slices"),
    ("scene.json", "points and tensions of the view that can be turned"),
    ("configuration.json", "the options of this run, with version and seed"),
)
_TERMS = ("90 % interval", "drift", "tilt", "controller", "specimen spread", "exit point")


def _next(pose: PoseJson) -> str:
    """What to do with this answer."""
    if any(warning["kind"] == "uncarried" for warning in pose["warnings"]):
        return "Next: [plane] in the robot's file, if a table or a rail carries the platform; else another pose."
    if not pose["feasible"]:
        return "Next: another pose or payload, or other bounds of the tension in the robot's file."
    return "Next: wirebayes calibrate finds the wires' lengths again, once the drift is more than you allow."


def _requested(pose: PoseJson) -> Points:
    place = ", ".join(number(float(x)) if x else "0" for x in pose["pose"]["position_m"])
    wires = pose.get("wires", {})
    points = [f"Platform of {pose['mass_kg']:g} kg at ({place}) m."]
    if "orientation" in pose:
        turned = ", ".join(f"{v:.4g}" for v in pose["pose"]["rotation_vector_rad"])
        points.append(f"Rotation vector ({turned}) rad. {pose['orientation']['sentence']}")
    if "plane" in pose:
        points.append(pose["plane"]["sentence"])
    if wires:
        points.append(wires_known(wires))
        points += specimens_in_words(wires)
        if pose.get("inverse"):
            low, high = (f(pose["inverse"]["tension_N"]) for f in (min, max))
            rule = pose["tension_distribution"]["choice"].replace("_", " ")
            points.append(f"Tensions by the rule “{rule}”: {number(low)} to {number(high)} N.")
        if angles := pose.get("inverse", {}).get("motor_angle_rad"):
            turned = ", ".join("no drum" if a is None else f"{a:.5g}" for a in angles["mean"])
            points.append(f"Motor angles, rad, counted from nothing paid out: {turned}.")
    return Points("What was computed", points)


def _answers(pose: PoseJson) -> list[Points]:
    known = []
    for entry in pose.get("drift", []):
        last = entry["times_s"][-1]
        if entry["distance_mm"]["q50"]:
            low, middle, high = (entry["distance_mm"][q][-1] for q in INTERVAL)
            alike = specimens_are(entry["specimen_spread"])
            moved = quantity(middle, low, high, "mm")
            known.append(f"After {lasting(last)} the platform has moved by {moved}, if {alike}.")
    claim = pose.get("claim")
    if claim:
        limits = f"less than {claim['distance_mm']:g} mm and tilts less than {claim['tilt_deg']:g}°"
        for held in claim["holds"]:
            chance, alike = _percent(held["probability"]), specimens_are(held["specimen_spread"])
            known.append(
                f"It moves {limits} within {lasting(claim['time_s'])} with a probability of {chance}, if {alike}."
            )
    space = pose.get("workspace")
    if space and claim:
        moved = quantity(space["q50_drift_mm"], space["q05_drift_mm"], space["q95_drift_mm"], "mm")
        known.append(
            f"Anywhere in the workspace it moves by {moved} within {lasting(claim['time_s'])}, and stays within both "
            f"limits with a probability of {_percent(space['probability'])}."
        )
    unknown = ["How much specimens of one line differ is assumed, not measured, unless three or more were tested."]
    known = known or ["Nothing: the pose cannot be held."]
    return [Points("What is known", known), Points("What is not known", unknown)]


def _percent(share: float | None) -> str:
    return "–" if share is None else f"{100 * share:.0f} %"


def _slices(pose: PoseJson) -> list[Block]:
    lines = []
    space = pose.get("workspace")
    for entry in space["slices"] if space else []:
        turn = entry["rotation_vector_rad"]
        named = f"({', '.join(f'{v:.3g}' for v in turn)}) rad" if any(turn) else "level"
        cells = [named, f"{entry['axis']} = {entry['at_m']:.3g} m", f"{100 * entry['feasible']:.0f} %"]
        if entry["feasible"]:
            drift = [number(entry["q50_drift_mm"]), span(entry["q05_drift_mm"], entry["q95_drift_mm"])]
            tension = span(entry["lowest_tension_N"], entry["highest_tension_N"])
            cells += [*drift, number(entry["q50_tilt_deg"]), number(entry["probability"], 2), tension]
        lines.append([*cells, *["–"] * (8 - len(cells))])
    header = ["orientation", "slice", "held", "moved, mm", "90 %", "tilt, degrees", "probability", "tensions, N"]
    caption = (
        "A minute on new wires, over poses and draws. Held: share of the positions that tensions within the bounds "
        "hold; probability: that the platform moves less than 0.3 mm and tilts less than 0.055°. workspace.csv has "
        "every point."
    )
    return [Table(header, lines, caption)] if lines else []


def _drift(pose: PoseJson) -> list[Block]:
    lines = []
    entries = pose.get("drift", [])
    angles = [entry[name] for entry in entries for name in ("tilt_deg", "from_vertical_deg")]
    turns = any(any(band["q95"] or ()) for band in angles)  # there are no bands where no draw could be solved
    for entry in entries:
        bands = [entry["distance_mm"], *([entry["tilt_deg"], entry["from_vertical_deg"]] if turns else [])]
        for i, time in enumerate(entry["times_s"]):
            if entry["distance_mm"]["q50"] and time > 0:
                cells = []
                for band in bands:
                    low, middle, high = (band[q][i] for q in INTERVAL)
                    cells += [number(middle), span(low, high)]
                lines.append([f"{100 * entry['specimen_spread']:g} %", f"{time:g}", *cells])
    header = ["specimen spread", "after, s", "moved, mm", "90 %"]
    header += ["tilt, degrees", "90 %", "from vertical, degrees", "90 %"] if turns else []
    caption = "Tilt: angle of the platform's normal to the commanded one; beside it, to the vertical. " if turns else ""
    return [Table(header, lines, caption + "Draws whose platform falls are left out.")] if lines else []


def _errors(pose: PoseJson) -> list[Block]:
    lines = []
    for entry in pose.get("pose_error", []):
        for i, time in enumerate(entry["times_s"]):
            if not entry["distance_mm"]["q50"] or time not in (60, 600, entry["times_s"][-1]):
                continue
            low, middle, high = (entry["distance_mm"][q][i] for q in INTERVAL)
            who = [CONTROLLERS[entry["controller"]], f"{100 * entry['specimen_spread']:g} %"]
            lines.append([*who, f"{time:g}", number(middle), span(low, high), _longest_time(entry)])
    header = ["controller", "specimen spread", "after, s", "pose error, mm", "90 %"]
    header.append("last requested time within tolerance, s")
    if not lines:
        return []
    evaluated = ", ".join(f"{time:g}" for time in pose["pose_error"][0]["times_s"])
    grid = (
        f" The last column is the last of the requested times that is ({evaluated} s); the next section has finer ones."
    )
    return [Table(header, lines, _limits(pose["pose_error"][0]) + grid)]


def _between(pose: PoseJson) -> list[Block]:
    lines = []
    for entry in pose.get("between_calibrations", []):
        loaded = f"{entry['loaded_before_s'] / 3600:g} h" if entry["loaded_before_s"] else "never"
        spread = f"{100 * entry['specimen_spread']:g} %"
        lines.append([CONTROLLERS[entry["controller"]], spread, loaded, _longest_time(entry)])
    header = ["controller", "specimen spread", "loaded before", "longest time between calibrations, s"]
    if not lines:
        return []
    grid = " The last column is the last of eight times a decade, from 1 s on: it is at most a quarter too short."
    limits = _limits(pose["between_calibrations"][0])
    return [Table(header, lines, f"The pose is exact when a calibration ends. {limits}{grid}")]


def _limits(entry: Tolerances) -> str:
    allowed = f"{entry['tolerance_mm']:g} mm and {entry['tolerance_deg']:.3g}°"
    return f"Within tolerance: less than {allowed} with a probability of 95 % at all earlier times."


def _longest_time(entry: TimeWithin) -> str:
    longest = number(float(entry["longest_time_within_s"]))
    return f"more than {longest}" if entry["still_within_at_the_end"] else longest


def _variance_shares(pose: PoseJson) -> list[Block]:
    shares = pose.get("variance_shares", {}).get("shared_draw")
    if not shares:
        return []
    lines = [[name, f"{100 * share:.0f} %"] for name, share in shares.items()]
    caption = f"Each parameter's share of the variance of the drift after {pose['variance_shares']['time_s']:g} s."
    return [Table(["parameter", "share"], lines, caption)]


def _equilibria(pose: PoseJson) -> list[Block]:
    found = pose.get("equilibria")
    if not found:
        return []
    count = found["stable_found"]
    many = "one stable equilibrium" if count == 1 else f"{count} stable equilibria"
    own = "the commanded pose is one of them" if count > 1 else "the commanded pose"
    unstable = "the commanded pose is balanced but not stable, so none of them"
    own = own if found["commanded_stable"] else unstable
    text = f"From {found['starts']} starts the mean wire's lengths lead to {many}: {own}."
    proof = pose["certificate"]
    if proof.get("sentence"):
        return [Text(f"{text} {proof['sentence']}")]
    if not proof["proved"]:
        return [Text(f"{text} Interval arithmetic could not prove that the one shown is the only one.")]
    alone = f"{number(1e3 * proof['alone_within_m'])} mm"
    proved = f"{text} Interval arithmetic proves that no other equilibrium lies within {alone} of the pose."
    band = proof.get("band")
    if band is None or band["low_mm"] is None or band["high_mm"] is None:
        return [Text(proved)]
    part = "all" if band["share"] == 1 else f"the middle {100 * band['share']:g} %"
    axes = zip("xyz", band["low_mm"], band["high_mm"], strict=True)
    box = ", ".join(f"{axis} {_outward(low, high)} mm" for axis, low, high in axes)
    sure = (
        f"With stiffness and creep of each wire independently anywhere in {part} of their 90 % bands, and the mean "
        f"wire's joint values commanded, the platform is certain to be in this box about the pose after "
        f"{band['time_s']:g} s: {box}. This is proved for the whole way there, with wires up to a tenth of the creep "
        "out of step."
    )
    return [Text(proved), Text(sure)]


def _outward(low: float, high: float) -> str:
    """A proved interval, rounded outward to a hundredth of its width (and no finer than it can be read)."""
    digits = max(0, 2 - math.floor(math.log10(max(high - low, 1e-9))))
    scale = 10.0**digits
    return f"{math.floor(low * scale) / scale:.{digits}f} to {math.ceil(high * scale) / scale:.{digits}f}"

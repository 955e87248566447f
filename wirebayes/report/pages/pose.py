"""The page of ``wirebayes pose``: where the platform goes, how sure that is, and where the uncertainty comes from."""

import math
from pathlib import Path

from wirebayes.answers.headline import pose_in_a_sentence
from wirebayes.answers.robot import stays_in_words
from wirebayes.io.run_folder import read_json
from wirebayes.json_files.pose import Drift, EquilibriaJson, PoseJson, SliceOfWorkspace, TimeWithin, Tolerances, stays
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
    captioned,
    files_beside,
    number,
    picture_file,
    seed_of_page,
    span,
)
from wirebayes.report.cells import NONE, at_row, percent
from wirebayes.report.glossary import meaning
from wirebayes.report.pages import pose_history
from wirebayes.report.pages.robot_view import robot_view
from wirebayes.report.pages.wires_known import wires_known
from wirebayes.report.pictures.robot import CONTROLLERS
from wirebayes.robot.mechanics.wires_used import specimens_in_words, undecided_in_words
from wirebayes.sentences import lasting, quantity, short, specimens_are

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


def pose_page(folder: Path, configuration: Configuration) -> Page:
    """The content of ``pose.json`` and the pictures beside it."""
    content = read_json(folder / "pose.json")
    if "history" in content:
        return pose_history.pose_history_page(folder, configuration, content)
    pose: PoseJson = content
    view = robot_view(folder)
    pictures = _pictures(folder, without_robot=bool(view))
    first = pictures[:_FIRST]
    rest = pictures[_FIRST:]
    blocks: list[Block] = before_the_answer(pose)
    if first:
        blocks.append(Pictures(first))
    blocks += beside_the_answer(pose)
    blocks.append(Text(_next(pose)))
    blocks.append(Columns([_requested(pose), *_answers(pose)]))
    sections = [
        Section("Summary", blocks),
        Section("The robot", view),
        Section("More pictures", [Pictures(rest)] if rest else []),
        Section("Slices of the workspace", _slices(pose)),
        Section("Drift", _drift(pose)),
        Section("Pose error", _errors(pose)),
        Section("Between calibrations", _between(pose)),
        Section("Sources of uncertainty", _variance_shares(pose)),
        Section("How many equilibria", _equilibria(pose)),
        files_beside(folder, _FILES),
        meaning(_TERMS, pose.get("wires", {}).get("effects", [])),
    ]
    filled = [section for section in sections if section.blocks]
    title = f"Robot {pose['robot']}"
    lead = pose_in_a_sentence(pose)
    return Page(title, lead, filled, seed_of_page(configuration))


def _pictures(folder: Path, without_robot: bool) -> list[Picture]:
    """The pictures of a pose that are there; the robot may be seen otherwise."""
    turned = sorted({file.stem for file in folder.glob("workspace-[0-9]*") if file.suffix in (".svg", ".png")})
    captions = _CAPTIONS | dict.fromkeys(turned, _TURNED)
    if without_robot:
        del captions["robot"]
    pictures = []
    for name, caption in captions.items():
        file = picture_file(folder, name)
        if file is not None:
            pictures.append(captioned(file, caption))
    return pictures


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
    drifts = pose.get("drift", [])
    if drifts and all(map(stays, drifts)):
        return "Next: wirebayes calibrate finds the wires' lengths."
    return "Next: wirebayes calibrate finds the wires' lengths again, once the drift is more than you allow."


def _requested(pose: PoseJson) -> Points:
    asked = pose["pose"]
    place = ", ".join(number(float(x)) if x else "0" for x in asked["position_m"])
    points = [f"Platform of {pose['mass_kg']:g} kg at ({place}) m."]
    if "orientation" in pose:
        turned = ", ".join(f"{value:.4g}" for value in asked["rotation_vector_rad"])
        decided = pose["orientation"]["sentence"]
        points.append(f"Rotation vector ({turned}) rad. {decided}")
    if "plane" in pose:
        points.append(pose["plane"]["sentence"])
    wires = pose.get("wires")
    if wires:
        points.append(wires_known(wires))
        points += undecided_in_words(wires)
        points += specimens_in_words(wires)
        points += _commanded(pose)
    return Points("What was computed", points)


def _commanded(pose: PoseJson) -> list[str]:
    """Tensions and motor angles; nothing where no tensions hold the pose."""
    inverse = pose.get("inverse")
    if not inverse:
        return []
    tensions = inverse["tension_N"]
    low = number(min(tensions))
    high = number(max(tensions))
    rule = pose["tension_distribution"]["choice"].replace("_", " ")
    bounds = low if low == high else f"{low} to {high}"
    points = [f"Tensions by the rule “{rule}”: {bounds} N."]
    angles = inverse.get("motor_angle_rad")
    if angles:
        turned = ", ".join("no drum" if angle is None else f"{angle:.5g}" for angle in angles["mean"])
        points.append(f"Motor angles, rad, counted from no wire paid out: {turned}.")
    return points


def _answers(pose: PoseJson) -> list[Points]:
    known = [*_moved(pose), *_within_limits(pose)]
    unknown = ["How much specimens of one line differ is assumed, not measured, unless three or more were tested."]
    known = known or ["Nothing: the pose cannot be held."]
    return [Points("What is known", known), Points("What is not known", unknown)]


def _moved(pose: PoseJson) -> list[str]:
    """How far the platform has moved in the end."""
    entries = pose.get("drift", [])
    if entries and all(map(stays, entries)):
        answer = stays_in_words(pose)
        return [f"{answer[0].upper()}{answer[1:]}."]
    known = []
    for entry in entries:
        if entry["distance_mm"]["q50"]:
            low, middle, high = at_row(entry["distance_mm"], -1)
            moved = quantity(middle, low, high, "mm")
            time = lasting(entry["times_s"][-1])
            alike = specimens_are(entry["specimen_spread"])
            known.append(f"After {time} the platform has moved by {moved}, if {alike}.")
    return known


def _within_limits(pose: PoseJson) -> list[str]:
    """With what probability it moves little within a minute, here and anywhere in the workspace."""
    claim = pose.get("claim")
    if not claim:
        return []
    known = []
    time = lasting(claim["time_s"])
    limits = f"less than {claim['distance_mm']:g} mm and tilts less than {claim['tilt_deg']:g}°"
    for held in claim["holds"]:
        chance = percent(held["probability"])
        alike = specimens_are(held["specimen_spread"])
        known.append(f"It moves {limits} within {time} with a probability of {chance}, if {alike}.")
    space = pose.get("workspace")
    if space:
        how_far = "it does not move"
        if space["q95_drift_mm"]:
            moved = quantity(space["q50_drift_mm"], space["q05_drift_mm"], space["q95_drift_mm"], "mm")
            how_far = f"it moves by {moved}"
        known.append(
            f"Anywhere in the workspace {how_far} within {time}, and stays within both "
            f"limits with a probability of {percent(space['probability'])}."
        )
    return known


def _slices(pose: PoseJson) -> list[Block]:
    space = pose.get("workspace")
    lines = [_slice(entry) for entry in space["slices"]] if space else []
    header = ["orientation", "slice", "held", "moved, mm", "90 %", "tilt, degrees", "probability", "tensions, N"]
    caption = (
        "A minute on new wires, over poses and draws. Held: share of the positions that tensions within the bounds "
        "hold; probability: that the platform moves less than 0.3 mm and tilts less than 0.055°. workspace.csv has "
        "every point."
    )
    return [Table(header, lines, caption)] if lines else []


def _slice(entry: SliceOfWorkspace) -> list[str]:
    """One slice's row of the table."""
    turn = entry["rotation_vector_rad"]
    orientation = "level"
    if any(turn):
        components = ", ".join(f"{value:.3g}" for value in turn)
        orientation = f"({components}) rad"
    where = [orientation, f"{entry['axis']} = {short(entry['at_m'], 3)} m", percent(entry["feasible"])]
    if not entry["feasible"]:
        return [*where, *[NONE] * 5]
    return [
        *where,
        number(entry["q50_drift_mm"]),
        span(entry["q05_drift_mm"], entry["q95_drift_mm"]),
        number(entry["q50_tilt_deg"]),
        number(entry["probability"], 2),
        span(entry["lowest_tension_N"], entry["highest_tension_N"]),
    ]


def _drift(pose: PoseJson) -> list[Block]:
    entries = pose.get("drift", [])
    angles = [entry[name] for entry in entries for name in ("tilt_deg", "from_vertical_deg")]
    turns = any(any(band["q95"] or ()) for band in angles)  # there are no bands where no draw could be solved
    header = ["specimen spread", "after", "moved, mm", "90 %"]
    caption = "Draws whose platform falls are left out."
    if turns:
        header += ["tilt, degrees", "90 %", "from vertical, degrees", "90 %"]
        caption = f"Tilt: angle of the platform's normal to the commanded one; beside it, to the vertical. {caption}"
    lines = []
    for entry in entries:
        if entry["distance_mm"]["q50"]:
            lines += _drifted(entry, turns)
    return [Table(header, lines, caption)] if lines else []


def _drifted(entry: Drift, turns: bool) -> list[list[str]]:
    """A row for each time after the first."""
    bands = [entry["distance_mm"]]
    if turns:
        bands += [entry["tilt_deg"], entry["from_vertical_deg"]]
    spread = _spread(entry["specimen_spread"])
    lines = []
    for i, time in enumerate(entry["times_s"]):
        if time <= 0:
            continue
        cells = [spread, lasting(time)]
        for band in bands:
            low, middle, high = at_row(band, i)
            cells += [number(middle), span(low, high)]
        lines.append(cells)
    return lines


def _spread(share: float) -> str:
    return f"{100 * share:g} %"


def _errors(pose: PoseJson) -> list[Block]:
    entries = pose.get("pose_error", [])
    lines = []
    for entry in entries:
        who = [CONTROLLERS[entry["controller"]], _spread(entry["specimen_spread"])]
        times = entry["times_s"]
        distance = entry["distance_mm"]
        for i, time in enumerate(times):
            if distance["q50"] and time in (60, 600, times[-1]):
                low, middle, high = at_row(distance, i)
                lines.append([*who, lasting(time), number(middle), span(low, high), _longest_time(entry)])
    if not lines:
        return []
    header = ["controller", "specimen spread", "after", "pose error, mm", "90 %"]
    header.append("last requested time within tolerance")
    first = entries[0]
    evaluated = ", ".join(map(lasting, first["times_s"]))
    caption = (
        f"{_limits(first)} The last column is the last of the requested times ({evaluated}) that is within tolerance; "
        "the next section has finer ones."
    )
    return [Table(header, lines, caption)]


def _between(pose: PoseJson) -> list[Block]:
    entries = pose.get("between_calibrations", [])
    if not entries:
        return []
    lines = []
    for entry in entries:
        controller = CONTROLLERS[entry["controller"]]
        spread = _spread(entry["specimen_spread"])
        loaded = "never"
        if entry["loaded_before_s"]:
            hours = entry["loaded_before_s"] / 3600
            loaded = f"{hours:g} h"
        lines.append([controller, spread, loaded, _longest_time(entry)])
    header = ["controller", "specimen spread", "loaded before", "longest time between calibrations"]
    limits = _limits(entries[0])
    grid = (
        "The last column is the last such time on a grid of eight per decade, from 1 s on: at most a quarter too short."
    )
    return [Table(header, lines, f"The pose is exact when a calibration ends. {limits} {grid}")]


def _limits(entry: Tolerances) -> str:
    allowed = f"{entry['tolerance_mm']:g} mm and {entry['tolerance_deg']:.3g}°"
    return f"Within tolerance: less than {allowed} with a probability of 95 % at all earlier times."


def _longest_time(entry: TimeWithin) -> str:
    longest = lasting(float(entry["longest_time_within_s"]))
    return f"more than {longest}" if entry["still_within_at_the_end"] else longest


def _variance_shares(pose: PoseJson) -> list[Block]:
    shares = pose.get("variance_shares", {}).get("shared_draw")
    if not shares:
        return []
    lines = [[name, percent(share)] for name, share in shares.items()]
    caption = f"Each parameter's share of the variance of the drift after {lasting(pose['variance_shares']['time_s'])}."
    return [Table(["parameter", "share"], lines, caption)]


def _equilibria(pose: PoseJson) -> list[Block]:
    found = pose.get("equilibria")
    if not found:
        return []
    text = f"From {found['starts']} starts the mean wire's lengths lead to {_how_many(found)}."
    proof = pose["certificate"]
    if proof.get("sentence"):
        return [Text(f"{text} {proof['sentence']}")]
    if not proof["proved"]:
        return [Text(f"{text} Interval arithmetic could not prove that the one shown is the only one.")]
    alone_mm = 1e3 * proof["alone_within_m"]
    alone = number(alone_mm)
    proved = f"{text} Interval arithmetic proves that no other equilibrium lies within {alone} mm of the pose."
    band = proof.get("band")
    if band is None or band["low_mm"] is None or band["high_mm"] is None:
        return [Text(proved)]
    part = "all" if band["share"] == 1 else f"the middle {100 * band['share']:g} %"
    axes = zip("xyz", band["low_mm"], band["high_mm"], strict=True)
    box = ", ".join(f"{axis} {_outward(low, high)} mm" for axis, low, high in axes)
    sure = (
        f"With stiffness and creep of each wire independently anywhere in {part} of their 90 % bands, and the mean "
        f"wire's joint values commanded, the platform is certain to be in this box about the pose after "
        f"{lasting(band['time_s'])}: {box}. This is proved for the whole way there, with wires up to a tenth of the "
        "creep out of step."
    )
    return [Text(proved), Text(sure)]


def _how_many(found: EquilibriaJson) -> str:
    """How many stable equilibria there are, and whether the pose is among them."""
    count = found["stable_found"]
    many = "one stable equilibrium" if count == 1 else f"{count} stable equilibria"
    if not found["commanded_stable"]:
        own = "the commanded pose is balanced but not stable, so none of them"
    elif count > 1:
        own = "the commanded pose is one of them"
    else:
        own = "the commanded pose"
    return f"{many}: {own}"


def _outward(low: float, high: float) -> str:
    """A proved interval in mm, rounded outward to a hundredth of its width, or to nanometres if that is finer."""
    digits = max(0, 2 - math.floor(math.log10(max(high - low, 1e-4))))
    scale = 10.0**digits
    below = math.floor(low * scale) / scale
    above = math.ceil(high * scale) / scale
    return f"{below:.{digits}f} to {above:.{digits}f}".replace("-", "−")

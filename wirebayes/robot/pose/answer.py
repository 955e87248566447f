"""Everything that `pose` reports about one robot, one line and one pose, as plain numbers with bands."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator

from wirebayes.json_files.pose import (
    Claim,
    ClaimHolds,
    DriftBands,
    InverseKinematics,
    MotorAngles,
    PoseJson,
    VarianceShares,
    Workspace,
)
from wirebayes.json_files.values import Band
from wirebayes.numeric.typing import Floats
from wirebayes.progress import Progress, ShareDone, part_of, shares_of, silent
from wirebayes.result_warnings import Notice, NoticeJson, to_json
from wirebayes.robot.mechanics import draws, drums, sag, statics, wire_doubts
from wirebayes.robot.mechanics import rotation as turning
from wirebayes.robot.mechanics.description import Drums, Robot
from wirebayes.robot.mechanics.draws import WireDraws
from wirebayes.robot.mechanics.winches import of_each_winch
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.mechanics.wires_used import wires_summary
from wirebayes.robot.motion import claim, control, drift, inverse, plausible
from wirebayes.robot.motion.claim import DISTANCE_M, TILT_RAD, TIME_S
from wirebayes.robot.motion.course import Course
from wirebayes.robot.pose import controllers, on_plane, stability, variance_shares
from wirebayes.robot.pose.maps import Map, map_slices, summaries
from wirebayes.robot.pose.orientation import Orientation, by_lines
from wirebayes.robot.pose.request import PoseRequest, band_over_draws
from wirebayes.robot.pose.round_trip import round_trip, stable_poses
from wirebayes.robot.proof import proofs
from wirebayes.sentences import short

_LEVEL = 1e-6  # sine of a wire's angle to the horizontal: so little is rounding in the robot's file


@dataclass(frozen=True)
class PoseAnswer:
    """What `pose` found.

    Attributes
    ----------
    content : dict
        The content of ``pose.json`` (arrays not yet lists).
    courses : dict of specimen spread to Course
        The drifts, for pictures; empty when the pose cannot be held.
    maps : tuple of Map
        A minute's drift over slices of the workspace.
    """

    content: PoseJson
    courses: dict[float, Course]
    maps: tuple[Map, ...] = ()


def pose_report(
    robot: Robot,
    line: WireDraws,
    request: PoseRequest,
    other: WireDraws | None = None,
    progress: Progress = silent,
) -> PoseAnswer:
    """Inverse and forward kinematics, drift, pose error and where it comes from.

    Parameters
    ----------
    robot : Robot
    line : WireDraws
    request : PoseRequest
    other : WireDraws, optional
        Another fit of the same line, used by one more controller.
    progress : function of name, done and total

    Returns
    -------
    PoseAnswer
    """
    x, R = request.position_m, request.rotation
    tau = inverse.tensions(robot, x[None], R[None])
    turned = request.orientation or Orientation(x, R)
    content = _requested(robot, line, x, R, turned)
    if not np.isfinite(tau).all():
        why_not = _why_not(robot, x, turned)
        return _unheld(robot, content, *why_not)
    lifted = on_plane.lifted(robot, x, R, tau[0])
    if lifted:
        return _unheld(robot, content, lifted)
    shared = draws.for_robot(robot, line)
    commands = inverse.commands(robot, shared, x[None], R[None], tau)
    feasible = commands.feasible
    content["feasible_draws"] = float(feasible.mean())
    if not feasible.any():
        return _unheld(robot, content, "These wires cannot pull as hard as the pose requires, however far stretched.")
    held = _Held(robot, line, shared, request, commands, tau)
    if robot.winch is not None:
        held = _by_winches(held, content)
    return _held_answer(held, other, turned, content, progress)


def _by_winches(held: "_Held", content: PoseJson) -> "_Held":
    """The pose that winches make of a requested one which drive several lines; the answer is of that one."""
    robot, request, commands = held.robot, held.request, held.commands
    tau = commands.tension_N[commands.feasible].mean(0, keepdims=True)
    x, asked = request.position_m[None], request.rotation[None]
    R = inverse.commands(robot, control.known(held.wires), x, asked, tau).rotation[0]
    content["pose"]["rotation_vector_rad"] = turning.vector(R)
    if robot.joints < robot.freedoms:
        content["orientation"] = by_lines(robot, R)
    return replace(held, request=replace(request, rotation=R), tension_N=tau)


@dataclass(frozen=True)
class _Held:
    """A pose that wires hold, `wires` being those without spread: its tensions ``(1, w)`` and the commands to it."""

    robot: Robot
    line: WireDraws
    wires: Wires
    request: PoseRequest
    commands: inverse.Commands
    tension_N: Floats


def _held_answer(
    held: _Held, other: WireDraws | None, turned: Orientation, content: PoseJson, progress: Progress
) -> PoseAnswer:
    """What is said of a pose that can be held, besides what `content` has already."""
    robot, line, request = held.robot, held.line, held.request
    x, R = request.position_m, request.rotation
    rng = np.random.default_rng(request.seed)
    _describe_pose(held, rng, content)
    courses = _courses(held, rng, part_of(progress, "drift"))
    _describe_creep(held, courses, content)
    content["pose_error"] = controllers.errors(robot, line, request, rng, other, part_of(progress, "pose error"))
    lasting = part_of(progress, "time between calibrations")
    content["between_calibrations"] = controllers.between_calibrations(robot, line, request, rng, lasting)
    content["variance_shares"] = _shares(robot, line, courses, x, R)
    warnings = _warnings(held, courses, content["equilibria"]["commanded_stable"], turned)
    content["warnings"] = to_json([*warnings, *on_plane.friction_notices(content.get("plane"))])
    spaces = map_slices(robot, line, request.slices, part_of(progress, "workspace"))
    content["workspace"] = _workspace(spaces)
    return PoseAnswer(content, courses, spaces)


def _describe_pose(held: _Held, rng: Generator, content: PoseJson) -> None:
    """Add what is said of the pose of new wires: its joint values, the way back from these, and other equilibria."""
    robot, wires, commands = held.robot, held.wires, held.commands
    x, R = held.request.position_m, held.request.rotation
    tension_N = held.tension_N[0]
    content["inverse"] = _inverse(robot, commands, tension_N)
    if robot.plane is not None:
        content["plane"] = on_plane.on_plane(robot, wires, commands, x, R, tension_N)
    content["forward"] = round_trip(robot, wires, commands, x, R)
    content["equilibria"] = stable_poses(robot, wires, x, R, rng)


def _describe_creep(held: _Held, courses: dict[float, Course], content: PoseJson) -> None:
    """Add what is said of the pose while its wires creep."""
    robot, wires = held.robot, held.wires
    x, R = held.request.position_m, held.request.rotation
    only = proofs.only_equilibrium(robot, wires, x, R)
    enclosed = proofs.enclosed(robot, wires, courses[0.0], x, R)
    content["certificate"] = {**only, **enclosed}
    content["drift"] = [{"specimen_spread": spread, **_drift(one, x, R)} for spread, one in courses.items()]
    content["stability"] = [{"specimen_spread": spread, **stability.summary(one)} for spread, one in courses.items()]
    content["claim"] = _claim(courses, x, R)


def _workspace(spaces: tuple[Map, ...]) -> Workspace | None:
    """The first orientation that is held anywhere as a whole, then every slice of each."""
    reached = [one for one in spaces if len(one.drift.position_m)]
    if not reached:
        return None
    return {**claim.claim_summary(reached[0].drift), "slices": summaries(spaces)}


def _courses(held: _Held, rng: Generator, progress: ShareDone) -> dict[float, Course]:
    """The drift from the pose, by the spread between specimens."""
    robot, request = held.robot, held.request
    at = request.position_m, request.rotation, request.times_s
    slip = control.largest_slip(request.tolerance_m, request.tolerance_rad)
    courses = {}
    done = shares_of(progress, len(request.spreads))
    for spread in request.spreads:
        wires = draws.for_robot(robot, held.line, spread, rng)
        courses[spread] = drift.from_command(robot, wires, *at, progress=next(done), slip=slip)
    return courses


def _warnings(held: _Held, courses: dict[float, Course], stable: bool, turned: Orientation) -> list[Notice]:
    """What speaks against the answer: weak wires, falls, what is not had, the robot's file, what was never tested."""
    out = [*_weak(held.commands), *stability.stability_warnings(courses, stable), *turned.turned_away]
    if turned.refused:
        out.append(Notice("geometry", turned.refused))
    out += plausible.robot_notices(held.robot) + plausible.strain_notices(held.robot, held.line, held.tension_N[0])
    return out + _untested(held)


def _unheld(robot: Robot, content: PoseJson, sentence: str, kind: str = "unheld") -> PoseAnswer:
    """An answer that ends because nothing holds the platform, and why."""
    content["feasible"] = False
    content["sentence"] = sentence
    content["warnings"] = unheld(robot, sentence, kind)
    return PoseAnswer(content, {})


def _why_not(robot: Robot, x: Floats, turned: Orientation) -> tuple[str, str]:
    """Why nothing holds the platform at the requested pose, and of which kind of warning that is."""
    if not statics.geometry(robot, x[:, None], turned.rotation[..., None]).clear[0]:
        nowhere = "A platform point lies on an exit point, inside a pulley or on its swivel axis: no wire runs there."
        return nowhere, "unheld"
    if robot.motions is None and not _pulled_up(robot, x, turned.rotation):
        open_ = (
            "No wire pulls upwards, so the wires cannot carry the weight here. If a table or a rail carries the "
            "platform, say so in the robot's file: [plane] with normal = [0.0, 0.0, 1.0]."
        )
        return open_, "uncarried"
    return turned.sentence or "No tensions within the bounds hold the platform at this pose.", "unheld"


def _pulled_up(robot: Robot, x: Floats, R: Floats) -> bool:
    """Whether some wire pulls the platform upwards, by more than rounding."""
    direction = statics.geometry_at(robot, x, R).direction[..., 0]
    return bool((-direction[2]).max() > _LEVEL)


def unheld(robot: Robot, sentence: str, kind: str = "unheld") -> list[NoticeJson]:
    """The warnings of an answer that ends because nothing holds the platform.

    Parameters
    ----------
    robot : Robot
        Whose file may be why.
    sentence : str
        Why.
    kind : str
    """
    return to_json([Notice(kind, sentence[:1].lower() + sentence[1:].rstrip(".")), *plausible.robot_notices(robot)])


def _requested(robot: Robot, line: WireDraws, x: Floats, R: Floats, turned: Orientation) -> PoseJson:
    """The request, the robot and the wires."""
    content: PoseJson = {
        "version": 1,
        "robot": robot.name,
        "mass_kg": robot.mass_kg,
        "pose": {"position_m": x, "rotation_vector_rad": turning.vector(R)},
        "wires": wires_summary(robot, line),
        "tension_distribution": {
            "choice": robot.rule.choice,
            "lowest_N": robot.rule.lowest_N,
            "highest_N": robot.rule.highest_N,
        },
        "feasible": True,
        "warnings": [],
    }
    if turned.found is not None:
        content["orientation"] = turned.found
    if turned.nearest_m is not None:
        content["nearest_position_m"] = turned.nearest_m
    return content


def _inverse(robot: Robot, commands: inverse.Commands, tension_N: Floats) -> InverseKinematics:
    found: InverseKinematics = {
        "tension_N": tension_N,
        "zero_tension_length_m": band_over_draws(commands.zero_m),
        "joint_value_m": band_over_draws(of_each_winch(robot, commands.joint_m)),
    }
    return found if robot.drums is None else {**found, **_motors(robot, robot.drums, commands.joint_m)}


def _weak(commands: inverse.Commands) -> list[Notice]:
    weak = 100 * (1 - float(commands.feasible.mean()))
    text = f"{short(weak, 2)} % of the draws cannot pull as hard as the pose requires, however far stretched"
    return [Notice("unheld", text)] if weak > 0 else []


def _untested(held: _Held) -> list[Notice]:
    """A warning for each way in which the pose leaves what was tested or what the model knows."""
    robot, request, commands = held.robot, held.request, held.commands
    out = wire_doubts.wire_warnings(robot, held.line, held.tension_N, float(request.times_s[-1]), commands.zero_m)
    out += sag.sag_warnings(robot, request.position_m, request.rotation, held.tension_N[0])
    out += plausible.pose_notices(robot, request.position_m, request.rotation)
    return out if robot.drums is None else out + _emptied(robot.drums, commands.joint_m[commands.feasible])


def _emptied(known: Drums, joint_m: Floats) -> list[Notice]:
    """A warning for each wire that is longer than its drum holds."""
    return [
        Notice("geometry", f"wire {i + 1} is longer here than its drum's wire_length_m, {known.wire_m[i]:g} m")
        for i in drums.emptied(known, joint_m)
    ]


def _motors(robot: Robot, known: Drums, joint_m: Floats) -> MotorAngles:
    """Motor angles and the wire that a radian pays out there; null for legs without a drum of known radius."""
    angle = drums.motor_angle(known, joint_m)
    _, slope = drums.paid_out(known, angle)
    angle, slope = of_each_winch(robot, angle), of_each_winch(robot, slope)
    return {"motor_angle_rad": _by_leg(angle), "wire_per_motor_angle_m_rad": _by_leg(slope)}


def _by_leg(values: Floats) -> Band:
    """Bands of legs one by one: what one leg does not have is no gap in the others."""
    bands = [band_over_draws(values[:, [i]]) for i in range(values.shape[1])]
    columns = zip(*(b.values() for b in bands), strict=True)
    mean, sd, low, middle, high = ([None if v is None else v[0] for v in column] for column in columns)
    return {"mean": mean, "sd": sd, "q05": low, "q50": middle, "q95": high}


def _drift(course: Course, x: Floats, R: Floats) -> DriftBands:
    shift, angle = drift.distance_moved(course, x, R)
    shift = np.where(course.found[:, None, None], shift, np.nan)
    distance = np.linalg.norm(shift, axis=-1)
    tilt = turning.tilt(course.rotation, R)
    from_vertical = turning.tilt(course.rotation)
    return {
        "times_s": course.times_s,
        "solved": float(course.found.mean()),
        "displacement_mm": band_over_draws(1e3 * shift),
        "distance_mm": band_over_draws(1e3 * distance),
        "tilt_deg": band_over_draws(np.degrees(tilt)),
        "from_vertical_deg": band_over_draws(np.degrees(from_vertical)),
        "rotation_deg": band_over_draws(np.degrees(angle)),
        "tension_N": band_over_draws(course.tension_N),
    }


def _claim(courses: dict[float, Course], x: Floats, R: Floats) -> Claim:
    """Probability, at this pose, of the paper's figures."""
    probability: list[ClaimHolds] = []
    for spread, course in courses.items():
        k = np.flatnonzero(course.times_s == TIME_S)
        value = None
        if k.size:
            distance = np.linalg.norm(course.position_m[:, k[0]] - x, axis=-1)
            tilt = turning.tilt(course.rotation[:, k[0]], R)
            inside = (distance < DISTANCE_M) & (tilt < TILT_RAD)
            value = float(inside.mean())
        probability.append({"specimen_spread": spread, "probability": value})
    return {
        "time_s": TIME_S,
        "distance_mm": 1e3 * DISTANCE_M,
        "tilt_deg": float(np.degrees(TILT_RAD)),
        "holds": probability,
    }


def _shares(robot: Robot, line: WireDraws, courses: dict[float, Course], x: Floats, R: Floats) -> VarianceShares:
    """Shares of the variance of the drift's size at the last time, shared draw; and what specimens add to it."""
    size = {spread: _last_distance(course, x, R) for spread, course in courses.items()}
    shared = size[0.0]
    held = np.isfinite(shared)
    result: VarianceShares = {"time_s": courses[0.0].times_s[-1], "output": "distance"}
    if robot.is_on_given_wires:
        result["sentence"] = "The robot's file gives the parameters of all wires: no share comes from the fit."
        return result
    if held.sum() < 30:
        result["sentence"] = "Fewer than 30 draws that hold the platform: no shares are computed."
        return result
    of_held = {name: values[held] for name, values in _parameters(line).items()}
    result["shared_draw"] = variance_shares.shares(of_held, shared[held])
    result["sd_mm"] = []
    for spread, distance_m in size.items():
        result["sd_mm"].append({"specimen_spread": spread, "sd_mm": _sd_mm(distance_m)})
    return result


def _last_distance(course: Course, x: Floats, R: Floats) -> Floats:
    """(n,) m from a pose at the last time."""
    shift, _ = drift.distance_moved(course, x, R)
    return np.linalg.norm(shift[:, -1], axis=-1)


def _parameters(line: WireDraws) -> dict[str, Floats]:
    """(n,) draws of all parameters that a drift depends on, named after their wire where there are several."""
    out: dict[str, Floats] = {}
    for wire, one in line.each.items():
        names = [*draws.CORE, *(column for effect in one.material() for column in effect.columns())]
        if draws.LENGTH_EXPONENT in one.parameters:
            names.append(draws.LENGTH_EXPONENT)
        mark = f"{wire} " if line.others else ""
        out |= {f"{mark}{name}": one.parameters[name] for name in names}
    return out


def _sd_mm(distance_m: Floats) -> float | None:
    """Standard deviation over the draws that have a distance; None where none has."""
    known = distance_m[np.isfinite(distance_m)]
    return 1e3 * float(known.std()) if known.size else None

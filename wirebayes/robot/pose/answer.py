"""Everything that `pose` reports about one robot, one line and one pose, as plain numbers with bands."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from wirebayes.robot.mechanics import draws, drums, sag, statics
from wirebayes.robot.mechanics import rotation as turning
from wirebayes.robot.mechanics.description import Drums, Robot
from wirebayes.robot.mechanics.draws import WireDraws
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion import claim, control, drift, forward, inverse, path
from wirebayes.robot.motion.claim import DISTANCE_M, TILT_RAD, TIME_S
from wirebayes.robot.pose import controllers, stability, variance_shares
from wirebayes.robot.pose.maps import Map, map_slices, summaries
from wirebayes.robot.pose.request import PoseRequest, band
from wirebayes.robot.proof import proofs
from wirebayes.typing import Floats


@dataclass(frozen=True)
class Answer:
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

    content: dict[str, Any]
    courses: dict[float, drift.Course]
    maps: tuple[Map, ...] = ()


def answer(robot: Robot, line: WireDraws, request: PoseRequest, other: WireDraws | None = None) -> Answer:
    """Inverse and forward kinematics, drift, pose error and where it comes from.

    Parameters
    ----------
    robot : Robot
    line : WireDraws
    request : PoseRequest
    other : WireDraws, optional
        Another fit of the same line, used by one more controller.

    Returns
    -------
    Answer
    """
    rng = np.random.default_rng(request.seed)
    shared = draws.for_robot(robot, line)
    x, R = request.position_m, request.rotation
    tau = inverse.tensions(robot, x[None], R[None])
    content: dict[str, Any] = {
        "version": 1,
        "robot": robot.name,
        "mass_kg": robot.mass_kg,
        "pose": {"position_m": x, "rotation_vector_rad": turning.vector(R[None])[0]},
        "wires": draws.summary(robot, line),
        "tension_distribution": {
            "choice": robot.rule.choice, "lowest_N": robot.rule.lowest_N, "highest_N": robot.rule.highest_N
        },
        "feasible": bool(np.isfinite(tau).all()),
    }  # fmt: skip
    if not content["feasible"]:
        said = "No tensions within the bounds hold the platform at this pose."
        if not statics.geometry(robot, x[:, None], R[..., None]).clear[0]:
            said = "A platform point lies inside a pulley or on its swivel axis: no wire runs there."
        return Answer(content | {"sentence": said}, {})
    commands = inverse.commands(robot, shared, x[None], R[None], tau)
    content["feasible_draws"] = float(commands.feasible.mean())
    if not commands.feasible.any():
        content["feasible"] = False
        said = "These wires cannot pull as hard as the pose requires, however far stretched."
        return Answer(content | {"sentence": said}, {})
    content["inverse"] = {
        "tension_N": tau[0],
        "zero_tension_length_m": band(commands.zero_m),
        "joint_value_m": band(commands.joint_m),
    }
    if robot.drums is not None:
        content["inverse"] |= _motors(robot.drums, commands.joint_m)
    content["forward"] = _round_trip(robot, shared, commands, x, R)
    content["equilibria"] = _all_equilibria(robot, shared, x, R, rng)
    stable = content["equilibria"]["commanded_stable"]
    content["certificate"] = proofs.alone(robot, shared, x, R)
    courses = {}
    content["drift"], losses = [], []
    for spread in request.spreads:
        wires = draws.for_robot(robot, line, spread, rng)
        courses[spread] = drift.from_command(robot, wires, x, R, request.times_s)
        content["drift"].append({"specimen_spread": spread} | _drift(courses[spread], x, R))
        losses += stability.warnings(courses[spread], spread, stable)
    content["stability"] = [{"specimen_spread": s} | stability.summary(c) for s, c in courses.items()]
    content["certificate"] |= proofs.enclosed(robot, shared, courses[0.0], x, R)
    content["claim"] = _claim(courses, x, R, request)
    content["pose_error"] = controllers.errors(robot, line, request, rng, other)
    content["between_calibrations"] = controllers.between_calibrations(robot, line, request, rng)
    content["variance_shares"] = _shares(line, courses, x, R)
    if content["feasible_draws"] < 1:
        weak = 100 * (1 - content["feasible_draws"])
        losses.insert(0, f"{weak:.2g} % of the draws cannot pull as hard as the pose requires, however far stretched")
    content["warnings"] = losses + draws.warnings(robot, line, tau, float(request.times_s[-1]), commands.zero_m)
    content["warnings"] += sag.warnings(robot, x, R, tau[0])
    if robot.drums is not None:
        content["warnings"] += _emptied(robot.drums, commands.joint_m[commands.feasible])
    spaces = map_slices(robot, line, request.slices)
    content["workspace"] = None
    held = [one for one in spaces if len(one.drift.position_m)]
    if held:  # the first orientation as a whole, then every slice of each
        content["workspace"] = claim.summary(held[0].drift) | {"slices": summaries(spaces)}
    return Answer(content, courses, spaces)


def _emptied(known: Drums, joint_m: Floats) -> list[str]:
    """A sentence for each wire that is longer than its drum holds."""
    return [
        f"wire {i + 1} is longer here than its drum's wire_length_m, {known.wire_m[i]:g} m"
        for i in drums.emptied(known, joint_m)
    ]


def _motors(known: Drums, joint_m: Floats) -> dict[str, Any]:
    """Motor angles and the wire that a radian pays out there; null for legs without a drum of known radius."""
    angle = drums.motor_angle(known, joint_m)
    return {"motor_angle_rad": _by_leg(angle), "wire_per_motor_angle_m_rad": _by_leg(drums.paid_out(known, angle)[1])}


def _by_leg(values: Floats) -> dict[str, Any]:
    """Bands of legs one by one: what one leg does not have is no gap in the others."""
    bands = [band(values[:, [i]]) for i in range(values.shape[1])]
    return {key: [None if b[key] is None else b[key][0] for b in bands] for key in bands[0]}


def _round_trip(robot: Robot, wires: Wires, commands: inverse.Commands, x: Floats, R: Floats) -> dict[str, Any]:
    """Forward kinematics of the commands, from a start beside the pose, must return to it."""
    back = forward.solve(robot, wires, commands.zero_m, commands.offset_m, x + 0.01 * robot.size_m, R)
    n = len(commands.zero_m)
    pose = np.repeat(x[None], n, 0), np.repeat(R[None], n, 0)
    stiff = path.lowest_stiffness(robot, wires, pose, (commands.zero_m, commands.offset_m))[commands.feasible]
    return {
        "solved": float(back.found.mean()),
        "statuses": {text: int((back.status == code).sum()) for code, text in forward.STATUS.items()},
        "largest_round_trip_error_m": float(np.abs(back.position_m - x)[back.found].max(initial=0.0)),
        "slack_wires": int((commands.tension_N[0] <= 0).sum()),
        "lowest_stiffness_N_m": band(stiff),
    }


def _all_equilibria(robot: Robot, wires: Wires, x: Floats, R: Floats, rng: np.random.Generator) -> dict[str, Any]:
    """The commanded pose, and every stable pose that the same lengths of the mean wire allow, from many starts."""
    mean = control.known(wires)
    tau = inverse.tensions(robot, x[None], R[None])
    commands = inverse.commands(robot, mean, x[None], R[None], tau)
    lengths = commands.zero_m[0], commands.offset_m[0]
    if not commands.feasible[0]:  # some draws are strong enough, their mean is not
        return {"stable_found": 0, "starts": 0, "commanded_stable": False, "poses": []}
    here = forward.solve(robot, mean, commands.zero_m, commands.offset_m, x, R)
    near_m = 1e-6 * robot.span_m
    stable = bool(here.found[0]) and bool(np.abs(here.position_m[0] - x).max() < near_m)
    found = forward.equilibria(robot, mean, *lengths, rng, known=(x, R))
    own = np.maximum(
        np.abs(found.position_m - x).max(1), robot.size_m * np.abs(found.rotation - R).max((1, 2))
    ) < near_m  # fmt: skip
    poses = [
        {"position_m": p, "rotation_vector_rad": v, "slack_wires": int((t <= 0).sum()), "commanded": bool(c),
         "stable": True}
        for p, v, t, c in zip(found.position_m, turning.vector(found.rotation), found.tension_N, own, strict=True)
    ]  # fmt: skip
    if not own.any():
        poses.append({"position_m": x, "rotation_vector_rad": turning.vector(R[None])[0],
                      "slack_wires": int((tau[0] <= 0).sum()), "commanded": True, "stable": False})  # fmt: skip
    return {
        "stable_found": len(found.position_m),
        "starts": 65,
        "commanded_stable": stable,
        "poses": poses,
    }


def _drift(course: drift.Course, x: Floats, R: Floats) -> dict[str, Any]:
    shift, angle = drift.moved(course, x, R)
    shift = np.where(course.found[:, None, None], shift, np.nan)
    return {
        "times_s": course.times_s,
        "solved": float(course.found.mean()),
        "displacement_mm": band(1e3 * shift),
        "distance_mm": band(1e3 * np.linalg.norm(shift, axis=-1)),
        "tilt_deg": band(np.degrees(turning.tilt(course.rotation, R))),
        "from_vertical_deg": band(np.degrees(turning.tilt(course.rotation))),
        "rotation_deg": band(np.degrees(angle)),
        "tension_N": band(course.tension_N),
    }


def _claim(courses: dict[float, drift.Course], x: Floats, R: Floats, request: PoseRequest) -> dict[str, Any]:
    """Probability, at this pose, of the paper's figures."""
    out: dict[str, Any] = {"time_s": TIME_S, "distance_mm": 1e3 * DISTANCE_M, "tilt_deg": float(np.degrees(TILT_RAD))}
    probability = []
    for spread, course in courses.items():
        k = np.flatnonzero(course.times_s == TIME_S)
        value = None
        if k.size:
            distance = np.linalg.norm(course.position_m[:, k[0]] - x, axis=-1)
            value = float(((distance < DISTANCE_M) & (turning.tilt(course.rotation[:, k[0]], R) < TILT_RAD)).mean())
        probability.append({"specimen_spread": spread, "probability": value})
    return out | {"holds": probability}


def _shares(line: WireDraws, courses: dict[float, drift.Course], x: Floats, R: Floats) -> dict[str, Any]:
    """Shares of the variance of the drift's size at the last time, shared draw; and what specimens add to it."""
    size = {s: np.linalg.norm(drift.moved(c, x, R)[0][:, -1], axis=-1) for s, c in courses.items()}
    held = np.isfinite(size[0.0])
    kept: dict[str, Floats] = {}
    for wire, one in line.each.items():
        names = [*draws.CORE, *(column for effect in one.material() for column in effect.columns())]
        names += [name for name in (draws.LENGTH_EXPONENT,) if name in one.parameters]
        own = f"{wire} " if line.others else ""
        kept |= {f"{own}{name}": one.parameters[name][held] for name in names}
    result: dict[str, Any] = {"time_s": courses[0.0].times_s[-1], "output": "distance"}
    if held.sum() < 30:
        return result | {"sentence": "Fewer than 30 draws that hold the platform: no shares are computed."}
    result["shared_draw"] = variance_shares.shares(kept, size[0.0][held])
    sd = {s: float(v[np.isfinite(v)].std()) if np.isfinite(v).any() else None for s, v in size.items()}
    result["sd_mm"] = [{"specimen_spread": s, "sd_mm": None if v is None else 1e3 * v} for s, v in sd.items()]
    return result

"""Everything that a calibration reports, as ``calibration.json`` holds it."""

from dataclasses import dataclass, replace

import numpy as np

from wirebayes.json_files.calibrate import (
    CalibratedPoses,
    CalibrateJson,
    CalibrationPrior,
    EstimatedDrums,
    EstimatedLengths,
    EstimatedPoses,
    IdentifiedJson,
    JointErrors,
    ObservabilityJson,
    PoseNow,
)
from wirebayes.numeric.typing import Floats
from wirebayes.progress import Progress, silent
from wirebayes.result_warnings import Notice, to_json
from wirebayes.robot.mechanics import drums, rotation
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.sag import sag_warnings_of_poses
from wirebayes.robot.mechanics.winches import of_each_winch
from wirebayes.robot.motion import home, inverse, plausible
from wirebayes.robot.self_calibration import sensors
from wirebayes.robot.self_calibration.calibrated import Calibrated, calibrated
from wirebayes.robot.self_calibration.equations import Holds, moved
from wirebayes.robot.self_calibration.estimate import estimate, progress_of
from wirebayes.robot.self_calibration.faults import fault_notices
from wirebayes.robot.self_calibration.identified import Identified, identified, weakest_in_words
from wirebayes.robot.self_calibration.mistaken import column_notices, tension_notices
from wirebayes.robot.self_calibration.next_poses import NextPoses, next_poses
from wirebayes.robot.self_calibration.open_where import contradicted_requests, most_open, odd_hold
from wirebayes.robot.self_calibration.posterior import RobotPosterior
from wirebayes.robot.self_calibration.residuals import contradicted, length_rms_m, lost, misfit, shown_joint_m, trust
from wirebayes.robot.self_calibration.search import RATHER, Searched, StatedPoses, searched
from wirebayes.robot.self_calibration.session import LengthPrior, Session
from wirebayes.robot.self_calibration.summary import Summary, summarised, wire_notices
from wirebayes.robot.self_calibration.trust import SIGNIFICANT, chance, interval_about, unlearnt, unlikely
from wirebayes.robot.self_calibration.unknowns import StatedErrors, Unknowns
from wirebayes.sentences import number, short

_UNEVEN = 0.05  # of the weight: balance that fails by more shows that something else held the platform


@dataclass(frozen=True)
class CalibrationAnswer:
    """The content of ``calibration.json``, and the robot with the history that it can go on from."""

    content: CalibrateJson
    robot: Robot
    known: Calibrated


def holds_of(robot: Robot, session: Session, readings: Floats) -> Holds:
    """A session with its readings, hold by hold.

    Parameters
    ----------
    robot : Robot
    session : Session
    readings : (r,) array
        Standardised: tensions of the holds that were read, then tilts.
    """
    tension = np.full(session.joint_m.shape, np.nan)
    count = int(session.read.sum()) * robot.legs
    tension[session.read] = readings[:count].reshape(-1, robot.legs) * session.tension_sd_N
    if session.tilt_sd_rad is None:
        return Holds(session, tension)
    tilt = np.full((len(tension), 2), np.nan)
    tilt[session.read] = readings[count:].reshape(-1, 2) * session.tilt_sd_rad
    return Holds(session, tension, tilt)


def calibration_report(
    robot: Robot,
    prior: LengthPrior,
    errors: StatedErrors,
    session: Session,
    readings: Floats,
    seed: int = 0,
    poses: StatedPoses = StatedPoses.MEASURED,
    visits: int = 5,
    progress: Progress = silent,
) -> CalibrationAnswer:
    """Calibrate a whole robot and say how far the answer can be trusted.

    Parameters
    ----------
    robot : Robot
        As its file says.
    prior : LengthPrior
        Of references, wires and sensors.
    errors : StatedErrors
        Of geometry and poses.
    session : Session
    readings : (r,) array
        Standardised, as `predicted.PredictedSession.readings`.
    seed : int
    poses : StatedPoses
    visits : int
        Number of poses to propose.
    progress : function of name, done and total
    """
    rng = np.random.default_rng(seed)
    holds = holds_of(robot, session, readings)
    search = searched(Unknowns(robot, prior, errors), holds, rng, poses, progress)
    found = search.found
    holds = search.holds
    seen = identified(search.found)
    ahead = next_poses(found, holds, visits, rng) if found.converged else NextPoses(np.empty((0, 3)), np.empty(0))
    requested = session if poses is StatedPoses.REQUESTED else None
    s = summarised(found)
    verdict = _Verdict(search, seen, contradicted_requests(found, requested))
    content: CalibrateJson = {
        "version": 2,
        "robot": robot.name,
        "holds": len(session.duration_s),
        "read": int(session.read.sum()),
        "prior": _prior(prior, errors, session),
        "exit_points_m": interval_about(*s.exit_m),
        "platform_points_m": interval_about(*s.platform_m),
        "zero_tension_lengths_m": interval_about(*s.length_m),
        "references_m": interval_about(*s.reference_m),
        **_drums(errors, s),
        "poses": _poses(s, session),
        "misfit": misfit(found),
        **_joint_errors(found),
        "identified": _identified(seen),
        "usable": verdict.usable,
        "sensors_at_fault": sensors.sensors_json(search.at_fault),
        "with_creep_model": _lengths(found, s, search.p),
        "by_hooke_alone": _by_hooke_alone(found, holds, prior, progress),
        **_now(robot, found, s, verdict.usable),
        "observability": _observability(seen, errors),
        "next_positions_m": ahead.position_m,
        "next_pose_sd_mm": 1e3 * ahead.pose_sd_m,
        "warnings": to_json(
            [
                *_warnings(verdict),
                *tension_notices(robot, session, readings),
                *([] if verdict.usable else _columns(search)),
                *fault_notices(search.explain, search.at_fault),
                *search.unlike,
                *wire_notices(robot, prior.line, session.duration_s, s, verdict.usable),
            ]
        ),
    }
    return CalibrationAnswer(content, moved(robot, found.unknowns.parts(found.state.white)), calibrated(found, session))


@dataclass(frozen=True)
class _Verdict:
    """What decides whether the values may be set in a controller."""

    search: Searched
    seen: Identified
    contradicted: list[Notice]

    @property
    def learnt(self) -> bool:
        """Whether the readings determine anything that was not known."""
        return self.seen.determined > 0 or self.seen.of == 0

    @property
    def uneven(self) -> bool:
        """Whether the tensions do not carry the weight."""
        return self.search.found.noise.balance > _UNEVEN

    @property
    def usable(self) -> bool:
        """Whether the values are known and nothing contradicts them."""
        search = self.search
        biased = search.at_fault is not None and search.at_fault.p_none < SIGNIFICANT
        explained = search.p >= SIGNIFICANT and not (search.inexact or search.too_near or self.uneven or biased)
        return bool(search.found.converged and self.learnt and explained and not self.contradicted)


def _prior(prior: LengthPrior, errors: StatedErrors, session: Session) -> CalibrationPrior:
    known: CalibrationPrior = {
        "reference_sd_mm": 1e3 * prior.reference_sd_m,
        "specimen_spread": prior.spread,
        "anchor_sd_mm": 1e3 * errors.exit_m,
        "platform_sd_mm": 1e3 * errors.platform_m,
        "pose_sd_mm": 1e3 * errors.pose_m,
        "drum_sd": errors.drum,
    }
    if prior.bias_sd_N > 0:
        known["tension_bias_sd_N"] = prior.bias_sd_N
        known["tension_bias_sign"] = "constant" if session.motion is None else "motion"
    return known


def _drums(errors: StatedErrors, summary: Summary) -> EstimatedDrums:
    """How much wider each leg's drum is than the robot's file says, where that was estimated."""
    if not errors.drum > 0:
        return {}
    drum = summary.drum
    return {"drum_wider_percent": interval_about(100 * drum.mean, 100 * drum.sd, drum.half)}


def _poses(summary: Summary, session: Session) -> EstimatedPoses:
    pairs = zip(summary.position_m, summary.turn_rad, strict=True)
    mean, sd, half = (np.hstack([position, turn]) for position, turn in pairs)
    numbers = np.asarray(session.numbers, float)
    return {"hold": numbers.tolist(), **interval_about(mean, sd, half)}


def _lengths(found: RobotPosterior, summary: Summary, p_joint: float) -> EstimatedLengths:
    reference = summary.reference_m
    known: EstimatedLengths = {
        "converged": found.converged,
        "misfit": misfit(found),
        "p_joint": p_joint,
        "length_m": interval_about(*summary.length_m),
        "creep_strain": summary.strain,
        "reference_error_mm": {"mean": 1e3 * reference.mean, "sd": 1e3 * reference.sd},
    }
    if found.unknowns.prior.bias_sd_N > 0:
        known["tension_bias_N"] = {"mean": summary.bias_N.mean, "sd": summary.bias_N.sd}
    return known


def _by_hooke_alone(found: RobotPosterior, holds: Holds, prior: LengthPrior, progress: Progress) -> EstimatedLengths:
    """What would be found if the wires did not creep."""
    without = replace(found.unknowns, prior=replace(prior, creeps=False))
    plain = estimate(without, holds, found.state, progress_of(progress, "without creep"))
    return _lengths(plain, summarised(plain), trust(plain))


def _observability(seen: Identified, errors: StatedErrors) -> ObservabilityJson:
    what = "points and lengths" if errors.exit_m or errors.platform_m else "lengths"
    determined = f"The readings determine {seen.determined} of {seen.of} combinations of {what}"
    least = weakest_in_words(seen.weakest, seen.weakest_sd_m)
    return {
        "rank": seen.determined,
        "of": seen.of,
        "weakest_combination": seen.weakest,
        "sentence": f"{determined}; of the lengths least of all {least}.",
    }


def _joint_errors(found: RobotPosterior) -> JointErrors:
    """How far the lengths are from the joint values; None where these are exact."""
    if found.unknowns.errors.joint_m == 0:
        return {"length_rms_mm": None, "joint_sd_mm": None}
    return {"length_rms_mm": 1e3 * length_rms_m(found), "joint_sd_mm": 1e3 * found.noise.joint_m}


def _identified(seen: Identified) -> IdentifiedJson:
    return {
        "determined": seen.determined,
        "of": seen.of,
        "combinations": [
            {"name": one.name, "before_mm": one.before_mm, "after_mm": one.after_mm, "determined": one.determined}
            for one in seen.combinations
        ],
        "not_determined": seen.sentences,
    }


def _now(robot: Robot, found: RobotPosterior, summary: Summary, usable: bool) -> CalibratedPoses:
    """Where the platform is after the last hold; joint values of the home pose where they can be used."""
    if not found.converged:
        return {"pose_now": None, "joint_values_for_home_m": None}
    pose: PoseNow = {"position_m": summary.position_m.mean[-1], "rotation_vector_rad": summary.turn_rad.mean[-1]}
    now: CalibratedPoses = {"pose_now": pose, "joint_values_for_home_m": None}
    if not usable:  # nobody should send the robot there
        return now
    joint_m = joint_values_to(found, robot.home_m, rotation.matrix(robot.home_rotation_rad))
    if not np.isfinite(joint_m).all():  # nothing holds the home pose
        return now
    now["joint_values_for_home_m"] = of_each_winch(robot, joint_m)
    if robot.drums is not None:
        now["motor_angles_for_home_rad"] = of_each_winch(robot, drums.motor_angle(robot.drums, joint_m))
    return now


def joint_values_to(found: RobotPosterior, position_m: Floats, turn: Floats) -> Floats:
    """Joint values that bring the platform to a pose after the session, by the robot that was found.

    Parameters
    ----------
    found : RobotPosterior
    position_m, turn : (3,), (3, 3) arrays
        The pose.

    Returns
    -------
    (w,) array
        m, of each leg; NaN where no tensions within the bounds hold the pose.
    """
    unknowns = found.unknowns
    parts = unknowns.parts(found.state.white)
    wires, _ = unknowns.prior.wires(unknowns.robot, parts.wires[None])
    there = moved(unknowns.robot, parts)
    pose = position_m[None], turn[None]
    tau = inverse.tensions(there, *pose)
    strain = found.creep.strain[-1][:, None]
    reference = parts.reference_m[:, None]
    drawn_m = inverse.commands(there, wires, *pose, tau, strain, reference).joint_m[0]
    return drawn_m / (1.0 + parts.drum)


def _warnings(verdict: _Verdict) -> list[Notice]:
    search = verdict.search
    found = verdict.search.found
    robot = found.unknowns.robot
    out = [*verdict.contradicted, *plausible.robot_notices(robot), *home.home_notices(robot)]
    if not found.converged:
        text = f"not converged: do not use these values; {_not_converged(found, search.holds.session)}"
        out.append(Notice("not-converged", text))
    else:
        out += odd_hold(found, search.holds.session)
        out += sag_warnings_of_poses(robot, found.state.position_m, found.state.rotation, found.state.pull_N)
    if search.requested:
        text = (
            "the stated poses are those that the joint values were computed for, or contradict the readings: they are "
            "taken for requests, and the poses as unknown; give --pose-sd if they were measured"
        )
        out.append(Notice("data", text))
    if found.converged and search.closer > RATHER:
        out.append(Notice("data", _perhaps_requests(search)))
    if search.too_near:
        text = (
            "geometry and references are found nearer to the robot's file than their stated errors allow: the file "
            "knows them better than --anchor-sd and --reference-sd say, or the joint values were computed for the "
            "stated poses, without which there is no answer; do not use these values before the errors are stated anew"
        )
        out.append(Notice("misfit", text))
    if found.converged and search.inexact:
        out.append(Notice("misfit", _inexact(search)))
    elif found.converged and search.p < SIGNIFICANT:
        out.append(unlikely(search.p))
    if found.converged and not (verdict.learnt or search.inexact):  # contradictions teach nothing
        out.append(unlearnt(1e3 * found.unknowns.prior.reference_sd_m))
    if verdict.uneven and not lost(found):  # else nothing is known of the tensions
        text = (
            f"the tensions leave {short(100 * found.noise.balance, 2)} % of the weight unbalanced: the platform was "
            "held by something else, or the tensions are not those of the wires; do not use these values"
        )
        out.append(Notice("misfit", text))
    return out


def _perhaps_requests(search: Searched) -> str:
    """What to do where the stated poses may be commands, though readings are too few to be sure."""
    with_poses = 1e3 * search.found.noise.joint_m
    without = with_poses / search.closer
    return (
        f"the joint values agree with the stated poses to {short(with_poses, 2)} mm, and to {short(without, 2)} mm if "
        "the poses are unknown: were they measured? If the robot was only sent there, leave them empty; if they were "
        "measured, say how well with --pose-sd"
    )


def _inexact(search: Searched) -> str:
    """What to do where joint values that are taken as exact contradict the rest."""
    found = search.found
    if found.unknowns.errors.joint_m == 0:  # no error of theirs explains it
        return (
            "robot and wires do not explain the readings together with the reference lengths (joint test, "
            f"{chance(search.p)}, mean squared residual {short(misfit(found), 3)}): do not use these values; check "
            "exit and platform points, which are taken as exact, --wires, the readings' units and signs, their order, "
            "--tension-sd and --reference-sd"
        )
    poses = search.holds.placed.any() and found.unknowns.errors.pose_m == 0
    exact, stated = (" and stated poses", "--pose-sd for the poses, ") if poses else ("", "")
    return (
        f"geometry{exact}, taken as exact, and joint values agree to {short(1e3 * shown_joint_m(found), 2)} mm only "
        f"(joint test, {chance(search.p)}): do not use these values; give --anchor-sd, {stated}or --joint-sd if the "
        "joint values are that uncertain, and check --wires, the readings' units and signs, --tension-sd and "
        "--reference-sd"
    )


def _columns(search: Searched) -> list[Notice]:
    """Tensions that do not carry the platform at the poses found, though in another unit or order they would."""
    state = search.found.state
    return column_notices(search.found.unknowns.robot, state.position_m, state.rotation, search.holds.tension_N)


def _not_converged(found: RobotPosterior, session: Session) -> str:
    """What to do about a search that found no mode."""
    if not lost(found):
        if contradicted(found):
            off = number(misfit(found) ** 0.5)
            return (
                f"the readings are {off} standard errors (root mean square) from what robot and wires allow; check "
                "their units, the order of the columns, and the robot's file"
            )
        return "read more poses, or check the readings and the stated errors"
    off_m = length_rms_m(found)
    off = f"{short(off_m, 2)} m (root mean square) from" if off_m < found.unknowns.robot.span_m else "not at all near"
    return (
        f"the joint values are {off} what robot and stated errors allow{most_open(found, session)}; "
        "check their units and signs, the order of the columns, and the robot's file"
    )

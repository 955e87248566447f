"""Everything that `calibrate` reports: lengths with intervals, Hooke alone, what cannot be observed, what next."""

from dataclasses import replace

import numpy as np
from scipy.special import ndtri

from wirebayes.json_files.calibrate import (
    CalibratedPoses,
    CalibrateJson,
    CalibrationPrior,
    EstimatedLengths,
    NamedEstimates,
    Observed,
)
from wirebayes.numeric.typing import Floats
from wirebayes.progress import Progress, silent
from wirebayes.result_warnings import Notice, to_json
from wirebayes.robot.mechanics import rotation
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.sag import sag_warnings_of_poses
from wirebayes.robot.mechanics.wire_doubts import doubts
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion import control, hanging, home, inverse, plausible
from wirebayes.robot.self_calibration import observability, sensors
from wirebayes.robot.self_calibration.calibrated import Calibrated, calibrated
from wirebayes.robot.self_calibration.estimate import GROSS, LengthPosterior, corrected_joints, length_posterior
from wirebayes.robot.self_calibration.mistaken import tension_notices
from wirebayes.robot.self_calibration.report_parts import estimated_lengths, pose_and_home, with_biases
from wirebayes.robot.self_calibration.session import LengthPrior, Session
from wirebayes.robot.self_calibration.summary import Moment
from wirebayes.robot.self_calibration.trust import SIGNIFICANT, chance, interval_about
from wirebayes.robot.self_calibration.whole import progress_of
from wirebayes.sentences import number, short

CANDIDATES = 200  # in the workspace: the best of them come within a few percent of the best there are
# Times the error of a reference length and the creep of the wire that crept most, by which a pose may be off. In
# simulated sessions of every shipped robot it was off by at most 2.7 times their sum.
_FAR = 10.0
_HALF = np.asarray(ndtri(0.95))  # standard deviations from the middle to the end of a 90 % interval


def lengths_report(
    robot: Robot,
    prior: LengthPrior,
    session: Session,
    readings: Floats,
    seed: int = 0,
    visits: int = 5,
    progress: Progress = silent,
) -> tuple[CalibrateJson, Calibrated]:
    """Calibrate one robot and say how far the answer can be trusted.

    Parameters
    ----------
    robot : Robot
    prior : LengthPrior
    session : Session
    readings : (r,) array
        Standardised, as `predicted.PredictedSession.readings`.
    seed : int
    visits : int
        Number of poses to propose.
    progress : function of name, done and total

    Returns
    -------
    content : dict
        Of ``calibration.json``; without a pose and joint values where the search did not converge.
    known : Calibrated
        What a history can start from.
    """
    known = length_posterior(robot, prior, session, readings[None], progress=progress_of(progress, "lengths"))
    hooke = replace(prior, creeps=False)
    plain = length_posterior(robot, hooke, session, readings[None], progress=progress_of(progress, "without creep"))
    given: CalibrationPrior = {"reference_sd_mm": 1e3 * prior.reference_sd_m, "specimen_spread": prior.spread}
    contradicted = _contradicted(robot, prior, session, known)
    at_fault = None if usable(known) else _at_fault(robot, prior, session, readings, known)
    content: CalibrateJson = {
        "version": 2,
        "robot": robot.name,
        "holds": len(session.duration_s),
        "read": int(session.read.sum()),
        "usable": usable(known) and not contradicted,
        "sensors_at_fault": sensors.sensors_json(at_fault),
        "misfit": float(known.misfit[0]),
        "prior": with_biases(given, prior, session),
        **_named(robot, prior, session, known),
        "length_rms_mm": None,
        "joint_sd_mm": None,
        "next_pose_sd_mm": [],
        "with_creep_model": _lengths(robot, prior, known),
        "by_hooke_alone": _lengths(robot, prior, plain),
        **_poses(robot, prior, known),
        **_observed(robot, prior, session, np.random.default_rng(seed), visits),
        "warnings": to_json(
            [
                *_unsure(known, plain),
                *contradicted,
                *tension_notices(robot, session, readings),
                *sensors.sensor_notices(at_fault),
                *plausible.robot_notices(robot),
                *_sag(robot, session, readings),
                *home.home_notices(robot),
                *doubts(robot, prior.line),
            ]
        ),
    }
    return content, calibrated(robot, prior, session, known)


def _sag(robot: Robot, session: Session, readings: Floats) -> list[Notice]:
    """What the wires' weight does where tensions ``(r,)``, standardised, were read; the platform as it was sent."""
    read = session.read
    tension_N = readings[: int(read.sum()) * robot.legs].reshape(-1, robot.legs) * session.tension_sd_N
    return sag_warnings_of_poses(robot, session.position_m[read], session.rotation[read], tension_N)


def usable(known: LengthPosterior) -> bool:
    """Whether the lengths may be set in a controller.

    Parameters
    ----------
    known : LengthPosterior
        Of one robot.
    """
    return bool(known.converged[0] and known.p_joint[0] >= SIGNIFICANT)


def _named(robot: Robot, prior: LengthPrior, session: Session, known: LengthPosterior) -> NamedEstimates:
    """Estimates in the words of a whole robot's calibration; its geometry is exact here."""
    zero = np.zeros((robot.legs, 3))
    reference = _moment(known, slice(robot.legs))
    before = prior.reference_sd_m
    learnt = reference.sd < 0.5 * before
    ended = known.ended_rotation[0]
    turn = rotation.vector(np.where(np.isfinite(ended), ended, np.eye(3)))
    pose = np.hstack([known.ended_m[0], turn])
    poses = interval_about(pose, known.ended_sd[0], _HALF)
    holds = np.asarray(session.numbers, float).tolist()
    open_ = []
    for i in np.flatnonzero(~learnt):
        widths = f"known to {short(1e3 * before, 2)} mm before, to {short(1e3 * reference.sd[i], 2)} mm now"
        open_.append(f"the reference length of wire {i + 1}: {widths}")
    determined = int(learnt.sum())
    return {
        "exit_points_m": interval_about(robot.exit_m, zero, _HALF),
        "platform_points_m": interval_about(robot.platform_m, zero, _HALF),
        "zero_tension_lengths_m": interval_about(known.length_m[0], known.length_sd_m[0], _HALF),
        "references_m": interval_about(*reference),
        "poses": {"hold": holds, **poses},
        "identified": {"determined": determined, "of": robot.legs, "combinations": [], "not_determined": open_},
    }


def _poses(robot: Robot, prior: LengthPrior, known: LengthPosterior) -> CalibratedPoses:
    """Where the robot is, and the joint values of its home; none where nothing holds it or nothing was found."""
    if not known.converged[0]:  # nobody should send the robot anywhere by it
        return {"pose_now": None, "joint_values_for_home_m": None}
    turn = rotation.vector(known.rotation)[0]
    joint = corrected_joints(robot, prior, known, robot.home_m, rotation.matrix(robot.home_rotation_rad))[0]
    return pose_and_home(robot, known.position_m[0], turn, joint)


def _unsure(known: LengthPosterior, plain: LengthPosterior) -> list[Notice]:
    """What speaks against the lengths, or against the comparison with those that ignore creep."""
    if not known.converged[0]:
        advice = "read more poses, or check the readings, --tension-sd and --reference-sd"
        if known.misfit[0] > GROSS:
            advice = (
                f"the readings are {number(known.misfit[0] ** 0.5)} standard errors from what robot and wires allow; "
                "check their units, the order of their columns, and the robot's file"
            )
        text = f"not converged with the creep model: do not use these lengths; {advice}"
        return [Notice("not-converged", text)]
    notices = []
    if not plain.converged[0]:
        text = "not converged with Hooke's law alone: what ignoring creep would cost is not known"
        notices.append(Notice("not-converged", text))
    if not known.p_joint[0] >= SIGNIFICANT:  # where it is not known, too
        text = (
            "robot and wires do not explain the readings together with the reference lengths (joint test, "
            f"{chance(known.p_joint[0])}, mean squared residual {short(known.misfit[0], 3)}): do not use these "
            "lengths; check exit and platform points, which are taken as exact, --wires, the readings' units and "
            "signs, --tension-sd and --reference-sd"
        )
        notices.append(Notice("misfit", text))
    return notices


def _contradicted(robot: Robot, prior: LengthPrior, session: Session, known: LengthPosterior) -> list[Notice]:
    """A warning for each hold whose requested pose is not where the joint values lead, for any plausible lengths."""
    if not known.converged[0]:
        return []
    begun_m, begun_rotation = known.begun_m[0], known.begun_rotation[0]
    shift = np.linalg.norm(begun_m - session.position_m, axis=1)
    turn = rotation.vector(session.rotation.mT @ begun_rotation)
    angle = np.linalg.norm(turn, axis=1)
    apart = np.maximum(shift, robot.size_m * angle)
    creep_m = known.creep[0] * known.length_m[0]
    error_m = prior.reference_sd_m + float(creep_m.max())
    plausible = _FAR * error_m
    out = []
    for i in np.flatnonzero(apart > plausible):
        text = (
            f"hold {session.numbers[i]:g}: the requested pose is {shift[i]:.3g} m and {angle[i]:.2g} rad from the one "
            f"that its joint values lead to, more than errors of the lengths and creep explain "
            f"({short(plausible, 2)} m); check both"
        )
        out.append(Notice("misfit", text))
    return out


def _at_fault(
    robot: Robot, prior: LengthPrior, session: Session, readings: Floats, known: LengthPosterior
) -> sensors.Suspects | None:
    """Which sensor would explain what contradicts; None where sensors have a bias already, or explain little of it."""
    if prior.bias_sd_N > 0:
        return None
    holds = int(session.read.sum())
    if holds < sensors.LEAST_HOLDS:
        return None
    tensions = readings[: holds * robot.legs]
    widest = session.tension_sd_N * float(tensions.max(initial=0.0))  # no more than it ever read
    if not widest > 0:
        return None
    # errors of sensors add to the readings: the first steps foresee already what they explain
    biased = replace(prior, bias_sd_N=widest)
    other = length_posterior(robot, biased, session, readings[None], patience=1)
    if not other.converged[0]:
        return None
    left = float(other.misfit[0] / known.misfit[0])  # of what contradicts, with errors of all sensors
    if other.p_joint[0] < SIGNIFICANT and left > 1 - sensors.MOST:
        return None
    bias = slice(-robot.legs, None)
    return sensors.weighed(other.unknowns[0, bias], other.covariance[0, bias, bias], widest)


def _moment(known: LengthPosterior, part: slice) -> Moment:
    """The moments of some of the unknowns."""
    sd = np.sqrt(np.diag(known.covariance[0]))
    return Moment(known.unknowns[0, part], sd[part], _HALF)


def _lengths(robot: Robot, prior: LengthPrior, known: LengthPosterior) -> EstimatedLengths:
    return estimated_lengths(
        converged=bool(known.converged[0]),
        misfit=float(known.misfit[0]),
        p_joint=float(known.p_joint[0]),
        length_m=Moment(known.length_m[0], known.length_sd_m[0], _HALF),
        creep=known.creep[0],
        reference_m=_moment(known, slice(robot.legs)),
        bias_N=_moment(known, slice(-robot.legs, None)) if prior.bias_sd_N > 0 else None,
    )


def _observed(robot: Robot, prior: LengthPrior, session: Session, rng: np.random.Generator, visits: int) -> Observed:
    """Rank and sentence for the poses that were read; poses worth reading next."""
    mean, _ = prior.moments(robot.legs)
    wires, _ = prior.wires(robot, mean[None])
    wires = control.known(wires)
    was_read = session.read
    zero, offset = inverse.lengths(robot, session.joint_m[was_read])
    position, turn = session.position_m[was_read], session.rotation[was_read]
    _, done = observability.length_sensitivity(robot, wires, position, turn, zero, offset)
    seen = observability.observe(done, session.tension_sd_N, prior.reference_sd_m, prior.bias_sd_N, session.bias_sign)
    next_m = _next_positions(robot, wires, prior, session, rng, visits)
    return {
        "observability": {
            "rank": seen.rank,
            "of": robot.legs,
            "weakest_combination": seen.weakest,
            "sentence": seen.sentence,
        },
        "next_positions_m": next_m,
    }


def _next_positions(
    robot: Robot, wires: Wires, prior: LengthPrior, session: Session, rng: np.random.Generator, visits: int
) -> Floats:
    """(v, 3) positions worth reading next."""
    x = rng.uniform(robot.lower_m, robot.upper_m, (CANDIDATES, 3))
    R = hanging.orientations(robot, x, rotation.matrix(robot.home_rotation_rad))
    tau = inverse.tensions(robot, x, R)
    good = np.isfinite(tau).all(1)
    x, R = x[good], R[good]
    commands = inverse.commands(robot, wires, x, R, tau[good])
    _, ahead = observability.length_sensitivity(robot, wires, x, R, commands.zero_m, commands.offset_m)
    pick = observability.choose_poses(ahead, visits, session.tension_sd_N, prior.reference_sd_m)
    return x[pick]

"""A first guess of reference lengths that slack wires cannot mislead.

A measured tension says how far a wire is stretched; so every reading closes a loop "stretched length = distance",
almost linear in pose and lengths, and the measured tensions must balance at every pose.
"""

from dataclasses import dataclass

import numpy as np

from wirebayes.numeric.batches import batch_first, batch_last
from wirebayes.numeric.linear_algebra import solve
from wirebayes.numeric.rows import chosen_rows
from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics import rotation, statics
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.wires import Wires, stretched_length
from wirebayes.robot.motion import inverse
from wirebayes.robot.self_calibration.predicted import PredictedSession, predict_session
from wirebayes.robot.self_calibration.session import LengthPrior, Session

_MOST_STEPS = 12  # of Gauss-Newton


@dataclass(frozen=True)
class _Loops:
    """What every reading of every robot says of its wires, r rows.

    Attributes
    ----------
    bare_m, offset_m : (r, w) arrays
        Commanded lengths, free and fixed.
    tension_N : (r, w) array
    stretch : (r, w) array
        Stretched over commanded length, by the tension and the expected creep.
    weight : (r, w) array
        One over the standard error of a loop, 1/m; 0 for a slack wire, which only says that its loop is too long.
    sd_N : float
        Standard error of a tension.
    """

    bare_m: Floats
    offset_m: Floats
    tension_N: Floats
    stretch: Floats
    weight: Floats
    sd_N: float


@dataclass(frozen=True)
class _Equations:
    """Loops and balance linearised, in standard errors; e equations a reading, poses in metres at the platform's edge.

    Attributes
    ----------
    residual : (r, e) array
    by_pose : (r, e, d) array
    by_length : (r, e, w) array
    """

    residual: Floats
    by_pose: Floats
    by_length: Floats


def starting_references(robot: Robot, prior: LengthPrior, session: Session, readings: Floats) -> Floats:
    """Reference errors ``(m, w)``, m, from closed loops and balance, creep taken as the prior expects it.

    Parameters
    ----------
    robot, prior, session, readings
        As for `estimate.calibrate`.
    """
    mean, _ = prior.moments(robot.legs)
    expected = predict_session(robot, prior, session, mean[None])
    loops = _loops(robot, prior, session, readings, expected)
    m = len(readings)
    x, R = _expected_poses(expected, m)
    error = np.zeros((m, robot.legs))
    for _ in range(_MOST_STEPS):
        equations = _linearised(robot, loops, x, R, error)
        change, move = _step(equations, error, prior.reference_sd_m)
        error = error + change
        x, R = _moved(robot, x, R, move)
        largest = np.abs(change).max()
        if not largest >= 1e-7:
            break
    # Absurd readings lead nowhere: such a robot starts from its references.
    known = np.asarray(np.isfinite(error).all(1))
    return chosen_rows(known, error, 0.0)


def _expected_poses(expected: PredictedSession, m: int) -> tuple[Floats, Floats]:
    """Poses ``(3, r)``, ``(3, 3, r)`` of the readings of m robots, where they are expected."""
    x = np.tile(expected.position_m[0], (m, 1))
    return x.T, batch_last(np.tile(expected.rotation[0], (m, 1, 1)))


def _moved(robot: Robot, x: Floats, R: Floats, move: Floats) -> tuple[Floats, Floats]:
    """Poses ``(3, r)``, ``(3, 3, r)`` after steps ``(d, r)``, of which long ones are cut."""
    largest = np.maximum(np.abs(move).max(0), 1e-300)
    share = np.minimum(1.0, 0.1 * robot.size_m / largest)
    step = move * share * robot.edge_scale[:, None]
    if robot.degrees == 6:
        R = rotation.compose(step[3:], R)
    return x + step[:3], R


def _loops(robot: Robot, prior: LengthPrior, session: Session, readings: Floats, expected: PredictedSession) -> _Loops:
    joint = session.joint_m[session.read]
    bare, offset = inverse.lengths(robot, joint)
    crept = expected.read_length_m[0] / bare
    tension = readings[:, : joint.size] * session.tension_sd_N
    tau = tension.reshape(-1, robot.legs)
    bare, offset, crept = (np.tile(values, (len(readings), 1)) for values in (bare, offset, crept))
    wires, _ = prior.wires(robot, prior.moments(robot.legs)[0][None])
    sd_N = float(np.hypot(session.tension_sd_N, prior.bias_sd_N))
    weight = _weight(tau, sd_N, bare * sd_N / wires.theta["k1"].mean())
    return _Loops(bare, offset, tau, _elastic(wires, tau) * crept, weight, sd_N)


def _elastic(wires: Wires, tension_N: Floats) -> Floats:
    """(r, w) stretched over zero-tension length."""
    pull = np.maximum(tension_N.T, 0.0)
    return stretched_length(wires, np.ones_like(pull), pull).T


def _weight(tension_N: Floats, sd_N: float, sd_m: Floats) -> Floats:
    """One over the standard errors of loops that tensions leave open by `sd_m`; 0 where a wire may be slack."""
    return (tension_N > 3 * sd_N) / np.hypot(1e-4, sd_m)


def _linearised(robot: Robot, loops: _Loops, x: Floats, R: Floats, error: Floats) -> _Equations:
    """Equations about poses ``(3, r)``, ``(3, 3, r)`` and reference errors ``(m, w)``."""
    r = len(loops.bare_m)
    of_readings = np.repeat(error, r // len(error), 0)
    loop, loop_by_pose = _closing(robot, loops, x, R, of_readings)
    balance, balance_by_pose = _balancing(robot, loops, x, R)
    weighted = loops.stretch * loops.weight
    loop_by_length = -weighted[:, None] * np.eye(robot.legs)
    balance_by_length = np.zeros((r, robot.degrees, robot.legs))
    value = np.concatenate([loop, balance], 1)
    by_pose = np.concatenate([loop_by_pose, balance_by_pose], 1)
    by_length = np.concatenate([loop_by_length, balance_by_length], 1)
    return _Equations(value, by_pose, by_length)


def _closing(robot: Robot, loops: _Loops, x: Floats, R: Floats, error: Floats) -> tuple[Floats, Floats]:
    """How far loops are open, ``(r, w)`` standard errors, and the slopes ``(r, w, d)`` by the pose."""
    shape = statics.geometry(robot, x, R)
    way = statics.stretched(robot, shape, loops.offset_m.T).T
    gap = way - (loops.bare_m + error) * loops.stretch
    J = statics.wire_jacobian(robot, shape) * robot.edge_scale[:, None, None]
    return gap * loops.weight, batch_first(J).mT * loops.weight[..., None]


def _balancing(robot: Robot, loops: _Loops, x: Floats, R: Floats) -> tuple[Floats, Floats]:
    """Imbalance of the measured tensions, ``(r, d)`` standard errors, and its slopes ``(r, d, d)`` by the pose."""
    scale, tau = robot.edge_scale[:, None], loops.tension_N.T
    shape = statics.geometry(robot, x, R)
    imbalance, hessian = statics.unbalance_and_stiffness(robot, shape, R, tau, np.zeros_like(tau))
    stiffness = batch_first(hessian) * (scale * scale.T)
    return (imbalance * scale).T / loops.sd_N, stiffness / loops.sd_N


def _step(equations: _Equations, error: Floats, reference_sd_m: float) -> tuple[Floats, Floats]:
    """Gauss-Newton changes of the reference errors ``(m, w)`` and of the poses ``(d, r)``.

    Poses are eliminated one by one; what is left speaks of the lengths.
    """
    m, legs = error.shape
    information, slope, answer = _without_poses(equations, legs)
    total = information.reshape(m, -1, legs, legs).sum(1) + np.eye(legs) / reference_sd_m**2
    pull = slope.reshape(m, -1, legs).sum(1) + error / reference_sd_m**2
    change = -solve(total, pull[..., None])[..., 0]
    of_readings = np.repeat(change, len(answer) // m, 0)
    move = -(answer[..., legs:] + answer[..., :legs] @ of_readings[..., None])
    return change, move[..., 0].T


def _without_poses(equations: _Equations, legs: int) -> tuple[Floats, Floats, Floats]:
    """What each reading says of the lengths once its pose is free, and how that pose answers.

    Returns
    -------
    information : (r, w, w) array
    slope : (r, w, 1) array
    answer : (r, d, w + 1) array
        To a change of each length, and last to the residuals.
    """
    by_pose, by_length = equations.by_pose, equations.by_length
    residual = equations.residual[..., None]
    mixed = by_pose.mT @ by_length
    normal = by_pose.mT @ by_pose + 1e-9 * np.eye(by_pose.shape[2])
    answer = solve(normal, np.concatenate([mixed, by_pose.mT @ residual], 2))
    information = by_length.mT @ by_length - mixed.mT @ answer[..., :legs]
    slope = by_length.mT @ residual - mixed.mT @ answer[..., legs:]
    return information, slope, answer

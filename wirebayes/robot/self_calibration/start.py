"""A first guess of reference lengths that slack wires cannot mislead.

A measured tension says how far a wire is stretched; so every reading closes a loop "stretched length = distance",
almost linear in pose and lengths, and the measured tensions must balance at every pose.
"""

from dataclasses import dataclass

import numpy as np

from wirebayes.numeric.linear_algebra import solve
from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics import rotation, statics
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.wires import stretched_length
from wirebayes.robot.motion import inverse
from wirebayes.robot.self_calibration.predicted import PredictedSession, predict_session
from wirebayes.robot.self_calibration.session import LengthPrior, Session


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


def starting_references(
    robot: Robot, prior: LengthPrior, session: Session, readings: Floats, iterations: int = 12
) -> Floats:
    """Reference errors ``(m, w)``, m, from closed loops and balance, creep taken as the prior expects it.

    Parameters
    ----------
    robot, prior, session, readings
        As for `estimate.calibrate`.
    iterations : int
        Gauss-Newton steps at most.
    """
    mean, _ = prior.moments(robot.legs)
    expected = predict_session(robot, prior, session, mean[None])
    m, q = len(readings), expected.position_m.shape[1]
    loops = _loops(robot, prior, session, readings, expected)
    x = np.tile(expected.position_m[0], (m, 1)).T
    R = np.moveaxis(np.tile(expected.rotation[0], (m, 1, 1)), 0, -1)
    error = np.zeros((m, robot.legs))
    for _ in range(iterations):
        equations = _linearised(robot, loops, x, R, np.repeat(error, q, 0))
        change, move = _step(equations, error, prior.reference_sd_m)
        error = error + change
        move *= np.minimum(1.0, 0.1 * robot.size_m / np.maximum(np.abs(move).max(0), 1e-300))
        move *= robot.edge_scale[:, None]
        x = x + move[:3]
        R = rotation.compose(move[3:], R) if robot.degrees == 6 else R
        if not np.abs(change).max() >= 1e-7:
            break
    # Absurd readings lead nowhere: such a robot starts from its references.
    return np.where(np.isfinite(error).all(1, keepdims=True), error, 0.0)


def _loops(robot: Robot, prior: LengthPrior, session: Session, readings: Floats, expected: PredictedSession) -> _Loops:
    wires, _ = prior.wires(robot, prior.moments(robot.legs)[0][None])
    m, q = len(readings), expected.position_m.shape[1]
    tau = readings[:, : q * robot.legs].reshape(m * q, robot.legs) * session.tension_sd_N
    joint = session.joint_m[session.read]
    bare, offset = (np.tile(a, (m, 1)) for a in inverse.lengths(robot, joint))
    grown = np.tile(expected.read_length_m[0] / inverse.lengths(robot, joint)[0], (m, 1))
    stretch = stretched_length(wires, np.ones_like(tau.T), np.maximum(tau.T, 0.0)).T * grown
    sd_N = float(np.hypot(session.tension_sd_N, prior.bias_sd_N))
    weight = (tau > 3 * sd_N) / np.hypot(1e-4, bare * sd_N / wires.theta["k1"].mean())
    return _Loops(bare, offset, tau, stretch, weight, sd_N)


def _linearised(robot: Robot, loops: _Loops, x: Floats, R: Floats, error: Floats) -> _Equations:
    """Equations about poses ``(3, r)``, ``(3, 3, r)`` and reference errors ``(r, w)``."""
    d, legs, scale = robot.degrees, robot.legs, robot.edge_scale[:, None]
    tau = loops.tension_N.T
    shape = statics.geometry(robot, x, R)
    J = statics.jacobian(robot, shape) * robot.lines[:, None]
    gap = statics.stretched(robot, shape, loops.offset_m.T).T - (loops.bare_m + error) * loops.stretch
    balance, H = statics.unbalance_and_stiffness(robot, shape, R, tau, np.zeros_like(tau))
    K = np.moveaxis(H, -1, 0) * (scale * scale.T)
    loop_by_pose = np.moveaxis(J * scale[:, None], -1, 0).swapaxes(1, 2) * loops.weight[..., None]
    loop_by_length = -(loops.stretch * loops.weight)[:, None] * np.eye(legs)
    return _Equations(
        np.concatenate([gap * loops.weight, (balance * scale).T / loops.sd_N], 1),
        np.concatenate([loop_by_pose, K / loops.sd_N], 1),
        np.concatenate([loop_by_length, np.zeros((len(gap), d, legs))], 1),
    )


def _step(equations: _Equations, error: Floats, reference_sd_m: float) -> tuple[Floats, Floats]:
    """Gauss-Newton changes of the reference errors ``(m, w)`` and of the poses ``(d, r)``.

    Poses are eliminated one by one; what is left speaks of the lengths.
    """
    m, legs = error.shape
    by_pose, by_length = equations.by_pose, equations.by_length
    residual, d = equations.residual[..., None], by_pose.shape[2]
    A = by_pose.swapaxes(1, 2) @ by_pose + 1e-9 * np.eye(d)
    B = by_pose.swapaxes(1, 2) @ by_length
    solved = solve(A, np.concatenate([B, by_pose.swapaxes(1, 2) @ residual], 2))
    by_change, alone = solved[..., :legs], solved[..., legs:]
    left = by_length.swapaxes(1, 2) @ by_length - B.swapaxes(1, 2) @ by_change
    right = by_length.swapaxes(1, 2) @ residual - B.swapaxes(1, 2) @ alone
    total = left.reshape(m, -1, legs, legs).sum(1) + np.eye(legs) / reference_sd_m**2
    pull = right.reshape(m, -1, legs).sum(1) + error / reference_sd_m**2
    change = -solve(total, pull[..., None])[..., 0]
    move = -(alone + by_change @ np.repeat(change, len(left) // m, 0)[..., None])[..., 0].T
    return change, move

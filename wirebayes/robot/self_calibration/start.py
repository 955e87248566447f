"""A first guess of reference lengths that slack wires cannot mislead.

A measured tension says how far a wire is stretched; so every reading closes a loop "stretched length = distance",
almost linear in pose and lengths, and the measured tensions must balance at every pose.
"""

import numpy as np

from wirebayes.linear_algebra import solve
from wirebayes.robot.mechanics import rotation, statics
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.wires import stretched_length
from wirebayes.robot.motion import inverse
from wirebayes.robot.self_calibration.session import Prior, Session, predict
from wirebayes.typing import Floats


def start(robot: Robot, prior: Prior, session: Session, readings: Floats, iterations: int = 12) -> Floats:
    """Reference errors ``(m, w)``, m, from closed loops and balance, creep taken as the prior expects it.

    Parameters
    ----------
    robot, prior, session, readings
        As in `calibration.calibrate`.
    """
    mean, _ = prior.moments(robot.legs)
    expected = predict(robot, prior, session, mean[None])
    wires, _ = prior.wires(robot, mean[None])
    m, legs, d = len(readings), robot.legs, robot.degrees
    q = expected.position_m.shape[1]
    tau = readings[:, : q * legs].reshape(m * q, legs) * session.tension_sd_N
    sd_N = float(np.hypot(session.tension_sd_N, prior.bias_sd_N))
    joint = session.joint_m[session.read]
    bare, offset = (np.tile(a, (m, 1)) for a in inverse.lengths(robot, joint))
    grown = np.tile(expected.read_length_m[0] / inverse.lengths(robot, joint)[0], (m, 1))
    stretch = stretched_length(wires, np.ones_like(tau.T), np.maximum(tau.T, 0.0)).T * grown
    # A slack wire only says that its loop is too long: it is left out here.
    weight = (tau > 3 * sd_N) / np.hypot(1e-4, bare * sd_N / wires.theta["k1"].mean())
    x = np.tile(expected.position_m[0], (m, 1)).T
    R = np.tile(expected.rotation[0], (m, 1, 1))
    R = np.moveaxis(R, 0, -1)
    o = np.zeros((m, legs))
    scale = np.ones((d, 1))
    scale[3:] = 1.0 / robot.size_m
    for _ in range(iterations):
        shape = statics.geometry(robot, x, R)
        J = statics.jacobian(robot, shape) * robot.lines[:, None]
        gap = statics.stretched(robot, shape, offset.T).T - (bare + np.repeat(o, q, 0)) * stretch
        zero = np.zeros_like(tau.T)
        balance, H = statics.unbalance_and_stiffness(robot, shape, R, tau.T, zero)
        K = np.stack([np.stack(row, -1) for row in H], -2) * (scale * scale.T)
        by_pose = np.concatenate([np.moveaxis(J * scale[:, None], -1, 0).swapaxes(1, 2) * weight[..., None],
                                  K / sd_N], 1)  # fmt: skip
        residual = np.concatenate([gap * weight, (balance * scale).T / sd_N], 1)
        by_length = np.concatenate([-(stretch * weight)[:, None] * np.eye(legs), np.zeros((m * q, d, legs))], 1)
        # Poses are eliminated one by one; what is left speaks of the lengths.
        A = by_pose.swapaxes(1, 2) @ by_pose + 1e-9 * np.eye(d)
        B = by_pose.swapaxes(1, 2) @ by_length
        f = by_pose.swapaxes(1, 2) @ residual[..., None]
        solved = solve(A, np.concatenate([B, f], 2))
        left = by_length.swapaxes(1, 2) @ by_length - B.swapaxes(1, 2) @ solved[..., :legs]
        right = by_length.swapaxes(1, 2) @ residual[..., None] - B.swapaxes(1, 2) @ solved[..., legs:]
        total = left.reshape(m, q, legs, legs).sum(1) + np.eye(legs) / prior.reference_sd_m**2
        pull = right.reshape(m, q, legs).sum(1) + o / prior.reference_sd_m**2
        change = -solve(total, pull[..., None])[..., 0]
        o = o + change
        move = -(solved[..., legs:] + solved[..., :legs] @ np.repeat(change, q, 0)[..., None])[..., 0].T * scale
        size = np.abs(move / scale).max(0)
        move *= np.minimum(1.0, 0.1 * robot.size_m / np.maximum(size, 1e-300))
        x = x + move[:3]
        R = rotation.compose(move[3:], R) if d == 6 else R
        if not np.abs(change).max() >= 1e-7:
            break
    # Absurd readings lead nowhere: such a robot starts from its references.
    return np.where(np.isfinite(o).all(1, keepdims=True), o, 0.0)

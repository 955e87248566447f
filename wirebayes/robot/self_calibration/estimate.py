"""Calibration without external sensors: joint values and tensions to the current length of every wire.

The posterior is Gaussian about its mode, found by Gauss-Newton over the whole load history, many robots at once; the
creep model makes readings at different times speak of the same unknowns.
"""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from wirebayes.numeric.linear_algebra import inv, solve
from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics import rotation
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.motion import inverse
from wirebayes.robot.self_calibration.session import LengthPrior, Prediction, Session, predict
from wirebayes.robot.self_calibration.start import starting_references
from wirebayes.robot.self_calibration.trust import joint_test


@dataclass(frozen=True)
class LengthPosterior:
    """Posterior after a session, for ``m`` robots.

    Attributes
    ----------
    unknowns : (m, d) array
        Mode.
    covariance : (m, d, d) array
    length_m, length_sd_m, creep : (m, w) arrays
        Current zero-tension lengths with their standard errors; the creep strain in them.
    position_m, rotation : (m, 3), (m, 3, 3) arrays
        Where the robot is now, at the mode.
    begun_m, begun_rotation : (m, p, 3), (m, p, 3, 3) arrays
        Where it was at the beginning of every hold.
    ended_m, ended_rotation : (m, p, 3), (m, p, 3, 3) arrays
        Where it was at the end of every hold.
    ended_sd : (m, p, 6) array
        Standard errors of these: m, and rad about the world's axes.
    misfit : (m,) array
        Mean squared standardised residual; well above one when the model cannot explain the readings.
    p_joint : (m,) array
        Probability of readings and references that contradict model and priors as much: `trust.joint_test`.
    converged : (m,) bool array
    """

    unknowns: Floats
    covariance: Floats
    length_m: Floats
    length_sd_m: Floats
    creep: Floats
    position_m: Floats
    rotation: Floats
    begun_m: Floats
    begun_rotation: Floats
    ended_m: Floats
    ended_rotation: Floats
    ended_sd: Floats
    misfit: Floats
    p_joint: Floats
    converged: NDArray[np.bool_]

    def interval(self, probability: float = 0.9) -> tuple[Floats, Floats]:
        """Central intervals of the lengths, two ``(m, w)`` arrays."""
        half = float(ndtri(0.5 + probability / 2)) * self.length_sd_m
        return self.length_m - half, self.length_m + half


def length_posterior(
    robot: Robot, prior: LengthPrior, session: Session, readings: Floats, iterations: int = 40
) -> LengthPosterior:
    """Posterior of the wires' lengths from standardised readings of one session on ``m`` robots.

    Parameters
    ----------
    robot : Robot
    prior : LengthPrior
    session : Session
    readings : (m, r) array
        In the order and the units of `Prediction.readings`.
    iterations : int
        Levenberg-Marquardt steps at most.

    Returns
    -------
    Calibration
    """
    mean, cov = prior.moments(robot.legs)
    root = np.asarray(np.linalg.cholesky(cov), np.float64)
    m, d = len(readings), len(mean)
    # Unknowns in units of their prior; references first brought near by the geometry of measured tensions.
    white = np.zeros((m, d))
    white[:, : robot.legs] = starting_references(robot, prior, session, readings) / prior.reference_sd_m
    here = predict(robot, prior, session, mean + white @ root.T)
    cost = _cost(here, readings, white)
    converged, damping = np.zeros(m, bool), np.full(m, 1e-3)
    J = np.zeros((m, readings.shape[1], d))
    moved = np.ones(m, bool)
    for _ in range(iterations):
        open_ = np.flatnonzero(~converged & moved)  # where a step failed, the derivatives stay: they are the work
        if len(open_):
            J[open_] = derivatives(robot, prior, session, mean, root, white[open_], _part(here, open_))[0]
        normal = np.swapaxes(J, 1, 2) @ J + np.eye(d)
        slope = np.einsum("mrd,mr->md", J, readings - here.readings) - white
        # What a whole step could still gain in twice the log posterior: below a thousandth, the mode is reached.
        decrement = np.einsum("md,md->m", slope, solve(normal, slope[..., None])[..., 0])
        # A mode on the edge of slackness has no zero slope; there, no step however short improves.
        converged |= (decrement < 1e-3) | (damping > 1e8)
        if converged.all():
            break
        ridge = damping[:, None, None] * np.einsum("mdd->md", normal)[:, None] * np.eye(d)
        step = solve(normal + ridge, slope[..., None])[..., 0]
        step[converged] = 0.0
        there = predict(robot, prior, session, mean + (white + step) @ root.T, near=(here.begun_m, here.begun_rotation))
        new = _cost(there, readings, white + step)
        better = new < cost - 1e-9 * np.where(np.isfinite(cost), cost, 0.0)
        white, moved = np.where(better[:, None], white + step, white), better
        damping = np.where(better, damping / 10, damping * 10)
        here, cost = _pick(better, there, here), np.where(better, new, cost)
    J, G, P = derivatives(robot, prior, session, mean, root, white, here)
    spread = inv(np.swapaxes(J, 1, 2) @ J + np.eye(d))
    variance = np.einsum("mwd,mde,mwe->mw", G, spread, G)
    ended = np.sqrt(np.einsum("mxd,mde,mxe->mx", P, spread, P)).reshape(m, -1, 6)
    misfit = ((readings - here.readings) ** 2).mean(1)
    return LengthPosterior(
        mean + white @ root.T, root @ spread @ root.T, here.length_m, np.sqrt(variance), here.creep,
        here.position_m[:, -1], here.rotation[:, -1], here.begun_m, here.begun_rotation,
        here.ended_m, here.ended_rotation, ended, misfit,
        joint_test(cost, readings.shape[1], white, spread, robot.legs), converged & here.solved,
    )  # fmt: skip


def corrected_joints(
    robot: Robot, prior: LengthPrior, known: LengthPosterior, position_m: Floats, rotation: Floats
) -> Floats:
    """Joint values that bring every calibrated robot to one pose, the creep so far included.

    Parameters
    ----------
    robot : Robot
    prior : LengthPrior
    known : Calibration
        Of m robots.
    position_m : (3,) array
    rotation : (3, 3) array
        The pose.

    Returns
    -------
    (m, w) array
        m.
    """
    wires, error = prior.wires(robot, known.unknowns)
    tau = inverse.tensions(robot, position_m[None], rotation[None])
    commands = inverse.commands(robot, wires, position_m[None], rotation[None], tau, known.creep.T, error.T)
    return commands.joint_m


def derivatives(
    robot: Robot, prior: LengthPrior, session: Session, mean: Floats, root: Floats, white: Floats, at: Prediction
) -> tuple[Floats, Floats, Floats]:
    """Derivatives of readings, final lengths and final poses by the unknowns in units of their prior.

    Central differences of the whole history in one batch: creep answers to tensions about a fifth as much as the
    elastic stretch does, so no part of the loop may be held fixed.

    Parameters
    ----------
    robot : Robot
    prior : LengthPrior
    session : Session
        Commands and durations of m robots.
    mean : (d,) array
    root : (d, d) array
        Mean of the prior and a factor of its covariance: unknowns are ``mean + root @ white``.
    white : (m, d) array
        Where the derivatives are taken.
    at : Prediction
        That of `white`; its poses are the starts of all others.

    Returns
    -------
    by_reading : (m, r, d) array
        Of standardised readings.
    by_length : (m, w, d) array
        Of final lengths, m.
    by_pose : (m, 6 p, d) array
        Of the pose at every hold's end: m, and rad about the world's axes.
    """
    m, d = white.shape
    step = 1e-3
    moves = step * np.concatenate([np.eye(d), -np.eye(d)])
    near = np.repeat(at.begun_m, 2 * d, 0), np.repeat(at.begun_rotation, 2 * d, 0)
    p = predict(robot, prior, session, mean + (white[:, None] + moves).reshape(-1, d) @ root.T, near=near)

    def difference(values: Floats) -> Floats:
        both = values.reshape(m, 2, d, -1)
        return np.asarray(np.swapaxes((both[:, 0] - both[:, 1]) / (2 * step), 1, 2))

    turn = p.ended_rotation.reshape(m, 2 * d, *at.ended_rotation.shape[1:])
    change = turn @ np.swapaxes(at.ended_rotation, -1, -2)[:, None]
    held = np.isfinite(change).all((-1, -2), keepdims=True)
    turned = rotation.vector(np.where(held, change, np.eye(3))).reshape(*p.ended_m.shape)
    poses = np.concatenate([p.ended_m, turned], -1).reshape(2 * d * m, -1)
    return difference(p.readings), difference(p.length_m), difference(poses)


def _cost(p: Prediction, readings: Floats, white: Floats) -> Floats:
    value = ((readings - p.readings) ** 2).sum(1) + (white**2).sum(1)
    return np.where(p.solved, value, np.inf)


def _pick(first: NDArray[np.bool_], a: Prediction, b: Prediction) -> Prediction:
    def choose(u: NDArray[Any], v: NDArray[Any]) -> NDArray[Any]:
        return np.where(first.reshape(-1, *[1] * (u.ndim - 1)), u, v)

    both = {f.name: choose(getattr(a, f.name), getattr(b, f.name)) for f in fields(Prediction)}
    return Prediction(**both)


def _part(p: Prediction, rows: NDArray[np.intp]) -> Prediction:
    return Prediction(**{f.name: getattr(p, f.name)[rows] for f in fields(Prediction)})

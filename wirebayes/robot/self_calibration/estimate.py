"""Calibration without external sensors: joint values and tensions to the current length of every wire.

The posterior is Gaussian about its mode, found by Gauss-Newton over the whole load history, many robots at once; the
creep model makes readings at different times speak of the same unknowns.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from wirebayes.numeric.linear_algebra import inv, solve
from wirebayes.numeric.rows import chosen_records, chosen_rows, rows_of
from wirebayes.numeric.typing import Bools, Floats
from wirebayes.progress import ShareDone
from wirebayes.robot.mechanics import rotation
from wirebayes.robot.mechanics.description import Poses, Robot
from wirebayes.robot.motion import inverse
from wirebayes.robot.self_calibration.predicted import PredictedSession, predict_session
from wirebayes.robot.self_calibration.session import LengthPrior, Session
from wirebayes.robot.self_calibration.start import starting_references
from wirebayes.robot.self_calibration.trust import joint_test

# Mean squared residual, foreseen by the slopes at best, from which on readings contradict the robot grossly: they are
# missed by a hundred standard errors. A search is given up after so many steps then; of sessions that fit, however
# rough, the third step foresees less than a thousandth of it.
GROSS, PATIENT = 1e4, 5
_MOST_STEPS = 40  # of Levenberg-Marquardt
_DIFFERENCE = 1e-3  # of a prior's standard deviation: differences of smooth functions


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
    converged: Bools

    def interval(self, probability: float = 0.9) -> tuple[Floats, Floats]:
        """Central intervals of the lengths, two ``(m, w)`` arrays."""
        half = float(ndtri(0.5 + probability / 2)) * self.length_sd_m
        return self.length_m - half, self.length_m + half


def length_posterior(
    robot: Robot,
    prior: LengthPrior,
    session: Session,
    readings: Floats,
    patience: int = PATIENT,
    progress: ShareDone = lambda share: None,
) -> LengthPosterior:
    """Posterior of the wires' lengths from standardised readings of one session on ``m`` robots.

    Parameters
    ----------
    robot : Robot
    prior : LengthPrior
    session : Session
    readings : (m, r) array
        In the order and the units of `Prediction.readings`.
    patience : int
        Steps from which on the search is given up where the readings contradict the robot grossly.
    progress : function of a share between 0 and 1

    Returns
    -------
    LengthPosterior
    """
    mean, cov = prior.moments(robot.legs)
    root = np.asarray(np.linalg.cholesky(cov), np.float64)
    target = _Target(robot, prior, session, readings, mean, root, progress)
    # Unknowns in units of their prior; references first brought near by the geometry of measured tensions.
    white = np.zeros((len(readings), len(mean)))
    references = starting_references(robot, prior, session, readings)
    white[:, : robot.legs] = references / prior.reference_sd_m
    mode = _mode(target, white, patience)
    progress(1.0)
    return _about(target, mode)


def _about(target: "_Target", mode: "_Mode") -> LengthPosterior:
    """The Gaussian posterior about its mode."""
    root, here, readings = target.root, mode.here, target.readings
    J, by_length, by_pose = target.derivatives(mode.white, here)
    spread = inv(J.mT @ J + np.eye(len(root)))
    ended_sd = _standard_errors(by_pose, spread).reshape(len(readings), -1, 6)
    return LengthPosterior(
        unknowns=target.mean + mode.white @ root.T,
        covariance=root @ spread @ root.T,
        length_m=here.length_m,
        length_sd_m=_standard_errors(by_length, spread),
        creep=here.creep,
        position_m=here.position_m[:, -1],
        rotation=here.rotation[:, -1],
        begun_m=here.begun_m,
        begun_rotation=here.begun_rotation,
        ended_m=here.ended_m,
        ended_rotation=here.ended_rotation,
        ended_sd=ended_sd,
        misfit=((readings - here.readings) ** 2).mean(1),
        p_joint=joint_test(mode.cost, readings.shape[1], mode.white, spread, target.robot.legs),
        converged=mode.converged & here.solved,
    )


def _standard_errors(slopes: Floats, spread: Floats) -> Floats:
    """``(m, k)`` of values with slopes ``(m, k, d)`` by unknowns of covariances ``(m, d, d)``."""
    return np.sqrt(np.einsum("mkd,mde,mke->mk", slopes, spread, slopes))


@dataclass(frozen=True)
class _Target:
    """The posterior of a session on ``m`` robots, by unknowns in units of their prior: ``mean + root @ white``."""

    robot: Robot
    prior: LengthPrior
    session: Session
    readings: Floats
    mean: Floats
    root: Floats
    progress: ShareDone

    def predicted(self, white: Floats, near: Poses | None = None) -> PredictedSession:
        """What unknowns ``(m, d)`` lead to; `near` are poses at the beginning of every hold."""
        return predict_session(self.robot, self.prior, self.session, self.mean + white @ self.root.T, near=near)

    def derivatives(self, white: Floats, at: PredictedSession) -> tuple[Floats, Floats, Floats]:
        """As `derivatives`, of some of the robots."""
        return derivatives(self.robot, self.prior, self.session, self.mean, self.root, white, at)

    def cost(self, at: PredictedSession, white: Floats) -> Floats:
        """(m,) minus twice the log posterior; infinite where nothing holds the platform."""
        value = ((self.readings - at.readings) ** 2).sum(1) + (white**2).sum(1)
        return np.where(at.solved, value, np.inf)

    def contradicted(self, foreseen: Floats) -> Bools:
        """(m,) Whether the readings contradict a robot grossly where slopes foresee no lower cost."""
        return foreseen > GROSS * self.readings.shape[1]


@dataclass(frozen=True)
class _Mode:
    """Where the search of the modes of ``m`` posteriors ended."""

    white: Floats
    here: PredictedSession
    cost: Floats
    converged: Bools


def _mode(target: _Target, white: Floats, patience: int) -> _Mode:
    """Modes by Levenberg-Marquardt, all robots at once, from a start ``(m, d)``; given up where readings are absurd."""
    m, d = white.shape
    here = target.predicted(white)
    cost = target.cost(here, white)
    moved = np.ones(m, bool)
    damping = np.full(m, 1e-3)
    converged, ended = np.zeros((2, m), bool)
    J = np.zeros((m, target.readings.shape[1], d))
    for taken in range(_MOST_STEPS):
        target.progress(taken / _MOST_STEPS)
        open_ = np.flatnonzero(~ended & moved)  # where a step failed, the derivatives stay: they are the work
        if len(open_):
            J[open_] = target.derivatives(white[open_], rows_of(here, open_))[0]
        normal = J.mT @ J + np.eye(d)
        slope = np.einsum("mrd,mr->md", J, target.readings - here.readings) - white
        decrement = _decrement(normal, slope)
        # A mode on the edge of slackness has no zero slope; there, no step however short improves.
        converged |= (decrement < 1e-3) | (damping > 1e8)
        absurd = (taken >= patience) & target.contradicted(cost - decrement)
        ended = converged | absurd
        if ended.all():
            break
        step = _damped_step(normal, slope, damping)
        tried = white + chosen_rows(~ended, step, 0.0)
        there = target.predicted(tried, near=(here.begun_m, here.begun_rotation))
        new = target.cost(there, tried)
        moved = _better(new, cost)
        white = chosen_rows(moved, tried, white)
        damping = np.where(moved, damping / 10, damping * 10)
        here = chosen_records(moved, there, here)
        cost = np.where(moved, new, cost)
    return _Mode(white, here, cost, converged)


def _decrement(normal: Floats, slope: Floats) -> Floats:
    """(m,) What a whole step could still gain in twice the log posterior: below a thousandth, the mode is reached."""
    step = solve(normal, slope[..., None])[..., 0]
    return np.einsum("md,md->m", slope, step)


def _better(new: Floats, cost: Floats) -> Bools:
    """(m,) Which costs are lower than before, by more than rounding."""
    finite = np.where(np.isfinite(cost), cost, 0.0)
    return new < cost - 1e-9 * finite


def _damped_step(normal: Floats, slope: Floats, damping: Floats) -> Floats:
    """Steps ``(m, d)`` by normal equations whose diagonals are larger by a share `damping` ``(m,)``."""
    diagonal = np.einsum("mdd->md", normal)[:, None]
    ridge = damping[:, None, None] * diagonal * np.eye(slope.shape[1])
    return solve(normal + ridge, slope[..., None])[..., 0]


def corrected_joints(
    robot: Robot, prior: LengthPrior, known: LengthPosterior, position_m: Floats, rotation: Floats
) -> Floats:
    """Joint values that bring every calibrated robot to one pose, the creep so far included.

    Parameters
    ----------
    robot : Robot
    prior : LengthPrior
    known : LengthPosterior
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
    x, R = position_m[None], rotation[None]
    tau = inverse.tensions(robot, x, R)
    commands = inverse.commands(robot, wires, x, R, tau, known.creep.T, error.T)
    return commands.joint_m


def derivatives(
    robot: Robot, prior: LengthPrior, session: Session, mean: Floats, root: Floats, white: Floats, at: PredictedSession
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
    moves = _DIFFERENCE * np.concatenate([np.eye(d), -np.eye(d)])
    unknowns = mean + (white[:, None] + moves).reshape(-1, d) @ root.T
    near = np.repeat(at.begun_m, 2 * d, 0), np.repeat(at.begun_rotation, 2 * d, 0)
    moved = predict_session(robot, prior, session, unknowns, near=near)
    poses = _small_motions(moved, at)
    return _difference(moved.readings, m), _difference(moved.length_m, m), _difference(poses, m)


def _difference(values: Floats, m: int) -> Floats:
    """Slopes ``(m, k, d)`` of values ``(2 d m, k)``, of all unknowns first a little up, then down."""
    both = values.reshape(m, 2, -1, *values.shape[1:])
    up, down = both[:, 0], both[:, 1]
    slope = (up - down) / (2 * _DIFFERENCE)
    return slope.mT


def _small_motions(moved: PredictedSession, at: PredictedSession) -> Floats:
    """Positions, and turns about the world's axes, at the holds' ends: ``(2 d m, 6 p)``."""
    m = len(at.ended_rotation)
    turn = moved.ended_rotation.reshape(m, -1, *at.ended_rotation.shape[1:])
    change = turn @ at.ended_rotation.mT[:, None]
    held = np.isfinite(change).all((-1, -2), keepdims=True)
    turned = rotation.vector(np.where(held, change, np.eye(3))).reshape(moved.ended_m.shape)
    return np.concatenate([moved.ended_m, turned], -1).reshape(len(turned), -1)

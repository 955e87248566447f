"""What is not known of a robot's wires, as columns to be followed: draws, and differences that give derivatives."""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from scipy.linalg import solve_triangular
from scipy.special import ndtri

from wirebayes.numeric.typing import Floats
from wirebayes.robot.history.follow import Track, uncreeping
from wirebayes.robot.mechanics.description import Poses, Robot
from wirebayes.robot.mechanics.draws import CORE, WireDraws
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion.creep import CreepState, fresh
from wirebayes.robot.self_calibration.calibrated import Calibrated
from wirebayes.robot.self_calibration.session import LengthPrior

_STEP = 0.05  # of a prior sd: far above the solver's error, and poses are straight over it
_FAR, _TIMES = 5.0, np.log(2.0)  # standard deviations of what is known of wires, and a factor of two in any case
_EXACT_M = 1e-6  # a length that is said to be exact is known to a micrometre


@dataclass(frozen=True)
class Uncertain:
    """The errors that measured values may have.

    Attributes
    ----------
    reference_m : float
        Standard error of the lengths that the joint values stand for, constant for each wire.
    spread : float
        Relative, of stiffness, creep amount and rate from wire to wire of one line.
    tension_N, tilt_rad : float
        Standard error of a reading. Beside it the sensor may keep an offset of half that variance, so that no number
        of readings says more than that.
    calibrated : Calibrated, optional
        What a calibration left known of lengths and wires, in the place of reference error and spread. The history
        then goes on where its session ended.
    """

    reference_m: float = 0.0
    spread: float = 0.05
    tension_N: float = 0.02
    tilt_rad: float = 1e-3
    calibrated: Calibrated | None = None


@dataclass(frozen=True)
class LogUnknowns:
    """Unknowns in units of their prior ("white"): reference lengths, the line's parameters, each specimen's own.

    Attributes
    ----------
    robot : Robot
    prior : LengthPrior
    mean : (d,) array
    root : (d, d) array
        Cholesky factor of the prior covariance.
    draws : (n, d) array
        White draws of the prior, the line's as the posterior of its fit has them.
    calibrated : Calibrated or None
    reach : (d,) array or float
        How far from the mean a search may go.
    """

    robot: Robot
    prior: LengthPrior
    mean: Floats
    root: Floats
    draws: Floats
    calibrated: Calibrated | None = None
    reach: Floats | float = np.inf

    @property
    def count(self) -> int:
        """Number of unknowns."""
        return len(self.mean)

    def columns(self, white: Floats) -> tuple[Wires, Floats]:
        """Wires of white unknowns ``(n, d)``, and reference errors ``(n, w)``, m."""
        return self.prior.wires(self.robot, self.mean + white @ self.root.T)

    def carried(self, white: Floats) -> CreepState:
        """What wires of white unknowns ``(n, d)`` carry into the history."""
        if self.calibrated is None:
            return fresh(self.robot.legs, len(white))
        return self.calibrated.carried(self.mean + white @ self.root.T)

    @property
    def errors_move(self) -> bool:
        """Whether the lengths' errors differ from pose to pose, because points may be off."""
        return self.calibrated is not None and bool(self.calibrated.points)

    def errors_at(self, white: Floats, poses: Poses, tension_N: Floats) -> tuple[Floats, Floats]:
        """Errors ``(t, n, w)`` of the lengths of white unknowns ``(n, d)`` at poses, and of the tensions beside these.

        Parameters
        ----------
        white : (n, d) array
        poses : (t, 3), (t, 3, 3) arrays
        tension_N : (t, w) array
            Of the mean wires there.
        """
        errors = self.mean + white @ self.root.T
        if self.calibrated is None:
            shape = len(tension_N), len(white), self.robot.legs
            return np.broadcast_to(errors[:, : self.robot.legs], shape), np.zeros(shape)
        return self.calibrated.errors_at(errors, poses, tension_N)

    def errors_along(self, white: Floats, track: Track) -> tuple[Floats, Floats]:
        """`errors_at` of white unknowns ``(n, d)``: ``(t, n, w)`` where they move, else ``(n, w)``.

        Parameters
        ----------
        white : (n, d) array
        track : Track
            Its first column says where the platform is, about; where it has fallen, the row before counts.
        """
        held = track.held[0]
        if not self.errors_move or not held[0]:
            length = (self.mean + white @ self.root.T)[:, : self.robot.legs]
            return length, np.zeros_like(length)
        row = np.maximum.accumulate(np.where(held, np.arange(len(held)), 0))
        poses = track.position_m[0, row], track.rotation[0, row]
        return self.errors_at(white, poses, track.tension_N[0, row])

    @property
    def plain(self) -> Wires:
        """The mean wire without creep: what a controller knows."""
        return uncreeping(self.prior.wires(self.robot, self.mean[None])[0])

    def differences(self, about: Floats) -> Floats:
        """White unknowns ``(1 + d, d)`` whose predictions give the derivatives at a point ``(d,)``; see `slopes`."""
        return np.concatenate([about[None], about + _STEP * np.eye(self.count)])


def slopes(values: Floats) -> Floats:
    """Derivatives ``(d, ...)`` by the white unknowns of values ``(1 + d, ...)`` at `LogUnknowns.differences`."""
    return (values[1:] - values[0]) / _STEP


def unknowns(robot: Robot, line: WireDraws, errors: Uncertain, rng: Generator) -> LogUnknowns:
    """The unknowns of a robot whose wires are cut from one line.

    Parameters
    ----------
    robot : Robot
    line : WireDraws
    errors : Uncertain
    rng : numpy Generator
        For reference lengths and specimens of the draws.
    """
    known = errors.calibrated
    if known is not None:
        draws = even_normals(line.count, len(known.mean), rng)
        root = _root(known.covariance)
        return LogUnknowns(robot, known.prior, known.mean, root, draws, known, _reach(known.prior, robot.legs, root))
    prior = LengthPrior(line, max(errors.reference_m, _EXACT_M), errors.spread)
    mean, covariance = prior.moments(robot.legs)
    root = np.asarray(np.linalg.cholesky(covariance), np.float64)
    off = _drawn(prior, robot.legs, rng) - mean
    white = solve_triangular(root, off.T, lower=True).T
    return LogUnknowns(robot, prior, mean, root, white, reach=_reach(prior, robot.legs, root))


def _reach(prior: LengthPrior, legs: int, root: Floats) -> Floats:
    """How far ``(d,)`` from the mean a search may go: for lengths and sensors as far as it likes.

    Readings that lead further for their wires are explained by none. A search followed them for minutes, through creep
    by the tenth power of the tension, until a time was too short to be divided by.
    """
    own = len(prior.own) * legs
    wires = slice(legs, legs + len(prior.names) + own)
    is_logarithm = [name.split()[-1] in CORE for name in prior.names] + [True] * own
    far = _FAR * np.linalg.norm(root[wires], axis=1)
    out = np.full(len(root), np.inf)
    out[wires] = np.where(is_logarithm, np.maximum(far, _TIMES), far)
    return out


def _drawn(prior: LengthPrior, legs: int, rng: Generator) -> Floats:
    """Unknowns ``(n, d)`` drawn from a prior, the line's as the posterior of its fit has them."""
    normal = even_normals(prior.line.count, len(prior.own) * legs + legs, rng)
    reference = normal[:, :legs] * prior.reference_sd_m
    own = normal[:, legs:] * prior.own_sd
    return np.concatenate([reference, prior.fitted.T, own], 1)


def even_normals(n: int, m: int, rng: Generator) -> Floats:
    """Independent columns of standard normal draws, one in each n-th part of the probability and symmetric about zero.

    Each draw is standard normal, but the mean over all of what is nearly a sum of functions of single columns has next
    to no noise. Without that, corrections of wires that have not crept were the mean deviation of a few specimens.

    Parameters
    ----------
    n : int
        Draws, any number.
    m : int
        Columns, each in a random order of its own.
    rng : numpy Generator

    Returns
    -------
    (n, m) array

    References
    ----------
    M. D. McKay, R. J. Beckman and W. J. Conover, A comparison of three methods for selecting values of input variables
    in the analysis of output from a computer code, Technometrics 21(2), 1979 (Latin hypercube sampling).
    """
    half = n // 2
    drawn = np.arange(half)[:, None] + 1.0 - rng.uniform(size=(half, m))
    below = ndtri(drawn / n)
    middle = ndtri((half + rng.uniform(size=(n % 2, m))) / n)
    in_order = np.concatenate([below, middle, -below])
    return rng.permuted(in_order, axis=0)


def _root(covariance: Floats) -> Floats:
    """Cholesky factor of a covariance whose unknowns have very different units."""
    sd = np.sqrt(np.diag(covariance))
    correlation = covariance / (sd[:, None] * sd)
    return np.asarray(sd[:, None] * np.linalg.cholesky(correlation), np.float64)

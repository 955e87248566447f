"""What tensions and tilts say about the unknowns: linear in them, gathered reading by reading.

Readings ``y = h(u) + offset + noise`` about a point where ``h`` is known with its derivatives. What they say is their
information matrix and, for each draw, a vector; both are sums over readings, so that they can be gathered while a robot
runs. A draw of the prior becomes one of the posterior by moving as far as its own readings, with noise of their own,
would move it (Matheron's rule), which is exact where ``h`` is linear and keeps the prior where nothing was read.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from wirebayes.numeric.typing import Floats
from wirebayes.robot.history.unknowns import Uncertain
from wirebayes.robot.mechanics.description import Robot

TOGETHER_S = 1.0  # readings nearer in time count as one: a sensor's noise at a controller's rate is not independent
_OFFSET = 0.5  # variance of a sensor's offset beside a reading's error, as a share of that variance


@dataclass(frozen=True)
class Sensors:
    """The sensors of a robot: a tension for each of ``w`` wires, then roll and pitch.

    Attributes
    ----------
    error : (m,) array
        Standard errors of a reading.
    bias : (m,) array
        Standard deviations of what a sensor is off by all the time, beside that.
    """

    error: Floats
    bias: Floats

    @property
    def sd(self) -> Floats:
        """(m,) standard deviations of a reading as they are stated."""
        return np.hypot(self.error, self.bias)

    @property
    def offset(self) -> Floats:
        """(m,) standard deviations of what stays."""
        return np.hypot(self.error * np.sqrt(_OFFSET), self.bias)


def sensors(robot: Robot, errors: Uncertain) -> Sensors:
    """Tension sensors of all wires and an inclinometer."""
    legs = robot.legs
    error = np.array([errors.tension_N] * legs + [errors.tilt_rad] * 2)
    return Sensors(error, np.array([robot.tension_bias_N] * legs + [0.0] * 2))


def reading_weight(since_s: float | None) -> float:
    """How many readings one counts as, `since_s` after the one before (None: there is none)."""
    return 1.0 if since_s is None else min(1.0, since_s / TOGETHER_S)


@dataclass
class Information:
    """What was read so far; unknowns ``d`` and the sensors' offsets ``m`` are one white vector ``e = d + m``.

    Attributes
    ----------
    matrix : (e, e) array
    vector : (n, e) array
        For every draw, from what it predicted.
    """

    matrix: Floats
    vector: Floats

    @classmethod
    def none(cls, unknowns: int, sensors: int, draws: int) -> "Information":
        """The information before any reading.

        Parameters
        ----------
        unknowns : int
        sensors : int
            Their offsets are unknowns too.
        draws : int

        Returns
        -------
        Information
        """
        e = unknowns + sensors
        return cls(np.zeros((e, e)), np.zeros((draws, e)))

    def add(self, of: Sensors, slope: Floats, residual: Floats, counts: float) -> None:
        """Add one row of readings.

        Parameters
        ----------
        of : Sensors
        slope : (d, m) array
            Of what the sensors should read, by the unknowns.
        residual : (n, m) array
            What each draw left of the readings; NaN where nothing was read.
        counts : float
            From `reading_weight`.
        """
        known = np.isfinite(residual)
        there = known.any(0) & np.isfinite(slope).all(0)
        if not there.any():
            return
        H = np.concatenate([slope, np.diag(of.offset)])
        error, left = of.error, residual
        if not there.all():
            H = H[:, there]
            error = error[there]
            left, known = left[:, there], known[:, there]
        scaled = H * (counts / error**2)
        if not known.all():
            left = np.where(known, left, np.nanmean(left, 0))  # a fallen draw has no say
        self.matrix += scaled @ H.T
        self.vector += left @ scaled.T

    def moves(self, before: Floats, noise: Floats | None) -> Floats:
        """How far white unknowns with offsets ``(n, e)`` move.

        Parameters
        ----------
        before : (n, e) array
            From where the draws are to where the prior has them; zero when they are the prior's own.
        noise : (n, e) array or None
            Standard normal, one row a draw: the noise of its own readings. None: it was in the residuals.
        """
        right = before + self.vector
        if noise is not None:
            values, vectors = np.linalg.eigh(self.matrix)
            right = right + noise @ (vectors * np.sqrt(np.maximum(values, 0.0))).T
        return cho_solve(cho_factor(self.matrix + np.eye(len(self.matrix))), right.T).T

    @property
    def sd(self) -> Floats:
        """(e,) posterior standard deviations in units of the prior's."""
        return np.sqrt(np.diag(np.linalg.inv(self.matrix + np.eye(len(self.matrix)))))

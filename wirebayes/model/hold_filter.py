"""What the readings of one hold say of the creep carried into it, of its setting error, and of the creep it carries on.

`line` is what `wirebayes.wire.staircase.linearise` returned; j is the number of a hold in it.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from wirebayes.numeric.typing import Array
from wirebayes.wire.staircase import Linearised

LOG_2PI = float(np.log(2.0 * np.pi))


@dataclass(frozen=True, slots=True)
class ReadingNoise:
    """Of each of n parameter sets: 1 / variance of a reading, its log normal density's constant, setting variance."""

    weight: Array
    log_variance: Array
    setting_var: Array

    @classmethod
    def of(cls, variance: Array, setting_sd: Array) -> "ReadingNoise":
        return cls(1.0 / variance, np.log(variance) + LOG_2PI, setting_sd * setting_sd)

    def where_read(self, readings: Array, mask: Array) -> "ReadingNoise":
        """The same, with readings (R, n) of a hold that are NaN as if their errors were without bound."""
        unread = np.isnan(readings[int(np.argmax(mask))])
        if not unread.any():
            return self
        weight, log_variance = (np.where(unread, 0.0, v) for v in (self.weight, self.log_variance))
        return ReadingNoise(weight, log_variance, self.setting_var)


def carried_unread(line: Linearised, j: int, m: Array, p: Array, noise: ReadingNoise) -> tuple[Array, Array]:
    """Mean and variance of the creep that a hold without readings carries on.

    Parameters
    ----------
    line : Linearised
    j : int
    m, p : (n,) arrays
        Mean and variance of the creep carried into it.
    noise : ReadingNoise
    """
    carry_c, carry_s = line.carry_by_creep[j], line.carry_by_setting[j]
    mean = carry_c * m
    var = carry_c * carry_c * p + carry_s * carry_s * noise.setting_var
    return mean, var


class HoldRead(NamedTuple):
    """What the readings of one hold say.

    The log density (n,) of the readings; mean and variance (n,) of the creep carried on; what the readings leave over
    (R, n); by how much they pull at the creep carried in and at the setting error, and what they know of either (n,).
    """

    log_density: Array
    mean: Array
    var: Array
    left: Array
    pull_c: Array
    pull_s: Array
    cc: Array
    ss: Array


def filter_hold(
    line: Linearised, j: int, readings: Array, mask: Array, m: Array, p: Array, noise: ReadingNoise
) -> HoldRead:
    """Filter the readings of one hold.

    Parameters
    ----------
    line : Linearised
    j : int
    readings : (R, n) or (R, 1) array
        Those whose weight is zero do not count, whatever they are.
    mask : (R,) bool array
    m, p : (n,) arrays
        Mean and variance of the creep carried into it.
    noise : ReadingNoise
    """
    keep = slice(None) if mask.all() else mask
    by_creep = line.by_creep[j][keep]
    by_setting = line.by_setting[j][keep]
    measured = np.where(noise.weight > 0, readings[keep], 0.0)
    surprise = measured - line.reading[j][keep] - by_creep * m
    known = information_of(by_creep, by_setting, noise.weight, p, noise.setting_var)
    along_c = summed(by_creep, surprise) * noise.weight
    along_s = summed(by_setting, surprise) * noise.weight
    creep, setting = known.errors(along_c, along_s)
    left = surprise - by_creep * creep - by_setting * setting
    pull_c, pull_s = known.pulls(along_c, along_s, p, noise.setting_var)
    log_density = _log_density(left, p * pull_c**2, noise.setting_var * pull_s**2, known.det, noise)
    mean, var = _carried(line, j, m + creep, setting, known)
    return HoldRead(log_density, mean, var, left, pull_c, pull_s, known.cc, known.ss)


def _log_density(left: Array, of_creep: Array, of_setting: Array, det: Array, noise: ReadingNoise) -> Array:
    """Of a hold's readings, by a sum of squares: the shorter difference of products can turn negative at absurd values.

    Parameters
    ----------
    left : (R, n) array
        What they leave over.
    of_creep, of_setting, det : (n,) arrays
        What either error adds to the squares; the determinant of `HoldInformation`.
    noise : ReadingNoise
    """
    of_readings = summed(left, left) * noise.weight
    square = of_readings + of_creep + of_setting
    log_noise = len(left) * noise.log_variance
    return -0.5 * (square + log_noise + np.log(det))


def _carried(line: Linearised, j: int, creep: Array, setting: Array, known: "HoldInformation") -> tuple[Array, Array]:
    """Mean and variance of the creep carried on, by the creep carried in and the setting error given the readings."""
    carry_c = line.carry_by_creep[j]
    carry_s = line.carry_by_setting[j]
    mean = carry_c * creep + carry_s * setting
    return mean, known.var_along(carry_c, carry_s)


def summed(one: Array, other: Array) -> Array:
    """(n,) sums of products (R, n) over the readings."""
    return np.asarray(np.einsum("rn,rn->n", one, other))


class HoldInformation(NamedTuple):
    """What a hold says about the creep carried in, c, and its setting error, s; all (n,).

    Products of the slopes, the determinant by which the readings' covariance exceeds that of sensor errors alone, and
    the covariance of the two given the readings.
    """

    cc: Array
    cs: Array
    ss: Array
    det: Array
    v_cc: Array
    v_cs: Array
    v_ss: Array

    def errors(self, along_c: Array, along_s: Array) -> tuple[Array, Array]:
        """Both errors by what readings have along their slopes, divided by the variance of a reading."""
        creep = self.v_cc * along_c + self.v_cs * along_s
        setting = self.v_cs * along_c + self.v_ss * along_s
        return creep, setting

    def pulls(self, along_c: Array, along_s: Array, p: Array, q: Array) -> tuple[Array, Array]:
        """By how much the readings pull at either.

        Parameters
        ----------
        along_c, along_s : (n,) arrays
            What they have along the slopes, divided by the variance of a reading.
        p, q : (n,) arrays
            Variances of either before.
        """
        at_creep = (1.0 + q * self.ss) * along_c - q * self.cs * along_s
        at_setting = (1.0 + p * self.cc) * along_s - p * self.cs * along_c
        return at_creep / self.det, at_setting / self.det

    def var_along(self, a: Array, c: Array) -> Array:
        """Variance of a times the creep carried in plus c times the setting error."""
        return a * a * self.v_cc + 2.0 * a * c * self.v_cs + c * c * self.v_ss


def information_of(by_c: Array, by_s: Array, weight: Array, p: Array, q: Array) -> HoldInformation:
    """What the readings of a hold say by their slopes.

    Parameters
    ----------
    by_c, by_s : (R, n) arrays
        Slopes of the readings by the creep carried in and by the setting error.
    weight : (n,) array
        1 / variance of a reading.
    p, q : (n,) arrays
        Variances, before, of the creep carried in and of the setting error.
    """
    cc = summed(by_c, by_c) * weight
    cs = summed(by_c, by_s) * weight
    ss = summed(by_s, by_s) * weight
    apart = np.maximum(cc * ss - cs * cs, 0.0)  # which may come out below zero by rounding
    det = 1.0 + p * cc + q * ss + p * q * apart
    v_cc = p * (1.0 + q * ss) / det
    v_cs = -p * q * cs / det
    v_ss = q * (1.0 + p * cc) / det
    return HoldInformation(cc, cs, ss, det, v_cc, v_cs, v_ss)


@dataclass(frozen=True, slots=True)
class Later:
    """Log density of the later holds' readings by the creep x carried into them: constant + pull x - precision x² / 2.

    Each (n,), and the sum of their squared residuals, in variances, whose rounding the density bears.
    """

    precision: Array
    pull: Array
    constant: Array
    square: Array

    def log_density(self, mean: Array, var: Array) -> Array:
        """Of those readings, the carried creep being normal with this mean and variance."""
        wider = 1.0 + self.precision * var
        square = self.precision * mean**2 - 2.0 * self.pull * mean - self.pull**2 * var
        return np.asarray(self.constant - 0.5 * (square / wider + np.log(wider)))

    def with_hold(self, line: Linearised, j: int, readings: Array, mask: Array, noise: ReadingNoise) -> "Later":
        """The same with the readings (R, n) of hold j, the one before them, by the creep carried into that hold.

        Parameters
        ----------
        readings : (R, n) or (R, 1) array
        mask : (R,) bool array
        """
        joint = self._with_setting(line, j, readings[mask], mask, noise.weight)
        return self._without_setting(joint, noise, int(mask.sum()))

    def _with_setting(self, line: Linearised, j: int, readings: Array, mask: Array, weight: Array) -> "_JointLater":
        """The same with those readings, jointly by the creep carried into their hold and by its setting error."""
        carry_c = line.carry_by_creep[j]
        carry_s = line.carry_by_setting[j]
        by_creep = line.by_creep[j][mask]
        by_setting = line.by_setting[j][mask]
        left = readings - line.reading[j][mask]
        precise_c = self.precision * carry_c
        precise_s = self.precision * carry_s
        cc = summed(by_creep, by_creep) * weight + precise_c * carry_c
        cs = summed(by_creep, by_setting) * weight + precise_c * carry_s
        ss = summed(by_setting, by_setting) * weight + precise_s * carry_s
        pull_c = summed(by_creep, left) * weight + self.pull * carry_c
        pull_s = summed(by_setting, left) * weight + self.pull * carry_s
        squares = summed(left, left) * weight
        return _JointLater(cc, cs, ss, pull_c, pull_s, squares)

    def _without_setting(self, joint: "_JointLater", noise: ReadingNoise, count: int) -> "Later":
        """With the setting error of that hold, of so many readings, integrated out."""
        wider = 1.0 + noise.setting_var * joint.ss
        known_s = noise.setting_var / wider
        log_noise = count * noise.log_variance + np.log(wider)
        by_readings = joint.squares + log_noise - known_s * joint.pull_s**2
        precision = joint.cc - known_s * joint.cs * joint.cs
        pull = joint.pull_c - known_s * joint.cs * joint.pull_s
        constant = self.constant - 0.5 * by_readings
        return Later(np.maximum(precision, 0.0), pull, constant, self.square + joint.squares)


class _JointLater(NamedTuple):
    """Precision and pull of `Later` by the creep carried in, c, and a setting error, s; squared residuals of a hold."""

    cc: Array
    cs: Array
    ss: Array
    pull_c: Array
    pull_s: Array
    squares: Array

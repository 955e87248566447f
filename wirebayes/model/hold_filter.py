"""What the readings of one hold say of the creep carried into it, of its setting error, and of the creep it carries on.

`line` is what `wirebayes.wire.staircase.linearise` returned; j is the number of a hold in it.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from wirebayes.numeric.typing import Array
from wirebayes.wire.edges import FirstReadings, Side
from wirebayes.wire.staircase import Linearised

LOG_2PI = float(np.log(2.0 * np.pi))


@dataclass(frozen=True, slots=True)
class ReadingNoise:
    """The noise of n parameter sets: 1 / variance of a reading, constant of its log density, setting variance."""

    weight: Array
    log_variance: Array
    setting_var: Array

    @classmethod
    def of(cls, variance: Array, setting_sd: Array) -> "ReadingNoise":
        return cls(1.0 / variance, np.log(variance) + LOG_2PI, setting_sd * setting_sd)

    def where_read(self, first: Array) -> "ReadingNoise":
        """The same, with readings of a hold whose first (n,) is NaN as if their errors were without bound."""
        unread = np.isnan(first)
        if not unread.any():
            return self
        weight = np.where(unread, 0.0, self.weight)
        log_variance = np.where(unread, 0.0, self.log_variance)
        return ReadingNoise(weight, log_variance, self.setting_var)


@dataclass(frozen=True)
class Measured:
    """Readings of a sequence of holds, and how they err.

    Attributes
    ----------
    readings : (H, R, n) or (H, R, 1) array
        NaN where a row does not see a hold: it is then as one without readings.
    mask : (H, R) bool array
        Which of them were taken.
    variance : (n,) array
        Of one reading, rounding included.
    setting_sd : (n,) array
    """

    readings: Array
    mask: Array
    variance: Array
    setting_sd: Array

    @property
    def noise(self) -> ReadingNoise:
        return ReadingNoise.of(self.variance, self.setting_sd)

    def first(self, j: int) -> Array:
        """(n,) or (1,) the first reading of a hold."""
        return self.readings[j][int(np.argmax(self.mask[j]))]

    @property
    def first_readings(self) -> FirstReadings:
        """The first reading of every hold, NaN where it has none."""
        column = np.argmax(self.mask, axis=1)
        value = self.readings[np.arange(len(column)), column]  # every evaluation asks for it
        value[~self.mask.any(axis=1)] = np.nan
        return FirstReadings(value, column, self.variance)


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
    carry_c = line.carry_by_creep[j]
    carry_s = line.carry_by_setting[j]
    mean = carry_c * m
    var = carry_c * carry_c * p + carry_s * carry_s * noise.setting_var
    return mean, var


class LinearHold(NamedTuple):
    """A hold of a staircase at the readings that were taken, (r, n) each: nominal readings, and their slopes."""

    reading: Array
    by_creep: Array
    by_setting: Array

    @classmethod
    def of(cls, line: Linearised | Side, j: int, taken: Array | slice) -> "LinearHold":
        """A hold of a staircase.

        Parameters
        ----------
        line : Linearised or Side
        j : int
            Its number.
        taken : (R,) bool array or slice
            Which of its readings.
        """
        return cls(line.reading[j][taken], line.by_creep[j][taken], line.by_setting[j][taken])

    def along(self, left: Array, weight: Array) -> tuple[Array, Array]:
        """What residuals (r, n) have along the slopes by creep and by setting error, times 1 / variance, (n,) each."""
        return summed(self.by_creep, left) * weight, summed(self.by_setting, left) * weight

    def products(self, weight: Array) -> tuple[Array, Array, Array]:
        """(n,) creep with creep, creep with setting error and setting error with itself, times 1 / variance."""
        cc, cs = self.along(self.by_creep, weight)
        ss = summed(self.by_setting, self.by_setting) * weight
        return cc, cs, ss


class HoldRead(NamedTuple):
    """What the readings of one hold say.

    Attributes
    ----------
    mean, var : (n,) arrays
        Of the creep carried on.
    var_before : (n,) array
        Variance of the creep carried in.
    left : (R, n) array
        What the best errors leave over of the readings.
    pulls : (n,), (n,) arrays
        By how much the readings pull at the creep carried in, and at the setting error.
    known : HoldInformation
        What they say of either.
    noise : ReadingNoise
    """

    mean: Array
    var: Array
    var_before: Array
    left: Array
    pulls: tuple[Array, Array]
    known: "HoldInformation"
    noise: ReadingNoise

    @property
    def log_density(self) -> Array:
        """(n,) by a sum of squares: the shorter difference of products can turn negative at absurd values."""
        pull_c, pull_s = self.pulls
        of_readings = summed(self.left, self.left) * self.noise.weight
        square = of_readings + self.var_before * pull_c**2 + self.noise.setting_var * pull_s**2
        log_noise = len(self.left) * self.noise.log_variance
        return -0.5 * (square + log_noise + np.log(self.known.det))

    def residuals(self) -> list[Array]:
        """The parts of `wirebayes.model.likelihoods.standardised` from one hold, (r, n) each."""
        noise = self.noise
        pull_c, pull_s = self.pulls
        in_sensor_errors = self.left * np.sqrt(noise.weight)
        creep = np.sqrt(self.var_before) * pull_c
        setting = np.sqrt(noise.setting_var) * pull_s
        log_sensor = np.sqrt(len(self.left)) * noise.log_variance
        log_creep = np.log1p(self.var_before * self.known.cc)
        log_setting = np.log1p(noise.setting_var * self.known.ss)
        log_sd = [0.5 * part[None] for part in (log_sensor, log_creep, log_setting)]
        return [in_sensor_errors, creep[None], setting[None], *log_sd]


def filter_hold(
    line: Linearised | Side, j: int, measured: Measured, m: Array, p: Array, noise: ReadingNoise
) -> HoldRead:
    """Filter the readings of one hold.

    Parameters
    ----------
    line : Linearised or Side
    j : int
    measured : Measured
    m, p : (n,) arrays
        Mean and variance of the creep carried into it.
    noise : ReadingNoise
        Readings whose weight is zero do not count, whatever they are.
    """
    mask = measured.mask[j]
    taken = slice(None) if mask.all() else mask
    hold = LinearHold.of(line, j, taken)
    readings = np.where(noise.weight > 0, measured.readings[j][taken], 0.0)
    surprise = readings - hold.reading - hold.by_creep * m
    known = information_of(hold, noise.weight, p, noise.setting_var)
    along = hold.along(surprise, noise.weight)
    creep, setting = known.errors(*along)
    carry_c = line.carry_by_creep[j]
    carry_s = line.carry_by_setting[j]
    return HoldRead(
        mean=carry_c * (m + creep) + carry_s * setting,
        var=known.var_along(carry_c, carry_s),
        var_before=p,
        left=surprise - hold.by_creep * creep - hold.by_setting * setting,
        pulls=known.pulls(*along, p, noise.setting_var),
        known=known,
        noise=noise,
    )


def summed(one: Array, other: Array) -> Array:
    """(n,) sums of products (R, n) over the readings."""
    return np.einsum("rn,rn->n", one, other)


class HoldInformation(NamedTuple):
    """What a hold says about the creep carried in, c, and its setting error, s.

    Attributes
    ----------
    cc, cs, ss : (n,) arrays
        Products of the slopes by either, times the weight of a reading.
    det : (n,) array
        Determinant by which the readings' covariance exceeds that of sensor errors alone.
    v_cc, v_cs, v_ss : (n,) arrays
        Covariance of the two given the readings.
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
        """How much the readings pull at either.

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


def information_of(hold: LinearHold, weight: Array, p: Array, q: Array) -> HoldInformation:
    """What the readings of a hold say by their slopes.

    Parameters
    ----------
    hold : LinearHold
    weight : (n,) array
        1 / variance of a reading.
    p, q : (n,) arrays
        Variances, before, of the creep carried in and of the setting error.
    """
    cc, cs, ss = hold.products(weight)
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
        """The log density of those readings, the carried creep being normal with this mean and variance."""
        wider = 1.0 + self.precision * var
        square = self.precision * mean**2 - 2.0 * self.pull * mean - self.pull**2 * var
        return self.constant - 0.5 * (square / wider + np.log(wider))

    def with_hold(self, line: Linearised, j: int, measured: Measured, noise: ReadingNoise) -> "Later":
        """The same with the readings of hold j, the one before them, by the creep carried into that hold.

        Parameters
        ----------
        line : Linearised
        j : int
        measured : Measured
        noise : ReadingNoise
            Of these readings.
        """
        joint = self._with_setting(line, j, measured, noise.weight)
        return self._without_setting(joint, noise, int(measured.mask[j].sum()))

    def _with_setting(self, line: Linearised, j: int, measured: Measured, weight: Array) -> "_JointLater":
        """The same with those readings, jointly by the creep carried into their hold and by its setting error."""
        taken = measured.mask[j]
        carry_c = line.carry_by_creep[j]
        carry_s = line.carry_by_setting[j]
        hold = LinearHold.of(line, j, taken)
        left = measured.readings[j][taken] - hold.reading
        cc, cs, ss = hold.products(weight)
        along_c, along_s = hold.along(left, weight)
        return _JointLater(
            cc=cc + self.precision * carry_c * carry_c,
            cs=cs + self.precision * carry_c * carry_s,
            ss=ss + self.precision * carry_s * carry_s,
            pull_c=along_c + self.pull * carry_c,
            pull_s=along_s + self.pull * carry_s,
            squares=summed(left, left) * weight,
        )

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

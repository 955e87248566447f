"""Sensor, setting and rounding error: the probability of readings given a staircase.

Readings are Gaussian with covariance ``V = (sensor² + resolution²/12) I + setting² J Jᵀ``, J the derivative of all
readings by all setting errors. One hold passes a single number on to the next, the carried creep, so the normal density
factors hold by hold in linear time: a Kalman filter whose state is that number.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from wirebayes.numeric.typing import Array
from wirebayes.wire import compiled
from wirebayes.wire.staircase import Linearised

if TYPE_CHECKING:
    from wirebayes.wire._kernel import Staircases

LOG_2PI = float(np.log(2.0 * np.pi))


@dataclass(frozen=True)
class Filtered:
    """What the readings say of each hold, in order.

    Attributes
    ----------
    log_likelihood : (H, n)
        log p(readings of the hold | readings of the holds before); zero for an unrecorded hold.
    carried_mean, carried_var : (H + 1, n)
        Deviation of the creep carried into each hold from its nominal value, given the holds before, mm and mm².
    """

    log_likelihood: Array
    carried_mean: Array
    carried_var: Array


def reading_variance(sensor_sd: Array, resolution: float) -> Array:
    """Variance of one reading, N² or mm²: sensor error and rounding."""
    return np.asarray(sensor_sd * sensor_sd + resolution * resolution / 12.0)


def chain(
    line: "Linearised | Staircases", readings: Array, mask: Array, variance: Array, setting_sd: Array
) -> Filtered:
    """Filter the readings along the holds.

    Parameters
    ----------
    line : Linearised or Staircases
        What `wirebayes.wire.staircase.linearise` or `streamed` returned.
    readings : (H, R, n) or (H, R, 1) array
        NaN where a row does not see a hold: it is then as one without readings.
    mask : (H, R) bool array
    variance : (n,) array
        Of one reading, rounding included.
    setting_sd : (n,) array
    """
    if compiled.kernel is not None:
        return Filtered(*compiled.kernel.chain(*_compiled(line, readings, mask, variance, setting_sd)))
    assert isinstance(line, Linearised)  # nothing is streamed without the kernel
    holds, _, n = line.reading.shape
    out = np.zeros((holds, n))
    mean, var = np.zeros((holds + 1, n)), np.zeros((holds + 1, n))
    noise = _Noise.of(variance, setting_sd)
    for j in range(holds):
        if mask[j].any():
            found = _hold(line, j, readings[j], mask[j], mean[j], var[j], noise.where_read(readings[j], mask[j]))
            out[j], mean[j + 1], var[j + 1] = found.log_density, found.mean, found.var
        else:
            mean[j + 1], var[j + 1] = _unread(line, j, mean[j], var[j], noise)
    return Filtered(out, mean, var)


def standardised(
    line: "Linearised | Staircases", readings: Array, mask: Array, variance: Array, setting_sd: Array
) -> tuple[Array, Array]:
    """Log-likelihood, and residuals whose derivatives J give its curvature nearly: the expected information is J'J.

    In each hold the residuals in sensor errors with the creep and the setting error at their best, those two in their
    standard deviations (together their squares are the quadratic form), and the logarithms of the standard deviations,
    whose derivatives are what the determinant adds to the information.

    Parameters
    ----------
    line, readings, mask, variance, setting_sd
        As for `chain`.

    Returns
    -------
    (n,) and (m, n) arrays
    """
    if compiled.kernel is not None:
        return compiled.kernel.standardised(*_compiled(line, readings, mask, variance, setting_sd))
    assert isinstance(line, Linearised)  # nothing is streamed without the kernel
    n = line.reading.shape[2]
    noise, total, out = _Noise.of(variance, setting_sd), np.zeros(n), []
    mean, var = np.zeros(n), np.zeros(n)
    for j in range(len(mask)):
        if mask[j].any():
            read = noise.where_read(readings[j], mask[j])
            here = _hold(line, j, readings[j], mask[j], mean, var, read)
            best = np.sqrt(var) * here.pull_c, np.sqrt(noise.setting_var) * here.pull_s
            known = var * here.cc, noise.setting_var * here.ss
            log_sd = np.sqrt(len(here.left)) * read.log_variance, *(np.log1p(k) for k in known)
            out += [here.left * np.sqrt(read.weight), *(b[None] for b in best), *(0.5 * s[None] for s in log_sd)]
            total, mean, var = total + here.log_density, here.mean, here.var
        else:
            mean, var = _unread(line, j, mean, var, noise)
    return total, np.concatenate(out)


def _compiled(
    line: "Linearised | Staircases", readings: Array, mask: Array, variance: Array, setting_sd: Array
) -> tuple[Any, ...]:
    """What the compiled filters are called with."""
    of = compiled.kernel.Stored(*_flat(line)) if isinstance(line, Linearised) else line
    return of, *_observed(of.n, readings, mask, variance, setting_sd)


def _flat(line: Linearised) -> tuple[Array, ...]:
    """Staircases as contiguous arrays."""
    parts = (line.reading, line.by_setting, line.by_creep, line.carry_by_setting, line.carry_by_creep)
    return tuple(np.ascontiguousarray(part, float) for part in parts)


def _observed(n: int, readings: Array, mask: Array, variance: Array, setting_sd: Array) -> tuple[Array, ...]:
    """Readings, which of them were taken, and the noise of n columns, in the types of compiled code."""
    noise = (np.full(n, v, float) for v in (variance, setting_sd))
    return np.asarray(readings, float), np.ascontiguousarray(mask).view(np.uint8), *noise


def held_out_density(
    line: Linearised, filtered: Filtered, readings: Array, mask: Array, variance: Array, setting_sd: Array
) -> Array:
    """Log probability of each held-out hold's readings given what the holds before it say that are not held out.

    Parameters
    ----------
    line, readings, variance, setting_sd
        As for `chain`.
    filtered : Filtered
        What `chain` returned with the held-out holds masked.
    mask : (H, R) bool array
        The readings of held-out holds that are evaluated; no others.

    Returns
    -------
    (h, n) array
        A row for each hold in the mask.
    """
    noise, (mean, var) = _Noise.of(variance, setting_sd), (filtered.carried_mean, filtered.carried_var)
    holds = np.flatnonzero(mask.any(axis=1)).tolist()
    return np.array([_hold(line, j, readings[j], mask[j], mean[j], var[j], noise).log_density for j in holds])


@dataclass(frozen=True, slots=True)
class _Noise:
    """Of each of n parameter sets: 1 / variance of a reading, its log normal density's constant, setting variance."""

    weight: Array
    log_variance: Array
    setting_var: Array

    @classmethod
    def of(cls, variance: Array, setting_sd: Array) -> "_Noise":
        return cls(1.0 / variance, np.log(variance) + LOG_2PI, setting_sd * setting_sd)

    def where_read(self, readings: Array, mask: Array) -> "_Noise":
        """The same, with readings (R, n) of a hold that are NaN as if their errors were without bound."""
        unread = np.isnan(readings[int(np.argmax(mask))])
        if not unread.any():
            return self
        weight, log_variance = (np.where(unread, 0.0, v) for v in (self.weight, self.log_variance))
        return _Noise(weight, log_variance, self.setting_var)


def _unread(line: Linearised, j: int, m: Array, p: Array, noise: _Noise) -> tuple[Array, Array]:
    """Mean and variance of the creep that a hold without readings carries on."""
    a, c = line.carry_by_creep[j], line.carry_by_setting[j]
    return a * m, a * a * p + c * c * noise.setting_var


class _Read(NamedTuple):
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


def _hold(line: Linearised, j: int, readings: Array, mask: Array, m: Array, p: Array, noise: _Noise) -> _Read:
    """Filter one hold's readings (R, n), the creep carried into it having mean `m` and variance `p`.

    Readings whose weight is zero do not count, whatever they are.
    """
    keep = slice(None) if mask.all() else mask
    by_c, by_s = line.by_creep[j][keep], line.by_setting[j][keep]
    r = np.where(noise.weight > 0, readings[keep], 0.0) - line.reading[j][keep] - by_c * m
    known = _learned(by_c, by_s, noise.weight, p, noise.setting_var)
    cr = np.einsum("rn,rn->n", by_c, r) * noise.weight
    sr = np.einsum("rn,rn->n", by_s, r) * noise.weight
    creep, setting = known.errors(cr, sr)
    pull_c = ((1.0 + noise.setting_var * known.ss) * cr - noise.setting_var * known.cs * sr) / known.det
    pull_s = ((1.0 + p * known.cc) * sr - p * known.cs * cr) / known.det
    # a sum of squares: the shorter difference of products can turn negative at absurd parameters
    left = r - by_c * creep - by_s * setting
    square = np.einsum("rn,rn->n", left, left) * noise.weight + p * pull_c**2 + noise.setting_var * pull_s**2
    log_density = -0.5 * (square + r.shape[0] * noise.log_variance + np.log(known.det))
    a, c = line.carry_by_creep[j], line.carry_by_setting[j]
    mean = a * (m + creep) + c * setting
    var = a * a * known.v_cc + 2.0 * a * c * known.v_cs + c * c * known.v_ss
    return _Read(log_density, mean, var, left, pull_c, pull_s, known.cc, known.ss)


class _Learned(NamedTuple):
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
        return self.v_cc * along_c + self.v_cs * along_s, self.v_cs * along_c + self.v_ss * along_s


def _learned(by_c: Array, by_s: Array, weight: Array, p: Array, q: Array) -> _Learned:
    """What a hold's slopes (R, n) say, with variances before: p of the creep carried in, q of the setting error."""
    cc = np.einsum("rn,rn->n", by_c, by_c) * weight
    cs = np.einsum("rn,rn->n", by_c, by_s) * weight
    ss = np.einsum("rn,rn->n", by_s, by_s) * weight
    # the difference of two products may come out below zero by rounding
    det = 1.0 + p * cc + q * ss + p * q * np.maximum(cc * ss - cs * cs, 0.0)
    return _Learned(cc, cs, ss, det, p * (1.0 + q * ss) / det, -p * q * cs / det, q * (1.0 + p * cc) / det)


def seen(
    line: Linearised,
    filtered: Filtered,
    readings: Array,
    shapes: Array,
    mask: Array,
    variance: Array,
    setting_sd: Array,
) -> tuple[Array, Array]:
    """What the readings say of shapes that may be added to them, V their covariance.

    Parameters
    ----------
    line, readings, mask, variance, setting_sd
        As for `chain`.
    filtered : Filtered
        What it returned for them.
    shapes : (H, R, k) array

    Returns
    -------
    (n, k, k) and (n, k) arrays
        shapesᵀ V⁻¹ shapes and shapesᵀ V⁻¹ (readings - line.reading).
    """
    if compiled.kernel is not None:
        observed = _observed(line.reading.shape[2], readings, mask, variance, setting_sd)
        beside = (np.ascontiguousarray(a, float) for a in (filtered.carried_mean, filtered.carried_var, shapes))
        return compiled.kernel.seen(*_flat(line), *observed, *beside)
    n, k = line.reading.shape[2], shapes.shape[2]
    gram, along = np.zeros((k, k, n)), np.zeros((k, n))
    mean = np.zeros((k, n))  # of the carried creep, had the shapes been the readings
    for j, keep in enumerate(mask):
        slopes = np.stack([line.by_creep[j][keep], line.by_setting[j][keep]])
        known = _learned(*slopes, 1.0 / variance, filtered.carried_var[j], setting_sd * setting_sd)
        reading = readings[j][keep] - line.reading[j][keep] - slopes[0] * filtered.carried_mean[j]
        # What is left of the shapes beside the creep that they would have carried in.
        left = shapes[j][keep][:, :, None] - slopes[0][:, None] * mean
        left_along = np.einsum("srn,rkn->skn", slopes, left) / variance
        errors = np.stack(known.errors(*left_along))
        gram += np.einsum("rkn,rln->kln", left, left) / variance - np.einsum("skn,sln->kln", left_along, errors)
        left -= np.einsum("skn,srn->rkn", errors, slopes)
        along += np.einsum("rkn,rn->kn", left, reading) / variance
        mean = line.carry_by_creep[j] * (mean + errors[0]) + line.carry_by_setting[j] * errors[1]
    return np.moveaxis(gram, -1, 0), along.T


def setting_jacobian(line: Linearised) -> Array:
    """(H, R, H, n) derivative of every reading by every setting error, N/mm; quadratic in the holds."""
    holds, width, n = line.reading.shape
    out = np.zeros((holds, width, holds, n))
    carried = np.zeros((holds, n))
    for j in range(holds):
        out[j] = line.by_creep[j][:, None, :] * carried[None]
        out[j, :, j] = line.by_setting[j]
        carried = line.carry_by_creep[j] * carried
        carried[j] = line.carry_by_setting[j]
    return out


def without_each_hold(
    line: Linearised, filtered: Filtered, readings: Array, mask: Array, variance: Array, setting_sd: Array
) -> Array:
    """Probability of the readings of all holds but one, for each hold in turn.

    The hold's displacement and duration stay: only its readings are left out. What the holds before it say of the
    carried creep is in `filtered`; what those after it say is gathered from the last hold backwards (a two-filter
    smoother), as an information vector, because at first it is nothing.

    Parameters
    ----------
    line, readings, mask, variance, setting_sd
        As for `chain`.
    filtered : Filtered
        What `chain` returned for them.

    Returns
    -------
    (H, n) array
        Log densities.
    """
    holds, _, n = line.reading.shape
    noise, out = _Noise.of(variance, setting_sd), np.zeros((holds, n))
    out[1:] = np.cumsum(filtered.log_likelihood[:-1], axis=0)
    later = _Later(np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n))
    for j in reversed(range(holds)):
        m, p = filtered.carried_mean[j], filtered.carried_var[j]
        a, c = line.carry_by_creep[j], line.carry_by_setting[j]
        out[j] += later.log_density(a * m, a * a * p + c * c * noise.setting_var)
        out[j] = np.where(later.square < _ABSURD, out[j], -np.inf)
        later = later.with_hold(line, j, readings[j], mask[j], noise)
    return out


@dataclass(frozen=True, slots=True)
class _Later:
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

    def with_hold(self, line: Linearised, j: int, readings: Array, mask: Array, noise: _Noise) -> "_Later":
        """The same with the readings (R, n) of hold j, the one before them, by the creep carried into that hold.

        Parameters
        ----------
        readings : (R, n) or (R, 1) array
        mask : (R,) bool array
        """
        a, c, q = line.carry_by_creep[j], line.carry_by_setting[j], noise.setting_var
        by_c, by_s = line.by_creep[j][mask], line.by_setting[j][mask]
        r = readings[mask] - line.reading[j][mask]
        cc, cs, ss, cr, sr, rr = (
            np.einsum("rn,rn->n", one, other) * noise.weight
            for one, other in ((by_c, by_c), (by_c, by_s), (by_s, by_s), (by_c, r), (by_s, r), (r, r))
        )
        # jointly in the carried creep and the setting error, which is then integrated out
        cross, pull_s = cs + self.precision * a * c, sr + self.pull * c
        wider = 1.0 + q * (ss + self.precision * c * c)
        precision = cc + self.precision * a * a - q * cross * cross / wider
        constant = self.constant - 0.5 * (rr + len(r) * noise.log_variance + np.log(wider) - q * pull_s**2 / wider)
        pull = cr + self.pull * a - q * cross * pull_s / wider
        return _Later(np.maximum(precision, 0.0), pull, constant, self.square + rr)


_ABSURD = 1e13  # sum of squared residuals in variances: its rounding reaches some hundredths of a nat

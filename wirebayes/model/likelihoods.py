"""Sensor, setting and rounding error: the probability of readings given a staircase.

Readings are Gaussian with covariance ``V = (sensor² + resolution²/12) I + setting² J Jᵀ``, J the derivative of all
readings by all setting errors. One hold passes a single number on to the next, the carried creep, so the normal density
factors hold by hold in linear time: a Kalman filter whose state is that number.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from wirebayes.model.hold_filter import (
    HoldRead,
    Later,
    LinearHold,
    ReadingNoise,
    carried_unread,
    filter_hold,
    information_of,
)
from wirebayes.numeric.typing import Array
from wirebayes.wire import compiled
from wirebayes.wire.staircase import Linearised

if TYPE_CHECKING:
    from wirebayes.wire._kernel import Staircases

_ABSURD = 1e13  # sum of squared residuals in variances: its rounding reaches some hundredths of a nat


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
    log_likelihood = np.zeros((holds, n))
    mean = np.zeros((holds + 1, n))
    var = np.zeros((holds + 1, n))
    noise = ReadingNoise.of(variance, setting_sd)
    for j in range(holds):
        m = mean[j]
        p = var[j]
        if not mask[j].any():
            mean[j + 1], var[j + 1] = carried_unread(line, j, m, p, noise)
            continue
        known_noise = noise.where_read(readings[j], mask[j])
        found = filter_hold(line, j, readings[j], mask[j], m, p, known_noise)
        log_likelihood[j] = found.log_density
        mean[j + 1] = found.mean
        var[j + 1] = found.var
    return Filtered(log_likelihood, mean, var)


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
    noise = ReadingNoise.of(variance, setting_sd)
    log_likelihood = np.zeros(n)
    mean = np.zeros(n)
    var = np.zeros(n)
    residuals: list[Array] = []
    for j, taken in enumerate(mask):
        if not taken.any():
            mean, var = carried_unread(line, j, mean, var, noise)
            continue
        known_noise = noise.where_read(readings[j], taken)
        found = filter_hold(line, j, readings[j], taken, mean, var, known_noise)
        residuals += _residuals(found, var, known_noise)
        log_likelihood = log_likelihood + found.log_density
        mean = found.mean
        var = found.var
    return log_likelihood, np.concatenate(residuals)


def _residuals(found: "HoldRead", carried_var: Array, noise: "ReadingNoise") -> list[Array]:
    """The parts of `standardised` from one hold, (r, n) each."""
    in_sensor_errors = found.left * np.sqrt(noise.weight)
    pull_c, pull_s = found.pulls
    creep = np.sqrt(carried_var) * pull_c
    setting = np.sqrt(noise.setting_var) * pull_s
    log_sensor = np.sqrt(len(found.left)) * noise.log_variance
    log_creep = np.log1p(carried_var * found.known.cc)
    log_setting = np.log1p(noise.setting_var * found.known.ss)
    log_sd = [0.5 * part[None] for part in (log_sensor, log_creep, log_setting)]
    return [in_sensor_errors, creep[None], setting[None], *log_sd]


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
    noise = (v if _is_column(v, n) else np.full(n, v, float) for v in (variance, setting_sd))
    return np.asarray(readings, float), np.ascontiguousarray(mask).view(np.uint8), *noise


def _is_column(values: Any, n: int) -> bool:
    """Whether values are n numbers as compiled code takes them."""
    return values.shape == (n,) and values.dtype == float and values.flags.c_contiguous


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
    noise = ReadingNoise.of(variance, setting_sd)
    densities = []
    for j in np.flatnonzero(mask.any(axis=1)).tolist():
        mean, var = filtered.carried_mean[j], filtered.carried_var[j]
        found = filter_hold(line, j, readings[j], mask[j], mean, var, noise)
        densities.append(found.log_density)
    return np.array(densities)


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
        return compiled.kernel.seen(*_seen_by(line, filtered, readings, shapes, mask, variance, setting_sd))
    n, k = line.reading.shape[2], shapes.shape[2]
    gram = np.zeros((k, k, n))
    along = np.zeros((k, n))
    mean = np.zeros((k, n))  # of the carried creep, had the shapes been the readings
    noise = ReadingNoise.of(variance, setting_sd)
    for j, taken in enumerate(mask):
        hold = LinearHold.of(line, j, taken)
        known = information_of(hold, noise.weight, filtered.carried_var[j], noise.setting_var)
        surprise = readings[j][taken] - hold.reading - hold.by_creep * filtered.carried_mean[j]
        # what is left of the shapes beside the creep that they would have carried in
        left = shapes[j][taken][:, :, None] - hold.by_creep[:, None] * mean
        along_c = _along(hold.by_creep, left) / variance
        along_s = _along(hold.by_setting, left) / variance
        creep, setting = known.errors(along_c, along_s)
        gram += np.einsum("rkn,rln->kln", left, left) / variance
        gram -= _products(along_c, creep) + _products(along_s, setting)
        left -= creep * hold.by_creep[:, None] + setting * hold.by_setting[:, None]
        along += _along(surprise, left) / variance
        mean = line.carry_by_creep[j] * (mean + creep) + line.carry_by_setting[j] * setting
    return np.moveaxis(gram, -1, 0), along.T


def _products(one: Array, other: Array) -> Array:
    """(k, k, n) products of rows (k, n)."""
    return np.asarray(np.einsum("kn,ln->kln", one, other))


def _seen_by(
    line: Linearised,
    filtered: Filtered,
    readings: Array,
    shapes: Array,
    mask: Array,
    variance: Array,
    setting_sd: Array,
) -> tuple[Array, ...]:
    """What the compiled `seen` is called with."""
    observed = _observed(line.reading.shape[2], readings, mask, variance, setting_sd)
    beside = (filtered.carried_mean, filtered.carried_var, shapes)
    return *_flat(line), *observed, *(np.ascontiguousarray(part, float) for part in beside)


def _along(slopes: Array, shapes: Array) -> Array:
    """(k, n) sums over the readings of slopes (R, n) times shapes (R, k, n)."""
    return np.asarray(np.einsum("rn,rkn->kn", slopes, shapes))


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
    noise = ReadingNoise.of(variance, setting_sd)
    out = np.zeros((holds, n))
    out[1:] = np.cumsum(filtered.log_likelihood[:-1], axis=0)
    later = Later(np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n))
    for j in reversed(range(holds)):
        mean, var = carried_unread(line, j, filtered.carried_mean[j], filtered.carried_var[j], noise)
        log_density = out[j] + later.log_density(mean, var)
        out[j] = np.where(later.square < _ABSURD, log_density, -np.inf)
        later = later.with_hold(line, j, readings[j], mask[j], noise)
    return out

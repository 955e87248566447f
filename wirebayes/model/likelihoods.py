"""Sensor, setting and rounding error: the probability of readings given a staircase.

Readings are Gaussian with covariance ``V = (sensor² + resolution²/12) I + setting² J Jᵀ``, J the derivative of all
readings by all setting errors. One hold passes a single number on to the next, the carried creep, so the normal density
factors hold by hold in linear time: a Kalman filter whose state is that number.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from wirebayes.model.hold_filter import (
    HoldInformation,
    Later,
    LinearHold,
    Measured,
    carried_unread,
    information_of,
)
from wirebayes.model.slack_holds import EitherSide, filter_holds, read_hold, settled
from wirebayes.numeric.typing import Array, Bools
from wirebayes.wire import compiled
from wirebayes.wire.edges import as_found
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
    is_taut : (H, n) bool array
        Near an edge, whether a taut wire is more probable than a slack one.
    """

    log_likelihood: Array
    carried_mean: Array
    carried_var: Array
    is_taut: Bools


def reading_variance(sensor_sd: Array, resolution: float) -> Array:
    """Variance of one reading, N² or mm²: sensor error and rounding."""
    return sensor_sd * sensor_sd + resolution * resolution / 12.0


def chain(line: "Linearised | Staircases", measured: Measured) -> Filtered:
    """Filter the readings along the holds.

    Parameters
    ----------
    line : Linearised or Staircases
        What `wirebayes.wire.staircase.linearise` or `streamed` returned.
    measured : Measured
    """
    if compiled.kernel is not None:
        of, *observed = _compiled(line, measured)
        seen_taut = np.zeros((len(measured.mask), of.n), np.uint8)
        return Filtered(*compiled.kernel.chain(of, *observed, is_taut=seen_taut), seen_taut.view(bool))
    assert isinstance(line, Linearised)  # nothing is streamed without the kernel
    holds, _, n = line.reading.shape
    log_likelihood = np.zeros((holds, n))
    mean = np.zeros((holds + 1, n))
    var = np.zeros((holds + 1, n))
    is_taut = np.zeros((holds, n), bool)
    for j, (carried_mean, carried_var, read) in enumerate(filter_holds(line, measured)):
        mean[j + 1] = carried_mean
        var[j + 1] = carried_var
        if read is not None:
            log_likelihood[j] = read.log_density
        if isinstance(read, EitherSide):
            is_taut[j] = read.near & (read.log_taut > read.log_slack)
    return Filtered(log_likelihood, mean, var, is_taut)


def standardised(line: "Linearised | Staircases", measured: Measured) -> tuple[Array, Array]:
    """Log-likelihood, and residuals whose derivatives J give its curvature nearly: the expected information is J'J.

    In each hold the residuals in sensor errors with the creep and the setting error at their best, those two in their
    standard deviations (together their squares are the quadratic form), and the logarithms of the standard deviations,
    whose derivatives are what the determinant adds to the information.

    Parameters
    ----------
    line, measured
        As for `chain`.

    Returns
    -------
    (n,) and (m, n) arrays
    """
    if compiled.kernel is not None:
        return compiled.kernel.standardised(*_compiled(line, measured))
    assert isinstance(line, Linearised)  # nothing is streamed without the kernel
    log_likelihood = np.zeros(line.reading.shape[2])
    residuals: list[Array] = []
    for _, _, read in filter_holds(line, measured):
        if read is not None:
            log_likelihood = log_likelihood + read.log_density
            residuals += read.residuals()
    return log_likelihood, np.concatenate(residuals)


def _compiled(line: "Linearised | Staircases", measured: Measured) -> tuple[Any, ...]:
    """What the compiled filters are called with."""
    of = _stored(line) if isinstance(line, Linearised) else line
    return of, *_observed(of.n, measured)


def _stored(line: Linearised) -> "Staircases":
    """Staircases that were computed before."""
    edges = None if line.edges is None else as_found(line.edges)
    return compiled.kernel.Stored(*_flat(line), edges=edges)


def _flat(line: Linearised) -> tuple[Array, ...]:
    """Staircases as contiguous arrays."""
    parts = (line.reading, line.by_setting, line.by_creep, line.carry_by_setting, line.carry_by_creep)
    return tuple(np.ascontiguousarray(part, float) for part in parts)


def _observed(n: int, measured: Measured) -> tuple[Array, ...]:
    """Readings, which of them were taken, and the noise of n columns, in the types of compiled code."""
    noise = (v if _is_column(v, n) else np.full(n, v, float) for v in (measured.variance, measured.setting_sd))
    return np.asarray(measured.readings, float), np.ascontiguousarray(measured.mask).view(np.uint8), *noise


def _is_column(values: Any, n: int) -> bool:
    """Whether values are n numbers as compiled code takes them."""
    return values.shape == (n,) and values.dtype == float and values.flags.c_contiguous


def held_out_density(line: Linearised, filtered: Filtered, measured: Measured) -> Array:
    """Log probability of each held-out hold's readings given what the holds before it say that are not held out.

    Parameters
    ----------
    line : Linearised
    filtered : Filtered
        What `chain` returned with the held-out holds masked.
    measured : Measured
        Its mask leaves the readings of held-out holds that are evaluated; no others.

    Returns
    -------
    (h, n) array
        A row for each hold in the mask.
    """
    noise = measured.noise
    densities = []
    for j in np.flatnonzero(measured.mask.any(axis=1)).tolist():
        found = read_hold(line, j, measured, filtered.carried_mean[j], filtered.carried_var[j], noise)
        densities.append(found.log_density)
    return np.array(densities)


@dataclass(frozen=True)
class OnSides:
    """A staircase with each hold on the more probable side of its edge, and what the readings say by it.

    Attributes
    ----------
    line : Linearised
        Without edges.
    filtered : Filtered
        By this line.
    beside : (H, n) array
        Log densities of each hold's readings on either side, less those on this one; zero far from edges.
    """

    line: Linearised
    filtered: Filtered
    beside: Array


def on_sides(line: Linearised, measured: Measured) -> OnSides:
    """Put each hold on the more probable side of its edge, for what needs a staircase that is linear in its errors.

    Parameters
    ----------
    line, measured
        As for `chain`.
    """
    every = chain(line, measured)
    if line.edges is None:
        return OnSides(line, every, np.zeros_like(every.log_likelihood))
    chosen = settled(line, every.is_taut, measured)
    filtered = chain(chosen, measured)
    return OnSides(chosen, filtered, every.log_likelihood - filtered.log_likelihood)


def seen(line: Linearised, filtered: Filtered, measured: Measured, shapes: Array) -> tuple[Array, Array]:
    """What the readings say of shapes that may be added to them, V their covariance.

    Parameters
    ----------
    line, measured
        As for `chain`; without edges.
    filtered : Filtered
        What it returned for them.
    shapes : (H, R, k) array

    Returns
    -------
    (n, k, k) and (n, k) arrays
        shapesᵀ V⁻¹ shapes and shapesᵀ V⁻¹ (readings - line.reading).
    """
    if compiled.kernel is not None:
        beside = filtered.carried_mean, filtered.carried_var, shapes
        contiguous = (np.ascontiguousarray(part, float) for part in beside)
        return compiled.kernel.seen(*_flat(line), *_observed(line.reading.shape[2], measured), *contiguous)
    n = line.reading.shape[2]
    k = shapes.shape[2]
    gram = np.zeros((k, k, n))
    along = np.zeros((k, n))
    mean = np.zeros((k, n))  # of the carried creep, had the shapes been the readings
    noise = measured.noise
    for j, taken in enumerate(measured.mask):
        hold = LinearHold.of(line, j, taken)
        known = information_of(hold, noise.weight, filtered.carried_var[j], noise.setting_var)
        # what is left of the shapes beside the creep that they would have carried in
        shown = shapes[j][taken][:, :, None] - hold.by_creep[:, None] * mean
        found = _ShapesOfHold.of(hold, known, shown, measured.variance)
        gram += found.square
        gram -= found.explained
        surprise = measured.readings[j][taken] - hold.reading - hold.by_creep * filtered.carried_mean[j]
        along += _along(surprise, found.left) / measured.variance
        mean = line.carry_by_creep[j] * (mean + found.creep) + line.carry_by_setting[j] * found.setting
    return np.moveaxis(gram, -1, 0), along.T


class _ShapesOfHold(NamedTuple):
    """Shapes in the readings of a hold, in variances.

    Attributes
    ----------
    square : (k, k, n) array
        Their products with each other.
    explained : (k, k, n) array
        What errors explain of these.
    creep, setting : (k, n) arrays
        These errors: of the creep carried in, and of the setting.
    left : (r, k, n) array
        What they leave of the shapes.
    """

    square: Array
    explained: Array
    creep: Array
    setting: Array
    left: Array

    @classmethod
    def of(cls, hold: LinearHold, known: HoldInformation, shapes: Array, variance: Array) -> "_ShapesOfHold":
        """The same by the shapes (r, k, n).

        Parameters
        ----------
        hold : LinearHold
        known : HoldInformation
            What its readings say of both errors.
        shapes : (r, k, n) array
        variance : (n,) array
            Of one reading.
        """
        along_c = _along(hold.by_creep, shapes) / variance
        along_s = _along(hold.by_setting, shapes) / variance
        creep, setting = known.errors(along_c, along_s)
        square = np.einsum("rkn,rln->kln", shapes, shapes) / variance
        explained = _products(along_c, creep) + _products(along_s, setting)
        left = shapes - (creep * hold.by_creep[:, None] + setting * hold.by_setting[:, None])
        return cls(square, explained, creep, setting, left)


def _products(one: Array, other: Array) -> Array:
    """(k, k, n) products of rows (k, n)."""
    return np.einsum("kn,ln->kln", one, other)


def _along(slopes: Array, shapes: Array) -> Array:
    """(k, n) sums over the readings of slopes (R, n) times shapes (R, k, n)."""
    return np.einsum("rn,rkn->kn", slopes, shapes)


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


def without_each_hold(line: Linearised, filtered: Filtered, measured: Measured) -> Array:
    """Probability of the readings of all holds but one, for each hold in turn.

    The hold's displacement and duration stay: only its readings are left out. What the holds before it say of the
    carried creep is in `filtered`; what those after it say is gathered from the last hold backwards (a two-filter
    smoother), as an information vector, because at first it is nothing.

    Parameters
    ----------
    line, measured
        As for `chain`.
    filtered : Filtered
        What `chain` returned for them.

    Returns
    -------
    (H, n) array
        Log densities.
    """
    holds, _, n = line.reading.shape
    noise = measured.noise
    earlier = np.zeros((holds, n))
    earlier[1:] = np.cumsum(filtered.log_likelihood[:-1], axis=0)
    out = np.empty((holds, n))
    later = Later(np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n))
    for j in reversed(range(holds)):
        mean, var = carried_unread(line, j, filtered.carried_mean[j], filtered.carried_var[j], noise)
        log_density = earlier[j] + later.log_density(mean, var)
        out[j] = np.where(later.square < _ABSURD, log_density, -np.inf)
        later = later.with_hold(line, j, measured, noise)
    return out

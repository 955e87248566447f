"""The probability of a hold's readings given its first: every hold is an experiment of its own."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from wirebayes.model.hold_filter import LOG_2PI
from wirebayes.numeric.typing import Array, Ints
from wirebayes.wire import compiled
from wirebayes.wire.model import Model
from wirebayes.wire.protocol import Protocol
from wirebayes.wire.staircase import simulate_alone
from wirebayes.wire.walk import Theta, Walk


def hold_by_hold(protocol: Protocol, theta: Theta, model: Model, readings: Array, variance: Array) -> Array:
    """Probability of each hold's later readings given its first, every hold an experiment of its own.

    The stretched length is where the first reading puts it, found by Newton steps; the first reading carries the
    sensor's error too, so the later ones have covariance ``variance (I + a aᵀ)``, a the ratio of slopes. A hold whose
    first reading is not above zero says nothing of its length and contributes nothing.

    Parameters
    ----------
    theta : mapping of name to (n,) array
        ``k1 B U k2 N`` and the amplitudes of the model's effects; `preload` plays no part.
    readings : (H, R, n) or (H, R, 1) array
        Tensions, N; what the protocol's mask leaves out is ignored.
    variance : (n,) array
        Of one reading, rounding included, N².

    Returns
    -------
    (H, n) array
        Log densities; zero for a hold with fewer than two readings.
    """
    holds, _, n = np.broadcast_shapes(readings.shape, (1, 1, len(variance)))
    out = np.zeros((holds, n))
    for hold in _single_holds(protocol, theta, model, readings):
        later = np.einsum("rn,rn->n", hold.left, hold.left)
        square = (later + hold.first * hold.first) / variance
        out[hold.number] = hold.log_density(square, variance)
    return out


def standardised_hold_by_hold(
    protocol: Protocol, theta: Theta, model: Model, readings: Array, variance: Array
) -> tuple[Array, Array]:
    """Log-likelihood of `hold_by_hold`, and residuals whose derivatives J give its curvature nearly, as J'J.

    Parameters
    ----------
    protocol, theta, model, readings, variance
        As for `hold_by_hold`.

    Returns
    -------
    (n,) and (m, n) arrays
    """
    total = np.zeros(len(variance))
    residuals = [np.zeros((0, len(variance)))]
    for hold in _single_holds(protocol, theta, model, readings):
        log_density, of_hold = hold.standardised(variance)
        total = total + log_density
        residuals.append(of_hold)
    return total, np.concatenate(residuals)


class _SingleHold(NamedTuple):
    """One hold, its error of the first reading at its best.

    Attributes
    ----------
    number : int
        Position of the hold.
    valid : (n,) bool array
        Where its length is known.
    left : (r, n) array
        What is left of the later readings.
    first : (n,) array
        Error of the first reading.
    ratio_square : (n,) array
        Squared ratios of the slopes of the later readings to that of the first, summed.
    """

    number: int
    valid: Array
    left: Array
    first: Array
    ratio_square: Array

    @classmethod
    def of(cls, j: int, course: tuple[Array, Array, Array], readings: Array, later: Ints) -> "_SingleHold":
        """The same by a hold's course (see `hold_courses`), its readings, and which of them are later ones.

        Parameters
        ----------
        j : int
            Position of the hold.
        course : tuple of arrays
        readings : (R, n) or (R, 1) array
        later : (r,) array of int
        """
        tension, slope, valid = course
        ratio = slope[later] / np.where(valid, slope[0], 1.0)
        residual = readings[later] - tension[later]
        ratio_square = np.einsum("rn,rn->n", ratio, ratio)
        first = np.einsum("rn,rn->n", ratio, residual) / (1.0 + ratio_square)
        return cls(j, valid, residual - ratio * first, first, ratio_square)

    def standardised(self, variance: Array) -> tuple[Array, Array]:
        """(n,) log density, and the hold's part (r, n) of the residuals of `standardised_hold_by_hold`."""
        every = np.vstack([self.left, self.first[None]]) / np.sqrt(variance)
        square = (every**2).sum(axis=0)
        log_sd = 0.5 * np.sqrt(len(self.left)) * np.log(variance)
        residuals = np.vstack([every, log_sd[None]])
        return self.log_density(square, variance), np.where(self.valid, residuals, 0.0)

    def log_density(self, square: Array, variance: Array) -> Array:
        """(n,) by the sum of squared residuals in variances; zero where the length is not known."""
        log_noise = len(self.left) * (np.log(variance) + LOG_2PI)
        value = -0.5 * (square + log_noise + np.log1p(self.ratio_square))
        return np.where(self.valid, value, 0.0)


def _single_holds(protocol: Protocol, theta: Theta, model: Model, readings: Array) -> Iterator[_SingleHold]:
    """Each hold with several readings."""
    for j, fitted in enumerate(hold_courses(protocol, theta, model, readings[:, 0])):
        if fitted is None:
            continue
        later = np.flatnonzero(protocol.mask[j])[1:]
        if len(later):
            yield _SingleHold.of(j, fitted, readings[j], later)


def hold_courses(
    protocol: Protocol, theta: Theta, model: Model, first: Array
) -> list[tuple[Array, Array, Array] | None]:
    """Each hold's course when its first reading alone says where the hold begins.

    Of a step, how far the wire is stretched; of a weight, which is known, the offset of the displacement.

    Parameters
    ----------
    theta : mapping of name to (n,) array
        ``k1 B U k2 N`` and the amplitudes of the model's effects; `preload` plays no part, nor does `k1` under weights.
    first : (H, n) or (H, 1) array
        First reading of each hold, N, or mm under weights.

    Returns
    -------
    list of (reading, slope, valid) or None
        For each hold the readings (R, n), their derivatives by what the first reading determines (R, n), and whether
        it does (n,); None for a hold without readings.
    """
    n = np.shape(theta["B"])[0]
    theta = dict(theta) | {"preload": np.zeros(n)}
    if protocol.control == "force":
        rigid = theta | {"k1": np.full(n, np.inf)}
        return _under_weights(protocol, rigid, model, first)
    first = np.broadcast_to(first, (len(protocol.setting), n))
    return _under_steps(protocol, theta, model, first)


def from_first_readings(protocol: Protocol, theta: Theta, model: Model, first: Array, error: Array) -> Array:
    """Readings of holds that each begin where their first reading puts them, which stays as it is.

    A first reading under steps whose error leaves no tension is that of a slack wire, which stays slack.

    Parameters
    ----------
    theta : mapping of name to (n,) array
        As for `hold_courses`.
    first : (H,) array
        N, or mm under weights; NaN of a hold of which nothing is wanted.
    error : (H, R, n) array
        Of every reading, the first ones too: what they say of the length is in error as well.

    Returns
    -------
    (H, R, n) array
        Zero for a hold without readings.
    """
    without_error = first[:, None] - error[:, 0]
    out = np.zeros_like(error)
    for j, course in enumerate(hold_courses(protocol, theta, model, without_error)):
        if course is None:
            continue
        reading, _, valid = course
        out[j] = np.where(valid, reading, 0.0) + error[j]
        out[j, 0] = first[j]
    return out


def _under_steps(
    protocol: Protocol, theta: Theta, model: Model, first: Array
) -> list[tuple[Array, Array, Array] | None]:
    """`hold_courses` where the displacement is set, compiled where that can be."""
    out: list[tuple[Array, Array, Array] | None] = [None] * len(first)
    recorded = np.flatnonzero(protocol.recorded).tolist()
    call = compiled.call(protocol, theta, model)
    if call is None:
        walk = Walk(protocol, theta, model)
        for j in recorded:
            out[j] = _course(walk, j, first[j])
        return out
    tension, slope = compiled.kernel.courses(*call, first, _NEWTON_STEPS)
    valid = (first > 0) & (slope[:, 0] > 0)
    for j in recorded:
        out[j] = tension[j], slope[j], valid[j]
    return out


def _course(walk: Walk, j: int, first: Array) -> tuple[Array, Array, Array]:
    """The course of a hold from its first reading (n,), as `hold_courses` returns it."""
    length_mm = walk.protocol.length_mm
    valid = first > 0
    target = np.where(valid, first, 1.0)
    strain = target / walk.k1
    stretch = length_mm * strain
    displacement = stretch
    if walk.model.law == "modified":
        displacement = displacement / np.maximum(1.0 - strain, 0.1)
    for _ in range(_NEWTON_STEPS):
        tension, slope = walk.fresh(j, displacement, slice(1))
        # A slack guess has no slope: go out until it pulls.
        pulls = slope[0] > 0
        newton = (target - tension[0]) / np.where(pulls, slope[0], 1.0)
        move = np.where(pulls, newton, stretch)
        displacement = displacement + move
        if np.max(np.abs(move)) < 1e-12 * length_mm:
            break
    tension, slope = walk.fresh(j, displacement)
    return tension, slope, valid & (slope[0] > 0)


def _under_weights(
    protocol: Protocol, theta: Theta, model: Model, first: Array
) -> list[tuple[Array, Array, Array] | None]:
    """`hold_courses` where the tension is set: a wire that does not stretch creeps from its first reading on."""
    courses = simulate_alone(protocol, theta, model)
    out: list[tuple[Array, Array, Array] | None] = [None] * len(courses)
    for j in np.flatnonzero(protocol.recorded).tolist():
        grown = courses[j] - courses[j][0]
        valid = np.isfinite(grown).all(axis=0) & np.isfinite(first[j])
        out[j] = first[j] + grown, np.ones_like(grown), valid
    return out


_NEWTON_STEPS = 30  # a limit for absurd parameters: others reach the tolerance after a few

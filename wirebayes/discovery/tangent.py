"""Samples made linear in their parameters, in the metric of their noise."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from typing import Self

import numpy as np

from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.model import likelihoods
from wirebayes.model.column_units import parameter_of
from wirebayes.model.problem import Problem
from wirebayes.model.sample import NOISES, Sample
from wirebayes.numeric.typing import Array
from wirebayes.wire.staircase import linearise, simulate

LARGEST_SLOPE = 1e100  # of any derivative: the square of a larger one overflows


_STEP = 1e-5  # of sampled coordinates, which are of order one: truncation and rounding both stay below 1e-5 of a slope


_PRIOR_STEP = 1e-3  # of the same, for second differences of the prior, which rounding spoils before


_FLAT = 1e-3  # of a bend: less is rounding, and would put the prior's own best anywhere


_LEAST_SQUARE = 1e-14  # share of the largest squared singular value: less is rounding


_LEAST_NOISE = 1e-6  # of the fitted variance: rounding errors of the arithmetic must not pass for a perfect fit


@dataclass(frozen=True)
class Tangent:
    """A block of samples made linear at n parameter sets, rows scaled by each sample's reading error.

    Attributes
    ----------
    residual : (n, N)
    parameters : (n, N, p)
        Derivatives by the sampled coordinates that move the mean.
    left, singular : (n, N, H), (n, H)
        Left singular vectors and values of K.
    ratio : (n,)
        The fitted ρ.
    prior_gradient, prior_precision : (n, p), (n, p, p)
    floor : (n,)
        Rounding's share of the scaled variance: noise cannot be smaller.
    prior : (n,)
        Log density of the prior in the sampled coordinates.
    """

    residual: Array
    parameters: Array
    left: Array
    singular: Array
    ratio: Array
    prior_gradient: Array
    prior_precision: Array
    floor: Array
    prior: Array

    def of(self, rows: Array) -> Self:
        """The same for some of the parameter sets."""
        alike = ("one_sided", "kinds", "processes")  # for all parameter sets
        every = {f.name: getattr(self, f.name) for f in fields(self) if f.name not in alike}
        return replace(self, **{name: value[rows] for name, value in every.items()})

    @property
    def degrees(self) -> int:
        """Readings less parameters."""
        return int(self.parameters.shape[1] - self.parameters.shape[2])

    @property
    def least(self) -> Array:
        """(n,) below which a sum of squares counts as rounding error."""
        most_free = max(self.degrees, 1)  # also where there are no more readings than parameters
        return most_free * np.maximum(self.floor, _LEAST_NOISE)

    @property
    def prior_square(self) -> Array:
        """(n,) squared distance of the point from the prior's own best, as a parabola sees it."""
        along = np.linalg.solve(self.prior_precision, self.prior_gradient[..., None])[..., 0]
        return (self.prior_gradient * along).sum(axis=1)


def moving_columns(problem: Problem) -> list[int]:
    """The columns of parameters that move the mean of the readings."""
    return [i for i, name in enumerate(problem.names) if parameter_of(name) not in NOISES]


def tangent(target: LogPosterior, z: Array, readings: Sequence[Array] | None, moving: list[int]) -> Tangent:
    """Linearise a block by some of its columns, without signatures.

    Parameters
    ----------
    target : LogPosterior
    z : (n, d) array
        Parameters, in the coordinates that are sampled.
    readings : sequence of (H, R, n) arrays or None
        As in `expand`.
    moving : list of int
        Columns of `z` by which the tensions are differentiated.

    Returns
    -------
    Tangent
    """
    around = around_points(target, z, moving)
    return tangent_of(target, around, list(points_of(target, around, readings)))


@dataclass(frozen=True)
class Around:
    """Points and steps from each along p coordinates: sampled and natural parameters ((1 + 3 p) n, d).

    The points come first, then the steps by which tensions are differentiated, then those for the prior, both ways.
    """

    z: Array
    theta: Array
    columns: int

    @property
    def points(self) -> int:
        return len(self.z) // (1 + 3 * self.columns)


def around_points(target: LogPosterior, z: Array, moving: list[int]) -> Around:
    """Points with their steps along some coordinates.

    Parameters
    ----------
    target : LogPosterior
    z : (n, d) array
    moving : list of int
        Columns of the coordinates.
    """
    p = len(moving)
    every = np.repeat(z[None], 1 + 3 * p, axis=0)
    steps = np.repeat([_STEP, _PRIOR_STEP, -_PRIOR_STEP], p)
    every[np.arange(1, 1 + 3 * p), :, moving * 3] += steps[:, None]
    flat = every.reshape(-1, z.shape[1])
    return Around(flat, target.coordinates.to_natural(flat), p)


@dataclass(frozen=True)
class Point:
    """One sample at n parameter sets, with slopes by p coordinates.

    Attributes
    ----------
    tension : (H, R, n) array
    slopes : (H, R, n, p) array
        Of the tensions.
    sd : (n,) array
        Reading error.
    residual : (n, N) array
        Readings less tensions; this and the others in units of the reading error, for the N readings that there are.
    parameters : (n, N, p) array
        The slopes.
    by_setting : (n, N, H) array
        What a standard deviation of each hold's setting error moves.
    floor : (n,) array
        Share of the reading error's variance that is rounding.
    """

    tension: Array
    slopes: Array
    sd: Array
    residual: Array
    parameters: Array
    by_setting: Array
    floor: Array

    def in_errors(self, values: Array) -> Array:
        """(n, N, m) values (N, m) in units of the reading error."""
        return values[None] / self.sd[:, None, None]

    def rows(self, values: Array, mask: Array) -> Array:
        """(H, R, n) to (n, N) in units of the reading error."""
        return (values[mask] / self.sd).T


def points_of(target: LogPosterior, around: Around, readings: Sequence[Array] | None) -> Iterator[Point]:
    """Each sample at the points.

    Parameters
    ----------
    target : LogPosterior
    around : Around
    readings : sequence of (H, R, n) arrays or None
        Replicates that stand in for the measured readings, an array a sample.
    """
    theta = around.theta[: around.points]
    for sample, y in target.problem.observed(readings):
        mask = sample.protocol.mask
        own = target.problem.parameters(theta, sample)
        sd = np.sqrt(sample.variance(own))
        line = linearise(sample.protocol, own, sample.model)
        residual = (y - line.reading)[mask] / sd
        slopes = _slopes(target, around, sample)
        by_parameters = slopes[mask] / sd[:, None]
        setting = likelihoods.setting_jacobian(line)
        by_setting = setting[mask] * (own["setting_sd"] / sd)
        rounding = np.broadcast_to(sample.resolution**2 / 12.0, sd.shape)
        yield Point(
            line.reading,
            slopes,
            sd,
            residual.T,
            by_parameters.transpose(1, 0, 2),
            np.moveaxis(by_setting, -1, 0),
            rounding / sd**2,
        )


def _slopes(target: LogPosterior, around: Around, sample: Sample) -> Array:
    """(H, R, n, p) derivatives of a sample's tensions by the coordinates stepped along."""
    n = around.points
    theta = around.theta[: n * (1 + around.columns)]
    own = target.problem.parameters(theta, sample)
    flat = simulate(sample.protocol, own, sample.model)
    moved = flat.reshape(*flat.shape[:2], 1 + around.columns, n)
    slopes = (moved[:, :, 1:] - moved[:, :, :1]) / _STEP
    return np.moveaxis(slopes, 2, -1)


def tangent_of(target: LogPosterior, around: Around, points: Sequence[Point]) -> Tangent:
    """The samples put together.

    Parameters
    ----------
    target : LogPosterior
    around : Around
    points : sequence of Point
        Of every sample there.
    """
    k = block_diagonal([p.by_setting for p in points])
    beyond = ~(np.abs(k) < LARGEST_SLOPE).all(axis=(1, 2))  # what the model cannot compute has no tangent
    k[beyond] = 1.0
    left, singular, ratio = _of_typical_length_one(k)
    prior, gradient, precision = _prior(target, around)
    residual = np.concatenate([p.residual for p in points], axis=1)
    residual[beyond] = np.nan
    parameters = np.concatenate([p.parameters for p in points], axis=1)
    floor = np.min([p.floor for p in points], axis=0)
    return Tangent(residual, parameters, left, singular, ratio, gradient, precision, floor, prior)


def _of_typical_length_one(k: Array) -> tuple[Array, Array, Array]:
    """Left singular vectors and values of K with a typical column of length one, and its size, which ρ measures.

    It has none where the wire is slack throughout: then no setting error moves any reading.
    """
    square = (k**2).sum(axis=(1, 2)) / k.shape[2]
    length = np.sqrt(np.where(square > 0, square, 1.0))
    left, singular = _directions(k / length[:, None, None])
    return left, singular, square


def _directions(k: Array) -> tuple[Array, Array]:
    """Left singular vectors and values of matrices (n, N, H) with few columns, from their squares: half the work.

    What is lost are digits of directions in which a setting error moves nothing to speak of: they become zero.
    """
    square, right = np.linalg.eigh(np.swapaxes(k, 1, 2) @ k)
    seen = square > _LEAST_SQUARE * square[:, -1:]
    singular = np.sqrt(np.where(seen, square, 0.0))
    return k @ (right / np.where(seen, singular, np.inf)[:, None]), singular


def residuals(target: LogPosterior, z: Array, readings: Sequence[Array] | None = None) -> tuple[Array, Array]:
    """Readings less tensions, in units of the reading error, and the log density of the prior.

    Parameters
    ----------
    target : LogPosterior
    z : (n, d) array
        Parameters, in the coordinates that are sampled.
    readings : sequence of (H, R, n) arrays, optional
        Replicates that stand in for the measured readings.

    Returns
    -------
    (n, N) and (n,) arrays
        All samples' readings one after the other; the density in the sampled coordinates.
    """
    theta = target.coordinates.to_natural(z)
    parts = []
    with np.errstate(all="ignore"):
        for sample, y in target.problem.observed(readings):
            own = target.problem.parameters(theta, sample)
            sd = np.sqrt(sample.variance(own))
            left = y - simulate(sample.protocol, own, sample.model)
            scaled = left[sample.protocol.mask] / sd
            parts.append(scaled.T)
    return np.concatenate(parts, axis=1), _prior_density(target, theta, z)


def _prior_density(target: LogPosterior, theta: Array, z: Array) -> Array:
    """(n,) log density of the prior in the sampled coordinates, at points whose natural parameters are known."""
    with np.errstate(all="ignore"):  # a parameter that underflows to zero has no density
        return target.sampled_prior(theta, z)


def _prior(target: LogPosterior, around: Around) -> tuple[Array, Array, Array]:
    """Log density of the prior; its gradient and (diagonal, positive) precision by the coordinates stepped along."""
    n = around.points
    p = around.columns
    rows = np.r_[:n, n * (1 + p) : len(around.z)]
    values = _prior_density(target, around.theta[rows], around.z[rows])
    at_points = values[:n]
    plus, minus = values[n:].reshape(2, p, n).swapaxes(1, 2)
    gradient, diagonal = _parabola(at_points[:, None], plus, minus)
    precision = np.zeros((n, p, p))
    columns = np.arange(p)
    precision[:, columns, columns] = diagonal
    return at_points, gradient, precision


def _parabola(centre: Array, plus: Array, minus: Array) -> tuple[Array, Array]:
    """(n, p) slope and positive precision of log densities at points (n, 1) and at a step to either side (n, p)."""
    h = _PRIOR_STEP
    # A boundary of the prior has no slope that means anything: there the column keeps a weak precision alone.
    inside = np.isfinite(plus) & np.isfinite(minus) & np.isfinite(centre)
    with np.errstate(invalid="ignore"):
        slope = (plus - minus) / (2 * h)
        gradient = np.where(inside, slope, 0.0)
        bend = -(plus + minus - 2 * centre) / h**2
        # Along an edge the density falls without a bend, as an exponential: its width is that of its slope.
        width = np.maximum(gradient**2, _FLAT)
        bend = np.where(bend > _FLAT, bend, width)
    return gradient, np.where(inside, bend, 1.0)


def damp(singular: Array, ratio: Array | float) -> Array:
    """How much of what moves whole holds the noise takes, at a ratio ρ, along each singular vector of K."""
    with np.errstate(over="ignore"):
        return ratio * singular**2 / (1.0 + ratio * singular**2)


def whitened(x: Tangent, columns: Array, ratio: float) -> Array:
    """(N, m) columns in the metric of the noise, as the first row has it.

    Parameters
    ----------
    x : Tangent
    columns : (N, m) array
    ratio : float
        Size of the setting errors against the sensor's, ρ.
    """
    shrink = 1.0 - 1.0 / np.sqrt(1.0 + ratio * x.singular[0] ** 2)
    return columns - x.left[0] @ (shrink[:, None] * (x.left[0].T @ columns))


def block_diagonal(blocks: Sequence[Array]) -> Array:
    """Batched (n, rows, columns) blocks along a diagonal."""
    batches, rows, columns = zip(*(block.shape for block in blocks), strict=True)
    out = np.zeros((max(batches), sum(rows), sum(columns)))
    row = column = 0
    for block in blocks:
        _, height, width = block.shape
        out[:, row : row + height, column : column + width] = block
        row += height
        column += width
    return out

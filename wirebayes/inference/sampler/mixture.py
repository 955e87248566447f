"""A mixture of multivariate Student-t distributions: density, draws, and its fit by expectation-maximisation."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.random import Generator
from scipy.special import gammaln

from wirebayes.inference.sampler.points import WeightedPoints
from wirebayes.inference.sampler.settings import DEGREES, EM_GAIN, EM_STEPS, LEAST_EVIDENCE
from wirebayes.numeric.log_sum import log_sum
from wirebayes.numeric.spread_rows import spread_rows
from wirebayes.numeric.typing import Array


@dataclass(frozen=True)
class Mixture:
    """A mixture of Student-t distributions.

    Attributes
    ----------
    weights, centres : (k,), (k, d) arrays
    factors : (k, d, d) array
        Lower Cholesky factors of the scales.
    degrees : float or (k,) array
        Of freedom: one number for all components, or one each.
    """

    weights: Array
    centres: Array
    factors: Array
    degrees: Any = DEGREES

    def to_arrays(self) -> dict[str, Any]:
        """What `from_arrays` makes the same mixture of."""
        return {"weights": self.weights, "centres": self.centres, "factors": self.factors, "degrees": self.degrees}

    @staticmethod
    def from_arrays(arrays: Mapping[str, Any]) -> "Mixture":
        """The mixture that gave these arrays."""
        return Mixture(arrays["weights"], arrays["centres"], arrays["factors"], float(arrays["degrees"]))

    def log_density(self, x: Array) -> Array:
        """(n,) log density of points (n, d)."""
        return log_sum(self.log_parts(self._distances(x)))

    def rvs(self, n: int, rng: Any) -> Array:
        """(n, d) draws; `rng` is a numpy RandomState or Generator."""
        d = self.centres.shape[1]
        which = rng.choice(len(self.weights), size=n, p=self.weights)
        stretch = np.sqrt(self.degrees / rng.chisquare(self.degrees, size=n))
        normal = rng.standard_normal((n, d))
        from_centre = np.einsum("nij,nj->ni", self.factors[which], normal)
        return self.centres[which] + stretch[:, None] * from_centre

    @property
    def moments(self) -> tuple[Array, Array]:
        """(d,) mean and (d, d) covariance; more than two degrees of freedom."""
        mean = self.weights @ self.centres
        apart = self.centres - mean
        variance = self.weights * self.degrees / (self.degrees - 2.0)
        within = np.einsum("k,kij,klj->il", variance, self.factors, self.factors)
        return mean, within + np.einsum("k,ki,kj->ij", self.weights, apart, apart)

    @cached_property
    def _whitening(self) -> tuple[Array, Array]:
        """What all components' whitened points are made of, in one product: (k d, d) and (k d, 1)."""
        inverse = np.linalg.inv(self.factors)
        middle = np.einsum("kij,kj->ki", inverse, self.centres)
        return inverse.reshape(-1, inverse.shape[2]), middle.reshape(-1, 1)

    def _distances(self, x: Array) -> Array:
        """(k, n) squared Mahalanobis distances, in the precision of the points."""
        (k, d), (product, middle) = self.centres.shape, self._whitening
        y = product.astype(x.dtype) @ x.T  # points last: sums over coordinates are several times as fast
        y -= middle.astype(x.dtype)
        y *= y
        return y.reshape(k, d, len(x)).sum(axis=1)

    def log_parts(self, distances: Array) -> Array:
        """(k, n) log of weight times density of each component."""
        d = self.centres.shape[1]
        nu = np.reshape(self.degrees, (-1, 1))
        constant = gammaln(0.5 * (nu + d)) - gammaln(0.5 * nu) - 0.5 * d * np.log(nu * np.pi)
        log_volume = np.log(np.einsum("kii->ki", self.factors)).sum(axis=1)
        own = np.log(self.weights) - log_volume
        kind = distances.dtype
        height = (constant + own[:, None]).astype(kind)
        heavy = (-0.5 * (nu + d)).astype(kind)
        nu = nu.astype(kind)
        return height + heavy * np.log1p(distances / nu)


def from_modes(centres: Array, covariances: Array, log_weights: Array) -> Mixture:
    """One component a mode, weighted by its evidence but none below a twentieth.

    Parameters
    ----------
    centres : (k, d) array
    covariances : (k, d, d) array
    log_weights : (k,) array
        Log evidence of each mode.
    """
    weights = np.maximum(np.exp(log_weights - log_weights.max()), LEAST_EVIDENCE)
    return Mixture(weights / weights.sum(), centres, np.linalg.cholesky(covariances))


def fit_mixture(
    points: WeightedPoints,
    rng: Generator,
    *,
    most: int = 8,
    degrees: float = DEGREES,
    before: Mixture | None = None,
) -> Mixture:
    """The mixture of as many components as points can hold apart.

    Parameters
    ----------
    rng : numpy.random.Generator
        Draws the starts.
    most : int
        Largest number of components; fewer are tried where a fit fails.
    degrees : float
        Degrees of freedom of every component.
    before : Mixture, optional
        A mixture of nearly these points, used as the start if it has `most` components.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the points do not span their space.
    """
    weight = points.weight
    share = weight / weight.sum()
    middle = share @ points.z
    away = points.z - middle
    scale = (away * share[:, None]).T @ away
    variances = np.diag(np.diag(scale))
    root = np.linalg.cholesky(scale + 1e-9 * variances)
    x = np.linalg.solve(root, away.T).T
    if not np.isfinite(x).all():  # a map fitted to too few points may overflow
        raise np.linalg.LinAlgError("the points do not span their space")

    def starts() -> Iterator[Mixture]:
        if before is not None and len(before.weights) == most:
            centres = np.linalg.solve(root, (before.centres - middle).T).T
            factors = np.linalg.solve(root, before.factors)
            yield Mixture(before.weights, centres, factors, degrees)
        for k in range(most, 0, -1):
            centres = x[spread_rows(x, k, rng, share)]
            if len(centres) == k:
                yield _round_components(centres, degrees)

    for start in starts():
        try:
            found = _em(x, weight, start)
        except np.linalg.LinAlgError:
            continue
        centres = middle + found.centres @ root.T
        factors = root @ found.factors
        return Mixture(found.weights, centres, factors, degrees)
    raise np.linalg.LinAlgError("the points do not span their space")


def _round_components(centres: Array, degrees: float = DEGREES) -> Mixture:
    """Equal components of unit scale about centres (k, d)."""
    k, d = centres.shape
    return Mixture(np.full(k, 1.0 / k), centres, np.repeat(np.eye(d)[None], k, axis=0), degrees)


def fit_around(points: WeightedPoints, of: Mixture, rng: Generator, *, most: int, wider: float) -> Mixture:
    """A mixture of few points, the components of which lean on the covariance of another mixture.

    Parameters
    ----------
    points : WeightedPoints
        However few.
    of : Mixture
        Of what the points lie around.
    most : int
        Largest number of components; no more than the points are worth, each as many as there are coordinates.
    wider : float
        Times the other covariance: what every component counts as much as so many points as there are coordinates.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the points are so far from the other mixture that a component has no digits left.
    """
    middle, covariance = of.moments
    d = len(middle)
    root = np.linalg.cholesky(wider * covariance)
    x = np.linalg.solve(root, (points.z - middle).T).T
    worth = points.weight.sum()
    k = int(np.clip(worth / d, 1, most))
    centres = x[spread_rows(x, k, rng, points.weight / worth)]
    start = _round_components(centres)
    found = _em(x, points.weight, start, kind=np.float64, of_the_whole=float(d), fewest=0.0)
    return Mixture(found.weights, middle + found.centres @ root.T, root @ found.factors)


def _em(
    x: Array,
    weight: Array,
    mixture: Mixture,
    *,
    kind: type[np.floating[Any]] = np.float32,
    of_the_whole: float = 3.0,
    fewest: float = 3.0,
) -> Mixture:
    """Expectation-maximisation, in single precision: half the work, and enough digits for points near the origin.

    The unit covariance counts as much as `of_the_whole` points in every component, because a component that holds few
    points would shrink onto them. One with fewer points than `fewest` for each coordinate is an error: it would take
    the others with it.
    """
    x = x.astype(kind)
    weight = weight.astype(kind)
    n, d = x.shape
    degrees = mixture.degrees
    squares = (x[:, :, None] * x[:, None, :]).reshape(n, d * d)
    last = -np.inf
    for _ in range(EM_STEPS):
        distances = mixture._distances(x)
        logs = mixture.log_parts(distances)
        total = log_sum(logs)
        share = np.exp(logs - total) * weight
        members = share.sum(axis=1, dtype=float)
        if not (members >= fewest * d).all():
            raise np.linalg.LinAlgError("empty component")
        heavy = share * (degrees + d) / (degrees + distances)
        centres, scatter = _moments(heavy, x, squares)
        scatter += of_the_whole * np.eye(d)
        factors = np.linalg.cholesky(scatter / (members + of_the_whole)[:, None, None])
        mixture = Mixture(members / members.sum(), centres, factors, degrees)
        log_likelihood = float(weight @ total)
        if log_likelihood - last < EM_GAIN * members.sum():
            break
        last = log_likelihood
    return mixture


def _moments(heavy: Array, x: Array, squares: Array) -> tuple[Array, Array]:
    """Centre of each component, and the sum of squares around it, of points that count so heavily in it."""
    k = len(heavy)
    d = x.shape[1]
    mass = heavy.sum(axis=1)
    centres = (heavy @ x) / mass[:, None]
    around_origin = (heavy @ squares).reshape(k, d, d)
    scale = around_origin - mass[:, None, None] * centres[:, :, None] * centres[:, None, :]
    return centres.astype(float), scale.astype(float)

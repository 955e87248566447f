"""A mixture of multivariate Student-t distributions: density, draws, and its fit by expectation-maximisation."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln, logsumexp

Array = NDArray[Any]
DEGREES = 10.0  # heavy enough to reach every tail of a posterior, light enough to be accepted


@dataclass(frozen=True)
class Mixture:
    """Weights ``(k,)``, centres ``(k, d)``, lower Cholesky factors ``(k, d, d)`` of the scales, degrees of freedom."""

    weights: Array
    centres: Array
    factors: Array
    degrees: float = DEGREES

    def log_density(self, x: Array) -> Array:
        """(n,) log density of points (n, d)."""
        return np.asarray(logsumexp(self._parts(x) + np.log(self.weights)[:, None], axis=0))

    def rvs(self, n: int, rng: Any) -> Array:
        """(n, d) draws; `rng` is a numpy RandomState or Generator."""
        d = self.centres.shape[1]
        which = rng.choice(len(self.weights), size=n, p=self.weights)
        stretch = np.sqrt(self.degrees / rng.chisquare(self.degrees, size=n))
        return self.centres[which] + stretch[:, None] * np.einsum(
            "nij,nj->ni", self.factors[which], rng.standard_normal((n, d))
        )

    def _parts(self, x: Array) -> Array:
        """(k, n) log density of each component."""
        return np.array(
            [_log_t(_distance(x, c, f), f, self.degrees) for c, f in zip(self.centres, self.factors, strict=True)]
        )


def from_modes(centres: Array, covariances: Array, log_weights: Array) -> Mixture:
    """One component a mode, weighted by its evidence but none below a twentieth."""
    weights = np.maximum(np.exp(log_weights - log_weights.max()), 0.05)
    return Mixture(weights / weights.sum(), centres, np.linalg.cholesky(covariances))


def fit(x: Array, rng: np.random.Generator, *, most: int = 8, degrees: float = DEGREES) -> Mixture:
    """The mixture of as many components, up to `most`, as points (n, d) can hold apart."""
    for k in range(most, 0, -1):
        try:
            return _em(x, k, degrees, rng)
        except np.linalg.LinAlgError:
            continue
    raise np.linalg.LinAlgError("the points do not span their space")


def _em(x: Array, k: int, degrees: float, rng: np.random.Generator, iterations: int = 60) -> Mixture:
    n, d = x.shape
    covariance = np.cov(x.T).reshape(d, d) + 1e-9 * np.diag(x.var(axis=0))
    root = np.linalg.cholesky(covariance)
    centres = x[spread_rows(np.linalg.solve(root, x.T).T, k, rng)]
    if len(centres) < k:
        raise np.linalg.LinAlgError("fewer different points than components")
    mixture = Mixture(np.full(k, 1.0 / k), centres, np.repeat(root[None], k, axis=0), degrees)
    last = -np.inf
    for _ in range(iterations):
        distances = np.array([_distance(x, c, f) for c, f in zip(mixture.centres, mixture.factors, strict=True)])
        logs = np.array([_log_t(q, f, degrees) for q, f in zip(distances, mixture.factors, strict=True)])
        logs += np.log(mixture.weights)[:, None]
        total = logsumexp(logs, axis=0)
        share = np.exp(logs - total)
        # A component that holds too few points for its own covariance takes the others with it: stop there.
        if (share.sum(axis=1) < 3.0 * d).any():
            raise np.linalg.LinAlgError("empty component")
        heavy = share * (degrees + d) / (degrees + distances)
        new_centres = np.einsum("kn,nd->kd", heavy, x) / heavy.sum(axis=1, keepdims=True)
        factors = []
        for i in range(k):
            deviation = x - new_centres[i]
            # a walker that stayed repeats its point: without some of the whole heap, a component shrinks onto that
            scale = (heavy[i][:, None] * deviation).T @ deviation + _OF_THE_WHOLE * covariance
            factors.append(np.linalg.cholesky(scale / (share[i].sum() + _OF_THE_WHOLE)))
        mixture = Mixture(share.sum(axis=1) / n, new_centres, np.array(factors), degrees)
        log_likelihood = float(total.sum())
        if log_likelihood - last < 1e-3 * n:
            break
        last = log_likelihood
    return mixture


def spread_rows(x: Array, k: int, rng: np.random.Generator) -> list[int]:
    """Rows far from one another, for a start (k-means++); fewer than `k` where there are not so many different ones."""
    chosen = [int(rng.integers(len(x)))]
    nearest = ((x - x[chosen[0]]) ** 2).sum(axis=1)
    while len(chosen) < k and nearest.any():
        chosen.append(int(rng.choice(len(x), p=nearest / nearest.sum())))
        nearest = np.minimum(nearest, ((x - x[chosen[-1]]) ** 2).sum(axis=1))
    return chosen


def _distance(x: Array, centre: Array, factor: Array) -> Array:
    """(n,) squared Mahalanobis distance; numpy's inverse of a small triangle beats a solve of many columns."""
    y = (x - centre) @ np.linalg.inv(factor).T
    return np.einsum("nd,nd->n", y, y)


def _log_t(distance: Array, factor: Array, degrees: float) -> Array:
    d = len(factor)
    constant = gammaln(0.5 * (degrees + d)) - gammaln(0.5 * degrees) - 0.5 * d * np.log(degrees * np.pi)
    return constant - np.log(np.diag(factor)).sum() - 0.5 * (degrees + d) * np.log1p(distance / degrees)


_OF_THE_WHOLE = 3.0  # points' worth of the covariance of all points in that of every component

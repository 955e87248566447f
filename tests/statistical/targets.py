"""Analytic targets in the sampler's own dimension, with their exact first and second moments."""

from types import SimpleNamespace

import numpy as np
from scipy import stats
from scipy.special import logsumexp

D = 8


class Analytic:
    """What the sampler asks of a target, for a density written down."""

    def __init__(self, log_density, mean, second, spread=6.0):
        self.log_density, self.mean, self.second = log_density, mean, second
        self.evaluations = 0
        same = lambda x: x  # noqa: E731
        d = len(mean)
        self.coordinates = SimpleNamespace(
            to_sampled=same, to_natural=same, log_columns=np.zeros(d, bool), order=np.arange(d)
        )
        start = lambda n, rng: rng.normal(0.0, spread, (n, d))  # noqa: E731
        self.problem = SimpleNamespace(prior=SimpleNamespace(rvs=start), names=tuple(f"x{i}" for i in range(d)))

    def __call__(self, z, readings=None):
        self.evaluations += len(z)
        return np.atleast_1d(self.log_density(z))  # scipy makes a number of one row


def gaussian(d=D):
    """Correlated, standard deviations from 0.03 to 1."""
    rng = np.random.default_rng(8)
    basis, _ = np.linalg.qr(rng.normal(size=(d, d)))
    covariance = basis @ np.diag(np.geomspace(1e-3, 1.0, d)) @ basis.T
    mean = rng.normal(size=d)
    density = stats.multivariate_normal(mean, covariance).logpdf
    return Analytic(density, mean, np.diag(covariance) + mean**2)


def banana():
    """x1 bends with the square of x0; the others are standard normal."""
    bend = 1.0

    def density(z):
        straight = z.copy()
        straight[:, 1] = (z[:, 1] - bend * (z[:, 0] ** 2 - 1.0)) / 0.5
        return -0.5 * (straight**2).sum(axis=1)

    second = np.ones(D)
    second[1] = 0.25 + 2.0 * bend**2  # var(x0²) = 2
    return Analytic(density, np.zeros(D), second)


def two_modes():
    """Ten standard deviations apart, weights 0.7 and 0.3, one a little narrower."""
    shift = np.zeros(D)
    shift[0] = 10.0
    weights, widths = np.array([0.7, 0.3]), np.array([1.0, 0.9])

    def density(z):
        parts = [
            np.log(w) - 0.5 * (((z - k * shift) / s) ** 2).sum(axis=1) - D * np.log(s)
            for k, (w, s) in enumerate(zip(weights, widths, strict=True))
        ]
        return logsumexp(parts, axis=0)

    second = weights @ np.array([np.full(D, s * s) + (k * shift) ** 2 for k, s in enumerate(widths)])
    return Analytic(density, weights[1] * shift, second)


def heavy_tails():
    """Student's t with eight degrees of freedom: second moments have a variance, and not much more."""
    density = stats.multivariate_t(np.zeros(D), np.eye(D), df=8).logpdf
    return Analytic(density, np.zeros(D), np.full(D, 8.0 / 6.0), spread=3.0)


TARGETS = {"gaussian": gaussian, "banana": banana, "two_modes": two_modes, "heavy_tails": heavy_tails}

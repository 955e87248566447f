"""Analytic targets in the sampler's own dimension, with their exact first and second moments."""

from types import SimpleNamespace

import numpy as np
from scipy import stats
from scipy.special import logsumexp

from wirebayes.model.problem import Problem

D = 8


class Analytic:
    """What the sampler asks of a target, for a density written down."""

    def __init__(self, log_density, mean, second, spread=6.0, hills=1, shares=()):
        self.hills = hills
        self.log_density, self.mean, self.second = log_density, mean, second
        self.evaluations = 0
        same = lambda x: x  # noqa: E731
        d = len(mean)
        self.coordinates = SimpleNamespace(
            noises=(),
            sensor_columns=[],
            setting_columns=[],
            kinds_of_creep=[],
            to_sampled=same,
            to_natural=same,
            log_columns=np.zeros(d, bool),
            order=np.arange(d),
            shares=shares,
        )
        start = lambda n, rng: rng.normal(0.0, spread, (n, d))  # noqa: E731
        self.problem = SimpleNamespace(prior=SimpleNamespace(rvs=start), names=tuple(f"x{i}" for i in range(d)))

    def __call__(self, z, readings=None):
        self.evaluations += len(z)
        return np.atleast_1d(self.log_density(z))  # scipy makes a number of one row

    def rowwise(self, readings=None):
        return lambda points, rows: self(points), None


class Silent(Problem):
    """No reading says anything."""

    def log_likelihood(self, theta, readings=None):
        return np.zeros(len(theta))

    def standardised(self, theta, readings=None):
        return np.zeros(len(theta)), np.zeros((0, len(theta)))


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
    return Analytic(density, weights[1] * shift, second, hills=2)


def heavy_tails():
    """Student's t with eight degrees of freedom: second moments have a variance, and not much more."""
    density = stats.multivariate_t(np.zeros(D), np.eye(D), df=8).logpdf
    return Analytic(density, np.zeros(D), np.full(D, 8.0 / 6.0), spread=3.0)


def funnel(neck=0):
    """Neal's, in six dimensions: coordinate `neck` is v ~ N(0, 3²), the others N(0, e^v) given it."""
    d = 6

    def density(z):
        v, others = z[:, neck], np.delete(z, neck, axis=1)
        with np.errstate(over="ignore"):
            return -0.5 * v**2 / 9.0 - 0.5 * (d - 1) * v - 0.5 * (others**2).sum(axis=1) * np.exp(-v)

    second = np.full(d, np.exp(4.5))
    second[neck] = 9.0
    return Analytic(density, np.zeros(d), second)


SHARE = stats.truncnorm(-11.0 / 6.0, np.inf, 0.11, 0.06)  # an amount that may be nothing


def share():
    """The score of such an amount, and three narrow coordinates that follow it."""
    slopes, width = np.array([1.5, -0.7, 0.4]), 3e-3

    def density(z):
        amount = stats.norm.cdf(z[:, 0])
        left = (z[:, 1:] - amount[:, None] * slopes) / width
        return SHARE.logpdf(amount) + stats.norm.logpdf(z[:, 0]) - 0.5 * (left**2).sum(axis=1)

    return Analytic(density, np.zeros(4), np.ones(4), spread=1.0, shares=[0])


def sixteen_modes(centres):
    """Of one weight, with unit covariance, at centres (16, d)."""

    def density(z):
        return logsumexp([-0.5 * ((z - centre) ** 2).sum(axis=1) for centre in centres], axis=0)

    return Analytic(density, centres.mean(axis=0), 1.0 + (centres**2).mean(axis=0), spread=12.0)


def grid(apart=10.0, d=6):
    """Four by four."""
    at = np.zeros((16, d))
    at[:, :2] = apart * (np.stack(np.meshgrid(range(4), range(4)), axis=-1).reshape(16, 2) - 1.5)
    return at


def corners(apart=10.0, d=8):
    """Of a cube in four dimensions."""
    at = np.zeros((16, d))
    at[:, :4] = apart * (np.stack(np.meshgrid(*4 * [range(2)]), axis=-1).reshape(16, 4) - 0.5)
    return at


TARGETS = {"gaussian": gaussian, "banana": banana, "two_modes": two_modes, "heavy_tails": heavy_tails}

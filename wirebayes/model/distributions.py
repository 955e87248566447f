"""Log densities of priors that are fast to evaluate, and a logistic normal distribution."""

from collections.abc import Callable
from copy import copy
from typing import Any, NamedTuple

import numpy as np
from scipy import stats
from scipy.special import expit, log_ndtr, logit, ndtr, ndtri

from wirebayes.numeric.typing import Array

_HALF_LOG_2PI = 0.5 * float(np.log(2.0 * np.pi))


class _LogitNormal(stats.rv_continuous):
    """A share of the scale whose logit is normal: log-normal for small shares, never above the scale."""

    def _argcheck(self, middle: Any, sd: Any) -> Any:  # type: ignore[override]
        return np.isfinite(middle) & (sd > 0)

    def _logpdf(self, x: Any, middle: Any, sd: Any) -> Any:  # type: ignore[override]
        score = (logit(x) - middle) / sd
        return -0.5 * score**2 - np.log(sd) - _HALF_LOG_2PI - np.log(x) - np.log1p(-x)

    def _pdf(self, x: Any, middle: Any, sd: Any) -> Any:  # type: ignore[override]
        return np.exp(self._logpdf(x, middle, sd))

    def _cdf(self, x: Any, middle: Any, sd: Any) -> Any:  # type: ignore[override]
        return ndtr((logit(x) - middle) / sd)

    def _ppf(self, q: Any, middle: Any, sd: Any) -> Any:  # type: ignore[override]
        return expit(middle + sd * ndtri(q))


logit_normal = _LogitNormal(a=0.0, b=1.0, name="logitnorm", shapes="middle, sd")


def scaled(distribution: Any, factor: float) -> Any:
    """The distribution of a positive number times what another one describes."""
    shapes, loc, scale = distribution.dist._parse_args(*distribution.args, **distribution.kwds)
    # a copy: freezing anew takes a hundred times as long, and a search does it thousands of times
    other = copy(distribution)
    other.args, other.kwds = shapes, {"loc": loc * factor, "scale": scale * factor}
    return other


def fast_logpdf(dist: Any) -> Callable[[Array], Array]:
    """The log density of a frozen distribution; closed forms of the common ones avoid scipy's overhead per call."""
    name, shape, loc, scale = parsed(dist)
    if name == "norm":
        constant = float(np.log(scale)) + _HALF_LOG_2PI
        return lambda x: -0.5 * ((x - loc) / scale) ** 2 - constant
    if name == "halfnorm":
        constant = 0.5 * float(np.log(2.0 / np.pi)) - float(np.log(scale))
        return lambda x: np.where(x >= loc, constant - 0.5 * ((x - loc) / scale) ** 2, -np.inf)
    if name == "lognorm" and loc == 0.0:
        return lognormal(shape, scale)
    if name == "truncnorm" and dist.support()[1] == np.inf:
        least, whole = loc + shape * scale, float(np.log(scale)) + _HALF_LOG_2PI + float(log_ndtr(-shape))
        return lambda x: np.where(x >= least, -0.5 * ((x - loc) / scale) ** 2 - whole, -np.inf)
    if name == "logitnorm":
        return _logit_normal(shape, float(dist.dist._parse_args(*dist.args, **dist.kwds)[0][1]), scale)
    if name == "uniform":
        return lambda x: np.where((x >= loc) & (x <= loc + scale), -np.log(scale), -np.inf)
    if name == "loguniform" and loc == 0.0:
        return log_uniform(*(float(end) for end in dist.support()))
    return lambda x: np.asarray(dist.logpdf(x))


class _Parsed(NamedTuple):
    """Name, first shape parameter (0 where there is none), location and scale of a distribution."""

    name: str
    shape: float
    loc: float
    scale: float


def parsed(dist: Any) -> _Parsed:
    """What a frozen distribution of scipy was made with."""
    shapes, loc, scale = dist.dist._parse_args(*dist.args, **dist.kwds)
    return _Parsed(dist.dist.name, float(shapes[0]) if shapes else 0.0, float(loc), float(scale))


def lognormal(spread: Any, median: Any) -> Callable[[Array], Array]:
    """The log density of a log-normal distribution, or of several, a column each."""
    middle, constant = np.log(median), np.log(spread) + _HALF_LOG_2PI

    def evaluate(x: Array) -> Array:
        inside = x > 0
        log_x = np.log(np.where(inside, x, 1.0))
        return np.where(inside, -0.5 * ((log_x - middle) / spread) ** 2 - log_x - constant, -np.inf)

    return evaluate


def _logit_normal(middle: float, sd: float, most: float) -> Callable[[Array], Array]:
    """The log density of a number between 0 and `most` the logit of whose share is normal."""
    constant = float(np.log(sd)) + _HALF_LOG_2PI + float(np.log(most))

    def evaluate(x: Array) -> Array:
        share = x / most
        inside = (share > 0) & (share < 1)
        u = np.where(inside, share, 0.5)
        log_below, log_above = np.log(u), np.log1p(-u)
        score = (log_below - log_above - middle) / sd
        return np.where(inside, -0.5 * score**2 - log_below - log_above - constant, -np.inf)

    return evaluate


def log_uniform(low: float, high: float) -> Callable[[Array], Array]:
    """The log density of a positive number whose logarithm is uniform between two ends."""
    constant = float(np.log(np.log(high / low)))

    def evaluate(x: Array) -> Array:
        inside = (x >= low) & (x <= high)
        return np.where(inside, -np.log(np.where(inside, x, low)) - constant, -np.inf)

    return evaluate

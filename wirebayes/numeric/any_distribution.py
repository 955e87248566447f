"""What is asked of a distribution whether it is one of `wirebayes.numeric.distributions` or a frozen one of scipy."""

from copy import copy
from typing import Any

import numpy as np

from wirebayes.numeric.distributions import (
    ONE_SD,
    Distribution,
    HalfCauchy,
    HalfNormal,
    LogNormal,
    LogUniform,
    Normal,
    TruncatedNormal,
    Uniform,
)
from wirebayes.numeric.typing import Function


def ours(distribution: Any) -> Any:
    """A frozen distribution of scipy as one of this module's, where it is of such a kind; any other one as it is."""
    if isinstance(distribution, Distribution):
        return distribution
    shapes, loc, scale = distribution.dist._parse_args(*distribution.args, **distribution.kwds)
    shapes, loc, scale = tuple(map(float, shapes)), float(loc), float(scale)
    match distribution.dist.name:
        case "norm":
            return Normal(loc, scale)
        case "halfnorm":
            return HalfNormal(scale, loc)
        case "halfcauchy" if loc == 0.0:
            return HalfCauchy(scale)
        case "truncnorm" if shapes[1] == np.inf:
            return TruncatedNormal(shapes[0], loc, scale)
        case "lognorm" if loc == 0.0:
            return LogNormal(shapes[0], scale)
        case "uniform":
            return Uniform(loc, scale)
        case "loguniform" if loc == 0.0:
            return LogUniform(shapes[0] * scale, shapes[1] * scale)
    return distribution


def scaled(distribution: Any, factor: float) -> Any:
    """The distribution of a number `factor` times as large, which is positive."""
    known = ours(distribution)
    if isinstance(known, Distribution):
        return known.scaled(factor)
    shapes, loc, scale = known.dist._parse_args(*known.args, **known.kwds)
    # a copy: freezing anew takes a hundred times as long, and a search does it thousands of times
    other = copy(known)
    other.args, other.kwds = shapes, {"loc": loc * factor, "scale": scale * factor}
    return other


def finite_spread(distribution: Any) -> float:
    """Its standard deviation; where that is infinite, half the distance between its 16 % and 84 % quantiles."""
    sd = float(distribution.std())
    if np.isfinite(sd):
        return sd
    low, high = distribution.ppf(ONE_SD)
    return float(0.5 * (high - low))


def log_density_of(distribution: Any) -> Function:
    """The log density of a distribution of this module or of scipy, as a function of an array."""
    known = ours(distribution)
    return known.log_density() if isinstance(known, Distribution) else lambda x: np.asarray(known.logpdf(x))

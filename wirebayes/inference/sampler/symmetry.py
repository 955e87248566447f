"""The sinh-arcsinh transformation that makes skewed points symmetric, and its shape for given points.

References
----------
M. C. Jones and A. Pewsey, Sinh-arcsinh distributions, Biometrika 96 (2009).
"""

import numpy as np
from scipy.special import ndtr

from wirebayes.inference.sampler.settings import RESERVE, SCORES, SKEWNESSES
from wirebayes.numeric.typing import Array


def made_symmetric(x: Array, shape: Array) -> tuple[Array, Array]:
    """What is even where x has this shape, sinh(arcsinh w - skewness), and the slopes; w is x in units of the shape."""
    location, width, skewness = shape
    even = np.cosh(skewness)
    odd = np.sinh(skewness)
    w = (x - location) / width
    root = np.sqrt(1.0 + w * w)
    return w * even - root * odd, (even - w / root * odd) / width


def made_skewed(u: Array, shape: Array) -> Array:
    """The inverse of `made_symmetric`: its sinh(arcsinh u + skewness), written out."""
    location, width, skewness = shape
    w = u * np.cosh(skewness) + np.sqrt(1.0 + u * u) * np.sinh(skewness)
    return location + width * w


def fitted_shapes(x: Array, weight: Array) -> Array:
    """(3, m) shapes of weighted points (n, m), by which their quantiles come nearest to those of a normal.

    For each of many skewnesses location and width are a weighted straight-line fit; the weights, slopes of the map,
    make of a distance between quantiles one between scores.
    """
    worth = weight.sum()
    middle = weight @ x / worth
    variance = weight @ (x - middle) ** 2 / worth
    spread = np.maximum(np.sqrt(variance), 1e-12)
    quantiles = (_quantiles(x, weight, ndtr(SCORES)) - middle) / spread
    locations, widths, misfit = _line_of_each_skewness(quantiles)
    reserve = (RESERVE * SKEWNESSES[:, None]) ** 2
    best = np.argmin(misfit + reserve, axis=0)
    chosen = best, np.arange(x.shape[1])
    return np.array([middle + spread * locations[chosen], spread * widths[chosen], SKEWNESSES[best]])


def _line_of_each_skewness(quantiles: Array) -> tuple[Array, Array, Array]:
    """(skewnesses, m) location and width that suit quantiles (scores, m) best at each skewness, and the misfit left."""
    inner = np.arcsinh(SCORES) + SKEWNESSES[:, None]
    curve = np.sinh(inner)
    slope = np.cosh(inner) / np.sqrt(1.0 + SCORES**2)
    slope = slope[..., None]
    lines = np.stack([np.ones_like(curve), curve], axis=-1) / slope
    weighted = quantiles / slope
    line = np.linalg.pinv(lines) @ weighted
    left = weighted - lines @ line
    width = np.maximum(line[:, 1], 1e-3)
    return line[:, 0], width, (left**2).sum(axis=1) / width**2


def _quantiles(x: Array, weight: Array, shares: Array) -> Array:
    """(k, m) quantiles of weighted points (n, m)."""
    rows = np.argsort(x, axis=0)
    ranked = np.take_along_axis(x, rows, axis=0)
    until = np.cumsum(weight[rows], axis=0)
    middles = (until - 0.5 * weight[rows]) / until[-1]
    of_each = [np.interp(shares, *column) for column in zip(middles.T, ranked.T, strict=True)]
    return np.stack(of_each, axis=1)

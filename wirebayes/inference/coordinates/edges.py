"""Amplitudes whose prior ends at an edge, transformed to scores that are standard normal under that prior."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import erf, erfc, erfcinv, erfinv, ndtr, ndtri

from wirebayes.numeric.any_distribution import ours
from wirebayes.numeric.distributions import HalfCauchy, HalfNormal, LogUniform, TruncatedNormal, Uniform
from wirebayes.numeric.typing import Array, Function

_NEAREST = 1e-9  # share of the prior between an edge and a value on it, whose score would be infinite


@dataclass(frozen=True)
class Edge:
    """A map between values and scores, each (n,).

    Attributes
    ----------
    score, value : function of an array
    ends : bool
        Whether the values have an upper end.
    """

    score: Function
    value: Function
    ends: bool


def edge(distribution: Any) -> Edge | None:
    """The map for halves of a normal and a Cauchy one, a normal cut off below, (log-)uniform ones; none for others."""
    match ours(distribution):
        case HalfNormal(sd, 0.0):
            return _half_normal(sd)
        case HalfCauchy(scale):
            return _half_cauchy(scale)
        case TruncatedNormal() as known:
            return _cut_off(known)
        case Uniform(low, width):
            return _uniform(low, width)
        case LogUniform() as known:
            return _log_uniform(known)
    return None


def _half_normal(sd: float) -> Edge:
    """Each half from its own tail, where it keeps its digits."""
    unit = sd * np.sqrt(2.0)

    def score(value: Array) -> Array:
        u = value / unit
        below = np.maximum(erf(u), _NEAREST)
        above = erfc(np.maximum(u, 0.5))
        return np.where(u < 0.5, ndtri(below), -ndtri(above))

    def value(score: Array) -> Array:
        below = ndtr(np.minimum(score, 0.0))
        above = ndtr(-np.maximum(score, 0.0))
        u = np.where(score < 0.0, erfinv(below), erfcinv(above))
        return unit * u

    return Edge(score, value, False)


def _half_cauchy(scale: float) -> Edge:
    """Each half from its own tail, where it keeps its digits."""

    def score(value: Array) -> Array:
        u = value / scale
        below = np.maximum(2.0 / np.pi * np.arctan(u), _NEAREST)
        above = 2.0 / np.pi * np.arctan(1.0 / np.maximum(u, 1.0))
        return np.where(u < 1.0, ndtri(below), -ndtri(above))

    def value(score: Array) -> Array:
        below = ndtr(np.minimum(score, 0.0))
        above = ndtr(-np.maximum(score, 0.0))
        u = np.where(score < 0.0, np.tan(0.5 * np.pi * below), 1.0 / np.tan(0.5 * np.pi * above))
        return scale * u

    return Edge(score, value, False)


def _cut_off(known: TruncatedNormal) -> Edge:
    """Each half from its own tail."""
    least = known.least_sd
    middle = known.centre
    sd = known.sd
    below = ndtr(least)
    above = ndtr(-least)
    end = known.support()[0]
    if abs(end) < 1e-12 * sd:
        end = 0.0  # where it was cut off, but for rounding

    def score(value: Array) -> Array:
        u = np.maximum((value - middle) / sd, least)
        right = ndtr(-u) / above
        left = (ndtr(u) - below) / above
        upper = -ndtri(right)
        lower = ndtri(np.maximum(left, _NEAREST))
        return np.where(right < 0.5, upper, lower)

    def value(score: Array) -> Array:
        left = ndtr(np.minimum(score, 0.0))
        right = ndtr(-np.maximum(score, 0.0))
        lower = ndtri(below + left * above)
        upper = -ndtri(right * above)
        found = middle + sd * np.where(score < 0.0, lower, upper)
        return np.maximum(found, end)  # rounding may lead beyond

    return Edge(score, value, False)


def _uniform(low: float, width: float) -> Edge:
    def score(value: Array) -> Array:
        return ndtri(np.clip((value - low) / width, _NEAREST, 1.0 - _NEAREST))

    def value(score: Array) -> Array:
        return low + width * ndtr(score)

    return Edge(score, value, True)


def _log_uniform(known: LogUniform) -> Edge:
    width = np.log(known.high / known.low)

    def score(value: Array) -> Array:
        share = np.log(value / known.low) / width
        return ndtri(np.clip(share, _NEAREST, 1.0 - _NEAREST))

    def value(score: Array) -> Array:
        found = known.low * np.exp(width * ndtr(score))
        return np.minimum(found, known.high)  # rounding may lead beyond

    return Edge(score, value, True)

"""Means of numbers that have no scale, and of those that are there."""

from collections.abc import Iterable

import numpy as np

from wirebayes.numeric.typing import Array, Floats


def geometric_mean(values: Iterable[float]) -> float:
    """Geometric mean of positive numbers; times a power of two where they all are, to the last bit."""
    every = np.array(list(values), float)
    if (every == every[0]).all():
        return float(every[0])
    mantissas, exponents = np.frexp(every)
    whole, rest = divmod(int(exponents.sum()), len(every))
    return float(np.ldexp(np.exp(np.log(mantissas).mean() + np.log(2.0) * rest / len(every)), whole))


def mean_of_finite(values: Floats) -> Floats:
    """Mean over the first axis of the values that are finite; NaN where none is."""
    good = np.isfinite(values)
    return np.where(good, values, 0.0).sum(0) / np.where(good.any(0), good.sum(0), np.nan)


def root_mean_square(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))

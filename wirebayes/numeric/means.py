"""Means of numbers that have no scale."""

from collections.abc import Iterable

import numpy as np


def geometric_mean(values: Iterable[float]) -> float:
    """Geometric mean of positive numbers; times a power of two where they all are, to the last bit."""
    every = np.array(list(values), float)
    if (every == every[0]).all():
        return float(every[0])
    mantissas, exponents = np.frexp(every)
    whole, rest = divmod(int(exponents.sum()), len(every))
    return float(np.ldexp(np.exp(np.log(mantissas).mean() + np.log(2.0) * rest / len(every)), whole))

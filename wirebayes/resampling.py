"""Draws from weighted ones, and how far weights may go before too few draws have them all."""

import numpy as np
from numpy.typing import NDArray

from wirebayes.typing import Array


def systematic_rows(weight: Array, n: int, rng: np.random.Generator) -> NDArray[np.intp]:
    """Rows drawn in proportion to their weights by systematic resampling, in their order.

    Parameters
    ----------
    weight : (m,) array
        Not negative; need not sum to one.
    n : int
        Number of draws.
    rng : numpy.random.Generator

    Returns
    -------
    (n,) int array

    References
    ----------
    J. Carpenter, P. Clifford and P. Fearnhead, Improved particle filter for nonlinear problems, IEE Proceedings -
    Radar, Sonar and Navigation 146(1), 1999.
    """
    shares = np.cumsum(weight)
    return np.minimum(np.searchsorted(shares / shares[-1], (np.arange(n) + rng.uniform()) / n), len(weight) - 1)


def truncated_rows(log_weight: Array, n: int, rng: np.random.Generator) -> NDArray[np.intp]:
    """Rows drawn in proportion to their weights, none of which counts for more than the root of all rows.

    Parameters
    ----------
    log_weight : (m,) array
        -inf for a row without weight.
    n : int
        Number of draws.
    rng : numpy.random.Generator

    Returns
    -------
    (n,) int array
        In random order.

    References
    ----------
    E. L. Ionides, Truncated importance sampling, J. Comput. Graph. Stat. 17(2), 2008: the bound is the mean weight
    times the root of all rows.
    """
    weight = np.exp(log_weight - log_weight.max())
    weight = np.minimum(weight, np.sqrt(len(weight)) * weight.mean())
    return rng.permutation(systematic_rows(weight, n, rng))


def next_power(log_weight: Array, most: float, share: float) -> float:
    """The largest power of the weights, at most `most`, that leaves a share of the rows effective.

    The step of an annealing: it may be next to nothing, but never is nothing.

    Parameters
    ----------
    log_weight : (n,) array
        -inf for a row without weight.
    most : float
        Positive.
    share : float
        Between 0 and 1: of the rows' effective number, (sum w)² / sum w².

    Returns
    -------
    float
    """

    def effective(power: float) -> float:
        weight = np.exp(power * (log_weight - log_weight.max()))
        return float(weight.sum() ** 2 / (weight**2).sum())

    if effective(most) >= share * len(log_weight):
        return most
    low, high = _LEAST, float(np.log(most))
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if effective(np.exp(middle)) > share * len(log_weight) else (low, middle)
    return float(np.exp(low))


_LEAST = -40.0  # logarithm of the smallest power
_HALVINGS = 40  # of the logarithm: to some 1e-10 of the power

"""Draws from weighted ones, and how far weights may go before too few draws have them all."""

import numpy as np
from numpy.random import Generator

from wirebayes.numeric.typing import Array, Indices


def systematic_rows(weight: Array, n: int, rng: Generator) -> Indices:
    """Rows drawn in proportion to their weights by systematic resampling, in their order.

    Parameters
    ----------
    weight : (m,) array
        Not negative; need not sum to one.
    n : int
        Number of draws.

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


def truncated_rows(log_weight: Array, n: int, rng: Generator) -> Indices:
    """Rows drawn in proportion to their weights, none of which counts for more than the root of all rows.

    Parameters
    ----------
    log_weight : (m,) array
        -inf for a row without weight.
    n : int
        Number of draws.

    Returns
    -------
    (n,) int array
        In random order.
    """
    return rng.permutation(systematic_rows(truncated(log_weight), n, rng))


def truncated(log_weight: Array) -> Array:
    """(m,) weights, none of which counts for more than the root of all rows.

    Parameters
    ----------
    log_weight : (m,) array
        -inf for a row without weight.

    References
    ----------
    E. L. Ionides, Truncated importance sampling, J. Comput. Graph. Stat. 17(2), 2008: the bound is the mean weight
    times the root of all rows.
    """
    weight = np.exp(log_weight - log_weight.max())
    return np.minimum(weight, np.sqrt(len(weight)) * weight.mean())


def effective_number(weight: Array) -> float:
    """How many equal weights would know as much as these (m,): (sum w)² / sum w²."""
    return float(weight.sum() ** 2 / (weight**2).sum())


def thinned(weight: Array, n: int, rng: Generator) -> tuple[Indices, Array]:
    """At most n rows and new weights, which are the old ones on average.

    Rows above a threshold stay as they are. The others are drawn in proportion to their weights and count as much as
    the threshold: of all ways to keep n different rows, this one changes weights the least.

    Parameters
    ----------
    weight : (m,) array
        Positive.
    n : int
        Positive.

    Returns
    -------
    rows : (k,) int array
        All rows where there are no more than n.
    weight : (k,) array

    References
    ----------
    P. Fearnhead and P. Clifford, On-line inference for hidden Markov models via particle filters, J. R. Stat. Soc. B
    65(4), 2003.
    """
    if len(weight) <= n:
        return np.arange(len(weight)), weight
    order = np.argsort(-weight, kind="stable")
    falling = weight[order]
    of_lighter = np.cumsum(falling[::-1])[::-1]  # each row's own weight included
    still_to_keep = n - np.arange(n)
    is_drawn = falling[:n] * still_to_keep <= of_lighter[:n]
    kept = int(np.argmax(is_drawn))  # the first row that no longer stays as it is
    drawn = kept + np.unique(systematic_rows(falling[kept:], n - kept, rng))
    threshold = of_lighter[kept] / (n - kept)
    rows = order[np.append(np.arange(kept), drawn)]
    return rows, np.append(falling[:kept], np.full(len(drawn), threshold))


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
    """
    relative = log_weight - log_weight.max()
    enough = share * len(log_weight)
    if effective_number(np.exp(most * relative)) >= enough:
        return most
    low, high = _LEAST, float(np.log(most))
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if effective_number(np.exp(np.exp(middle) * relative)) > enough:
            low = middle
        else:
            high = middle
    return float(np.exp(low))


_LEAST = -40.0  # logarithm of the smallest power
_HALVINGS = 40  # of the logarithm: to some 1e-10 of the power

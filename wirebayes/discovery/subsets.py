"""Evidence of something that may be present in any of several materials: every number of them, and each choice, alike.

The proportion of materials that have it is unknown and uniform, so the materials support each other: if most show it,
it is expected in the next.
"""

import numpy as np
from scipy.special import gammaln

from wirebayes.numeric.typing import Array


def over_subsets(values: Array) -> tuple[float, Array, list[int]]:
    """Sum over all non-empty subsets of materials.

    Parameters
    ----------
    values : (b,) array
        Log Bayes factor of each material on its own.

    Returns
    -------
    The log Bayes factor against none of them, the probability (b,) that each belongs to the subset, and the most
    probable subset.
    """
    values = np.asarray(values, float)
    b = len(values)
    weights = _log_weights(b)
    by_size = weights + _symmetric(values)[1:]
    total = float(np.logaddexp.reduce(by_size))
    without = np.array([_symmetric(np.delete(values, i))[:b] for i in range(b)])  # of 0 to b - 1 others
    each = np.zeros(b)
    if np.isfinite(total):
        beside = np.logaddexp.reduce(weights + without, axis=1)
        each = np.exp(values + beside - total)
    return total, np.minimum(each, 1.0), _most_probable(values, weights)


def _most_probable(values: Array, weights: Array) -> list[int]:
    """The most probable subset, by the log prior (b,) of one of each size."""
    order = np.argsort(-values, kind="stable")
    highest = weights + np.cumsum(values[order])
    size = int(np.argmax(highest)) + 1
    return sorted(order[:size].tolist())


def _log_weights(b: int) -> Array:
    """(b,) log prior probability of one subset of each size from 1 to b."""
    n = np.arange(1, b + 1)
    return -np.log(b) - (gammaln(b + 1) - gammaln(n + 1) - gammaln(b - n + 1))


def _symmetric(values: Array) -> Array:
    """(b + 1,) log of the sum over subsets of each size of the product of the exponentials of `values` (b,)."""
    out = np.full(len(values) + 1, -np.inf)
    out[0] = 0.0
    for i, value in enumerate(values):
        out[1 : i + 2] = np.logaddexp(out[1 : i + 2], out[: i + 1] + value)
    return out

"""Rows of an array that lie far from one another."""

import numpy as np

from wirebayes.numeric.typing import Array


def spread_rows(x: Array, k: int, rng: np.random.Generator, weight: Array | None = None) -> list[int]:
    """Rows far from one another, for a start (k-means++).

    Parameters
    ----------
    x : (n, d) array
    k : int
        How many rows.
    weight : (n,) array, optional
        Of the rows, summing to one.

    Returns
    -------
    list of int
        Fewer than `k` where there are not so many different points.
    """
    share = np.full(len(x), 1.0 / len(x)) if weight is None else weight
    chosen = [int(rng.choice(len(x), p=share))]
    nearest = ((x - x[chosen[0]]) ** 2).sum(axis=1)
    while len(chosen) < k and nearest.any():
        chosen.append(int(rng.choice(len(x), p=share * nearest / (share @ nearest))))
        nearest = np.minimum(nearest, ((x - x[chosen[-1]]) ** 2).sum(axis=1))
    return chosen


def spread_in_widths(x: Array, k: int, rng: np.random.Generator) -> list[int]:
    """Rows far from one another, each column counted in its standard deviation.

    Parameters
    ----------
    x : (n, d) array
    k : int
        How many rows.
    rng : numpy Generator

    Returns
    -------
    list of int
        As of `spread_rows`.
    """
    width = x.std(axis=0)
    return spread_rows(x / np.where(width > 0, width, 1.0), k, rng)

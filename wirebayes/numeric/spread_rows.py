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
    n = len(x)
    share = np.full(n, 1.0 / n) if weight is None else weight
    newest = int(rng.choice(n, p=share))
    chosen = [newest]
    nearest = ((x - x[newest]) ** 2).sum(axis=1)
    while len(chosen) < k and nearest.any():
        by_distance = share * nearest / (share @ nearest)
        newest = int(rng.choice(n, p=by_distance))
        chosen.append(newest)
        nearest = np.minimum(nearest, ((x - x[newest]) ** 2).sum(axis=1))
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

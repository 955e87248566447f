"""Many small symmetric systems at once: Cholesky written over the batch, which numpy does fast."""

import numpy as np
from numpy.typing import NDArray

from wirebayes.typing import Floats


def solve(H: list[list[Floats]], right: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """Solve ``H x = right`` for symmetric matrices given entry by entry.

    Parameters
    ----------
    H : nested list of (n,) arrays
        Only the upper triangle is read.
    right : (d, n) array

    Returns
    -------
    x : (d, n) array
        Meaningless where the matrix is not positive definite.
    positive : (n,) bool array
        True where every pivot is positive, that is, where the equilibrium would be stable.
    """
    d, n = right.shape
    L: list[list[Floats]] = [[np.empty(0)] * d for _ in range(d)]
    positive = np.ones(n, bool)
    y = np.empty_like(right)
    inverse = []
    for j in range(d):
        pivot = H[j][j]
        for k in range(j):
            pivot = pivot - L[j][k] * L[j][k]
        # A pivot lost to rounding counts as zero: the platform is free to move that way.
        good = pivot > 1e-12 * np.abs(H[j][j])
        positive &= good
        inv = 1.0 / np.sqrt(np.where(good, pivot, 1.0))
        inverse.append(inv)
        for i in range(j + 1, d):
            value = H[j][i]
            for k in range(j):
                value = value - L[i][k] * L[j][k]
            L[i][j] = value * inv
        total = right[j]
        for k in range(j):
            total = total - L[j][k] * y[k]
        y[j] = total * inv
    x = np.empty_like(right)
    for j in reversed(range(d)):
        total = y[j]
        for k in range(j + 1, d):
            total = total - L[k][j] * x[k]
        x[j] = total * inverse[j]
    return x, positive

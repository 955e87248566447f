"""Many small symmetric systems at once: Cholesky written over the batch, which numpy does fast."""

import numpy as np

from wirebayes.numeric.typing import Bools, Floats


def solve_symmetric(H: Floats, right: Floats) -> tuple[Floats, Bools]:
    """Solve ``H x = right`` for symmetric matrices.

    Parameters
    ----------
    H : (d, d, n) array
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
    # A row and what it has on the right; of the rows below, what is left once the rows above are taken out.
    left = np.concatenate([H, right[:, None]], 1)
    diagonal = H[range(d), range(d)]
    floor = 1e-12 * np.abs(diagonal)  # a pivot lost to rounding counts as zero: free to move that way
    positive = np.ones(n, bool)
    inverse = np.empty((d, n))
    for j in range(d):
        pivot = left[j, j]
        good = pivot > floor[j]
        positive &= good
        inverse[j] = 1.0 / np.sqrt(np.where(good, pivot, 1.0))
        row = left[j, j + 1 :]
        row *= inverse[j]
        below = left[j + 1 :, j + 1 :]
        below -= row[:-1, None] * row
    x = left[:, d]
    for j in reversed(range(d)):
        x[j] *= inverse[j]
        x[:j] -= left[:j, j] * x[j]
    return x, positive

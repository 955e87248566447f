"""Draws from weighted ones."""

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

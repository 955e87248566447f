"""Fewer readings of a hold: relaxation is fast at first, so they are spaced evenly in the logarithm of time."""

import numpy as np
from numpy.typing import NDArray

MOST = 60  # readings of a hold that are all kept: nobody writes down more by hand
KEPT = 30  # of longer ones: ten or more a decade of time, and a fit of twelve such holds takes a minute


def thinned(time_s: NDArray[np.float64]) -> NDArray[np.int64]:
    """Which readings of a hold are kept.

    Parameters
    ----------
    time_s : (r,) array
        Since the hold began, rising.

    Returns
    -------
    (k,) array of int
        All where there are `MOST` or fewer; else at most `KEPT`, the first and the last among them.
    """
    count = len(time_s)
    if count <= MOST:
        return np.arange(count)
    since = time_s - time_s[0]
    targets = np.concatenate([[0.0], np.geomspace(since[1], since[-1], KEPT - 1)])
    after = np.searchsorted(since, targets).clip(1, count - 1)
    nearest = np.where(targets - since[after - 1] < since[after] - targets, after - 1, after)
    return np.unique(np.concatenate([nearest, [count - 1]]))

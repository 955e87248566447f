"""Fewer readings of a hold: relaxation is fast at first, so they are spaced evenly in the logarithm of time."""

import numpy as np

from wirebayes.numeric.typing import Floats, Ints

MOST = 60  # readings of a hold that are all kept: nobody writes down more by hand
KEPT = MOST  # of longer ones: twenty or so a decade of time


def kept_readings(time_s: Floats) -> Ints:
    """Which readings of a hold are kept.

    Parameters
    ----------
    time_s : (r,) array
        Since the hold began, rising from 0 or later.

    Returns
    -------
    (k,) array of int
        All where there are `MOST` or fewer; else at most `KEPT`, the first and the last among them.
    """
    count = len(time_s)
    if count <= MOST:
        return np.arange(count)
    begin = time_s[0] if time_s[0] > 0 else time_s[1]
    targets = np.concatenate([time_s[:1], np.geomspace(begin, time_s[-1], KEPT - 1)])
    after = np.searchsorted(time_s, targets).clip(1, count - 1)
    nearest = np.where(targets - time_s[after - 1] < time_s[after] - targets, after - 1, after)
    return np.unique(np.concatenate([nearest, [count - 1]]))

"""Holds that go on long after their last readings, as rests do of which nothing was written down."""

import numpy as np

from wirebayes.numeric.typing import Floats

UNREAD, LONGER = 0.5, 1.5  # of the time that was read, and times its longest pause: beyond, it may be a rest


def unread_s(time_s: Floats, end_s: float) -> float:
    """For how long a hold goes on unread, where that is longer than its readings explain; else 0.

    Parameters
    ----------
    time_s : (r,) array
        Times of its readings, since it began.
    end_s : float
        When it ended.
    """
    after = end_s - float(time_s[-1])
    usual = max(UNREAD * float(time_s[-1]), LONGER * float(np.diff(time_s).max(initial=0.0)))
    return after if after > usual else 0.0

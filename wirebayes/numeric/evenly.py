"""Some of many, evenly spread."""

import numpy as np

from wirebayes.numeric.typing import Indices


def evenly(count: int, most: int) -> Indices:
    """At most so many of `count` indices, evenly from the first to the last."""
    return np.unique(np.linspace(0, count - 1, most).round().astype(np.intp))

"""Some of many, evenly spread."""

import numpy as np
from numpy.typing import NDArray


def evenly(count: int, most: int) -> NDArray[np.intp]:
    """At most so many of `count` indices, evenly from the first to the last."""
    return np.unique(np.linspace(0, count - 1, most).round().astype(np.intp))

"""By how much the readings shrank the 90 % interval of a quantity, relative to the prior's."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
LEAST_CONTRACTION = 2.0 / 3.0  # a parameter counts as determined when its interval has less than a third of its width


def interval(values: Array) -> tuple[float, float, float]:
    """5 %, 50 % and 95 % quantile."""
    low, middle, high = np.quantile(values, [0.05, 0.5, 0.95])
    return float(low), float(middle), float(high)


def contraction(posterior: Array, prior: Array) -> float:
    """Share by which the width of the 90 % interval shrank: on a logarithmic scale for a positive quantity.

    Parameters
    ----------
    posterior, prior : (n,) and (m,) arrays
        Draws.
    """
    after, before = interval(posterior), interval(prior)
    if min(posterior.min(), prior.min()) > 0:
        return 1.0 - float(np.log(after[2] / after[0]) / np.log(before[2] / before[0]))
    return 1.0 - (after[2] - after[0]) / (before[2] - before[0])

"""How much the readings taught about a quantity: posterior contraction, and the words for it."""

from typing import Literal

import numpy as np

from wirebayes.numeric.typing import Array

Source = Literal["prior", "data and prior", "data"]
LEAST = 0.3  # below it the prior determines a quantity
MOST = 0.9  # from here on, a 90 % range of a third, the data do


def interval(values: Array) -> tuple[float, float, float]:
    """5 %, 50 % and 95 % quantile."""
    low, middle, high = np.quantile(values, [0.05, 0.5, 0.95])
    return float(low), float(middle), float(high)


def contraction(posterior: Array, prior: Array) -> float:
    """Posterior contraction: 1 - posterior variance / prior variance, of the logarithm for a positive quantity.

    Parameters
    ----------
    posterior, prior : (n,) and (m,) arrays
        Draws.

    Returns
    -------
    float
        1 where the readings determine the quantity, 0 where they say nothing of it, less where they widen it.

    References
    ----------
    M. Betancourt, Towards a principled Bayesian workflow (2020).
    """
    after = np.asarray(posterior, float)
    before = np.asarray(prior, float)
    if min(after.min(), before.min()) > 0:
        after = np.log(after)
        before = np.log(before)
    return float(1.0 - after.var(ddof=1) / before.var(ddof=1))


def source(value: float) -> Source:
    """What determines a quantity that has contracted so much."""
    if value < LEAST:
        return "prior"
    return "data and prior" if value < MOST else "data"

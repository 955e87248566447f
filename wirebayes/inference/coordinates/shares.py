"""Coordinates of an amount that adds to another one, where the data know their sum: the logarithm of the sum, a score
of the share.

A fixture gives way in series with the wire, and the readings see the compliance of both. A wire that creeps in two ways
shows what both lose together. In the amounts themselves such a posterior is a thin curve, bent where either takes all.
The score is standard normal for a share that is uniform between nothing and all, and no sum and score lie outside the
prior.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import log_ndtr, ndtri_exp

from wirebayes.numeric.typing import Array, Floats
from wirebayes.wire.effect import Effect, HoldContext

_LEAST = np.log(1e-9)  # share of an amount of nothing, whose score would be infinite
_NORMAL = 0.5 * np.log(2.0 * np.pi)  # of the normal density


@dataclass(frozen=True)
class Elongation:
    """What an effect adds to the creep, in proportion to its amplitude.

    Attributes
    ----------
    column : int
        Of the amplitude.
    effect : Effect
    others : mapping of short name to int or float
        Columns of the effect's other amplitudes, or the numbers at which they are fixed.
    holds : tuple of HoldContext
        With the tensions as measured, each at its end.
    kept : float
        Share of the elongation that is carried from hold to hold, 0 or 1.
    """

    column: int
    effect: Effect
    others: Mapping[str, int | float]
    holds: tuple[HoldContext, ...]
    kept: float

    def log_gained(self, theta: Array) -> Array:
        """(n,) log root mean square of the elongation gained in a hold, mm, for an amplitude of one.

        Parameters
        ----------
        theta : (n, d) array
            Natural parameters.
        """
        n = len(theta)
        own: dict[str, Floats] = {self.effect.amplitudes[0].name: np.ones(n)}
        for name, x in self.others.items():
            own[name] = theta[:, x] if isinstance(x, int) else np.full(n, x)
        carried = np.zeros((1, n))
        square = np.zeros(n)
        for hold in self.holds:
            begin = self.kept * carried
            end = self.effect.apply(begin, own, hold.carrying(carried))
            gained = (end - begin)[0]
            square = square + gained**2
            carried = end
        mean_square = square / len(self.holds)
        return 0.5 * np.log(np.maximum(mean_square, 1e-300))


def score(log_amount: Array, log_other: Array) -> Array:
    """(n,) scores of an amount's share in its sum with another.

    Parameters
    ----------
    log_amount, log_other : (n,) arrays
    """
    total = np.logaddexp(log_amount, log_other)
    share = np.maximum(log_amount - total, _LEAST)
    rest = np.maximum(log_other - total, _LEAST)
    low = ndtri_exp(np.minimum(share, np.log(0.5)))
    high = ndtri_exp(np.minimum(rest, np.log(0.5)))
    return np.where(share < rest, low, -high)  # the smaller share keeps its digits


def log_shares(scores: Array) -> tuple[Array, Array]:
    """(n,) logarithms of an amount's share, and of the rest, by its scores."""
    return log_ndtr(scores), log_ndtr(-scores)


def log_slope(amount: Array, scores: Array) -> Array:
    """(n,) log determinant from log sum and score to log other and amount.

    Parameters
    ----------
    amount, scores : (n,) arrays
    """
    share, rest = log_shares(scores)
    return np.log(amount) - share - rest - 0.5 * scores * scores - _NORMAL

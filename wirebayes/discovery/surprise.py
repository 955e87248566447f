"""How surprising a log Bayes factor is, given those of simulations without any effect."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from wirebayes.discovery.settings import ABOVE_COUNT, ONE_NAT, UPPER
from wirebayes.numeric.typing import Array

AGAINST = -2.0  # nats; names that hardly show have nearly the same value in all simulations, below this


def empirical_surprise(value: Any, chance: Array) -> Any:
    """Minus the log share of simulated values (n,) as large; beyond the largest it goes on by the distance."""
    larger = len(chance) - np.searchsorted(np.sort(chance), value)
    return np.log1p(len(chance)) - np.log1p(larger) + np.maximum(value - chance.max(), 0.0)


@dataclass(frozen=True)
class Scale:
    """How surprising a log Bayes factor of one name is: minus the log share of simulations as large.

    It is exceeded by chance about exponentially seldom. Counting the few simulations that exceed it would make the
    surprise, and with it p, as uncertain as a number of five; a line through the upper values is not. Where a tail is
    longer than exponential the line would lead far beyond what was counted: there the count decides.

    Attributes
    ----------
    high : float
        What a share `UPPER` of simulated values exceed.
    fall : float
        Nats by which the value grows while that share falls to 1/e of it.
    chance : (n,) array
        The simulated values.
    """

    high: float
    fall: float
    chance: Array

    @staticmethod
    def of(chance: Array) -> "Scale":
        """The scale of simulated values; where there are few, the fall is nearly one nat, as for many readings."""
        high = float(np.quantile(chance, 1.0 - UPPER))
        beyond = chance[chance > high] - high
        fall = (beyond.sum() + ONE_NAT) / (len(beyond) + ONE_NAT)
        return Scale(high, float(fall), chance)

    def surprise(self, value: Any) -> Any:
        """How surprising a value is, or each value of an array; not at all where the evidence is against the name."""
        along = np.maximum((value - self.high) / self.fall - np.log(UPPER), 0.0)
        most = empirical_surprise(value, self.chance) + ABOVE_COUNT
        return np.where(np.greater(value, AGAINST), np.minimum(along, most), 0.0)

    def value(self, surprise: float) -> float:
        """The least value that is so surprising."""
        along = self.high + self.fall * float(surprise + np.log(UPPER))
        beyond = surprise - ABOVE_COUNT - float(np.log1p(len(self.chance)))  # the largest simulated value
        if beyond > 0:
            least = self.chance.max() + beyond
        else:
            share = min(1.0, np.exp(ABOVE_COUNT - surprise))
            least = np.quantile(self.chance, 1.0 - share)
        return max(along, float(least))

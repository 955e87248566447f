"""Weighted points that a proposal is learned from, whose weights sum to what they are worth.

Draws of one density stand for another by their weights. Weights are kept instead of resampled: points that were drawn
again and again would cost as much as different ones and teach nothing. A sum of weights is the effective number of
points, so sets of different quality may be put together as they are.
"""

from dataclasses import dataclass, replace

import numpy as np

from wirebayes.numeric.resampling import thinned, truncated
from wirebayes.numeric.typing import Array


@dataclass(frozen=True)
class WeightedPoints:
    """Distinct points (n, d) and their weights (n,)."""

    z: Array
    weight: Array

    @staticmethod
    def weighted(z: Array, log_weight: Array) -> "WeightedPoints":
        """The points by their weights, none of which counts for more than the root of all rows.

        Parameters
        ----------
        z : (n, d) array
            Rows that repeat become one. They are known by their first column: draws do not agree there by chance.
        log_weight : (n,) array
            -inf for a row without weight; not all of them.
        """
        _, first, number = np.unique(z[:, 0], return_index=True, return_inverse=True)
        weight = np.bincount(number, truncated(log_weight), len(first))
        some = weight > 0
        return WeightedPoints(z[first[some]], weight[some]).worth(len(z))

    @staticmethod
    def equal(z: Array) -> "WeightedPoints":
        """The points (n, d) as they came: as often as they repeat."""
        return WeightedPoints.weighted(z, np.zeros(len(z)))

    @property
    def spread(self) -> Array:
        """(d,) standard deviations."""
        share = self.weight / self.weight.sum()
        return np.sqrt(share @ (self.z - share @ self.z) ** 2)

    @property
    def distinct(self) -> float:
        """How many different points there would be among as many draws of them as their weights sum to."""
        return float(np.minimum(self.weight, 1.0).sum())

    def worth(self, total: float) -> "WeightedPoints":
        """The same points, their weights summing to another number."""
        return replace(self, weight=self.weight * (total / self.weight.sum()))

    def joined(self, other: "WeightedPoints") -> "WeightedPoints":
        """Both sets as one."""
        return WeightedPoints(np.vstack([self.z, other.z]), np.append(self.weight, other.weight))

    def thinned(self, n: int, rng: np.random.Generator) -> "WeightedPoints":
        """At most n of the points, their weights raised where others had to go, by `resampling.thinned`.

        No more than `distinct` either: where a point stands for less than a draw, it goes or counts as one.

        Parameters
        ----------
        rng : numpy Generator
        """
        rows, weight = thinned(self.weight, min(n, int(np.ceil(self.distinct))), rng)
        return WeightedPoints(self.z[rows], weight)

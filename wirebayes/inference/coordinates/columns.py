"""Each parameter by itself: what it is measured in before the parameters are straightened together."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from wirebayes.inference.coordinates.edges import Edge, edge
from wirebayes.model.problem import Problem
from wirebayes.numeric.any_distribution import finite_spread
from wirebayes.numeric.distributions import ONE_SD, LogitNormal
from wirebayes.numeric.typing import Array, Bools, Ints


@dataclass(frozen=True)
class ColumnMap:
    """The map of the columns of ``(n, d)`` parameters, one by one.

    Attributes
    ----------
    positive : (d,) array of bool
        Sampled by their logarithms.
    most : (d,) array
        The largest value of what is sampled by its log odds of that; infinite for the others.
    edges : mapping of column to Edge
        Parameters whose prior ends at an edge.
    scale : (d,) array
        Units of the others, a standard deviation of their prior; 1 for the former.
    log_spread : (d,) array
        Standard deviations of the logarithms under the prior; 1 for what is no logarithm.
    """

    positive: Bools
    most: Array
    edges: dict[int, Edge]
    scale: Array
    log_spread: Array

    @cached_property
    def _logarithmic(self) -> tuple[Ints, Array]:
        """Numbers of the positive columns, and the largest value of each."""
        return np.flatnonzero(self.positive), self.most[self.positive]

    def is_linear(self, column: int) -> bool:
        """Whether a parameter is only divided by its scale."""
        return not self.positive[column] and column not in self.edges

    def logarithms(self, theta: Array) -> Array:
        """(n, k) logarithms of the positive parameters, of those with a largest value the log odds of reaching it."""
        columns, most = self._logarithmic
        return _log_odds(theta[:, columns], most)

    def coordinate(self, theta: Array, column: int) -> Array:
        """(n,) coordinate of a parameter that is not sampled by its logarithm."""
        value = theta[:, column]
        if column in self.edges:
            return self.edges[column].score(value)
        return value / self.scale[column]

    def middle(self, median: float, column: int) -> float:
        """The coordinate of a column's median under its prior."""
        if self.positive[column]:
            return float(_log_odds(median, self.most[column]))
        return 0.0 if column in self.edges else median / float(self.scale[column])

    def to_sampled(self, theta: Array) -> Array:
        """(n, d) coordinates of natural parameters (n, d)."""
        z = theta / self.scale
        z[:, self.positive] = self.logarithms(theta)
        for i, at in self.edges.items():
            z[:, i] = at.score(theta[:, i])
        return z

    def to_natural(self, z: Array) -> Array:
        """(n, d) natural parameters of coordinates (n, d)."""
        theta = z * self.scale
        columns, most = self._logarithmic
        odds = np.exp(z[:, columns])
        theta[:, columns] = odds / (1.0 + odds / most)
        for i, at in self.edges.items():
            theta[:, i] = at.value(z[:, i])
        return theta


def columns_of(problem: Problem) -> ColumnMap:
    """How each parameter of a problem is measured."""
    logarithmic = problem.prior.logarithmic
    positive = np.array([name in logarithmic for name in problem.names], dtype=bool)
    d = len(positive)
    most = np.full(d, np.inf)
    scale = np.ones(d)
    log_spread = np.ones(d)
    edges: dict[int, Edge] = {}
    for i, distribution in enumerate(problem.prior.distributions.values()):
        if isinstance(distribution, LogitNormal):
            most[i] = distribution.most
        if positive[i]:
            log_spread[i] = _log_spread(distribution, most[i])
            continue
        at = edge(distribution)
        if at is not None:
            edges[i] = at
        else:
            scale[i] = _spread(distribution)
    return ColumnMap(positive, most, edges, scale, log_spread)


def _log_odds(value: Any, most: Any) -> Any:
    """``log(value / (1 - value / most))``: the logarithm of values far below the most."""
    with np.errstate(all="ignore"):  # what cannot be has no coordinate
        return np.log(value) - np.log1p(-value / most)


def _spread(distribution: Any) -> float:
    spread = finite_spread(distribution)
    return spread if np.isfinite(spread) and spread > 0 else 1.0


def _log_spread(distribution: Any, most: float) -> float:
    low, high = distribution.ppf(ONE_SD)
    return float(0.5 * (_log_odds(high, most) - _log_odds(low, most)))

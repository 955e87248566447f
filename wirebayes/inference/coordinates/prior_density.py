"""The prior density of the sampled coordinates: under the prior nearly every one of them is normal."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from wirebayes.inference.coordinates.columns import ColumnMap
from wirebayes.model.prior import Prior
from wirebayes.numeric.any_distribution import log_density_of, ours
from wirebayes.numeric.distributions import LogitNormal, LogNormal, Normal
from wirebayes.numeric.typing import Array, Function, Ints

_HALF_LOG_2PI = 0.5 * float(np.log(2.0 * np.pi))


@dataclass(frozen=True)
class PriorDensity:
    """The log prior density of parameters that are each mapped by itself, in the coordinates of that map.

    Attributes
    ----------
    normal : (k,) array of int
        Columns whose coordinate is normal under the prior.
    middle : (k, 1) array
        Their means, in standard deviations.
    log_constant : float
        What the logarithms of their densities have in common.
    others : sequence of functions
        Of (n, d) parameters: the log densities (n,) of the other columns, one each.
    """

    normal: Ints
    middle: Array
    log_constant: float
    others: Sequence[Function]

    @classmethod
    def of(cls, prior: Prior, columns: ColumnMap, replaced: Collection[int]) -> "PriorDensity":
        """The density under a prior.

        Parameters
        ----------
        prior : Prior
        columns : ColumnMap
        replaced : collection of int
            Columns with an edge whose coordinate is another one: their density is that of the parameter itself.
        """
        normal = []
        middle = []
        log_constant = 0.0
        others = []
        for i, (name, distribution) in enumerate(prior.distributions.items()):
            if i not in replaced and _is_normal(name, ours(distribution), prior, columns, i):
                spread = columns.log_spread[i]
                normal.append(i)
                middle.append(columns.middle(distribution.median(), i) / spread)
                log_constant -= _HALF_LOG_2PI + float(np.log(spread))
            else:
                others.append(_own_density(name, distribution, prior, columns, i))
        return cls(np.array(normal, np.intp), np.array(middle)[:, None], log_constant, others)

    def __call__(self, theta: Array, residuals: Array) -> Array:
        """(n,) log densities at parameters (n, d), with their distances (d, n) as `Transformation.prior_residuals`."""
        off = residuals[self.normal] - self.middle
        total = self.log_constant - 0.5 * np.einsum("kn,kn->n", off, off)
        for log_density in self.others:
            total = total + log_density(theta)
        return total


def _is_normal(name: str, distribution: Any, prior: Prior, columns: ColumnMap, i: int) -> bool:
    """Whether the coordinate of a column is normal under its prior."""
    if columns.positive[i]:
        return isinstance(distribution, LogNormal | LogitNormal)
    if i in columns.edges:
        return True
    return isinstance(distribution, Normal) and name not in prior.powers


def _own_density(name: str, distribution: Any, prior: Prior, columns: ColumnMap, i: int) -> Function:
    """The log density of a column whose coordinate is not normal under its prior."""
    log_pdf = log_density_of(distribution)
    log_scale = float(np.log(columns.scale[i]))

    def log_density(theta: Array) -> Array:
        value = theta[:, i]
        log_factor = prior.log_factor(name, theta)
        log_slope = np.log(value) if columns.positive[i] else log_scale
        return log_pdf(value * np.exp(log_factor)) + log_factor + log_slope

    return log_density

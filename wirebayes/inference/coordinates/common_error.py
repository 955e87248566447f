"""What the errors of several weights have in common, which readings hardly tell.

They tell the errors apart from each other. Of what all have in common their expected sizes decide: measured in its
standard deviation by these, it has the same width whatever they are.
"""

from dataclasses import dataclass

import numpy as np

from wirebayes.model.problem import Problem
from wirebayes.numeric.typing import Array


@dataclass(frozen=True)
class CommonError:
    """Coordinates (m, n) of m errors: their mean in its standard deviations; distances of the others from the first.

    Attributes
    ----------
    setting : list of int
        Columns of the standard deviations of weights.
    weights : (m, 1) array
        To which errors are relative, in the unit of these.
    """

    setting: list[int]
    weights: Array

    def coordinates(self, errors: Array, theta: Array) -> Array:
        """Coordinates of errors (m, n) beside natural parameters (n, d)."""
        precision = self._precision(theta)
        common = (precision * errors).sum(axis=0) / np.sqrt(precision.sum(axis=0))
        return np.concatenate([common[None], errors[1:] - errors[0]])

    def errors(self, coordinates: Array, theta: Array) -> Array:
        """Errors of coordinates (m, n) beside natural parameters (n, d)."""
        precision = self._precision(theta)
        apart = coordinates[1:]
        total = precision.sum(axis=0)
        first = (coordinates[0] * np.sqrt(total) - (precision[1:] * apart).sum(axis=0)) / total
        return np.concatenate([first[None], first + apart])

    def log_slope(self, theta: Array) -> Array:
        """(n,) log |d errors / d coordinates|."""
        return -0.5 * np.log(self._precision(theta).sum(axis=0))

    def _precision(self, theta: Array) -> Array:
        """(m, n) expected, one over the variance of each error."""
        return (self.weights / theta[:, self.setting].T) ** 2


def common_error(problem: Problem) -> CommonError | None:
    """The coordinates for a problem of samples of one weight each; None where there is one, or where errors are known.

    Parameters
    ----------
    problem : Problem
    """
    setting = [problem.place("setting_sd", sample) for sample in problem.samples]
    columns = [place for place in setting if isinstance(place, int)]
    if len(columns) == 1 or len(columns) < len(setting):
        return None
    weights = [sample.protocol.setting[sample.protocol.recorded][-1] for sample in problem.samples]
    return CommonError(columns, np.array(weights)[:, None])

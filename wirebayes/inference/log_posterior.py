"""The density that is sampled: of the coordinates of a transformation."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from wirebayes.inference.coordinates.transform import Transformation
from wirebayes.model.problem import Problem
from wirebayes.numeric.typing import Array

# of points (m, d) and row numbers (m,): log densities (m,), and the same with their residuals (k, m)
Density = Callable[[Array, Array], Array]
Residuals = Callable[[Array, Array], tuple[Array, Array]]
_NUMBERS, _LEAST_ROWS = 100_000, 64  # readings times rows at once: what stays in the cache


class LogPosterior:
    """The log posterior density in the sampled coordinates, batched, counting its evaluations."""

    def __init__(self, problem: Problem) -> None:
        self.problem, self.coordinates = problem, Transformation(problem)
        self.evaluations = 0
        self._rows = max(_LEAST_ROWS, _NUMBERS // sum(s.protocol.mask.size for s in problem.samples))

    def __reduce__(self) -> tuple[Any, ...]:
        # what else there is has closures, which no other process can be sent
        return LogPosterior, (self.problem,)

    def __call__(self, z: Array, readings: Any = None) -> Array:
        """(n,) log density of (n, d) sampled coordinates; -inf outside the prior."""
        self.evaluations += len(z)
        if len(z) <= self._rows:
            return self._values(z, readings)
        return np.concatenate([self._values(z[p], _of_rows(readings, p)) for p in self._pieces(len(z))])

    def standardised(self, z: Array, readings: Any = None) -> tuple[Array, Array]:
        """(n,) log density, and (m, n) residuals whose derivatives J give its curvature nearly, as JᵀJ.

        Those of the likelihood (`wirebayes.model.problem.Problem.standardised`), and those of the prior.
        """
        self.evaluations += len(z)
        if len(z) <= self._rows:
            return self._standardised(z, readings)
        parts = [self._standardised(z[p], _of_rows(readings, p)) for p in self._pieces(len(z))]
        values, residuals = zip(*parts, strict=True)
        return np.concatenate(values), np.concatenate(residuals, axis=1)

    def rowwise(self, readings: Sequence[Array] | None = None) -> tuple[Density, Residuals]:
        """The density, and the same with its residuals, of points and row numbers, as a climb takes them.

        Parameters
        ----------
        readings : sequence of (H, R, n) arrays, optional
            In place of the measured ones, a sample each: row r sees the r-th of n.
        """
        return (
            lambda points, rows: self(points, _of_rows(readings, rows)),
            lambda points, rows: self.standardised(points, _of_rows(readings, rows)),
        )

    def _pieces(self, count: int) -> list[slice]:
        return [slice(i, i + self._rows) for i in range(0, count, self._rows)]

    def sampled_prior(self, theta: Array, z: Array) -> Array:
        """(n,) log prior density of (n, d) sampled coordinates, by the parameters that they stand for."""
        residuals = self.coordinates.prior_residuals(theta, z)
        return self.coordinates.log_prior(theta, z, residuals)

    def _standardised(self, z: Array, readings: Any) -> tuple[Array, Array]:
        theta = self.coordinates.to_natural(z)
        with np.errstate(all="ignore"):
            residuals = self.coordinates.prior_residuals(theta, z)
            prior = self.coordinates.log_prior(theta, z, residuals)
        value, left = self.problem.standardised(theta, readings)
        return np.where(np.isfinite(prior), prior + value, -np.inf), np.concatenate([left, residuals])

    def _values(self, z: Array, readings: Any) -> Array:
        theta = self.coordinates.to_natural(z)
        with np.errstate(all="ignore"):
            value = self.sampled_prior(theta, z)
        inside = np.isfinite(value)
        if not inside.any():
            return np.full(len(z), -np.inf)
        if inside.all():
            return value + self.problem.log_likelihood(theta, readings)
        own_readings = _of_rows(readings, inside)
        log_likelihood = self.problem.log_likelihood(theta[inside], own_readings)
        value = np.where(inside, value, -np.inf)
        value[inside] += log_likelihood
        return value


def _of_rows(readings: Sequence[Array] | None, rows: Any) -> list[Array] | None:
    """What some of the rows see in place of the measured readings."""
    return None if readings is None else [y[..., rows] for y in readings]

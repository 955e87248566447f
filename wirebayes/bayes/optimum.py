"""Modes of the posterior: batched Newton steps from many starts, and the normal approximation at each.

Every row is an optimisation of its own; rows may also have readings of their own (refits of simulated data).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wirebayes.bayes.coordinates import Target
from wirebayes.bayes.mixture import spread_rows

Array = NDArray[Any]
Density = Callable[[Array, Array], Array]
_LEAST_CURVATURE = 0.3
_POPULATION = 800
_MOVES = 2
_LENGTHS = np.array([1.0, 0.5, 0.2, 0.05, 0.01, 1e-3])


@dataclass(frozen=True)
class Optimum:
    """Where the climbs ended.

    Attributes
    ----------
    z : (n, d) array, sampled coordinates
    log_density : (n,) array
    curvature : (n, d, d) array
        Minus the Hessian, made positive definite.
    converged : (n,) bool array
        The Newton decrement fell below the tolerance.
    """

    z: Array
    log_density: Array
    curvature: Array
    converged: NDArray[np.bool_]

    @property
    def covariance(self) -> Array:
        """(n, d, d) covariance of the normal approximation."""
        eigen, vectors = np.linalg.eigh(self.curvature)
        # A ridge thinner than this against its length has no Cholesky factor in double precision.
        eigen = np.maximum(eigen, 1e-10 * eigen.max(axis=1, keepdims=True))
        half = vectors / np.sqrt(eigen)[:, None, :]
        return half @ np.swapaxes(half, 1, 2)

    @property
    def log_evidence(self) -> Array:
        """(n,) Laplace approximation of the log evidence of each mode.

        No direction counts as wider than the prior makes it (sampled coordinates are of order one under the prior).
        """
        d = self.z.shape[1]
        eigen = np.maximum(np.linalg.eigvalsh(self.curvature), _LEAST_CURVATURE)
        return np.asarray(self.log_density + 0.5 * d * np.log(2.0 * np.pi) - 0.5 * np.log(eigen).sum(axis=1))


def climb(density: Density, start: Array, *, iterations: int = 60, tolerance: float = 1e-5) -> Optimum:
    """Maximise a log density from every row of `start`.

    Parameters
    ----------
    density : function of ((m, d) points, (m,) row numbers) to (m,) values
        The row numbers say which start a point belongs to.
    start : (n, d) array
    iterations : int
    tolerance : float
        Stop a row when half its squared Newton decrement is below this.

    Returns
    -------
    Optimum
    """
    z = start.copy()
    n, d = z.shape
    value = density(z, np.arange(n))
    curvature = np.broadcast_to(np.eye(d), (n, d, d)).copy()
    step_size = np.full((n, d), 1e-3)
    done = ~np.isfinite(value)
    converged = np.zeros(n, bool)
    for _ in range(iterations):
        rows = np.flatnonzero(~done)
        if not len(rows):
            break
        gradient, hessian = _derivatives(density, z[rows], rows, value[rows], step_size[rows])
        eigen, vectors = np.linalg.eigh(-hessian)
        scale = np.maximum(np.abs(eigen).max(axis=1, keepdims=True), 1e-8)
        eigen = np.maximum(np.abs(eigen), 1e-9 * scale)
        along = np.einsum("nij,ni->nj", vectors, gradient)
        curvature[rows] = np.einsum("nij,nj,nkj->nik", vectors, eigen, vectors)
        decrement = 0.5 * (along**2 / eigen).sum(axis=1)
        step_size[rows] = np.clip(0.1 / np.sqrt(np.maximum(np.einsum("nii->ni", curvature[rows]), 1.0)), 1e-6, 0.05)
        finished = decrement < tolerance
        converged[rows[finished]] = True
        done[rows[finished]] = True
        go = ~finished
        rows, along, eigen, vectors = rows[go], along[go], eigen[go], vectors[go]
        if not len(rows):
            break
        # The direction always climbs; try several lengths at once and keep the best, no line search in Python.
        direction = np.einsum("nij,nj->ni", vectors, along / eigen)
        direction *= np.minimum(1.0, 2.0 / np.abs(direction).max(axis=1, keepdims=True))
        trial = z[rows, None] + _LENGTHS[:, None] * direction[:, None, :]
        tried = density(trial.reshape(-1, d), np.repeat(rows, len(_LENGTHS))).reshape(len(rows), -1)
        best = np.argmax(tried, axis=1)
        gained = tried[np.arange(len(rows)), best]
        better = gained > value[rows]
        z[rows[better]] = trial[np.arange(len(rows)), best][better]
        value[rows[better]] = gained[better]
        done[rows[~better]] = True
    return Optimum(z, value, curvature, converged)


def _derivatives(density: Density, z: Array, rows: Array, value: Array, h: Array) -> tuple[Array, Array]:
    """Gradient and Hessian by central differences, all points of all rows in one batch."""
    n, d = z.shape
    upper = np.triu_indices(d, 1)
    unit = np.eye(d)
    moves = np.concatenate([unit, -unit, unit[upper[0]] + unit[upper[1]], -unit[upper[0]] - unit[upper[1]]])
    points = z[:, None, :] + moves[None] * h[:, None, :]
    f = density(points.reshape(-1, d), np.repeat(rows, len(moves))).reshape(n, len(moves))
    f = np.where(np.isfinite(f), f, value[:, None] - 1e3)
    plus, minus = f[:, :d], f[:, d : 2 * d]
    gradient = (plus - minus) / (2.0 * h)
    hessian = np.zeros((n, d, d))
    hessian[:, np.arange(d), np.arange(d)] = (plus + minus - 2.0 * value[:, None]) / h**2
    m = len(upper[0])
    both, neither = f[:, 2 * d : 2 * d + m], f[:, 2 * d + m :]
    i, j = upper
    mixed = (both + neither - plus[:, i] - plus[:, j] - minus[:, i] - minus[:, j] + 2.0 * value[:, None]) / (
        2.0 * h[:, i] * h[:, j]
    )
    hessian[:, i, j] = hessian[:, j, i] = mixed
    return gradient, hessian


def modes(
    target: Target, rng: np.random.Generator, *, draws: int = 2000, starts: int = 24, extra: Array | None = None
) -> Optimum:
    """The distinct modes of a posterior, best first: good ones among many prior draws, each climbed.

    Half of the starts are the best draws, which may all lie about one mode; the others come from a population of draws
    that was cooled to the posterior and so holds every mode that had weight on the way. `extra` are further starts
    ``(m, d)`` in sampled coordinates.
    """
    z = target.coordinates.to_sampled(target.problem.prior.rvs(draws, rng))
    value = target(z)
    best = z[np.argsort(-value)[: starts // 2]]
    cooled = _cooled(target, z[:_POPULATION], value[:_POPULATION], rng)
    width = cooled.std(axis=0)
    spread = spread_rows(cooled / np.where(width > 0, width, 1.0), starts - len(best), rng)
    best = np.vstack([best, cooled[spread]])
    start = best if extra is None else np.vstack([extra, best])
    found = climb(lambda points, rows: target(points), start)
    order = np.argsort(-found.log_density)
    keep: list[int] = []
    for i in order:
        if not np.isfinite(found.log_density[i]) or found.log_density[i] < found.log_density[order[0]] - 30.0:
            continue
        apart = [(found.z[i] - found.z[k]) @ found.curvature[k] @ (found.z[i] - found.z[k]) for k in keep]
        if all(distance > 4.0 for distance in apart):
            keep.append(int(i))
    return Optimum(found.z[keep], found.log_density[keep], found.curvature[keep], found.converged[keep])


def _cooled(target: Target, z: Array, value: Array, rng: np.random.Generator) -> Array:
    """(m, d) rows from the density to a power that grows from 0 to 1: an annealed start, near enough to find modes.

    Each step of the power halves the effective number of rows and moves them by differential evolution.
    """
    m, d = z.shape
    value = np.where(np.isfinite(value), value, -1e300)
    power = 0.0
    while power < 1.0:
        step = _next_step(value, 1.0 - power)
        power += step
        weight = np.exp(step * (value - value.max()))
        kept = rng.choice(m, m, p=weight / weight.sum())
        z, value = z[kept], value[kept]
        for _ in range(_MOVES):
            one, other = rng.integers(m, size=(2, m))
            moved = z + 2.38 / np.sqrt(2.0 * d) * (z[one] - z[other]) + 1e-3 * rng.normal(size=z.shape)
            tried = target(moved)
            taken = np.log(rng.uniform(size=m)) < power * (tried - value)
            z = np.where(taken[:, None], moved, z)
            value = np.where(taken, tried, value)
    return z


def _next_step(value: Array, most: float) -> float:
    """The largest step of the power that leaves half of the rows effective."""

    def effective(step: float) -> float:
        weight = np.exp(step * (value - value.max()))
        return float(weight.sum() ** 2 / (weight**2).sum())

    if effective(most) >= 0.5 * len(value):
        return most
    low, high = -40.0, float(np.log(most))
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if effective(np.exp(middle)) > 0.5 * len(value) else (low, middle)
    return float(np.exp(low))


def rowwise(target: Target, readings: Sequence[Array]) -> Density:
    """A density whose row r sees the r-th of the replicated readings, per sample (H, R, n)."""
    return lambda points, rows: target(points, [y[..., rows] for y in readings])

"""The size of a hidden effect: delta, its direction in the space the plain model cannot reach, and the inverse."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag, solve_triangular

from .catalogue import Candidate, largest, members
from .generator import simulate
from .rig import MATERIAL_PARAMETERS, Array, Rig

# log steps for effects that show early, even steps at the top where curves bend and even turn back
COARSE_GRID = np.concatenate([np.geomspace(1e-4, 0.08, 12), np.linspace(0.1, 1.0, 19)])


@dataclass(frozen=True)
class Geometry:
    """A rig's plain readings and the metric in which effects are measured.

    Attributes
    ----------
    plain : plain, noise-free readings (N), shape (R,).
    chol : lower Cholesky factor of the true covariance V of the readings (N), shape (R, R).
    basis : orthonormal basis of the whitened derivatives by the free parameters, shape (R, r).
    floor : standard deviation of each reading (N), shape (R,).
    """

    rig: Rig
    plain: Array
    chol: Array
    basis: Array
    floor: Array

    def whiten(self, dy: Array) -> Array:
        """V^(-1/2) dy for rows `dy` (n, R)."""
        return solve_triangular(self.chol, np.atleast_2d(dy).T, lower=True).T

    def project(self, dy: Array) -> Array:
        """Whitened rows with what the plain parameters can absorb taken out, shape (n, R)."""
        z = self.whiten(dy)
        return z - (z @ self.basis) @ self.basis.T


def derivatives(rig: Rig, theta: Array | None = None) -> tuple[Array, Array, Array]:
    """Central differences of the plain readings.

    Returns
    -------
    readings (R,), derivative by the free parameters (R, d), by the setting errors of all holds (R, H), in N per unit.
    """
    theta = rig.theta if theta is None else theta
    d, h = len(theta), rig.n_holds
    steps = np.abs(theta) * 1e-4
    steps[len(rig.materials) * len(MATERIAL_PARAMETERS) :] = 1e-3
    thetas = np.tile(theta, (1 + 2 * (d + h), 1))
    eta = np.zeros((len(thetas), h))
    for i in range(d):
        thetas[1 + 2 * i, i] += steps[i]
        thetas[2 + 2 * i, i] -= steps[i]
    for i in range(h):
        eta[1 + 2 * d + 2 * i, i] = 1e-3
        eta[2 + 2 * d + 2 * i, i] = -1e-3
    y = simulate(rig, thetas, None, eta)
    difference = (y[1::2] - y[2::2]).T
    return y[0], difference[:, :d] / (2 * steps), difference[:, d:] / 2e-3


def covariance(rig: Rig, by_eta: Array) -> Array:
    """True covariance V (N^2) of all readings: sensor, rounding and setting errors carried along the chain."""
    blocks = []
    variances = np.concatenate([np.full(len(b.holds), b.setting_sd**2) for b in rig.benches])
    for bench in rig.benches:
        rounding = (bench.resolution_N or 0.0) ** 2 / 12
        blocks.append((bench.sensor_sd**2 + rounding) * np.eye(bench.n_readings))
    v: Array = block_diag(*blocks) + (by_eta * variances) @ by_eta.T
    return v


def geometry(rig: Rig) -> Geometry:
    """Metric of a rig at its true parameters."""
    y, by_theta, by_eta = derivatives(rig)
    v = covariance(rig, by_eta)
    chol = np.asarray(np.linalg.cholesky(v), dtype=np.float64)
    columns = solve_triangular(chol, by_theta, lower=True)
    columns = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    left, size, _ = np.linalg.svd(columns, full_matrices=False)
    basis = left[:, size > 1e-7 * size[0]]
    return Geometry(rig, y, chol, basis, np.sqrt(np.diag(v)))


def signature(geo: Geometry, rows: list[list[tuple[Candidate, float]]]) -> Array:
    """Projected, whitened signatures of finite effects, shape (n, R); delta is the norm of a row."""
    return geo.project(simulate(geo.rig, members=members(geo.rig, rows)) - geo.plain)


def delta_curves(geo: Geometry, candidates: list[Candidate], grid: Array = COARSE_GRID) -> tuple[Array, Array]:
    """Signatures of candidates over a grid of amplitudes, in shares of the largest sensible one.

    Returns
    -------
    amplitudes (c, points), signatures (c, points, R).
    """
    sizes = np.array([largest(geo.rig, c, geo.plain) for c in candidates])[:, None] * grid
    rows = [[(c, float(a))] for c, line in zip(candidates, sizes, strict=True) for a in line]
    z = signature(geo, rows)
    return sizes, z.reshape(len(candidates), len(grid), -1)


_AGREES = 2e-3  # relative error of a delta that is reached
_AGREE_TOGETHER, _ROUNDS = 0.1, 6  # of several effects: error of each, attempts


def solve_amplitude(geo: Geometry, candidate: Candidate, delta: float) -> float:
    """Smallest amplitude (its size) whose signature has the given delta; nan when no sensible one has.

    A grid, then finer grids inside the bracket with the log-log interpolated point among them, until one point agrees
    to the relative tolerance: thresholds make delta bend sharply.
    """
    sizes, z = delta_curves(geo, [candidate])
    grid, height = sizes[0], np.linalg.norm(z[0], axis=1)
    for _ in range(12):
        above = np.flatnonzero(height >= delta)
        if not len(above) or above[0] == 0:
            return float("nan")
        near = slice(int(above[0]) - 1, int(above[0]) + 1)
        guess = np.exp(np.interp(np.log(delta), np.log(np.maximum(height[near], 1e-12)), np.log(grid[near])))
        grid = np.sort(np.append(np.geomspace(grid[near][0], grid[near][1], 5), guess))
        height = np.linalg.norm(signature(geo, [[(candidate, float(a))] for a in grid]), axis=1)
        error = np.abs(height / delta - 1)
        if error.min() < _AGREES:
            return float(grid[np.argmin(error)])
    return float("nan")  # delta jumps over the value asked for


def conditional(geo: Geometry, hidden: list[tuple[Candidate, float]]) -> Array:
    """(k,) delta of each of several effects after the plain parameters and the other effects have taken their part."""
    rows = [hidden, *([e for e in hidden if e is not one] for one in hidden)]
    whole, *without = signature(geo, rows)
    parts = np.array([whole - w for w in without])
    found = []
    for i, part in enumerate(parts):
        others = np.delete(parts, i, axis=0).T
        left = part - others @ np.linalg.lstsq(others, part, rcond=None)[0] if others.size else part
        found.append(float(np.linalg.norm(left)))
    return np.array(found)


def solve_together(geo: Geometry, candidates: list[Candidate], delta: float) -> list[float]:
    """Amplitudes of several effects with the same conditional delta each; nan when no sensible ones have it."""
    wanted = np.full(len(candidates), delta)
    for _ in range(_ROUNDS):
        sizes = [solve_amplitude(geo, c, float(w)) for c, w in zip(candidates, wanted, strict=True)]
        if np.any(np.isnan(sizes)):
            break
        found = conditional(geo, list(zip(candidates, sizes, strict=True)))
        if np.all(np.abs(found / delta - 1.0) < _AGREE_TOGETHER):
            return sizes
        wanted = wanted * np.clip(delta / np.maximum(found, 1e-9), 0.3, 3.0)
    return [float("nan")] * len(candidates)

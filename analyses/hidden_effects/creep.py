"""Creep within a hold, integrated in rate form along a fine clock.

The stretched exponential is the solution of de/dw = k2 (target - e) with the clock w = t^N; in t its rate is singular
at t = 0 for N < 1, so the steps are taken in w. One step of size z = k2 dw multiplies the distance to the target by the
stability function of the three-stage Radau IIA method: fifth order, and quiet however fast the creep.
"""

from __future__ import annotations

import numpy as np

from .rig import Array


def radau(z: Array) -> Array:
    """Decay over one implicit step of size `z` >= 0 (any shape)."""
    return (1 - 2 * z / 5 + z * z / 20) / (1 + 3 * z / 5 + 3 * z * z / 20 + z**3 / 60)


def time_grid(
    times_s: Array, k2: float, exponent: float, largest_step: float = 0.4, fewest: int = 3
) -> tuple[Array, Array]:
    """Fine grid through the given times, from 0, even in the clock between two of them.

    Parameters
    ----------
    times_s : rising times that must be nodes (s), shape (r,).
    k2, exponent : typical creep rate and clock exponent of the batch.
    largest_step : largest k2 dw wanted for the typical member.
    fewest : steps between two of the times at least.

    Returns
    -------
    grid (s), shape (G,), starting at 0; index of each of `times_s` in it, shape (r,).
    """
    nodes = [0.0]
    where = []
    power = min(exponent, 1.0)
    for end in times_s:
        begin = nodes[-1]
        if end > begin:
            steps = int(np.clip(np.ceil(k2 * (end**exponent - begin**exponent) / largest_step), fewest, 80))
            nodes.extend(np.linspace(begin**power, end**power, steps + 1)[1:-1] ** (1 / power))
            nodes.append(float(end))
        where.append(len(nodes) - 1)
    return np.array(nodes), np.array(where, dtype=np.int64)


def remaining(grid_s: Array, k2: Array, exponent: Array, age_s: Array | None = None) -> Array:
    """Fraction of the way to the target still to go at every node.

    Parameters
    ----------
    grid_s : nodes (s), shape (G,) or (n, G), starting at 0.
    k2, exponent : shape (n,).
    age_s : reading of the clock at the first node (s), shape (n,) ; 0 when left out.

    Returns
    -------
    shape (n, G), 1 at the first node.
    """
    grid = np.atleast_2d(grid_s)
    if age_s is not None:
        grid = grid + age_s[:, None]
    clock = np.maximum(grid, 0.0) ** exponent[:, None]  # a search may step to a time before the start
    steps = radau(k2[:, None] * np.diff(clock, axis=1))
    return np.concatenate([np.ones((len(steps), 1)), np.cumprod(steps, axis=1)], axis=1)

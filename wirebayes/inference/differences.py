"""First and second derivatives of a density by differences of its values, in one batch."""

from functools import cache

import numpy as np

from wirebayes.inference.log_posterior import Density
from wirebayes.numeric.typing import Array

_NO_DENSITY = 1e3  # how far below its neighbour the log density counts where there is none: downhill, whatever the step


def steps_apart(bend: Array) -> Array:
    """(n, d) steps of differences: a tenth of a standard deviation, as the diagonals (n, d) of curvatures say."""
    return np.clip(0.1 / np.sqrt(np.maximum(bend, 1.0)), 1e-6, 0.05)


def gradient_and_hessian(
    density: Density, z: Array, rows: Array, value: Array, h: Array, sides: int
) -> tuple[Array, Array]:
    """Gradient and Hessian by central differences, all points of all rows in one batch.

    Mixed derivatives take most of the points: with one side only, half as many, they give the direction well enough.

    Parameters
    ----------
    density : function of ((m, d) points, (m,) row numbers) to (m,) values
    z : (n, d) array
        Places.
    rows : (n,) int array
        Their row numbers.
    value : (n,) array
        The density there.
    h : (n, d) array
        Steps.
    sides : {1, 2}
        Of the mixed derivatives.

    Returns
    -------
    (n, d) and (n, d, d) arrays
    """
    d = z.shape[1]
    moves = _differences(d, sides) * h[:, None]
    found = _beside(density, z, rows, value, moves)
    centre = value[:, None]
    plus = found[:, :d]
    minus = found[:, d : 2 * d]
    gradient = (plus - minus) / (2.0 * h)
    bend = (plus + minus - 2.0 * centre) / h**2
    i, j = np.triu_indices(d, 1)
    both_plus, both_minus = np.split(found[:, 2 * d :], [len(i)], axis=1)
    mixed = both_plus - plus[:, i] - plus[:, j] + centre
    if sides == 2:
        mixed = 0.5 * (mixed + both_minus - minus[:, i] - minus[:, j] + centre)
    mixed_bend = mixed / (h[:, i] * h[:, j])
    return gradient, _symmetric(bend, mixed_bend)


def _symmetric(diagonal: Array, above: Array) -> Array:
    """(n, d, d) matrices by their diagonals (n, d), and what stands above these, row by row (n, d (d - 1) / 2)."""
    n, d = diagonal.shape
    on_diagonal = np.arange(d)
    i, j = np.triu_indices(d, 1)
    out = np.zeros((n, d, d))
    out[:, on_diagonal, on_diagonal] = diagonal
    out[:, i, j] = above
    out[:, j, i] = above
    return out


def _beside(density: Density, z: Array, rows: Array, value: Array, moves: Array) -> Array:
    """(n, m) densities at moves (n, m, d) from places (n, d); far below the place's own (n,) where there is none."""
    n, m, d = moves.shape
    points = z[:, None] + moves
    found = density(points.reshape(-1, d), np.repeat(rows, m))
    found = found.reshape(n, m)
    return np.where(np.isfinite(found), found, value[:, None] - _NO_DENSITY)


@cache
def _differences(d: int, sides: int) -> Array:
    """(m, d) along each coordinate and back, along each pair of them, and where there are two sides, back."""
    i, j = np.triu_indices(d, 1)
    unit = np.eye(d)
    both = unit[i] + unit[j]
    moves = [unit, -unit, both]
    if sides == 2:
        moves.append(-both)
    return np.concatenate(moves)

"""A Gauss-Newton step from a place of a path, as far as the tangent reaches."""

from collections.abc import Sequence

import numpy as np

from wirebayes.discovery.path_weights import Weighed
from wirebayes.discovery.tangent import Tangent, damp, residuals
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.numeric.log_sum import or_impossible
from wirebayes.numeric.typing import Array

# of a step, tried in one batch: whole, and shorter where the tangent does not reach so far
_LENGTHS = np.array([1.0, 0.4, 0.1])
_LONGEST = 3.0  # of a step, in any sampled coordinate


def stepped(
    target: LogPosterior,
    z: Array,
    readings: Sequence[Array] | None,
    x: Tangent,
    here: Weighed,
    columns: list[int],
    degrees: int,
) -> Array:
    """Move the parameters a step, or as much of it as is best, or not at all.

    Parameters
    ----------
    target : LogPosterior
    z : (n, d) array
        Where they are, in the coordinates that are sampled.
    readings : sequence of (H, R, n) arrays or None
        A sample each; None for the measured ones.
    x, here
        The tangent there, and what its weights say.
    columns : list of int
        Which parameters move.
    degrees : int
        Readings less parameters.
    """
    trial = _along(here.step, z, columns)
    residual, prior = _tried(target, trial[1:], readings)
    residual = np.concatenate([x.residual[None], residual])
    prior = np.concatenate([x.prior[None], prior])
    square = _squares(x, here.ratio, residual)
    with np.errstate(invalid="ignore"):
        value = prior - 0.5 * degrees * np.log(np.maximum(square, x.least))
    best = np.argmax(or_impossible(value), axis=0)
    rows = np.arange(len(z))
    return trial[best, rows]


def _tried(target: LogPosterior, places: Array, readings: Sequence[Array] | None) -> tuple[Array, Array]:
    """(k, n, N) residuals and (k, n) log prior densities at k places (k, n, d) of each data set."""
    k, n, d = places.shape
    tiled = None
    if readings is not None:
        tiled = [np.tile(of_sample, (1, 1, k)) for of_sample in readings]
    residual, prior = residuals(target, places.reshape(-1, d), tiled)
    return residual.reshape(k, n, -1), prior.reshape(k, n)


def _along(step: Array, z: Array, columns: list[int]) -> Array:
    """(1 + k, n, d) places (n, d), and those at each of `_LENGTHS` of their steps (n, p), none too long."""
    size = np.abs(step).max(axis=1, keepdims=True)
    step = step * np.minimum(1.0, _LONGEST / np.maximum(size, 1e-300))
    out = np.repeat(z[None], 1 + len(_LENGTHS), axis=0)
    out[1:, :, columns] += _LENGTHS[:, None, None] * step
    return out


def _squares(x: Tangent, ratio: Array, residual: Array) -> Array:
    """(k, n) sums of squares of residuals (k, n, N) in the metric of the noise, at its ratio (n,)."""
    levels = residual.transpose(1, 0, 2) @ x.left
    shrink = damp(x.singular, ratio[:, None])
    whole_holds = (levels**2 @ shrink[..., None])[..., 0]
    return (residual**2).sum(axis=2) - whole_holds.T

"""What an effect explains of the smooth remainder: its log Bayes factor with the remainder in the model, linearised."""

from typing import NamedTuple

import numpy as np

from wirebayes.discovery.noise_integral import ABSORBED, SIZES, Expansion, Projected, has_tangent, project
from wirebayes.numeric.linear_algebra import eigh
from wirebayes.numeric.log_sum import log_sum
from wirebayes.numeric.typing import Array, Bools


def beside_smooth(x: Expansion) -> Array:
    """(m,) log Bayes factor of each signature of the first row with the smooth remainder, of one process, in the model.

    It is taken at the best amplitude, whose prior is not in it (`wirebayes.discovery.refit.occam`); sizes of the
    remainder and noise ratios are summed over as in `wirebayes.discovery.linear_scan.scan`.
    """
    first = x.of(np.array([0]))
    nothing = np.full(x.signatures.shape[2], -np.inf)
    if not has_tangent(first)[0]:
        return nothing
    found = project(first)
    seen = np.isfinite(found.shared[0])  # ratios at which the parameters can be distinguished
    if not seen.any():
        return nothing
    shared, rss, along, square = _with_remainder(found, seen)
    upward = np.where(x.one_sided, np.maximum(along, 0.0), along)
    absorbed = ABSORBED * (x.signatures[0] ** 2).sum(axis=0)
    gain = np.where(square > absorbed, upward**2 / np.where(square > 0, square, np.inf), 0.0)
    least, half = float(x.least[0]), 0.5 * x.degrees
    left = np.maximum(rss, least)
    left_beside = np.maximum(left[..., None] - gain, least)
    without = shared - half * np.log(left)
    beside = shared[..., None] - half * np.log(left_beside)
    return np.asarray(log_sum(beside.reshape(-1, beside.shape[2])) - log_sum(without.ravel()))


class _Products(NamedTuple):
    """Of `Projected`, at k ratios and s sizes of a remainder that is in the model."""

    shared: Array
    rss: Array
    along: Array
    square: Array


def _with_remainder(found: Projected, seen: Bools) -> _Products:
    """The first row's inner products at some ratios, free of what a remainder of one process takes, too."""
    (functions,), (with_residual,), (smooth,) = found.smooth_square, found.smooth_along, found.smooth
    crossed = smooth.products(found.form, found.shrink)
    # along the eigenvectors of its functions' products the remainder is a sum of independent ones
    values, vectors = eigh(functions[0][seen])
    values = np.maximum(values, 0.0)
    turn = np.swapaxes(vectors, 1, 2)
    of_residual = (turn @ with_residual[0][seen][..., None])[:, None, :, 0]
    of_signatures = turn @ crossed[0][seen]
    variance = (SIZES**2 / np.maximum(values.sum(axis=1), 1e-300)[:, None])[..., None]
    excess = variance * values[:, None]
    taken = variance / (1.0 + excess)
    shared, rss, along, square = (
        each[0][seen][:, None] for each in (found.shared, found.rss, found.along, found.square)
    )
    return _Products(
        shared - 0.5 * np.log1p(excess).sum(axis=2),
        rss - (taken * of_residual**2).sum(axis=2),
        along - (taken * of_residual) @ of_signatures,
        square - taken @ of_signatures**2,
    )

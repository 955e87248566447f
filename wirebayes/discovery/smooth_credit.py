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
    signatures = x.signatures.shape[2]
    nothing = np.full(signatures, -np.inf)
    if not has_tangent(first)[0]:
        return nothing
    found = project(first)
    seen = np.isfinite(found.shared[0])  # ratios at which the parameters can be distinguished
    if not seen.any():
        return nothing
    products = _with_remainder(found, seen)
    least = float(x.least[0])
    half = 0.5 * x.degrees
    left = np.maximum(products.rss, least)
    left_beside = np.maximum(left[..., None] - _gain(x, products), least)
    without = products.shared - half * np.log(left)
    beside = products.shared[..., None] - half * np.log(left_beside)
    by_signature = beside.reshape(-1, signatures)
    return log_sum(by_signature) - log_sum(without.ravel())


class _Products(NamedTuple):
    """The inner products of `Projected`, with a remainder in the model: at k ratios ρ and s sizes of it."""

    shared: Array
    rss: Array
    along: Array
    square: Array


def _gain(x: Expansion, products: _Products) -> Array:
    """(k, s, m) what each signature takes of the sum of squares at its best amplitude."""
    upward = np.where(x.one_sided, np.maximum(products.along, 0.0), products.along)
    absorbed = ABSORBED * (x.signatures[0] ** 2).sum(axis=0)
    square = np.where(products.square > 0, products.square, np.inf)
    return np.where(products.square > absorbed, upward**2 / square, 0.0)


def _with_remainder(found: Projected, seen: Bools) -> _Products:
    """The first row's inner products at some ratios, free of what a remainder of one process takes, too."""
    [functions] = found.smooth_square
    [with_residual] = found.smooth_along
    [smooth] = found.smooth
    crossed = smooth.products(found.form, found.shrink)
    # along the eigenvectors of its functions' products the remainder is a sum of independent ones
    values, vectors = eigh(functions[0][seen])
    values = np.maximum(values, 0.0)
    turn = np.swapaxes(vectors, 1, 2)
    turned = turn @ with_residual[0][seen][..., None]
    of_residual = turned[:, None, :, 0]
    of_signatures = turn @ crossed[0][seen]
    whole = np.maximum(values.sum(axis=1), 1e-300)
    variance = (SIZES**2 / whole[:, None])[..., None]
    excess = variance * values[:, None]
    taken = variance / (1.0 + excess)
    volume = np.log1p(excess).sum(axis=2)

    def without(values: Array) -> Array:
        """Of the first row at these ratios, for every size."""
        return values[0][seen][:, None]

    return _Products(
        without(found.shared) - 0.5 * volume,
        without(found.rss) - (taken * of_residual**2).sum(axis=2),
        without(found.along) - (taken * of_residual) @ of_signatures,
        without(found.divisor) - taken @ of_signatures**2,
    )

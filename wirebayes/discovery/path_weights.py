"""The density at one place of a path, the noise integrated out, and the step that leads on from there."""

from dataclasses import dataclass, replace

import numpy as np

from wirebayes.discovery.noise_integral import ABSORBED, RATIOS
from wirebayes.discovery.tangent import Tangent, damp
from wirebayes.numeric.linear_algebra import cholesky, solve
from wirebayes.numeric.log_sum import or_impossible
from wirebayes.numeric.rows import joined_rows, rows_of
from wirebayes.numeric.typing import Array, Bools

_JUMP = 1e8  # standard deviations a unit of any parameter: no tangent where the readings jump


_LARGE = 1e200  # above any sum of squares, and its square root finite


_PIECE = 64  # rows weighed at once: what stays in the cache


@dataclass(frozen=True)
class Weighed:
    """What the readings say at n places, with the noise integrated out.

    Attributes
    ----------
    height : (n,) array
        Log marginal density.
    move : (n,) array
        The best move of the amplitude.
    norm : (n,) array
        δ per amplitude.
    step : (n, p) array
        Of the parameters, by Gauss and Newton.
    ratio : (n,) array
        ρ, the size of the setting errors against the sensor's, that suits best.
    promise : (n,) array
        By how much the log density would grow with that step, were the tangent exact.
    """

    height: Array
    move: Array
    norm: Array
    step: Array
    ratio: Array
    promise: Array

    def of(self, rows: Array) -> "Weighed":
        """The same for some of the places."""
        return rows_of(self, rows)


def weigh(
    x: Tangent,
    signature: Array,
    near: Array | float,
    far: Array | float,
    degrees: int,
) -> Weighed:
    """Integrate the noise out, as the linear scan does, with the amplitude moved to its best.

    Parameters
    ----------
    x : Tangent
        At n places.
    signature : (n, N) array
        What a unit of the amplitude adds to the readings.
    near, far : (n,) array or float
        Ends of the amplitude's move.
    degrees : int
        Readings less parameters.
    """
    n = len(x.residual)
    near = np.broadcast_to(near, n)
    far = np.broadcast_to(far, n)
    parts = []
    for first in range(0, n, _PIECE):
        rows = np.arange(first, min(first + _PIECE, n))
        parts.append(_weigh_few(x.of(rows), signature[rows], near[rows], far[rows], degrees))
    return joined_rows(parts)


@dataclass(frozen=True)
class _Free:
    """Inner products at n places and k noise ratios of what the parameters leave.

    Attributes
    ----------
    gram : (n, k, p + 2, p + 2) array
        Of parameters, signature and residual, before the parameters take anything.
    regular : (n, k) bool array
        Whether the parameters can be distinguished.
    log_volume : (n, k) array
        Of the parameters.
    along, square : (n, k) arrays
        Of the signature with the residual, and with itself.
    taken : (n, k, p) array
        What the parameters take of the residual, in coordinates in which it is a sum of squares.
    """

    gram: Array
    regular: Bools
    log_volume: Array
    along: Array
    square: Array
    taken: Array

    @property
    def residual(self) -> Array:
        """(n, k) of the residual with itself. Nothing is taken off it: far out, steps promise more than they keep."""
        return self.gram[..., -1, -1]

    def left(self, amplitude: Array, least: Array) -> Array:
        """(n, k) sum of squares beside amplitudes (n, k); no less than rounding (n,)."""
        squares = self.residual - 2.0 * amplitude * self.along + amplitude**2 * self.square
        return np.maximum(squares, least[:, None])


def _weigh_few(x: Tangent, signature: Array, near: Array, far: Array, degrees: int) -> Weighed:
    columns, smooth = _columns(x, signature)
    free = _eliminated(_inner_products(x, columns))
    nowhere = np.zeros_like(free.square)
    amplitude = np.divide(free.along, free.square, out=nowhere, where=free.square > 0)
    amplitude = np.clip(amplitude, near[:, None], far[:, None])
    left = free.left(amplitude, x.least)
    height = _heights(x, free, left, degrees)
    k = np.argmax(height, axis=1)
    best = np.arange(len(height)), k
    left_best = left[best]
    by_step = (free.taken[best] ** 2).sum(axis=1)
    after = np.maximum(left_best - by_step, x.least)
    total = _summed(height, height[best])
    return Weighed(
        height=np.where(smooth, total, -np.inf),
        move=amplitude[best],
        norm=np.sqrt(free.square[best] * degrees / left_best),
        step=_steps(free.gram[best], free.regular[best]),
        ratio=RATIOS[k],
        promise=0.5 * degrees * np.log(left_best / after),
    )


def _heights(x: Tangent, free: _Free, left: Array, degrees: int) -> Array:
    """(n, k) log density at each noise ratio, with sums of squares that are left (n, k)."""
    moved_whole = np.log1p(RATIOS[:, None] * x.singular[:, None] ** 2)
    log_volume = -0.5 * moved_whole.sum(axis=2) - free.log_volume
    height = log_volume - 0.5 * degrees * np.log(left)
    return np.where(free.regular, height, -np.inf)


def _columns(x: Tangent, signature: Array) -> tuple[Array, Bools]:
    """(n, N, p + 2) parameters, signature and residual, all zero in rows (n,) where the readings jump."""
    columns = np.concatenate([x.parameters, signature[..., None], x.residual[..., None]], axis=2)
    with np.errstate(invalid="ignore"):
        smooth = np.abs(columns).max(axis=(1, 2)) < _JUMP
    columns[~smooth] = 0.0
    return columns, smooth


def _inner_products(x: Tangent, columns: Array) -> Array:
    """(n, k, c, c) inner products of columns (n, N, c) at each noise ratio, with the prior of the parameters."""
    n = len(columns)
    p = x.parameters.shape[2]
    levels = np.swapaxes(x.left, 1, 2) @ columns
    products = (levels[..., None] * levels[..., None, :]).reshape(*levels.shape[:2], -1)
    whole_holds = damp(x.singular[:, None], RATIOS[:, None]) @ products
    plain = np.swapaxes(columns, 1, 2) @ columns
    plain[:, :p, :p] += x.prior_precision
    plain[:, -1, :p] += x.prior_gradient
    return plain[:, None] - whole_holds.reshape(n, len(RATIOS), *plain.shape[1:])


def _eliminated(gram: Array) -> _Free:
    """What the parameters leave, of inner products of parameters, signature and residual.

    One Cholesky factor gives the volume, and what the parameters leave of signature and residual. Its last two pivots
    need only be positive: the one is taken back, the other not used.
    """
    p = gram.shape[-1] - 2
    own = gram[..., p, p]
    added = np.where(own > 0, own, 1.0)
    bordered = gram.copy()
    bordered[..., p, p] += added
    bordered[..., -1, -1] = _LARGE
    factor = cholesky(bordered)
    regular = np.isfinite(factor[..., 0, 0])
    factor[~regular] = 1.0
    of_parameters = factor[..., :p, :p]
    diagonal = np.einsum("nkpp->nkp", of_parameters)
    pivot = factor[..., p, p]
    square = pivot**2 - added
    is_free = square > ABSORBED * own
    residual = factor[..., -1, :]
    return _Free(
        gram,
        regular,
        log_volume=np.log(diagonal).sum(axis=2),
        along=residual[..., p] * pivot,
        square=np.where(is_free, square, 0.0),
        taken=residual[..., :p],
    )


def _summed(height: Array, peak: Array) -> Array:
    """(n,) log densities summed over ratios (n, k), whose largest is `peak`; -inf where that is not a number."""
    with np.errstate(invalid="ignore"):
        total = peak + np.log(np.exp(height - peak[:, None]).sum(axis=1))
    return or_impossible(total)


def _steps(gram: Array, regular: Bools) -> Array:
    """(n, p) Gauss-Newton steps, of inner products (n, p + 2, p + 2); none where there is no such step."""
    step = solve(gram[:, :-2, :-2], gram[:, -1, :-2, None])[..., 0]
    return np.where((regular & np.isfinite(step).all(axis=1))[:, None], step, 0.0)


def without_last(x: Tangent) -> Tangent:
    """The tangent with its last parameter held."""
    precision = x.prior_precision[:, :-1, :-1]
    return replace(
        x, parameters=x.parameters[..., :-1], prior_gradient=x.prior_gradient[:, :-1], prior_precision=precision
    )

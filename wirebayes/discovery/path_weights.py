"""The density at one place of a path, the noise integrated out, and the step that leads on from there."""

from dataclasses import dataclass, fields, replace

import numpy as np

from wirebayes.discovery.noise_integral import ABSORBED, RATIOS
from wirebayes.discovery.tangent import Tangent, damp
from wirebayes.numeric.linear_algebra import cholesky, solve
from wirebayes.numeric.typing import Array

_JUMP = 1e8  # standard deviations a unit of any parameter: no tangent where the readings jump


_LARGE = 1e200  # above any sum of squares, and its square root finite


_PIECE = 64  # rows weighed at once: what stays in the cache


@dataclass(frozen=True)
class Weighed:
    """At one place: log marginal density, best move of the amplitude, δ per amplitude, step of the parameters, ρ.

    And by how much the density would grow with that step, were the tangent exact.
    """

    height: Array
    move: Array
    norm: Array
    step: Array
    ratio: Array
    promise: Array

    def of(self, rows: Array) -> "Weighed":
        """That of some places."""
        return Weighed(*(getattr(self, f.name)[rows] for f in fields(self)))


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
    near, far = np.broadcast_to(near, n), np.broadcast_to(far, n)
    pieces = [np.arange(i, min(i + _PIECE, n)) for i in range(0, n, _PIECE)]
    parts = [_weigh_few(x.of(i), signature[i], near[i], far[i], degrees) for i in pieces]
    return Weighed(*(np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Weighed)))


def _weigh_few(x: Tangent, signature: Array, near: Array, far: Array, degrees: int) -> Weighed:
    n, p = x.parameters.shape[0], x.parameters.shape[2]
    columns = np.concatenate([x.parameters, signature[..., None], x.residual[..., None]], axis=2)
    with np.errstate(invalid="ignore"):
        smooth = np.abs(columns).max(axis=(1, 2)) < _JUMP
    columns[~smooth] = 0.0
    levels = np.swapaxes(x.left, 1, 2) @ columns
    products = (levels[..., None] * levels[..., None, :]).reshape(*levels.shape[:2], -1)
    # For each ratio all inner products (n, k, p + 2, p + 2): of the parameters, the signature and the residual.
    gram = (damp(x.singular[:, None], RATIOS[:, None]) @ products).reshape(n, len(RATIOS), p + 2, p + 2)
    whole = np.swapaxes(columns, 1, 2) @ columns
    whole[:, :p, :p] += x.prior_precision
    whole[:, -1, :p] += x.prior_gradient
    gram = whole[:, None] - gram
    # Not less what a further step promises: far out, steps promise more than they keep.
    rss, mm = gram[..., -1, -1].copy(), gram[..., p, p].copy()
    # One Cholesky factor gives the volume, and what the parameters leave of signature and residual. Its last two pivots
    # need only be positive: the one is taken back, the other not used.
    added = np.where(mm > 0, mm, 1.0)
    gram[..., p, p] += added
    gram[..., -1, -1] = _LARGE
    factor = cholesky(gram)
    regular = np.isfinite(factor[..., 0, 0])
    factor[~regular] = 1.0
    pivot = factor[..., p, p]
    b, c = factor[..., -1, p] * pivot, pivot**2 - added
    c = np.where(c > ABSORBED * mm, c, 0.0)
    a = np.divide(b, c, out=np.zeros_like(c), where=c > 0)
    a = np.clip(a, near[:, None], far[:, None])
    left = np.maximum(rss - 2.0 * a * b + a**2 * c, x.least[:, None])
    volume = -0.5 * np.log1p(RATIOS[:, None] * x.singular[:, None] ** 2).sum(axis=2)
    volume -= np.log(np.einsum("nkpp->nkp", factor[..., :p, :p])).sum(axis=2)
    height = np.where(regular, volume - 0.5 * degrees * np.log(left), -np.inf)
    rows, k = np.arange(n), np.argmax(height, axis=1)
    best = rows, k
    step = solve(gram[rows, k, :p, :p], gram[rows, k, -1, :p, None])[..., 0]
    step = np.where((regular[best] & np.isfinite(step).all(axis=1))[:, None], step, 0.0)
    peak = height[best]
    with np.errstate(invalid="ignore"):
        total = peak + np.log(np.exp(height - peak[:, None]).sum(axis=1))
    total = np.where(smooth & np.isfinite(total), total, -np.inf)
    after = np.maximum(left[best] - (factor[rows, k, -1, :p] ** 2).sum(axis=1), x.least)
    promise = 0.5 * degrees * np.log(left[best] / after)
    return Weighed(total, a[best], np.sqrt(c[best] * degrees / left[best]), step, RATIOS[k], promise)


def without_last(x: Tangent) -> Tangent:
    """The tangent with its last parameter held."""
    precision = x.prior_precision[:, :-1, :-1]
    return replace(
        x, parameters=x.parameters[..., :-1], prior_gradient=x.prior_gradient[:, :-1], prior_precision=precision
    )

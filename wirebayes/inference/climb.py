"""Climbs to the maxima of a density: batched Newton steps, and the normal approximation where they end.

Every row is an optimisation of its own; rows may also have their own readings (refits of simulated data).
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wirebayes.inference.log_posterior import Density, Residuals
from wirebayes.numeric.typing import Array

LEAST_CURVATURE = 0.3  # a standard deviation of 1.8; the widest prior, k1's, has 1.5 in its logarithm
_ONE_MODE = 4.0  # squared standard deviations
_ENOUGH = 0.25  # of what a step promises to gain: with less, damped ones are tried
_LONGEST = 2.0  # step of a coordinate; they are of order one under the prior
_NARROW = 1e-2  # standard deviation assumed where none is known yet, so that differences stay inside it
_NEAR = 1e-6  # step of a derivative: far above rounding, far below any standard deviation
# added to the curvature (of order one under the prior alone), tried in one batch where a step gains too little
_DAMPINGS = np.array([1.0, 10.0, 100.0, 1e3, 1e4, 1e6])
_PATIENCE = 10.0  # times the promised gain of a step: along a bent ridge there are many such steps
REACH = 30.0  # nats below the best mode that no mode counts
_RELAX, _LEAST_DAMPING = 0.2, 0.3  # share of the damping kept after a step that was good; less than the latter is none


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

    def rows(self, which: Any) -> "Optimum":
        """Some of them, by number or mask."""
        return Optimum(self.z[which], self.log_density[which], self.curvature[which], self.converged[which])

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
        eigen = np.maximum(np.linalg.eigvalsh(self.curvature), LEAST_CURVATURE)
        return np.asarray(self.log_density + 0.5 * d * np.log(2.0 * np.pi) - 0.5 * np.log(eigen).sum(axis=1))


@dataclass(frozen=True)
class _Local:
    """A density at places: its value (n,), gradient (n, d), and curvature (n, d, d), minus the Hessian or nearly so."""

    value: Array
    gradient: Array
    curvature: Array


@dataclass(frozen=True)
class _Ends:
    """Where climbs of several densities have ended, and which density (k,) each place is of."""

    which: NDArray[np.int64]
    places: Optimum

    @classmethod
    def of(cls, known: Sequence[Optimum]) -> "_Ends":
        """Modes of each density that are known."""
        return cls(np.repeat(np.arange(len(known)), [len(found.z) for found in known]), together(known))

    def joined(self, which: NDArray[np.int64], ended: Optimum) -> "_Ends":
        """With further places, highest first, but for those that are near one.

        Parameters
        ----------
        which : (n,) int array
            Their densities.
        """
        out = self
        for i in np.argsort(-ended.log_density):
            here = ended.rows([i])
            if not out.near(which[[i]], here.z, here.log_density)[0]:
                out = _Ends(np.append(out.which, which[i]), together([out.places, here]))
        return out

    def near(self, which: NDArray[np.int64], z: Array, value: Array) -> NDArray[np.bool_]:
        """(n,) whether places would count as one of these modes of their density; never where they are higher.

        Parameters
        ----------
        which : (n,) int array
            Their densities.
        z : (n, d) array
        value : (n,) array
        """
        near = _apart(z, self.places.z, self.places.curvature) <= _ONE_MODE
        lower = value[:, None] <= self.places.log_density
        return np.asarray((near & lower & (self.which == which[:, None])).any(axis=1))


def climb(
    density: Density,
    start: Array,
    residuals: Residuals | None = None,
    *,
    iterations: int = 60,
    tolerance: float = 1e-5,
    of: NDArray[np.int64] | None = None,
    known: Sequence[Optimum] = (),
    reach: float = np.inf,
    curvature_at_end: bool = True,
) -> Optimum:
    """Maximise a log density from every row of `start`.

    The steps are Newton's, damped where they gain too little (Levenberg and Marquardt): on a bent ridge a damped step
    stays near the ridge, a shortened one does not. With `residuals` the curvature is the expected information (Fisher
    scoring), which d + 1 evaluations give and which also points uphill where the density is not concave; without,
    differences give the Hessian, which takes d² / 2.

    Parameters
    ----------
    density : function of ((m, d) points, (m,) row numbers) to (m,) values
        The row numbers say which start a point belongs to.
    start : (n, d) array
    residuals : function of ((m, d) points, (m,) row numbers) to (m,) values and (k, m) residuals, optional
        The density with what its curvature is made of, as `LogPosterior.standardised` returns them.
    tolerance : float
        Stop a row when half its squared Newton decrement is below this.
    of : (n,) int array, optional
        Which of several densities each row climbs. Given up, after a step, are then the rows that come so near to where
        another row of the same density has ended that they would count as that mode; their log density becomes -inf.
    known : sequence of Optimum
        Modes of each of those densities that are known before: they are ends, too.
    reach : float
        Give up, likewise, the rows that are lower than the best by more than this and ten times what they may gain;
        than the best of their density, if there are several.
    curvature_at_end : bool
        Where only the places matter, the curvature may stay that of the last step: the Hessian takes d² evaluations.
    """
    n, d = start.shape
    look = partial(_by_differences, density) if residuals is None else partial(_by_residuals, residuals)
    group = np.zeros(n, np.int64) if of is None else of
    ends = _Ends.of(known or [Optimum(start[:0], np.empty(0), np.empty((0, d, d)), np.empty(0, bool))])
    z, value = start.copy(), np.full(n, -np.inf)
    slope, eigen, vectors = np.zeros((n, d)), np.full((n, d), _NARROW**-2), np.tile(np.eye(d), (n, 1, 1))
    # Where to look next: at the end of a step, in the hope that it is taken, or, after another one, at `z`.
    ahead, promised, arrived = start.copy(), np.zeros(n), np.ones(n, bool)
    damping, done, converged = np.zeros(n), np.zeros(n, bool), np.zeros(n, bool)
    for _ in range(iterations):
        rows = np.flatnonzero(~done)
        if not len(rows):
            break
        local = look(ahead[rows], rows, eigen[rows], vectors[rows])
        least = np.where(arrived[rows], -np.inf, value[rows] + _ENOUGH * promised[rows])
        kept = np.isfinite(local.value) & (local.value > least)
        done[rows[arrived[rows] & ~kept]] = True
        failed = rows[~kept & ~arrived[rows]]
        if len(failed):
            trial, tried, by = _damped(density, z[failed], failed, slope[failed], eigen[failed], vectors[failed])
            better = tried > value[failed]
            done[failed] = ~better
            moved = failed[better]
            z[moved], value[moved], damping[moved] = trial[better], tried[better], by[better]
            ahead[moved], arrived[moved] = z[moved], True
        here = rows[kept]
        z[here], value[here] = ahead[here], local.value[kept]
        eigen[here], vectors[here] = _positive(local.curvature[kept])
        slope[here] = np.einsum("nij,ni->nj", vectors[here], local.gradient[kept])
        converged[here] = done[here] = 0.5 * (slope[here] ** 2 / eigen[here]).sum(axis=1) < tolerance
        damping[here] = np.where(arrived[here], damping[here], damping[here] * _RELAX)
        damping[here[damping[here] < _LEAST_DAMPING]] = 0.0
        promised[here] = 0.5 * (slope[here] ** 2 / (eigen[here] + damping[here, None])).sum(axis=1)
        ahead[here] = z[here] + _step(slope[here], eigen[here], vectors[here], damping[here, None])[:, 0]
        arrived[here] = False
        left = rows[~done[rows]]
        hopeless = value[left] + _PATIENCE * promised[left] < _best(value, group)[left] - reach
        if of is not None:
            if len(here := here[converged[here]]):
                curvature = _composed(eigen[here], vectors[here])
                ends = ends.joined(of[here], Optimum(z[here], value[here], curvature, converged[here]))
            if len(ends.which):
                hopeless |= ends.near(of[left], z[left], value[left])
        left = left[hopeless]
        done[left], value[left] = True, -np.inf
    found = Optimum(z, value, _composed(eigen, vectors), converged)
    return curved(density, found) if curvature_at_end else found


def _best(value: Array, group: NDArray[np.int64]) -> Array:
    """(n,) the greatest of the values (n,) in each one's group (n,)."""
    best = np.full(group.max(initial=0) + 1, -np.inf)
    np.maximum.at(best, group, value)
    return best[group]


def curved(density: Density, found: Optimum, which: NDArray[np.int64] | None = None) -> Optimum:
    """The same places with the curvature of the density itself, where that is finite.

    Parameters
    ----------
    density : function of ((m, d) points, (m,) row numbers) to (m,) values
    found : Optimum
        Of n places.
    which : (n,) int array, optional
        The row numbers of the places; their own where left out.
    """
    which = np.arange(len(found.z)) if which is None else which
    rows = np.flatnonzero(np.isfinite(found.log_density))
    if not len(rows):
        return found
    z, value, curvature = found.z[rows], found.log_density[rows], found.curvature.copy()
    bend = np.einsum("nii->ni", curvature[rows])
    _, hessian = _derivatives(density, z, which[rows], value, _steps(bend), sides=2)
    curvature[rows] = _composed(*_positive(-hessian))
    return replace(found, curvature=curvature)


def _damped(
    density: Density, z: Array, rows: NDArray[np.int64], slope: Array, eigen: Array, vectors: Array
) -> tuple[Array, Array, Array]:
    """Places (n, d) to which the best of several damped steps leads, the density there, and the dampings (n,)."""
    trial = z[:, None] + _step(slope, eigen, vectors, _DAMPINGS)
    tried = density(trial.reshape(-1, z.shape[1]), np.repeat(rows, len(_DAMPINGS))).reshape(len(z), -1)
    best = np.argmax(tried, axis=1)
    i = np.arange(len(z))
    return trial[i, best], tried[i, best], _DAMPINGS[best]


def _step(slope: Array, eigen: Array, vectors: Array, damping: Array) -> Array:
    """(n, k, d) steps with k dampings (n, k) or (k,): the more damped, the less far along what is little curved."""
    damping = np.broadcast_to(damping, (len(slope), np.shape(damping)[-1]))
    step = np.einsum("nij,nkj->nki", vectors, slope[:, None] / (eigen[:, None] + damping[..., None]))
    return step * np.minimum(1.0, _LONGEST / np.maximum(np.abs(step).max(axis=2, keepdims=True), 1e-300))


def _composed(eigen: Array, vectors: Array) -> Array:
    """(n, d, d) symmetric matrices of their eigenvalues and vectors."""
    return np.einsum("nij,nj,nkj->nik", vectors, eigen, vectors)


def _positive(matrices: Array) -> tuple[Array, Array]:
    """Eigenvalues, made positive, and vectors of symmetric matrices (n, d, d)."""
    eigen, vectors = np.linalg.eigh(matrices)
    scale = np.maximum(np.abs(eigen).max(axis=1, keepdims=True), 1e-8)
    return np.maximum(np.abs(eigen), 1e-9 * scale), vectors


def _by_residuals(residuals: Residuals, z: Array, rows: NDArray[np.int64], *_: Array) -> _Local:
    """Curvature as the expected information, and the gradient, from one more evaluation a coordinate."""
    n, d = z.shape
    points = z[:, None] + np.concatenate([np.zeros((1, d)), _NEAR * np.eye(d)])
    values, each = residuals(points.reshape(-1, d), np.repeat(rows, d + 1))
    values, each = values.reshape(n, d + 1), each.reshape(-1, n, d + 1)
    with np.errstate(all="ignore"):
        slopes = np.moveaxis(each[..., 1:] - each[..., :1], 0, 1) / _NEAR
        slopes = np.where(np.isfinite(slopes), slopes, 0.0)
        curvature = np.swapaxes(slopes, 1, 2) @ slopes
        # a difference to one side, put right by the curvature
        gradient = (values[:, 1:] - values[:, :1]) / _NEAR + 0.5 * _NEAR * np.einsum("nii->ni", curvature)
    return _Local(values[:, 0], np.where(np.isfinite(gradient), gradient, 0.0), curvature)


def _by_differences(density: Density, z: Array, rows: NDArray[np.int64], eigen: Array, vectors: Array) -> _Local:
    """Curvature and gradient from differences of values alone, as far apart as the last curvature's diagonal suggests.

    Of that, `eigen` (n, d) are the eigenvalues, `vectors` (n, d, d) the vectors.
    """
    bend = np.einsum("nij,nj->ni", vectors**2, eigen)
    value = density(z, rows)
    inside = np.isfinite(value)
    gradient, hessian = np.zeros(z.shape), np.tile(np.eye(z.shape[1]), (len(z), 1, 1))
    if inside.any():
        gradient[inside], hessian[inside] = _derivatives(
            density, z[inside], rows[inside], value[inside], _steps(bend[inside]), sides=1
        )
    return _Local(value, gradient, -hessian)


def _steps(bend: Array) -> Array:
    """(n, d) steps of differences: a tenth of a standard deviation, as the diagonals (n, d) of curvatures say."""
    return np.clip(0.1 / np.sqrt(np.maximum(bend, 1.0)), 1e-6, 0.05)


def _derivatives(density: Density, z: Array, rows: Array, value: Array, h: Array, sides: int) -> tuple[Array, Array]:
    """Gradient and Hessian by central differences, all points of all rows in one batch.

    Mixed derivatives take most of the points: with one side only, half as many, they give the
    direction well enough.
    """
    n, d = z.shape
    upper = np.triu_indices(d, 1)
    unit = np.eye(d)
    mixed = unit[upper[0]] + unit[upper[1]]
    moves = np.concatenate([unit, -unit, mixed, -mixed] if sides == 2 else [unit, -unit, mixed])
    points = z[:, None, :] + moves[None] * h[:, None, :]
    f = density(points.reshape(-1, d), np.repeat(rows, len(moves))).reshape(n, len(moves))
    f = np.where(np.isfinite(f), f, value[:, None] - 1e3)
    plus, minus = f[:, :d], f[:, d : 2 * d]
    gradient = (plus - minus) / (2.0 * h)
    hessian = np.zeros((n, d, d))
    hessian[:, np.arange(d), np.arange(d)] = (plus + minus - 2.0 * value[:, None]) / h**2
    i, j = upper
    twice = f[:, 2 * d : 2 * d + len(i)] - plus[:, i] - plus[:, j] + value[:, None]
    if sides == 2:
        twice = 0.5 * (twice + f[:, 2 * d + len(i) :] - minus[:, i] - minus[:, j] + value[:, None])
    hessian[:, i, j] = hessian[:, j, i] = twice / (h[:, i] * h[:, j])
    return gradient, hessian


def distinct(found: Sequence[Optimum]) -> Optimum:
    """The rows that no better one is near, none hopelessly below the best; best first.

    Parameters
    ----------
    found : sequence of Optimum
        What climbs returned, put together.
    """
    every = together(found)
    order = np.argsort(-every.log_density)
    keep: list[int] = []
    for i in order:
        if not np.isfinite(every.log_density[i]) or every.log_density[i] < every.log_density[order[0]] - REACH:
            continue
        if not (_apart(every.z[[i]], every.z[keep], every.curvature[keep]) <= _ONE_MODE).any():
            keep.append(int(i))
    return every.rows(keep)


def together(found: Sequence[Optimum]) -> Optimum:
    """The rows of several, one after the other."""
    return Optimum(*(np.concatenate([getattr(f, field.name) for f in found]) for field in fields(Optimum)))


def _apart(z: Array, modes: Array, curvature: Array) -> Array:
    """(n, k) squared distances of places (n, d) from modes (k, d), in standard deviations."""
    apart = z[:, None] - modes
    return np.asarray(np.einsum("nki,kij,nkj->nk", apart, curvature, apart))

"""Modes of the posterior: batched Newton steps from many starts, and the normal approximation at each.

Every row is an optimisation of its own; rows may also have their own readings (refits of simulated data).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wirebayes.inference.log_posterior import Density, LogPosterior, Residuals
from wirebayes.numeric.resampling import next_power, systematic_rows
from wirebayes.numeric.spread_rows import spread_rows
from wirebayes.numeric.typing import Array

LEAST_CURVATURE = 0.3  # a standard deviation of 1.8; the widest prior, k1's, has 1.5 in its logarithm
_ANNEALED = 400  # prior draws
_EFFECTIVE = 0.2  # share of the rows that stays so at each step of the cooling
_WARM_STEPS = 4  # the last ones of the cooling
_ONE_MODE = 4.0  # squared standard deviations
_ENOUGH = 0.25  # of what a step promises to gain: with less, damped ones are tried
_LONGEST = 2.0  # step of a coordinate; they are of order one under the prior
_NARROW = 1e-2  # standard deviation assumed where none is known yet, so that differences stay inside it
_NEAR = 1e-6  # step of a derivative: far above rounding, far below any standard deviation
# added to the curvature (of order one under the prior alone), tried in one batch where a step gains too little
_DAMPINGS = np.array([1.0, 10.0, 100.0, 1e3, 1e4, 1e6])
_PATIENCE = 10.0  # times the promised gain of a step: along a bent ridge there are many such steps
_REACH = 30.0  # nats below the best mode that no mode counts
_FIRST = 9  # starts that differ in what decides where a climb ends: every pair of three ranks below
_STARTS = 36  # further ones; narrow modes take 2 to 10 % of them
_DRAWS_FOR_A_START = 2  # prior draws, some of which the model forbids
# nats up for the setting error held, down for the sensor's noise; other pairs up to 4 reach narrow modes less often
_SETTING_UP, _SENSOR_DOWN = 3.0, 1.0
# of setting errors over sensor noise, for each start in turn: standard deviations of its logarithm under the prior
_RATIOS = np.array([1.3, -1.3, 0.0])
# ranks among prior draws of the creep's rate and of its power of tension, for nine starts in turn: each pair of rate,
# power and ratio occurs once
_RANKS = np.array(
    [[0.1, 0.1], [0.1, 0.9], [0.1, 0.5], [0.9, 0.9], [0.9, 0.5], [0.9, 0.1], [0.5, 0.5], [0.5, 0.1], [0.5, 0.9]]
)
_WITHIN = 0.1  # added to these, at most
_LED, _LED_TO = 12, 0.1  # steps, at most, with a ratio kept, and the gain in nats that ends them
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
        ended : Optimum
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
    iterations : int
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

    Returns
    -------
    Optimum
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


def modes(target: LogPosterior, rng: np.random.Generator, extra: Array | None = None) -> Optimum:
    """The distinct modes of a posterior, best first (see `searches`).

    Parameters
    ----------
    target : LogPosterior
    rng : numpy.random.Generator
        Draws the starts.
    extra : (m, d) array, optional
        Further starts, in the coordinates that are sampled.

    Returns
    -------
    Optimum
    """
    return searches(target, rng, 1, extra=extra)[0]


def searches(
    target: LogPosterior,
    rng: np.random.Generator,
    n: int,
    readings: Sequence[Array] | None = None,
    *,
    starts: int = _STARTS,
    extra: Array | None = None,
) -> list[Optimum]:
    """Look for the modes of a posterior, several times side by side: climbs from prior draws.

    What decides where a climb ends is how fast the creep is, how much more it is under more tension, and whether
    setting errors or the sensor's noise explain the residuals. The first climbs differ in these. Narrow modes, which
    hardly any climb comes to that frees the noises on its way, are reached from many further prior draws with both
    noises held for some steps: setting errors much larger than those of the best mode so far and the sensor's noise
    smaller, so that the wire's parameters follow how readings change within a hold.

    Searches are independent of each other; their climbs are evaluated together.

    Parameters
    ----------
    target : LogPosterior
    rng : numpy Generator
    n : int
        How many searches.
    readings : sequence of (H, R, n) arrays, optional
        What each search sees in place of the measured readings, a sample each; NaN in a hold that it does not see.
    starts : int
        Further prior draws of each.
    extra : (m, d) array, optional
        Further starts, in sampled coordinates.

    Returns
    -------
    list of Optimum
        The distinct modes that each search found, best first.
    """
    side_by_side = _SideBySide(target, n, readings)
    drawn = [_prior(target, _DRAWS_FOR_A_START * starts, rng) for _ in range(n)]
    prior = [_possible(z, side_by_side.density(z, np.full(len(z), i))) for i, z in enumerate(drawn)]
    spread = side_by_side.with_ratios([_spread(target, z, _FIRST, rng) for z in prior])
    found = side_by_side.climbed([b if extra is None else np.vstack([b, extra]) for b in spread], [])
    return side_by_side.further(found, [_some(z, starts, rng) for z in prior])


@dataclass(frozen=True)
class Search:
    """What a search found that began with annealing.

    Attributes
    ----------
    modes : Optimum
        The distinct modes, best first.
    warm, cold : (n, d) arrays
        Rough draws of the density to some power below one, and of the density itself.
    height : (n,) array
        Log densities of the cold ones.
    """

    modes: Optimum
    warm: Array
    cold: Array
    height: Array


def search(target: LogPosterior, rng: np.random.Generator, *, extra: Array | None = None) -> Search:
    """Look for the modes, and for places that roughly follow the posterior: prior draws are annealed to it, too.

    Climbs begin as in `searches`, and at places that the annealing passed, the highest one and some far from one
    another: where it ends, a mode of less weight may have died out.

    Parameters
    ----------
    target : LogPosterior
    rng : numpy Generator
    extra : (m, d) array, optional
        Further starts, in sampled coordinates.

    Returns
    -------
    Search
    """
    alone = _SideBySide(target, 1, None)
    z = _prior(target, _ANNEALED, rng)
    value = alone.density(z, np.zeros(len(z), int))
    passed, height = _cooled(lambda z: alone.density(z, np.zeros(len(z), int)), z, value, rng)
    width = passed.std(axis=0)
    apart = spread_rows(passed / np.where(width > 0, width, 1.0), _FIRST, rng)
    possible = _possible(z, value)
    [spread] = alone.with_ratios([_spread(target, possible, _FIRST, rng)])
    begin = [spread, passed[[int(np.argmax(height)), *apart]], *([] if extra is None else [extra])]
    found = alone.climbed([np.vstack(begin)], [])
    [every] = alone.further(found, [_some(possible, _STARTS, rng)])
    return Search(every, passed[-_WARM_STEPS * _ANNEALED :], passed[-_ANNEALED:], height[-_ANNEALED:])


class _SideBySide:
    """Climbs on n densities of the same parameters, evaluated together.

    Parameters
    ----------
    target : LogPosterior
    n : int
    readings : sequence of (H, R, n) arrays or None
        See `searches`.
    """

    def __init__(self, target: LogPosterior, n: int, readings: Sequence[Array] | None) -> None:
        self.n, self.noises = n, target.coordinates.noises
        self.sensors, self.settings = target.coordinates.sensor_columns, target.coordinates.setting_columns
        self.density, self.residuals = target.rowwise(readings)

    def climbed(self, begin: Sequence[Array], before: Sequence[Optimum]) -> list[Optimum]:
        """The modes to which climbs lead from (m, d) places of each density, but for those known before."""
        of = np.repeat(np.arange(self.n), [len(b) for b in begin])
        residuals = self.residuals
        end = climb(
            lambda z, rows: self.density(z, of[rows]), np.vstack(begin),
            None if residuals is None else lambda z, rows: residuals(z, of[rows]),
            of=of, known=before, reach=_REACH, curvature_at_end=False,
        )  # fmt: skip
        found = [distinct([end.rows(of == i)]) for i in range(self.n)]
        of = np.repeat(np.arange(self.n), [len(f.z) for f in found])
        every = curved(self.density, together(found), of)
        return [every.rows(of == i) for i in range(self.n)]

    def with_ratios(self, begin: Sequence[Array]) -> Sequence[Array]:
        """Places (m, d) of each density led uphill for some steps, each with one of several ratios of the noises kept.

        Above all, what explains the residuals, setting errors or the sensor's noise, decides at which of several modes
        a climb ends. Whatever they were, both grow at first from a start that fits badly, and the wire's parameters
        follow them. With the ratio kept, the wire is fitted as if it were known; the climb that comes after frees it.
        """
        ratio = np.concatenate([np.resize(_RATIOS, len(b)) for b in begin])

        def kept(z: Array, rows: Array) -> Array:
            for pair in self.noises:
                z[:, pair.setting] = z[:, pair.sensor] + pair.middle + pair.spread * ratio[rows]
            return z

        return [led.z for led in self._led(begin, [p.setting for p in self.noises], kept)] if self.noises else begin

    def further(self, found: Sequence[Optimum], begin: Sequence[Array]) -> list[Optimum]:
        """The modes of each density, with those found from further (m, d) places with the noises held for some steps.

        Climbs that come to the same place meanwhile go on as one.
        """
        best = np.repeat([f.z[np.argmax(f.log_evidence)] for f in found], [len(b) for b in begin], axis=0)

        def held(z: Array, rows: Array) -> Array:
            z[:, self.settings] = best[rows][:, self.settings] + _SETTING_UP
            z[:, self.sensors] = best[rows][:, self.sensors] - _SENSOR_DOWN
            return z

        if noises := [*self.settings, *self.sensors]:
            begin = [distinct([led]).z for led in self._led(begin, noises, held, together=True)]
        return [distinct([old, new]) for old, new in zip(found, self.climbed(begin, found), strict=True)]

    def _led(
        self, begin: Sequence[Array], fixed: list[int], kept: Callable[[Array, Array], Array], together: bool = False
    ) -> list[Optimum]:
        """Where some steps uphill lead from (m, d) places of each density, with some coordinates fixed by the others.

        Climbs have the other coordinates alone: no derivative is taken by the fixed ones, which `kept` sets.
        """
        of = np.repeat(np.arange(self.n), [len(b) for b in begin])
        start = np.vstack(begin)
        free = np.delete(np.arange(start.shape[1]), fixed)

        def whole(z: Array, rows: Array) -> Array:
            out = np.empty((len(z), start.shape[1]))
            out[:, free] = z
            return kept(out, rows)

        found = climb(
            lambda z, rows: self.density(whole(z, rows), of[rows]), start[:, free],
            lambda z, rows: self.residuals(whole(z, rows), of[rows]),
            iterations=_LED, tolerance=_LED_TO, of=of if together else None, curvature_at_end=False,
        )  # fmt: skip
        curvature = np.zeros((len(of), start.shape[1], start.shape[1]))
        curvature[np.ix_(np.arange(len(of)), free, free)] = found.curvature
        found = Optimum(whole(found.z, np.arange(len(of))), found.log_density, curvature, found.converged)
        return [found.rows(of == i) for i in range(self.n)]


def _prior(target: LogPosterior, n: int, rng: np.random.Generator) -> Array:
    """(n, d) prior draws in sampled coordinates."""
    return target.coordinates.to_sampled(target.problem.prior.rvs(n, rng))


def _some(z: Array, n: int, rng: np.random.Generator) -> Array:
    """(n, d) of the places (m, d), none twice where there are enough."""
    return np.asarray(z[rng.choice(len(z), n, replace=n > len(z))])


def _possible(z: Array, value: Array) -> Array:
    """Those of (m, d) places where the density is above zero; all, if it is nowhere."""
    inside = np.isfinite(value)
    return z[inside] if inside.any() else z


def _spread(target: LogPosterior, z: Array, n: int, rng: np.random.Generator) -> Array:
    """(n, d) of the places (m, d): where the creep is slow, fast and between, each with a small and a large power."""
    kinds = target.coordinates.kinds_of_creep
    if not kinds:
        return _some(z, n, rng)
    found = np.stack([np.argsort(np.argsort(z[:, columns].mean(axis=1))) / len(z) for columns in kinds], axis=1)
    wanted = np.resize(_RANKS, (n, 2))[:, : len(kinds)] + _WITHIN * rng.uniform(-1.0, 1.0, (n, len(kinds)))
    return np.asarray(z[((found - wanted[:, None]) ** 2).sum(axis=2).argmin(axis=1)])


def distinct(found: Sequence[Optimum]) -> Optimum:
    """The rows that no better one is near, none hopelessly below the best; best first.

    Parameters
    ----------
    found : sequence of Optimum
        What climbs returned, put together.

    Returns
    -------
    Optimum
    """
    every = together(found)
    order = np.argsort(-every.log_density)
    keep: list[int] = []
    for i in order:
        if not np.isfinite(every.log_density[i]) or every.log_density[i] < every.log_density[order[0]] - _REACH:
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


def _cooled(density: Callable[[Array], Array], z: Array, value: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """Places (n, d) and their log densities (n,), from the density to powers that grow from 0 to 1, all together.

    Each step of the power leaves a fifth of the rows effective and moves them by differential evolution: near enough to
    the modes to find them.
    """
    m, d = z.shape
    value = np.where(np.isfinite(value), value, -1e300)
    power, way, height = 0.0, [], []
    while power < 1.0:
        step = next_power(value, 1.0 - power, _EFFECTIVE)
        power += step
        weight = np.exp(step * (value - value.max()))
        kept = systematic_rows(weight, m, rng)
        z, value = z[kept], value[kept]
        one, other = rng.integers(m, size=(2, m))
        moved = z + 2.38 / np.sqrt(2.0 * d) * (z[one] - z[other]) + 1e-3 * rng.normal(size=z.shape)
        tried = density(moved)
        taken = np.log(rng.uniform(size=m)) < power * (tried - value)
        z = np.where(taken[:, None], moved, z)
        value = np.where(taken, tried, value)
        way.append(z)
        height.append(value)
    return np.concatenate(way), np.concatenate(height)

"""Climbs to the maxima of a density: batched Newton steps, and the normal approximation where they end.

Every row is an optimisation of its own; rows may also have their own readings (refits of simulated data).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np

from wirebayes.inference.differences import gradient_and_hessian, steps_apart
from wirebayes.inference.log_posterior import Density, Residuals
from wirebayes.inference.optimum import Ends, Optimum, nowhere
from wirebayes.numeric.typing import Array, Bools, Ints

_ENOUGH = 0.25  # of what a step promises to gain: with less, damped ones are tried
_LONGEST = 2.0  # step of a coordinate; they are of order one under the prior
_FLATTEST = 1e-9  # of the largest curvature, that none falls below: a direction that is not seen
_NARROW = 1e-2  # standard deviation assumed where none is known yet, so that differences stay inside it
_NEAR = 1e-6  # step of a derivative: far above rounding, far below any standard deviation
# nats by which differences may make a normal approximation's volume smaller than the expected information does: of
# 6,217 places of simulated tests it was 3 at most, but for eleven beside a jump, where it was 4 to 27
_MOST_CURVED = 3.5
# added to the curvature (of order one under the prior alone), tried in one batch where a step gains too little
_DAMPINGS = np.array([1.0, 10.0, 100.0, 1e3, 1e4, 1e6])
_PATIENCE = 10.0  # times the promised gain of a step: along a bent ridge there are many such steps
_SLOW = 15  # steps: a row that still climbs then creeps along a ridge, where the density is less curved than expected
_MOST_POINTS = 2000  # of one step by differences: a batch of so many takes hardly longer than a small one
_RELAX, _LEAST_DAMPING = 0.2, 0.3  # share of the damping kept after a step that was good; less than the latter is none


@dataclass(frozen=True)
class _Local:
    """A density at places: its value (n,), gradient (n, d), and curvature (n, d, d).

    The curvature is minus the Hessian, or nearly so, and positive definite.
    """

    value: Array
    gradient: Array
    curvature: Array

    def rows(self, which: Bools) -> "_Local":
        """Some of the places."""
        return _Local(self.value[which], self.gradient[which], self.curvature[which])


@dataclass
class _Climbs:
    """Where n climbs stand, and what each does next.

    Attributes
    ----------
    z, value, gradient, curvature
        The places (n, d), and there the density (n,), its gradient (n, d) and its curvature (n, d, d).
    ahead : (n, d) array
        Where to look next: at the end of a step, in the hope that it is taken, or, after another one, at `z`.
    promised : (n,) array
        What that step gains, were the density a parabola.
    arrived : (n,) bool array
        Whether `ahead` is `z`.
    damping : (n,) array
    done, converged : (n,) bool arrays
    """

    z: Array
    value: Array
    gradient: Array
    curvature: Array
    ahead: Array
    promised: Array
    arrived: Bools
    damping: Array
    done: Bools
    converged: Bools

    @classmethod
    def beginning(cls, start: Array) -> "_Climbs":
        """At the starts (n, d), where nothing is known yet."""
        n, d = start.shape
        return cls(
            z=start.copy(),
            value=np.full(n, -np.inf),
            gradient=np.zeros((n, d)),
            curvature=np.tile(_NARROW**-2 * np.eye(d), (n, 1, 1)),
            ahead=start.copy(),
            promised=np.zeros(n),
            arrived=np.ones(n, bool),
            damping=np.zeros(n),
            done=np.zeros(n, bool),
            converged=np.zeros(n, bool),
        )

    def gain_enough(self, rows: Ints, ahead: Array) -> Bools:
        """Whether rows gain what makes a step good, given their densities ahead; at its start any density will do."""
        least = np.where(self.arrived[rows], -np.inf, self.value[rows] + _ENOUGH * self.promised[rows])
        return np.isfinite(ahead) & (ahead > least)

    def go_on(self, density: Density, rows: Ints, local: _Local, tolerance: float) -> Ints:
        """Let rows take the steps to where they looked, or lead them back, and return those that took theirs."""
        good = self.gain_enough(rows, local.value)
        if good.all():
            self.take_step(rows, local, tolerance)
            return rows
        self.lead_back(density, rows[~good])
        here = rows[good]
        self.take_step(here, local.rows(good), tolerance)
        return here

    def lead_back(self, density: Density, rows: Ints) -> None:
        """Rows that do not gain enough: done if they have just begun, else led to where a damped step leads."""
        at_start = self.arrived[rows]
        self.done[rows[at_start]] = True  # there is no density where they are
        self.lead_damped(density, rows[~at_start])

    def lead_damped(self, density: Density, rows: Ints) -> None:
        """Lead rows whose step was not good to where the best damped one leads; those that none leads up are done."""
        if not len(rows):
            return
        trial, tried, by = _damped(density, self.z[rows], rows, self.gradient[rows], self.curvature[rows])
        better = tried > self.value[rows]
        self.done[rows] = ~better
        moved = rows[better]
        self.z[moved] = self.ahead[moved] = trial[better]
        self.value[moved] = tried[better]
        self.damping[moved] = by[better]
        self.arrived[moved] = True

    def take_step(self, rows: Ints, local: _Local, tolerance: float) -> None:
        """Lead rows to what they looked at, and plan their next steps from what is known there."""
        here = self.ahead[rows]
        self.z[rows] = here
        self.value[rows] = local.value
        self.gradient[rows] = local.gradient
        self.curvature[rows] = local.curvature
        damping = self._relaxed(rows)
        undamped_and_damped = np.stack([np.zeros(len(rows)), damping], axis=1)
        steps = _newton_steps(local.gradient, local.curvature, undamped_and_damped)
        gains = 0.5 * np.einsum("nki,ni->nk", steps, local.gradient)
        is_near = gains[:, 0] < tolerance
        self.converged[rows] = is_near
        self.done[rows] = is_near
        self.damping[rows] = damping
        self.promised[rows] = gains[:, 1]
        self.ahead[rows] = here + _no_longer(steps[:, 1])
        self.arrived[rows] = False

    def _relaxed(self, rows: Ints) -> Array:
        """(m,) dampings of the next steps: less where the last step was good, none where they hardly matter."""
        damping = self.damping[rows]
        damping = np.where(self.arrived[rows], damping, damping * _RELAX)
        damping[damping < _LEAST_DAMPING] = 0.0
        return damping

    def most_promised(self, rows: Ints) -> Array:
        """(n,) densities that rows hardly rise beyond."""
        return self.value[rows] + _PATIENCE * self.promised[rows]

    def give_up_below(self, rows: Ints, least: Array) -> None:
        """Give up rows that hardly rise to the least densities (m,) that count."""
        hopeless = self.most_promised(rows) < least
        self.give_up(rows[hopeless])

    def give_up(self, rows: Ints) -> None:
        self.done[rows], self.value[rows] = True, -np.inf

    def optimum(self, rows: Ints) -> Optimum:
        """Where rows stand."""
        return Optimum(self.z[rows], self.value[rows], self.curvature[rows], self.converged[rows])


def climb(
    density: Density,
    start: Array,
    residuals: Residuals | None = None,
    *,
    iterations: int = 60,
    tolerance: float = 1e-5,
    of: Ints | None = None,
    known: Sequence[Optimum] = (),
    reach: float = np.inf,
    curvature_at_end: bool = True,
) -> Optimum:
    """Maximise a log density from every row of `start`.

    The steps are Newton's, damped where they gain too little (Levenberg and Marquardt): on a bent ridge a damped step
    stays near the ridge, a shortened one does not. With `residuals` the curvature is the expected information (Fisher
    scoring), which d + 1 evaluations give and which also points uphill where the density is not concave. Without, and
    for the last rows, which creep along a ridge by the former, differences give the Hessian, which takes d² / 2.

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
    usual = partial(_by_differences, density) if residuals is None else partial(_by_residuals, residuals)
    group = np.zeros(len(start), np.int64) if of is None else of
    ends = Ends.of(known or [nowhere(start.shape[1])])
    climbs = _Climbs.beginning(start)
    last = np.empty(0, np.intp)
    look = usual
    for step in range(iterations):
        rows = np.flatnonzero(~climbs.done)
        if not len(rows):
            break
        if not len(last) and _are_the_last(step, len(rows), start.shape[1]):
            last = rows
            look = partial(_by_differences, density)
        local = look(climbs.ahead[rows], rows, climbs.curvature[rows])
        here = climbs.go_on(density, rows, local, tolerance)
        left = rows[~climbs.done[rows]]
        if reach < np.inf:
            least = _best(climbs.value, group) - reach
            climbs.give_up_below(left, least[left])
        if of is not None:
            ended = here[climbs.converged[here]]
            if len(ended):
                ends = ends.joined(of[ended], climbs.optimum(ended))
            same = ends.near(of[left], climbs.z[left], climbs.value[left])
            climbs.give_up(left[same])
    if residuals is not None and len(last):
        climbs.curvature[last] = usual(climbs.z[last], last, climbs.curvature[last]).curvature
    found = climbs.optimum(np.arange(len(start)))
    return curved(density, found) if curvature_at_end else found


def _are_the_last(step: int, n: int, d: int) -> bool:
    """Whether n rows of d coordinates have climbed so long, and are so few, that differences are to end them."""
    points = n * d * d // 2
    return step >= _SLOW and points <= _MOST_POINTS


def _best(value: Array, group: Ints) -> Array:
    """(n,) the greatest of the values (n,) in each one's group (n,)."""
    best = np.full(group.max(initial=0) + 1, -np.inf)
    np.maximum.at(best, group, value)
    return best[group]


def curved(density: Density, found: Optimum, which: Ints | None = None) -> Optimum:
    """The same places with the curvature of the density itself, where that is finite and smooth.

    Beside a jump, as where a wire goes slack, differences would take the jump for curvature: there the curvature stays.

    Parameters
    ----------
    density : function of ((m, d) points, (m,) row numbers) to (m,) values
    found : Optimum
        Of n places.
    which : (n,) int array, optional
        The row numbers of the places; their own where left out.
    """
    if which is None:
        which = np.arange(len(found.z))
    rows = np.flatnonzero(np.isfinite(found.log_density))
    if not len(rows):
        return found
    before = found.curvature[rows]
    steps = steps_apart(np.einsum("nii->ni", before))
    _, hessian = gradient_and_hessian(density, found.z[rows], which[rows], found.log_density[rows], steps, sides=2)
    exact = _positive(-hessian)
    is_smooth = _log_volume(before) - _log_volume(exact) < _MOST_CURVED
    curvature = found.curvature.copy()
    curvature[rows[is_smooth]] = exact[is_smooth]
    return replace(found, curvature=curvature)


def _log_volume(curvature: Array) -> Array:
    """(n,) log volumes of normal approximations with these curvatures (n, d, d), but for a constant."""
    _, log_determinant = np.linalg.slogdet(curvature)
    return -0.5 * log_determinant


def _damped(density: Density, z: Array, rows: Ints, gradient: Array, curvature: Array) -> tuple[Array, Array, Array]:
    """Places (n, d) to which the best of several damped steps leads, the density there, and the dampings (n,)."""
    n, d = z.shape
    dampings = np.tile(_DAMPINGS, (n, 1))
    steps = _newton_steps(gradient, curvature, dampings)
    trial = z[:, None] + _no_longer(steps)
    tried = density(trial.reshape(-1, d), np.repeat(rows, len(_DAMPINGS))).reshape(n, -1)
    best = np.argmax(tried, axis=1)
    i = np.arange(n)
    return trial[i, best], tried[i, best], _DAMPINGS[best]


def _newton_steps(gradient: Array, curvature: Array, damping: Array) -> Array:
    """(n, k, d) steps with k dampings (n, k): the more damped, the less far along what is little curved."""
    identity = np.eye(gradient.shape[1])
    damped = curvature[:, None] + damping[..., None, None] * identity
    slope = gradient[:, None, :, None]
    return np.linalg.solve(damped, slope)[..., 0]


def _no_longer(step: Array) -> Array:
    """Steps (..., d), shortened where a coordinate would move by more than the longest."""
    longest = np.abs(step).max(axis=-1, keepdims=True)
    return step * np.minimum(1.0, _LONGEST / np.maximum(longest, 1e-300))


def _positive(matrices: Array) -> Array:
    """The symmetric matrices (n, d, d) with their eigenvalues made positive."""
    eigen, vectors = np.linalg.eigh(matrices)
    size = np.abs(eigen)
    scale = np.maximum(size.max(axis=1, keepdims=True), 1e-8)
    eigen = np.maximum(size, _FLATTEST * scale)
    return np.einsum("nij,nj,nkj->nik", vectors, eigen, vectors)


def _by_residuals(residuals: Residuals, z: Array, rows: Ints, _: Array) -> _Local:
    """Curvature as the expected information, and the gradient, from one more evaluation a coordinate."""
    n, d = z.shape
    points = z[:, None] + _moves(d)
    flat, each = residuals(points.reshape(-1, d), np.repeat(rows, d + 1))
    values = flat.reshape(n, d + 1)
    here = values[:, :1]
    with np.errstate(all="ignore"):
        slopes = _slopes(each.reshape(-1, n, d + 1))
        curvature = np.swapaxes(slopes, 1, 2) @ slopes
        one_sided = (values[:, 1:] - here) / _NEAR
        bend = np.einsum("nii->ni", curvature)
        gradient = _finite(one_sided + 0.5 * _NEAR * bend)
        flattest = _FLATTEST * np.maximum(bend.max(axis=1), 1e-8)
        curvature += flattest[:, None, None] * np.eye(d)
    return _Local(here[:, 0], gradient, curvature)


def _slopes(residuals: Array) -> Array:
    """(n, k, d) derivatives of residuals (k, n, 1 + d), at each place and at its neighbours."""
    moved = residuals[..., 1:] - residuals[..., :1]
    moved /= _NEAR
    return _finite(np.moveaxis(moved, 0, 1))


@cache
def _moves(d: int) -> Array:
    """(d + 1, d) none, and one along each coordinate."""
    return np.concatenate([np.zeros((1, d)), _NEAR * np.eye(d)])


def _finite(values: Array) -> Array:
    """The values, 0 where they are no numbers; no other array where all are."""
    return values if np.isfinite(values.sum()) else np.where(np.isfinite(values), values, 0.0)


def _by_differences(density: Density, z: Array, rows: Ints, last: Array) -> _Local:
    """Curvature and gradient from differences of values, as far apart as the last curvatures (n, d, d) suggest."""
    n, d = z.shape
    value = density(z, rows)
    gradient = np.zeros((n, d))
    hessian = np.tile(np.eye(d), (n, 1, 1))
    inside = np.isfinite(value)
    if inside.any():
        bend = np.einsum("nii->ni", last[inside])
        steps = steps_apart(bend)
        slope, bends = gradient_and_hessian(density, z[inside], rows[inside], value[inside], steps, sides=1)
        gradient[inside] = slope
        hessian[inside] = bends
    return _Local(value, gradient, _positive(-hessian))

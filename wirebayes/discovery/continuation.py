"""The global test from starting points with larger effects, to which the parameters have already adapted.

The plain fit bends to absorb what is missing, and from where the fit ends a large effect may look like nothing. So the
amplitude of each effect is raised along a path: at every step the parameters follow by Gauss-Newton steps, and the
effect's log Bayes factor is evaluated there, linear over the range of amplitudes that the step stands for. Simulated
data sets follow the same paths, which gives the distribution of the result under chance.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import repeat
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from wirebayes.discovery.linear_scan import (
    ABSORBED,
    RATIOS,
    Probe,
    Scan,
    Tangent,
    damp,
    forms,
    moving_columns,
    residuals,
    tangent,
)
from wirebayes.discovery.refit import occam
from wirebayes.discovery.screening import (
    Candidate,
    GlobalTest,
    Replicates,
    Scale,
    by_name,
    counted,
    shared_amplitude,
)
from wirebayes.discovery.settings import BY_LARGER
from wirebayes.inference.laplace_fit import LaplaceFit, column_of
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.model import likelihoods
from wirebayes.numeric.linear_algebra import cholesky, solve
from wirebayes.numeric.typing import Array
from wirebayes.processes.workers import ParallelMap
from wirebayes.wire.effect import Effect, EventEffect

_FIRST, _LAST = 1.5, 24.0  # δ of the rungs
_RAW = 10.0  # δ of the first one before the parameters take their part, if that is less
_APART, _MOST = 2.0, 8  # largest ratio of neighbours, unless they would be more than that many
_STEPS, _FEW = 4, 2  # of the parameters at a rung, and at the low ones
# of a Gauss-Newton step, tried in one batch: whole, and shorter where the tangent does not reach so far
_LENGTHS = np.array([1.0, 0.4, 0.1])
_SETTLED, _HOPELESS = 0.05, -15.0  # nats: a gain too small to go on for, a rung from which none leads up again
_NEVER = -1e300  # log Bayes factor of what cannot be computed: finite, so that sums of it stay numbers
_MIDDLE = 6.0  # δ for which a one-sided form is tried
_LONGEST = 3.0  # of a step, in any sampled coordinate
_JUMP = 1e8  # standard deviations a unit of any parameter: no tangent where the readings jump
_LARGE = 1e200  # above any sum of squares, and its square root finite
_PIECE = 64  # rows weighed at once: what stays in the cache
_FIRST_ROWS, _ROWS = 40, 160  # data sets that climb at once, at first and at most
_CLEARLY = 3.0  # nats of surprise beyond all simulations, from which a name needs no more of them
_TRIED = 3  # names
_LEVEL = 0.95  # of chance, which a name has to exceed by most to be tried first


@dataclass(frozen=True)
class AmplitudePath:
    """A form of an effect and the amplitudes it is led through, from several starts at once.

    Attributes
    ----------
    probes : tuple of Probe
        One for each start: they differ in their shape constants.
    amplitudes : (rungs, starts) array
        Signed distances from neutral, growing in size.
    candidates : tuple of Candidate
        Of this form, on the blocks where it may act.
    """

    probes: tuple[Probe, ...]
    amplitudes: Array
    candidates: tuple[Candidate, ...]

    @property
    def effect(self) -> Effect:
        return self.probes[0].effect

    @property
    def blocks(self) -> set[int]:
        return {b for c in self.candidates for b in c.blocks}


def ladders(
    blocks: Sequence[LaplaceFit], trials: Sequence[Probe], candidates: Sequence[Candidate], data: Sequence[Scan]
) -> list[AmplitudePath]:
    """Ladders of amplitudes for each form that lasts: a start for each trial of its shape constants and each sign.

    There are none for events: they move the level of their hold, which the linear scan sees.

    Parameters
    ----------
    blocks : sequence of LaplaceFit
        The plain fits, one a material.
    trials : sequence of Probe
        Every form at the amplitudes of the linear scan.
    candidates : sequence of Candidate
        Which probe may act on which blocks.
    data : sequence of Scan
        The linear scan of each block's readings; it gives the size that one unit of amplitude has in them.

    Returns
    -------
    list of AmplitudePath
    """
    alike: dict[str, dict[tuple[float, ...], list[int]]] = {}
    for k, probe in enumerate(trials):
        if not isinstance(probe.effect, EventEffect):
            shape = tuple(probe.own[name] for name in probe.effect.columns()[1:])
            alike.setdefault(probe.effect.key, {}).setdefault(shape, []).append(k)
    out = []
    for shapes in alike.values():
        every = [k for numbers in shapes.values() for k in numbers]
        here = tuple(c for c in candidates if c.probe == every[0])
        on = sorted({b for c in here for b in c.blocks})
        strength = {k: float(np.sqrt(sum(data[b].norm[0, k] ** 2 for b in on))) for k in every}
        starts: list[tuple[Probe, float, float]] = []
        for numbers in shapes.values():
            visible = [k for k in numbers if strength[k] > 0]
            if visible:
                # Of a one-sided form the probe that lies in the middle of the ladder.
                k = min(visible, key=lambda k: abs(np.log(strength[k] * trials[k].step / _MIDDLE)))
                raw = float(np.sqrt(sum(_raw(blocks[b], trials[k]) for b in on)))
                ends = min(_FIRST / strength[k], _RAW / raw), _LAST / strength[k]
                starts += [(trials[k], s * ends[0], s * ends[1]) for s in ((1,) if trials[k].one_sided else (1, -1))]
        if starts:
            probes, first, last = zip(*starts, strict=True)
            widest = float(np.max(np.divide(last, first)))
            rungs = min(1 + int(np.ceil(np.log(widest) / np.log(_APART))), _MOST)
            out.append(AmplitudePath(probes, np.geomspace(first, last, rungs), here))
    return out


def _raw(block: LaplaceFit, probe: Probe) -> float:
    """Squared length of a unit of the effect in the readings, in standard deviations of one."""
    shapes = forms(block.target, block.modes.z[:1], [probe])
    theta, total = block.target.coordinates.to_natural(block.modes.z[:1]), 0.0
    for sample, shape in zip(block.target.problem.samples, shapes, strict=True):
        own = block.target.problem.parameters(theta, sample)
        variance = likelihoods.reading_variance(own["sensor_sd"], sample.resolution)
        total += float((shape[sample.protocol.mask] ** 2).sum() / variance[0])
    return total


@dataclass(frozen=True)
class Climbed:
    """A block on a ladder ``(rungs starts, n)``: log Bayes factor over each stretch, where, and δ per amplitude."""

    log_bayes: Array
    amplitude: Array
    norm: Array


@dataclass(frozen=True)
class Start:
    """Where ladders begin.

    Attributes
    ----------
    z : (places n, d) array
        Places without the effect of n data sets, in the coordinates that are sampled.
    log_density : (places n,) array
        Log marginal density, each in the units of its place.
    largest : (places n,) array
        The largest among the places of each data set, in the same units.
    data_sets : int
    readings : sequence of (H, R, n) arrays or None
        Theirs, a sample; None for the measured ones.
    degrees : int
        Readings less parameters.
    """

    z: Array
    log_density: Array
    largest: Array
    data_sets: int
    readings: Sequence[Array] | None
    degrees: int


def start(block: LaplaceFit, z: Array, readings: Sequence[Array] | None = None) -> Start:
    """The best places without an effect, of the same density and by the same steps as on a ladder.

    The plain fit is the best with its own noise; with the noise integrated out some place nearby is better, by up to a
    tenth of a nat where it was measured. Places that differ in their noise are compared in the same units.

    Parameters
    ----------
    block : LaplaceFit
    z : (n, d) array
        The plain fits of n data sets, sampled coordinates.
    readings : sequence of (H, R, n) arrays, optional
        Their readings, a sample; the measured ones when left out.
    """
    target, n = block.target, len(z)
    free = moving_columns(target.problem)
    y = z.copy()
    units = _log_units(target, y)
    best, height, rows = y.copy(), np.full(len(y), -np.inf), np.arange(len(y))
    for step in range(_STEPS + 1):
        own = None if readings is None else [r[..., rows % n] for r in readings]
        with np.errstate(all="ignore"):
            x = tangent(target, y[rows], own, free)
        here = _weigh(x, np.zeros_like(x.residual), 0.0, 0.0, x.degrees)
        value = np.nan_to_num(here.height + x.prior, nan=-np.inf)
        with np.errstate(invalid="ignore"):
            gain = value - height[rows]
        better = gain > 0
        best[rows[better]], height[rows[better]] = y[rows[better]], value[better]
        go = np.flatnonzero(np.minimum(gain, here.promise) >= _SETTLED)
        if step == _STEPS or not len(go):
            break
        rows, own = rows[go], None if own is None else [r[..., go] for r in own]
        y[rows] = _follow(target, y[rows], own, x.of(go), here.of(go), free, x.degrees)
    largest = (height - units).reshape(-1, n).max(axis=0)
    return Start(best, height, np.tile(largest, len(y) // n) + units, n, readings, x.degrees)


def _log_units(target: LogPosterior, z: Array) -> Array:
    """(n,) log of the units in which readings are weighed, their standard deviations, summed over all readings."""
    theta, total = target.coordinates.to_natural(z), np.zeros(len(z))
    for sample in target.problem.samples:
        own = target.problem.parameters(theta, sample)
        variance = likelihoods.reading_variance(own["sensor_sd"], sample.resolution)
        total += 0.5 * sample.protocol.mask.sum() * np.log(variance)
    return total


def climb(block: LaplaceFit, ladder: AmplitudePath, begin: Start) -> Climbed:
    """Lead an effect through its amplitudes.

    Parameters
    ----------
    block : LaplaceFit
    ladder : AmplitudePath
    begin : Start
        Of n data sets.
    """
    n = begin.data_sets
    ascent, y = _begin(block, ladder, begin)
    moving = [i for i in moving_columns(ascent.target.problem) if i != ascent.column]
    shapes = set(ladder.effect.columns()[1:])
    rigid = [i for i in moving if ascent.target.problem.names[i].split("[")[0] not in shapes]
    every = np.tile(ladder.amplitudes, len(y) // (len(ladder.probes) * n)).repeat(n, axis=1)
    unseen = _Places.unseen(y)
    best, found, alive = _Places.unseen(y), list[_Places](), np.ones(n, bool)
    for amplitudes in every:
        # Shape constants mean nothing while the amplitude is small, and would wander.
        is_low = bool((np.abs(amplitudes) < 0.999 * np.abs(every[-1]) * _FIRST / _LAST).all())
        rung = ascent.look(y, amplitudes, alive, rigid if is_low else moving, _FEW if is_low else _STEPS)
        y = rung.z
        found.append(rung)
        best.improve(np.arange(len(y)), rung)
        if not is_low:
            alive = alive & (ascent.best_start(rung.log_bayes + ascent.behind) >= _HOPELESS)
        if ascent.is_beyond(amplitudes) or not alive.any():
            found += [unseen] * (len(ladder.amplitudes) - len(found))
            break
    found.append(ascent.look(best.z, best.amplitude, np.ones(n, bool), moving, _STEPS))
    rungs = ([getattr(rung, name) for rung in found] for name in ("log_bayes", "amplitude", "norm"))
    return Climbed(*(np.array(values).reshape(-1, n) for values in rungs))


@dataclass(frozen=True)
class _Places:
    """Places (m, d) of m climbs, and the log Bayes factor, the amplitude and δ per amplitude there, (m,) each."""

    z: Array
    log_bayes: Array
    amplitude: Array
    norm: Array

    @classmethod
    def unseen(cls, z: Array, amplitude: Array | None = None) -> "_Places":
        """Places at which nothing has been evaluated yet."""
        nothing = np.zeros(len(z)) if amplitude is None else amplitude
        return cls(z.copy(), np.full(len(z), _NEVER), nothing.copy(), np.zeros(len(z)))

    def improve(self, rows: Array, other: "_Places") -> NDArray[np.bool_]:
        """Take over, in place, the others' places where they are better than these in some rows, and say where."""
        better = other.log_bayes > self.log_bayes[rows]
        for f in fields(self):
            getattr(self, f.name)[rows[better]] = getattr(other, f.name)[better]
        return np.asarray(better)


@dataclass(frozen=True)
class _Ascent:
    """What does not change on the way up a ladder.

    Attributes
    ----------
    target : LogPosterior
        Of the block with the effect.
    column : int
        Of the amplitude.
    neutral, low, high : float
        Where the amplitude changes nothing, and its ends.
    readings : sequence of (H, R, n) arrays or None
    data_sets, degrees : int
    nothing : (starts n,) array
        The largest log marginal density without the effect.
    behind : (starts n,) array
        How much less it is where the start is.
    half : (starts n,) array
        Ratio of an amplitude to where the stretch of its rung ends.
    """

    target: LogPosterior
    column: int
    neutral: float
    low: float
    high: float
    readings: Sequence[Array] | None
    data_sets: int
    degrees: int
    nothing: Array
    behind: Array
    half: Array

    def best_start(self, values: Array) -> Array:
        """(n,) the largest value of each data set."""
        return np.asarray(values.reshape(-1, self.data_sets).max(axis=0))

    def is_beyond(self, amplitudes: Array) -> bool:
        """Whether all amplitudes have reached their ends."""
        return bool(np.isin(np.clip(self.neutral + amplitudes, self.low, self.high), (self.low, self.high)).all())

    def look(self, z: Array, amplitude: Array, alive: NDArray[np.bool_], free: list[int], steps: int) -> _Places:
        """The best places at one step of the path: the other parameters follow while the amplitude is held.

        A data set goes on for as long as it gains something from any of its starts.

        Parameters
        ----------
        z : (starts n, d) array
            Where the step begins, in the coordinates that are sampled.
        amplitude : (starts n,) array
            The effect's distance from neutral at this step.
        alive : (n,) bool array
            Data sets that are still followed.
        free : list of int
            Columns of the parameters that follow.
        steps : int
            Gauss-Newton steps at most.

        Returns
        -------
        _Places
        """
        n, scale = self.data_sets, self.target.coordinates.scale[self.column]
        ends = (1.0, 1.0 / self.half, self.half)
        at, near, far = (np.clip(self.neutral + amplitude * f, self.low, self.high) for f in ends)
        z = z.copy()
        z[:, self.column] = at / scale
        first, last = np.minimum(near, far) - at, np.maximum(near, far) - at
        best = _Places.unseen(z, at - self.neutral)
        rows = np.flatnonzero(np.tile(alive, len(z) // n))
        for step in range(steps + 1):
            own = None if self.readings is None else [r[..., rows % n] for r in self.readings]
            with np.errstate(all="ignore"):
                both = tangent(self.target, z[rows], own, [*free, self.column])
            signature = both.parameters[..., -1] / scale
            here = _weigh(_without_last(both), signature, first[rows], last[rows], self.degrees)
            lr = np.nan_to_num(here.height + both.prior - self.nothing[rows], nan=_NEVER, neginf=_NEVER)
            gain = np.full(len(z), -np.inf)
            gain[rows] = np.minimum(lr - best.log_bayes[rows], here.promise)
            better = best.improve(rows, _Places(z[rows], lr, (at - self.neutral)[rows] + here.move, here.norm))
            # A step that led down, where the wire went slack say, is the last one.
            go = np.flatnonzero(better & (self.best_start(gain) >= _SETTLED)[rows % n])
            if step == steps or not len(go):
                break
            rows, own = rows[go], None if own is None else [r[..., go] for r in own]
            z[rows] = _follow(self.target, z[rows], own, both.of(go), here.of(go), free, self.degrees)
        return best


def _begin(block: LaplaceFit, ladder: AmplitudePath, begin: Start) -> tuple[_Ascent, Array]:
    """What a climb needs, and the points (starts n, d) at which it begins."""
    n, places = begin.data_sets, len(begin.z) // begin.data_sets
    target, column, y = _with_effect(block, ladder, np.split(begin.z, places))
    # The amplitude, and shape constants that are free, integrate to one where nothing depends on them.
    plain = begin.largest - 0.5 * np.log(2.0 * np.pi) * (len(target.problem.names) - begin.z.shape[1])
    each_place = np.stack([np.where(np.isfinite(plain), plain, np.inf), begin.largest - begin.log_density])
    nothing, behind = each_place.reshape(2, places, n).repeat(len(ladder.probes), axis=1).reshape(2, -1)
    # From where to where a rung speaks: half way, by ratio, to its neighbours.
    apart = np.tile(ladder.amplitudes[1] / ladder.amplitudes[0], places).repeat(n)
    main = ladder.effect.amplitudes[0]
    low, high = (float(v) for v in main.prior.support())
    ascent = _Ascent(
        target, column, main.neutral, low, high, begin.readings, n, begin.degrees, nothing, behind, np.sqrt(apart)
    )
    return ascent, y


def _with_effect(block: LaplaceFit, ladder: AmplitudePath, places: Sequence[Array]) -> tuple[LogPosterior, int, Array]:
    """The block's density with the effect, its amplitude's column, and its points (places starts n, d) at each start.

    `places` (n, d) are points of the density without the effect.
    """
    effect = ladder.effect
    problem = block.problem_with(effect)
    column = column_of(problem, effect)
    # A prior that is not felt, in whose standard deviations the column counts.
    wide = stats.norm(0.0, 100.0 * float(np.abs(ladder.amplitudes).max()))
    free = problem.prior.distributions | {problem.names[column]: wide}
    target = LogPosterior(replace(problem, prior=replace(problem.prior, distributions=free)), for_draws=False)
    theta = []
    for z in places:
        values = dict(zip(block.target.problem.names, block.target.coordinates.to_natural(z).T, strict=True))
        for probe in ladder.probes:
            own = probe.own | {effect.columns()[0]: effect.amplitudes[0].neutral}
            each = [values.get(name, np.full(len(z), own.get(name.split("[")[0]))) for name in problem.names]
            theta.append(np.stack(each, axis=1))
    return target, column, target.coordinates.to_sampled(np.concatenate(theta))


@dataclass(frozen=True)
class _Weighed:
    """At one place: log marginal density, best move of the amplitude, δ per amplitude, step of the parameters, ρ.

    And by how much the density would grow with that step, were the tangent exact.
    """

    height: Array
    move: Array
    norm: Array
    step: Array
    ratio: Array
    promise: Array

    def of(self, rows: Array) -> "_Weighed":
        """That of some places."""
        return _Weighed(*(getattr(self, f.name)[rows] for f in fields(self)))


def _weigh(
    x: Tangent,
    signature: Array,
    near: Array | float,
    far: Array | float,
    degrees: int,
) -> _Weighed:
    """Integrate the noise out, as the linear scan does, the amplitude moved to its best from `near` to `far`."""
    n = len(x.residual)
    near, far = np.broadcast_to(near, n), np.broadcast_to(far, n)
    pieces = [np.arange(i, min(i + _PIECE, n)) for i in range(0, n, _PIECE)]
    parts = [_weigh_few(x.of(i), signature[i], near[i], far[i], degrees) for i in pieces]
    return _Weighed(*(np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(_Weighed)))


def _weigh_few(x: Tangent, signature: Array, near: Array, far: Array, degrees: int) -> _Weighed:
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
    return _Weighed(total, a[best], np.sqrt(c[best] * degrees / left[best]), step, RATIOS[k], promise)


def _without_last(x: Tangent) -> Tangent:
    """The tangent with its last parameter held."""
    precision = x.prior_precision[:, :-1, :-1]
    return replace(
        x, parameters=x.parameters[..., :-1], prior_gradient=x.prior_gradient[:, :-1], prior_precision=precision
    )


def _follow(
    target: LogPosterior,
    z: Array,
    readings: Sequence[Array] | None,
    x: Tangent,
    here: _Weighed,
    columns: list[int],
    degrees: int,
) -> Array:
    """Move the parameters a step, or as much of it as is best, or not at all."""
    step = here.step * np.minimum(1.0, _LONGEST / np.maximum(np.abs(here.step).max(axis=1, keepdims=True), 1e-300))
    many = len(_LENGTHS)
    trial = np.repeat(z[None], 1 + many, axis=0)
    trial[1:, :, columns] += _LENGTHS[:, None, None] * step
    flat = trial[1:].reshape(-1, z.shape[1])
    tiled = None if readings is None else [np.tile(y, (1, 1, many)) for y in readings]
    moved, prior = residuals(target, flat, tiled)
    r = np.concatenate([x.residual[None], moved.reshape(many, len(z), -1)])
    levels = r.transpose(1, 0, 2) @ x.left
    shrink = damp(x.singular, here.ratio[:, None])
    square = (r**2).sum(axis=2) - (levels**2 @ shrink[..., None])[..., 0].T
    with np.errstate(invalid="ignore"):
        prior = np.concatenate([x.prior[None], prior.reshape(many, -1)])
        value = prior - 0.5 * degrees * np.log(np.maximum(square, x.least))
    best = np.argmax(np.where(np.isfinite(value), value, -np.inf), axis=0)
    return np.asarray(trial[best, np.arange(len(z))])


def strengths(ways: Sequence[AmplitudePath], climbed: Sequence[Mapping[int, Climbed]]) -> dict[Candidate, Array]:
    """(n,) log Bayes factor of each of the ladders' candidates, with the prior of `screen.log_bayes`."""
    out = {}
    for ladder, each in zip(ways, climbed, strict=True):
        prior = occam(ladder.probes[0].one_sided)
        for candidate in ladder.candidates:
            here = [(each[b].log_bayes, each[b].amplitude, each[b].norm) for b in candidate.blocks]
            if len(here) > 1 and candidate.shared:
                value = shared_amplitude(*(np.array(v) for v in zip(*here, strict=True)))[0].max(axis=0) + prior
            else:
                value = np.sum([lr.max(axis=0) + prior for lr, _, _ in here], axis=0)
            out[candidate] = value
    return out


class Continuation:
    """The global test with every effect led up its ladder, in the data and in the simulations alike.

    The test may be repeated with more simulations: paths already computed are kept.

    Parameters
    ----------
    blocks, trials, candidates, data
        See `ladders`.
    parallel_map : function, optional
        The built-in `map`, or one over processes.

    Attributes
    ----------
    p : float
        What the paths made of the last test's p, whether it counted or not.
    """

    def __init__(
        self,
        blocks: Sequence[LaplaceFit],
        trials: Sequence[Probe],
        candidates: Sequence[Candidate],
        data: Sequence[Scan],
        parallel_map: ParallelMap = map,
    ) -> None:
        self._blocks, self._each = blocks, parallel_map
        self._ways = ladders(blocks, trials, candidates, data)
        found = self._strengths(self._ways, [(b.modes.z[:1], None) for b in blocks])
        self.log_bayes = {c: float(v[0]) for c, v in found.items()}  # of every candidate that has a ladder
        linear = by_name(candidates, data)
        self._values = {c.name: float(linear[c.name][0]) for c in found}
        for c, value in self.log_bayes.items():
            self._values[c.name] = max(self._values[c.name], value)
        self.p = 1.0
        self._known: dict[str, Array] = {}  # of each name, in the simulations climbed so far

    def test(self, simulated: Sequence[Replicates], test: GlobalTest) -> GlobalTest:
        """The global test again, with what the ladders add, where that makes the result clear; else as it was.

        Only names that might become that surprising are tried in the simulations: others do not decide. How often the
        most surprising of all names is that surprising is known from the linear scan of the same simulations. This
        holds in the far tail, where one name alone decides. Nearer the middle, ladders of a few names would be compared
        with scans of all names, and p would not be uniform; so ladders count up to p = `BY_LARGER`, or where p is as
        small as it can be. Simulations are those of an earlier call, and more.
        """
        values, count = self._values, len(test.null)
        clear = max(BY_LARGER, 1.0 / (1 + count))
        needed = float(np.quantile(test.null, 1.0 - clear))  # below it no surprise can make p so small
        # Simulations come out no lower along the paths than in the scan, so a value is no more surprising than there.
        most = {name: float(test.scales[name].surprise(v)) for name, v in values.items()}
        lead = {name: v - float(np.quantile(test.chance[name], _LEVEL)) for name, v in values.items()}
        surprises, largest = dict(test.surprises), float(test.null.max())
        may = [n for n in lead if most[n] >= needed and most[n] > surprises[n]]
        for name in sorted(may, key=lambda n: -lead[n])[:_TRIED]:
            chance = self._chance(name, test.chance[name], simulated, needed, largest)
            surprises[name] = max(surprises[name], _surprise(values[name], chance))
            if surprises[name] > largest:
                break
        larger = replace(test, surprises=surprises)
        self.p = larger.p
        return larger if larger.p <= clear else test

    def _chance(
        self, name: str, linear: Array, simulated: Sequence[Replicates], needed: float, largest: float
    ) -> Array:
        """(m,) largest log Bayes factor of a name in the simulations, by scan or ladder; no more than it takes.

        That is until so many are as high as the data that these cannot be as surprising as `needed`, or until these are
        clearly more surprising than all simulations, of which the most surprising one is by `largest`.
        """
        known = self._known.get(name, np.empty(0))
        ways = [way for way in self._ways if way.effect.name == name]
        out, decided = np.empty(0), False
        while len(out) < len(linear) and not decided:
            last = min(len(out) + int(np.clip(len(out), _FIRST_ROWS, _ROWS)), len(linear))
            if last > len(known):
                rows = slice(len(known), last)
                climbed = self._strengths(ways, [(s.z[rows], [y[..., rows] for y in s.readings]) for s in simulated])
                known = np.append(known, np.max(list(climbed.values()), axis=0))
            out = np.maximum(linear[:last], known[:last])
            as_high = int((out >= self._values[name]).sum())
            too_common = as_high > 0 and np.log1p(len(linear)) - np.log1p(as_high) < needed
            clear = len(out) >= _ROWS and _surprise(self._values[name], out) >= largest + _CLEARLY
            decided = bool(too_common or clear)
        self._known[name] = known
        return out

    def _strengths(self, ways: Sequence[AmplitudePath], plain: Sequence[tuple[Array, Any]]) -> dict[Candidate, Array]:
        z, readings = zip(*plain, strict=True)
        begin = list(self._each(start, self._blocks, z, readings))
        return strengths(ways, list(self._each(_climbs, ways, repeat(self._blocks), repeat(begin))))


def _surprise(value: float, chance: Array) -> float:
    """Of a value along a path, by the simulations' (n,): no more than the line through them says, and than the count.

    The most surprising of all names, which it is compared with, is read off lines alone, and hardly varies. A count
    varies by a factor of two, and some would by chance come out on the other side.
    """
    return float(min(counted(value, chance), Scale.of(chance).surprise(value)))


def _climbs(way: AmplitudePath, blocks: Sequence[LaplaceFit], begin: Sequence[Start]) -> dict[int, Climbed]:
    """A ladder climbed on all its blocks."""
    return {b: climb(blocks[b], way, begin[b]) for b in way.blocks}

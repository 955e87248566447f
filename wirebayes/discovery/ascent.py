"""The way up one path: at every rung the parameters follow, and the evidence of the effect is evaluated."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from wirebayes.discovery.ladders import FIRST, LAST, AmplitudePath
from wirebayes.discovery.path_weights import Weighed, weigh, without_last
from wirebayes.discovery.tangent import Tangent, damp, moving_columns, residuals, tangent
from wirebayes.inference.laplace_fit import LaplaceFit, column_of
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.numeric.distributions import Normal
from wirebayes.numeric.log_sum import or_impossible
from wirebayes.numeric.typing import Array, Bools, Ints

_STEPS, _FEW = 4, 2  # of the parameters at a rung, and at the low ones


# of a Gauss-Newton step, tried in one batch: whole, and shorter where the tangent does not reach so far
_LENGTHS = np.array([1.0, 0.4, 0.1])


_SETTLED, _HOPELESS = 0.05, -15.0  # nats: a gain too small to go on for, a rung from which none leads up again


_NEVER = -1e300  # log Bayes factor of what cannot be computed: finite, so that sums of it stay numbers


_LONGEST = 3.0  # of a step, in any sampled coordinate


@dataclass(frozen=True)
class PathEvidence:
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
        here = weigh(x, np.zeros_like(x.residual), 0.0, 0.0, x.degrees)
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
        variance = sample.variance(own)
        total += 0.5 * sample.protocol.mask.sum() * np.log(variance)
    return total


def lead(block: LaplaceFit, ladder: AmplitudePath, begin: Start) -> PathEvidence:
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
        is_low = bool((np.abs(amplitudes) < 0.999 * np.abs(every[-1]) * FIRST / LAST).all())
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
    return PathEvidence(*(np.array(values).reshape(-1, n) for values in rungs))


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

    def improve(self, rows: Array, other: "_Places") -> Bools:
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

    def look(self, z: Array, amplitude: Array, alive: Bools, free: list[int], steps: int) -> _Places:
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
        n = self.data_sets
        at, first, last = self._stretch(amplitude)
        z = z.copy()
        z[:, self.column] = (self.neutral + at) / self._scale
        best = _Places.unseen(z, at)
        rows = np.flatnonzero(np.tile(alive, len(z) // n))
        for step in range(steps + 1):
            with np.errstate(all="ignore"):
                both = tangent(self.target, z[rows], self._seen(rows), [*free, self.column])
            signature = both.parameters[..., -1] / self._scale
            here = weigh(without_last(both), signature, first[rows], last[rows], self.degrees)
            log_bayes = here.height + both.prior - self.nothing[rows]
            log_bayes = np.nan_to_num(log_bayes, nan=_NEVER, neginf=_NEVER)
            gain = np.full(len(z), -np.inf)
            gain[rows] = np.minimum(log_bayes - best.log_bayes[rows], here.promise)
            better = best.improve(rows, _Places(z[rows], log_bayes, at[rows] + here.move, here.norm))
            # A step that led down, where the wire went slack say, is the last one.
            go = np.flatnonzero(better & (self.best_start(gain) >= _SETTLED)[rows % n])
            if step == steps or not len(go):
                break
            rows = rows[go]
            z[rows] = _follow(self.target, z[rows], self._seen(rows), both.of(go), here.of(go), free, self.degrees)
        return best

    def _seen(self, rows: Ints) -> list[Array] | None:
        """The readings of the data sets of some climbs, a sample each; None for the measured ones."""
        return None if self.readings is None else [r[..., rows % self.data_sets] for r in self.readings]

    @property
    def _scale(self) -> float:
        """Of the amplitude's coordinate."""
        return float(self.target.coordinates.scale[self.column])

    def _stretch(self, amplitude: Array) -> tuple[Array, Array, Array]:
        """Distances (m,) from neutral within the amplitude's ends, and the ends of the moves that each speaks for."""
        at, near, far = (
            np.clip(self.neutral + amplitude * share, self.low, self.high)
            for share in (1.0, 1.0 / self.half, self.half)
        )
        return at - self.neutral, np.minimum(near, far) - at, np.maximum(near, far) - at


def _begin(block: LaplaceFit, ladder: AmplitudePath, begin: Start) -> tuple[_Ascent, Array]:
    """What a lead needs, and the points (starts n, d) at which it begins."""
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
    wide = Normal(0.0, 100.0 * float(np.abs(ladder.amplitudes).max()))
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


def _follow(
    target: LogPosterior,
    z: Array,
    readings: Sequence[Array] | None,
    x: Tangent,
    here: Weighed,
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
    best = np.argmax(or_impossible(value), axis=0)
    return np.asarray(trial[best, np.arange(len(z))])

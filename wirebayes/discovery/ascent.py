"""The way up one path: at every rung the parameters follow, and the evidence of the effect is evaluated."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from wirebayes.discovery.ladders import FIRST, LAST, AmplitudePath
from wirebayes.discovery.path_weights import Weighed, weigh, without_last
from wirebayes.discovery.tangent import Tangent, moving_columns, tangent
from wirebayes.discovery.tangent_step import stepped
from wirebayes.inference.laplace_fit import LaplaceFit, column_of
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.model.column_units import parameter_of
from wirebayes.numeric.distributions import Normal
from wirebayes.numeric.rows import put_rows, rows_of
from wirebayes.numeric.typing import Array, Bools, Ints

_STEPS, _FEW = 4, 2  # of the parameters at a rung, and at the low ones
_SETTLED, _HOPELESS = 0.05, -15.0  # nats: a gain too small to go on for, a rung from which none leads up again
_NEVER = -1e300  # log Bayes factor of what cannot be computed: finite, so that sums of it stay numbers


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
    z : (n, d) array
        Places without the effect of n data sets, in the coordinates that are sampled.
    log_density : (n,) array
        Log marginal density there.
    readings : sequence of (H, R, n) arrays or None
        Theirs, a sample; None for the measured ones.
    degrees : int
        Readings less parameters.
    """

    z: Array
    log_density: Array
    readings: Sequence[Array] | None
    degrees: int

    @property
    def data_sets(self) -> int:
        return len(self.z)


def start(block: LaplaceFit, z: Array, readings: Sequence[Array] | None = None) -> Start:
    """The best places without an effect, of the same density and by the same steps as on a ladder.

    The plain fit is the best with its own noise; with the noise integrated out some place nearby is better, by up to a
    tenth of a nat where it was measured.

    Parameters
    ----------
    block : LaplaceFit
    z : (n, d) array
        The plain fits of n data sets, sampled coordinates.
    readings : sequence of (H, R, n) arrays, optional
        Their readings, a sample; the measured ones when left out.
    """
    problem = block.target.problem
    free = moving_columns(problem)
    degrees = sum(int(sample.protocol.mask.sum()) for sample in problem.samples) - len(free)
    climbs = _Climbs(block.target, readings, len(z), degrees)

    def look(y: Array, rows: Ints) -> _Look:
        x = climbs.tangent(y, rows, free)
        no_signature = np.zeros_like(x.residual)
        here = weigh(x, no_signature, 0.0, 0.0, degrees)
        height = _finite(here.height + x.prior)
        nothing = np.zeros(len(y))
        return _Look(x, here, _Places(y, height, nothing, nothing))

    best = climbs.follow(look, _Places.unseen(z), np.arange(len(z)), free, _STEPS)
    height = np.where(best.log_bayes == _NEVER, -np.inf, best.log_bayes)
    return Start(best.z, height, readings, degrees)


def _finite(log_bayes: Array) -> Array:
    """The same where it can be computed."""
    return np.nan_to_num(log_bayes, nan=_NEVER, neginf=_NEVER)


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
    moving = ascent.moving()
    rigid = ascent.moving(but_for=ladder.effect.shape_columns)
    rungs = ladder.amplitudes.repeat(n, axis=1)
    low_below = 0.999 * np.abs(rungs[-1]) * FIRST / LAST
    best = _Places.unseen(y)
    found: list[_Places] = []
    alive = np.ones(n, bool)
    for amplitudes in rungs:
        is_low = np.all(np.abs(amplitudes) < low_below)
        if is_low:
            # Shape constants mean nothing while the amplitude is small, and would wander.
            rung = ascent.look(y, amplitudes, alive, rigid, _FEW)
        else:
            rung = ascent.look(y, amplitudes, alive, moving, _STEPS)
            alive = alive & (ascent.best_start(rung.log_bayes) >= _HOPELESS)
        y = rung.z
        found.append(rung)
        best.improve(np.arange(len(y)), rung)
        if ascent.is_beyond(amplitudes) or not alive.any():
            break
    not_reached = len(rungs) - len(found)
    found += [_Places.unseen(y)] * not_reached
    every_set = np.ones(n, bool)
    found.append(ascent.look(best.z, best.amplitude, every_set, moving, _STEPS))
    return _evidence(found, n)


def _evidence(found: Sequence["_Places"], n: int) -> PathEvidence:
    """What was found at the rungs of n data sets, a row a rung and start."""
    log_bayes = np.array([rung.log_bayes for rung in found])
    amplitude = np.array([rung.amplitude for rung in found])
    norm = np.array([rung.norm for rung in found])
    return PathEvidence(log_bayes.reshape(-1, n), amplitude.reshape(-1, n), norm.reshape(-1, n))


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
        put_rows(self, rows[better], rows_of(other, better))
        return better


@dataclass(frozen=True)
class _Look:
    """What is seen from some climbs: tangents at their places, what the weights of these say, and the places' worth."""

    tangent: Tangent
    weighed: Weighed
    places: _Places


@dataclass(frozen=True)
class _Climbs:
    """Climbs from several starts in each of n data sets.

    Attributes
    ----------
    target : LogPosterior
        Of the block, or of the block with the effect.
    readings : sequence of (H, R, n) arrays or None
        Of the data sets, a sample; None for the measured ones.
    data_sets : int
    degrees : int
        Readings less parameters, without the effect.
    """

    target: LogPosterior
    readings: Sequence[Array] | None
    data_sets: int
    degrees: int

    def follow(
        self, look: Callable[[Array, Ints], _Look], best: _Places, rows: Ints, free: list[int], steps: int
    ) -> _Places:
        """Improve places by steps of the parameters; a data set goes on for as long as it gains from any of its starts.

        Parameters
        ----------
        look : function of places (m, d) and of the numbers (m,) of their climbs
        best : _Places
            Where all climbs begin; changed in place.
        rows : (m,) array of int
            The climbs that are followed.
        free : list of int
            Columns of the parameters that follow.
        steps : int
            Gauss-Newton steps at most.
        """
        z = best.z.copy()
        for step in range(steps + 1):
            seen = look(z[rows], rows)
            gain = seen.places.log_bayes - best.log_bayes[rows]
            hope = np.minimum(gain, seen.weighed.promise)
            better = best.improve(rows, seen.places)
            # A step that led down, where the wire went slack say, is the last one.
            go = np.flatnonzero(better & self._is_hopeful(rows, hope, len(z)))
            if step == steps or not len(go):
                break
            rows = rows[go]
            readings = self._readings_of(rows)
            tangent = seen.tangent.of(go)
            weighed = seen.weighed.of(go)
            z[rows] = stepped(self.target, z[rows], readings, tangent, weighed, free, self.degrees)
        return best

    def tangent(self, z: Array, rows: Ints, moving: list[int]) -> Tangent:
        """The tangents of some climbs at their places (m, d), by the columns that move."""
        with np.errstate(all="ignore"):
            return tangent(self.target, z, self._readings_of(rows), moving)

    def best_start(self, values: Array) -> Array:
        """(n,) the largest value of each data set."""
        by_start = values.reshape(-1, self.data_sets)
        return by_start.max(axis=0)

    def _is_hopeful(self, rows: Ints, hope: Array, climbs: int) -> Bools:
        """Whether the data sets of some of the climbs may gain something, by what each of these hopes for."""
        every = np.full(climbs, -np.inf)
        every[rows] = hope
        by_set = self.best_start(every) >= _SETTLED
        return by_set[rows % self.data_sets]

    def _readings_of(self, rows: Ints) -> list[Array] | None:
        """The readings of the data sets of some climbs, a sample each; None for the measured ones."""
        if self.readings is None:
            return None
        return [of_sample[..., rows % self.data_sets] for of_sample in self.readings]


@dataclass(frozen=True)
class _Ascent(_Climbs):
    """What does not change on the way up a ladder.

    Attributes
    ----------
    column : int
        Of the amplitude.
    neutral, low, high : float
        Where the amplitude changes nothing, and its ends.
    nothing : (starts n,) array
        The log marginal density without the effect.
    half : (starts n,) array
        Ratio of an amplitude to where the stretch of its rung ends.
    """

    column: int
    neutral: float
    low: float
    high: float
    nothing: Array
    half: Array

    def moving(self, but_for: Sequence[str] = ()) -> list[int]:
        """The columns of the parameters that follow, without the amplitude and some columns of the effect."""
        names = self.target.problem.names
        columns = moving_columns(self.target.problem)
        return [i for i in columns if i != self.column and parameter_of(names[i]) not in but_for]

    def is_beyond(self, amplitudes: Array) -> bool:
        """Whether all amplitudes have reached their ends."""
        within = np.clip(self.neutral + amplitudes, self.low, self.high)
        return bool(np.isin(within, (self.low, self.high)).all())

    def look(self, z: Array, amplitude: Array, alive: Bools, free: list[int], steps: int) -> _Places:
        """The best places at one step of the path: the other parameters follow while the amplitude is held.

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
        at, first, last = self._stretch(amplitude)
        z = z.copy()
        z[:, self.column] = (self.neutral + at) / self._scale

        def look(y: Array, rows: Ints) -> _Look:
            x = self.tangent(y, rows, [*free, self.column])
            signature = x.parameters[..., -1] / self._scale
            here = weigh(without_last(x), signature, first[rows], last[rows], self.degrees)
            log_bayes = _finite(here.height + x.prior - self.nothing[rows])
            return _Look(x, here, _Places(y, log_bayes, at[rows] + here.move, here.norm))

        starts = len(z) // len(alive)
        rows = np.flatnonzero(np.tile(alive, starts))
        return self.follow(look, _Places.unseen(z, at), rows, free, steps)

    @property
    def _scale(self) -> float:
        """The scale of the amplitude's coordinate."""
        return float(self.target.coordinates.scale[self.column])

    def _stretch(self, amplitude: Array) -> tuple[Array, Array, Array]:
        """Distances (m,) from neutral within the amplitude's ends, and the ends of the moves that each speaks for."""
        at = self._within(amplitude)
        near = self._within(amplitude * (1.0 / self.half))
        far = self._within(amplitude * self.half)
        return at - self.neutral, np.minimum(near, far) - at, np.maximum(near, far) - at

    def _within(self, amplitude: Array) -> Array:
        """Values at distances from neutral, no farther than the amplitude's ends."""
        return np.clip(self.neutral + amplitude, self.low, self.high)


def _begin(block: LaplaceFit, ladder: AmplitudePath, begin: Start) -> tuple[_Ascent, Array]:
    """What a lead needs, and the points (starts n, d) at which it begins."""
    target, column, y = _with_effect(block, ladder, begin.z)
    # The amplitude, and shape constants that are free, integrate to one where nothing depends on them.
    more_parameters = y.shape[1] - begin.z.shape[1]
    plain = begin.log_density - 0.5 * np.log(2.0 * np.pi) * more_parameters
    nothing = np.where(np.isfinite(plain), plain, np.inf)
    # From where to where a rung speaks: half way, by ratio, to its neighbours.
    apart = ladder.amplitudes[1] / ladder.amplitudes[0]
    main = ladder.effect.amplitudes[0]
    low, high = main.prior.support()
    ascent = _Ascent(
        target,
        begin.readings,
        begin.data_sets,
        begin.degrees,
        column,
        main.neutral,
        float(low),
        float(high),
        nothing=np.tile(nothing, len(ladder.probes)),
        half=np.sqrt(apart.repeat(begin.data_sets)),
    )
    return ascent, y


def _with_effect(block: LaplaceFit, ladder: AmplitudePath, z: Array) -> tuple[LogPosterior, int, Array]:
    """The block's density with the effect, its amplitude's column, and its points (starts n, d) at each start.

    `z` (n, d) are points of the density without the effect.
    """
    effect = ladder.effect
    problem = block.problem_with(effect)
    column = column_of(problem, effect)
    # A prior that is not felt, in whose standard deviations the column counts.
    largest = float(np.abs(ladder.amplitudes).max())
    wide = {problem.names[column]: Normal(0.0, 100.0 * largest)}
    prior = replace(problem.prior, distributions=problem.prior.distributions | wide)
    target = LogPosterior(replace(problem, prior=prior))
    theta = _at_each_start(ladder, block.target, z, problem.names)
    return target, column, target.coordinates.to_sampled(theta)


def _at_each_start(ladder: AmplitudePath, plain: LogPosterior, z: Array, names: Sequence[str]) -> Array:
    """(starts n, d) parameters of some names with the effect at its neutral value, by points (n, d) without it."""
    effect = ladder.effect
    theta = plain.coordinates.to_natural(z)
    known = dict(zip(plain.problem.names, theta.T, strict=True))
    neutral = {effect.amplitude_column: effect.amplitudes[0].neutral}
    return np.concatenate([_extended(known, names, probe.own | neutral) for probe in ladder.probes])


def _extended(known: Mapping[str, Array], names: Sequence[str], added: Mapping[str, float]) -> Array:
    """(n, d) parameters of some names: those that are known (n,), and an effect's own, the same in all rows."""
    n = len(next(iter(known.values())))
    columns = []
    for name in names:
        if name in known:
            columns.append(known[name])
        else:
            value = added[parameter_of(name)]
            columns.append(np.full(n, value))
    return np.stack(columns, axis=1)

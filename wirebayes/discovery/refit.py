"""Which effect: every candidate refitted without linearisation, its evidence compared with the flexible reference.

The prior of an amplitude is the catalogue's density as far as the effect does not exceed δ = `LARGEST` in the noise of
the plain fit, integrated to one: a wide catalogue does not count against an effect, and an amplitude that is hardly
possible does. A share has an end of its own, and is not cut off. Fits with the effect inside, folds, samples and
predictions have the same density.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from wirebayes.discovery.profile import Profile, has_near_neighbours, integral_of, top_of
from wirebayes.discovery.sharing import alike
from wirebayes.inference.laplace_fit import LaplaceFit, Pinned
from wirebayes.inference.optimum import Optimum
from wirebayes.numeric.any_distribution import finite_spread
from wirebayes.numeric.typing import Array, Function, Ints
from wirebayes.wire.effect import Effect

# δ; end of an amplitude's prior. Hardly matters: twice as much takes ln 2 from every name alike
LARGEST = 40.0
_FARTHER = np.array([1.3, 1.7, 2.3])  # times an end's distance from neutral, where the top lies at an end
_OUTWARD = 6  # times that the grid may grow outwards so: 150-fold in all
_ROUNDING = 1e-9  # of a reach, which a grid may end on, and of amplitudes that are one and the same
# δ of the first amplitudes tried, doubling up to `LARGEST`; around the best the grid is refined later. The scan's unit
# may be too large where the parameters bend themselves to the effect, so that it begins below what could be seen.
_DELTAS = np.array([0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 40.0])
# of the way from the far end of a share to neutral: creep that is nearly all permanent fits by another amount and
# another exponent, and a climb that comes from little of it meets a valley on the way
_FAR_END = np.array([0.25, 0.1, 0.03])
# of its prior's standard deviation, the most that an amplitude of δ = 1 may be: where the parameters of the fit without
# the effect bend themselves to it, the scan sees nothing, and its unit has no end
_LARGEST_UNIT = 0.1
_SWEEPS = 3  # times that climbs may begin once more where their neighbour nearer to neutral has ended
_NEWS = 0.1  # nats that such a climb must gain to be followed further
_FAR = 12.0  # nats below the best amplitude, from which on no climb begins at an amplitude once more
# times that amplitudes are tried closer to the best one; beside a cliff, as where creep stops, three had missed the top
_CLOSER = 5
_COUNTS = 6.0  # nats below the best amplitude, up to which the curvature is computed exactly
# of a top that is a parabola's, where it is tried: standard deviations
_ABOUT_TOP = np.array([-2.0, -1.0, 0.0, 1.0, 2.0])
_ENOUGH = 3  # of them between the neighbours of the best amplitude; with fewer, what lies between is tried evenly


@dataclass(frozen=True)
class Refit:
    """A candidate refitted on some blocks.

    Attributes
    ----------
    effect : Effect
    blocks : tuple of int
        On which it acts with one shared amplitude.
    log_bayes : float
        Against the same blocks without it.
    amplitude, sd : float
        Best amplitude and its standard deviation.
    theta : tuple of (d,) arrays
        All parameters there, a block.
    """

    effect: Effect
    blocks: tuple[int, ...]
    log_bayes: float
    amplitude: float
    sd: float
    theta: tuple[Array, ...]


def is_share(effect: Effect) -> bool:
    """Whether an effect's amplitude goes from neutral to an end, as a share does.

    Parameters
    ----------
    effect : Effect
    """
    main = effect.amplitudes[0]
    least, most = main.prior.support()
    return bool(least == main.neutral and np.isfinite(most))


def occam(one_sided: bool) -> float:
    """What the prior of an amplitude, uniform in δ up to `LARGEST`, adds to the log of its best likelihood ratio."""
    return float(0.5 * np.log(2 * np.pi) - np.log(LARGEST if one_sided else 2.0 * LARGEST))


def refit(
    blocks: Sequence[LaplaceFit],
    which: Sequence[int],
    effect: Effect,
    per_delta: float,
    guess: float,
    reach: float = np.inf,
    shapes: Sequence[Mapping[str, float]] = (),
) -> Refit:
    """Refit one effect with one amplitude shared by the blocks `which`.

    Parameters
    ----------
    blocks : sequence of LaplaceFit
    which : sequence of int
    effect : Effect
    per_delta : float
        Amplitude that amounts to δ = 1, from the linear scan.
    guess : float
        The linear scan's best distance from neutral.
    reach : float
        Distance from neutral at which the effect has δ = `LARGEST` in the noise of the plain fit.
    shapes : sequence of mappings of column to float
        Shape constants to begin with, a block each; their medians where left out.
    """
    amplitude = _Amplitude.of([blocks[b] for b in which], effect, per_delta, reach)
    starts = [p.starts(own) for p, own in zip(amplitude.pinned, shapes or [{}] * len(which), strict=True)]
    grid = amplitude.first(guess)
    profile = amplitude.climbed(grid, [np.tile(start, (len(grid), 1)) for start in starts])
    profile = _looked_closer(amplitude, _followed(amplitude, profile).known())
    return _summary(effect, which, amplitude, _exact(amplitude, profile))


@dataclass(frozen=True)
class _Amplitude:
    """An amplitude that some blocks share.

    Attributes
    ----------
    pinned : sequence of Pinned
        The blocks with the effect, the amplitude of which is given.
    neutral, low, high : float
        Where it changes nothing, and its ends.
    most : float
        The end of its prior, infinite but for a share.
    per_delta : float
        What amounts to δ = 1.
    added : function of (a,) amplitudes to (a,)
        Log density of its prior, less the evidence without the effect.
    """

    pinned: Sequence[Pinned]
    neutral: float
    low: float
    high: float
    most: float
    per_delta: float
    added: Function

    @classmethod
    def of(cls, blocks: Sequence[LaplaceFit], effect: Effect, per_delta: float, reach: float) -> "_Amplitude":
        """The same for an effect on some blocks.

        Parameters
        ----------
        blocks : sequence of LaplaceFit
        effect : Effect
        per_delta : float
        reach : float
            How far from neutral it may lie.
        """
        main = effect.amplitudes[0]
        least, most = (float(end) for end in main.prior.support())
        low = max(least, main.neutral - reach)
        high = min(most, main.neutral + reach)
        pinned = [Pinned(block, effect) for block in blocks]
        prior = pinned[0].prior
        unit = min(per_delta, _LARGEST_UNIT * finite_spread(prior))
        log_prior = within(prior, main.neutral, reach)
        without = sum(block.log_evidence for block in blocks)
        return cls(pinned, main.neutral, low, high, most, unit, lambda amplitudes: log_prior(amplitudes) - without)

    @property
    def one_sided(self) -> bool:
        return self.low >= self.neutral

    def first(self, guess: float) -> Array:
        """The amplitudes tried first, with one that is guessed."""
        steps = np.append(_DELTAS, max(abs(guess) / self.per_delta, 0.3)) * self.per_delta
        grid = self.neutral + (steps if self.one_sided else np.concatenate([steps, -steps]))
        if self.one_sided and np.isfinite(self.most):
            grid = np.append(grid, self.most - _FAR_END * (self.most - self.neutral))
        return np.unique(np.clip(grid, self.low, self.high))

    def outwards(self, from_: float) -> Array:
        """Three amplitudes that lie farther from neutral."""
        return np.clip(self.neutral + (from_ - self.neutral) * _FARTHER, self.low, self.high)

    def climbed(self, amplitudes: Array, begin: Sequence[Array]) -> Profile:
        """The profile at amplitudes (a,): blocks climb from k starts an amplitude, (a k, d); the best end stays."""
        ends = []
        rows = np.arange(len(amplitudes))
        for block, start in zip(self.pinned, begin, strict=True):
            k = len(start) // len(amplitudes)
            found = block.climb(start, np.repeat(amplitudes, k))
            value = np.where(found.converged, found.log_evidence, -np.inf).reshape(-1, k)
            ends.append(found.rows(rows * k + np.argmax(value, axis=1)))
        return self.profile(amplitudes, ends)

    def profile(self, amplitudes: Array, ends: Sequence[Optimum]) -> Profile:
        """The profile along climbs that have ended, one for each amplitude and block."""
        total = np.sum([np.where(end.converged, end.log_evidence, -np.inf) for end in ends], axis=0)
        if len(self.pinned) > 1 and self.pinned[0].common:
            total = total + _one_value_each(self.pinned, ends, amplitudes)
        return Profile(amplitudes, total + self.added(amplitudes), ends)


def _looked_closer(amplitude: _Amplitude, profile: Profile) -> Profile:
    """The profile with amplitudes about its top, followed outwards where that lies at an end."""
    end = amplitude.neutral if amplitude.one_sided else None
    outward = 0
    closer = 0
    while closer < _CLOSER and not (closer and has_near_neighbours(profile)):
        goes_on = outward < _OUTWARD and _may_go_on(amplitude, profile)
        if goes_on:
            # The scan's unit was too small, or climbs from afar ended nowhere: go on outwards before looking closer.
            best = float(profile.amplitude[profile.best])
            finer = amplitude.outwards(best)
            outward += 1
        else:
            finer = _around(profile, end, amplitude.per_delta)
            closer += 1
        found = _with_news(amplitude, profile, finer)
        if found is not profile:
            profile = found
        elif goes_on:  # nor would the same climbs again bring any
            outward = _OUTWARD
        else:
            break
    return profile


def _may_go_on(amplitude: _Amplitude, profile: Profile) -> bool:
    """Whether the top lies at an end of the profile from which it may be followed outwards."""
    best = float(profile.amplitude[profile.best])
    at_end = profile.best in (0, len(profile.amplitude) - 1)
    return at_end and amplitude.low < best < amplitude.high and best != amplitude.neutral


def _with_news(amplitude: _Amplitude, profile: Profile, finer: Array) -> Profile:
    """The profile with further amplitudes; itself where these are known, or no climb at a new one converges."""
    is_known = np.isclose(finer[:, None], profile.amplitude, rtol=_ROUNDING, atol=0.0).any(axis=1)
    if is_known.all():
        return profile
    finer = finer[~is_known]
    begin = [_between(profile.amplitude, ends.z, profile.best, finer) for ends in profile.ends]
    found = profile.joined(amplitude.climbed(finer, begin)).known()
    return profile if np.array_equal(found.amplitude, profile.amplitude) else found


def _followed(amplitude: _Amplitude, profile: Profile) -> Profile:
    """The profile with climbs that begin where the next amplitude towards neutral has ended, where these are better.

    A climb from the fit without the effect may end nowhere, or in a lesser mode.
    """
    number = np.arange(len(profile.amplitude))
    inner = _next_inwards(profile.amplitude, amplitude.neutral)
    news = np.isfinite(profile.value)
    for _ in range(_SWEEPS):
        least = profile.value.max() - _FAR
        hopeful = news[inner] & (profile.value[inner] > least)
        rows = np.flatnonzero(hopeful & (inner != number))
        if not len(rows):
            break
        begin = [ends.z[inner[rows]] for ends in profile.ends]
        tried = amplitude.climbed(profile.amplitude[rows], begin)
        better = tried.value > profile.value[rows] + _NEWS
        profile = profile.with_rows(rows[better], tried.rows(better))
        news = np.isin(number, rows[better])
    return profile


def _next_inwards(amplitudes: Array, neutral: float) -> Ints:
    """(a,) number of each amplitude's neighbour towards neutral on its own side; its own number where there is none."""
    number = np.arange(len(amplitudes))
    side = np.sign(amplitudes - neutral)
    towards = number - side.astype(np.int64)
    towards = np.clip(towards, 0, len(number) - 1)
    return np.where(side[towards] == side, towards, number)


def within(prior: Any, neutral: float, reach: float) -> Function:
    """The log density of a prior as far as `reach` from neutral, integrated to one.

    Parameters
    ----------
    prior : Distribution
    neutral, reach : float
    """
    inside = float(prior.cdf(neutral + reach) - prior.cdf(neutral - reach))

    def log_density(amplitude: Array) -> Array:
        with np.errstate(over="ignore"):  # an absurd amplitude has no density
            density = prior.logpdf(amplitude) - np.log(max(inside, 1e-300))
        return np.where(np.abs(amplitude - neutral) <= reach * (1.0 + _ROUNDING), density, -np.inf)

    return log_density


def _exact(amplitude: _Amplitude, profile: Profile) -> Profile:
    """The profile with exact curvatures where it counts; until then their expectation has shown where the top is."""
    rows = np.flatnonzero(profile.value > profile.value.max() - _COUNTS)
    if not len(rows):
        return profile
    near = profile.rows(rows)
    ends = [block.curved(end, near.amplitude) for block, end in zip(amplitude.pinned, near.ends, strict=True)]
    return profile.with_rows(rows, amplitude.profile(near.amplitude, ends)).known()


def _one_value_each(pinned: Sequence[Pinned], ends: Sequence[Optimum], amplitudes: Array) -> Array:
    """(a,) log evidence that the blocks have each shape constant alike, over each having its own."""
    known = [block.shapes(end, amplitudes) for block, end in zip(pinned, ends, strict=True)]
    total = np.zeros(len(amplitudes))
    for number in range(len(pinned[0].common)):
        means, sds = (np.array([part[:, number] for part in parts]) for parts in zip(*known, strict=True))
        total += alike(means, sds, partial(pinned[0].log_prior_of_shape, number))
    return total


def _around(profile: Profile, end: float | None, per_delta: float) -> Array:
    """Amplitudes about the top that the best and its neighbours suggest, no lower than `end` if there is one.

    An amplitude that is the only one with evidence has neighbours `per_delta` away.
    """
    left, right = _beside_best(profile, end, per_delta)
    about = _about_top(profile)
    about = about[(left < about) & (about < right)]
    if len(about) >= _ENOUGH:
        return about
    return np.linspace(left, right, 8)[1:-1]


def _beside_best(profile: Profile, end: float | None, per_delta: float) -> tuple[float, float]:
    """The neighbours of the best amplitude, or what stands for one that is missing."""
    grid = profile.amplitude
    best = profile.best
    last = len(grid) - 1
    next_up = grid[1] if last else grid[0] + per_delta
    right = grid[min(best + 1, last)] if last else next_up
    if best:
        return grid[best - 1], right
    return 2 * grid[0] - next_up if end is None else end, right


def _about_top(profile: Profile) -> Array:
    """Amplitudes about the top of the parabola through the best and its neighbours; none where there is no such top."""
    grid = profile.amplitude
    best = profile.best
    if not 0 < best < len(grid) - 1:
        return np.empty(0)
    three = slice(best - 1, best + 2)
    away = grid[three] - grid[best]
    bend, slope, _ = np.polyfit(away, profile.value[three], 2)
    if not bend < 0:
        return np.empty(0)
    top = grid[best] - 0.5 * slope / bend
    return top + _ABOUT_TOP / np.sqrt(-2.0 * bend)


def _summary(effect: Effect, which: Sequence[int], amplitude: _Amplitude, profile: Profile) -> Refit:
    only_best = profile.rows(slice(profile.best, profile.best + 1))
    at = only_best.amplitude
    top = top_of(profile, amplitude.per_delta)
    if top is None:
        log_bayes, sd = integral_of(profile, amplitude.neutral, amplitude.per_delta)
    else:
        log_bayes = top.log_integral(amplitude.low, amplitude.high)
        sd = top.sd
    each_block = zip(amplitude.pinned, only_best.ends, strict=True)
    theta = tuple(pinned.natural(end.z, at)[0] for pinned, end in each_block)
    return Refit(effect, tuple(which), log_bayes, float(at[0]), sd, theta)


def _between(grid: Array, ends: Array, best: int, finer: Array) -> Array:
    """(m, d) where climbs with `finer` amplitudes begin: on the line from the best place to its neighbour's."""
    aside = np.where(finer < grid[best], max(best - 1, 0), min(best + 1, len(grid) - 1))
    apart = grid[aside] - grid[best]
    share = np.divide(finer - grid[best], apart, out=np.zeros(len(finer)), where=apart != 0)
    near = np.isfinite(ends[aside]).all(axis=1) & (share <= 1.0)
    return np.where(near[:, None], ends[best] + share[:, None] * (ends[aside] - ends[best]), ends[best])

"""Modes of the posterior: climbs from many starts, which differ in what decides where a climb ends."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from wirebayes.inference.climb import climb, curved
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.inference.optimum import REACH, Optimum, distinct, together
from wirebayes.numeric.resampling import next_power, systematic_rows
from wirebayes.numeric.spread_rows import spread_in_widths
from wirebayes.numeric.typing import Array, Function, Ints

_ANNEALED = 400  # prior draws
_EFFECTIVE = 0.2  # share of the rows that stays so at each step of the cooling
_WARM_STEPS = 4  # the last ones of the cooling
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


def modes(target: LogPosterior, rng: Generator, extra: Array | None = None) -> Optimum:
    """The distinct modes of a posterior, best first (see `searches`).

    Parameters
    ----------
    rng : numpy.random.Generator
        Draws the starts.
    extra : (m, d) array, optional
        Further starts, in the coordinates that are sampled.
    """
    return searches(target, rng, 1, extra=extra)[0]


def searches(
    target: LogPosterior,
    rng: Generator,
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
    possible = []
    for i, z in enumerate(drawn):
        value = side_by_side.density(z, np.full(len(z), i))
        possible.append(_possible(z, value))
    begin = side_by_side.with_ratios([_spread(target, z, _FIRST, rng) for z in possible])
    if extra is not None:
        begin = [np.vstack([places, extra]) for places in begin]
    found = side_by_side.climbed(begin, [])
    others = [_some(z, starts, rng) for z in possible]
    return side_by_side.further(found, others)


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


def search(target: LogPosterior, rng: Generator, *, extra: Array | None = None) -> Search:
    """Look for the modes, and for places that roughly follow the posterior: prior draws are annealed to it, too.

    Climbs begin as in `searches`, and at places that the annealing passed, the highest one and some far from one
    another: where it ends, a mode of less weight may have died out.

    Parameters
    ----------
    rng : numpy Generator
    extra : (m, d) array, optional
        Further starts, in sampled coordinates.
    """
    alone = _SideBySide(target, 1, None)

    def density(z: Array) -> Array:
        return alone.density(z, np.zeros(len(z), int))

    z = _prior(target, _ANNEALED, rng)
    value = density(z)
    passed, height = _cooled(density, z, value, rng)
    landmarks = _landmarks(passed, height, rng)
    possible = _possible(z, value)
    spread = _spread(target, possible, _FIRST, rng)
    begin = [*alone.with_ratios([spread]), landmarks]
    if extra is not None:
        begin.append(extra)
    found = alone.climbed([np.vstack(begin)], [])
    others = _some(possible, _STARTS, rng)
    [every] = alone.further(found, [others])
    warm = passed[-_WARM_STEPS * _ANNEALED :]
    return Search(every, warm, passed[-_ANNEALED:], height[-_ANNEALED:])


def _landmarks(passed: Array, height: Array, rng: Generator) -> Array:
    """The highest of the places (n, d) that the annealing passed, and some that are far from one another."""
    apart = spread_in_widths(passed, _FIRST, rng)
    highest = int(np.argmax(height))
    return passed[[highest, *apart]]


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
        self.n = n
        self.noises = target.coordinates.noises
        self.sensors = target.coordinates.sensor_columns
        self.settings = target.coordinates.setting_columns
        self.density, self.residuals = target.rowwise(readings)

    def climbed(self, begin: Sequence[Array], before: Sequence[Optimum]) -> list[Optimum]:
        """The modes to which climbs lead from (m, d) places of each density, but for those known before."""
        of = self._numbers(begin)

        def density(z: Array, rows: Ints) -> Array:
            return self.density(z, of[rows])

        def residuals(z: Array, rows: Ints) -> tuple[Array, Array]:
            return self.residuals(z, of[rows])

        end = climb(
            density,
            np.vstack(begin),
            None if self.residuals is None else residuals,
            of=of,
            known=before,
            reach=REACH,
            curvature_at_end=False,
        )
        found = [distinct([end.rows(of == i)]) for i in range(self.n)]
        of = self._numbers([modes.z for modes in found])
        every = curved(self.density, together(found), of)
        return self._of_each(every, of)

    def _numbers(self, places: Sequence[Array]) -> Ints:
        """(m,) the density to which each of the places belongs, put one after the other."""
        return np.repeat(np.arange(self.n), [len(own) for own in places])

    def _of_each(self, every: Optimum, of: Ints) -> list[Optimum]:
        """The rows of each density."""
        return [every.rows(of == i) for i in range(self.n)]

    def with_ratios(self, begin: Sequence[Array]) -> Sequence[Array]:
        """Places (m, d) of each density led uphill for some steps, each with one of several ratios of the noises kept.

        Above all, what explains the residuals, setting errors or the sensor's noise, decides at which of several modes
        a climb ends. Whatever they were, both grow at first from a start that fits badly, and the wire's parameters
        follow them. With the ratio kept, the wire is fitted as if it were known; the climb that comes after frees it.
        """
        if not self.noises:
            return begin
        ratio = np.concatenate([np.resize(_RATIOS, len(places)) for places in begin])

        def kept(z: Array, rows: Array) -> Array:
            for pair in self.noises:
                z[:, pair.setting] = z[:, pair.sensor] + pair.middle + pair.spread * ratio[rows]
            return z

        settings = [pair.setting for pair in self.noises]
        return [led.z for led in self._led(begin, settings, kept)]

    def further(self, found: Sequence[Optimum], begin: Sequence[Array]) -> list[Optimum]:
        """The modes of each density, with those found from further (m, d) places with the noises held for some steps.

        Climbs that come to the same place meanwhile go on as one.
        """
        best = [modes.z[np.argmax(modes.log_evidence)] for modes in found]
        best_of_row = np.repeat(best, [len(places) for places in begin], axis=0)

        def held(z: Array, rows: Array) -> Array:
            best_there = best_of_row[rows]
            z[:, self.settings] = best_there[:, self.settings] + _SETTING_UP
            z[:, self.sensors] = best_there[:, self.sensors] - _SENSOR_DOWN
            return z

        noises = [*self.settings, *self.sensors]
        if noises:
            led = self._led(begin, noises, held, together=True)
            begin = [distinct([places]).z for places in led]
        climbed = self.climbed(begin, found)
        return [distinct([old, new]) for old, new in zip(found, climbed, strict=True)]

    def _led(
        self, begin: Sequence[Array], fixed: list[int], kept: Callable[[Array, Array], Array], together: bool = False
    ) -> list[Optimum]:
        """Where some steps uphill lead from (m, d) places of each density, with some coordinates fixed by the others.

        Climbs have the other coordinates alone: no derivative is taken by the fixed ones, which `kept` sets.
        """
        of = self._numbers(begin)
        start = np.vstack(begin)
        n, d = start.shape
        free = np.delete(np.arange(d), fixed)

        def whole(z: Array, rows: Ints) -> Array:
            out = np.empty((len(z), d))
            out[:, free] = z
            return kept(out, rows)

        def density(z: Array, rows: Ints) -> Array:
            return self.density(whole(z, rows), of[rows])

        def residuals(z: Array, rows: Ints) -> tuple[Array, Array]:
            return self.residuals(whole(z, rows), of[rows])

        found = climb(
            density,
            start[:, free],
            residuals,
            iterations=_LED,
            tolerance=_LED_TO,
            of=of if together else None,
            curvature_at_end=False,
        )
        rows = np.arange(n)
        curvature = np.zeros((n, d, d))
        curvature[np.ix_(rows, free, free)] = found.curvature
        led = Optimum(whole(found.z, rows), found.log_density, curvature, found.converged)
        return self._of_each(led, of)


def _prior(target: LogPosterior, n: int, rng: Generator) -> Array:
    """(n, d) prior draws in sampled coordinates."""
    return target.coordinates.to_sampled(target.problem.prior.rvs(n, rng))


def _some(z: Array, n: int, rng: Generator) -> Array:
    """(n, d) of the places (m, d), none twice where there are enough."""
    return z[rng.choice(len(z), n, replace=n > len(z))]


def _possible(z: Array, value: Array) -> Array:
    """The places among (m, d) where the density is above zero; all, if it is nowhere."""
    inside = np.isfinite(value)
    return z[inside] if inside.any() else z


def _spread(target: LogPosterior, z: Array, n: int, rng: Generator) -> Array:
    """(n, d) of the places (m, d): where the creep is slow, fast and between, each with a small and a large power."""
    kinds = target.coordinates.kinds_of_creep
    if not kinds:
        return _some(z, n, rng)
    ranks = [np.argsort(np.argsort(z[:, columns].mean(axis=1))) for columns in kinds]
    found = np.stack(ranks, axis=1) / len(z)
    anywhere = rng.uniform(-1.0, 1.0, (n, len(kinds)))
    wanted = np.resize(_RANKS, (n, 2))[:, : len(kinds)] + _WITHIN * anywhere
    off = found - wanted[:, None]
    nearest = (off**2).sum(axis=2).argmin(axis=1)
    return z[nearest]


def _cooled(density: Function, z: Array, value: Array, rng: Generator) -> tuple[Array, Array]:
    """Places (n, d) and their log densities (n,), from the density to powers that grow from 0 to 1, all together.

    Each step of the power leaves a fifth of the rows effective and moves them by differential evolution: near enough to
    the modes to find them.
    """
    value = np.where(np.isfinite(value), value, -1e300)
    power = 0.0
    way = []
    height = []
    while power < 1.0:
        step = next_power(value, 1.0 - power, _EFFECTIVE)
        power += step
        weight = np.exp(step * (value - value.max()))
        kept = systematic_rows(weight, len(z), rng)
        z = z[kept]
        value = value[kept]
        moved = _evolved(z, rng)
        tried = density(moved)
        chance = np.log(rng.uniform(size=len(z)))
        taken = chance < power * (tried - value)
        z = np.where(taken[:, None], moved, z)
        value = np.where(taken, tried, value)
        way.append(z)
        height.append(value)
    return np.concatenate(way), np.concatenate(height)


def _evolved(z: Array, rng: Generator) -> Array:
    """(n, d) proposals of differential evolution: places moved by the difference of two others."""
    n, d = z.shape
    one, other = rng.integers(n, size=(2, n))
    stretch = 2.38 / np.sqrt(2.0 * d)
    jitter = 1e-3 * rng.normal(size=z.shape)
    return z + stretch * (z[one] - z[other]) + jitter

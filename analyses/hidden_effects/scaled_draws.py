"""Tests of any scale with a hidden effect, drawn at random.

Lines and noise have the ranges of `analyses.posterior.any_scale`. Holds last seconds or days and are read rarely or
often; a test may rest before each move, go part of the way back, log a temperature or be rounded.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .rig import Array
from .scaled_cases import OF_LENGTHS, ScaledCase
from .scaled_law import Hidden, ScaledTest
from .scaled_lengths import TwoLengths
from .scaled_sizes import Signatures

DELTAS = (5.0, 8.0, 12.0)
_TRIES = 40  # draws of an effect, of which one can be as large as it should
_AGREES = 0.05  # relative error of the size of what is hidden
_UNEVEN, _LOGGED = 0.3, 0.25  # shares of tests with uneven steps, and with a temperature
_REST = 1.4  # of a hold, until the next move, where the wire rests before it


def draw_case(rng: np.random.Generator, weights: bool) -> ScaledCase:
    """A line and its test, drawn again while the wire goes slack or creeps as far as it is stretched."""
    while True:
        case = _tested(_line(rng), rng, weights)
        if _is_taut(case):
            return case


def draw_lengths(rng: np.random.Generator, weights: bool) -> TwoLengths:
    """Two tests of one line, of which one specimen is longer than the other."""
    while True:
        line = _line(rng)
        longer = line.times_as_long(float(rng.uniform(1.5, 3.0)))
        both = (_tested(line, rng, weights), _tested(longer, rng, weights))
        if all(_is_taut(case) for case in both):
            return TwoLengths(both)


def _is_taut(case: ScaledCase) -> bool:
    return case.test.weights or bool(case.plain.min() > 0.05 * case.test.tension_ref_N)


@dataclass(frozen=True)
class _Line:
    """A line and how large things are in its test: ``k1 B U k2 N``, tension, stretch and duration of a hold."""

    truth: dict[str, float]
    length_mm: float
    tension_N: float
    stretch_mm: float
    hold_s: float

    def times_as_long(self, ratio: float) -> _Line:
        """A longer specimen, which creeps in proportion."""
        truth = self.truth | {"B": ratio * self.truth["B"]}
        return replace(self, truth=truth, length_mm=ratio * self.length_mm, stretch_mm=ratio * self.stretch_mm)


def _line(rng: np.random.Generator) -> _Line:
    tension, length, hold_s = 10.0 ** rng.uniform((-3.0, 1.5, 0.5), (6.0, 4.5, 5.2))
    strain = 10.0 ** rng.uniform(-2.7, -1.5)
    U, N = rng.uniform(0.4, 1.2), rng.uniform(0.5, 1.1)
    stretch = strain * length
    creep = stretch * 10.0 ** rng.uniform(-1.5, -0.3)
    k2 = np.log(2.0) / (hold_s * 10.0 ** rng.uniform(-1.2, 0.3)) ** N
    truth = {"k1": float(tension / strain), "B": float(creep / tension**U), "U": U, "k2": float(k2), "N": N}
    return _Line(truth, float(length), float(tension), float(stretch), float(hold_s))


def _settings(rng: np.random.Generator, low: float, high: float) -> tuple[Array, float, bool]:
    """What is set in each hold, one step, and whether the test goes back."""
    holds = int(rng.integers(5, 13))
    settings = np.linspace(low, high, holds)
    step = (high - low) / (holds - 1)
    if rng.random() < _UNEVEN:
        settings[1:-1] += step * rng.uniform(-0.35, 0.35, holds - 2)
    back = bool(rng.random() < 0.5)
    if back:
        settings = np.concatenate([settings, settings[-2 : -2 - int(rng.integers(2, 4)) : -1]])
    return settings, step, back


def _tested(line: _Line, rng: np.random.Generator, weights: bool) -> ScaledCase:
    unit, low, high = (line.tension_N, 0.4, 1.6) if weights else (line.stretch_mm, 0.3, 1.8)
    settings, step, back = _settings(rng, low, high)
    few_or_many = str(rng.choice(["few", "usual", "many"]))
    counts = {"few": int(rng.integers(3, 5)), "usual": 7, "many": int(rng.integers(20, 41))}
    shares = _shares(rng, counts[few_or_many])
    rests = bool(rng.random() < 1.0 / 3.0)
    durations = np.full(len(settings), line.hold_s * (_REST if rests else 1.0))
    times = tuple(line.hold_s * shares for _ in settings)
    warming = _warming(rng, durations, times) if rng.random() < _LOGGED else None
    sensor_sd = (line.stretch_mm if weights else line.tension_N) * float(10.0 ** rng.uniform(-3.3, -2.3))
    resolution = float(rng.choice([0.0, 0.0, 1.0, 3.0])) * sensor_sd
    preload = line.stretch_mm * (rng.uniform(-0.2, 0.5) if weights else rng.uniform(0.0, 0.3))
    setting_sd = unit * step * float(10.0 ** rng.uniform(-2.5, -1.2))
    test = ScaledTest(weights, line.length_mm, unit * settings, times, durations, warming, line.tension_N)
    about = {
        "weights": weights,
        "rests": rests,
        "back": back,
        "readings": few_or_many,
        "holds": len(settings),
        "tension_N": line.tension_N,
        "length_mm": line.length_mm,
        "hold_s": line.hold_s,
        "stretch_mm": line.stretch_mm,
    }
    return ScaledCase(test, line.truth | {"preload": preload}, sensor_sd, setting_sd, resolution, about)


def _shares(rng: np.random.Generator, count: int) -> Array:
    """When a hold is read, in shares of it: evenly in time or in its logarithm, from its beginning or soon after."""
    first = 0.0 if rng.random() < 0.6 else float(rng.uniform(0.005, 0.04))
    if rng.random() < 0.5:
        return np.linspace(first, 1.0, count)
    return np.concatenate([[first], np.geomspace(first + 0.02, 1.0, count - 1)])


def _warming(rng: np.random.Generator, durations: Array, times: tuple[Array, ...]) -> tuple[Array, ...]:
    """A slow swing of the temperature, in K above the first one logged, hold by hold."""
    whole_s = float(durations.sum())
    starts = np.concatenate([[0.0], np.cumsum(durations)[:-1]])
    swing, periods, phase = rng.uniform(0.5, 4.0), rng.uniform(0.5, 3.0), rng.uniform(0.0, 2.0 * np.pi)
    moments = [start + at for start, at in zip(starts, times, strict=True)]
    logged = [np.round(swing * np.sin(2 * np.pi * periods * moment / whole_s + phase), 2) for moment in moments]
    return tuple(of_hold - logged[0][0] for of_hold in logged)


def draw_hidden(case: Signatures, rng: np.random.Generator, names: Sequence[str] = ()) -> tuple[Hidden, float] | None:
    """An effect of a size, none more often than another; none where no try was large enough.

    Parameters
    ----------
    case : Signatures
    rng : numpy.random.Generator
    names : sequence of str
        Effects to draw from; those of the catalogue that the readings can show when left out.
    """
    delta = float(rng.choice(DELTAS))
    names = names or case.shown()
    for _ in range(_TRIES):
        (form,) = case.forms(str(rng.choice(names)), rng)
        found = case.of_delta(form, delta, _AGREES, case.left)
        if found is not None:
            return found, delta
    return None


def draw_case_and_hidden(
    rng: np.random.Generator, weights: bool, kind: str
) -> tuple[ScaledCase | TwoLengths, tuple[Hidden, float] | None]:
    """A case and what is hidden in it.

    Parameters
    ----------
    rng : numpy.random.Generator
    weights : bool
    kind : {"catalogue", "foreign", "lengths"}
        Of the effect: one that a single test shows, one in no catalogue, or one that only two lengths show.
    """
    if kind == "lengths":
        pair = draw_lengths(rng, weights)
        return pair, draw_hidden(pair, rng, tuple(OF_LENGTHS))
    case = draw_case(rng, weights)
    return case, draw_hidden(case, rng, case.foreign() if kind == "foreign" else ())

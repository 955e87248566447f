"""Effects of the bench: its clock, its sensor, its screw."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from wirebayes.numeric.distributions import HalfNormal, LogNormal, LogUniform, Normal, Uniform
from wirebayes.numeric.means import geometric_mean
from wirebayes.numeric.typing import Array
from wirebayes.wire.effect import Amplitude, Effect, HoldContext, Own
from wirebayes.wire.protocol import Protocol


class ReadingDelay(Effect):
    """The first reading of a hold comes t_d seconds late."""

    name = "reading_delay"
    pattern = "course of a hold"
    place = "clock"
    formula = "delay"
    scope = "instrument"
    # some seconds in holds of minutes
    amplitudes = (Amplitude("t_d", "s", 0.0, HalfNormal(0.04)),)
    sentence = "The first reading of each hold was taken later than recorded."
    shows = "first reading low, most where creep is fastest"

    def apply(self, value: Array, own: Own, hold: HoldContext) -> Array:
        first = np.zeros((len(hold.time_s), 1))
        first[0] = hold.recorded
        return value + own["t_d"] * first


class LateClock(Effect):
    """All readings of a hold are taken t_d seconds later than recorded, and it lasts t_d longer."""

    name = "late_clock"
    pattern = "course of a hold"
    place = "time"
    formula = "late"
    scope = "instrument"
    # the seconds between the end of a move and the start of a clock by hand, in holds of minutes
    amplitudes = (Amplitude("t_d", "s", 0.0, HalfNormal(0.05)),)
    sentence = "The clock of each hold was started some time after the move."
    sentence_of_weights = "The clock of each hold was started some time after the change of weight."
    shows = "first readings of all holds low"

    def apply(self, value: Array, own: Own, hold: HoldContext) -> Array:
        return value + own["t_d"]


class SensorDrift(Effect):
    """Reading + a x elapsed time."""

    name = "sensor_drift"
    pattern = "slow drift"
    place = "reading"
    formula = "drift"
    scope = "instrument"
    # a tenth of the typical tension a hold, of a gauge a tenth of a step: what drifts faster is seen before the test
    amplitudes = (Amplitude("a", "N/s", 0.0, Normal(0.0, 0.1)),)
    sentence = "The force sensor drifts with time."
    sentence_of_weights = "The gauge drifts with time."
    shows = "grows with elapsed time, also within holds"

    def apply(self, value: Array, own: Own, hold: HoldContext) -> Array:
        return value + own["a"] * (hold.start_s + hold.time_s)


class SensorNonlinearity(Effect):
    """Reading τ + a τ²."""

    name = "sensor_nonlinearity"
    pattern = "elastic curve"
    place = "reading"
    formula = "square"
    scope = "instrument"
    # at the typical tension, under weights at the displacement that the typical weight makes, the reading is wrong by
    # a few per cent: a sensor half wrong is no sensor
    amplitudes = (Amplitude("a", "1/N", 0.0, Normal(0.0, 0.08)),)
    sentence = "The force sensor is nonlinear at higher tension."
    sentence_of_weights = "The gauge is nonlinear at larger displacements."
    shows = "like stiffening; distinguishable with several wires"

    def apply(self, value: Array, own: Own, hold: HoldContext) -> Array:
        return value * (1.0 + own["a"] * value)

    def on(self, protocols: Sequence[Protocol], range_mm: float) -> Effect:
        """Under weights the unit of a displacement is one step of many, and the prior speaks of what is read."""
        if not protocols or any(p.control == "displacement" for p in protocols):
            return self
        (amplitude,) = type(self).amplitudes
        typical = geometric_mean(_typical_over_step(p) for p in protocols)
        own = self.under(self.control)
        own.amplitudes = (replace(amplitude, prior=amplitude.prior.scaled(1.0 / typical)),)  # type: ignore[misc]
        return own


def _typical_over_step(protocol: Protocol) -> float:
    """The typical weight in median changes between holds that differ: by proportion, also of the displacements."""
    weights = protocol.setting[protocol.setting > 0]
    changes = np.abs(np.diff(protocol.setting))
    if not (changes > 0).any() or not weights.size:
        return 1.0
    return float(np.median(weights)) / float(np.median(changes[changes > 0]))


class ClampTransient(Effect):
    """Reading τ (1 + a exp(-t / T))."""

    name = "clamp_transient"
    pattern = "course of a hold"
    place = "reading"
    formula = "transient"
    scope = "instrument"
    amplitudes = (
        # a few per cent of the tension, gone in a tenth of a hold within a factor of three
        Amplitude("a", "-", 0.0, Normal(0.0, 0.05)),
        Amplitude("T", "s", 0.08, LogNormal(1.0, 0.08), is_shape=True),
    )
    sentence = "After each move the clamp or sensor settles, in proportion to the tension."
    sentence_of_weights = "After each change of weight the gauge settles, in proportion to the displacement."
    shows = "decays inside the hold, scales with tension"

    def apply(self, value: Array, own: Own, hold: HoldContext) -> Array:
        return value * (1.0 + own["a"] * np.exp(-hold.time_s / own["T"]))


class _NeedsReversal(Effect):
    """An effect that only a change of direction can show."""

    @classmethod
    def variants(cls, protocols: Sequence[Protocol]) -> list[Effect]:
        turned = [p for p in protocols if len(set(np.sign(np.diff(p.setting, prepend=0.0))) - {0.0}) > 1]
        return [cls()] if turned else []


_SHORTEST = 2.0  # steps: a shorter period looks like a longer one (Nyquist)
_OFF = 0.05  # steps: what a thread or a dial is off by


@dataclass(frozen=True)
class ScrewError(Effect):
    """Position x + a cos(2π x / P + φ) at displacement x: an uneven thread, or a dial that is read unevenly.

    Displacements that are multiples of a step h show no period below 2 h but as one above it: there the prior of P
    begins. It ends at half the range, for a longer one is a bend. At P = 2 h only a cos φ is seen.

    Attributes
    ----------
    longest : float
        Where the log-uniform prior of P ends, in steps.
    of_several : bool
        Whether it is for several tests, which share a and P and have a phase each.
    """

    longest: float = 6.0
    of_several: bool = False
    name = "screw_error"
    pattern = "position of the screw"
    place = "position"
    formula = "screw"
    scope = "instrument"
    sentence = "The position has a periodic error, as of a screw's thread."
    shows = "level of holds alternates or beats with displacement"
    nearly_linear = True
    # a few per cent of a step; with either sign half a turn of phase is enough
    amplitudes = (
        Amplitude("a", "mm", 0.0, Normal(0.0, _OFF)),
        Amplitude("P", "mm", 4.0, LogUniform(_SHORTEST, 6.0), is_shape=True),
        Amplitude("phi", "-", 0.0, Uniform(-0.5 * np.pi, np.pi), is_shape=True, of_each_test=True),
    )

    def __post_init__(self) -> None:
        size, period, phase = type(self).amplitudes
        period = replace(period, prior=LogUniform(_SHORTEST, self.longest))
        if self.of_several:  # one sign for all of them, so each test needs the whole turn
            size = replace(size, prior=HalfNormal(_OFF))
            phase = replace(phase, prior=Uniform(-np.pi, 2.0 * np.pi))
        object.__setattr__(self, "amplitudes", (size, period, phase))

    def apply(self, value: Array, own: Own, hold: HoldContext) -> Array:
        return value + own["a"] * np.cos(2.0 * np.pi / own["P"] * hold.displacement_mm + own["phi"])

    def on(self, protocols: Sequence[Protocol], range_mm: float) -> Effect:
        longest = max((_half_range(p) for p in protocols), default=0.0)
        if self.of_several or longest < _LEAST * _SHORTEST:
            return self
        return type(self)(longest, len(protocols) > 1).under(self.control)

    def shapes_tried(self) -> list[dict[str, float]]:
        """Periods so near that no other fits much better between two, and a phase every sixth of a turn."""
        longest, shortest = 1.0 / self.longest, 1.0 / _SHORTEST
        count = 1 + min(int(np.ceil(4.0 * self.longest * (shortest - longest))), _MOST_PERIODS)
        turns = np.linspace(longest, shortest, count)
        period, phase = self.shape_columns
        sixths = np.arange(-2, 4) if self.of_several else np.arange(-1, 2)
        return [{period: float(1.0 / t), phase: float(p)} for t in turns for p in sixths * (np.pi / 3.0)]

    @classmethod
    def variants(cls, protocols: Sequence[Protocol]) -> list[Effect]:
        """One where half the range is longer than two steps."""
        longest = max((_half_range(p) for p in protocols), default=0.0)
        return [cls(longest, len(protocols) > 1)] if longest >= _LEAST * _SHORTEST else []


_LEAST = 1.5  # of the longest period to the shortest: seven holds at even steps have it
_MOST_PERIODS = 60  # so many are looked at in a test of sixty steps; in a longer one they lie further apart


def _half_range(protocol: Protocol) -> float:
    """Half the range of displacements, zero included, in median moves between those that differ; 0 if none are set."""
    steps = np.abs(np.diff(protocol.setting))
    if protocol.control != "displacement" or not (steps > 0).any():
        return 0.0
    reach = max(float(protocol.setting.max()), 0.0) - min(float(protocol.setting.min()), 0.0)
    return 0.5 * reach / float(np.median(steps[steps > 0]))


class LostMotion(_NeedsReversal):
    """After a reversal the position lags by w."""

    name = "lost_motion"
    pattern = "way back"
    place = "position"
    formula = "lost_motion"
    scope = "instrument"
    # play of a tenth of a step
    amplitudes = (Amplitude("w", "mm", 0.0, HalfNormal(0.1)),)
    sentence = "The screw has play: after a reversal the true position lags behind."
    sentence_of_weights = "The gauge has play: after a reversal what it shows lags behind."
    shows = "unloading branch"

    def apply(self, value: Array, own: Own, hold: HoldContext) -> Array:
        return value - own["w"] * hold.direction if hold.direction != hold.first_direction else value


class GuideFriction(_NeedsReversal):
    """τ (1 ± μ) by direction of motion, relative to the first direction's value."""

    name = "guide_friction"
    pattern = "way back"
    place = "guide"
    formula = "friction"
    scope = "instrument"
    # a guide or a pulley takes a few per cent of the tension
    amplitudes = (Amplitude("mu", "-", 0.0, Normal(0.0, 0.05)),)
    sentence = "Friction in the guide raises the reading while loading and lowers it while unloading."
    sentence_of_weights = (
        "Friction in the guide bears a part of the weight while loading and adds to it while unloading."
    )
    shows = "unloading branch"

    def apply(self, value: Array, own: Own, hold: HoldContext) -> Array:
        return value * (1.0 + own["mu"] * hold.direction)

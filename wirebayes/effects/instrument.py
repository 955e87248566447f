"""Effects of the bench: its clock, its sensor, its screw."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from wirebayes.wire.effect import Amplitude, Effect, HoldContext
from wirebayes.wire.protocol import Protocol

Own = dict[str, NDArray[Any]]


class ReadingDelay(Effect):
    """The first reading of a hold comes t_d seconds late."""

    name = "reading_delay"
    place = "clock"
    formula = "delay"
    scope = "instrument"
    amplitudes = (Amplitude("t_d", "s", 0.0, stats.halfnorm(0.0, 0.04)),)
    sentence = "The first reading of each hold was taken later than recorded."
    shows = "first reading low, most where creep is fastest"

    def apply(self, value: NDArray[Any], own: Own, hold: HoldContext) -> NDArray[Any]:
        first = np.zeros((len(hold.time_s), 1))
        first[0] = hold.recorded
        return value + own["t_d"] * first


class SensorDrift(Effect):
    """Reading + a x elapsed time."""

    name = "sensor_drift"
    place = "reading"
    formula = "drift"
    scope = "instrument"
    amplitudes = (Amplitude("a", "N/s", 0.0, stats.norm(0.0, 0.1)),)
    sentence = "The force sensor drifts with time."
    shows = "grows with elapsed time, also within holds"

    def apply(self, value: NDArray[Any], own: Own, hold: HoldContext) -> NDArray[Any]:
        return value + own["a"] * (hold.start_s + hold.time_s)


class SensorNonlinearity(Effect):
    """Reading τ + a τ²."""

    name = "sensor_nonlinearity"
    place = "reading"
    formula = "square"
    scope = "instrument"
    amplitudes = (Amplitude("a", "1/N", 0.0, stats.norm(0.0, 0.08)),)
    sentence = "The force sensor is nonlinear at higher tension."
    shows = "like stiffening; distinguishable with several wires"

    def apply(self, value: NDArray[Any], own: Own, hold: HoldContext) -> NDArray[Any]:
        return value * (1.0 + own["a"] * value)


class ClampTransient(Effect):
    """Reading τ (1 + a exp(-t / T))."""

    name = "clamp_transient"
    place = "reading"
    formula = "transient"
    scope = "instrument"
    amplitudes = (
        Amplitude("a", "-", 0.0, stats.norm(0.0, 0.05)),
        Amplitude("T", "s", 0.08, stats.lognorm(1.0, scale=0.08), is_shape=True),
    )
    sentence = "After each move the clamp or sensor settles, in proportion to the tension."
    shows = "decays inside the hold, scales with tension"

    def apply(self, value: NDArray[Any], own: Own, hold: HoldContext) -> NDArray[Any]:
        return value * (1.0 + own["a"] * np.exp(-hold.time_s / own["T"]))


class _NeedsReversal(Effect):
    """An effect that only a change of direction can show."""

    @classmethod
    def variants(cls, protocols: Sequence[Protocol]) -> list[Effect]:
        turned = [p for p in protocols if len(set(np.sign(np.diff(p.setting, prepend=0.0))) - {0.0}) > 1]
        return [cls()] if turned else []


class LostMotion(_NeedsReversal):
    """After a reversal the position lags by w."""

    name = "lost_motion"
    place = "position"
    formula = "lost_motion"
    scope = "instrument"
    amplitudes = (Amplitude("w", "mm", 0.0, stats.halfnorm(0.0, 0.1)),)
    sentence = "The screw has play: after a reversal the true position lags behind."
    shows = "unloading branch"

    def apply(self, value: NDArray[Any], own: Own, hold: HoldContext) -> NDArray[Any]:
        return value - own["w"] * hold.direction if hold.direction != hold.first_direction else value


class GuideFriction(_NeedsReversal):
    """τ (1 ± μ) by direction of motion, relative to the first direction's value."""

    name = "guide_friction"
    place = "guide"
    formula = "friction"
    scope = "instrument"
    amplitudes = (Amplitude("mu", "-", 0.0, stats.norm(0.0, 0.05)),)
    sentence = "Friction in the guide raises the reading while loading and lowers it while unloading."
    shows = "unloading branch"

    def apply(self, value: NDArray[Any], own: Own, hold: HoldContext) -> NDArray[Any]:
        return value * (1.0 + own["mu"] * hold.direction)

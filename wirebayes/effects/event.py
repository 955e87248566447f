"""Effects that happened once, at one hold of one test."""

from dataclasses import dataclass

from wirebayes.numeric.distributions import HalfCauchy, Normal
from wirebayes.numeric.typing import Array
from wirebayes.wire.effect import Amplitude, EventEffect, HoldContext, Own


@dataclass(frozen=True)
class GripSlip(EventEffect):
    """Zero-tension length + w from hold h on."""

    name = "grip_slip"
    pattern = "step at a hold"
    place = "zero_length"
    formula = "slip"
    # a third of a step: a grip that gives way by more is seen in the readings
    amplitudes = (Amplitude("w", "mm", 0.0, Normal(0.0, 0.3)),)
    sentence = "The wire slipped in its grip once."
    shows = "one step in level; names the hold"

    def apply(self, value: Array, own: Own, hold: HoldContext) -> Array:
        return value + own["w"] if hold.order >= self.hold else value


@dataclass(frozen=True)
class UnrecordedHold(EventEffect):
    """Before hold h, T seconds passed at its displacement."""

    name = "unrecorded_hold"
    pattern = "step at a hold"
    place = "wait"
    formula = "wait"
    # some holds long, as a pause between two holds is; the tail is for a night in a test of minutes, hundreds of holds
    amplitudes = (Amplitude("T", "s", 0.0, HalfCauchy(2.5)),)
    sentence = "Time passed at a displacement before its first reading."
    sentence_of_weights = "Time passed under a weight before its first reading."
    shows = "step in level; names the hold"

    def apply(self, value: Array, own: Own, hold: HoldContext) -> Array:
        return value + own["T"] if hold.order == self.hold else value + 0.0 * own["T"]

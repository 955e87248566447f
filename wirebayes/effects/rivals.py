"""Alternatives to eq (5): other time laws, and eq (2) without any. Not missing effects, so not in the catalogue.

A time law returns the share of the creep reached by a time, in place of that of eq (5).
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from wirebayes.numeric.distributions import LogNormal, Uniform
from wirebayes.numeric.typing import Array
from wirebayes.wire.effect import Amplitude, Effect, HoldContext, Own, Typical

LONG = 720.0  # typical holds: a day, where they last two minutes


@dataclass(frozen=True)
class _WithoutPlateau(Effect):
    """A time law without a plateau: the creep of eq (4) is what is reached after a long time, `long_s`."""

    long_s: float = LONG * 120.0

    def formula_constant(self, typical: Typical) -> float:
        return self.long_s

    def in_units(self, set_: float, read: float, time: float) -> "_WithoutPlateau":
        return replace(self, long_s=self.long_s * time)

    def referred(self, hold_s: float) -> "_WithoutPlateau":
        return replace(self, long_s=LONG * hold_s)


class AtOnce(Effect):
    """Eq (2) without time: the strain is an elastic part s and a creep part B (k1 s)^U / L0."""

    name = "at_once"
    place = "strain"
    formula = "at_once"
    scope = "material"
    amplitudes = ()
    sentence = "All creep of eq (2) happens before the first reading."

    def apply(self, value: Array, own: Own, hold: HoldContext) -> Array:
        stretched = value.real > 0
        whole = np.where(stretched, value, 1.0)
        exponent = hold.theta["U"]
        log_creep = np.log(hold.theta["B"] / hold.length_mm) + exponent * np.log(hold.theta["k1"])
        # In log s the equation is convex and rising: Newton's steps from above cannot miss.
        log_s = np.minimum((np.log(whole.real) - log_creep.real) / exponent.real, np.log(whole.real))
        for _ in range(_NEWTON_STEPS - 1):
            log_s = _nearer(log_s, log_creep.real, exponent.real, whole.real)
        log_s = _nearer(log_s, log_creep, exponent, whole)  # from the root itself, a step has its derivatives, too
        return np.where(stretched, np.exp(log_s), value)


def _nearer(log_s: Array, log_creep: Array, exponent: Any, whole: Array) -> Array:
    """One of Newton's steps towards the elastic part of a whole strain, in its logarithm."""
    elastic, crept = np.exp(log_s), np.exp(log_creep + exponent * log_s)
    return log_s - (elastic + crept - whole) / (elastic + exponent * crept)


_NEWTON_STEPS = 7  # exact to rounding from where they start, in each of 20,000 draws of the prior; five leave 4e-9


class NotInTime(Effect):
    """No creep by eq (5) at all; beside `AtOnce`."""

    name = "not_in_time"
    place = "fraction"
    formula = "not_in_time"
    scope = "material"
    amplitudes = ()
    sentence = "Nothing changes while a position is held."

    def apply(self, value: Array, own: Own, hold: HoldContext) -> Array:
        return 0.0 * value


class Logarithmic(_WithoutPlateau):
    """log(1 + t / t0), one after a long time."""

    name = "logarithmic"
    place = "fraction"
    formula = "logarithmic"
    scope = "material"
    amplitudes = (Amplitude("t0", "s", np.nan, LogNormal(1.5, 0.08), is_shape=True),)
    sentence = "Creep grows with the logarithm of time."

    def apply(self, value: Array, own: Own, hold: HoldContext) -> Array:
        share = np.log1p(hold.time_s / own["t0"]) / np.log1p(self.long_s / own["t0"])
        return share + 0.0 * value


class PowerLaw(_WithoutPlateau):
    """(t / long time)^n."""

    name = "power_law"
    place = "fraction"
    formula = "power_of_time"
    scope = "material"
    amplitudes = (Amplitude("n", "-", np.nan, LogNormal(0.7, 0.25), is_shape=True),)
    sentence = "Creep grows with a power of time."

    def apply(self, value: Array, own: Own, hold: HoldContext) -> Array:
        return (hold.time_s / self.long_s) ** own["n"] + 0.0 * value


class TwoModes(Effect):
    """Two exponentials, the second slower by a factor."""

    name = "two_modes"
    place = "fraction"
    formula = "two_modes"
    scope = "material"
    amplitudes = (
        Amplitude("slow_share", "-", np.nan, Uniform(0.0, 1.0)),
        Amplitude("slower", "-", np.nan, LogNormal(1.0, 10.0), is_shape=True),
    )
    sentence = "The creep has two exponential modes."

    def apply(self, value: Array, own: Own, hold: HoldContext) -> Array:
        rate = hold.theta["k2"] * hold.time_s
        share = (1.0 - own["slow_share"]) * -np.expm1(-rate) + own["slow_share"] * -np.expm1(-rate / own["slower"])
        return share + 0.0 * value


RIVALS: dict[str, type[Effect]] = {rival.name: rival for rival in (AtOnce, NotInTime, Logarithmic, PowerLaw, TwoModes)}

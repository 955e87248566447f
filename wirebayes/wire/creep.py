"""Creep of one hold with effects, eqs (4) and (5): what the bench, a fresh sample and a robot's wire share.

The caller says under which tension the wire creeps and how time passes; this module composes the effects.
"""

from collections.abc import Mapping

import numpy as np

from wirebayes.numeric.typing import Array
from wirebayes.wire import laws
from wirebayes.wire.effect import HoldContext, Placed


class Creep:
    """The creep law of one set of parameters.

    Parameters
    ----------
    effects : Placed
    theta : mapping of name to array
        ``B U k2 N``; arrays end in the batch axis.
    history : {"saturating", "additive"}
    """

    def __init__(self, effects: Placed, theta: Mapping[str, Array], history: laws.History) -> None:
        self.effects = effects
        self.B, self.U, self.k2, self.N = theta["B"], theta["U"], theta["k2"], theta["N"]
        self.kept = 1.0 if history == "saturating" else 0.0

    def amount(self, tension_N: Array, hold: HoldContext) -> Array:
        """Creep still to come in a hold under a tension, mm, given what `hold` has carried into it."""
        target = laws.creep_target(self.effects.change("drive", tension_N, hold), self.B, self.U)
        return self.effects.change("amount", target - self.kept * hold.carried, hold)

    def rate(self, hold: HoldContext) -> Array:
        """k2 in a hold, s^-N."""
        return self.effects.change("rate", self.k2, hold)

    def clock(self, hold: HoldContext) -> Array:
        """Time since the hold began as the creep counts it, s."""
        return self.effects.change("clock", hold.time_s, hold)

    def fraction(self, k2: Array, hold: HoldContext) -> Array:
        """Share of the amount reached at the times of a hold."""
        return self.fraction_after(self.clock(hold), k2, hold)

    def fraction_after(self, clock_s: Array, k2: Array, hold: HoldContext) -> Array:
        """Share of the amount reached when creep has gone on for so long.

        Parameters
        ----------
        clock_s : array
            As creep counts it: a reading that comes late has no part in it.
        k2 : array
            What `rate` returned.
        hold : HoldContext
        """
        return self.effects.change("fraction", laws.creep_fraction(clock_s, k2, self.N), hold)

    def creep(self, grown_mm: Array, hold: HoldContext) -> Array:
        """Creep elongation at the times of a hold, mm; `grown_mm` is what was carried in and has grown since."""
        return self.effects.change("creep", grown_mm, hold)

    def beside(self, carried: Mapping[str, Array], hold: HoldContext) -> dict[str, Array]:
        """Elongations beside the creep at the times of a hold, mm, by effect key; `carried` is what came into it."""
        return {
            effect.key: effect.apply(carried.get(effect.key, np.zeros((1, 1))), self.effects.own[effect.key], hold)
            for effect in self.effects.at.get("elongation", ())
        }

    def elongation(self, creep_mm: Array, beside: Mapping[str, Array], hold: HoldContext) -> Array:
        """Growth of the zero-tension length over the length before the test, mm.

        Parameters
        ----------
        creep_mm : (R, n) array
            What `creep` returned.
        beside : mapping of effect key to (R, n) array
            What `beside` returned.

        Returns
        -------
        (R, n) array
        """
        total = sum(beside.values(), creep_mm)
        if "zero_length" in self.effects.at:  # a difference of lengths would cost the others some digits
            total = self.effects.change("zero_length", hold.length_mm + total, hold) - hold.length_mm
        return total

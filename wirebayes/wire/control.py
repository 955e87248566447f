"""What is set in a hold and what is read: the displacement and the tension (steps), or the reverse (weights).

Both kinds of test are this one description; the walk along the holds, the creep and all that is built on them know no
other. Instruments act where they are: the screw or the gauge on the position, the guide between the wire and what holds
it, the sensor or the gauge on what it shows.
"""

from wirebayes.numeric.typing import Array
from wirebayes.wire.effect import HoldContext, Placed
from wirebayes.wire.elastic_with_effects import Elastic
from wirebayes.wire.inverse import inverse
from wirebayes.wire.protocol import Control


class Steps:
    """The displacement is set, mm, and the tension is read, N.

    Parameters
    ----------
    effects : Placed
    elastic : Elastic
    base_mm : (n,) array
        Stretched length at displacement zero.
    """

    def __init__(self, effects: Placed, elastic: Elastic, base_mm: Array) -> None:
        self.effects, self.elastic, self.base_mm = effects, elastic, base_mm

    def held(self, setting: Array, hold: HoldContext) -> Array:
        """What of the wire stays as it is during a hold.

        Parameters
        ----------
        setting : (n,) or (1,) array
            What was set, with its error.

        Returns
        -------
        (1, n) array
            Stretched length, mm, or tension, N.
        """
        position: Array = self.effects.change("position", (self.base_mm + setting)[None], hold)
        return position

    def tension(self, held: Array, elongation_mm: Array, hold: HoldContext) -> Array:
        """Tension of the wire, N.

        Parameters
        ----------
        held : (1, n) array
        elongation_mm : (R, n) array
            Of the zero-tension length.
        """
        return self.elastic.tension(held, elongation_mm, hold)

    def read(self, held: Array, elongation_mm: Array, hold: HoldContext) -> Array:
        """Readings (R, n), N or mm.

        Parameters
        ----------
        held : (1, n) array
        elongation_mm : (R, n) array
            Of the zero-tension length.
        """
        tension = self.effects.change("guide", self.elastic.tension(held, elongation_mm, hold), hold)
        readings: Array = self.effects.change("reading", tension, hold)
        return readings


class Weights(Steps):
    """The tension is set, N, and the displacement is read, mm."""

    def held(self, setting: Array, hold: HoldContext) -> Array:
        if "guide" not in self.effects.at:
            return setting[None]
        return inverse(lambda tension: self.effects.change("guide", tension, hold), setting[None])

    def tension(self, held: Array, elongation_mm: Array, hold: HoldContext) -> Array:
        return held

    def read(self, held: Array, elongation_mm: Array, hold: HoldContext) -> Array:
        position = self.elastic.position(held, elongation_mm, hold)
        hold.displacement_mm = position - self.base_mm
        shown = self.effects.change("position", position, hold) - self.base_mm
        readings: Array = self.effects.change("reading", shown, hold)
        return readings


SETTINGS: dict[Control, type[Steps]] = {"displacement": Steps, "force": Weights}
READ_UNIT: dict[Control, str] = {"displacement": "N", "force": "mm"}
SET_UNIT: dict[Control, str] = {"displacement": "mm", "force": "N"}

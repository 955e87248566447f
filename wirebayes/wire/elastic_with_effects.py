"""Elasticity of a wire with its effects: from the stretched length to the tension, and back."""

import numpy as np

from wirebayes.numeric.typing import Array
from wirebayes.wire.bent_strain import strain_of
from wirebayes.wire.effect import HoldContext, Placed
from wirebayes.wire.laws import LAWS, ElasticLaw


class Elastic:
    """The elastic law of one set of parameters.

    Parameters
    ----------
    effects : Placed
    k1 : (n,) array
        N per unit strain.
    length_mm : float
        Zero-tension length before the test.
    law : {"hooke", "modified"}
    """

    def __init__(self, effects: Placed, k1: Array, length_mm: float, law: ElasticLaw) -> None:
        self.effects, self.k1, self.length_mm, self.law = effects, k1, length_mm, LAWS[law]

    def tension(self, position_mm: Array, elongation_mm: Array, hold: HoldContext) -> Array:
        """Tension at a stretched length, N; zero when slack.

        Parameters
        ----------
        position_mm : array
            Stretched length.
        elongation_mm : array
            Of the zero-tension length.
        """
        hold.zero_mm = self._zero(elongation_mm, hold)
        strain = self.effects.change("strain", self.law.strain(position_mm, hold.zero_mm), hold)
        return np.where(strain.real > 0, self.k1 * strain, 0.0)

    def position(self, tension_N: Array, elongation_mm: Array, hold: HoldContext) -> Array:
        """Stretched length under a tension, mm; NaN where the wire cannot carry it.

        Parameters
        ----------
        tension_N : array
        elongation_mm : array
            Of the zero-tension length.
        """
        hold.zero_mm = self._zero(elongation_mm, hold)
        return self.law.stretched(strain_of(self.effects, tension_N / self.k1, hold), hold.zero_mm)

    def _zero(self, elongation_mm: Array, hold: HoldContext) -> Array:
        zero: Array = self.effects.change("zero_length", self.length_mm + elongation_mm, hold)
        return zero

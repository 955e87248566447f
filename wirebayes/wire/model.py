"""Which wire is computed: its laws and effects, and the constants they refer to."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wirebayes.numeric.means import geometric_mean
from wirebayes.numeric.typing import Array
from wirebayes.wire import laws
from wirebayes.wire.effect import ONE_NEWTON_AND_SECOND, Effect, Typical


@dataclass(frozen=True)
class Model:
    """The model of a wire: elastic law, history, effects, and the constant the effects refer to.

    Attributes
    ----------
    law : {"hooke", "modified"}
        Eq (1) or eq (3).
    history : {"saturating", "additive"}
        Whether eq (4) is the total creep a tension leads to, or is added again in every hold.
    effects : tuple of Effect
    tension_ref_N : float
        Geometric mean of the training tensions.
    length_ref_mm : float
        Geometric mean of the samples' lengths, for effects that compare lengths; 0 means this sample's own.
    typical : Typical
        Tension and hold of the tests that are fitted together.
    """

    law: laws.ElasticLaw = "hooke"
    history: laws.History = "saturating"
    effects: tuple[Effect, ...] = ()
    tension_ref_N: float = 1.0
    length_ref_mm: float = 0.0
    typical: Typical = ONE_NEWTON_AND_SECOND

    @cached_property
    def compiled(self) -> tuple[tuple[str, ...], tuple[tuple[str, int, float], ...]] | None:
        """Columns of the effects' amplitudes, and what the compiled twin knows the effects by; None where it does not.

        Every evaluation asks for it.
        """
        if not all(effect.has_formula for effect in self.effects):
            return None
        columns = tuple(column for effect in self.effects for column in effect.columns())
        formulas = tuple((e.formula, len(e.amplitudes), e.formula_constant(self.typical)) for e in self.effects)
        return columns, formulas

    def at(self, place: str) -> list[Effect]:
        """The effects at one place, in the order they compose."""
        return [effect for effect in self.effects if effect.place == place]


PLAIN = Model()


def tension_reference(tensions: Sequence[float] | Array) -> float:
    """Geometric mean of the positive tensions, N; the constant that some effects and coordinates refer to."""
    values = np.asarray(tensions, float)
    values = values[values > 0]
    return geometric_mean(values) if values.size else 1.0

"""What a search for the missing effect is asked."""

from collections.abc import Mapping
from dataclasses import dataclass

from wirebayes.wire.effect import Effect
from wirebayes.wire.laws import ElasticLaw, History

ALPHA = 0.04  # level of the global test: one clean file in twenty-five is called incomplete
SIMULATIONS = 999  # p of .04 is then known to .006, and more are made where that is not enough


@dataclass(frozen=True)
class Settings:
    """What is asked.

    Attributes
    ----------
    law, history
        Of the plain model.
    kinds : mapping of name to effect class
        The catalogue searched.
    simulations : int
        Refitted data sets behind the p-value; more where it lies too close to the level to tell.
    """

    law: ElasticLaw = "hooke"
    history: History = "saturating"
    kinds: Mapping[str, type[Effect]] = None  # type: ignore[assignment]
    simulations: int = SIMULATIONS

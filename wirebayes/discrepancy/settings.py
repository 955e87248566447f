"""What a search for the missing effect is asked."""

from collections.abc import Mapping
from dataclasses import dataclass

from wirebayes.wire.effect import Effect
from wirebayes.wire.laws import ElasticLaw, History


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
        Refitted data sets behind the p-value.
    """

    law: ElasticLaw = "hooke"
    history: History = "saturating"
    kinds: Mapping[str, type[Effect]] = None  # type: ignore[assignment]
    simulations: int = 999

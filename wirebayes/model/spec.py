"""Which model of a wire is fitted, in one object that is handed on."""

from dataclasses import dataclass
from typing import Any

from wirebayes.model.sample import Likelihood
from wirebayes.wire.laws import ElasticLaw, History


@dataclass(frozen=True)
class ModelSpec:
    """The model that is fitted, beside its effects: these are keys where a worker loads them, objects where they act.

    Attributes
    ----------
    law : {"hooke", "modified"}
        Of elasticity: eq (1) or eq (3).
    history : {"saturating", "additive"}
        Whether eq (4) is the total creep a tension leads to, or is added again in every hold.
    likelihood : {"chain", "hold"}
        Whether the holds are one history, or each an experiment of its own (`wirebayes.model.likelihoods`).
    length_exponent : float or Distribution
        p of B ∝ L0^p among samples of one material: a value, or a prior to learn it.
    """

    law: ElasticLaw = "hooke"
    history: History = "saturating"
    likelihood: Likelihood = "chain"
    length_exponent: Any = 1.0


PLAIN_SPEC = ModelSpec()

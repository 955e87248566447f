"""The models that a comparison sets side by side, each differing from a base in one thing."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from wirebayes.effects import effect_named
from wirebayes.effects.rivals import RIVALS
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.inference.modes import modes
from wirebayes.io.experiment import Experiment
from wirebayes.model.build import build
from wirebayes.model.problem import Problem
from wirebayes.model.spec import PLAIN_SPEC, ModelSpec
from wirebayes.wire.effect import Effect, EventEffect, Kinds

HOOKE, TIME = "Is Hooke's law enough?", "Which time law?"
LAW, HISTORY, LIKELIHOOD = "Which elastic law?", "Which history?", "One history, or every hold by itself?"
SETTING, ABSENT = "Do setting errors matter?", "Was the wire held where readings are missing?"
EFFECT = "Which effect helps?"
BASE = "plain"
_NO_TIME_LAW = {"k2": 1.0, "N": 1.0}  # where something else stands for the time law, it does not matter what they are
_NO_CREEP = {"B": 0.0, "U": 1.0, **_NO_TIME_LAW}  # an amount of zero; what the others are does not matter then


@dataclass(frozen=True)
class ModelToCompare:
    """One model of a comparison.

    Attributes
    ----------
    name : str
        ``plain`` for the base.
    question, sentence : str
        What its comparison with the base answers, and what it says of the wire.
    spec : ModelSpec
    effects : tuple of str
        Keys; an event without its hold (``grip_slip``) stands for the hold with the most evidence in the training.
    fixed : dict
        Parameters kept at a value.
    unrecorded : bool
        False to skip the holds without readings, as if they had not been.
    """

    name: str
    question: str
    sentence: str
    spec: ModelSpec = PLAIN_SPEC
    effects: tuple[str, ...] = ()
    fixed: Mapping[str, float] = field(default_factory=dict)
    unrecorded: bool = True


def candidates(
    experiment: Experiment, base: ModelToCompare, known: Kinds, only: Sequence[str] | None = None
) -> list[ModelToCompare]:
    """The base and everything that may be set beside it for this experiment.

    Parameters
    ----------
    base : ModelToCompare
        Law, history and likelihood that the others share.
    known : mapping of name to effect class
    only : sequence of str, optional
        Keep only these names (and the base).
    """

    beside = [*_other_creep(base), *_other_model(base)]
    if any(not hold.recorded for hold in experiment.holds):
        sentence = "No time passed where readings are missing."
        beside.append(_beside(base, "unrecorded_skipped", ABSENT, sentence, unrecorded=False))
    beside += _with_effects(experiment, base, known)
    return [base, *(candidate for candidate in beside if only is None or candidate.name in only)]


def _beside(base: ModelToCompare, name: str, question: str, sentence: str, **changes: Any) -> ModelToCompare:
    return replace(base, name=name, question=question, sentence=sentence, **changes)


def _other_creep(base: ModelToCompare) -> list[ModelToCompare]:
    """No creep, and other laws of how it comes by time."""

    def rival(name: str, fixed: dict[str, float]) -> ModelToCompare:
        return _beside(base, name, TIME, RIVALS[name].sentence, effects=(name,), fixed=fixed)

    at_once = RIVALS["at_once"].sentence
    return [
        _beside(base, "hooke_without_creep", HOOKE, "The wire is a spring and does not creep.", fixed=_NO_CREEP),
        _beside(base, "creep_at_once", HOOKE, at_once, effects=("at_once", "not_in_time"), fixed=_NO_TIME_LAW),
        _beside(base, "exponential", TIME, "The creep has one time constant: N = 1.", fixed={"N": 1.0}),
        rival("logarithmic", _NO_TIME_LAW),
        rival("power_law", _NO_TIME_LAW),
        rival("two_modes", {"N": 1.0}),
    ]


def _other_model(base: ModelToCompare) -> list[ModelToCompare]:
    """The other elastic law, history and likelihood."""
    spec = base.spec
    out = []
    if spec.law == "hooke":
        sentence = "Strain is taken over the stretched length, eq (3)."
        out.append(_beside(base, "modified_hooke", LAW, sentence, spec=replace(spec, law="modified")))
    else:
        sentence = "Strain is taken over the zero-tension length, eq (1)."
        out.append(_beside(base, "hooke", LAW, sentence, spec=replace(spec, law="hooke")))
    if spec.history == "saturating":
        sentence = "Every hold adds the creep of eq (4) again."
        out.append(_beside(base, "additive", HISTORY, sentence, spec=replace(spec, history="additive")))
    else:
        sentence = "Creep saturates towards the amount of eq (4)."
        out.append(_beside(base, "saturating", HISTORY, sentence, spec=replace(spec, history="saturating")))
    if spec.likelihood == "chain":
        sentence = "Every hold is a separate experiment."
        out.append(_beside(base, "hold_by_hold", LIKELIHOOD, sentence, spec=replace(spec, likelihood="hold")))
        sentence = "Positions are exact; each reading has an independent error."
        out.append(_beside(base, "independent_errors", SETTING, sentence, fixed={"setting_sd": 0.0}))
    else:
        sentence = "The holds form one history."
        out.append(_beside(base, "chain", LIKELIHOOD, sentence, spec=replace(spec, likelihood="chain")))
    return out


def _with_effects(experiment: Experiment, base: ModelToCompare, known: Kinds) -> list[ModelToCompare]:
    """The model with each effect that the test may show."""
    protocol = experiment.protocol()
    out = []
    for name, kind in known.items():
        if kind.needs_saturation and base.spec.history == "additive":
            continue
        keys = [name] if issubclass(kind, EventEffect) else [each.key for each in kind.variants([protocol])]
        sentence = kind.sentence_under(experiment.control)
        out += [_beside(base, key, EFFECT, sentence, effects=(key,)) for key in keys]
    return out


def effects_of(candidate: ModelToCompare, training: Experiment, known: Kinds, seed: int) -> list[Effect]:
    """The candidate's effects; an event is put at the training hold where it has the most evidence (Laplace).

    Parameters
    ----------
    training : Experiment
        The training holds only, so that an event is never placed by readings that are predicted later.
    known : mapping of name to effect class
        The catalogue, a user's own effects included.
    seed : int
        Of the fits that place an event.

    Returns
    -------
    list of Effect
    """
    out: list[Effect] = []
    for key in candidate.effects:
        name = key.split("@")[0]
        if name in RIVALS:
            out.append(RIVALS[name]())
        elif "@" not in key and issubclass(known[name], EventEffect):
            out.append(_most_evident(candidate, training, known[name].variants([training.protocol()]), seed))
        else:
            out.append(effect_named(key, known))
    return out


def _most_evident(candidate: ModelToCompare, training: Experiment, variants: Sequence[Effect], seed: int) -> Effect:
    evidence = []
    for variant in variants:
        problem = problem_of(candidate, training, [variant])
        target = LogPosterior(problem.in_units(problem.own_units))
        found = modes(target, np.random.default_rng(seed))
        evidence.append(np.where(found.converged, found.log_evidence, -np.inf).max())
    return variants[int(np.argmax(evidence))]


def problem_of(candidate: ModelToCompare, training: Experiment, effects: Sequence[Effect]) -> Problem:
    """The candidate's posterior of an experiment.

    Parameters
    ----------
    candidate : ModelToCompare
        Parameters that it fixes leave the posterior.
    effects : sequence of Effect
        What `effects_of` returned.
    """
    problem = build([training], effects, candidate.spec)
    prior = problem.prior
    here = {name: value for name, value in candidate.fixed.items() if name in prior.names}
    free = {name: distribution for name, distribution in prior.distributions.items() if name not in here}
    logarithmic = prior.logarithmic & free.keys()
    prior = replace(prior, distributions=free, fixed=prior.fixed | here, logarithmic=logarithmic)
    return replace(problem, prior=prior)

"""From the probabilities of models to the evidence on each material: families, what they gain, and what remains."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from scipy.special import logsumexp

from wirebayes.discovery import model_space
from wirebayes.discovery.families import Family
from wirebayes.discovery.fitted_sets import Accepted, Explored, Fits, FittedSet, Key
from wirebayes.discovery.gains import family_gain, name_gain
from wirebayes.discovery.held_out import LeftOut
from wirebayes.discovery.judgement import Evidence, FamilyEvidence
from wirebayes.discovery.model_space import EffectSet, ModelPosterior, largest_first
from wirebayes.discovery.predicting import Predicting
from wirebayes.discovery.retest import Retest, complete, fails, retested
from wirebayes.discovery.settings import ALPHA_AFTER, LEAST_HOLDS, P_SLOPE, Settings
from wirebayes.inference.laplace_fit import LaplaceFit
from wirebayes.numeric.typing import Array
from wirebayes.processes.workers import ParallelMap


@dataclass(frozen=True)
class Decision:
    """What the models say of every material.

    Attributes
    ----------
    posterior : ModelPosterior
    best : FittedSet or None
        The most probable set of effects, fitted, or the one it gave way to; None where that is the plain model.
    retest : Retest or None
        With the best set inside, or with the one that was, where a remainder alone came out more probable.
    gains : dict of family to float
        What each family of the best set gains by leaving out one hold at a time; none where there are too few holds.
    best_gain : float or None
        What the best set's first effect gains.
    """

    posterior: ModelPosterior
    best: FittedSet | None
    retest: Retest | None
    gains: dict[Family, float] = field(default_factory=dict)
    best_gain: float | None = None


def decide(
    plain: list[LaplaceFit],
    explored: Explored,
    families: Sequence[Family],
    settings: Settings,
    left_out: LeftOut,
    rng: np.random.Generator,
    parallel_map: ParallelMap,
) -> Decision:
    """Weigh the sets, leave out those whose last family does not predict, and test the best one once more.

    Parameters
    ----------
    plain : list of LaplaceFit
        One a material.
    explored : Explored
        Sets of effects that the search visited, with their evidence and fits.
    families : sequence of tuple of str
        Names that these tests cannot tell apart.
    settings : Settings
    left_out : LeftOut
        Scores the fits.
    rng : numpy.random.Generator
    parallel_map : function
        The built-in `map`, or one over processes.

    Returns
    -------
    Decision
    """
    fits = Fits(plain, explored, settings, rng)
    predicting = Predicting(explored, fits, left_out, rng, parallel_map)
    weigh = partial(model_space.log_weights, names=len(settings.kinds), families=families, other=explored.left_over)
    sets, gave_way, found = _predicting_sets(explored, weigh, predicting, families, len(plain))
    best = _best_fitted(found, explored)
    if best is None:
        return Decision(found, None, None)
    retest = retested(best, rng, parallel_map)
    if fails(retest):
        predicts = partial(predicting.last_predicts, found=found)
        passing = complete(found, explored, best, predicts, rng, parallel_map)
        if passing is not None:
            failed = passing.failed | {best.effects.key}
            sets = [s for s in sets if s.key not in failed]
            best = passing.best
            retest = passing.retest
    weights = _after(retest, sets, weigh(sets), best, found)
    found = _posterior(sets, weights, gave_way, families, len(plain))
    if not found.best.names:
        return Decision(found, None, retest)
    if _has_few_holds(plain):
        return Decision(found, best, retest)
    names = best.effects.names
    of_names = dict.fromkeys(found.family(name) for name in names)
    by_family = {family: family_gain(best, family, found, fits, left_out) for family in of_names}
    first_gain = name_gain(best, names[0], fits, left_out)
    return Decision(found, best, retest, by_family, first_gain)


def _has_few_holds(blocks: Sequence[LaplaceFit]) -> bool:
    """Whether any test has too few holds to leave one out."""
    counts = [len(e.recorded_holds) for block in blocks for e in block.experiments]
    return min(counts) < LEAST_HOLDS


_Weights = tuple[Array, Array]  # log weights of sets, without a remainder and with one


def _predicting_sets(
    explored: Explored,
    weigh: Callable[[Sequence[EffectSet]], _Weights],
    predicting: Predicting,
    families: Sequence[Family],
    blocks: int,
) -> tuple[list[EffectSet], set[Key], ModelPosterior]:
    """The sets whose last family predicts, those of them whose remainder does not, and what they say together."""
    sets = list(explored.sets)
    gave_way: set[Key] = set()
    while True:
        weights = weigh(sets)
        found = _posterior(sets, weights, gave_way, families, blocks)
        giving_way = predicting.giving_way(found)
        if giving_way:
            gave_way |= giving_way
            continue
        best = _best_fitted(found, explored)
        if best is None or predicting.last_predicts(best, found):
            return sets, gave_way, found
        kinds = _kinds(best.effects, found)
        sets = [s for s in sets if not kinds <= _kinds(s, found)]
        gave_way.clear()  # to sets that may be gone


def _posterior(
    sets: Sequence[EffectSet], weights: _Weights, gave_way: set[Key], families: Sequence[Family], blocks: int
) -> ModelPosterior:
    """Probabilities, where no remainder stands beside the sets where it gave way."""
    without, beside = weights
    stays = np.array([s.key not in gave_way for s in sets])
    return model_space.posterior(sets, without, np.where(stays, beside, -np.inf), blocks, families)


def _after(
    retest: Retest, sets: Sequence[EffectSet], weights: _Weights, best: FittedSet, found: ModelPosterior
) -> _Weights:
    """The log weights of sets, without a remainder and with one, once the best one has been tested."""
    without, beside = weights
    if retest.p is None:
        return without, beside
    alike = [k for k, s in enumerate(sets) if _kinds(s, found) == _kinds(best.effects, found)]
    odds = float(-P_SLOPE * np.log(retest.p / ALPHA_AFTER))
    return without, _more_beside(sets, without, beside, alike, odds)


def _kinds(effects: EffectSet, found: ModelPosterior) -> frozenset[tuple[Family, int]]:
    """The families of a set's names, each numbered within its family: two names of one family are more than one."""
    families = [found.family(name) for name in effects.names]
    return frozenset((family, families[:k].count(family)) for k, family in enumerate(families))


def _best_fitted(found: ModelPosterior, explored: Explored) -> FittedSet | None:
    """The most probable set, if effects are in it; where a chain of refits is all that is known of it, the next one."""
    if not found.best.names or found.best.key in explored.fitted:
        return explored.fitted.get(found.best.key)
    weights = {key: weight for key, weight in found.weights.items() if key in explored.fitted}
    return explored.fitted[max(weights, key=lambda key: weights[key])] if weights else None


def _more_beside(sets: Sequence[EffectSet], without: Array, beside: Array, alike: Sequence[int], odds: float) -> Array:
    """Log weights with more for a remainder beside the sets `alike`, or for a remainder alone.

    What is left beside a name may mean that it is the wrong name: the smooth remainder shows whether one of its family
    is needed where one is in the model anyway, so the two share in proportion to their weights there. Look-alikes leave
    the same over: what the best of them leaves counts for all.

    Parameters
    ----------
    sets : sequence of EffectSet
    without, beside : (s,) arrays
        Log weights without and with a remainder.
    alike : sequence of int
        Sets of the families of the one that was tested.
    odds : float
        Log odds of a remainder beside it, to none.
    """
    alone = next(k for k, s in enumerate(sets) if not s.names)
    log_odds_alone = np.clip(beside[alone] - logsumexp(beside[alike]), -50.0, 50.0)
    share = 1.0 / (1.0 + np.exp(log_odds_alone))
    more_beside = without[alike] + odds + np.log(share)
    more_alone = -np.inf
    if share < 1.0:
        more_alone = float(logsumexp(without[alike])) + odds + np.log1p(-share)
    out = beside.copy()
    out[alike] = np.logaddexp(out[alike], more_beside)
    out[alone] = np.logaddexp(out[alone], more_alone)
    return out


def evidence(decision: Decision, p: float, block: int, remainder_gain: float | None = None) -> Evidence:
    """What decides the verdict on a material.

    Parameters
    ----------
    decision : Decision
    p : float
        Of the global test on the plain model.
    block : int
        Number of the material.
    remainder_gain : float, optional
        What a smooth discrepancy beside the established families gains.
    """
    found = decision.posterior
    return Evidence(
        p=p,
        nothing=float(found.nothing[block]) if found.shares[block] else 1.0,
        families=tuple(_families(decision, block)),
        shares=found.shares[block],
        best_gain=decision.best_gain,
        remainder=float(found.remainder[block]),
        remainder_gain=remainder_gain,
    )


def _families(decision: Decision, block: int) -> list[FamilyEvidence]:
    """What is known of each family in a material: those of the best set first, then the others by probability."""
    found = decision.posterior
    best = decision.best
    together = {}
    for family, probability in zip(found.families, found.together, strict=True):
        together[family] = float(probability[block])
    gains = decision.gains
    accepted = list(gains)
    if best is not None:
        accepted = [found.family(name) for name in best.effects.names]
    ranked = sorted(found.families, key=lambda family: -together[family])
    out = []
    for family in dict.fromkeys([*accepted, *ranked]):
        members = _members(found, family, block)
        evidence = FamilyEvidence(members, together[family], gains.get(family))
        out.append(evidence)
    return out


def _members(found: ModelPosterior, family: Family, block: int) -> dict[str, float]:
    """Probability of each name of a family in a material, the most probable first."""
    known = [name for name in family if name in found.inclusion]
    return largest_first({name: float(found.inclusion[name][block]) for name in known})


def accepted_effects(decision: Decision, found: Evidence, block: int) -> list[Accepted]:
    """Effects that the final model of a material has: those of established families, else the best one.

    Parameters
    ----------
    decision : Decision
    found : Evidence
        On the material.
    block : int
        Its number.
    """
    if decision.best is None:
        return []
    here = [a for a in decision.best.accepted if block in a.blocks]
    sure = {name for family in found.established for name in family.members}
    return [a for a in here if a.name in sure] if sure else here[:1]

"""From the probabilities of models to the evidence on each material: families, what they gain, and what remains."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import logsumexp

from wirebayes.discovery import model_space, residual_patterns, screening
from wirebayes.discovery.families import Family
from wirebayes.discovery.global_test import is_close, with_more
from wirebayes.discovery.held_out import LeftOut
from wirebayes.discovery.judgement import Evidence, FamilyEvidence
from wirebayes.discovery.linear_scan import expand, scan
from wirebayes.discovery.model_space import EffectSet, ModelPosterior
from wirebayes.discovery.screening import Replicates
from wirebayes.discovery.settings import (
    ALPHA_AFTER,
    GIVE_WAY,
    KEEP_ELPD,
    LEAST_ALTERNATIVE,
    LEAST_HOLDS,
    MOST_ALTERNATIVES,
    MOST_RETESTS,
    P_SLOPE,
    RETESTS,
    Settings,
)
from wirebayes.discovery.stepwise import Accepted, Explored, Fits, FittedSet, Key
from wirebayes.inference.laplace_fit import LaplaceFit
from wirebayes.json_files.discovery import Disagreement
from wirebayes.numeric.typing import Array
from wirebayes.processes.workers import ParallelMap


@dataclass(frozen=True)
class Retest:
    """The global test once more, with effects inside.

    Attributes
    ----------
    p : float or None
        None where nothing could be added any more.
    where : list of list of dict
        Residual patterns beside the effects, a list a block (`wirebayes.discovery.residual_patterns.findings`).
    """

    p: float | None
    where: list[list[Disagreement]]


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
    sets, gains = list(explored.sets), dict[Key, float]()
    count, blocks = len(settings.kinds), len(plain)
    fits = Fits(plain, explored, settings, rng)

    def predicts(candidate: FittedSet, found: ModelPosterior) -> bool:
        """Whether the last family of a set, if it is not the only one, predicts holds that are left out."""
        names = candidate.effects.names
        if len(names) > 1 and candidate.effects.key not in gains:
            gains[candidate.effects.key] = _last_gain(candidate, found, fits, left_out)
        return len(names) == 1 or gains[candidate.effects.key] > KEEP_ELPD

    def weighed() -> tuple[Array, Array]:
        return model_space.log_weights(sets, count, families, explored.left_over)

    while True:
        found = model_space.posterior(sets, *weighed(), blocks, families)
        best = _best_fitted(found, explored)
        if best is None:
            return Decision(found, None, None)
        if predicts(best, found):
            break
        sets = [s for s in sets if not _kinds(best.effects, found) <= _kinds(s, found)]
    retest = _retested(best, rng, parallel_map)
    if _fails(retest):
        passing = _complete(found, explored, best, lambda candidate: predicts(candidate, found), rng, parallel_map)
        if passing is not None:
            sets = [s for s in sets if s.key != best.effects.key and s.key not in passing.failed]
            best, retest = passing.best, passing.retest
    without, beside = weighed()
    if retest.p is not None:
        alike = [k for k, s in enumerate(sets) if _kinds(s, found) == _kinds(best.effects, found)]
        beside = _more_beside(sets, without, beside, alike, float(-P_SLOPE * np.log(retest.p / ALPHA_AFTER)))
    found = model_space.posterior(sets, without, beside, blocks, families)
    if not found.best.names:
        return Decision(found, None, retest)
    if any(len(e.recorded_holds) < LEAST_HOLDS for block in plain for e in block.experiments):
        return Decision(found, best, retest)
    own = dict.fromkeys(found.family(name) for name in best.effects.names)
    by_family = {family: _family_gain(best, family, found, fits, left_out) for family in own}
    return Decision(found, best, retest, by_family, _name_gain(best, best.effects.names[0], fits, left_out))


def _kinds(s: EffectSet, found: ModelPosterior) -> frozenset[tuple[Family, int]]:
    """The families of a set's names, each numbered within its family: two names of one family are more than one."""
    families = [found.family(name) for name in s.names]
    return frozenset((family, families[:k].count(family)) for k, family in enumerate(families))


def _last_gain(candidate: FittedSet, found: ModelPosterior, fits: Fits, left_out: LeftOut) -> float:
    """What the last effect of a set gains: its family, or the effect alone where the family has another in the set."""
    *earlier, last = candidate.effects.names
    family = found.family(last)
    if any(name in family for name in earlier):
        return _name_gain(candidate, last, fits, left_out)
    return _family_gain(candidate, family, found, fits, left_out)


def _name_gain(candidate: FittedSet, name: str, fits: Fits, left_out: LeftOut) -> float:
    """What an effect of a set gains against the set without it."""
    on = _acting(candidate, (name,))
    without = fits.of(candidate.effects.key - {name})
    elpd = left_out.of([version[b] for version in (candidate.blocks, without) for b in on])
    return float(np.sum([v.sum() for v in elpd[: len(on)]]) - np.sum([v.sum() for v in elpd[len(on) :]]))


def _family_gain(candidate: FittedSet, family: Family, found: ModelPosterior, fits: Fits, left_out: LeftOut) -> float:
    """What the mixture over a family's members gains beside the other effects of a set, against these alone."""
    rest = frozenset(name for name in candidate.effects.names if name not in family)
    on = _acting(candidate, family)
    weights = {s.key: w for s, w in zip(found.sets, (found.without + found.beside).tolist(), strict=True)}
    members = {k: w for k, w in weights.items() if k > rest and all(name in family for name in k - rest)}
    least = LEAST_ALTERNATIVE * sum(members.values())
    kept = [k for k, w in members.items() if k == candidate.effects.key or (w >= least and fits.knows(k))]
    versions = [candidate.blocks if k == candidate.effects.key else fits.of(k) for k in kept]
    elpd = left_out.of([version[b] for version in (*versions, fits.of(rest)) for b in on])
    each = np.array([np.concatenate(elpd[i * len(on) : (i + 1) * len(on)]) for i in range(len(versions) + 1)])
    log_weight = np.log(np.maximum([members[k] for k in kept], 1e-300))
    return float((mixed(log_weight, each[:-1]) - each[-1]).sum())


def mixed(log_weight: Array, elpd: Array) -> Array:
    """(H,) log density of left-out holds by a mixture of models, whose weights forget each hold in turn.

    Of models with weight w_m given all holds, those given all but one are proportional to w_m / p_m, so that the
    mixture predicts Σ w_m / Σ (w_m / p_m).

    Parameters
    ----------
    log_weight : (m,) array
        Of each model, given all holds.
    elpd : (m, H) array
        Log density of each left-out hold by each model.
    """
    return np.asarray(logsumexp(log_weight) - logsumexp(log_weight[:, None] - elpd, axis=0))


def _acting(candidate: FittedSet, names: Sequence[str]) -> list[int]:
    """Blocks on which any of some effects of a set acts."""
    return sorted({b for a in candidate.accepted if a.name in names for b in a.blocks})


def _best_fitted(found: ModelPosterior, explored: Explored) -> FittedSet | None:
    """The most probable set, if effects are in it; where a chain of refits is all that is known of it, the next one."""
    if not found.best.names or found.best.key in explored.fitted:
        return explored.fitted.get(found.best.key)
    weights = zip(found.without + found.beside, (explored.fitted.get(s.key) for s in found.sets), strict=True)
    known = [(weight, s) for weight, s in weights if s is not None]
    return max(known, key=lambda item: item[0])[1] if known else None


def _fails(retest: Retest) -> bool:
    return retest.p is not None and retest.p <= ALPHA_AFTER


@dataclass(frozen=True)
class _Passing:
    """A set that leaves nothing over, its test, and the sets that were tried before it."""

    best: FittedSet
    retest: Retest
    failed: set[Key]


def _complete(
    found: ModelPosterior,
    explored: Explored,
    best: FittedSet,
    predicts: Callable[[FittedSet], bool],
    rng: np.random.Generator,
    parallel_map: ParallelMap,
) -> _Passing | None:
    """A set nearly as probable as the best one that leaves nothing over where that does; None where there is none.

    It must predict as the best one had to; one that does not has failed without a test.
    """
    weights = {s.key: float(w) for s, w in zip(found.sets, found.without + found.beside, strict=True)}
    least = weights[best.effects.key] * np.exp(-GIVE_WAY)
    near = [k for k, w in sorted(weights.items(), key=lambda item: -item[1]) if k in explored.fitted and w > least]
    failed: set[Key] = set()
    for key in near[:MOST_RETESTS]:
        candidate = explored.fitted[key]
        if candidate is best:
            continue
        if predicts(candidate):
            retest = _retested(candidate, rng, parallel_map)
            if not _fails(retest):
                return _Passing(candidate, retest, failed)
        failed.add(key)
    return None


def _retested(best: FittedSet, rng: np.random.Generator, parallel_map: ParallelMap) -> Retest:
    """The global test with the set inside, and where its residuals still depend on something.

    Half of the simulations decide where p is clearly above the level; below it, the odds depend on how small p is.
    """
    trials, candidates = best.probed
    if not candidates:
        return Retest(None, [[] for _ in best.blocks])
    patterns = [residual_patterns.patterns(block.target.problem) for block in best.blocks]
    data = [
        scan(expand(block.target, block.modes.z[:1], trials, columns=columns))
        for block, (_, columns) in zip(best.blocks, patterns, strict=True)
    ]
    simulated: list[Replicates] = []
    for n in ((RETESTS + 1) // 2, RETESTS // 2):
        simulated = with_more(simulated, best.blocks, trials, n, rng, parallel_map)
        test = screening.global_test(candidates, data, [s.scan for s in simulated])
        if test.p > ALPHA_AFTER and not is_close(test.p, ALPHA_AFTER, len(test.null)):
            break
    where = [
        residual_patterns.findings(listed, len(trials), here, s.scan, ", ".join(block.names))
        for block, (listed, _), here, s in zip(best.blocks, patterns, data, simulated, strict=True)
    ]
    return Retest(test.p, where)


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
    whole = float(logsumexp(without[alike]))
    share = 1.0 / (1.0 + np.exp(np.clip(beside[alone] - logsumexp(beside[alike]), -50.0, 50.0)))
    out = beside.copy()
    out[alike] = np.logaddexp(out[alike], without[alike] + odds + np.log(share))
    out[alone] = np.logaddexp(out[alone], whole + odds + np.log1p(-share) if share < 1.0 else -np.inf)
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
    accepted = decision.gains if decision.best is None else [found.family(n) for n in decision.best.effects.names]
    together = dict(zip(found.families, found.together, strict=True))
    ranked = sorted(found.families, key=lambda family: -together[family][block])
    families = []
    for family in dict.fromkeys([*accepted, *ranked]):
        each = {name: float(found.inclusion[name][block]) for name in family if name in found.inclusion}
        members = dict(sorted(each.items(), key=lambda item: -item[1]))
        families.append(FamilyEvidence(members, float(together[family][block]), decision.gains.get(family)))
    return Evidence(
        p=p,
        nothing=float(found.nothing[block]) if found.shares[block] else 1.0,
        families=tuple(families),
        shares=found.shares[block],
        best_gain=decision.best_gain,
        remainder=float(found.remainder[block]),
        remainder_gain=remainder_gain,
    )


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


@dataclass(frozen=True)
class Alternative:
    """One of several models between which the readings do not decide.

    Attributes
    ----------
    block : LaplaceFit
    remains : bool
        Whether something unknown remains beside its effects.
    probability : float
    """

    block: LaplaceFit
    remains: bool
    probability: float


def alternatives(
    decision: Decision, fits: Fits, i: int, final: LaplaceFit, undecided: Sequence[str], remains: bool
) -> list[Alternative]:
    """The final model of block `i` and the others that share the probability with it, at most `MOST_ALTERNATIVES`.

    Parameters
    ----------
    decision : Decision
    fits : Fits
    i : int
        Number of the block among the materials.
    final : LaplaceFit
        The block's final model.
    undecided : sequence of str
        Names between which the verdict is undecided: the others differ from the final model in these alone.
    remains : bool
        Whether a discrepancy stands beside the effects.

    Returns
    -------
    list of Alternative
        The final model first, probabilities summing to one; empty where it stands alone.
    """
    found = decision.posterior
    names = frozenset(effect.name for effect in final.effects)
    weights: dict[Key, float] = {}
    for s, weight in zip(found.sets, (found.without + found.beside).tolist(), strict=True):
        acting = frozenset(name for name in s.names if s.presence[name][i] > 0.5)
        swaps = acting - names <= set(undecided) and names - acting <= set(undecided)
        if acting and acting != names and swaps and s.key == acting and fits.knows(s.key):
            weights[s.key] = weights.get(s.key, 0.0) + weight
        elif acting == names:
            weights[names] = weights.get(names, 0.0) + weight
    total = sum(weights.values())
    others = sorted(
        (k for k, w in weights.items() if k != names and w >= LEAST_ALTERNATIVE * total), key=lambda k: -weights[k]
    )
    kept = [names, *others[:MOST_ALTERNATIVES]]
    weights.setdefault(names, 0.0)
    total = sum(weights[k] for k in kept)
    if total <= 0.0 or len(kept) == 1:
        return []
    blocks = [final, *(fits.of(k)[i] for k in kept[1:])]
    return [Alternative(block, remains, weights[k] / total) for block, k in zip(blocks, kept, strict=True)]

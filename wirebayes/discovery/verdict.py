"""From the probabilities of models to a verdict for each material, in the order in which the thresholds apply."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from wirebayes.discovery import model_space, residual_patterns, screening
from wirebayes.discovery.global_test import is_close, with_more
from wirebayes.discovery.held_out import LeftOut
from wirebayes.discovery.linear_scan import expand, scan
from wirebayes.discovery.model_space import EffectSet, ModelPosterior, smallest_set
from wirebayes.discovery.screening import Replicates
from wirebayes.discovery.settings import (
    ALPHA_AFTER,
    GIVE_WAY,
    INCLUSION,
    KEEP_ELPD,
    LEAST_ALTERNATIVE,
    MOST_ALTERNATIVES,
    MOST_RETESTS,
    P_SLOPE,
    REMAINS,
    RETESTS,
    Settings,
)
from wirebayes.discovery.stepwise import Accepted, Explored, FittedSet, Key
from wirebayes.discovery.subsets import over_subsets
from wirebayes.inference.laplace_fit import LaplaceFit
from wirebayes.json_files.discovery import Disagreement, Verdict
from wirebayes.typing import Array
from wirebayes.workers import ParallelMap


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
    gains : dict of name to (b,) array
        Gain of leaving out one hold at a time that each effect of the best set brought when it was added.
    """

    posterior: ModelPosterior
    best: FittedSet | None
    retest: Retest | None
    gains: dict[str, Array]


def decide(
    plain: list[LaplaceFit],
    explored: Explored,
    copies: Mapping[str, Collection[str]],
    settings: Settings,
    left_out: LeftOut,
    rng: np.random.Generator,
    parallel_map: ParallelMap,
) -> Decision:
    """Weigh the sets, leave out those whose last effect does not predict, and test the best one once more.

    Parameters
    ----------
    plain : list of LaplaceFit
        One a material.
    explored : Explored
        Sets of effects that the search visited, with their evidence and fits.
    copies : mapping of name to set of names
        Those that share one signature in these tests (`power.copies`).
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
    sets, gains = list(explored.sets), dict[Key, Array]()
    count, blocks = len(settings.kinds), len(plain)

    def predicts(candidate: FittedSet) -> bool:
        """Whether the last effect of a set, if it is not the only one, predicts holds that are left out."""
        key = candidate.effects.key
        if key not in gains:
            gains[key] = _gain(plain, candidate, explored, left_out)
        return len(key) == 1 or float(gains[key].sum()) > KEEP_ELPD

    while True:
        without, beside = model_space.log_weights(sets, count, copies, explored.left_over)
        found = model_space.posterior(sets, without, beside, blocks, copies)
        best = _best_fitted(found, explored)
        if best is None:
            return Decision(found, None, None, {})
        if predicts(best):
            break
        sets = [s for s in sets if not best.effects.key <= s.key]
    retest = _retested(best, rng, parallel_map)
    if _fails(retest):
        passing = _complete(found, explored, best, predicts, rng, parallel_map)
        if passing is not None:
            sets = [s for s in sets if s.key != best.effects.key and s.key not in passing.failed]
            best, retest = passing.best, passing.retest
    without, beside = model_space.log_weights(sets, count, copies, explored.left_over)
    if retest.p is not None:
        i = next(k for k, s in enumerate(sets) if s.key == best.effects.key)
        beside = _more_beside(sets, beside, i, float(without[i] - P_SLOPE * np.log(retest.p / ALPHA_AFTER)))
    found = model_space.posterior(sets, without, beside, blocks, copies)
    if not found.best.names:
        return Decision(found, None, retest, {})
    path = [explored.fitted.get(frozenset(best.effects.names[: n + 1])) for n in range(len(best.effects.names))]
    steps = [step for step in path if step is not None]
    for step in steps:
        predicts(step)
    return Decision(found, best, retest, {s.accepted[-1].name: gains[s.effects.key] for s in steps})


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


def _gain(plain: list[LaplaceFit], best: FittedSet, explored: Explored, left_out: LeftOut) -> Array:
    """(b,) gain in leave-one-hold-out elpd that the last effect of a set brings in each block it acts on."""
    earlier = explored.fitted.get(frozenset(best.effects.names[:-1]))
    before = plain if earlier is None else earlier.blocks
    on = list(best.accepted[-1].blocks)
    fits = [version[b] for version in (best.blocks, before) for b in on]
    elpd = [float(v.sum()) for v in left_out.of(fits)]
    out = np.zeros(len(plain))
    out[on] = np.subtract(elpd[: len(on)], elpd[len(on) :])
    return out


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


def _more_beside(sets: Sequence[EffectSet], beside: Array, i: int, extra: float) -> Array:
    """Log weights with more for a remainder beside set `i`, or for a remainder alone.

    What is left beside a name may mean that it is the wrong name: the smooth remainder shows whether the name is needed
    where one is in the model anyway, so the two share in proportion to their weights there.
    """
    alone = next(k for k, s in enumerate(sets) if not s.names)
    share = 1.0 / (1.0 + np.exp(np.clip(beside[alone] - beside[i], -50.0, 50.0)))
    out = beside.copy()
    out[i] = np.logaddexp(out[i], extra + np.log(share))
    out[alone] = np.logaddexp(out[alone], extra + np.log1p(-share) if share < 1.0 else -np.inf)
    return out


def established(decision: Decision, block: int) -> list[Accepted]:
    """Effects of the best set that are there beyond doubt in a material, in the order in which they were added."""
    if decision.best is None:
        return []
    return [
        a for a in decision.best.accepted
        if block in a.blocks
        and decision.posterior.inclusion[a.name][block] >= INCLUSION
        and decision.gains[a.name].sum() > KEEP_ELPD
    ]  # fmt: skip


def verdict_of(decision: Decision, block: int) -> tuple[Verdict, list[Accepted]]:
    """The verdict on a material that the global test has not cleared, and the effects accepted there."""
    found = decision.posterior
    shares = found.shares[block]
    if found.nothing[block] > 0.5 or not shares:
        return "nothing-missing", []
    if found.remainder[block] > REMAINS:
        sure = established(decision, block)
        return ("partial", sure) if sure else ("unknown", [])
    present = [] if decision.best is None else [a for a in decision.best.accepted if block in a.blocks]
    if not present:
        return "unknown", []
    return "named" if len(smallest_set(shares)) == 1 else "ambiguous", present


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
    decision: Decision, explored: Explored, i: int, final: LaplaceFit, verdict: Verdict
) -> list[Alternative]:
    """The final model of block `i` and the others that share the probability with it, at most `MOST_ALTERNATIVES`.

    Parameters
    ----------
    decision : Decision
    explored : Explored
    i : int
        Number of the block among the materials.
    final : LaplaceFit
        The block's final model.
    verdict : str
        Of the block; a partial one has the discrepancy beside its effects.

    Returns
    -------
    list of Alternative
        The final model first, probabilities summing to one; empty where it stands alone.
    """
    found = decision.posterior
    blocks: dict[tuple[str, bool], LaplaceFit] = {}
    weights: dict[tuple[str, bool], float] = {}
    for s, bare, more in zip(found.sets, found.without, found.beside, strict=True):
        fit = explored.fitted.get(s.key)
        if fit is None or not fit.blocks[i].effects:
            continue
        remains = 1.0 if s.remainder is None else over_subsets(s.remainder)[1][i]
        key = "+".join(sorted(e.key for e in fit.blocks[i].effects))
        for rest, weight in ((False, bare + more * (1.0 - remains)), (True, more * remains)):
            blocks.setdefault((key, rest), fit.blocks[i])
            weights[key, rest] = weights.get((key, rest), 0.0) + float(weight)
    own = "+".join(sorted(e.key for e in final.effects)), verdict == "partial"
    blocks[own] = final
    weights.setdefault(own, 0.0)
    others = sorted((k for k in weights if k != own and weights[k] >= LEAST_ALTERNATIVE), key=lambda k: -weights[k])
    kept = [own, *others[:MOST_ALTERNATIVES]]
    total = sum(weights[k] for k in kept)
    if total <= 0.0 or len(kept) == 1:
        return []
    return [Alternative(blocks[k], k[1], weights[k] / total) for k in kept]

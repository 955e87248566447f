"""The global test once more, with effects inside: whether they leave something over, and a set that does not."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from wirebayes.discovery import residual_patterns, screening
from wirebayes.discovery.fitted_sets import Explored, FittedSet, Key
from wirebayes.discovery.global_test import is_close, with_more
from wirebayes.discovery.linear_scan import expand, scan
from wirebayes.discovery.model_space import ModelPosterior, largest_first
from wirebayes.discovery.scans import Scan
from wirebayes.discovery.screening import GlobalTest, Replicates
from wirebayes.discovery.settings import ALPHA_AFTER, GIVE_WAY, MOST_RETESTS, RETESTS
from wirebayes.json_files.discovery import Disagreement
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


def fails(retest: Retest) -> bool:
    """Whether something is left over."""
    return retest.p is not None and retest.p <= ALPHA_AFTER


@dataclass(frozen=True)
class _Passing:
    """A set that leaves nothing over, its test, and the sets that were tried before it."""

    best: FittedSet
    retest: Retest
    failed: set[Key]


def complete(
    found: ModelPosterior,
    explored: Explored,
    best: FittedSet,
    predicts: Callable[[FittedSet], bool],
    rng: Generator,
    parallel_map: ParallelMap,
) -> _Passing | None:
    """A set nearly as probable as the best one that leaves nothing over where that does; None where there is none.

    It must predict as the best one had to; one that does not has failed without a test.

    Parameters
    ----------
    found : ModelPosterior
        Weights of the sets.
    explored : Explored
        Those that were fitted.
    best : FittedSet
        The best one, which leaves something over.
    predicts : function of a FittedSet
        Whether its last family predicts holds that are left out.
    rng : numpy.random.Generator
    parallel_map : function
        The built-in `map`, or one over processes.
    """
    weights = found.weights
    least = weights[best.effects.key] * np.exp(-GIVE_WAY)
    fitted = explored.fitted
    near = [k for k, w in largest_first(weights).items() if k in fitted and w > least]
    failed: set[Key] = set()
    for key in near[:MOST_RETESTS]:
        candidate = fitted[key]
        if candidate is best:
            continue
        if predicts(candidate):
            retest = retested(candidate, rng, parallel_map, _is_decided)
            if not fails(retest):
                return _Passing(candidate, retest, failed)
        failed.add(key)
    return None


def _is_passed(test: GlobalTest) -> bool:
    """Whether p is clearly above the level: below it, the odds of a remainder depend on how small p is."""
    return test.p > ALPHA_AFTER and not is_close(test.p, ALPHA_AFTER, len(test.null))


def _is_decided(test: GlobalTest) -> bool:
    """Whether p is clearly on one side of the level, where nothing depends on how small it is.

    Below it is where not one of half of the simulations is as surprising. Whatever the true p, these then disagree with
    all of them in four files of a thousand at most: none of 100, and six of 100 more.
    """
    return _is_passed(test) or test.p <= 1.0 / (1 + len(test.null))


def retested(
    best: FittedSet,
    rng: Generator,
    parallel_map: ParallelMap,
    enough: Callable[[GlobalTest], bool] = _is_passed,
) -> Retest:
    """The global test with the set inside, and where its residuals still depend on something.

    Parameters
    ----------
    best : FittedSet
    rng : numpy.random.Generator
    parallel_map : function
        The built-in `map`, or one over processes.
    enough : function of a GlobalTest
        Whether half of the simulations are enough.
    """
    trials, candidates = best.probed
    if not candidates:
        return Retest(None, [[] for _ in best.blocks])
    listed = []
    data = []
    for block in best.blocks:
        target = block.target
        own_patterns, columns = residual_patterns.patterns(target.problem)
        x = expand(target, block.z, trials, columns=columns)
        listed.append(own_patterns)
        data.append(scan(x))
    p, nulls = _tested(best, data, rng, parallel_map, enough)
    where = []
    for block, own_patterns, here, null in zip(best.blocks, listed, data, nulls, strict=True):
        names = ", ".join(block.names)
        where.append(residual_patterns.findings(own_patterns, len(trials), here, null, names))
    return Retest(p, where)


def _tested(
    best: FittedSet,
    data: Sequence[Scan],
    rng: Generator,
    parallel_map: ParallelMap,
    enough: Callable[[GlobalTest], bool],
) -> tuple[float, list[Scan]]:
    """The p of the global test beside a set, and the scans of simulations, of which half may be enough."""
    trials, candidates = best.probed
    simulated: list[Replicates] = []
    half = RETESTS // 2
    for n in (RETESTS - half, half):
        simulated = with_more(simulated, best.blocks, trials, n, rng, parallel_map)
        nulls = [s.scan for s in simulated]
        test = screening.global_test(candidates, data, nulls)
        if enough(test):
            break
    return test.p, nulls

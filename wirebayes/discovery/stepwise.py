"""The search through sets of effects: forward from each set close enough to the best, and back, every set kept.

A step back asks whether an early effect is still needed beside those that came after it: the set without it may be
better, and was never reached because the names in it explain little one by one.

The evidence of a set comes from a chain of refits, each effect refitted beside those before it. The prior of an
amplitude is the same in every set, so the order of the chain does not matter.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain

import numpy as np
from numpy.random import Generator

from wirebayes.discovery import screening
from wirebayes.discovery.families import Family
from wirebayes.discovery.fitted_sets import Accepted, Explored, FittedSet, Key, added
from wirebayes.discovery.frontier import Frontier
from wirebayes.discovery.linear_scan import expand, scan
from wirebayes.discovery.model_space import EffectSet, family_of, log_prior
from wirebayes.discovery.name_evidence import NameEvidence, weigh_names
from wirebayes.discovery.noise_integral import Expansion
from wirebayes.discovery.probes import Probe
from wirebayes.discovery.refit import occam
from wirebayes.discovery.remainder_evidence import Reference, reference_of, remainder_evidence
from wirebayes.discovery.scans import Scan
from wirebayes.discovery.settings import (
    FIRST_LOOK,
    LEFT_OVER,
    LEFT_OVER_WEIGHT,
    MORE,
    MOST_BESIDE,
    MOST_EFFECTS,
    MOST_LOOKS,
    WORTH_A_REFIT,
    WORTH_ADDING,
    Settings,
)
from wirebayes.discovery.smooth_credit import beside_smooth
from wirebayes.discovery.two_effects import log_bayes_of_each_pair
from wirebayes.inference.laplace_fit import LaplaceFit
from wirebayes.numeric.typing import Array
from wirebayes.processes.workers import ParallelMap


def explore(
    plain: list[LaplaceFit],
    found: NameEvidence,
    expansions: Sequence[Expansion],
    trials: Sequence[Probe],
    families: Sequence[Family],
    settings: Settings,
    rng: Generator,
    parallel_map: ParallelMap,
) -> Explored:
    """Fit the sets of effects that may hold a good share of the probability.

    Parameters
    ----------
    plain : list of LaplaceFit
    found : NameEvidence
        Of single effects.
    expansions, trials
        Of the plain blocks, as the global test has them.
    families : sequence of tuple of str
        Names that look alike, by their refits as single effects.
    settings : Settings
    rng : numpy Generator
    parallel_map : function
        The built-in `map`, or one over processes; the sets are the same.
    """
    references = [reference_of(block) for block in plain]
    root = EffectSet((), 0.0, {}, _remainders(plain, references))
    start = FittedSet(root, plain, (), found, ([], []))
    frontier = Frontier(len(settings.kinds), families)
    _add_singles(frontier, root, found, _credits(expansions, trials))
    frontier.lead_to(_leading_pair(expansions, trials))
    fit = partial(_fit, families=families, references=references, settings=settings)
    without = _log_evidence(plain)
    while wave := frontier.next_looks(_looks(len(frontier.fitted))):
        parents, names = frontier.origins(wave, start)
        fitted_sets = parallel_map(fit, parents, names, rng.spawn(len(wave)))
        for key, new in zip(wave, fitted_sets, strict=True):
            own_fit = _log_evidence(new.blocks) - without
            _keep(frontier, key, new, own_fit)
    sets = root, *frontier.known.values()
    return Explored(sets, frontier.fitted, _left_over(frontier), frontier.parents, start)


def _remainders(blocks: Sequence[LaplaceFit], references: Sequence[Reference]) -> Array:
    """(b,) log Bayes factor of a smooth remainder in each block."""
    return np.array([remainder_evidence(b, r) for b, r in zip(blocks, references, strict=True)])


def _add_singles(frontier: Frontier, root: EffectSet, found: NameEvidence, credits: Mapping[str, Array]) -> None:
    """Add the sets of one effect, each with what it may come to beside a remainder."""
    assert root.remainder is not None
    for name in found.winners:
        credit = -np.inf
        if name in credits:
            beside = np.maximum(root.remainder + credits[name], 0.0)
            credit = float(beside.sum())
        frontier.add(root, name, found, credit)


def _looks(done: int) -> int:
    """How many sets are fitted next, after so many."""
    wave = 2 if done else FIRST_LOOK
    return max(min(wave, MOST_LOOKS - done), 0)


def _log_evidence(blocks: Sequence[LaplaceFit]) -> float:
    """The log evidence of fits to all blocks."""
    return sum(block.log_evidence for block in blocks)


def _keep(frontier: Frontier, key: Key, new: FittedSet, own_fit: float) -> None:
    """Note a fitted set, and go on from it: to what it lacks, to what may stand in its place, and forward.

    `own_fit` is its log Bayes factor by its own fit.
    """
    known = frontier.known[key]
    remainder = new.effects.remainder
    assert remainder is not None
    fitted_set = replace(new, effects=replace(known, remainder=remainder))
    frontier.fitted[key] = fitted_set
    frontier.known[key] = fitted_set.effects
    explained = float(np.maximum(remainder, 0.0).sum())
    frontier.credit[key] = known.log_bayes + explained
    frontier.step_back(key)
    frontier.step_aside(key)
    further = new.further
    if further is None or len(key) >= MOST_EFFECTS:
        return
    for name in further.winners:
        if further.log_bayes[name] > 0.0:
            frontier.add(fitted_set.effects, name, further, own_fit=own_fit)


def _left_over(frontier: Frontier) -> dict[Key, float]:
    """Log Bayes factor of a remainder that is not smooth beside each set that leaves something to further effects."""
    out = {}
    log_weight = float(np.log(LEFT_OVER_WEIGHT / MORE))
    for key, fitted_set in frontier.fitted.items():
        further = fitted_set.further
        if further is None or not further.winners:
            continue
        one_more = log_prior(len(key) + 1, frontier.names) - log_prior(len(key), frontier.names)
        out[key] = log_weight + one_more + min(further.largest, LEFT_OVER)
    return out


def _credits(expansions: Sequence[Expansion], trials: Sequence[Probe]) -> dict[str, Array]:
    """(b,) log Bayes factor of each name beside a smooth remainder, linearly, the better of its forms."""
    out: dict[str, Array] = {}
    values = np.array([beside_smooth(x)[: len(trials)] for x in expansions])
    for k, probe in enumerate(trials):
        name = probe.effect.name
        before = out.get(name, -np.inf)
        out[name] = np.maximum(before, values[:, k] + occam(probe.one_sided))
    return out


def _leading_pair(expansions: Sequence[Expansion], trials: Sequence[Probe]) -> Key:
    """The two effects that explain most together, linearly, where it is more than one explains; else none.

    Two that only show together are not met one at a time: beside the plain model neither explains anything.
    """
    names = list(dict.fromkeys(trial.effect.name for trial in trials))
    in_each_block = [np.maximum(log_bayes_of_each_pair(x), 0.0) for x in expansions]
    explained = np.sum(in_each_block, axis=0)
    alone = np.diag(explained).max(initial=0.0)
    np.fill_diagonal(explained, 0.0)
    one, other = np.unravel_index(np.argmax(explained), explained.shape)
    gain = explained[one, other] - alone + occam(one_sided=False)
    if gain > WORTH_A_REFIT:
        return frozenset({names[one], names[other]})
    return frozenset()


def _fit(
    parent: FittedSet,
    name: str,
    rng: Generator,
    *,
    families: Sequence[Family],
    references: Sequence[Reference],
    settings: Settings,
) -> FittedSet:
    """The parent's blocks refitted with one more effect in its best form, and what could be added then."""
    blocks, effects = added(parent, name, settings, rng)
    names = (*parent.effects.names, name)
    probed = screening.candidate_probes(blocks, settings.kinds)
    further = _further(parent, names, blocks, probed, families)
    accepted = (*parent.accepted, Accepted(name, tuple(effects), effects))
    fitted_set = EffectSet(names, 0.0, {}, _remainders(blocks, references))
    return FittedSet(fitted_set, blocks, accepted, further, probed)


def _further(
    parent: FittedSet,
    names: Sequence[str],
    blocks: list[LaplaceFit],
    probed: tuple[list[Probe], list[screening.Candidate]],
    families: Sequence[Family],
) -> NameEvidence | None:
    """Evidence of one more effect beside some names; None where none has a chance."""
    assert parent.further is not None
    trials, candidates = probed
    scans = [scan(expand(block.target, block.z, trials)) for block in blocks]
    explained = {other for own in names for other in family_of(own, families)}  # what they were, they are no more
    before = {n: -np.inf if n in explained else value for n, value in parent.further.tried.items()}
    if not _may_show(candidates, scans, before):
        return None
    further = weigh_names(
        blocks,
        trials,
        candidates,
        scans,
        reach=parent.further.reach,
        before=before,
        most=MOST_BESIDE,
        forms_a_name=1,
    )
    return further if further.largest >= WORTH_ADDING else None


def _may_show(candidates: Sequence[screening.Candidate], scans: Sequence[Scan], before: Mapping[str, float]) -> bool:
    """Whether any candidate is worth a refit, by what its name was beside fewer effects, or by the scan."""
    by_scan = (float(screening.scanned(c, scans).log_bayes[0]) for c in candidates)
    hopeless = all(value < WORTH_A_REFIT for value in chain(before.values(), by_scan))
    return bool(candidates) and not hopeless

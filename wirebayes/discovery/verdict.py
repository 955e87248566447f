"""From the evidence of names to a verdict: company, second effects by leave-one-hold-out, and the test once more."""

from dataclasses import dataclass, replace
from itertools import repeat

import numpy as np

from wirebayes.discovery import gap, name_evidence, screening
from wirebayes.discovery.linear_scan import Probe, Scan, expand, scan
from wirebayes.discovery.name_evidence import UNKNOWN_WEIGHT, NameEvidence
from wirebayes.discovery.refit import probabilities
from wirebayes.discovery.screening import Candidate
from wirebayes.discovery.settings import Settings
from wirebayes.inference.laplace_fit import LaplaceFit, fitted
from wirebayes.wire.effect import Effect
from wirebayes.workers import Each

KEEP_ELPD = 4.0
_ALPHA_AFTER = 0.03
_WORTH_A_REFIT, _WORTH_ADDING = 1.3, 2.0  # log Bayes factors of a second effect: by scan, and refitted
_MOST_EFFECTS = 2
_NEAR, _MOST_COMPANY = 4.0, 2  # names this close to the best one are looked at again, so many
_LEFT_OVER = 8.0  # the most that a second effect may explain of what one unknown form leaves over beside a name
_RETESTS = 299


@dataclass(frozen=True)
class Accepted:
    """An effect taken into the model.

    Attributes
    ----------
    name : str
    blocks : tuple of int
    effects : dict of int to Effect
        Its form in each block.
    """

    name: str
    blocks: tuple[int, ...]
    effects: dict[int, Effect]


def decide(
    plain: list[LaplaceFit], choice: NameEvidence, settings: Settings, rng: np.random.Generator, each: Each
) -> tuple[str, list[Accepted], list[LaplaceFit], NameEvidence]:
    """Verdict, accepted effects in order, final blocks, and the choice as revised by pairs of effects."""
    choice, added = _with_company(plain, choice, settings, rng, each)
    if choice.best == "unknown":
        return "unknown", [], plain, choice
    blocks, done, further = added[choice.best].blocks, [added[choice.best].accepted], added[choice.best].further
    while further is not None and len(done) < _MOST_EFFECTS:
        name = max(further.winners, key=further.log_bayes.__getitem__)
        if further.log_bayes[name] < _WORTH_ADDING:
            break
        more, extra = _add(blocks, further, name, settings, rng)
        after, before = ([version[b] for b in extra.blocks] for version in (more, blocks))
        elpd = [v.sum() for v in each(gap.leave_one_hold_out, after + before, rng.spawn(2 * len(after)))]
        if sum(elpd[: len(after)]) - sum(elpd[len(after) :]) <= KEEP_ELPD:
            break
        blocks, done = more, [*done, extra]
        further = _beside(blocks, settings, each)[0] if len(done) < _MOST_EFFECTS else None
    choice = _retested(blocks, choice, settings, rng, each)
    if choice.best == "unknown":
        return "unknown", [], plain, choice
    return "named" if choice.set == [choice.best] else "ambiguous", done, blocks, choice


@dataclass(frozen=True)
class _Added:
    """The blocks with a name in them, and what would come next: None where nothing has a chance."""

    blocks: list[LaplaceFit]
    accepted: Accepted
    further: NameEvidence | None


def _beside(blocks: list[LaplaceFit], settings: Settings, each: Each) -> tuple[NameEvidence | None, float]:
    """What could be added to fitted blocks, if anything has a chance, and the flexible reference's evidence."""
    trials, candidates, scans = _scanned(blocks, settings)
    loose = name_evidence.flexible_evidence(scans)
    if max((float(screening.log_bayes(c, scans)[0][0]) for c in candidates), default=-np.inf) < _WORTH_A_REFIT:
        return None, loose
    return name_evidence.choose(blocks, trials, candidates, scans, each=each), loose


def _with_company(
    plain: list[LaplaceFit], choice: NameEvidence, settings: Settings, rng: np.random.Generator, each: Each
) -> tuple[NameEvidence, dict[str, _Added]]:
    """The likeliest names once more, each together with a second effect, and together with the flexible reference.

    The best of the new choice, unless it is *unknown*, is among those added.

    A pair has prior odds of a tenth to one effect, shared by all second effects, and counts for the name. A name that
    needs the flexible reference beside it is only like what is missing: that counts for *unknown*. So does a small
    second effect, twice as much as for a pair: what a name leaves over of a form like it is small, a second effect of
    its own need not be.
    """
    names = sorted(choice.winners, key=lambda n: -choice.log_bayes[n])
    names = [n for n in names if choice.log_bayes[n] > choice.log_bayes[names[0]] - _NEAR][:_MOST_COMPANY]
    odds = np.log(0.1) - np.log(len(settings.kinds))
    evidence, unknown = dict(choice.log_bayes), choice.unknown
    known: dict[str, _Added] = {}
    with_one = each(_add, repeat(plain), repeat(choice), names, repeat(settings), rng.spawn(len(names)))
    for name, (blocks, accepted) in zip(names, with_one, strict=True):
        further, loose = _beside(blocks, settings, each)
        known[name] = _Added(blocks, accepted, further)
        beside = loose + np.log(0.5 / len(names))
        unknown = float(np.logaddexp(unknown, choice.log_bayes[name] + beside))
        if further is None:
            continue
        pair = max((further.log_bayes[n] for n in further.winners), default=-np.inf)
        evidence[name] = float(np.logaddexp(evidence[name], choice.log_bayes[name] + odds + pair))
        alike = choice.log_bayes[name] + odds + np.log(2.0) + min(pair, _LEFT_OVER)
        unknown = float(np.logaddexp(unknown, alike))
    return _weighed(replace(choice, log_bayes=evidence, unknown=unknown)), known


def _retested(
    blocks: list[LaplaceFit], choice: NameEvidence, settings: Settings, rng: np.random.Generator, each: Each
) -> NameEvidence:
    """The global test again, with what was accepted inside: a name that leaves too much over gives way to *unknown*.

    At `_ALPHA_AFTER` both are as likely; below it the odds grow as p to the power -0.8, the density that p has where
    more is missing than was added.
    """
    trials, candidates, scans = _scanned(blocks, settings)
    if not candidates:
        return choice
    simulated = each(screening.replicated, blocks, repeat(trials), repeat(_RETESTS), rng.spawn(len(blocks)))
    nulls = [s.scan for s in simulated]
    p = screening.global_test(candidates, scans, nulls).p
    if p > _ALPHA_AFTER:
        return choice
    against = choice.log_bayes[choice.best] - 0.8 * np.log(p / _ALPHA_AFTER)
    return _weighed(replace(choice, unknown=float(np.logaddexp(choice.unknown, against))))


def _scanned(blocks: list[LaplaceFit], settings: Settings) -> tuple[list[Probe], list[Candidate], list[Scan]]:
    """What could be added to fitted blocks, and its linear scan on each."""
    trials, candidates = screening.candidate_probes(blocks, settings.kinds)
    return trials, candidates, [scan(expand(b.target, b.modes.z[:1], trials)) for b in blocks]


def _weighed(choice: NameEvidence) -> NameEvidence:
    """The probabilities of a choice whose evidence has changed."""
    shares = probabilities({n: choice.log_bayes[n] for n in choice.winners}, choice.unknown, UNKNOWN_WEIGHT)
    return replace(choice, shares=shares)


def _add(
    blocks: list[LaplaceFit], choice: NameEvidence, name: str, settings: Settings, rng: np.random.Generator
) -> tuple[list[LaplaceFit], Accepted]:
    """The blocks refitted with a name's best form."""
    out, effects = list(blocks), {}
    for b, r in choice.amplitudes(name).items():
        effects[b] = r.effect
        near = r.theta[r.blocks.index(b)]
        every = (*blocks[b].effects, r.effect)
        out[b] = fitted(blocks[b].experiments, every, settings.law, settings.history, rng, near)
    return out, Accepted(name, tuple(effects), effects)

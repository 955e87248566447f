"""The search through sets of effects: forward from each set close enough to the best, and back, every set kept.

A step back asks whether an early effect is still needed beside those that came after it: the set without it may be
better, and was never reached because the names in it explain little one by one.

The evidence of a set comes from a chain of refits, each effect refitted beside those before it. The prior of an
amplitude is the same in every set, so the order of the chain does not matter.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import repeat

import numpy as np

from wirebayes.discovery import screening
from wirebayes.discovery.families import Family
from wirebayes.discovery.linear_scan import Expansion, Probe, expand, scan
from wirebayes.discovery.model_space import EffectSet, family_of, log_prior
from wirebayes.discovery.name_evidence import NameEvidence, weigh_names
from wirebayes.discovery.refit import Refit, occam
from wirebayes.discovery.remainder_evidence import Reference, reference_of, remainder_evidence
from wirebayes.discovery.screening import Candidate
from wirebayes.discovery.settings import (
    FIRST_LOOK,
    LEFT_OVER,
    LEFT_OVER_WEIGHT,
    MORE,
    MOST_BESIDE,
    MOST_EFFECTS,
    MOST_LOOKS,
    REACH,
    SAME_EVIDENCE,
    WORTH_A_REFIT,
    WORTH_ADDING,
    Settings,
)
from wirebayes.discovery.sharing import informed
from wirebayes.discovery.smooth_credit import beside_smooth
from wirebayes.inference.laplace_fit import LaplaceFit, fitted
from wirebayes.numeric.typing import Array
from wirebayes.processes.workers import ParallelMap
from wirebayes.wire.effect import Effect

Key = frozenset[str]


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


@dataclass(frozen=True)
class FittedSet:
    """A set of effects, fitted, with what could be added to it.

    Attributes
    ----------
    effects : EffectSet
    blocks : list of LaplaceFit
    accepted : tuple of Accepted
        In the order in which they were added.
    further : NameEvidence or None
        Of one more effect; None where none has a chance.
    probed : tuple
        Probes, and candidates for one more effect.
    """

    effects: EffectSet
    blocks: list[LaplaceFit]
    accepted: tuple[Accepted, ...]
    further: NameEvidence | None
    probed: tuple[list[Probe], list[Candidate]]

    def weighing(self, log_bayes: float) -> "FittedSet":
        """The same with another log Bayes factor."""
        return replace(self, effects=replace(self.effects, log_bayes=log_bayes))


@dataclass(frozen=True)
class Explored:
    """The sets that were looked at.

    Attributes
    ----------
    sets : tuple of EffectSet
        The plain model with its remainder first.
    fitted : dict of set to FittedSet
        Those that were fitted in full.
    left_over : dict of set to float
        Log Bayes factor of a remainder that is not smooth beside a set, from what a further effect would explain.
    parents : dict of set to (set, name)
        The fitted set, the plain one included, beside which one more effect was refitted, and that effect.
    root : FittedSet
        The plain one.
    """

    sets: tuple[EffectSet, ...]
    fitted: dict[Key, FittedSet]
    left_over: dict[Key, float]
    parents: dict[Key, tuple[Key, str]]
    root: FittedSet

    def refits(self) -> dict[str, tuple[FittedSet, dict[int, Refit]]]:
        """Each name where it was refitted with the most evidence: beside which set, and how; the best name first."""
        best: dict[str, tuple[float, float, FittedSet, dict[int, Refit]]] = {}
        for parent in (self.root, *self.fitted.values()):
            further = parent.further
            for name in further.winners if further is not None else ():
                assert further is not None
                own = further.log_bayes[name]
                value = parent.effects.log_bayes + own
                if name not in best or value > best[name][0]:
                    best[name] = value, own, parent, further.amplitudes(name)
        # of names that are best together the one that explains most is better
        order = sorted(best, key=lambda name: (-best[name][0], -best[name][1]))
        return {name: best[name][2:] for name in order}


class Fits:
    """Blocks with sets of effects, those that the search did not fit in full fitted when they are asked for.

    Parameters
    ----------
    plain : list of LaplaceFit
    explored : Explored
    settings : Settings
    rng : numpy.random.Generator
    """

    def __init__(
        self, plain: list[LaplaceFit], explored: Explored, settings: Settings, rng: np.random.Generator
    ) -> None:
        self._explored, self._settings, self._rng = explored, settings, rng
        self._known: dict[Key, list[LaplaceFit]] = {frozenset(): plain}
        self._known |= {key: s.blocks for key, s in explored.fitted.items()}

    def knows(self, key: Key) -> bool:
        """Whether the set was fitted, or refitted beside one that was."""
        return key in self._known or key in self._explored.parents

    def of(self, key: Key) -> list[LaplaceFit]:
        """The blocks with the effects of a set; its forms are those of the refit, or of a set that has them."""
        if key not in self._known:
            self._known[key] = self._from_parent(key) if key in self._explored.parents else self._from_larger(key)
        return self._known[key]

    def _from_parent(self, key: Key) -> list[LaplaceFit]:
        before, name = self._explored.parents[key]
        parent = self._explored.fitted.get(before, self._explored.root)
        return added(parent, name, self._settings, self._rng)[0]

    def _from_larger(self, key: Key) -> list[LaplaceFit]:
        larger = min((s for k, s in self._explored.fitted.items() if k > key), key=lambda s: len(s.effects.names))
        out = []
        for plain, block in zip(self._known[frozenset()], larger.blocks, strict=True):
            effects = [effect for effect in block.effects if effect.name in key]
            base = block if effects else plain
            if effects:
                out.append(fitted(base.experiments, effects, plain.law, plain.history, self._rng, scales=plain.scales))
            else:
                out.append(plain)
        return out


@dataclass
class _Frontier:
    """Sets known by evidence alone, and which of them have been fitted."""

    names: int
    families: Sequence[Family] = ()
    known: dict[Key, EffectSet] = field(default_factory=dict)
    fitted: dict[Key, FittedSet] = field(default_factory=dict)
    parents: dict[Key, tuple[Key, str]] = field(default_factory=dict)
    credit: dict[Key, float] = field(default_factory=dict)
    towards: list[Key] = field(default_factory=list)

    def add(self, parent: EffectSet, name: str, found: NameEvidence, credit: float = -np.inf) -> None:
        """A set that a refit found, unless another order of the same names is better.

        Of orders that found the same, the one with the strongest parent stays: the weakest effect has to prove itself.

        Parameters
        ----------
        parent : EffectSet
            The set that was refitted with one more effect.
        name : str
            Of that effect.
        found : NameEvidence
            What the refit says of it beside the parent.
        credit : float
            Log Bayes factor that the set may come to with a remainder beside it, as far as is known.
        """
        key = parent.key | {name}
        value = parent.log_bayes + found.log_bayes[name]
        known = self.known.get(key)
        if key in self.fitted:  # its fit searched from many starts; of what its refits found, the better counts
            assert known is not None
            if value > known.log_bayes + SAME_EVIDENCE:
                self.fitted[key] = self.fitted[key].weighing(value)
                self.known[key] = self.fitted[key].effects
        else:
            ahead = np.inf if known is None else value - known.log_bayes
            if abs(ahead) < SAME_EVIDENCE:
                ahead = parent.log_bayes - self.known[self.parents[key][0]].log_bayes
            if ahead > 0.0:
                presence = {**parent.presence, name: found.presence[name]}
                self.known[key] = EffectSet((*parent.names, name), value, presence, None)
                self.parents[key] = parent.key, name
        self.credit[key] = max(self.credit.get(key, -np.inf), credit)

    def promise(self, key: Key) -> float:
        """The largest log weight that a set may come to, by what is known so far."""
        with_remainder = self.credit[key] + np.log(MORE)
        return log_prior(len(key), self.names) + float(np.logaddexp(self.known[key].log_bayes, with_remainder))

    def kinds(self, key: Key) -> tuple[Family, ...]:
        """The families of a set's names."""
        return tuple(sorted(family_of(name, self.families) for name in key))

    def next_looks(self, most: int) -> list[Key]:
        """Sets to be fitted next: of those close enough to the best one each combination of families first.

        Look-alikes would use up all looks, and what only shows beside one of them would never be met.

        Parameters
        ----------
        most : int
            How many at most.
        """
        promises = {key: self.promise(key) for key in self.known}
        best = max(promises.values(), default=-np.inf)
        near = [k for k, promise in promises.items() if k not in self.fitted and promise > best - REACH]
        near.sort(key=lambda k: (-promises[k], sorted(k)))
        looked = [self.kinds(key) for key in self.fitted]
        rank = {}
        for key in near:
            rank[key] = looked.count(self.kinds(key))
            looked.append(self.kinds(key))
        near.sort(key=lambda k: rank[k])  # the order within a rank stays
        waiting = [k for k in self.towards if k not in self.fitted]
        # as many at once whatever the number of cores, so that the sets are the same
        wave = list(dict.fromkeys([*waiting, *near]))[:most]
        return wave or [k for k in near if promises[k] == best][:1]  # the best set is always fitted

    def step_aside(self, key: Key) -> None:
        """From a set close to the best, go towards one where a name of it may give way to another of its family.

        A look-alike that explains little by itself is not met beside the others of the set.
        """
        if self.promise(key) < max(map(self.promise, self.known)) - REACH:
            return
        for name in sorted(key):
            rest = key - {name}
            others = [rest | {other} for other in family_of(name, self.families) if other not in key]
            if rest in self.known and rest not in self.fitted and not all(k in self.known for k in others):
                self.towards.append(rest)

    def step_back(self, key: Key) -> None:
        """Go towards the sets that lack one effect of a fitted set and that no step forward has met."""
        for name in sorted(key):
            fewer = key - {name}
            before = [fewer - {other} for other in sorted(fewer)]  # from these the smaller set is one step forward
            if fewer not in self.known and not any(k in self.fitted for k in before):
                self.towards += sorted((k for k in before if k in self.known), key=self.promise)[-1:]


def explore(
    plain: list[LaplaceFit],
    found: NameEvidence,
    expansions: Sequence[Expansion],
    trials: Sequence[Probe],
    families: Sequence[Family],
    settings: Settings,
    rng: np.random.Generator,
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
    smooth = np.array([remainder_evidence(b, r) for b, r in zip(plain, references, strict=True)])
    root = EffectSet((), 0.0, {}, smooth)
    frontier = _Frontier(len(settings.kinds), families)
    credits = _credits(expansions, trials)
    for name in found.winners:
        credit = float(np.maximum(smooth + credits.get(name, -np.inf), 0.0).sum()) if name in credits else -np.inf
        frontier.add(root, name, found, credit)
    done = frontier.fitted
    start = FittedSet(root, plain, (), found, ([], []))
    while True:
        wave = frontier.next_looks(max(min(FIRST_LOOK if not done else 2, MOST_LOOKS - len(done)), 0))
        if not wave:
            break
        parents = [done.get(frontier.parents[k][0], start) for k in wave]
        names = [frontier.parents[k][1] for k in wave]
        common = repeat(families), repeat(references), repeat(settings)
        fitted_sets = parallel_map(_fit, parents, names, *common, rng.spawn(len(wave)))
        for key, new in zip(wave, fitted_sets, strict=True):
            known = frontier.known[key]
            beside = float(np.maximum(new.effects.remainder, 0.0).sum())
            done[key] = FittedSet(
                EffectSet(known.names, known.log_bayes, known.presence, new.effects.remainder),
                new.blocks, new.accepted, new.further, new.probed,
            )  # fmt: skip
            frontier.known[key] = done[key].effects
            frontier.credit[key] = known.log_bayes + beside
            frontier.step_back(key)
            frontier.step_aside(key)
            if new.further is None or len(key) >= MOST_EFFECTS:
                continue
            for further in new.further.winners:
                if new.further.log_bayes[further] > 0.0:
                    frontier.add(done[key].effects, further, new.further)
    one_more = np.log(LEFT_OVER_WEIGHT / MORE)
    left_over = {
        key: one_more + log_prior(len(key) + 1, frontier.names) - log_prior(len(key), frontier.names)
        + min(max(s.further.log_bayes[n] for n in s.further.winners), LEFT_OVER)
        for key, s in done.items() if s.further is not None and s.further.winners
    }  # fmt: skip
    return Explored((root, *frontier.known.values()), done, left_over, frontier.parents, start)


def _credits(expansions: Sequence[Expansion], trials: Sequence[Probe]) -> dict[str, Array]:
    """(b,) log Bayes factor of each name beside a smooth remainder, linearly, the better of its forms."""
    out: dict[str, Array] = {}
    values = np.array([beside_smooth(x)[: len(trials)] for x in expansions])
    for k, probe in enumerate(trials):
        here = values[:, k] + occam(probe.one_sided)
        out[probe.effect.name] = np.maximum(out.get(probe.effect.name, -np.inf), here)
    return out


def added(
    parent: FittedSet, name: str, settings: Settings, rng: np.random.Generator
) -> tuple[list[LaplaceFit], dict[int, Effect]]:
    """The parent's blocks refitted with one more effect in its best form, and that form by block.

    Parameters
    ----------
    parent : FittedSet
    name : str
        Of an effect that was refitted beside it.
    settings : Settings
    rng : numpy.random.Generator
    """
    assert parent.further is not None
    blocks, effects = list(parent.blocks), {}
    refits = parent.further.amplitudes(name)
    for b, r in refits.items():
        effects[b] = r.effect
        near = r.theta[r.blocks.index(b)]
        every = (*blocks[b].effects, r.effect)
        scales = blocks[b].scales
        blocks[b] = fitted(blocks[b].experiments, every, settings.law, settings.history, rng, near, scales=scales)
    if any(len(r.blocks) > 1 for r in refits.values()):
        blocks = informed(blocks, effects, rng)
    return blocks, effects


def _fit(
    parent: FittedSet,
    name: str,
    families: Sequence[Family],
    references: Sequence[Reference],
    settings: Settings,
    rng: np.random.Generator,
) -> FittedSet:
    """The parent's blocks refitted with one more effect in its best form, and what could be added then."""
    assert parent.further is not None
    blocks, effects = added(parent, name, settings, rng)
    trials, candidates = screening.candidate_probes(blocks, settings.kinds)
    scans = [scan(expand(block.target, block.modes.z[:1], trials)) for block in blocks]
    further = None
    names = (*parent.effects.names, name)
    explained = {other for own in names for other in family_of(own, families)}  # what they were, they are no more
    before = {n: -np.inf if n in explained else value for n, value in parent.further.tried.items()}
    by_scan = [float(screening.log_bayes(c, scans)[0][0]) for c in candidates]
    if candidates and max([*by_scan, *before.values()]) >= WORTH_A_REFIT:
        further = weigh_names(
            blocks, trials, candidates, scans, reach=parent.further.reach, before=before,
            most=MOST_BESIDE, forms_a_name=1,
        )  # fmt: skip
        if max((further.log_bayes[n] for n in further.winners), default=-np.inf) < WORTH_ADDING:
            further = None
    remainder = np.array([remainder_evidence(b, r) for b, r in zip(blocks, references, strict=True)])
    accepted = (*parent.accepted, Accepted(name, tuple(effects), effects))
    return FittedSet(
        EffectSet(names, 0.0, {}, remainder), blocks, accepted, further,
        (trials, candidates),
    )  # fmt: skip

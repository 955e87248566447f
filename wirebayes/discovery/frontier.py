"""Which sets of effects to fit next: those that may come close to the best, and the way to those not met yet."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from wirebayes.discovery.families import Family
from wirebayes.discovery.fitted_sets import FittedSet, Key
from wirebayes.discovery.model_space import EffectSet, family_of, log_prior
from wirebayes.discovery.name_evidence import NameEvidence
from wirebayes.discovery.settings import FALLS_SHORT, MORE, REACH, SAME_EVIDENCE


@dataclass
class Frontier:
    """Sets known by evidence alone, and which of them have been fitted.

    Attributes
    ----------
    names : int
        Names in the catalogue.
    families : sequence of tuple of str
        Names that look alike.
    known : dict of set to EffectSet
        With the evidence of the best order of its names.
    fitted : dict of set to FittedSet
    parents : dict of set to (set, name)
        Beside which set it was refitted, and the name that was added.
    credit : dict of set to float
        Log Bayes factor that it may come to with a remainder beside it.
    towards : list of set
        Sets to be fitted because they lead to others.
    pair : set of str
        Two effects that may only show together; none where there are no such.
    """

    names: int
    families: Sequence[Family] = ()
    known: dict[Key, EffectSet] = field(default_factory=dict)
    fitted: dict[Key, FittedSet] = field(default_factory=dict)
    parents: dict[Key, tuple[Key, str]] = field(default_factory=dict)
    credit: dict[Key, float] = field(default_factory=dict)
    towards: list[Key] = field(default_factory=list)
    pair: Key = frozenset()

    def add(
        self, parent: EffectSet, name: str, found: NameEvidence, credit: float = -np.inf, own_fit: float = np.inf
    ) -> None:
        """A set that a refit found, unless another order of the same names is better.

        Of orders that found the same, the one with the strongest parent stays: the weakest effect has to prove itself.
        A refit says what one more effect gains over the parent's own fit. Where that fell short, as at a kink of its
        density, the effect makes up for it, and that is no evidence for the effect.

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
        own_fit : float
            Log Bayes factor of the parent by its own fit.
        """
        key = parent.key | {name}
        falls_short = parent.log_bayes - own_fit > FALLS_SHORT
        before = own_fit if falls_short else parent.log_bayes
        value = before + found.log_bayes[name]
        if key in self.fitted:
            self._weigh_again(key, value)
        elif self._is_better(key, value, parent):
            names = (*parent.names, name)
            presence = {**parent.presence, name: found.presence[name]}
            self.known[key] = EffectSet(names, value, presence, None)
            self.parents[key] = parent.key, name
        known_credit = self.credit.get(key, -np.inf)
        self.credit[key] = max(known_credit, credit)

    def _weigh_again(self, key: Key, value: float) -> None:
        """The fit of a set searched from many starts; of what its refits found, the better counts."""
        if value > self.known[key].log_bayes + SAME_EVIDENCE:
            fitted = self.fitted[key].weighing(value)
            self.fitted[key] = fitted
            self.known[key] = fitted.effects

    def _is_better(self, key: Key, value: float, parent: EffectSet) -> bool:
        """Whether this order of a set's names is better than the one that is known, if any is."""
        if key not in self.known:
            return True
        ahead = value - self.known[key].log_bayes
        if abs(ahead) < SAME_EVIDENCE:
            known_parent, _ = self.parents[key]
            ahead = parent.log_bayes - self.known[known_parent].log_bayes
        return ahead > 0.0

    def promise(self, key: Key) -> float:
        """The largest log weight that a set may come to, by what is known so far."""
        with_remainder = self.credit[key] + np.log(MORE)
        return log_prior(len(key), self.names) + float(np.logaddexp(self.known[key].log_bayes, with_remainder))

    def kinds(self, key: Key) -> tuple[Family, ...]:
        """The families of a set's names."""
        return tuple(sorted(family_of(name, self.families) for name in key))

    def next_looks(self, most: int) -> list[Key]:
        """Sets to be fitted next: of those close enough to the best one each combination of families first.

        Parameters
        ----------
        most : int
            How many at most.
        """
        promises = {key: self.promise(key) for key in self.known}
        best = max(promises.values(), default=-np.inf)
        near = self._in_turn(promises, best - REACH)
        wanted = [*self.towards, self.pair]
        waiting = [key for key in wanted if key in self.known and key not in self.fitted]
        # as many at once whatever the number of cores, so that the sets are the same
        wave = list(dict.fromkeys([*waiting, *near]))[:most]
        if wave:
            return wave
        return [key for key in near if promises[key] == best][:1]  # the best set is always fitted

    def _in_turn(self, promises: Mapping[Key, float], least: float) -> list[Key]:
        """Sets that are not fitted and promise more than the least, each combination of families in turn.

        Look-alikes would use up all looks, and what only shows beside one of them would never be met.
        """
        near = [key for key, promise in promises.items() if key not in self.fitted and promise > least]
        near.sort(key=lambda key: (-promises[key], sorted(key)))
        looked = [self.kinds(key) for key in self.fitted]
        rank = {}
        for key in near:
            kinds = self.kinds(key)
            rank[key] = looked.count(kinds)
            looked.append(kinds)
        return sorted(near, key=lambda key: rank[key])  # the order within a rank stays

    def origins(self, keys: Sequence[Key], root: FittedSet) -> tuple[list[FittedSet], list[str]]:
        """For each set, the fitted set with one effect less (at first the `root`), and the name of that effect."""
        parents = []
        names = []
        for key in keys:
            before, name = self.parents[key]
            parents.append(self.fitted.get(before, root))
            names.append(name)
        return parents, names

    def lead_to(self, pair: Key) -> None:
        """Go towards two effects that only show together: to the better one, and from there to both.

        Parameters
        ----------
        pair : set of str
            Their names, or none.
        """
        self.pair = pair
        singles = [frozenset({name}) for name in sorted(pair) if frozenset({name}) in self.known]
        self.towards += sorted(singles, key=self.promise)[-1:]

    def step_aside(self, key: Key) -> None:
        """Go from a set close to the best towards sets in which one of its names gives way to another of its family.

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

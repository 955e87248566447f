"""Probabilities over models: sets of effects, each with or without a smooth remainder in each material.

A set is evaluated together with the remainder, so an effect is credited for what it explains of the remainder, and the
probability of a remainder is part of the answer.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import gammaln, logsumexp

from wirebayes.discovery.families import Family
from wirebayes.discovery.settings import IN_SET, MORE, UNKNOWN_WEIGHT
from wirebayes.discovery.subsets import over_subsets
from wirebayes.numeric.typing import Array


@dataclass(frozen=True, eq=False)
class EffectSet:
    """A set of effects and its evidence.

    Attributes
    ----------
    names : tuple of str
        Largest share of the disagreement first; empty for the plain model.
    log_bayes : float
        Against the plain model, without remainder.
    presence : dict of name to (b,) array
        Probability that the effect is present in each material, given the set.
    remainder : (b,) array or None
        Log Bayes factor of a remainder in each material, beside the set; None where it was not looked for.
    """

    names: tuple[str, ...]
    log_bayes: float
    presence: Mapping[str, Array]
    remainder: Array | None

    @property
    def key(self) -> frozenset[str]:
        return frozenset(self.names)

    @property
    def first(self) -> str:
        """The name with the largest share, empty where there is none."""
        return self.names[0] if self.names else ""


@dataclass(frozen=True)
class ModelPosterior:
    """What the models say together, none having been excluded by the global test.

    Attributes
    ----------
    sets : tuple of EffectSet
    without, beside : (s,) array
        Probability of each set without a remainder, and with one.
    nothing : (b,) array
        Probability that nothing is missing in a material.
    remainder : (b,) array
        Probability of a remainder in a material.
    inclusion : dict of name to (b,) array
        Probability that an effect acts in a material.
    families : sequence of tuple of str
        Names that these tests cannot tell apart; a name in none of them stands alone.
    together : list of (b,) array
        For each family the probability that any of its members acts in a material.
    shares : list of dict
        For each material, the probability of each name to be the effect with the largest share of the disagreement, and
        of *unknown*, a remainder and no effect; given that something is missing there.
    """

    sets: tuple[EffectSet, ...]
    without: Array
    beside: Array
    nothing: Array
    remainder: Array
    inclusion: dict[str, Array]
    families: tuple[Family, ...]
    together: list[Array]
    shares: list[dict[str, float]]

    def family(self, name: str) -> Family:
        """The family of a name."""
        return family_of(name, self.families)

    @property
    def weights(self) -> dict[frozenset[str], float]:
        """Probability of each set by its names, without a remainder or with one."""
        return {s.key: w for s, w in zip(self.sets, (self.without + self.beside).tolist(), strict=True)}

    @property
    def best(self) -> EffectSet:
        """The most probable set of those that begin with the most probable first family, and in it the first name."""
        weights = (self.without + self.beside).tolist()
        weighted = list(zip(weights, self.sets, strict=True))
        weighted = _most_probable(weighted, lambda s: self.family(s.first))
        weighted = _most_probable(weighted, lambda s: s.first)
        _, best = max(weighted, key=lambda item: item[0])
        return best


def _most_probable(
    weighted: Sequence[tuple[float, EffectSet]], kind: Callable[[EffectSet], Any]
) -> list[tuple[float, EffectSet]]:
    """The sets of the kind that has the most weight, with their weights."""
    weights: dict[Any, float] = {}
    for weight, effects in weighted:
        weights[kind(effects)] = weights.get(kind(effects), 0.0) + weight
    leading = max(weights, key=lambda each: weights[each])
    return [(weight, effects) for weight, effects in weighted if kind(effects) == leading]


def family_of(name: str, families: Sequence[Family]) -> Family:
    """The family that a name belongs to, itself alone where it is in none."""
    return next((f for f in families if name in f), (name,))


def largest_first(shares: Mapping[Any, float]) -> dict[Any, float]:
    """The same by falling share; what is equal stays in its order."""
    return dict(sorted(shares.items(), key=lambda item: -item[1]))


def log_prior(size: int, kinds: int) -> float:
    """Log weight of one set of `size` of so many kinds of effect; that of a single one is zero.

    All sets of one size together have `MORE` times the weight of those that are one smaller.
    """
    if size < 2:
        return 0.0
    kinds = max(kinds, size)
    sets = gammaln(kinds + 1) - gammaln(size + 1) - gammaln(kinds - size + 1)
    return float((size - 1) * np.log(MORE) + np.log(kinds) - sets)


def log_weights(
    sets: Sequence[EffectSet],
    names: int,
    families: Sequence[Family] = (),
    other: Mapping[frozenset[str], float] = {},
) -> tuple[Array, Array]:
    """(s,) unnormalised log probabilities of each set without a remainder and with one.

    Families are alike before the test, and in each of them its members: a family of five is as likely as one of one.

    Parameters
    ----------
    sets : sequence of EffectSet
    names : int
        Names in the catalogue.
    families : sequence of tuple of str
        Names that these tests cannot tell apart.
    other : mapping of set to float
        Log Bayes factor of a remainder that is not smooth, beside a set.
    """
    kinds = names - sum(len(f) - 1 for f in families)
    without = []
    beside = []
    for s in sets:
        smooth = -np.inf
        if s.remainder is not None:
            smooth, _, _ = over_subsets(s.remainder)
        if s.names:
            alone = _log_prior_in_families(s, kinds, families) + s.log_bayes
            remainder = np.logaddexp(smooth, other.get(s.key, -np.inf))
            without.append(alone)
            beside.append(alone + np.log(MORE) + remainder)
        else:
            without.append(-np.inf)  # nothing at all: the global test has excluded it
            beside.append(np.log(UNKNOWN_WEIGHT) + smooth)
    return np.array(without), np.array(beside)


def _log_prior_in_families(effects: EffectSet, kinds: int, families: Sequence[Family]) -> float:
    """Log weight of a set of so many kinds of effect, shared among the members of its families."""
    sizes = [len(family_of(name, families)) for name in effects.names]
    members = sum(np.log(size) for size in sizes)
    return float(log_prior(len(effects.names), kinds) - members)


def posterior(
    sets: Sequence[EffectSet],
    without: Array,
    beside: Array,
    blocks: int,
    families: Sequence[Family] = (),
) -> ModelPosterior:
    """Normalise, and sum over the sets for each material.

    Parameters
    ----------
    sets : sequence of EffectSet
    without, beside : (s,) arrays
        As `log_weights` returns them.
    blocks : int
        Number of materials.
    families : sequence of tuple of str
        As for `log_weights`.
    """
    p_without, p_beside = _normalised(without, beside)
    names = dict.fromkeys(name for s in sets for name in s.names)
    of_names = dict.fromkeys(family_of(name, families) for name in names)
    sums = _Sums.over(names, of_names, blocks)
    for s, bare, more in zip(sets, p_without, p_beside, strict=True):
        sums.add(s, bare, more)
    inclusion = {name: _at_most_one(value) for name, value in sums.inclusion.items()}
    together = [_at_most_one(value) for value in sums.together.values()]
    leading = [_shares(sums.leading(b)) for b in range(blocks)]
    return ModelPosterior(
        tuple(sets),
        p_without,
        p_beside,
        _at_most_one(sums.nothing),
        _at_most_one(sums.remainder),
        inclusion,
        tuple(sums.together),
        together,
        leading,
    )


def _normalised(without: Array, beside: Array) -> tuple[Array, Array]:
    """Probabilities of log weights, which together sum to one."""
    total = logsumexp([*without, *beside])
    p_without = np.exp(without - total)
    p_beside = np.exp(beside - total)
    whole = p_without.sum() + p_beside.sum()  # one but for rounding, which grows with the log weights
    return p_without / whole, p_beside / whole


def _at_most_one(probability: Array) -> Array:
    """Sums of many probabilities that are one but for rounding."""
    return np.minimum(probability, 1.0)


@dataclass(frozen=True)
class _Sums:
    """Probabilities (b,) in each material, added up over sets.

    Attributes
    ----------
    nothing, remainder : that nothing is missing, and that there is a remainder.
    inclusion, together : that a name acts, and that any of a family does.
    first : that a name is the first of those that act, and as *unknown*, that a remainder is there and none acts.
    """

    nothing: Array
    remainder: Array
    inclusion: dict[str, Array]
    together: dict[Family, Array]
    first: dict[str, Array]

    @classmethod
    def over(cls, names: Iterable[str], families: Iterable[Family], blocks: int) -> "_Sums":
        """Sums of nothing yet.

        Parameters
        ----------
        names, families
            In any of the sets.
        blocks : int
            Number of materials.
        """
        inclusion = {name: np.zeros(blocks) for name in names}
        together = {family: np.zeros(blocks) for family in families}
        first = {name: np.zeros(blocks) for name in (*names, "unknown")}
        return cls(np.zeros(blocks), np.zeros(blocks), inclusion, together, first)

    def leading(self, block: int) -> dict[str, float]:
        """In one material, that each name is the first of those that act."""
        return {name: float(value[block]) for name, value in self.first.items()}

    def add(self, effects: EffectSet, without: float, beside: float) -> None:
        """Add a set.

        Parameters
        ----------
        effects : EffectSet
        without, beside : float
            Its probability without a remainder and with one.
        """
        idle = self._add_names(effects, without + beside)
        remains = np.ones(len(self.nothing))
        if effects.remainder is not None:
            remains = over_subsets(effects.remainder)[1]
        with_remainder = beside * remains
        self.remainder[:] += with_remainder
        self.first["unknown"] += with_remainder * idle
        self.nothing[:] += without * idle + beside * (1.0 - remains) * idle

    def _add_names(self, effects: EffectSet, whole: float) -> Array:
        """Add the names of a set and their families; (b,) the probability that none of them acts."""
        idle = np.ones(len(self.nothing))  # no effect before acts here
        for name in effects.names:
            acts = effects.presence[name]
            self.first[name] += whole * idle * acts
            self.inclusion[name] += whole * acts
            idle = idle * (1.0 - acts)
        for family, probability in self.together.items():
            members = [name for name in effects.names if name in family]
            idle_members = [1.0 - effects.presence[name] for name in members]
            absent = np.prod(idle_members, axis=0)
            probability += whole * (1.0 - absent)
        return idle


def _shares(leading: Mapping[str, float]) -> dict[str, float]:
    """Probabilities that sum to one, the largest first; none where nothing is missing for certain."""
    missing = sum(leading.values())
    return {name: value / missing for name, value in largest_first(leading).items()} if missing > 0.0 else {}


def smallest_set(shares: Mapping[str, float], level: float = IN_SET) -> list[str]:
    """The fewest names that together hold `level` of the probability, most probable first."""
    out: list[str] = []
    total = 0.0
    for name, share in largest_first(shares).items():
        out.append(name)
        total += share
        if total >= level:
            break
    return out

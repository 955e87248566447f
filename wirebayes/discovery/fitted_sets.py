"""Sets of effects that were fitted, with what could be added to each."""

from dataclasses import dataclass, replace
from typing import NamedTuple

from numpy.random import Generator

from wirebayes.discovery.model_space import EffectSet
from wirebayes.discovery.name_evidence import NameEvidence
from wirebayes.discovery.probes import Probe
from wirebayes.discovery.refit import Refit
from wirebayes.discovery.screening import Candidate
from wirebayes.discovery.settings import Settings
from wirebayes.discovery.sharing import informed
from wirebayes.inference.laplace_fit import LaplaceFit, fitted
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


class _Refitted(NamedTuple):
    """A name refitted beside a set, by block, with the log Bayes factors of the set with it and of the name itself."""

    of_set: float
    own: float
    parent: FittedSet
    refits: dict[int, Refit]


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
        best: dict[str, _Refitted] = {}
        for parent in (self.root, *self.fitted.values()):
            further = parent.further
            if further is None:
                continue
            for name in further.winners:
                own = further.log_bayes[name]
                of_set = parent.effects.log_bayes + own
                if name not in best or of_set > best[name].of_set:
                    best[name] = _Refitted(of_set, own, parent, further.amplitudes(name))
        # of names that are best together the one that explains most is better
        order = sorted(best, key=lambda name: (best[name].of_set, best[name].own), reverse=True)
        return {name: (best[name].parent, best[name].refits) for name in order}


class Fits:
    """Blocks with sets of effects, those that the search did not fit in full fitted when they are asked for.

    Parameters
    ----------
    plain : list of LaplaceFit
    explored : Explored
    settings : Settings
    rng : numpy.random.Generator
    """

    def __init__(self, plain: list[LaplaceFit], explored: Explored, settings: Settings, rng: Generator) -> None:
        self._explored = explored
        self._settings = settings
        self._rng = rng
        self._known: dict[Key, list[LaplaceFit]] = {frozenset(): plain}
        self._known |= {key: s.blocks for key, s in explored.fitted.items()}

    def knows(self, key: Key) -> bool:
        """Whether the set was fitted, or refitted beside one that was."""
        return key in self._known or key in self._explored.parents

    def of(self, key: Key) -> list[LaplaceFit]:
        """The blocks with the effects of a set; its forms are those of the refit, or of a set that has them."""
        if key not in self._known:
            refitted = key in self._explored.parents
            self._known[key] = self._from_parent(key) if refitted else self._from_larger(key)
        return self._known[key]

    def _from_parent(self, key: Key) -> list[LaplaceFit]:
        before, name = self._explored.parents[key]
        parent = self._explored.fitted.get(before, self._explored.root)
        blocks, _ = added(parent, name, self._settings, self._rng)
        return blocks

    def _from_larger(self, key: Key) -> list[LaplaceFit]:
        """Fits of a set that was not fitted itself, with its effects as the smallest fitted set around it has them."""
        larger = [fitted_set for known, fitted_set in self._explored.fitted.items() if known > key]
        smallest = min(larger, key=lambda fitted_set: len(fitted_set.effects.names))
        out = []
        for plain, block in zip(self._known[frozenset()], smallest.blocks, strict=True):
            own = plain
            effects = [effect for effect in block.effects if effect.name in key]
            if effects:
                own = fitted(block.experiments, effects, plain.spec, self._rng, scales=plain.scales)
            out.append(own)
        return out


def added(
    parent: FittedSet, name: str, settings: Settings, rng: Generator
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
    blocks = list(parent.blocks)
    refits = parent.further.amplitudes(name)
    for b, refit in refits.items():
        block = blocks[b]
        effects = (*block.effects, refit.effect)
        near = refit.theta[refit.blocks.index(b)]
        blocks[b] = fitted(block.experiments, effects, settings.spec, rng, near, scales=block.scales)
    forms = {b: refit.effect for b, refit in refits.items()}
    is_shared = any(len(refit.blocks) > 1 for refit in refits.values())
    if is_shared:
        blocks = informed(blocks, forms, rng)
    return blocks, forms

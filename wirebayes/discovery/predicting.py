"""Which sets, and which remainders beside them, predict holds that are left out.

A remainder and further names are two explanations of what a set leaves over. Evidence takes little from a remainder,
of which only the size is unknown, and much from a name: a share of the prior with all others, and what its amplitude
and shape could have been. Leaving out one hold at a time takes the same from both.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from wirebayes.discovery.fitted_sets import Explored, Fits, FittedSet, Key
from wirebayes.discovery.gains import last_gain
from wirebayes.discovery.held_out import LeftOut
from wirebayes.discovery.model_space import EffectSet, ModelPosterior
from wirebayes.discovery.settings import KEEP_ELPD, LEAST_ALTERNATIVE, REACH
from wirebayes.discovery.shrinking import discrepancy_gain
from wirebayes.processes.workers import ParallelMap


@dataclass(frozen=True)
class Predicting:
    """What sets gain by leaving out one hold at a time, each asked once.

    Attributes
    ----------
    explored : Explored
    fits : Fits
        Blocks with the effects of any set.
    left_out : LeftOut
        Scores them.
    rng : numpy.random.Generator
    parallel_map : function
        The built-in `map`, or one over processes.
    """

    explored: Explored
    fits: Fits
    left_out: LeftOut
    rng: np.random.Generator
    parallel_map: ParallelMap
    _last: dict[Key, float] = field(default_factory=dict)
    _remainder: dict[Key, float | None] = field(default_factory=dict)

    def last_predicts(self, candidate: FittedSet, found: ModelPosterior) -> bool:
        """Whether the last family of a set, if it is not the only one, predicts.

        Parameters
        ----------
        candidate : FittedSet
        found : ModelPosterior
            Weights of the sets, and the families of their names.
        """
        key = candidate.effects.key
        if len(key) == 1:
            return True
        if key not in self._last:
            self._last[key] = last_gain(candidate, found, self.fits, self.left_out)
        return self._last[key] > KEEP_ELPD

    def giving_way(self, found: ModelPosterior) -> set[Key]:
        """Sets beside which a remainder gives way to further names: these predict better, and are nearly as probable.

        Asked of remainders that could keep a name from being established. One name alone and a remainder alone have the
        same prior, and are left to the evidence.

        Parameters
        ----------
        found : ModelPosterior
            Weights of the sets, without a remainder and with one.
        """
        beside = zip(found.sets, found.beside.tolist(), strict=True)
        asked = [(s, weight) for s, weight in beside if weight >= LEAST_ALTERNATIVE and self._is_fitted(s.key)]
        return {s.key for s, weight in asked if self._is_outpredicted(s, weight, found)}

    def _is_fitted(self, key: Key) -> bool:
        return not key or key in self.explored.fitted

    def _is_outpredicted(self, effects: EffectSet, weight: float, found: ModelPosterior) -> bool:
        larger = {}
        for other, own in zip(found.sets, found.without.tolist(), strict=True):
            if other.key > effects.key and len(other.key) > 1:
                larger[other.key] = own
        least = np.exp(-REACH) * weight
        if sum(larger.values()) < least:
            return False
        best = self._best_predicting(larger, found)
        if best is None:
            return False
        by_remainder = self._gain_of_remainder(effects.key)
        if by_remainder is None:
            return False
        by_names = self._elpd(best) - self._elpd(effects.key)
        return by_names > by_remainder + KEEP_ELPD

    def _best_predicting(self, weights: Mapping[Key, float], found: ModelPosterior) -> Key | None:
        """The most probable of some sets that is fitted and whose last family predicts."""
        fitted = self.explored.fitted
        known = weights.keys() & fitted.keys()
        for key in sorted(known, key=lambda key: (-weights[key], sorted(key))):
            if self.last_predicts(fitted[key], found):
                return key
        return None

    def _elpd(self, key: Key) -> float:
        return sum(float(each.sum()) for each in self.left_out.of(self.fits.of(key)))

    def _gain_of_remainder(self, key: Key) -> float | None:
        """What a remainder gains beside a set, in the materials where it gains; None where there are too few holds."""
        if key not in self._remainder:
            blocks = self.fits.of(key)
            gains = [discrepancy_gain(block, self.left_out, self.rng, self.parallel_map) for block in blocks]
            known = [gain for gain in gains if gain is not None]
            self._remainder[key] = sum(max(gain, 0.0) for gain in known) if len(known) == len(gains) else None
        return self._remainder[key]

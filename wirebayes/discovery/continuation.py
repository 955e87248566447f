"""The global test from starting points with larger effects, to which the parameters have already adapted.

The plain fit bends to absorb what is missing, and from where the fit ends a large effect may look like nothing. So the
amplitude of each effect is raised along a path: at every step the parameters follow by Gauss-Newton steps, and the
effect's log Bayes factor is evaluated there, linear over the range of amplitudes that the step stands for. Simulated
data sets follow the same paths, which gives the distribution of the result under chance.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import repeat
from typing import Any

import numpy as np

from wirebayes.discovery.ascent import PathEvidence, Start, lead, start
from wirebayes.discovery.ladders import AmplitudePath, ladders
from wirebayes.discovery.probes import Probe
from wirebayes.discovery.refit import occam
from wirebayes.discovery.scans import Scan
from wirebayes.discovery.screening import (
    Candidate,
    GlobalTest,
    Replicates,
    by_name,
    shared_amplitude,
)
from wirebayes.discovery.settings import BY_LARGER
from wirebayes.discovery.surprise import Scale, empirical_surprise
from wirebayes.inference.laplace_fit import LaplaceFit
from wirebayes.numeric.typing import Array
from wirebayes.processes.workers import ParallelMap

_FIRST_ROWS, _ROWS = 40, 160  # data sets that lead at once, at first and at most
_MOST_ROWS = 320  # in all: a name that decides has two or three as high, and many forms cost a tenth of a second each
_CLEARLY = 3.0  # nats of surprise beyond all simulations, from which a name needs no more of them
_TRIED = 3  # names
_LEVEL = 0.95  # of chance, which a name has to exceed by most to be tried first


def strengths(ways: Sequence[AmplitudePath], climbed: Sequence[Mapping[int, PathEvidence]]) -> dict[Candidate, Array]:
    """(n,) log Bayes factor of each of the ladders' candidates, with the prior of `screening.scanned`."""
    out = {}
    for ladder, each in zip(ways, climbed, strict=True):
        prior = occam(ladder.probes[0].one_sided)
        for candidate in ladder.candidates:
            here = [each[b] for b in candidate.blocks]
            out[candidate] = _strength(here, candidate.shared, prior)
    return out


def _strength(here: Sequence[PathEvidence], shared: bool, prior: float) -> Array:
    """(n,) log Bayes factor of a candidate by its paths on its blocks, with one amplitude for all or one each."""
    if len(here) == 1 or not shared:
        return np.sum([path.log_bayes.max(axis=0) + prior for path in here], axis=0)
    log_bayes = np.array([path.log_bayes for path in here])
    amplitude = np.array([path.amplitude for path in here])
    norm = np.array([path.norm for path in here])
    value, _ = shared_amplitude(log_bayes, amplitude, norm)
    return value.max(axis=0) + prior


class Continuation:
    """The global test with every effect led up its ladder, in the data and in the simulations alike.

    The test may be repeated with more simulations: paths already computed are kept.

    Parameters
    ----------
    blocks, trials, candidates, data
        See `ladders`.
    parallel_map : function, optional
        The built-in `map`, or one over processes.

    Attributes
    ----------
    p : float
        What the paths made of the last test's p, whether it counted or not.
    """

    def __init__(
        self,
        blocks: Sequence[LaplaceFit],
        trials: Sequence[Probe],
        candidates: Sequence[Candidate],
        data: Sequence[Scan],
        parallel_map: ParallelMap = map,
    ) -> None:
        self._blocks = blocks
        self._each = parallel_map
        self._ways = ladders(blocks, trials, candidates, data)
        found = self._strengths(self._ways, [(b.z, None) for b in blocks])
        self.log_bayes = {c: float(v[0]) for c, v in found.items()}  # of every candidate that has a ladder
        linear = by_name(candidates, data)
        self._values = {c.name: float(linear[c.name][0]) for c in found}
        for c, value in self.log_bayes.items():
            self._values[c.name] = max(self._values[c.name], value)
        self.p = 1.0
        self._known: dict[str, Array] = {}  # of each name, in the simulations climbed so far

    def test(self, simulated: Sequence[Replicates], test: GlobalTest) -> GlobalTest:
        """The global test again, with what the ladders add, where that makes the result clear; else as it was.

        Only names that might become that surprising are tried in the simulations: others do not decide. How often the
        most surprising of all names is that surprising is known from the linear scan of the same simulations. This
        holds in the far tail, where one name alone decides. Nearer the middle, ladders of a few names would be compared
        with scans of all names, and p would not be uniform; so ladders count up to p = `BY_LARGER`, or where p is as
        small as it can be. Simulations are those of an earlier call, and more.
        """
        clear = max(BY_LARGER, 1.0 / (1 + len(test.null)))
        needed = float(np.quantile(test.null, 1.0 - clear))  # below it no surprise can make p so small
        largest = float(test.null.max())
        surprises = dict(test.surprises)
        for name in self._worth_trying(test, needed)[:_TRIED]:
            chance = self._chance(name, test.chance[name], simulated, needed, largest)
            surprise = _surprise(self._values[name], chance)
            surprises[name] = max(surprises[name], surprise)
            if surprises[name] > largest:
                break
        larger = replace(test, surprises=surprises)
        self.p = larger.p
        return larger if larger.p <= clear else test

    def _worth_trying(self, test: GlobalTest, needed: float) -> list[str]:
        """Names whose paths may make them as surprising as is needed, those farthest above chance first."""
        lead = {}
        for name, value in self._values.items():
            # Simulations come out no lower along the paths than in the scan, so a value is no more surprising than
            # there.
            most = float(test.scales[name].surprise(value))
            if most >= needed and most > test.surprises[name]:
                lead[name] = value - float(np.quantile(test.chance[name], _LEVEL))
        return sorted(lead, key=lambda name: -lead[name])

    def _chance(
        self, name: str, linear: Array, simulated: Sequence[Replicates], needed: float, largest: float
    ) -> Array:
        """(m,) largest log Bayes factor of a name in the simulations, by scan or ladder; no more than it takes.

        That is until so many are as high as the data that these cannot be as surprising as `needed`, or until these are
        clearly more surprising than all simulations, of which the most surprising one is by `largest`.
        """
        linear = linear[:_MOST_ROWS]
        value = self._values[name]
        known = self._known.get(name, np.empty(0))
        out = np.empty(0)
        while len(out) < len(linear):
            more = int(np.clip(len(out), _FIRST_ROWS, _ROWS))
            last = min(len(out) + more, len(linear))
            if last > len(known):
                rows = slice(len(known), last)
                known = np.append(known, self._climbed(name, simulated, rows))
            out = np.maximum(linear[:last], known[:last])
            as_high = int((out >= value).sum())
            if as_high and np.log1p(len(linear)) - np.log1p(as_high) < needed:
                break  # too common
            if len(out) >= _ROWS and _surprise(value, out) >= largest + _CLEARLY:
                break
        self._known[name] = known
        return out

    def _climbed(self, name: str, simulated: Sequence[Replicates], rows: slice) -> Array:
        """(m,) largest log Bayes factor of a name along its ladders, in some of the simulations."""
        ways = [way for way in self._ways if way.effect.name == name]
        plain = []
        for block in simulated:
            readings = [of_sample[..., rows] for of_sample in block.readings]
            plain.append((block.z[rows], readings))
        climbed = self._strengths(ways, plain)
        return np.max(list(climbed.values()), axis=0)

    def _strengths(self, ways: Sequence[AmplitudePath], plain: Sequence[tuple[Array, Any]]) -> dict[Candidate, Array]:
        z, readings = zip(*plain, strict=True)
        begin = list(self._each(start, self._blocks, z, readings))
        return strengths(ways, list(self._each(_climbs, ways, repeat(self._blocks), repeat(begin))))


def _surprise(value: float, chance: Array) -> float:
    """How surprising a value along a path is, given simulations (n,): by their count or by a line, whichever is less.

    The most surprising of all names, which it is compared with, is read off lines alone, and hardly varies. A count
    varies by a factor of two, and some would by chance come out on the other side.
    """
    return float(min(empirical_surprise(value, chance), Scale.of(chance).surprise(value)))


def _climbs(way: AmplitudePath, blocks: Sequence[LaplaceFit], begin: Sequence[Start]) -> dict[int, PathEvidence]:
    """A ladder climbed on all its blocks."""
    return {b: lead(blocks[b], way, begin[b]) for b in way.blocks}

"""Candidates for the missing effect, judged linearly over all blocks of a file, and the global test on them.

An effect of the material has an amplitude a material, an effect of the instrument or the environment one a file, an
event one at its hold of its experiment: the scope decides which blocks a candidate acts on, and what they share.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wirebayes.bayes.optimum import climb, rowwise
from wirebayes.bayes.replicate import readings as replicate
from wirebayes.discrepancy.block import Block
from wirebayes.discrepancy.expansion import Probe, Scan, expand, forms, joined, probes, scan
from wirebayes.discrepancy.naming import LARGEST
from wirebayes.wire.effect import Effect, EventEffect

Array = NDArray[Any]
_ROWS = 250  # replicates linearised at once


@dataclass(frozen=True)
class Candidate:
    """One probe on the blocks where its scope puts it.

    Attributes
    ----------
    probe : int
        Its number among the probes.
    name : str
    blocks : tuple of int
    shared : bool
        One amplitude for all its blocks, rather than one each.
    """

    probe: int
    name: str
    blocks: tuple[int, ...]
    shared: bool


def candidate_probes(blocks: Sequence[Block], kinds: Mapping[str, type[Effect]]) -> tuple[list[Probe], list[Candidate]]:
    """Every form of every effect that these blocks could show."""
    several = sum(len(b.experiments) for b in blocks) > 1
    trials: list[Probe] = []
    candidates: list[Candidate] = []
    for kind in kinds.values():
        where: dict[str, tuple[Effect, list[int]]] = {}
        for at, block in enumerate(blocks):
            accepted = {e.name for e in block.effects}
            if kind.name in accepted and not issubclass(kind, EventEffect):
                continue
            for effect in _variants(kind, block, several):
                where.setdefault(effect.key, (effect, []))[1].append(at)
        for effect, on in where.values():
            for probe in probes(effect):
                number = len(trials)
                trials.append(probe)
                if effect.scope in ("instrument", "environment") and len(on) > 1:
                    candidates.append(Candidate(number, effect.name, tuple(on), True))
                    continue
                candidates += [Candidate(number, effect.name, (b,), True) for b in on]
                if len(on) > 1:
                    candidates.append(Candidate(number, effect.name, tuple(on), False))
    return trials, candidates


def _variants(kind: type[Effect], block: Block, several: bool) -> list[Effect]:
    if not issubclass(kind, EventEffect):
        return kind.variants([e.protocol() for e in block.experiments])
    taken = {e.key for e in block.effects}
    if kind.name in {e.name for e in block.effects}:
        return []
    found = [(e.name, v) for e in block.experiments for v in kind.variants([e.protocol()])]
    out = [replace(v, test=name) if several else v for name, v in found]  # type: ignore[type-var]
    return [v for v in out if v.key not in taken]


def log_bayes(candidate: Candidate, scans: Sequence[Scan]) -> tuple[Array, Array, Array]:
    """(n,) log Bayes factor with the same prior on every amplitude, best amplitude, and amplitude per δ."""
    i = candidate.probe
    one_sided = scans[candidate.blocks[0]].pieces.one_sided[i]
    occam = 0.5 * np.log(2 * np.pi) - np.log(LARGEST * (1 if one_sided else 2))
    lr = np.array([scans[b].effects[:, i] for b in candidate.blocks])
    a = np.array([scans[b].amplitude[:, i] for b in candidate.blocks])
    norm = np.array([scans[b].norm[:, i] for b in candidate.blocks])
    if one_sided:
        a = np.maximum(a, 0.0)
    if not candidate.shared:
        return lr.sum(axis=0) + occam * len(candidate.blocks), a[0], 1.0 / np.maximum(norm[0], 1e-300)
    # Each block's log Bayes factor as a parabola through zero amplitude and through its own best.
    with np.errstate(divide="ignore", invalid="ignore"):
        weight = np.where(np.abs(a) * norm > 0.5, 2.0 * lr / a**2, norm**2)
    total = np.maximum(weight.sum(axis=0), 1e-300)
    mean = (weight * a).sum(axis=0) / total
    value = (lr - 0.5 * weight * (a - mean) ** 2).sum(axis=0)
    return value + occam, mean, 1.0 / np.sqrt(np.maximum((norm**2).sum(axis=0), 1e-300))


def flexible_log_bayes(scans: Sequence[Scan]) -> Array:
    """(b + 1, n) log Bayes factor of the flexible reference on each block alone, and on all."""
    single = np.array([s.flexible for s in scans])
    return np.vstack([single, single.sum(axis=0)])


def replicated(block: Block, trials: Sequence[Probe], n: int, rng: np.random.Generator, columns: Any = None) -> Scan:
    """Scan `n` data sets simulated at the block's fit, each refitted first."""
    z = np.repeat(block.modes.z[:1], n, axis=0)
    theta = block.target.coordinates.to_natural(z)
    problem = block.target.problem
    y = [replicate(problem, theta, s, rng) for s in problem.samples]
    found = climb(rowwise(block.target, y), z, iterations=25, tolerance=1e-2)
    shapes = forms(block.target, block.modes.z[:1], trials)
    parts = []
    for begin in range(0, n, _ROWS):
        rows = slice(begin, begin + _ROWS)
        parts.append(scan(expand(block.target, found.z[rows], trials, [v[..., rows] for v in y], columns, shapes)))
    return joined(parts)


@dataclass(frozen=True)
class GlobalTest:
    """The largest statistic of all candidates and of the flexible reference.

    Attributes
    ----------
    p : float
        Share of refitted simulations at least as large.
    statistic : float
    null : (n,) array
    offset : float
        Added to the flexible reference's log Bayes factor, so that both sides are equally often the largest by chance.
    """

    p: float
    statistic: float
    null: Array
    offset: float

    def threshold(self, alpha: float) -> float:
        """The statistic that chance exceeds with probability alpha."""
        return float(np.quantile(self.null, 1.0 - alpha))


def global_test(candidates: Sequence[Candidate], data: Sequence[Scan], null: Sequence[Scan]) -> GlobalTest:
    """Compare the data's largest statistic with the simulations'."""
    best_null = np.max([log_bayes(c, null)[0] for c in candidates], axis=0)
    best_data = float(np.max([log_bayes(c, data)[0][0] for c in candidates]))
    loose_null = flexible_log_bayes(null).max(axis=0)
    loose_data = float(flexible_log_bayes(data).max())
    offset = float(np.quantile(best_null, 0.97) - np.quantile(loose_null, 0.97))
    reference = np.maximum(best_null, loose_null + offset)
    statistic = max(best_data, loose_data + offset)
    return GlobalTest(float((1 + (reference >= statistic).sum()) / (1 + len(reference))), statistic, reference, offset)

"""Candidates for the missing effect, evaluated linearly over all blocks of a file, and the global test on them.

An effect of the material has one amplitude per material, an effect of the instrument or the environment one per file,
an event one at its hold of its experiment: the scope decides on which blocks a candidate acts, and what they share.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.special import betaincinv

from wirebayes.discovery.linear_scan import expand, plain_reference, scan
from wirebayes.discovery.probes import Probe, forms, probes
from wirebayes.discovery.refit import occam
from wirebayes.discovery.scans import Scan, joined
from wirebayes.discovery.surprise import AGAINST, Scale
from wirebayes.effects.elastic import LengthDependence
from wirebayes.inference.climb import climb
from wirebayes.inference.laplace_fit import LaplaceFit
from wirebayes.model.replicate import readings as replicate
from wirebayes.model.sample import LENGTH_EXPONENT
from wirebayes.model.scales import scales_of
from wirebayes.numeric.log_sum import or_impossible
from wirebayes.numeric.typing import Array, Ints
from wirebayes.wire.effect import Effect, EventEffect, Kinds
from wirebayes.wire.protocol import Protocol

_ROWS = 100  # replicates linearised at once, at most
_NUMBERS = 4e6  # signatures of these, readings times probes: some copies of them have to fit into memory
_FLEXIBLE = "unknown"
TWO = "two effects together"
FILE_WIDE = ("instrument", "environment")  # scopes of which all blocks share an amplitude
# What a learned exponent of B says already: the two together are one direction, and a climb along it never ends.
_LEARNED_EXPONENT = LengthDependence("B").key


@dataclass(frozen=True)
class Candidate:
    """One probe on the blocks where its scope puts it.

    Attributes
    ----------
    probe : int
        Its number among the probes.
    shared : bool
        One amplitude for all its blocks, rather than one each.
    others : tuple of int
        Probes that differ from it only in what each test has for itself; a block takes the one that explains it best.
    """

    probe: int
    name: str
    blocks: tuple[int, ...]
    shared: bool
    others: tuple[int, ...] = ()


def candidate_probes(blocks: Sequence[LaplaceFit], kinds: Kinds) -> tuple[list[Probe], list[Candidate]]:
    """Every form of every effect that these blocks could show."""
    tests = [e.protocol() for b in blocks for e in b.experiments]
    trials: list[Probe] = []
    candidates: list[Candidate] = []
    for kind in kinds.values():
        where: dict[str, tuple[Effect, list[int]]] = {}
        for at, block in enumerate(blocks):
            accepted = {e.name for e in block.effects}
            if kind.name in accepted and not issubclass(kind, EventEffect):
                continue
            for effect in _variants(kind, block, tests):
                _, on = where.setdefault(effect.key, (effect, []))
                on.append(at)
        for effect, on in where.values():
            first = len(trials)
            own = probes(effect)
            candidates += _candidates_of(effect, dict(enumerate(own, first)), tuple(on))
            trials += own
    return trials, candidates


def _candidates_of(effect: Effect, trials: dict[int, Probe], on: tuple[int, ...]) -> list[Candidate]:
    """The candidates of one effect: each trial in each of its blocks alone, and in all of them together."""
    name = effect.name
    several = len(on) > 1
    if several and effect.scope in FILE_WIDE:
        groups = _but_for_each_test(effect, trials)
        return [Candidate(k, name, on, True, tuple(others)) for k, *others in groups]
    out = []
    for number in trials:
        for block in on:
            out.append(Candidate(number, name, (block,), True))
        if several:
            out.append(Candidate(number, name, on, False))
    return out


def _but_for_each_test(effect: Effect, numbered: Mapping[int, Probe]) -> list[list[int]]:
    """Numbers of probes that differ in nothing but the shape constants that every test has for itself."""
    common = effect.common_shapes()
    groups: dict[tuple[float, ...], list[int]] = {}
    for number, probe in numbered.items():
        groups.setdefault((probe.step, *(probe.own[name] for name in common)), []).append(number)
    return list(groups.values())


def _variants(kind: type[Effect], block: LaplaceFit, tests: Sequence[Protocol]) -> list[Effect]:
    """The forms of an effect that a block could show; what all tests share has the form that it has for all of them."""
    if kind.needs_saturation and block.spec.history == "additive":
        return []
    if kind.scope in FILE_WIDE:
        return _of_the_bench(kind, block, tests)
    if issubclass(kind, EventEffect):
        return _events(kind, block, several_tests=len(tests) > 1)
    own = [e.protocol() for e in block.experiments]
    found = [v.on(own, _range_mm(block)) for v in kind.variants(own)]
    if any(name.startswith(LENGTH_EXPONENT) for name in block.target.problem.names):
        return [v for v in found if v.key != _LEARNED_EXPONENT]
    return found


def _range_mm(block: LaplaceFit) -> float:
    """How far the wires of a block are stretched."""
    scales = block.target.problem.scales or scales_of(block.experiments)
    return scales.range_mm


def _events(kind: type[EventEffect], block: LaplaceFit, several_tests: bool) -> list[Effect]:
    """The forms of an event in each test of a block, none where one of the kind is in the model already."""
    if kind.name in {e.name for e in block.effects}:
        return []
    out: list[Effect] = []
    for e in block.experiments:
        for event in kind.variants([e.protocol()]):
            out.append(replace(event, test=e.name) if several_tests else event)  # type: ignore[type-var]
    return out


def _of_the_bench(kind: type[Effect], block: LaplaceFit, tests: Sequence[Protocol]) -> list[Effect]:
    """The forms of what belongs to a bench; where a file has steps and weights, each kind of test has its own."""
    controls = sorted({p.control for p in tests})
    out: list[Effect] = []
    for control in controls:
        here = [e.protocol() for e in block.experiments if e.control == control]
        alike = [p for p in tests if p.control == control]
        forms_here = kind.variants(here) if here else []
        out += [v.on(alike, _range_mm(block)).under(control if len(controls) > 1 else None) for v in forms_here]
    return out


class Scanned(NamedTuple):
    """A candidate in n data sets, (n,) each: log Bayes factor, best amplitude, and amplitude per δ."""

    log_bayes: Array
    amplitude: Array
    per_delta: Array


def scanned(candidate: Candidate, scans: Sequence[Scan]) -> Scanned:
    """What a scan says of a candidate, with the same prior on every amplitude."""
    blocks = candidate.blocks
    one_sided = bool(scans[blocks[0]].pieces.one_sided[candidate.probe])
    prior = occam(one_sided)
    log_ratio, amplitude, norm = _in_each_block(candidate, scans)
    if one_sided:
        amplitude = np.maximum(amplitude, 0.0)
    if not candidate.shared or len(blocks) == 1:
        value = log_ratio.sum(axis=0) + prior * len(blocks)
        per_delta = 1.0 / np.maximum(norm[0], 1e-300)
        return Scanned(value, amplitude[0], per_delta)
    value, mean = shared_amplitude(log_ratio, amplitude, norm)
    square = (norm**2).sum(axis=0)
    together = np.sqrt(np.maximum(square, 1e-300))
    return Scanned(value + prior, mean, 1.0 / together)


def _in_each_block(candidate: Candidate, scans: Sequence[Scan]) -> tuple[Array, Array, Array]:
    """(b, n) log likelihood ratio, best amplitude, and δ per amplitude."""
    log_ratio, amplitude, norm = [], [], []
    for b, numbers in zip(candidate.blocks, best_probes(candidate, scans), strict=True):
        log_ratio.append(_each(scans[b].effects, numbers))
        amplitude.append(_each(scans[b].amplitude, numbers))
        norm.append(_each(scans[b].norm, numbers))
    return np.array(log_ratio), np.array(amplitude), np.array(norm)


def best_probes(candidate: Candidate, scans: Sequence[Scan]) -> list[Ints]:
    """(n,) numbers of the probes that explain most in each of the candidate's blocks."""
    if not candidate.others:
        return [np.full(len(scans[b].effects), candidate.probe) for b in candidate.blocks]
    numbers = np.array([candidate.probe, *candidate.others])
    return [numbers[np.argmax(scans[b].effects[:, numbers], axis=1)] for b in candidate.blocks]


def _each(values: Array, columns: Ints) -> Array:
    """(n,) of every row the value in its own column."""
    return values[np.arange(len(columns)), columns]


def shared_amplitude(log_ratio: Array, amplitude: Array, norm: Array) -> tuple[Array, Array]:
    """One amplitude for several blocks: its log likelihood ratio, and the amplitude itself.

    Each block's log likelihood ratio is a parabola through zero amplitude and through its own best.

    Parameters
    ----------
    log_ratio : (b, ...) array
        Log likelihood ratio of each block at its own best amplitude.
    amplitude : (b, ...) array
        That amplitude.
    norm : (b, ...) array
        δ per amplitude, the curvature where the best amplitude is too small to say.
    """
    with np.errstate(all="ignore"):
        weight = np.where(np.abs(amplitude) * norm > 0.5, 2.0 * log_ratio / amplitude**2, norm**2)
        total = np.maximum(weight.sum(axis=0), 1e-300)
        mean = (weight * amplitude).sum(axis=0) / total
        lost = 0.5 * weight * (amplitude - mean) ** 2
        value = (log_ratio - lost).sum(axis=0)
    return or_impossible(value), mean


def _alone_and_together(log_bayes: Sequence[Array]) -> Array:
    """(n,) the largest log Bayes factor of what each block has for itself (n,): of a block alone, or of all."""
    each = np.array(log_bayes)
    return np.maximum(each.max(axis=0), each.sum(axis=0))


@dataclass(frozen=True)
class Replicates:
    """Data sets simulated at a block's fit: their scan, plain fits (n, d), and readings, a sample (H, R, n)."""

    scan: Scan
    z: Array
    readings: list[Array]


def replicated(
    block: LaplaceFit, trials: Sequence[Probe], n: int, rng: np.random.Generator, columns: Any = None
) -> Replicates:
    """Scan `n` data sets simulated at the block's fit, each refitted first.

    Parameters
    ----------
    columns : callable, optional
        Further signatures (see `linear_scan.expand`).
    """
    target = block.target
    problem = target.problem
    z = np.repeat(block.z, n, axis=0)
    theta = target.coordinates.to_natural(z)
    y = [replicate(problem, theta, s, rng) for s in problem.samples]
    density, residuals = target.rowwise(y)
    found = climb(density, z, residuals, iterations=25, tolerance=1e-2, curvature_at_end=False)
    of_replicates = _scanned_in_parts(block, trials, found.z, y, columns)
    return Replicates(of_replicates, found.z, y)


def _scanned_in_parts(block: LaplaceFit, trials: Sequence[Probe], z: Array, y: Sequence[Array], columns: Any) -> Scan:
    """Simulated readings scanned so many at once that their signatures do not fill the memory."""
    target = block.target
    shapes = forms(target, block.z, trials)
    smooth = plain_reference(target.problem)
    numbers = sum(shape.size for shape in shapes)
    at_once = int(np.clip(_NUMBERS / max(numbers, 1), 1, _ROWS))
    parts = []
    for begin in range(0, len(z), at_once):
        rows = slice(begin, begin + at_once)
        own = [v[..., rows] for v in y]
        x = expand(target, z[rows], trials, own, columns, shapes, smooth)
        parts.append(scan(x))
    return joined(parts)


def joined_replicates(parts: Sequence[Replicates]) -> Replicates:
    """Several lots of replicates of one block as one."""
    if len(parts) == 1:
        return parts[0]
    scans = joined([p.scan for p in parts])
    z = np.concatenate([p.z for p in parts])
    of_samples = zip(*(p.readings for p in parts), strict=True)
    readings = [np.concatenate(of_sample, axis=-1) for of_sample in of_samples]
    return Replicates(scans, z, readings)


def by_name(candidates: Sequence[Candidate], scans: Sequence[Scan]) -> dict[str, Array]:
    """(n,) the largest log Bayes factor of each name, of two effects together, and of the flexible reference.

    None is below `AGAINST`: clear evidence against a name is no surprise, however rare its size.
    """
    flexible = _alone_and_together([s.flexible for s in scans])
    two = _alone_and_together([s.two for s in scans])
    out = {_FLEXIBLE: np.maximum(flexible, AGAINST), TWO: np.maximum(two, AGAINST)}
    for c in candidates:
        before = out.get(c.name, AGAINST)
        out[c.name] = np.maximum(before, scanned(c, scans).log_bayes)
    return out


@dataclass(frozen=True)
class GlobalTest:
    """The most surprising name, or the flexible reference, beside the most surprising one of each simulation.

    Attributes
    ----------
    chance : dict of name to (n,) array
        Its largest log Bayes factor in the simulations.
    scales : dict of name to Scale
        From the first third of the simulations.
    surprises : dict of name to float
        Of the data.
    null : (m,) array
        Largest surprise of each of the other simulations: given the scales, these are independent of each other.
    """

    chance: dict[str, Array]
    scales: dict[str, Scale]
    surprises: dict[str, float]
    null: Array

    @property
    def _as_surprising(self) -> int:
        """How many simulations are."""
        return int((self.null >= max(self.surprises.values())).sum())

    @property
    def p(self) -> float:
        """Share of refitted simulations at least as surprising, the readings counted with them."""
        return (1 + self._as_surprising) / (1 + len(self.null))

    @property
    def p_interval(self) -> tuple[float, float]:
        """Clopper and Pearson's 95 % interval of the share of simulations at least as surprising."""
        above, all_of_them = self._as_surprising, len(self.null)
        low = betaincinv(above, all_of_them - above + 1, 0.025) if above > 0 else 0.0
        high = betaincinv(above + 1, all_of_them - above, 0.975) if above < all_of_them else 1.0
        return float(low), float(high)

    def threshold(self, name: str, alpha: float) -> float:
        """The log Bayes factor at which a name would be as surprising as chance is with probability alpha."""
        return self.scales[name].value(float(np.quantile(self.null, 1.0 - alpha)))


def chance_level(candidates: Sequence[Candidate], null: Sequence[Scan]) -> GlobalTest:
    """What chance reaches in simulations, with no readings to compare."""
    chance = by_name(candidates, null)
    first = max(len(next(iter(chance.values()))) // 3, 1)
    scales = {name: Scale.of(value[:first]) for name, value in chance.items()}
    surprises = [scales[name].surprise(value[first:]) for name, value in chance.items()]
    return GlobalTest(chance, scales, {}, np.max(surprises, axis=0))


def global_test(candidates: Sequence[Candidate], data: Sequence[Scan], null: Sequence[Scan]) -> GlobalTest:
    """Compare the data's most surprising name with the simulations'.

    Parameters
    ----------
    candidates : sequence of Candidate
    data : sequence of Scan
        Of the measured readings, one a block.
    null : sequence of Scan
        Of data sets simulated at the fits, one a block.

    Returns
    -------
    GlobalTest
    """
    level = chance_level(candidates, null)
    found = {}
    for name, value in by_name(candidates, data).items():
        found[name] = float(level.scales[name].surprise(value[0]))
    return replace(level, surprises=found)

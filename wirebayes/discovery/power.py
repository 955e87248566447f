"""Detectable amplitudes, similar effects, what this protocol cannot show, and what to measure next."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import stats

from wirebayes.discovery.linear_scan import Expansion, Probe, Scan, expand, projected
from wirebayes.discovery.refit import LARGEST, occam
from wirebayes.discovery.screening import Candidate, GlobalTest
from wirebayes.discovery.settings import ALPHA, NEARLY_ONE
from wirebayes.inference.laplace_fit import LaplaceFit
from wirebayes.inference.transform import LogPosterior
from wirebayes.model.problem import LENGTH_EXPONENT, Problem, with_protocols
from wirebayes.typing import Array
from wirebayes.wire.effect import Amplitude, Effect, HoldContext
from wirebayes.wire.protocol import Protocol

ALIKE = 0.95  # |cos| from which names form a group: an effect of δ = 10 then differs from its twin by δ = 3 only
_POWER_ROWS = 300  # simulations behind an 80 % amplitude
_WORTH = 1.1  # times as far apart as now, for a measurement to be proposed
_TRIED = "unloading, longer holds, finer steps, another length"


def amplitude_80(null: Scan, probe: Probe, i: int, threshold: float) -> float | None:
    """Amplitude of a probe that passes the global test in 80 % of simulations.

    Parameters
    ----------
    null : Scan
        Of data sets simulated without any effect.
    probe : Probe
    i : int
        The probe's number in the scan.
    threshold : float
        Log Bayes factor, prior included, that the test needs.

    Returns
    -------
    float or None
        Distance from neutral; None where even δ of `LARGEST` would not pass, or the probe does not show at all.
    """
    norm = float(np.median(null.norm[:, i]))
    if norm <= 0:
        return None
    prior = occam(probe.one_sided)
    low, high = 0.0, LARGEST / norm
    pieces = null.pieces.of(i, _POWER_ROWS)

    def seen(amplitude: float) -> bool:
        return bool(np.mean(pieces.log_bayes(amplitude) + prior > threshold) >= 0.8)

    if not seen(high):
        return None
    for _ in range(12):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if seen(middle) else (middle, high)
    return high


def detectable(
    null: Scan, trials: Sequence[Probe], candidates: Sequence[Candidate], level: GlobalTest, block: int = 0
) -> dict[str, tuple[int, float | None]]:
    """For each effect that a block can show, its best probe and the amplitude that is detected in 80 % of tests.

    Parameters
    ----------
    null : Scan
        Of simulated data sets of the block, refitted.
    trials, candidates
        See `wirebayes.discovery.screening.candidate_probes`.
    level : GlobalTest
        What chance reaches over all blocks.
    block : int
    """
    best: dict[str, int] = {}
    strength = np.median(null.norm, axis=0)
    for c in candidates:
        if block in c.blocks and (c.name not in best or strength[c.probe] > strength[best[c.name]]):
            best[c.name] = c.probe
    return {name: (k, amplitude_80(null, trials[k], k, level.threshold(name, ALPHA))) for name, k in best.items()}


def similarity(
    expansions: Sequence[Expansion], trials: Sequence[Probe], ratios: Sequence[float]
) -> dict[tuple[str, str], float]:
    """Largest |cos| between the projected signatures of any two effects, over their forms, at a noise ratio a block.

    An effect with one amplitude a block may put any size on each, so it is as alike as the best sizes make it.

    Parameters
    ----------
    expansions : sequence of Expansion
        One a block.
    trials : sequence of Probe
    ratios : sequence of float
        Size of the setting errors against the sensor's, ρ, of each block.

    Returns
    -------
    dict of (name, name) to float
        From 0 (orthogonal) to 1 (one signature).
    """
    cosines = _cosines(expansions, trials, ratios)
    names = [t.effect.name for t in trials]
    out: dict[tuple[str, str], float] = {}
    for i, a in enumerate(names):
        for j, b in enumerate(names):
            out[a, b] = max(out.get((a, b), 0.0), float(cosines[i, j]))
    return out


def copies(expansions: Sequence[Expansion], trials: Sequence[Probe], ratios: Sequence[float]) -> dict[str, int]:
    """How many names are one and the same in these tests, itself included, by name.

    Two names are where each form of either has a form of the other with the same signature.

    Parameters
    ----------
    expansions : sequence of Expansion
        One a block.
    trials : sequence of Probe
    ratios : sequence of float
        As in `similarity`.

    Returns
    -------
    dict of name to int
        Only names that show at all.
    """
    same = _cosines(expansions, trials, ratios) > NEARLY_ONE
    forms: dict[str, list[int]] = {}
    for k, trial in enumerate(trials):
        if same[k, k]:  # it shows at all
            forms.setdefault(trial.effect.name, []).append(k)
    both = {
        (a, b): same[np.ix_(i, j)].any(axis=1).all() and same[np.ix_(i, j)].any(axis=0).all()
        for a, i in forms.items()
        for b, j in forms.items()
    }
    return {a: sum(bool(both[a, b]) for b in forms) for a in forms}


def _cosines(expansions: Sequence[Expansion], trials: Sequence[Probe], ratios: Sequence[float]) -> Array:
    """(m, m) |cos| of the projected signatures, zero for one that does not show."""
    parts = [projected(x, r) for x, r in zip(expansions, ratios, strict=True)]
    lengths = np.array([(p**2).sum(axis=0) for p in parts])
    products = np.array([p.T @ p for p in parts])
    material = np.array([t.effect.scope == "material" for t in trials]) & (len(expansions) > 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        together = products.sum(axis=0) ** 2 / (lengths.sum(axis=0)[:, None] * lengths.sum(axis=0)[None])
        loose = (products**2 / lengths[:, None, :]).sum(axis=0) / lengths.sum(axis=0)[:, None]
    square = np.nan_to_num(np.where(material[None, :], loose, together))
    return np.sqrt(np.minimum(np.maximum(square, square.T), 1.0))


def group_of(members: Sequence[str], alike: dict[tuple[str, str], float]) -> list[str]:
    """The members and every effect whose signature is as good as one of theirs."""
    names = dict.fromkeys([*members, *(b for (a, b), cos in alike.items() if a in members and cos > ALIKE)])
    return list(names)


class _SensorGain(Effect):
    name, place, scope = "gain of the force sensor", "reading", "instrument"
    amplitudes = (Amplitude("a", "-", 0.0, stats.norm(0.0, 0.1)),)
    sentence = "The force sensor's gain is off."

    def apply(self, value: Array, own: dict[str, Array], hold: HoldContext) -> Array:
        return value * (1.0 + own["a"])


class _ForceOffset(Effect):
    name, place, scope = "constant force offset", "reading", "instrument"
    amplitudes = (Amplitude("a", "N", 0.0, stats.norm(0.0, 0.1)),)
    sentence = "The force sensor's zero is off."

    def apply(self, value: Array, own: dict[str, Array], hold: HoldContext) -> Array:
        return value + own["a"]


class _DisplacementScale(Effect):
    name, place, scope = "scale of the displacement", "position", "instrument"
    amplitudes = (Amplitude("a", "-", 0.0, stats.norm(0.0, 0.1)),)
    sentence = "The displacement's scale is off."

    def apply(self, value: Array, own: dict[str, Array], hold: HoldContext) -> Array:
        return value + own["a"] * hold.displacement_mm


class _Compliance(Effect):
    name, place, scope = "compliance of the fixture", "strain", "instrument"
    amplitudes = (Amplitude("c", "mm/N", 0.0, stats.norm(0.0, 0.1)),)
    sentence = "The bench gives way."

    def apply(self, value: Array, own: dict[str, Array], hold: HoldContext) -> Array:
        return value / (1.0 + own["c"] * hold.theta["k1"] / hold.length_mm)


_ABSORBABLE: tuple[type[Effect], ...] = (_SensorGain, _ForceOffset, _DisplacementScale, _Compliance)


def not_identifiable(block: LaplaceFit, kinds: Sequence[type[Effect]], possible: Sequence[str]) -> list[str]:
    """Sentences: what the plain model's own parameters take up on this protocol, and what it cannot show.

    Parameters
    ----------
    block : LaplaceFit
    kinds : sequence of effect class
        The catalogue.
    possible : sequence of str
        Names of effects that this protocol can show.

    Returns
    -------
    list of str
    """
    absorbable = [kind for kind in _ABSORBABLE if not (kind is _Compliance and "fixture_compliance" in possible)]
    trials = [Probe(kind(), {kind().columns()[0]: 1e-3}, 1e-3, False) for kind in absorbable]
    x = expand(block.target, block.modes.z[:1], trials)
    wholes = np.sqrt((x.signatures[0] ** 2).sum(axis=0))
    left = np.sqrt((projected(x, 0.0) ** 2).sum(axis=0))
    out = [
        f"{t.effect.name}: {100 * (1 - rest / whole):.1f} % of it is absorbed by the model's own parameters"
        for t, whole, rest in zip(trials, wholes, left, strict=True)
        if rest < 0.1 * whole
    ]
    return out + [
        f"{kind.name}: this protocol cannot show it ({kind.shows})" for kind in kinds if kind.name not in possible
    ]


@dataclass(frozen=True)
class MeasurementPlan:
    """A measurement one could make next: in words, and as holds at displacements, each read at the same times."""

    words: str
    displacement_mm: Array
    times_s: Array
    length_mm: float

    @property
    def protocol(self) -> Protocol:
        """Its holds."""
        return _holds(self.displacement_mm, self.times_s, self.length_mm)


def alternatives(p: Protocol, alone: bool) -> list[MeasurementPlan]:
    """What could be done with a sample instead; `alone` if there is no other, whose displacements would differ."""
    recorded = p.recorded
    x = p.displacement_mm[recorded]
    down = x[-2::-1] if len(x) > 1 else x
    log_times = np.concatenate([[0.0], np.geomspace(2.0, 600.0, 24)])
    times = _longest_series(p)
    span = f"{x.min():g} to {x.max():g} mm" if alone else "each sample's displacements"
    dense = "600 s with 25 readings spaced evenly in the logarithm of time"
    there_and_back = np.concatenate([x, down])
    halved = np.sort(np.concatenate([x, x[:-1] + 0.5 * np.diff(x)]))
    last = f" from {x.max():g} to {x.min():g} mm" if alone else ", of every sample"
    back = f"the same displacements back{last}, each held {times[-1]:g} s"
    return [
        MeasurementPlan(words, displacements, moments, p.length_mm)
        for words, displacements, moments in (
            (f"unload the wire after the last hold: {back}", there_and_back, times),
            (f"hold each of the displacements {span} for {dense}", x, log_times),
            (f"load and unload over {span}, each hold {dense}", there_and_back, log_times),
            (f"take twice as many, half as large steps over {span}", halved, times),
        )
    ]


def _longest_series(p: Protocol) -> Array:
    """Reading times of the hold with most readings."""
    counts = p.mask.sum(axis=1)
    return p.time_s[int(np.argmax(counts))][: int(counts.max())]


def _holds(displacement: Array, times: Array, length_mm: float) -> Protocol:
    """Holds at these displacements, each read at these times."""
    h = len(displacement)
    time, duration = np.tile(times, (h, 1)), np.full(h, times[-1])
    return Protocol(length_mm, displacement, time, np.ones(time.shape, bool), duration, np.arange(1, h + 1))


def _another_length(problem: Problem) -> tuple[str, Problem]:
    """The test repeated, beside what there is, on a sample twice as long as the longest, whose preload it shares."""
    longest = max(problem.samples, key=lambda s: s.protocol.length_mm)
    p, length = longest.protocol, 2.0 * longest.protocol.length_mm
    protocol = _holds(2.0 * p.displacement_mm[p.recorded], _longest_series(p), length)
    model = replace(longest.model, length_ref_mm=longest.model.length_ref_mm or p.length_mm)
    more = replace(longest, protocol=protocol, readings=np.zeros((*protocol.time_s.shape, 1)), model=model)
    exponent = {} if LENGTH_EXPONENT in problem.prior.names else {LENGTH_EXPONENT: 1.0}
    prior = replace(problem.prior, fixed=exponent | problem.prior.fixed)
    which = "a second" if len({s.protocol.length_mm for s in problem.samples}) == 1 else "another"
    words = f"repeat the test at {which} length, {length:g} mm, with steps scaled alike"
    return words, replace(problem, samples=(*problem.samples, more), prior=prior)


def next_measurement(block: LaplaceFit, pair: tuple[Probe, Probe] | None, weakest: Probe | None) -> str:
    """The plan that best distinguishes two candidates, or best shows one effect, by projected signatures.

    Parameters
    ----------
    block : LaplaceFit
        The fit whose test would be followed by another.
    pair : (Probe, Probe) or None
        Candidates to distinguish.
    weakest : Probe or None
        Without a pair: the effect to reveal.

    Returns
    -------
    str
        A sentence, also where no plan helps.
    """
    trials = list(pair) if pair else [weakest] if weakest else []
    if not trials:
        return "No candidate remains; repeating the same holds would narrow the parameters."
    words, ratio = _best_plan(block, lambda target: _separation(target, block, trials))
    names = " from ".join(t.effect.name for t in trials)
    if ratio < _WORTH:
        aim = f"distinguish {names}; measure one of them" if pair else f"reveal a smaller {names}; measure it"
        return f"None of the tests considered ({_TRIED}) would {aim} independently."
    if pair:
        known = np.isfinite(ratio) and ratio < 1e3
        gain = f" {ratio:.1f} times as much as now" if known else "; at present they do not"
        return f"To distinguish {names}: {words}. Their signatures would then differ{gain}."
    return f"To detect a smaller {names}: {words}. Its signature would be {ratio:.1f} times as large as now."


def next_for_remainder(block: LaplaceFit) -> str:
    """The plan in which a smooth remainder of the same size in newtons would stand out most."""
    words, ratio = _best_plan(block, lambda target: _remainder_seen(target, block))
    if ratio < _WORTH:
        return f"None of the tests considered ({_TRIED}) would show more of what remains; repeat this one."
    return f"To learn more of what remains: {words}. It would stand out {ratio:.1f} times as much as now."


def _best_plan(block: LaplaceFit, value: Callable[[LogPosterior], float]) -> tuple[str, float]:
    """Words of the plan with the largest value, and that value over the present test's."""
    problem = block.target.problem
    planned = [_another_length(problem)]
    for plans in zip(*(alternatives(s.protocol, len(problem.samples) == 1) for s in problem.samples), strict=True):
        protocols = [plan.protocol for plan in plans]
        empty = [np.zeros((*p.time_s.shape, 1)) for p in protocols]
        planned.append((plans[0].words, with_protocols(problem, protocols, empty)))
    here = value(block.target)
    best, words = max((value(replace_problem(block.target, other)), words) for words, other in planned)
    return words, best / here if here > 0 else np.inf


def _remainder_seen(target: LogPosterior, block: LaplaceFit) -> float:
    """Typical length, in standard deviations of a reading, of a smooth remainder of one newton after projection."""
    x = expand(target, block.modes.z[:1], [])
    smooth = replace(x, signatures=x.flexible, one_sided=np.zeros(x.flexible.shape[2], bool))
    return float(np.sqrt((projected(smooth, float(x.ratio[0])) ** 2).sum()))


def replace_problem(target: LogPosterior, problem: Any) -> LogPosterior:
    """A target on other holds whose coordinates mean the same."""
    out = LogPosterior(problem)
    out.coordinates.ridges = target.coordinates.ridges
    return out


def _separation(target: LogPosterior, block: LaplaceFit, trials: Sequence[Probe]) -> float:
    """Length of the first signature left when parameters, and the second where there is one, have taken their part."""
    x = expand(target, block.modes.z[:1], trials)
    p = projected(x, float(x.ratio[0]))
    first = p[:, 0]
    if p.shape[1] > 1 and (p[:, 1] ** 2).sum() > 0:
        second = p[:, 1] / np.sqrt((p[:, 1] ** 2).sum())
        first = first - second * (second @ first)
    return float(np.sqrt(first @ first))

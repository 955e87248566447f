"""Find the missing effect: nothing is missing, this is, one of these is, or something that is not in the catalogue.

The order is: gross errors; fits; one global test calibrated by refitted simulations; effects by refitted evidence
beside a flexible reference; further effects by leave-one-hold-out; the gap on held-out holds; what could not be
detected.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import repeat
from typing import Any

import numpy as np

from wirebayes.discovery import gross_errors, next_measurement, power, residual_patterns, shrinking
from wirebayes.discovery.families import Family, block_ratio, called, families_of, noise_ratio, refitted_probe, sentence
from wirebayes.discovery.global_test import Gate, examine
from wirebayes.discovery.held_out import LeftOut
from wirebayes.discovery.judgement import Evidence, FamilyEvidence, Judgement, judge
from wirebayes.discovery.linear_scan import Expansion
from wirebayes.discovery.model_space import smallest_set
from wirebayes.discovery.name_evidence import NameEvidence, reaches, weigh_names
from wirebayes.discovery.screening import GlobalTest
from wirebayes.discovery.settings import ALPHA, LEAST_HOLDS, REMAINS, Settings
from wirebayes.discovery.stepwise import Accepted, Explored, Fits, explore
from wirebayes.discovery.verdict import (
    Alternative,
    Decision,
    accepted_effects,
    alternatives,
    decide,
    evidence,
)
from wirebayes.effects import CATALOGUE
from wirebayes.errors import InputError
from wirebayes.inference.fit import seed_of
from wirebayes.inference.laplace_fit import LaplaceFit, fitted
from wirebayes.io.experiment import Experiment
from wirebayes.json_files.discovery import (
    Amplitude,
    Answer,
    DetectableAmplitude,
    Disagreement,
    DiscoveryJson,
    ExperimentFindings,
    FamilyReport,
    HeldOutReport,
    Outlook,
    Remainder,
    Verdict,
)
from wirebayes.json_files.read_units import in_unit
from wirebayes.model.scales import scales_of
from wirebayes.notice import Notice, named, to_json
from wirebayes.processes.workers import ParallelMap
from wirebayes.sentences import counted
from wirebayes.wire.control import READ_UNIT
from wirebayes.wire.effect import Effect, EventEffect

_VISIBLE = 0.05  # p of a residual pattern that is reported of the remainder


@dataclass(frozen=True)
class Investigation:
    """What was found in a file.

    Attributes
    ----------
    report : dict
        The content of ``discovery.json``.
    final : tuple of LaplaceFit
        The samples of each material, gross errors struck out, with the effects that were accepted.
    undecided : tuple of list of Alternative
        For each material the models that the readings leave undecided, the final one first; empty where nothing is.
    """

    report: DiscoveryJson
    final: tuple[LaplaceFit, ...]
    undecided: tuple[list[Alternative], ...] = ()


def catalogue_without(names: Sequence[str], known: Mapping[str, type[Effect]] = CATALOGUE) -> dict[str, type[Effect]]:
    """The catalogue less some effects.

    Raises
    ------
    InputError
        If it has no such effect.
    """
    for name in names:
        if name not in known:
            raise InputError(f"--without {name}: no such effect; known are {', '.join(sorted(known))}")
    return {name: kind for name, kind in known.items() if name not in names}


def discover(
    experiments: Sequence[Experiment], *, without: Sequence[str] = (), seed: int = 0, **settings: Any
) -> DiscoveryJson:
    """The content of ``discovery.json`` for the experiments of one file (see `investigate`).

    Parameters
    ----------
    experiments : sequence of Experiment
        Those of one material are judged jointly.
    without : sequence of str
        Effects taken out of the catalogue.
    seed : int
    **settings
        Fields of `Settings`.

    Returns
    -------
    dict
    """
    kinds = catalogue_without(without, settings.pop("kinds", CATALOGUE))
    return investigate(experiments, Settings(kinds=kinds, **settings), seed).report


def investigate(
    experiments: Sequence[Experiment],
    settings: Settings,
    seed: int = 0,
    report: Callable[[str, float, float], None] = lambda name, done, total: None,
    parallel_map: ParallelMap = map,
) -> Investigation:
    """Judge the experiments of one file together.

    Parameters
    ----------
    experiments : sequence of Experiment
    settings : Settings
    seed : int
    report : function of (what, done, total)
        Called as the work proceeds.
    parallel_map : function, optional
        The built-in `map`, or one over processes (`wirebayes.processes.workers`); the findings are the same.

    Returns
    -------
    Investigation
    """
    rng = np.random.default_rng(seed_of(seed, "discover"))
    groups: dict[str, list[Experiment]] = {}
    for e in experiments:
        groups.setdefault(e.material, []).append(e)
    laws = repeat(settings.law), repeat(settings.history)
    one_scale = partial(fitted, scales=scales_of(experiments))  # materials may share the amplitude of an instrument
    start = list(parallel_map(one_scale, groups.values(), repeat(()), *laws, rng.spawn(len(groups))))
    gate = examine(start, settings.kinds, settings.simulations, rng, report=report, parallel_map=parallel_map)
    where = [
        residual_patterns.findings(p, len(gate.trials), d, n, ", ".join(b.names))
        for p, d, n, b in zip(gate.patterns, gate.data, gate.nulls, gate.blocks, strict=True)
    ]
    expansions = [_only(x, len(gate.trials)) for x in gate.expansions]
    past: _Named | None = None
    left_out = LeftOut(rng, parallel_map)
    if gate.test.p <= ALPHA:
        report("naming", 0, 1)
        past = _named(gate, expansions, settings, left_out, rng, parallel_map)
        report("naming", 1, 1)
    answers = [_answer(gate, past, i, where[i], left_out, rng, parallel_map) for i in range(len(gate.blocks))]
    final = [a.stages[-1] if a.stages else block for a, block in zip(answers, gate.blocks, strict=True)]
    ratios = [block_ratio(f) for f in final]
    alike = power.similarity(expansions, gate.trials, ratios)
    out: dict[str, ExperimentFindings] = {}
    for i, block in enumerate(gate.blocks):
        report("held-out holds", i, len(gate.blocks))
        common = _common(answers, i, gate.blocks, gate.test, where[i], alike)
        outlook = _outlook(gate, i, settings, answers[i], alike)
        for name, own in _own_reports(gate, block, answers[i], left_out, rng, parallel_map).items():
            out[name] = {**common, **outlook, **own}
    report("held-out holds", len(gate.blocks), len(gate.blocks))
    undecided = [
        alternatives(past.decision, past.fits, i, last, answer.judgement.undecided, answer.remains)
        if past is not None and answer.judgement.undecided and answer.stages
        else []
        for i, (answer, last) in enumerate(zip(answers, final, strict=True))
    ]
    return Investigation({"version": 3, "experiments": out, "warnings": named(out)}, tuple(final), tuple(undecided))


@dataclass(frozen=True)
class _Named:
    """What was found past the global test: the sets of effects, what they say, and blocks with any of them."""

    explored: Explored
    decision: Decision
    fits: Fits


def _named(
    gate: Gate,
    expansions: Sequence[Expansion],
    settings: Settings,
    left_out: LeftOut,
    rng: np.random.Generator,
    parallel_map: ParallelMap,
) -> _Named:
    """The sets of effects that were looked at, past the global test, and what they say."""
    reach = reaches(gate.blocks, gate.trials, gate.candidates)
    found = weigh_names(gate.blocks, gate.trials, gate.candidates, gate.data, parallel_map, reach)
    alike = _families_of_singles(gate.blocks, found)
    explored = explore(gate.blocks, found, expansions, gate.trials, alike, settings, rng, parallel_map)
    families = _families(gate.blocks, explored)
    decision = decide(gate.blocks, explored, families, settings, left_out, rng, parallel_map)
    return _Named(explored, decision, Fits(gate.blocks, explored, settings, rng))


def _families_of_singles(plain: list[LaplaceFit], found: NameEvidence) -> list[Family]:
    """Families of effects refitted one at a time, in the noise that the best of them leaves."""
    ranked = sorted(found.winners, key=lambda name: -found.log_bayes[name])
    if not ranked:
        return []
    probed = {n: {b: refitted_probe(plain[b], r, b) for b, r in found.amplitudes(n).items()} for n in ranked}
    best = found.amplitudes(ranked[0])
    ratios = [noise_ratio(block, best[b], b) if b in best else block_ratio(block) for b, block in enumerate(plain)]
    return families_of(plain, probed, ratios)


def _families(plain: list[LaplaceFit], explored: Explored) -> list[Family]:
    """Families of all effects that were refitted, each where it had the most evidence, in the noise of the best set."""
    refits = explored.refits()
    probed = {
        name: {b: refitted_probe(parent.blocks[b], r, b) for b, r in found.items()}
        for name, (parent, found) in refits.items()
    }
    if not probed:
        return []
    best = max(explored.fitted.values(), key=lambda s: s.effects.log_bayes) if explored.fitted else explored.root
    return families_of(plain, probed, [block_ratio(block) for block in best.blocks])


def _own_reports(
    gate: Gate,
    block: LaplaceFit,
    answer: "_Answer",
    left_out: LeftOut,
    rng: np.random.Generator,
    parallel_map: ParallelMap,
) -> dict[str, HeldOutReport]:
    """What the report says of each experiment of a block apart from the others."""
    names = [a.name for a in answer.accepted]
    checks = shrinking.shrinking(block, answer.stages, names, answer.remains, left_out, rng, parallel_map)
    reports: dict[str, HeldOutReport] = {}
    for e, check in zip(block.experiments, checks, strict=True):
        struck = [g for g in gate.struck if g["experiment"] == e.name]
        own: HeldOutReport = {
            "steps": check.steps,
            "held_out": check.held_out,
            "residual_rms_N": shrinking.left_over(block, e.name),
            "gross_errors": struck,
            "warnings": to_json([*map(gross_errors.in_words, struck), *_few_holds(e)]),
        }
        reports[e.name] = in_unit(own, READ_UNIT[e.control])
    return reports


def _few_holds(e: Experiment) -> list[Notice]:
    """What a test of few holds leaves open: nothing is left out, so nothing shows whether an effect predicts."""
    holds = len(e.recorded_holds)
    if holds >= LEAST_HOLDS:
        return []
    text = (
        f"{counted(holds, 'hold')}: no effect can be established, and no hold is held out to be predicted; both need "
        f"{LEAST_HOLDS} recorded holds"
    )
    return [Notice("few-holds", text)]


@dataclass(frozen=True)
class JointModel:
    """What is sampled at once: some experiments with some effects, and where the best parameters are, if known."""

    experiments: tuple[Experiment, ...]
    effects: tuple[Effect, ...] = ()
    near: dict[str, float] | None = None


def final_models(findings: Investigation) -> list[JointModel]:
    """The final model of every experiment.

    Samples of one material share what they are, and the amplitude of what was added. Where nothing was, each stands for
    itself; where something unknown remains, with the flexible discrepancy beside what was added.
    """
    out = []
    for block in findings.final:
        reports = [findings.report["experiments"][name] for name in block.names]
        remains = reports[0]["verdict"] in ("partial", "unknown")
        out += _sampled(block, remains)
    return out


def alternative_models(findings: Investigation) -> list[list[JointModel]]:
    """The other models that stay undecided beside the final ones, each as what is sampled for it."""
    return [_sampled(other.block, other.remains) for others in findings.undecided for other in others[1:]]


def _sampled(block: LaplaceFit, remains: bool) -> list[JointModel]:
    """What is sampled for a block, with a smooth discrepancy beside its effects where something remains."""
    if block.effects and not remains:
        return [JointModel(block.experiments, block.effects, block.best)]
    out = []
    for e in block.experiments:
        own = shrinking.alone(block.effects, e)
        smooth = (shrinking.discrepancy(e, shrinking.left_over(block, e.name)),) if remains else ()
        out.append(JointModel((e,), (*own, *smooth), block.parameters(e.name)))
    return out


@dataclass(frozen=True)
class _Answer:
    """What is said of one material.

    Attributes
    ----------
    judgement : Judgement
    accepted : list of Accepted
    stages : list of LaplaceFit
        Its block with the first accepted effect, the first two, and so on.
    found : Evidence or None
        None where only the global test was requested.
    remainder : dict
    """

    judgement: Judgement
    accepted: list[Accepted]
    stages: list[LaplaceFit]
    found: Evidence | None
    remainder: Remainder

    @property
    def verdict(self) -> Verdict:
        return self.judgement.verdict

    @property
    def remains(self) -> bool:
        """Whether the final model has a discrepancy."""
        return self.verdict in ("partial", "unknown")

    @property
    def shares(self) -> dict[str, float]:
        """Probability of each name, and of *unknown*, to have the largest share; empty where nothing is missing."""
        return {} if self.found is None or self.verdict == "nothing-missing" else dict(self.found.shares)

    @property
    def best(self) -> str | None:
        if self.verdict == "unknown":
            return "unknown"
        return max(self.shares, key=lambda name: self.shares[name]) if self.shares else None

    @property
    def set(self) -> list[str]:
        if self.verdict == "ambiguous":
            return list(self.judgement.undecided)
        members = smallest_set(self.shares)
        return members if self.verdict != "unknown" or "unknown" in members else [*members, "unknown"]


# of a material that the global test has cleared
_NO_REMAINDER: Remainder = {"probability": 0.0, "where": [], "p": None, "leave_one_hold_out": None}


def _answer(
    gate: Gate, past: _Named | None, i: int, where: list[Disagreement], left_out: LeftOut,
    rng: np.random.Generator, parallel_map: ParallelMap,
) -> _Answer:  # fmt: skip
    """The verdict on block `i`, and its fits with what was accepted."""
    if past is None:
        return _Answer(Judgement("nothing-missing"), [], [], None, _NO_REMAINDER)
    p, plain = gate.test.p, gate.blocks[i]
    before = evidence(past.decision, p, i)
    accepted = accepted_effects(past.decision, before, i)
    stages = _stages(plain, accepted, past.explored, i, rng)
    gain = None
    if before.remainder > REMAINS:
        base = stages[-1] if before.established else plain
        gain = shrinking.discrepancy_gain(base, left_out, rng, parallel_map)
    found = replace(before, remainder_gain=gain)
    judgement = judge(found)
    if judgement.verdict in ("nothing-missing", "unknown"):
        accepted, stages = [], []
    # beside the effects where some are accepted, else what the plain model leaves over
    retest = past.decision.retest
    beside = retest.where[i] if retest is not None else []
    patterns = {"partial": beside, "unknown": where}.get(judgement.verdict, [])
    remainder: Remainder = {
        "probability": found.remainder,
        "where": [w["covariate"] for w in patterns if w["p"] <= _VISIBLE],
        "p": None if retest is None else retest.p,
        "leave_one_hold_out": gain,
    }
    return _Answer(judgement, accepted, stages, found, remainder)


def _stages(
    plain: LaplaceFit, accepted: Sequence[Accepted], explored: Explored, i: int, rng: np.random.Generator
) -> list[LaplaceFit]:
    """Block `i` with the first accepted effect, the first two, and so on; fitted here where the search has not."""
    stages: list[LaplaceFit] = []
    for k in range(len(accepted)):
        effects = tuple(a.effects[i] for a in accepted[: k + 1])
        ready = [s.blocks[i] for s in explored.fitted.values() if s.blocks[i].effects == effects]
        base = stages[-1] if stages else plain
        own = (
            ready[0] if ready else fitted(base.experiments, effects, plain.law, plain.history, rng, scales=plain.scales)
        )
        stages.append(own)
    return stages


def _family(family: FamilyEvidence) -> FamilyReport:
    """What is said of a family."""
    members = tuple(family.members)
    return {
        "name": called(members),
        "members": list(members),
        "inclusion": family.inclusion,
        "leave_one_hold_out": family.gain,
        "established": family.is_established,
        "sentence": sentence(family.members),
    }


def _amplitude(final: LaplaceFit, effect: Effect) -> Amplitude:
    """Amplitude in the final model, by its normal approximation in the sampled coordinates."""
    low, mean, high = map(float, final.along(effect, (-1.645, 0.0, 1.645)))
    hold = effect.hold if isinstance(effect, EventEffect) else None
    return {"mean": mean, "q05": low, "q95": high, "unit": final.unit(effect), "hold": hold}


def _inclusion(found: Evidence | None) -> dict[str, float]:
    """Probability of each name to be missing, the most probable first."""
    each = {} if found is None else {n: p for family in found.families for n, p in family.members.items()}
    return dict(sorted(each.items(), key=lambda item: -item[1]))


def _common(
    answers: Sequence[_Answer], i: int, plain: list[LaplaceFit], test: GlobalTest, where: list[Disagreement],
    alike: dict[tuple[str, str], float],
) -> Answer:  # fmt: skip
    """What the experiments of one block share in the report."""
    answer = answers[i]
    names, members = [a.name for a in answer.accepted], answer.set
    named = [m for m in members if m != "unknown"]
    shared = [n for a in answer.accepted for b in a.blocks if b != i for n in plain[b].names]
    return {
        "verdict": answer.verdict,
        "effects": {"ambiguous": list(answer.judgement.undecided)}.get(answer.verdict, names),
        "best": answer.best,
        "set": members,
        "group": (power.group_of(named, alike) if named else []) + (["unknown"] if "unknown" in members else []),
        "accepted": names,
        "amplitudes": {a.name: _amplitude(answer.stages[-1], a.effects[i]) for a in answer.accepted},
        "probabilities": answer.shares,
        "probability_nothing": None if answer.found is None else answer.found.nothing,
        "inclusion": _inclusion(answer.found),
        "families": [] if answer.found is None else [_family(f) for f in answer.found.families],
        "parameters": {},
        "remainder": answer.remainder,
        "p_global": test.p,
        "p_interval": list(test.p_interval),
        "p_simulations": len(test.null),
        "shared_with": list(dict.fromkeys(shared)),
        "where": where,
    }


def _outlook(gate: Gate, i: int, settings: Settings, answer: _Answer, alike: dict[tuple[str, str], float]) -> Outlook:
    """What could have been seen in block `i`, what cannot be, and what to measure next."""
    block, trials, candidates = gate.blocks[i], gate.trials, gate.candidates
    found = power.detectable(gate.nulls[i], trials, candidates, gate.test, i)
    best_probe = {name: k for name, (k, _) in found.items()}
    seen: dict[str, DetectableAmplitude] = {
        name: _detectable(block, trials[k].effect, amplitude) for name, (k, amplitude) in found.items()
    }
    possible = [c.name for c in candidates if i in c.blocks]
    hidden = power.not_identifiable(block, list(settings.kinds.values()), possible)
    pair, weakest = None, None
    if answer.verdict in ("ambiguous", "named", "partial"):
        rivals = [n for n in answer.judgement.undecided or answer.shares if n in best_probe]
        group = [n for n in rivals if n == rivals[0] or alike.get((rivals[0], n), 0.0) > power.ALIKE]
        rivals = [n for n in rivals if n in answer.set or n in group]
        if len(rivals) > 1:
            pair = (trials[best_probe[rivals[0]]], trials[best_probe[rivals[1]]])
        elif rivals:
            weakest = trials[best_probe[rivals[0]]]
    if pair is None and weakest is None and best_probe:
        # Relative to what a person expects before the test, which effect was hidden best?
        def hiddenness(name: str) -> float:
            amplitude = found[name][1]
            return (
                float("inf")
                if amplitude is None
                else amplitude / trials[best_probe[name]].effect.amplitudes[0].prior.std()
            )

        weakest = trials[best_probe[max(best_probe, key=hiddenness)]]
    if answer.remains:
        proposal = next_measurement.next_for_remainder(answer.stages[-1] if answer.stages else block)
        if answer.judgement.undecided and pair is not None:
            proposal = f"{next_measurement.next_measurement(block, pair, None)} {proposal}"
    else:
        proposal = next_measurement.next_measurement(block, pair, weakest)
    return {"power": seen, "not_identifiable": hidden, "next_measurement": proposal}


def _detectable(block: LaplaceFit, effect: Effect, amplitude: float | None) -> DetectableAmplitude:
    """The smallest amplitude that is likely to be seen, in its natural unit."""
    seen = None if amplitude is None else block.natural_amplitude(effect, amplitude)
    return {"amplitude_80": seen, "unit": block.unit(effect)}


def _only(x: Expansion, m: int) -> Expansion:
    """The expansion with its first m signatures."""
    return replace(x, signatures=x.signatures[..., :m], one_sided=x.one_sided[:m])

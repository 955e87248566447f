"""Find the missing effect: nothing is missing, this is, one of these is, or something that is not in the catalogue.

The order is: gross errors; fits; one global test calibrated by refitted simulations; effects by refitted evidence
beside a flexible reference; further effects by leave-one-hold-out; the gap on held-out holds; what could not be
detected.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from itertools import repeat

import numpy as np
from numpy.random import Generator

from wirebayes.discovery import gross_errors, power, residual_patterns, shrinking
from wirebayes.discovery.alternatives import Alternative, alternatives
from wirebayes.discovery.apart import p_alike
from wirebayes.discovery.doubts import lengths_or_samples, likely_beside, samples_differ
from wirebayes.discovery.families import block_ratio, called, family_names, family_sentence
from wirebayes.discovery.global_test import Gate, examine
from wirebayes.discovery.held_out import LeftOut
from wirebayes.discovery.investigation import Concluded, Investigation
from wirebayes.discovery.judgement import Evidence, FamilyEvidence
from wirebayes.discovery.material_answer import MaterialAnswer, answer_material
from wirebayes.discovery.model_space import largest_first
from wirebayes.discovery.naming import Named, name_effects
from wirebayes.discovery.noise_integral import Expansion
from wirebayes.discovery.outlook import outlook
from wirebayes.discovery.power import Cosines
from wirebayes.discovery.screening import GlobalTest
from wirebayes.discovery.settings import ALPHA, LEAST_HOLDS, Settings
from wirebayes.effects import CATALOGUE
from wirebayes.errors import InputError
from wirebayes.inference.fit import seed_of
from wirebayes.inference.laplace_fit import LaplaceFit, fitted
from wirebayes.io.experiment import Experiment, by_material
from wirebayes.json_files.discovery import (
    AmplitudeEstimate,
    Disagreement,
    ExperimentFindings,
    FamilyReport,
    HeldOutReport,
    SharedFindings,
)
from wirebayes.json_files.read_units import in_unit
from wirebayes.model.scales import scales_of
from wirebayes.processes.workers import ParallelMap
from wirebayes.progress import Progress, silent
from wirebayes.result_warnings import Notice, from_json, notices_by_part, to_json
from wirebayes.results.posterior_checks import copied_samples
from wirebayes.sentences import counted
from wirebayes.wire.control import READ_UNIT
from wirebayes.wire.effect import Effect, EventEffect, Kinds


def catalogue_without(names: Sequence[str], known: Kinds = CATALOGUE) -> dict[str, type[Effect]]:
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


def investigate(
    experiments: Sequence[Experiment],
    settings: Settings,
    seed: int = 0,
    report: Progress = silent,
    parallel_map: ParallelMap = map,
    concluded: Callable[[Concluded], None] = lambda found: None,
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
    concluded : function of a Concluded, optional
        Called as soon as the models are known, before it is reported how they predict.

    Returns
    -------
    Investigation
    """
    rng = np.random.default_rng(seed_of(seed, "discover"))
    gate = examine(
        _plain_fits(experiments, settings, rng, parallel_map),
        settings.kinds,
        settings.simulations,
        rng,
        report=report,
        parallel_map=parallel_map,
    )
    where = _disagreements(gate)
    expansions = [_only(x, len(gate.trials)) for x in gate.expansions]
    past: Named | None = None
    left_out = LeftOut(rng, parallel_map)
    if gate.test.p <= ALPHA:
        report("naming", 0, 1)
        past = name_effects(gate, expansions, settings, left_out, rng, parallel_map)
        report("naming", 1, 1)
    answers = [answer_material(gate, past, i, where[i], left_out, rng, parallel_map) for i in range(len(gate.blocks))]
    models = _models(past, answers, gate.blocks)
    concluded(models)
    of_samples = _differing_samples(models.final, seed, parallel_map)
    alike = power.similarity(expansions, gate.trials, [block_ratio(f) for f in models.final])
    out: dict[str, ExperimentFindings] = {}
    for i, answer in enumerate(answers):
        report("held-out holds", i, len(answers))
        ahead = outlook(gate, i, settings, answer, alike)
        own = _own_reports(gate, i, answer, left_out, rng, parallel_map)
        for e in gate.blocks[i].experiments:
            common = _common(answers, i, e, gate.blocks, gate.test, where[i], alike)
            out[e.name] = _with_doubts({**common, **ahead, **own[e.name]}, of_samples[i])
    report("held-out holds", len(answers), len(answers))
    return Investigation(
        models.final,
        models.remains,
        models.undecided,
        {"version": 3, "experiments": out, "warnings": notices_by_part(out)},
    )


def _plain_fits(
    experiments: Sequence[Experiment], settings: Settings, rng: Generator, parallel_map: ParallelMap
) -> list[LaplaceFit]:
    """The experiments of each material, fitted jointly, all on one scale: they may share an instrument's amplitude."""
    materials = by_material(experiments)
    one_scale = partial(fitted, scales=scales_of(experiments))
    spec = repeat(settings.spec)
    return list(parallel_map(one_scale, materials.values(), repeat(()), spec, rng.spawn(len(materials))))


def _disagreements(gate: Gate) -> list[list[Disagreement]]:
    """What the residuals of each plain block depend on."""
    number = len(gate.trials)
    each = zip(gate.patterns, gate.data, gate.nulls, gate.blocks, strict=True)
    return [residual_patterns.findings(p, number, d, null, ", ".join(b.names)) for p, d, null, b in each]


def _models(past: Named | None, answers: Sequence[MaterialAnswer], plain: Sequence[LaplaceFit]) -> Concluded:
    """What is said of each material as models: the final one, and those that stay undecided beside it."""
    final = tuple(a.stages[-1] if a.stages else block for a, block in zip(answers, plain, strict=True))
    return Concluded(final, tuple(a.remains for a in answers), _undecided(past, answers, final))


def _undecided(
    past: Named | None, answers: Sequence[MaterialAnswer], final: Sequence[LaplaceFit]
) -> tuple[list[Alternative], ...]:
    """For each material the models that the readings leave undecided; an empty list where nothing is."""
    out = []
    for i, (answer, last) in enumerate(zip(answers, final, strict=True)):
        names = answer.judgement.undecided
        known = past is not None and names and answer.stages
        out.append(alternatives(past.decision, past.fits, i, last, names, answer.remains) if past and known else [])
    return tuple(out)


def _own_reports(
    gate: Gate,
    i: int,
    answer: MaterialAnswer,
    left_out: LeftOut,
    rng: Generator,
    parallel_map: ParallelMap,
) -> dict[str, HeldOutReport]:
    """What the report says of each experiment of block `i` apart from the others."""
    block = gate.blocks[i]
    names = [a.name for a in answer.accepted]
    copied = copied_samples(sample for each in gate.blocks for sample in each.target.problem.samples)
    checks = shrinking.shrinking(block, answer.stages, names, answer.remains, left_out, rng, parallel_map)
    reports: dict[str, HeldOutReport] = {}
    for e, check in zip(block.experiments, checks, strict=True):
        struck = [g for g in gate.struck if g["experiment"] == e.name]
        notices = [*map(gross_errors.in_words, struck), *copied.get(e.name, ()), *_few_holds(e)]
        own: HeldOutReport = {
            "steps": check.steps,
            "held_out": check.held_out,
            "residual_rms_N": shrinking.residual_rms(block, e.name),
            "gross_errors": struck,
            "warnings": to_json(notices),
        }
        reports[e.name] = in_unit(own, READ_UNIT[e.control])
    return reports


def _differing_samples(final: Sequence[LaplaceFit], seed: int, parallel_map: ParallelMap) -> list[list[Notice]]:
    """What is said of each material whose samples differ, or may do so."""
    each = np.random.default_rng(seed_of(seed, "samples")).spawn(len(final))
    found = parallel_map(p_alike, final, each)
    in_blocks = Counter(effect.name for block in final for effect in block.effects)
    said = []
    for p, block in zip(found, final, strict=True):
        of_one = [effect for effect in block.effects if in_blocks[effect.name] == 1]
        said.append([*samples_differ(p, block.names), *lengths_or_samples(of_one, block.experiments)])
    return said


def _with_doubts(found: ExperimentFindings, of_samples: Sequence[Notice]) -> ExperimentFindings:
    """What is said of an experiment, and among its warnings what the final model lacks or takes to be alike."""
    doubts = [*likely_beside(found), *of_samples]
    found["warnings"] = to_json([*doubts, *from_json(found["warnings"])])
    return found


def _few_holds(experiment: Experiment) -> list[Notice]:
    """What a test of few holds leaves open: nothing is left out, so nothing shows whether an effect predicts."""
    holds = len(experiment.recorded_holds)
    if holds >= LEAST_HOLDS:
        return []
    text = (
        f"{counted(holds, 'hold')}: no effect can be established, and no hold is held out to be predicted; both need "
        f"{LEAST_HOLDS} recorded holds"
    )
    return [Notice("few-holds", text)]


def _families(found: Evidence | None) -> list[FamilyReport]:
    """What is said of each family."""
    families = () if found is None else found.families
    names = family_names([tuple(family.members) for family in families])
    established = set[str]()
    out = []
    for name, family in zip(names, families, strict=True):
        pattern = called(tuple(family.members))
        out.append(_family(name, family, again=pattern in established))
        if family.is_established:
            established.add(pattern)
    return out


def _family(name: str, family: FamilyEvidence, *, again: bool) -> FamilyReport:
    """What is said of a family, which is one of a pattern once more or not."""
    return {
        "name": name,
        "members": list(family.members),
        "inclusion": family.inclusion,
        "leave_one_hold_out": family.gain,
        "established": family.is_established,
        "sentence": family_sentence(family.members, again=again),
    }


def _amplitude(final: LaplaceFit, effect: Effect) -> AmplitudeEstimate:
    """Amplitude in the final model, by its normal approximation in the sampled coordinates."""
    low, middle, high = map(float, final.along(effect, (-1.645, 0.0, 1.645)))
    hold = effect.hold if isinstance(effect, EventEffect) else None
    return {"mean": middle, "q05": low, "q50": middle, "q95": high, "unit": final.unit(effect), "hold": hold}


def _inclusion(found: Evidence | None) -> dict[str, float]:
    """Probability of each name to be missing, the most probable first."""
    each = {} if found is None else {n: p for family in found.families for n, p in family.members.items()}
    return largest_first(each)


def _common(
    answers: Sequence[MaterialAnswer],
    i: int,
    experiment: Experiment,
    plain: list[LaplaceFit],
    test: GlobalTest,
    where: list[Disagreement],
    alike: Cosines,
) -> SharedFindings:
    """What the experiments of one block share in the report; of amplitudes those of the effects that act on `e`."""
    answer = answers[i]
    names = [a.name for a in answer.accepted]
    return {
        "verdict": answer.verdict,
        "effects": list(answer.judgement.undecided) if answer.verdict == "ambiguous" else names,
        "best": answer.best,
        "set": answer.set,
        "group": _group(answer.set, alike),
        "accepted": names,
        "amplitudes": _amplitudes(answer, i, experiment),
        "probabilities": answer.shares,
        "probability_nothing": None if answer.found is None else answer.found.nothing,
        "inclusion": _inclusion(answer.found),
        "families": _families(answer.found),
        "parameters": {},
        "remainder": answer.remainder,
        "p_global": test.p,
        "p_interval": list(test.p_interval),
        "p_simulations": len(test.null),
        "shared_with": _sharing(answer, i, plain),
        "where": where,
    }


def _group(members: Sequence[str], alike: Cosines) -> list[str]:
    """The names of a set and their look-alikes; what is unknown has none."""
    named = [name for name in members if name != "unknown"]
    group = power.group_of(named, alike) if named else []
    if "unknown" in members:
        group.append("unknown")
    return group


def _amplitudes(answer: MaterialAnswer, i: int, experiment: Experiment) -> dict[str, AmplitudeEstimate]:
    """The amplitudes of each effect in the final model of material `i` that acts on an experiment."""
    out = {}
    for accepted in answer.accepted:
        effect = accepted.effects[i]
        if effect.acts_on(experiment.name, experiment.control):
            out[accepted.name] = _amplitude(answer.stages[-1], effect)
    return out


def _sharing(answer: MaterialAnswer, i: int, plain: Sequence[LaplaceFit]) -> list[str]:
    """The experiments of other materials that have an effect's amplitude in common with material `i`."""
    names: dict[str, None] = {}
    for accepted in answer.accepted:
        for b in accepted.blocks:
            if b != i:
                names |= dict.fromkeys(plain[b].names)
    return list(names)


def _only(x: Expansion, m: int) -> Expansion:
    """The expansion with its first m signatures."""
    return replace(x, signatures=x.signatures[..., :m], one_sided=x.one_sided[:m], kinds=x.kinds[:m])

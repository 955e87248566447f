"""Find the missing effect: nothing is missing, this is, one of these is, or something that is not in the catalogue.

The order is: gross errors; fits; one global test calibrated by refitted simulations; names by refitted evidence beside
a flexible reference; further effects by leave-one-hold-out; the gap on held-out holds; what could not have been seen.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import repeat
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wirebayes.discovery import gap, name_evidence, power, residual_patterns, screening
from wirebayes.discovery.global_test import examine
from wirebayes.discovery.linear_scan import Expansion, Probe, Scan, expand
from wirebayes.discovery.name_evidence import NameEvidence
from wirebayes.discovery.screening import Candidate, GlobalTest
from wirebayes.discovery.settings import ALPHA, Settings
from wirebayes.discovery.sharing import informed
from wirebayes.discovery.verdict import KEEP_ELPD, Accepted, decide
from wirebayes.effects import CATALOGUE
from wirebayes.effects.unknown import Discrepancy
from wirebayes.errors import InputError
from wirebayes.inference.fit import seed_of
from wirebayes.inference.laplace_fit import LaplaceFit, fitted
from wirebayes.io.experiment import Experiment
from wirebayes.wire.effect import Effect, EventEffect
from wirebayes.workers import Each

Array = NDArray[Any]


@dataclass(frozen=True)
class Findings:
    """What was found in a file.

    Attributes
    ----------
    report : dict
        The content of ``discovery.json``.
    final : tuple of LaplaceFit
        The samples of each material, gross errors struck out, with the effects that were accepted.
    """

    report: dict[str, Any]
    final: tuple[LaplaceFit, ...]


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
) -> dict[str, Any]:
    """The content of ``discovery.json`` for the experiments of one file (see `investigate`)."""
    kinds = catalogue_without(without, settings.pop("kinds", CATALOGUE))
    return investigate(experiments, Settings(kinds=kinds, **settings), seed).report


def investigate(
    experiments: Sequence[Experiment],
    settings: Settings,
    seed: int = 0,
    report: Callable[[str, float, float], None] = lambda name, done, total: None,
    each: Each = map,
) -> Findings:
    """Judge the experiments of one file together.

    Parameters
    ----------
    experiments : sequence of Experiment
    settings : Settings
    seed : int
    report : function of (what, done, total)
        Told as the work goes on.
    each : function, optional
        The built-in `map`, or one over processes (`wirebayes.workers`); the findings are the same.

    Returns
    -------
    Findings
    """
    rng = np.random.default_rng(seed_of(seed, "discover"))
    groups: dict[str, list[Experiment]] = {}
    for e in experiments:
        groups.setdefault(e.material, []).append(e)
    laws = repeat(settings.law), repeat(settings.history)
    start = list(each(fitted, groups.values(), repeat(()), *laws, rng.spawn(len(groups))))
    gate = examine(start, settings.kinds, settings.simulations, rng, report=report, each=each)
    plain, trials, candidates, data, nulls = gate.blocks, gate.trials, gate.candidates, gate.data, gate.nulls
    test = gate.test
    where = [
        residual_patterns.findings(p, len(trials), d, n, ", ".join(b.names))
        for p, d, n, b in zip(gate.patterns, data, nulls, plain, strict=True)
    ]
    if test.p > ALPHA:
        verdict, choice, accepted = "nothing-missing", None, list[Accepted]()
        final = plain
    else:
        report("naming", 0, 1)
        choice = name_evidence.choose(plain, trials, candidates, data, gate.further, each)
        verdict, accepted, final, choice = decide(plain, choice, settings, rng, each)
        for a in accepted:
            if len(a.effects) > 1 and settings.kinds[a.name].scope in screening.FILE_WIDE:
                final = informed(final, a.effects, rng)
        report("naming", 1, 1)
    ratios = [float(expand(f.target, f.modes.z[:1], []).ratio[0]) for f in final]
    alike = power.similarity([_only(x, len(trials)) for x in gate.expansions], trials, ratios)
    out: dict[str, Any] = {}
    for i, block in enumerate(plain):
        report("held-out holds", i, len(plain))
        affected = [a for a in accepted if i in a.blocks]
        common = _common(verdict, choice, affected, plain, final[i], i, test.p, where[i], alike)
        common |= _outlook(block, i, trials, candidates, nulls[i], test, settings, choice, common["verdict"], alike)
        checks = _held_out(block, final[i], verdict, rng, each)
        for e, check in zip(block.experiments, checks, strict=True):
            out[e.name] = common | {
                "held_out": check,
                "residual_rms_N": _left_over(block, e.name),
                "gross_errors": [g for g in gate.struck if g["experiment"] == e.name],
            }
    report("held-out holds", len(plain), len(plain))
    return Findings({"version": 1, "experiments": out}, tuple(final))


@dataclass(frozen=True)
class JointModel:
    """What is sampled at once: some experiments with some effects, and where the best parameters are, if known."""

    experiments: tuple[Experiment, ...]
    effects: tuple[Effect, ...] = ()
    near: dict[str, float] | None = None


def final_models(findings: Findings) -> list[JointModel]:
    """The final model of every experiment.

    Samples of one material share what they are, and the amplitude of what was added. Where nothing was, each stands for
    itself; where what is missing has no name, with the flexible discrepancy.
    """
    out = []
    for block in findings.final:
        reports = [findings.report["experiments"][name] for name in block.names]
        if block.effects:
            out.append(JointModel(block.experiments, block.effects, block.best))
            continue
        for e, report in zip(block.experiments, reports, strict=True):
            flexible = report["verdict"] == "unknown"
            effects = (_discrepancy(e, float(report["residual_rms_N"])),) if flexible else ()
            out.append(JointModel((e,), effects, block.parameters(e.name)))
    return out


def _amplitude(final: LaplaceFit, effect: Effect) -> dict[str, Any]:
    """Amplitude in the final model, by its normal approximation in the sampled coordinates."""
    main = effect.amplitudes[0]
    low, mean, high = map(float, final.along(effect, (-1.645, 0.0, 1.645)))
    hold = effect.hold if isinstance(effect, EventEffect) else None
    return {"mean": mean, "q05": low, "q95": high, "unit": main.unit, "hold": hold}


def _common(
    verdict: str, choice: NameEvidence | None, affected: list[Accepted], plain: list[LaplaceFit], final: LaplaceFit,
    i: int, p: float,
    where: list[dict[str, Any]], alike: dict[tuple[str, str], float],
) -> dict[str, Any]:  # fmt: skip
    """What the experiments of one block share in the report."""
    names = [a.name for a in affected]
    if choice is None or (verdict != "unknown" and not names):
        verdict, members, shares, best = "nothing-missing", [], {}, None
    else:
        shares, best = choice.shares, choice.best
        members = choice.set
    named = [m for m in members if m != "unknown"]
    shared = [n for a in affected for b in a.blocks if b != i for n in plain[b].names]
    return {
        "verdict": verdict,
        "effects": names if verdict == "named" else named if verdict == "ambiguous" else [],
        "best": best,
        "set": members,
        "group": (power.group_of(named, alike) if named else []) + (["unknown"] if "unknown" in members else []),
        "accepted": names,
        "amplitudes": {a.name: _amplitude(final, a.effects[i]) for a in affected},
        "probabilities": shares,
        "p_global": p,
        "shared_with": list(dict.fromkeys(shared)),
        "where": where,
    }


def _outlook(
    block: LaplaceFit, i: int, trials: list[Probe], candidates: list[Candidate], null: Scan, test: GlobalTest,
    settings: Settings, choice: NameEvidence | None, verdict: str, alike: dict[tuple[str, str], float],
) -> dict[str, Any]:  # fmt: skip
    """What could have been seen, what cannot be, and what to measure next."""
    best_probe: dict[str, int] = {}
    strength = np.median(null.norm, axis=0)
    for c in candidates:
        if i in c.blocks and (c.name not in best_probe or strength[c.probe] > strength[best_probe[c.name]]):
            best_probe[c.name] = c.probe
    seen = {
        name: {
            "amplitude_80": power.amplitude_80(null, trials[k], k, test.threshold(name, ALPHA)),
            "unit": trials[k].effect.amplitudes[0].unit,
        }
        for name, k in best_probe.items()
    }
    possible = [c.name for c in candidates if i in c.blocks]
    hidden = power.not_identifiable(block, list(settings.kinds.values()), possible)
    pair, weakest = None, None
    if choice is not None and verdict in ("ambiguous", "named"):
        rivals = [n for n in sorted(choice.winners, key=lambda n: -choice.shares.get(n, 0.0)) if n in best_probe]
        group = [n for n in rivals if n == rivals[0] or alike.get((rivals[0], n), 0.0) > power.ALIKE]
        rivals = [n for n in rivals if n in choice.set or n in group]
        if len(rivals) > 1:
            pair = (trials[best_probe[rivals[0]]], trials[best_probe[rivals[1]]])
        elif rivals:
            weakest = trials[best_probe[rivals[0]]]
    if pair is None and weakest is None and best_probe:
        # Relative to what a person expects before the test, which effect was hidden best?
        def hiddenness(name: str) -> float:
            amplitude = seen[name]["amplitude_80"]
            return (
                float("inf")
                if amplitude is None
                else amplitude / trials[best_probe[name]].effect.amplitudes[0].prior.std()
            )

        weakest = trials[best_probe[max(best_probe, key=hiddenness)]]
    return {"power": seen, "not_identifiable": hidden, "next_measurement": power.next_measurement(block, pair, weakest)}


def _held_out(
    block: LaplaceFit, final: LaplaceFit, verdict: str, rng: np.random.Generator, each: Each
) -> list[dict[str, Any]]:
    """Plain and final model on the last third of the holds, and by leaving out one hold at a time.

    The flexible discrepancy beside them: an effect that predicts worse than a smooth curve does not shrink the gap.
    """
    train = [gap.last_third(e) for e in block.experiments]
    if not all(train):
        nothing: dict[str, Any] = {"rmse_N": None, "elpd": None}
        return [
            {
                "holds": [],
                "plain": nothing,
                "final": nothing | {"elpd_difference_se": None},
                "gap_closed": None,
                "shrinks": False,
            }
            for _ in block.experiments
        ]
    asked: list[tuple[Any, ...]] = [(block.experiments, train, (), block)]
    named, whole = bool(final.effects), list[LaplaceFit]()
    n = len(train) if named or verdict == "unknown" else 0
    if n:
        first = [e.train(k) for e, k in zip(block.experiments, train, strict=True)]
        unnamed = list(each(_unnamed, repeat(block), [*block.experiments, *first], rng.spawn(2 * n)))
        alone, added = [(e,) for e in block.experiments], [(d,) for d in unnamed]
        whole += each(fitted, alone, added[:n], repeat(block.law), repeat(block.history), rng.spawn(n))
        asked += zip(alone, [(k,) for k in train], added[n:], repeat(block), strict=False)
    if named:
        asked.append((block.experiments, train, final.effects, final))
        whole.append(final)
    predicted = each(gap.held_out, *zip(*asked, strict=True), rng.spawn(len(asked)))
    left_out = each(gap.leave_one_hold_out, [block, *whole] if n else [], rng.spawn(1 + len(whole)))  # at the same time
    plain, *parts = predicted
    flexible = [h for part in parts[:n] for h in part]
    better = parts[-1] if named else flexible or plain
    shrinks, loho = False, None
    if n:
        without, *elpd = left_out
        loose = np.concatenate(elpd[:n])
        difference = (elpd[-1] if named else loose) - without
        gain, se = float(difference.sum()), float(difference.std(ddof=1) * np.sqrt(len(difference)))
        unnamed_gain = float((loose - without).sum())
        loho = {"elpd_difference": gain, "elpd_difference_se": se, "flexible_elpd_difference": unnamed_gain}
        shrinks = gain > max(KEEP_ELPD, 2.0 * se) and gain >= unnamed_gain
    out = []
    for i, (a, b) in enumerate(zip(plain, better, strict=True)):
        d = b.elpd - a.elpd
        out.append({
            "holds": a.holds,
            "plain": _score(a),
            "final": _score(b)
                     | {"elpd_difference_se": float(d.std(ddof=1) * np.sqrt(len(d))) if len(d) > 1 else None},
            "flexible": _score(flexible[i]) if n else None,
            "floor_N": float(np.sqrt(b.floor)),
            "gap_closed": gap.gap_closed(a, b) if n else None,
            "leave_one_hold_out": loho,
            "shrinks": shrinks,
        })  # fmt: skip
    return out


def _score(held: gap.HeldOut) -> dict[str, float]:
    return {"rmse_N": held.rmse_N, "elpd": float(held.elpd.sum()), "coverage_90": held.inside}


def _unnamed(block: LaplaceFit, experiment: Experiment, rng: np.random.Generator) -> Discrepancy:
    """A discrepancy as large as what the plain model, fitted to the experiment alone, leaves over in it."""
    plain = fitted([experiment], (), block.law, block.history, rng)
    return _discrepancy(experiment, _left_over(plain, experiment.name))


def _discrepancy(experiment: Experiment, size_N: float) -> Discrepancy:
    durations = [h.duration_s for h in experiment.recorded_holds]
    return Discrepancy(len(experiment.holds), size_N, float(np.median(durations)) or 1.0)


def _left_over(block: LaplaceFit, name: str) -> float:
    """Root mean square of what the best parameters leave over in an experiment's readings, N."""
    sample = block.target.problem.samples[block.names.index(name)]
    line, _, _ = block.target.problem.linearised(block.target.coordinates.to_natural(block.modes.z[:1]), sample)
    return float(np.sqrt((((sample.readings - line.tension)[sample.protocol.mask]) ** 2).mean()))


def _only(x: Expansion, m: int) -> Expansion:
    """The expansion with its first m signatures."""
    return replace(x, signatures=x.signatures[..., :m], one_sided=x.one_sided[:m])

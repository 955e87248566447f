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

from wirebayes.bayes.fit import seed_of
from wirebayes.discrepancy import choose, gap, gross, locate, power, screen
from wirebayes.discrepancy.block import Block, fitted
from wirebayes.discrepancy.choose import UNKNOWN_WEIGHT, Choice
from wirebayes.discrepancy.expansion import Expansion, Probe, Scan, expand, scan
from wirebayes.discrepancy.naming import probabilities
from wirebayes.discrepancy.outward import outward
from wirebayes.discrepancy.screen import Candidate, GlobalTest, Replicates
from wirebayes.discrepancy.sharing import informed
from wirebayes.effects import CATALOGUE
from wirebayes.effects.unknown import Discrepancy
from wirebayes.errors import InputError
from wirebayes.experiment import Experiment
from wirebayes.wire.effect import Effect, EventEffect
from wirebayes.wire.laws import ElasticLaw, History
from wirebayes.workers import Each

Array = NDArray[Any]
ALPHA = 0.04
PLAIN_TO_SEE = 0.002  # p of the linear scan at which no look from further out could change the verdict
ALPHA_AFTER = 0.03
KEEP_ELPD = 4.0
_WORTH_A_REFIT, _WORTH_ADDING = 1.3, 2.0  # log Bayes factors of a second effect: by scan, and refitted
_MOST_EFFECTS = 2
_NEAR, _MOST_COMPANY = 4.0, 2  # names this close to the best one are looked at again, so many
_LEFT_OVER = 8.0  # the most that a second effect may explain of what one unknown form leaves over beside a name
_RETESTS = 299


@dataclass(frozen=True)
class Settings:
    """What is asked.

    Attributes
    ----------
    law, history
        Of the plain model.
    kinds : mapping of name to effect class
        The catalogue searched.
    simulations : int
        Refitted data sets behind the p-value.
    """

    law: ElasticLaw = "hooke"
    history: History = "saturating"
    kinds: Mapping[str, type[Effect]] = None  # type: ignore[assignment]
    simulations: int = 999


@dataclass(frozen=True)
class Findings:
    """What was found in a file.

    Attributes
    ----------
    report : dict
        The content of ``discovery.json``.
    final : tuple of Block
        The samples of each material, gross errors struck out, with the effects that were accepted.
    """

    report: dict[str, Any]
    final: tuple[Block, ...]


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
    plain = list(each(fitted, groups.values(), repeat(()), *laws, rng.spawn(len(groups))))
    trials, candidates = screen.candidate_probes(plain, settings.kinds)
    if not candidates:
        raise InputError("no effect of the catalogue could show in these holds; at least one must be left to look for")
    struck: list[dict[str, Any]] = []
    for i, block in enumerate(plain):
        plain[i], gone = _strike_gross_errors(block, trials, candidates, i, settings, rng)
        struck += gone
    data, simulated, patterns, expansions = [], list[Replicates](), [], []
    for block in plain:
        listed, columns = locate.patterns(block.target.problem)
        x = expand(block.target, block.modes.z[:1], trials, columns=columns)
        expansions.append(x)
        data.append(scan(x))
        patterns.append(listed)
    of_each = repeat(trials), repeat(settings.simulations), rng.spawn(len(plain))
    for replicates in each(_simulated, plain, *of_each):
        simulated.append(replicates)
        report("simulations", len(simulated), len(plain))
    nulls = [s.scan for s in simulated]
    test = screen.global_test(candidates, data, nulls)
    further: dict[Candidate, float] = {}
    if test.p > max(PLAIN_TO_SEE, 1.0 / (1 + settings.simulations)):
        report("larger effects", 0, 1)
        test, further = outward(plain, trials, candidates, data, simulated, test, each)
        report("larger effects", 1, 1)
    where = [
        locate.findings(p, len(trials), d, n, ", ".join(b.names))
        for p, d, n, b in zip(patterns, data, nulls, plain, strict=True)
    ]
    if test.p > ALPHA:
        verdict, choice, accepted = "nothing-missing", None, list[_Accepted]()
        final = plain
    else:
        report("naming", 0, 1)
        choice = choose.choose(plain, trials, candidates, data, further, each)
        verdict, accepted, final, choice = _decide(plain, choice, settings, rng, each)
        for a in accepted:
            if len(a.effects) > 1 and settings.kinds[a.name].scope in screen.FILE_WIDE:
                final = informed(final, a.effects, rng)
        report("naming", 1, 1)
    ratios = [float(expand(f.target, f.modes.z[:1], []).ratio[0]) for f in final]
    alike = power.similarity([_only(x, len(trials)) for x in expansions], trials, ratios)
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
                "gross_errors": [g for g in struck if g["experiment"] == e.name],
            }
    report("held-out holds", len(plain), len(plain))
    return Findings({"version": 1, "experiments": out}, tuple(final))


@dataclass(frozen=True)
class Joint:
    """What is sampled at once: some experiments with some effects, and where the best parameters are, if known."""

    experiments: tuple[Experiment, ...]
    effects: tuple[Effect, ...] = ()
    near: dict[str, float] | None = None


def final_models(findings: Findings) -> list[Joint]:
    """The final model of every experiment.

    Samples of one material share what they are, and the amplitude of what was added. Where nothing was, each stands for
    itself; where what is missing has no name, with the flexible discrepancy.
    """
    out = []
    for block in findings.final:
        reports = [findings.report["experiments"][name] for name in block.names]
        if block.effects:
            out.append(Joint(block.experiments, block.effects, block.best))
            continue
        for e, report in zip(block.experiments, reports, strict=True):
            flexible = report["verdict"] == "unknown"
            effects = (_discrepancy(e, float(report["residual_rms_N"])),) if flexible else ()
            out.append(Joint((e,), effects, block.parameters(e.name)))
    return out


@dataclass(frozen=True)
class _Accepted:
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


def _simulated(block: Block, trials: list[Probe], n: int, rng: np.random.Generator) -> Replicates:
    return screen.replicated(block, trials, n, rng, locate.patterns(block.target.problem)[1])


def _strike_gross_errors(
    block: Block, trials: list[Probe], candidates: list[Candidate], i: int, settings: Settings, rng: np.random.Generator
) -> tuple[Block, list[dict[str, Any]]]:
    struck: list[dict[str, Any]] = []
    most = max(1, int(gross.MOST * gross.readings_of(block.experiments)))
    while len(struck) < most:
        own = [c for c in candidates if i in c.blocks]
        here = scan(expand(block.target, block.modes.z[:1], trials))
        rival = max((float(here.effects[0, c.probe]) for c in own), default=0.0)
        found = gross.suspect(block, max(rival, float(here.flexible[0])))
        if found is None:
            break
        name, hold, reading, value = found
        members = [gross.without(e, hold, reading) if e.name == name else e for e in block.experiments]
        block = fitted(members, (), settings.law, settings.history, rng)
        struck.append({"experiment": name, "hold": hold, "reading": reading, "log_bayes": value})
    return block, struck


def _decide(
    plain: list[Block], choice: Choice, settings: Settings, rng: np.random.Generator, each: Each
) -> tuple[str, list[_Accepted], list[Block], Choice]:
    """Verdict, accepted effects in order, final blocks, and the choice as revised by pairs of effects."""
    choice, added = _with_company(plain, choice, settings, rng, each)
    if choice.best == "unknown":
        return "unknown", [], plain, choice
    blocks, done, further = added[choice.best].blocks, [added[choice.best].accepted], added[choice.best].further
    while further is not None and len(done) < _MOST_EFFECTS:
        name = max(further.winners, key=further.log_bayes.__getitem__)
        if further.log_bayes[name] < _WORTH_ADDING:
            break
        more, extra = _add(blocks, further, name, settings, rng)
        after, before = ([version[b] for b in extra.blocks] for version in (more, blocks))
        elpd = [v.sum() for v in each(gap.leave_one_hold_out, after + before, rng.spawn(2 * len(after)))]
        if sum(elpd[: len(after)]) - sum(elpd[len(after) :]) <= KEEP_ELPD:
            break
        blocks, done = more, [*done, extra]
        further = _beside(blocks, settings, each)[0] if len(done) < _MOST_EFFECTS else None
    choice = _retested(blocks, choice, settings, rng, each)
    if choice.best == "unknown":
        return "unknown", [], plain, choice
    return "named" if choice.set == [choice.best] else "ambiguous", done, blocks, choice


@dataclass(frozen=True)
class _Added:
    """The blocks with a name in them, and what would come next: None where nothing has a chance."""

    blocks: list[Block]
    accepted: _Accepted
    further: Choice | None


def _beside(blocks: list[Block], settings: Settings, each: Each) -> tuple[Choice | None, float]:
    """What could be added to fitted blocks, if anything has a chance, and the flexible reference's evidence."""
    trials, candidates, scans = _scanned(blocks, settings)
    loose = choose.flexible_evidence(scans)
    if max((float(screen.log_bayes(c, scans)[0][0]) for c in candidates), default=-np.inf) < _WORTH_A_REFIT:
        return None, loose
    return choose.choose(blocks, trials, candidates, scans, each=each), loose


def _with_company(
    plain: list[Block], choice: Choice, settings: Settings, rng: np.random.Generator, each: Each
) -> tuple[Choice, dict[str, _Added]]:
    """The likeliest names once more, each together with a second effect, and together with the flexible reference.

    The best of the new choice, unless it is *unknown*, is among those added.

    A pair has prior odds of a tenth to one effect, shared by all second effects, and counts for the name. A name that
    needs the flexible reference beside it is only like what is missing: that counts for *unknown*. So does a small
    second effect, twice as much as for a pair: what a name leaves over of a form like it is small, a second effect of
    its own need not be.
    """
    names = sorted(choice.winners, key=lambda n: -choice.log_bayes[n])
    names = [n for n in names if choice.log_bayes[n] > choice.log_bayes[names[0]] - _NEAR][:_MOST_COMPANY]
    odds = np.log(0.1) - np.log(len(settings.kinds))
    evidence, unknown = dict(choice.log_bayes), choice.unknown
    known: dict[str, _Added] = {}
    with_one = each(_add, repeat(plain), repeat(choice), names, repeat(settings), rng.spawn(len(names)))
    for name, (blocks, accepted) in zip(names, with_one, strict=True):
        further, loose = _beside(blocks, settings, each)
        known[name] = _Added(blocks, accepted, further)
        beside = loose + np.log(0.5 / len(names))
        unknown = float(np.logaddexp(unknown, choice.log_bayes[name] + beside))
        if further is None:
            continue
        pair = max((further.log_bayes[n] for n in further.winners), default=-np.inf)
        evidence[name] = float(np.logaddexp(evidence[name], choice.log_bayes[name] + odds + pair))
        alike = choice.log_bayes[name] + odds + np.log(2.0) + min(pair, _LEFT_OVER)
        unknown = float(np.logaddexp(unknown, alike))
    return _weighed(replace(choice, log_bayes=evidence, unknown=unknown)), known


def _retested(
    blocks: list[Block], choice: Choice, settings: Settings, rng: np.random.Generator, each: Each
) -> Choice:
    """The global test again, with what was accepted inside: a name that leaves too much over gives way to *unknown*.

    At `ALPHA_AFTER` both are as likely; below it the odds grow as p to the power -0.8, the density that p has where
    more is missing than was added.
    """
    trials, candidates, scans = _scanned(blocks, settings)
    if not candidates:
        return choice
    simulated = each(screen.replicated, blocks, repeat(trials), repeat(_RETESTS), rng.spawn(len(blocks)))
    nulls = [s.scan for s in simulated]
    p = screen.global_test(candidates, scans, nulls).p
    if p > ALPHA_AFTER:
        return choice
    against = choice.log_bayes[choice.best] - 0.8 * np.log(p / ALPHA_AFTER)
    return _weighed(replace(choice, unknown=float(np.logaddexp(choice.unknown, against))))


def _scanned(blocks: list[Block], settings: Settings) -> tuple[list[Probe], list[Candidate], list[Scan]]:
    """What could be added to fitted blocks, and its linear scan on each."""
    trials, candidates = screen.candidate_probes(blocks, settings.kinds)
    return trials, candidates, [scan(expand(b.target, b.modes.z[:1], trials)) for b in blocks]


def _weighed(choice: Choice) -> Choice:
    """The probabilities of a choice whose evidence has changed."""
    shares = probabilities({n: choice.log_bayes[n] for n in choice.winners}, choice.unknown, UNKNOWN_WEIGHT)
    return replace(choice, shares=shares)


def _add(
    blocks: list[Block], choice: Choice, name: str, settings: Settings, rng: np.random.Generator
) -> tuple[list[Block], _Accepted]:
    """The blocks refitted with a name's best form."""
    out, effects = list(blocks), {}
    for b, r in choice.amplitudes(name).items():
        effects[b] = r.effect
        near = r.theta[r.blocks.index(b)]
        every = (*blocks[b].effects, r.effect)
        out[b] = fitted(blocks[b].experiments, every, settings.law, settings.history, rng, near)
    return out, _Accepted(name, tuple(effects), effects)


def _amplitude(final: Block, effect: Effect) -> dict[str, Any]:
    """Amplitude in the final model, by its normal approximation in the sampled coordinates."""
    main = effect.amplitudes[0]
    low, mean, high = map(float, final.along(effect, (-1.645, 0.0, 1.645)))
    hold = effect.hold if isinstance(effect, EventEffect) else None
    return {"mean": mean, "q05": low, "q95": high, "unit": main.unit, "hold": hold}


def _common(
    verdict: str, choice: Choice | None, affected: list[_Accepted], plain: list[Block], final: Block, i: int,
    p: float,
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
    block: Block, i: int, trials: list[Probe], candidates: list[Candidate], null: Scan, test: GlobalTest,
    settings: Settings, choice: Choice | None, verdict: str, alike: dict[tuple[str, str], float],
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
    block: Block, final: Block, verdict: str, rng: np.random.Generator, each: Each
) -> list[dict[str, Any]]:
    """Plain and final model on the last third of the holds, and by leaving out one hold at a time."""
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
    whole = list[Block]()
    if verdict == "unknown":
        n = len(train)
        first = [e.train(k) for e, k in zip(block.experiments, train, strict=True)]
        unnamed = list(each(_unnamed, repeat(block), [*block.experiments, *first], rng.spawn(2 * n)))
        alone, added = [(e,) for e in block.experiments], [(d,) for d in unnamed]
        whole += each(fitted, alone, added[:n], repeat(block.law), repeat(block.history), rng.spawn(n))
        asked += zip(alone, [(k,) for k in train], added[n:], repeat(block), strict=False)
    elif final.effects:
        asked.append((block.experiments, train, final.effects, final))
        whole.append(final)
    predicted = each(gap.held_out, *zip(*asked, strict=True), rng.spawn(len(asked)))
    left_out = each(gap.leave_one_hold_out, [block, *whole], rng.spawn(1 + len(whole)))  # at the same time
    plain, *parts = predicted
    better = [h for part in parts for h in part] or plain
    shrinks, loho = False, None
    if whole:
        without, *elpd = left_out
        difference = np.concatenate(elpd) - without
        se = float(difference.std(ddof=1) * np.sqrt(len(difference)))
        loho = {"elpd_difference": float(difference.sum()), "elpd_difference_se": se}
        shrinks = bool(difference.sum() > KEEP_ELPD and difference.sum() > 2 * se)
    out = []
    for a, b in zip(plain, better, strict=True):
        d = b.elpd - a.elpd
        out.append({
            "holds": a.holds,
            "plain": {"rmse_N": a.rmse_N, "elpd": float(a.elpd.sum()), "coverage_90": a.inside},
            "final": {"rmse_N": b.rmse_N, "elpd": float(b.elpd.sum()), "coverage_90": b.inside,
                      "elpd_difference_se": float(d.std(ddof=1) * np.sqrt(len(d))) if len(d) > 1 else None},
            "floor_N": float(np.sqrt(b.floor)),
            "gap_closed": gap.gap_closed(a, b) if whole else None,
            "leave_one_hold_out": loho,
            "shrinks": shrinks,
        })  # fmt: skip
    return out


def _unnamed(block: Block, experiment: Experiment, rng: np.random.Generator) -> Discrepancy:
    """A discrepancy as large as what the plain model, fitted to the experiment alone, leaves over in it."""
    plain = fitted([experiment], (), block.law, block.history, rng)
    return _discrepancy(experiment, _left_over(plain, experiment.name))


def _discrepancy(experiment: Experiment, size_N: float) -> Discrepancy:
    durations = [h.duration_s for h in experiment.recorded_holds]
    return Discrepancy(len(experiment.holds), size_N, float(np.median(durations)) or 1.0)


def _left_over(block: Block, name: str) -> float:
    """Root mean square of what the best parameters leave over in an experiment's readings, N."""
    sample = block.target.problem.samples[block.names.index(name)]
    line, _, _ = block.target.problem.linearised(block.target.coordinates.to_natural(block.modes.z[:1]), sample)
    return float(np.sqrt((((sample.readings - line.tension)[sample.protocol.mask]) ** 2).mean()))


def _only(x: Expansion, m: int) -> Expansion:
    """The expansion with its first m signatures."""
    return replace(x, signatures=x.signatures[..., :m], one_sided=x.one_sided[:m])

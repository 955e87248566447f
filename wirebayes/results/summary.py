"""The summary of a fit in JSON: parameters with intervals, what follows from them, and what is suspicious."""

import numpy as np

from wirebayes.inference.chain_statistics import bulk_ess, r_hat, tail_ess
from wirebayes.inference.fit import Fit
from wirebayes.json_files.hold_ends import HoldEnds
from wirebayes.json_files.summary import CREEP_TIMES_S, Derived, Mixed, Parameter, SummaryJson
from wirebayes.json_files.values import Statistics
from wirebayes.model.sample import Sample
from wirebayes.numeric.typing import Array
from wirebayes.result_warnings import Notice, NoticeJson, to_json
from wirebayes.results import hold_ends, posterior_checks
from wirebayes.results.contraction import interval
from wirebayes.results.identifiability import extrapolation, identifiability
from wirebayes.results.parameters import all_effects, length_of_creep_amount, unit_of, variables
from wirebayes.wire.fresh import FreshSample


def derived(wire: FreshSample, tension_N: float) -> Derived:
    """Quantities people compare: creep at a tension after some times and in the end, its speed, stiffness."""
    two_minutes, hour, day = wire.creep_mm(tension_N, np.array(list(CREEP_TIMES_S.values())))
    return {
        "tension_N": tension_N,
        "length_mm": wire.length_mm,
        "creep_2min_mm": band(two_minutes),
        "creep_1h_mm": band(hour),
        "creep_1day_mm": band(day),
        "final_creep_mm": band(wire.final_creep_mm(tension_N)),
        "median_creep_time_s": band(wire.median_creep_time_s(tension_N)),
        "stiffness_N": band(wire.stiffness_N(tension_N)),
    }


def band(values: Array) -> Statistics | None:
    """Mean, sd and quantiles of draws; None where a draw has no finite value (creep that never ends)."""
    if not np.isfinite(values).all():
        return None
    low, middle, high = interval(values)
    with np.errstate(over="ignore"):  # the square of a creep time that is all but endless
        sd = float(values.std(ddof=1))
    return {"mean": float(values.mean()), "sd": sd, "q05": low, "q50": middle, "q95": high}


def statistics(values: Array) -> Mixed:
    """Mean, sd, quantiles, effective sample sizes and R-hat of (chains, draws)."""
    low, middle, high = interval(values)
    with np.errstate(invalid="ignore"):
        return {
            "mean": float(values.mean()),
            "sd": float(values.std(ddof=1)),
            "q05": low,
            "q50": middle,
            "q95": high,
            "ess_bulk": bulk_ess(values),
            "ess_tail": tail_ess(values),
            "r_hat": r_hat(values),
        }


def _warnings(fit: Fit, sample: Sample | None, ends: HoldEnds | None) -> list[NoticeJson]:
    """Notices that the fit has not converged and of what is suspicious, with the experiment where there are several."""
    found = [] if fit.chains.converged else [Notice("not-converged", fit.chains.why)]
    copied = posterior_checks.copied_samples(fit.problem.samples)
    if sample is not None:
        found += [*copied.get(sample.name, ()), *posterior_checks.posterior_warnings(fit, sample)]
    else:
        for one in fit.problem.samples:
            own = [*copied.get(one.name, ()), *posterior_checks.posterior_warnings(fit, one)]
            found += [notice.of(one.name) for notice in own]
        found += posterior_checks.of_lengths(fit.problem, fit.flat)
    return to_json([*found, *hold_ends.hold_ends_notice(ends)])


def _hold_ends(fit: Fit) -> HoldEnds | None:
    best = fit.flat[int(fit.log_density.argmax())]
    return hold_ends.cost(fit.problem, best, fit.flat)


def summary_of(fit: Fit, sample: Sample | None) -> SummaryJson:
    """What ``summary.json`` says of a fit: of one of its samples, or, where None, of all together."""
    problem = fit.problem
    chains = fit.chains
    first = sample or problem.samples[0]
    model = first.model
    tension = first.tested_tension_N
    wire = FreshSample(problem.parameters(fit.flat, first), model, first.protocol.length_mm)
    ends = _hold_ends(fit)
    ahead = extrapolation(fit, tension, sample=problem.samples.index(first))
    return {
        "experiment": sample.name if sample else first.material.replace(" ", "-"),
        "B_length_mm": length_of_creep_amount(problem, sample),
        "likelihood": problem.likelihood,
        "elastic_law": model.law,
        "history": model.history,
        "effects": [effect.key for effect in all_effects([sample] if sample else problem.samples)],
        "converged": chains.converged,
        "convergence": chains.why,
        "warnings": _warnings(fit, sample, ends),
        "parameters": _parameters(fit, sample),
        "derived": derived(wire, tension),
        "longest_hold_s": float(first.protocol.duration_s.max()),
        "identifiability": identifiability(fit),
        "extrapolation": ahead.to_dict(),
        "hold_ends": ends,
        "likelihood_evaluations": chains.evaluations,
        "kept_evaluations": chains.kept_evaluations,
        "autocorrelation_steps": float(chains.autocorrelation_steps.max()),
        "smallest_ess": float(chains.ess.min()),
        "largest_nested_r_hat": float(chains.r_hat.max()),
        "acceptance": chains.acceptance,
        "learned_move": chains.learned,
        "modes_found": chains.modes,
    }


def _parameters(fit: Fit, sample: Sample | None) -> dict[str, Parameter]:
    """Every parameter with its unit; those that each sample has for itself, with the name of the sample."""
    samples = [sample] if sample else list(fit.problem.samples)
    effects = all_effects(samples)
    controls = [one.protocol.control for one in samples]
    parameters: dict[str, Parameter] = {}
    for name, values in variables(fit.problem, fit.theta, sample).items():
        if values.ndim == 2:
            parameters[name] = {"unit": unit_of(name, effects, controls), **statistics(values)}
            continue
        for i, (one, control) in enumerate(zip(samples, controls, strict=True)):
            unit = unit_of(name, effects, [control])
            parameters[f"{name}[{one.name}]"] = {"unit": unit, **statistics(values[..., i])}
    return parameters

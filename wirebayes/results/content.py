"""What ``posterior.nc`` holds of a fit: draws, readings, protocols, and what is needed to use them alone."""

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.random import Generator

from wirebayes._version import __version__
from wirebayes.inference.fit import Fit
from wirebayes.io.readings import READ, SET, UNIT
from wirebayes.model.problem import Problem
from wirebayes.model.replicate import readings as replicate
from wirebayes.model.sample import LENGTH_EXPONENT, Sample
from wirebayes.numeric.typing import Array, Ints
from wirebayes.results.netcdf import Group, Variable
from wirebayes.results.parameters import (
    all_effects,
    fixed_length_exponent,
    length_of_creep_amount,
    unit_of,
    variables,
)
from wirebayes.wire.protocol import Control, Protocol

_UNIT_IN_NAME = {unit: unit for unit in ("N", "mm", "s", "K")}  # the last part of the name of what was measured
_PREDICTIVE_DRAWS = 500  # a chain: predicted readings are many more numbers than parameters
READING, SETTING = "reading", "setting"  # of steps and weights together
_PRIOR_DRAWS = 2000  # a 5 % quantile is then one between 4.2 % and 5.8 %
_CHUNK = 2000  # draws at a time: bounds the memory


def groups_of(fit: Fit, sample: Sample | None, provenance: Mapping[str, Any], rng: Generator) -> dict[str, Group]:
    """The content of ``posterior.nc``: of one sample as if it stood alone, or of all samples.

    Parameters
    ----------
    sample : Sample or None
        None for all.
    provenance : mapping
        Stored as attributes.
    rng : numpy Generator
        Draws from the prior and of the predictive distribution.
    """
    members = list(fit.problem.samples) if sample is None else [sample]
    labels = _hold_coordinates(members, apart=sample is not None)
    groups = _of_parameters(fit, sample, members, rng) | _of_readings(fit, members, labels, rng)
    _label(groups, members)
    groups["constant_data"].attributes["reference_C"] = _listed(s.protocol.reference_C for s in members)
    groups["posterior"].attributes.update(_about(fit, members, provenance))
    return groups


def _of_readings(fit: Fit, members: Sequence[Sample], labels: dict[str, Variable], rng: Generator) -> dict[str, Group]:
    """Predicted and measured readings, how likely they are at every draw, and what was set."""
    chains, draws, d = fit.theta.shape
    kept = min(draws, _PREDICTIVE_DRAWS)
    few = np.unique(np.linspace(0, draws - 1, kept).astype(int))
    chosen = fit.theta[:, few].reshape(-1, d)
    replicated, measured = _replicated_and_measured(fit.problem, chosen, members, rng)
    predictive = _readings(members, replicated, (chains, len(few)))
    every_step = _steps(chains, np.arange(draws))
    return {
        "posterior_predictive": Group(predictive, labels | _steps(chains, few)),
        "log_likelihood": Group(_log_likelihood(fit, members), labels | every_step),
        "observed_data": Group(_readings(members, measured, ()), labels),
        "constant_data": Group(_protocols(members), labels),
    }


def _replicated_and_measured(
    problem: Problem, theta: Array, members: Sequence[Sample], rng: Generator
) -> tuple[dict[str, Array], dict[str, Array]]:
    """(n, H, R) readings of each sample at draws (n, d), and (1, H, R) what was read."""
    replicated = {}
    measured = {}
    for member in members:
        predicted = replicate(problem, theta, member, rng)
        replicated[member.name] = np.moveaxis(predicted, -1, 0)
        measured[member.name] = np.moveaxis(member.readings, -1, 0)
    return replicated, measured


def _of_parameters(fit: Fit, sample: Sample | None, members: Sequence[Sample], rng: Generator) -> dict[str, Group]:
    """Posterior and prior draws of the parameters, and the log density."""
    problem = fit.problem
    chains, draws, _ = fit.theta.shape
    prior = problem.prior.rvs(_PRIOR_DRAWS, rng)
    several = {}
    if sample is None:
        names = np.array([s.name for s in members])
        several["experiment"] = Variable(("experiment",), names)
    steps = _steps(chains, np.arange(draws))
    prior_steps = _steps(1, np.arange(_PRIOR_DRAWS))
    posterior_draws = _named(variables(problem, fit.theta, sample))
    prior_draws = _named(variables(problem, prior[None], sample))
    log_density = Variable(("chain", "draw"), fit.log_density)
    return {
        "posterior": Group(posterior_draws, steps | several),
        "sample_stats": Group({"lp": log_density}, dict(steps)),
        "prior": Group(prior_draws, prior_steps | several),
    }


def _named(values: Mapping[str, Array]) -> dict[str, Variable]:
    """Draws (chains, draws) of each parameter, or (chains, draws, experiments)."""
    axes = ("chain", "draw", "experiment")
    return {name: Variable(axes[: draws.ndim], draws) for name, draws in values.items()}


def _steps(chains: int, draws: Ints) -> dict[str, Variable]:
    """Coordinates of draws."""
    return {"chain": Variable(("chain",), np.arange(chains)), "draw": Variable(("draw",), draws)}


def _log_likelihood(fit: Fit, members: Sequence[Sample]) -> dict[str, Variable]:
    """Log density of each recorded hold given all others, at every draw."""
    chains, draws, _ = fit.theta.shape
    recorded = []
    for values, s in zip(_left_out(fit.problem, fit.flat), fit.problem.samples, strict=True):
        if s in members:
            recorded.append(values[s.protocol.recorded])
    holds = np.concatenate(recorded)
    densities = holds.T.reshape(chains, draws, -1)
    return {_name(members, READ, READING): Variable(("chain", "draw", "hold"), densities)}


def _label(groups: Mapping[str, Group], members: Sequence[Sample]) -> None:
    """Units of all variables."""
    effects = all_effects(members)
    controls = _controls(members)
    for kind, group in groups.items():
        for name in group.variables:
            if kind in ("posterior", "prior"):
                unit = unit_of(name, effects, controls)
            elif kind in ("log_likelihood", "sample_stats"):
                unit = "1"
            elif name in (READING, SETTING, "hold_mean", f"unrecorded_{SETTING}"):
                unit = "of the hold's control"
            else:
                unit = _UNIT_IN_NAME.get(name.rsplit("_", 1)[-1], "1")
            group.units[name] = unit


def _listed(values: Iterable[Any]) -> str:
    """A value of each experiment, as an attribute holds them."""
    return json.dumps(list(values))


def _about(fit: Fit, members: Sequence[Sample], provenance: Mapping[str, Any]) -> dict[str, Any]:
    """Attributes of the posterior: experiments, model, range of the readings, sampler."""
    first = members[0]
    model = first.model
    protocols = [s.protocol for s in members]
    tensions = [s.tensions_N for s in members]
    lowest = min(own.min() for own in tensions)
    highest = max(own.max() for own in tensions)
    longest = max(protocol.duration_s.max() for protocol in protocols)
    exponent = fixed_length_exponent(fit.problem, first)  # one that is estimated is among the draws
    return {
        "wirebayes_version": __version__,
        "inference_library": "emcee",
        "experiment": first.name,
        "experiments": _listed(s.name for s in members),
        "material": first.material,
        "length_mm": first.protocol.length_mm,
        "B_length_mm": length_of_creep_amount(fit.problem, members[0] if len(members) == 1 else None),
        "lengths_mm": _listed(protocol.length_mm for protocol in protocols),
        "controls": _listed(protocol.control for protocol in protocols),
        "resolutions": _listed(s.resolution for s in members),
        "elastic_law": model.law,
        "history": model.history,
        "likelihood": fit.problem.likelihood,
        **({} if exponent is None else {LENGTH_EXPONENT: float(exponent)}),
        "effects": _listed(effect.key for effect in all_effects(members)),
        "tension_ref_N": model.tension_ref_N,
        "typical_tension_N": model.typical.tension_N,
        "typical_hold_s": model.typical.hold_s,
        "tension_range_N": [float(lowest), float(highest)],
        "time_range_s": [0.0, float(longest)],
        "walkers": fit.chains.z.shape[2],
        "thin": fit.thin,
        "converged": int(fit.chains.converged),
        "provenance": json.dumps(dict(provenance)),
    }


def _hold_coordinates(members: Sequence[Sample], *, apart: bool) -> dict[str, Variable]:
    """Labels of the recorded holds: their numbers; of several experiments ``NAME:NUMBER``, one after the other.

    Unrecorded holds have no readings, so they are no part of this dimension: what is a missing value for one function
    of ArviZ is an observation for another.
    """
    protocols = [s.protocol for s in members]
    number = np.concatenate([protocol.number[protocol.recorded] for protocol in protocols])
    if apart or len(members) == 1:
        return {"hold": Variable(("hold",), number)}
    holds = [protocol.recorded.sum() for protocol in protocols]
    names = np.repeat([s.name for s in members], holds)
    labels = []
    for name, own in zip(names, number, strict=True):
        labels.append(f"{name}:{own}")
    return {
        "hold": Variable(("hold",), np.array(labels)),
        "experiment": Variable(("hold",), names),
        "number": Variable(("hold",), number),
    }


def _stacked(members: Sequence[Sample], values: Mapping[str, Array]) -> Array:
    """(n, holds, R) from (n, H, R) of each sample: recorded holds, one after the other, NaN where nothing was read."""
    width = max(s.protocol.time_s.shape[1] for s in members)
    rows = []
    for s in members:
        read = np.where(s.protocol.mask, values[s.name], np.nan)[:, s.protocol.recorded]
        rows.append(np.pad(read, [(0, 0), (0, 0), (0, width - read.shape[2])], constant_values=np.nan))
    return np.concatenate(rows, axis=1)


def _readings(members: Sequence[Sample], values: Mapping[str, Array], shape: tuple[int, ...]) -> dict[str, Variable]:
    """Readings of each hold, and their mean, which has the dimensions of the log-likelihood."""
    read = _stacked(members, values)
    counts = np.isfinite(read).sum(axis=2)
    means = np.where(counts > 0, np.nansum(read, axis=2) / np.maximum(counts, 1), np.nan)
    steps = ("chain", "draw") if shape else ()
    name = _name(members, READ, READING)
    mean_name = "hold_mean" if name == READING else f"hold_mean_{UNIT[name]}"
    _, holds, times = read.shape
    return {
        name: Variable((*steps, "hold", "time"), read.reshape(*shape, holds, times)),
        mean_name: Variable((*steps, "hold"), means.reshape(*shape, holds)),
    }


def _controls(members: Sequence[Sample]) -> list[Control]:
    return sorted({s.protocol.control for s in members})


def _name(members: Sequence[Sample], names: Mapping[Control, str], of_both: str) -> str:
    """The name of what was set or read; where steps and weights are stored together, one without a unit."""
    controls = _controls(members)
    return names[controls[0]] if len(controls) == 1 else of_both


def _protocols(members: Sequence[Sample]) -> dict[str, Variable]:
    """What was done: the recorded holds, and beside them the unrecorded ones, as an experiment file states them."""
    protocols = [s.protocol for s in members]
    recorded = _of_all(protocols, "recorded")
    set_as = _name(members, SET, SETTING)
    setting = _of_all(protocols, "setting")[recorded]
    duration = _of_all(protocols, "duration_s")[recorded]
    times = _stacked(members, {s.name: s.protocol.time_s[None] for s in members})[0]
    out = {
        set_as: Variable(("hold",), setting),
        "duration_s": Variable(("hold",), duration),
        "time_s": Variable(("hold", "time"), times),
    }
    if any(protocol.warming_K is not None for protocol in protocols):
        warming = _stacked(members, _warming(members))[0]
        out["warming_K"] = Variable(("hold", "time"), warming)
    if set_as == SETTING:
        control = [protocol.control for protocol in protocols]
        controls = np.repeat(control, _holds(protocols))
        out["control"] = Variable(("hold",), controls[recorded])
    if not recorded.all():
        for name, values in _unrecorded(members, set_as).items():
            out[name] = Variable(("unrecorded_hold",), values[~recorded])
    return out


def _warming(members: Sequence[Sample]) -> dict[str, Array]:
    """Warming of each test, (1, H, R); NaN where it was not logged."""
    warming = {}
    for s in members:
        values = np.full(s.protocol.time_s.shape, np.nan) if s.protocol.warming_K is None else s.protocol.warming_K
        warming[s.name] = values[None]
    return warming


def _of_all(protocols: Sequence[Protocol], field: str) -> Array:
    """Values of each hold, one test after the other."""
    return np.concatenate([getattr(protocol, field) for protocol in protocols])


def _holds(protocols: Sequence[Protocol]) -> list[int]:
    return [len(protocol.number) for protocol in protocols]


def _unrecorded(members: Sequence[Sample], set_as: str) -> dict[str, Array]:
    """What is stored of unrecorded holds, of every hold."""
    protocols = [s.protocol for s in members]
    following = [_following(protocol.number) for protocol in protocols]
    return {
        "unrecorded_experiment": np.repeat([s.name for s in members], _holds(protocols)),
        "unrecorded_before_hold": np.concatenate(following),
        f"unrecorded_{set_as}": _of_all(protocols, "setting"),
        "unrecorded_duration_s": _of_all(protocols, "duration_s"),
    }


def _following(number: Array) -> Array:
    """(H,) number of the next recorded hold; every test ends with one."""
    out = number.copy()
    for j in range(len(out) - 2, -1, -1):
        if out[j] < 0:
            out[j] = out[j + 1]
    return out


def _left_out(problem: Problem, theta: Array) -> list[Array]:
    """Per sample (H, n) log p(readings of a hold | those of all others, parameters), some draws at a time."""
    parts = [problem.leave_one_hold_out(theta[i : i + _CHUNK]) for i in range(0, len(theta), _CHUNK)]
    return [np.concatenate(holds, axis=1) for holds in zip(*parts, strict=True)]

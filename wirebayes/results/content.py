"""What ``posterior.nc`` holds of a fit: draws, readings, protocols, and what is needed to use them alone."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.random import Generator

from wirebayes._version import __version__
from wirebayes.inference.fit import Fit
from wirebayes.io.readings import READ, SET, UNIT
from wirebayes.model.problem import Problem
from wirebayes.model.replicate import readings as replicate
from wirebayes.model.sample import Sample
from wirebayes.numeric.typing import Array, Ints
from wirebayes.results.netcdf import Group, Variable
from wirebayes.results.parameters import unit_of, variables
from wirebayes.wire.protocol import Control

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
    problem, (m, draws, _) = fit.problem, fit.theta.shape
    members = list(problem.samples) if sample is None else [sample]
    few = np.unique(np.linspace(0, draws - 1, min(draws, _PREDICTIVE_DRAWS)).astype(int))
    chosen = fit.theta[:, few].reshape(-1, fit.theta.shape[-1])
    groups = _of_parameters(fit, sample, members, rng)
    replicated = {s.name: np.moveaxis(replicate(problem, chosen, s, rng), -1, 0) for s in members}
    labels = _hold_coordinates(members, apart=sample is not None)
    measured = {s.name: np.moveaxis(s.readings, -1, 0) for s in members}
    groups |= {
        "posterior_predictive": Group(_readings(members, replicated, (m, len(few))), labels | _steps(m, few)),
        "log_likelihood": Group(_log_likelihood(fit, members), labels | _steps(m, np.arange(draws))),
        "observed_data": Group(_readings(members, measured, ()), labels),
        "constant_data": Group(_protocols(members), labels),
    }
    _label(groups, fit, members, provenance)
    return groups


def _of_parameters(fit: Fit, sample: Sample | None, members: Sequence[Sample], rng: Generator) -> dict[str, Group]:
    """Posterior and prior draws of the parameters, and the log density."""
    problem, (m, draws, _) = fit.problem, fit.theta.shape
    prior = problem.prior.rvs(_PRIOR_DRAWS, rng)
    experiments = Variable(("experiment",), np.array([s.name for s in members]))

    def group(variables: Mapping[str, Array], steps: dict[str, Variable]) -> Group:
        axes = ("chain", "draw", "experiment")
        named = {name: Variable(axes[: values.ndim], values) for name, values in variables.items()}
        return Group(named, steps | ({} if sample else {"experiment": experiments}))

    return {
        "posterior": group(variables(problem, fit.theta, sample), _steps(m, np.arange(draws))),
        "sample_stats": Group({"lp": Variable(("chain", "draw"), fit.log_density)}, _steps(m, np.arange(draws))),
        "prior": group(variables(problem, prior[None], sample), _steps(1, np.arange(_PRIOR_DRAWS))),
    }


def _steps(chains: int, draws: Ints) -> dict[str, Variable]:
    """Coordinates of draws."""
    return {"chain": Variable(("chain",), np.arange(chains)), "draw": Variable(("draw",), draws)}


def _log_likelihood(fit: Fit, members: Sequence[Sample]) -> dict[str, Variable]:
    """Log density of each recorded hold given all others, at every draw."""
    m, draws, _ = fit.theta.shape
    samples = zip(_left_out(fit.problem, fit.flat), fit.problem.samples, strict=True)
    holds = np.concatenate([values[s.protocol.recorded] for values, s in samples if s in members])
    return {_name(members, READ, READING): Variable(("chain", "draw", "hold"), holds.T.reshape(m, draws, -1))}


def _label(groups: Mapping[str, Group], fit: Fit, members: Sequence[Sample], provenance: Mapping[str, Any]) -> None:
    """Units of all variables, and what is needed to use the posterior without its experiment file."""
    effects, controls = members[0].model.effects, _controls(members)
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
    groups["constant_data"].attributes["reference_C"] = json.dumps([s.protocol.reference_C for s in members])
    groups["posterior"].attributes.update(_about(fit, members, provenance))


def _about(fit: Fit, members: Sequence[Sample], provenance: Mapping[str, Any]) -> dict[str, Any]:
    """Attributes of the posterior: experiments, model, range of the readings, sampler."""
    first = members[0]
    loads = [s.tensions_N for s in members]
    return {
        "wirebayes_version": __version__,
        "inference_library": "emcee",
        "experiment": first.name,
        "experiments": json.dumps([s.name for s in members]),
        "material": first.material,
        "length_mm": first.protocol.length_mm,
        "lengths_mm": json.dumps([s.protocol.length_mm for s in members]),
        "controls": json.dumps([s.protocol.control for s in members]),
        "resolutions": json.dumps([s.resolution for s in members]),
        "elastic_law": first.model.law,
        "history": first.model.history,
        "likelihood": fit.problem.likelihood,
        "effects": json.dumps([e.key for e in first.model.effects]),
        "tension_ref_N": first.model.tension_ref_N,
        "tension_range_N": [float(min(t.min() for t in loads)), float(max(t.max() for t in loads))],
        "time_range_s": [0.0, float(max(s.protocol.duration_s.max() for s in members))],
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
    number = np.concatenate([s.protocol.number[s.protocol.recorded] for s in members])
    if apart or len(members) == 1:
        return {"hold": Variable(("hold",), number)}
    names = np.repeat([s.name for s in members], [s.protocol.recorded.sum() for s in members])
    labels = np.array([f"{name}:{n}" for name, n in zip(names, number, strict=True)])
    each = {"hold": labels, "experiment": names, "number": number}
    return {name: Variable(("hold",), values) for name, values in each.items()}


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
    read, first = _stacked(members, values), ("chain", "draw") if shape else ()
    name = _name(members, READ, READING)
    mean = "hold_mean" if name == READING else f"hold_mean_{UNIT[name]}"
    return {
        name: Variable((*first, "hold", "time"), read.reshape(*shape, *read.shape[1:])),
        mean: Variable((*first, "hold"), np.nanmean(read, axis=2).reshape(*shape, read.shape[1])),
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
    recorded = np.concatenate([p.recorded for p in protocols])

    def each(field: str) -> Array:
        return np.concatenate([getattr(p, field) for p in protocols])

    set_as = _name(members, SET, SETTING)
    times = {s.name: s.protocol.time_s[None] for s in members}
    out = {
        set_as: Variable(("hold",), each("setting")[recorded]),
        "duration_s": Variable(("hold",), each("duration_s")[recorded]),
        "time_s": Variable(("hold", "time"), _stacked(members, times)[0]),
    }
    if any(p.warming_K is not None for p in protocols):
        warming = {
            s.name: (np.nan if p.warming_K is None else p.warming_K) + 0.0 * times[s.name]
            for s, p in zip(members, protocols, strict=True)
        }
        out["warming_K"] = Variable(("hold", "time"), _stacked(members, warming)[0])
    if set_as == SETTING:
        controls = np.concatenate([np.full(len(p.number), p.control) for p in protocols])
        out["control"] = Variable(("hold",), controls[recorded])
    if not recorded.all():
        following = np.concatenate([_following(p.number) for p in protocols])
        names = np.repeat([s.name for s in members], [len(p.number) for p in protocols])
        unrecorded = {
            "unrecorded_experiment": names,
            "unrecorded_before_hold": following,
            f"unrecorded_{set_as}": each("setting"),
            "unrecorded_duration_s": each("duration_s"),
        }
        out |= {name: Variable(("unrecorded_hold",), values[~recorded]) for name, values in unrecorded.items()}
    return out


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

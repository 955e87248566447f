"""Results on disk: netCDF that ArviZ reads, and a summary in JSON. The only module that knows xarray and ArviZ."""

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import arviz_base
import arviz_stats
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from wirebayes import __version__
from wirebayes.bayes.fit import Fit
from wirebayes.bayes.identifiability import extrapolation, identifiability, told
from wirebayes.bayes.prior import Prior
from wirebayes.bayes.problem import LENGTH_EXPONENT, Problem, Sample, at_length
from wirebayes.bayes.replicate import readings as replicate
from wirebayes.bayes.stored_check import check
from wirebayes.effects import catalogue, named
from wirebayes.errors import InputError
from wirebayes.interrupt import unfinished
from wirebayes.output import stored_results, write_bytes, write_json
from wirebayes.wire.effect import Effect
from wirebayes.wire.fresh import FreshSample
from wirebayes.wire.protocol import Protocol
from wirebayes.wire.staircase import Model

Array = NDArray[Any]
UNITS = {"k1": "N", "B": "mm N^-U", "U": "1", "k2": "s^-N", "N": "1", "preload": "mm", "sensor_sd": "N",
         "setting_sd": "mm", LENGTH_EXPONENT: "1"}  # fmt: skip
CREEP_TIMES_S = {"creep_2min_mm": 120.0, "creep_1h_mm": 3600.0, "creep_1day_mm": 86400.0}
_PREDICTIVE_DRAWS = 500


def save(
    fit: Fit, folder: Path, provenance: Mapping[str, Any], *, seed: int = 0, sample: Sample | None = None
) -> dict[str, Any]:
    """Write ``posterior.nc`` and ``summary.json`` into an existing folder and return the summary.

    Parameters
    ----------
    fit : Fit
    folder : Path
    provenance : mapping
        Data hash, configuration, seed: stored as attributes.
    seed : int
        For the draws of the predictive and prior groups.
    sample : Sample, optional
        Store the parameters of this sample alone, under their plain names; otherwise all samples, with a dimension
        ``experiment``. A problem of one sample needs none.
    """
    if sample is None and len(fit.problem.samples) == 1:
        sample = fit.problem.samples[0]
    tree = _tree(fit, sample, provenance, np.random.default_rng(seed))
    partial = folder / ".posterior.nc.partial"
    with unfinished(partial):
        tree.to_netcdf(partial, engine="h5netcdf")
        write_bytes(folder / "posterior.nc", partial.read_bytes())
        partial.unlink()
    summary = _summary(fit, sample, tree)
    write_json(folder / "summary.json", summary)
    return summary


@dataclass(frozen=True)
class Stored:
    """A posterior read back.

    Attributes
    ----------
    draws : dict of name to (n,) array
        Parameters of one experiment, at its own length.
    sample : Sample
        Its holds and readings, law, history and effects.
    likelihood : {"chain", "hold"}
    length_exponent : (n,) array or None
        Where samples of two lengths were fitted together: creep grows as length to this power.
    """

    draws: dict[str, Array]
    sample: Sample
    likelihood: str
    length_exponent: Array | None = None

    @property
    def problem(self) -> Problem:
        """A problem whose columns are the stored draws (its prior is not known any more)."""
        model = Model(self.sample.model.law, self.sample.model.history, self.sample.model.effects,
                      self.sample.model.tension_ref_N)  # fmt: skip
        names: dict[str, Any] = dict.fromkeys(self.draws)
        return Problem(
            (Sample(self.sample.name, self.sample.material, self.sample.protocol, self.sample.readings,
                    self.sample.resolution_N, model),),
            Prior(names, {}, frozenset()),
            self.likelihood,  # type: ignore[arg-type]
        )  # fmt: skip

    @property
    def theta(self) -> Array:
        """(n, d) draws in the problem's order."""
        return np.column_stack(list(self.draws.values()))


def experiments_in(path: Path) -> tuple[str, ...]:
    """The experiments whose posterior a ``posterior.nc`` of ours holds; an `InputError` where it is none."""
    with _opened(path) as tree:
        return tuple(str(name) for name in json.loads(tree["posterior"].attrs["experiments"]))


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """The tree of a ``posterior.nc``; whatever is wrong with it is an `InputError`."""
    with stored_results(path), xr.open_datatree(path, engine="h5netcdf") as tree:
        yield tree


def load(folder: Path, experiment: str | None = None, own_effects: Path | None = None) -> Stored:
    """Read the posterior of one experiment from a folder that `save` wrote.

    Parameters
    ----------
    folder : Path
        Holds ``posterior.nc``.
    experiment : str, optional
        Which sample, where several were fitted together.
    own_effects : Path, optional
        The user's Python file of effects, where the fit used one of them.

    Raises
    ------
    InputError
        No posterior there, not one of ours, or the experiment is not in it.
    """
    path = folder / "posterior.nc"
    if not path.is_file():
        raise InputError(f"{path}: no such file, expected the posterior of a fit")
    with _opened(path) as tree:
        about, constant = tree["posterior"].attrs, tree["constant_data"].to_dataset()
        if "wirebayes_version" not in about:
            raise InputError(f"{path}: not a posterior of wirebayes")
        posterior, observed = tree["posterior"].to_dataset(), tree["observed_data"].to_dataset()
        names = json.loads(about["experiments"])
        if experiment is None and len(names) > 1:
            raise InputError(f"{path}: holds {', '.join(names)}; say which with --experiment")
        if experiment is not None and experiment not in names:
            raise InputError(f"--experiment {experiment}: not in {path}; it holds {', '.join(names)}")
        at = names.index(experiment or names[0])
        if "experiment" in constant.dims:
            posterior = posterior.isel(experiment=at) if "experiment" in posterior.dims else posterior
            constant, observed = constant.isel(experiment=at), observed.isel(experiment=at)
        draws = {str(n): np.ascontiguousarray(v.values.reshape(-1)) for n, v in posterior.data_vars.items()}
        lengths = json.loads(about["lengths_mm"])
        keys, known = json.loads(about["effects"]), catalogue(own_effects)
        model = Model(about["elastic_law"], about["history"], tuple(named(k, known) for k in keys),
                      float(about["tension_ref_N"]))  # fmt: skip
        exponent = draws.pop(LENGTH_EXPONENT, None)
        if len(names) > 1:
            reference = float(np.exp(np.mean(np.log(lengths))))
            draws = at_length(draws, model.effects, lengths[at] / reference, 1.0 if exponent is None else exponent)
            draws = _by_length(draws, model.effects, lengths[at], reference)
        if "reference_C" not in constant.attrs:
            raise InputError(f"{path}: written by an older wirebayes, expected a posterior of this version; fit again")
        reference_C = json.loads(constant.attrs["reference_C"])[at]
        here = constant["held"].values.astype(bool)
        protocol = Protocol(
            float(lengths[at]),
            constant["displacement_mm"].values[here],
            constant["time_s"].values[here],
            constant["mask"].values[here].astype(bool),
            constant["duration_s"].values[here],
            constant["number"].values[here].astype(np.int64),
            None if reference_C is None else constant["warming_K"].values[here],
            reference_C,
        )
        tension = np.nan_to_num(observed["tension_N"].values[here])[..., None]
        resolutions = json.loads(about["resolutions_N"])
        sample = Sample(names[at], about["material"], protocol, tension, float(resolutions[at]), model)
        check(draws, sample, about["likelihood"])
        return Stored(draws, sample, about["likelihood"], exponent)


def prior_draws(folder: Path, experiment: str | None = None) -> dict[str, Array]:
    """What was believed before the fit: draws of the prior of one experiment's parameters, each (n,)."""
    path = folder / "posterior.nc"
    with _opened(path) as tree:
        prior, names = tree["prior"].to_dataset(), json.loads(tree["posterior"].attrs["experiments"])
        if "experiment" in prior.dims:
            prior = prior.isel(experiment=names.index(experiment or names[0]))
        return {str(name): values.values.reshape(-1) for name, values in prior.data_vars.items()}


def _tree(fit: Fit, sample: Sample | None, provenance: Mapping[str, Any], rng: np.random.Generator) -> Any:
    problem, (m, draws, _) = fit.problem, fit.theta.shape
    together = sample is None
    samples = problem.samples if together else (sample,)
    assert samples[0] is not None
    members = [s for s in samples if s is not None]
    holds = max(len(s.protocol.displacement_mm) for s in members)
    width = max(s.protocol.time_s.shape[1] for s in members)

    def laid(values: list[Array]) -> Array:
        """Per-sample arrays (H, ..., rest) padded and stacked; without the first axis for a single sample."""
        return np.stack(values) if together else values[0]

    def padded(array: Array, fill: float = 0.0, *, timed: bool = False) -> Array:
        """(H, ...) grown to all holds, and with `timed` (H, R, ...) to all reading times too."""
        grow = [(0, holds - array.shape[0])]
        if timed:
            grow.append((0, width - array.shape[1]))
        return np.pad(array.astype(float), grow + [(0, 0)] * (array.ndim - len(grow)), constant_values=fill)

    flat = fit.flat
    if together:
        variables = _together_variables(problem, fit.theta)
    else:
        variables = {k: v.reshape(m, draws) for k, v in _own(problem, flat, members[0]).items()}
    per_hold = problem.hold_log_likelihood(flat)
    order = [i for i, s in enumerate(problem.samples) if s in members]
    likelihood = np.moveaxis(laid([padded(per_hold[i]) for i in order]), -1, 0).reshape(
        m, draws, *([len(members)] if together else []), holds
    )
    few = np.linspace(0, draws - 1, min(draws, _PREDICTIVE_DRAWS)).astype(int)
    chosen = fit.theta[:, few].reshape(-1, fit.theta.shape[-1])
    predicted = np.moveaxis(laid([padded(replicate(problem, chosen, s, rng), timed=True) for s in members]), -1, 0)
    predicted = predicted.reshape(m, len(few), *predicted.shape[1:])
    prior = problem.prior.rvs(2000, rng)
    prior_variables = (
        _together_variables(problem, prior[None])
        if together
        else {k: v[None] for k, v in _own(problem, prior, members[0]).items()}
    )
    constant: dict[str, Array] = {
        "displacement_mm": laid([padded(s.protocol.displacement_mm) for s in members]),
        "duration_s": laid([padded(s.protocol.duration_s) for s in members]),
        "number": laid([padded(s.protocol.number.astype(float), -1.0) for s in members]),
        "held": laid([padded(np.ones(len(s.protocol.displacement_mm))) for s in members]),
        "time_s": laid([padded(s.protocol.time_s, timed=True) for s in members]),
        "mask": laid([padded(s.protocol.mask, timed=True) for s in members]),
    }
    if any(s.protocol.warming_K is not None for s in members):
        constant["warming_K"] = laid(
            [
                padded(
                    np.zeros_like(s.protocol.time_s) if s.protocol.warming_K is None else s.protocol.warming_K,
                    timed=True,
                )
                for s in members
            ]  # fmt: skip
        )
    observed = laid(
        [padded(np.where(s.protocol.mask, s.readings[..., 0], np.nan), np.nan, timed=True) for s in members]
    )
    first = ["experiment"] if together else []
    hold_time, only_hold = [*first, "hold", "time"], [*first, "hold"]
    dims = {"displacement_mm": only_hold, "duration_s": only_hold, "number": only_hold, "held": only_hold,
            "time_s": hold_time, "mask": hold_time, "warming_K": hold_time, "tension_N": hold_time}  # fmt: skip
    dims |= {name: ["experiment"] for name, v in variables.items() if v.ndim > 2}
    coords: dict[str, Any] = {"experiment": [s.name for s in members]} if together else {}
    tree = arviz_base.from_dict(
        {
            "posterior": variables,
            "sample_stats": {"lp": fit.log_density},
            "posterior_predictive": {"tension_N": predicted},
            "observed_data": {"tension_N": observed},
            "constant_data": constant,
            "prior": prior_variables,
        },
        dims=dims,
        coords=coords,
    )
    tree["log_likelihood"] = xr.DataTree(
        xr.Dataset(
            {"tension_N": (("chain", "draw", *only_hold), likelihood)},
            coords={"chain": range(m), "draw": range(draws)} | coords,
        )
    )
    about = {
        "wirebayes_version": __version__,
        "inference_library": "emcee",
        "experiment": members[0].name,
        "experiments": json.dumps([s.name for s in members]),
        "material": members[0].material,
        "length_mm": members[0].protocol.length_mm,
        "lengths_mm": json.dumps([s.protocol.length_mm for s in members]),
        "resolutions_N": json.dumps([s.resolution_N for s in members]),
        "elastic_law": members[0].model.law,
        "history": members[0].model.history,
        "likelihood": problem.likelihood,
        "effects": json.dumps([e.key for e in members[0].model.effects]),
        "tension_ref_N": members[0].model.tension_ref_N,
        "tension_range_N": [float(np.min([s.readings[..., 0][s.protocol.mask].min() for s in members])),
                            float(np.max([s.readings[..., 0][s.protocol.mask].max() for s in members]))],
        "time_range_s": [0.0, float(max(s.protocol.duration_s.max() for s in members))],
        "walkers": fit.chains.z.shape[2],
        "thin": fit.thin,
        "converged": int(fit.chains.converged),
        "provenance": json.dumps(dict(provenance)),
    }  # fmt: skip
    for group in ("posterior", "prior"):
        tree[group].attrs.clear()
        for name, variable in tree[group].data_vars.items():
            variable.attrs["units"] = unit_of(str(name), members[0].model.effects)
    tree["constant_data"].attrs["reference_C"] = json.dumps([s.protocol.reference_C for s in members])
    tree["posterior"].attrs.update(about)
    tree.attrs.update({k: about[k] for k in ("wirebayes_version", "inference_library", "provenance")})
    return tree


def _own(problem: Problem, theta: Array, sample: Sample) -> dict[str, Array]:
    """A sample's parameters as they are at its own length, with which it can stand alone."""
    reference = sample.model.length_ref_mm or sample.protocol.length_mm
    return _by_length(problem.parameters(theta, sample), sample.model.effects, sample.protocol.length_mm, reference)


def _by_length(
    own: dict[str, Array], effects: Sequence[Effect], length_mm: float, reference_mm: float
) -> dict[str, Array]:
    """Parameters that depend on the length as they are at this one: alone, a sample has no other to compare with."""
    hold: Any = SimpleNamespace(length_mm=length_mm, length_ref_mm=reference_mm)
    out: Any = own
    for effect in (e for e in effects if e.compares_lengths):
        amplitudes = {a.name: own[c] for a, c in zip(effect.amplitudes, effect.columns(), strict=True)}
        out = effect.apply(out, amplitudes, hold)
    return dict(out)


def _together_variables(problem: Problem, theta: Array) -> dict[str, Array]:
    """Columns under their plain names; those of one sample each stacked along a last axis."""
    out: dict[str, Any] = {}
    for i, name in enumerate(problem.names):
        plain = name.split("[")[0]
        if plain == name:
            out[plain] = theta[..., i]
        else:
            out.setdefault(plain, []).append(theta[..., i])
    return {name: np.stack(v, axis=-1) if isinstance(v, list) else v for name, v in out.items()}


def unit_of(name: str, effects: tuple[Effect, ...] = ()) -> str:
    """Unit of a parameter."""
    units = UNITS | {c: a.unit for e in effects for c, a in zip(e.columns(), e.amplitudes, strict=True)}
    return units.get(name, "1")


def derived(wire: FreshSample, tension_N: float) -> dict[str, Array]:
    """Quantities people compare, per draw: creep at a tension after some times and in the end, its speed, stiffness."""
    creep = wire.creep_mm(tension_N, np.array(list(CREEP_TIMES_S.values())))
    return {
        **dict(zip(CREEP_TIMES_S, creep, strict=True)),
        "final_creep_mm": wire.final_creep_mm(tension_N),
        "median_creep_time_s": wire.median_creep_time_s(tension_N),
        "stiffness_N": wire.stiffness_N(tension_N),
    }


def band(values: Array) -> dict[str, float] | None:
    """Mean, sd and quantiles of draws; None where a draw has no finite value (creep that never ends)."""
    if not np.isfinite(values).all():
        return None
    low, middle, high = (float(q) for q in np.quantile(values, [0.05, 0.5, 0.95]))
    return {"mean": float(values.mean()), "sd": float(values.std(ddof=1)), "q05": low, "q50": middle, "q95": high}


def statistics(values: Array) -> dict[str, float]:
    """Mean, sd, quantiles, effective sample sizes and R-hat of (chains, draws)."""
    q05, q50, q95 = np.quantile(values, [0.05, 0.5, 0.95])
    with np.errstate(invalid="ignore"):
        return {
            "mean": float(values.mean()), "sd": float(values.std(ddof=1)),
            "q05": float(q05), "q50": float(q50), "q95": float(q95),
            "ess_bulk": float(arviz_stats.ess(values, method="bulk")),
            "ess_tail": float(arviz_stats.ess(values, method="tail", prob=(0.05, 0.95))),
            "r_hat": float(arviz_stats.rhat(values)),
        }  # fmt: skip


def _summary(fit: Fit, sample: Sample | None, tree: Any) -> dict[str, Any]:
    first = sample or fit.problem.samples[0]
    parameters: dict[str, Any] = {}
    for name, variable in tree["posterior"].data_vars.items():
        if variable.ndim == 2:
            parameters[str(name)] = statistics(variable.values)
        else:
            for i, s in enumerate(fit.problem.samples):
                parameters[f"{name}[{s.name}]"] = statistics(variable.values[..., i])
    tension = round(first.model.tension_ref_N, 3)
    wire = FreshSample(fit.problem.parameters(fit.flat, first), first.model, first.protocol.length_mm)
    quantities = {key: band(value) for key, value in derived(wire, tension).items()}
    chains = fit.chains
    return {
        "experiment": sample.name if sample else first.material.replace(" ", "-"),
        "likelihood": fit.problem.likelihood,
        "elastic_law": first.model.law,
        "history": first.model.history,
        "effects": [e.key for e in first.model.effects],
        "converged": chains.converged,
        "convergence": chains.why,
        "parameters": parameters,
        "derived": {"tension_N": tension, **quantities},
        "identifiability": told(identifiability(fit)),
        "extrapolation": extrapolation(fit, tension, sample=fit.problem.samples.index(first)).told(),
        "likelihood_evaluations": chains.evaluations,
        "kept_evaluations": chains.kept_evaluations,
        "autocorrelation_steps": float(chains.autocorrelation_steps.max()),
        "smallest_ess": float(chains.ess.min()),
        "largest_nested_r_hat": float(chains.r_hat.max()),
        "acceptance": chains.acceptance,
        "learned_move": chains.learned,
        "modes_found": chains.modes,
    }

"""Results on disk: netCDF that ArviZ reads, and a summary in JSON. The only module that makes objects of xarray."""

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wirebayes._version import __version__
from wirebayes.effects import catalogue, named
from wirebayes.errors import InputError
from wirebayes.inference.chain_statistics import bulk_ess, r_hat, tail_ess
from wirebayes.inference.fit import Fit
from wirebayes.io.readings import READ, SET, UNIT
from wirebayes.io.run_folder import read_json, stored_results, write_bytes, write_json
from wirebayes.json_files.hold_ends import HoldEnds
from wirebayes.json_files.summary import Derived, Mixed, Parameter, SummaryJson
from wirebayes.json_files.values import UNITS, Statistics
from wirebayes.model.prior import Prior
from wirebayes.model.problem import LENGTH_EXPONENT, Problem, Sample, at_length
from wirebayes.model.replicate import readings as replicate
from wirebayes.notice import Notice, NoticeJson, to_json
from wirebayes.numeric.typing import Array
from wirebayes.results import hold_ends, netcdf, posterior_checks
from wirebayes.results.identifiability import extrapolation, identifiability
from wirebayes.results.netcdf import Group, Variable
from wirebayes.results.stored_check import check
from wirebayes.wire.control import READ_UNIT, SET_UNIT
from wirebayes.wire.effect import Effect
from wirebayes.wire.fresh import FreshSample
from wirebayes.wire.model import Model
from wirebayes.wire.protocol import Control, Protocol

if TYPE_CHECKING:
    import xarray as xr

# a hold of the paper, and what a robot on the wire works through
CREEP_TIMES_S = {"creep_2min_mm": 120.0, "creep_1h_mm": 3600.0, "creep_1day_mm": 86400.0}
_UNIT_IN_NAME = {unit: unit for unit in ("N", "mm", "s", "K")}  # the last part of the name of what was measured
_PREDICTIVE_DRAWS = 500  # a chain: predicted readings are many more numbers than parameters
_READING, _SETTING = "reading", "setting"  # of steps and weights together
_MODEL = ("posterior", "observed_data", "constant_data")  # groups that say what was fitted, and the draws
_PRIOR_DRAWS = 2000  # a 5 % quantile is then one between 4.2 % and 5.8 %
_CHUNK = 2000  # draws at a time: bounds the memory


def save(
    fit: Fit, folder: Path, provenance: Mapping[str, Any], *, seed: int = 0, sample: Sample | None = None
) -> SummaryJson:
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
    alone = _alone(fit, sample)
    groups = _groups(fit, alone, provenance, np.random.default_rng(seed))
    about = groups["posterior"].attributes
    whole = {key: about[key] for key in ("wirebayes_version", "inference_library", "provenance")}
    write_bytes(folder / "posterior.nc", netcdf.content(groups, whole))
    return save_summary(fit, folder, sample=sample)


def save_summary(fit: Fit, folder: Path, *, sample: Sample | None = None) -> SummaryJson:
    """Write ``summary.json`` alone, the same as `save` does, and return it.

    Parameters
    ----------
    fit : Fit
    folder : Path
    sample : Sample, optional
        See `save`.
    """
    summary = _summary(fit, _alone(fit, sample))
    write_json(folder / "summary.json", summary)
    return summary


def _alone(fit: Fit, sample: Sample | None) -> Sample | None:
    """The sample that is stored under plain names; None where several are stored together."""
    return fit.problem.samples[0] if sample is None and len(fit.problem.samples) == 1 else sample


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
    doubts : tuple of Notice
        What the fit itself says against using it: that it has not converged, that its model failed the check.
    """

    draws: dict[str, Array]
    sample: Sample
    likelihood: str
    length_exponent: Array | None = None
    doubts: tuple[Notice, ...] = ()

    @property
    def problem(self) -> Problem:
        """A problem whose columns are the stored draws (its prior is not known any more)."""
        model = Model(self.sample.model.law, self.sample.model.history, self.sample.model.effects,
                      self.sample.model.tension_ref_N)  # fmt: skip
        names: dict[str, Any] = dict.fromkeys(self.draws)
        return Problem(
            (Sample(self.sample.name, self.sample.material, self.sample.protocol, self.sample.readings,
                    self.sample.resolution, model),),
            Prior(names, {}, frozenset()),
            self.likelihood,  # type: ignore[arg-type]
        )  # fmt: skip

    @property
    def theta(self) -> Array:
        """(n, d) draws in the problem's order."""
        return np.column_stack(list(self.draws.values()))


def experiments_in(path: Path) -> tuple[str, ...]:
    """The experiments whose posterior a ``posterior.nc`` of ours holds; an `InputError` where it is none."""
    with _opened(path, "posterior") as groups:
        return tuple(str(name) for name in json.loads(groups["posterior"].attributes["experiments"]))


@contextmanager
def _opened(path: Path, *groups: str) -> Iterator[dict[str, Group]]:
    """Some groups of a ``posterior.nc``, for each costs time to read; whatever is wrong there is an `InputError`."""
    with stored_results(path):
        yield netcdf.read(path, groups)


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
    with _opened(path, *_MODEL) as groups:
        names = _names_in(groups, path)
        if experiment is None and len(names) > 1:
            raise InputError(f"{path}: holds {', '.join(names)}; say which with --experiment")
        if experiment is not None and experiment not in names:
            raise InputError(f"--experiment {experiment}: not in {path}; it holds {', '.join(names)}")
        stored = _stored(groups, path, names.index(experiment or names[0]), own_effects)
        return replace(stored, doubts=_doubts(groups, stored.sample.name, folder / "summary.json"))


def _doubts(groups: Mapping[str, Group], name: str, summary: Path) -> tuple[Notice, ...]:
    """What a fit says against using it, and its check, which is in the summary beside it if there was one."""
    out = []
    if not groups["posterior"].attributes.get("converged", 1):
        text = f"the fit of {name} has not converged: nothing that follows from it is to be relied on"
        out.append(Notice("not-converged", text))
    check = read_json(summary).get("model_check") if summary.is_file() else None
    if check and check["passed"] is False:
        text = (
            f"the model fitted to {name} does not describe its readings (p = {check['p']:.2g}): what follows from it "
            "can be wrong by more than is said; wirebayes discover looks for what is missing"
        )
        out.append(Notice("model-check", text))
    return tuple(out)


def load_with_priors(folder: Path) -> list[tuple[Stored, dict[str, Array]]]:
    """The posterior of each experiment in a folder that `save` wrote, beside draws of its prior, each (n,)."""
    path = folder / "posterior.nc"
    with _opened(path, *_MODEL, "prior") as groups:
        return [(_stored(groups, path, at), _prior(groups, at)) for at in range(len(_names_in(groups, path)))]


def _names_in(groups: Mapping[str, Group], path: Path) -> list[str]:
    about = groups["posterior"].attributes
    if "wirebayes_version" not in about:
        raise InputError(f"{path}: not a posterior of wirebayes")
    names: list[str] = json.loads(about["experiments"])
    return names


def _stored(groups: Mapping[str, Group], path: Path, at: int, own_effects: Path | None = None) -> Stored:
    """The posterior of the experiment at this place among those of the file."""
    posterior, observed, constant = (groups[name] for name in _MODEL)
    about = posterior.attributes
    names = json.loads(about["experiments"])
    draws = _one_of(posterior, at)
    lengths = json.loads(about["lengths_mm"])
    keys, known = json.loads(about["effects"]), catalogue(own_effects)
    model = Model(about["elastic_law"], about["history"], tuple(named(k, known) for k in keys),
                  float(about["tension_ref_N"]))  # fmt: skip
    exponent = draws.pop(LENGTH_EXPONENT, None)
    if len(names) > 1:
        reference = float(np.exp(np.mean(np.log(lengths))))
        draws = at_length(draws, model.effects, lengths[at] / reference, 1.0 if exponent is None else exponent)
        draws = _by_length(draws, model.effects, lengths[at], reference)
    if "reference_C" not in constant.attributes:
        raise InputError(f"{path}: written by an older wirebayes, expected a posterior of this version; fit again")
    reference_C = json.loads(constant.attributes["reference_C"])[at]
    if "controls" not in about:
        raise InputError(f"{path}: written by an older wirebayes, expected a posterior of this version; fit again")
    control = json.loads(about["controls"])[at]
    protocol, readings = _measured(constant, observed, names[at], float(lengths[at]), reference_C, control)
    resolutions = json.loads(about["resolutions"])
    sample = Sample(names[at], about["material"], protocol, readings[..., None], float(resolutions[at]), model)
    check(draws, sample, about["likelihood"])
    return Stored(draws, sample, about["likelihood"], exponent)


def _one_of(group: Group, at: int) -> dict[str, Array]:
    """Draws of each parameter, (n,), of the experiment at this place, where there are several."""
    draws = {}
    for name, (dims, values) in group.variables.items():
        own = values.take(at, axis=dims.index("experiment")) if "experiment" in dims else values
        draws[name] = np.ascontiguousarray(own.reshape(-1))
    return draws


def _measured(
    constant: Group, observed: Group, name: str, length_mm: float, reference_C: float | None, control: Control
) -> tuple[Protocol, Array]:
    """One experiment's holds, unrecorded ones at their place, and its (H, R) readings, padded with zeros."""
    read_as = READ[control] if READ[control] in observed else _READING
    set_as = SET[control] if SET[control] in constant else _SETTING
    holds = constant["hold"]
    own = constant["experiment"] == name if "experiment" in constant else np.full(len(holds), True)
    if not np.array_equal(observed["hold"], holds):
        raise ValueError("readings and holds that do not belong together")
    here = {key: constant[key][own] for key in (set_as, "duration_s", "time_s")}
    measured = observed[read_as][own]
    width = int(np.isfinite(measured).sum(axis=1).max())
    before, unrecorded = np.zeros(0, int), dict[str, Array]()
    if "unrecorded_before_hold" in constant:
        mine = constant["unrecorded_experiment"] == name
        before = constant["unrecorded_before_hold"][mine]
        unrecorded = {key: constant[f"unrecorded_{key}"][mine] for key in (set_as, "duration_s")}
    number = constant["number" if "number" in constant else "hold"][own]
    # An unrecorded hold stands before the recorded one it names; several keep their order.
    place = np.argsort(np.concatenate([before - 0.5, number]), kind="stable")

    def whole(recorded: Array, others: Array | None = None) -> Array:
        none = np.full((len(before), *recorded.shape[1:]), np.nan) if others is None else others
        return np.concatenate([none, recorded])[place]

    readings, times = (whole(values)[:, :width] for values in (measured, here["time_s"]))
    mask = np.isfinite(readings)
    if not np.array_equal(mask, np.isfinite(times)):
        raise ValueError("readings and times that do not belong together")
    setting, duration = (whole(here[key], unrecorded.get(key)) for key in (set_as, "duration_s"))
    protocol = Protocol(
        length_mm,
        setting,
        np.nan_to_num(times),
        mask,
        duration,
        whole(number, np.full(len(before), -1)).astype(np.int64),
        None if reference_C is None else np.nan_to_num(whole(constant["warming_K"][own])[:, :width]),
        reference_C,
        control,
    )
    padding = protocol.mask.shape[1] - readings.shape[1]  # a column where a hold went on after its last reading
    return protocol, np.pad(np.nan_to_num(readings), [(0, 0), (0, padding)])


def datatree(folder: Path) -> "xr.DataTree":
    """The whole content of a folder's ``posterior.nc``, in memory."""
    import xarray as xr  # for users; no command makes such objects

    path = folder / "posterior.nc"
    with stored_results(path), xr.open_datatree(path, engine="h5netcdf") as tree:
        loaded: xr.DataTree = tree.load()
        return loaded


def datatrees(folders: Mapping[str, Path]) -> "xr.DataTree":
    """The content of several ``posterior.nc`` in memory, each a branch under its name."""
    import xarray as xr  # as above

    groups = {
        f"{name}{path}".rstrip("/"): group
        for name, folder in folders.items()
        for path, group in datatree(folder).to_dict().items()
    }
    return xr.DataTree.from_dict(groups)


def prior_draws(folder: Path, experiment: str | None = None) -> dict[str, Array]:
    """The prior: draws of the prior of one experiment's parameters, each (n,)."""
    path = folder / "posterior.nc"
    with _opened(path, "posterior", "prior") as groups:
        names = _names_in(groups, path)
        return _prior(groups, names.index(experiment or names[0]))


def _prior(groups: Mapping[str, Group], at: int) -> dict[str, Array]:
    """Draws of the prior of the experiment at this place among those of the file."""
    return _one_of(groups["prior"], at)


def _groups(
    fit: Fit, sample: Sample | None, provenance: Mapping[str, Any], rng: np.random.Generator
) -> dict[str, Group]:
    """The content of ``posterior.nc``: of one sample as if it stood alone, or of all samples."""
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


def _of_parameters(
    fit: Fit, sample: Sample | None, members: Sequence[Sample], rng: np.random.Generator
) -> dict[str, Group]:
    """Posterior and prior draws of the parameters, and the log density."""
    problem, (m, draws, _) = fit.problem, fit.theta.shape
    prior = problem.prior.rvs(_PRIOR_DRAWS, rng)
    experiments = Variable(("experiment",), np.array([s.name for s in members]))

    def group(variables: Mapping[str, Array], steps: dict[str, Variable]) -> Group:
        axes = ("chain", "draw", "experiment")
        named = {name: Variable(axes[: values.ndim], values) for name, values in variables.items()}
        return Group(named, steps | ({} if sample else {"experiment": experiments}))

    return {
        "posterior": group(_variables(problem, fit.theta, sample), _steps(m, np.arange(draws))),
        "sample_stats": Group({"lp": Variable(("chain", "draw"), fit.log_density)}, _steps(m, np.arange(draws))),
        "prior": group(_variables(problem, prior[None], sample), _steps(1, np.arange(_PRIOR_DRAWS))),
    }


def _steps(chains: int, draws: NDArray[np.int64]) -> dict[str, Variable]:
    """Coordinates of draws."""
    return {"chain": Variable(("chain",), np.arange(chains)), "draw": Variable(("draw",), draws)}


def _log_likelihood(fit: Fit, members: Sequence[Sample]) -> dict[str, Variable]:
    """Log density of each recorded hold given all others, at every draw."""
    m, draws, _ = fit.theta.shape
    samples = zip(_left_out(fit.problem, fit.flat), fit.problem.samples, strict=True)
    holds = np.concatenate([values[s.protocol.recorded] for values, s in samples if s in members])
    return {_name(members, READ, _READING): Variable(("chain", "draw", "hold"), holds.T.reshape(m, draws, -1))}


def _label(groups: Mapping[str, Group], fit: Fit, members: Sequence[Sample], provenance: Mapping[str, Any]) -> None:
    """Units of all variables, and what is needed to use the posterior without its experiment file."""
    effects, controls = members[0].model.effects, _controls(members)
    for kind, group in groups.items():
        for name in group.variables:
            if kind in ("posterior", "prior"):
                unit = unit_of(name, effects, controls)
            elif kind in ("log_likelihood", "sample_stats"):
                unit = "1"
            elif name in (_READING, _SETTING, "hold_mean", f"unrecorded_{_SETTING}"):
                unit = "of the hold's control"
            else:
                unit = _UNIT_IN_NAME.get(name.rsplit("_", 1)[-1], "1")
            group.units[name] = unit
    groups["constant_data"].attributes["reference_C"] = json.dumps([s.protocol.reference_C for s in members])
    groups["posterior"].attributes.update(_about(fit, members, provenance))


def _about(fit: Fit, members: Sequence[Sample], provenance: Mapping[str, Any]) -> dict[str, Any]:
    """Attributes of the posterior: experiments, model, range of the readings, sampler."""
    first = members[0]
    loads = [_tensions(s) for s in members]
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
    name = _name(members, READ, _READING)
    mean = "hold_mean" if name == _READING else f"hold_mean_{UNIT[name]}"
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


def _tensions(sample: Sample) -> Array:
    """Tensions that were read, or set while something was read, N."""
    if sample.protocol.control == "force":
        return sample.protocol.setting[sample.protocol.recorded]
    return np.asarray(sample.readings[..., 0][sample.protocol.mask])


def _protocols(members: Sequence[Sample]) -> dict[str, Variable]:
    """What was done: the recorded holds, and beside them the unrecorded ones, as an experiment file states them."""
    protocols = [s.protocol for s in members]
    recorded = np.concatenate([p.recorded for p in protocols])

    def each(field: str) -> Array:
        return np.concatenate([getattr(p, field) for p in protocols])

    set_as = _name(members, SET, _SETTING)
    times = {s.name: s.protocol.time_s[None] for s in members}
    out = {
        set_as: Variable(("hold",), each("setting")[recorded]),
        "duration_s": Variable(("hold",), each("duration_s")[recorded]),
        "time_s": Variable(("hold", "time"), _stacked(members, times)[0]),
    }
    if any(p.warming_K is not None for p in protocols):
        warming = {s.name: (np.nan if p.warming_K is None else p.warming_K) + 0.0 * times[s.name]
                   for s, p in zip(members, protocols, strict=True)}  # fmt: skip
        out["warming_K"] = Variable(("hold", "time"), _stacked(members, warming)[0])
    if set_as == _SETTING:
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


def _variables(problem: Problem, theta: Array, sample: Sample | None) -> dict[str, Array]:
    """Parameters (chains, draws), of one sample, or of all with those of one sample each along a last axis."""
    if sample is None:
        return _together_variables(problem, theta)
    own = _own(problem, theta.reshape(-1, theta.shape[-1]), sample)
    return {name: values.reshape(theta.shape[:2]) for name, values in own.items()}


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
    """Columns under their plain names; those of one sample each, or of one instrument, by sample along a last axis."""
    columns = dict(zip(problem.names, np.moveaxis(theta, -1, 0), strict=True))
    out: dict[str, Array] = {}
    for name in problem.names:
        plain = name.split("[")[0]
        if plain == name:
            out[plain] = columns[name]
        elif plain not in out:
            of_samples = [problem.column(plain, sample) for sample in problem.samples]
            fixed = {c: np.full(theta.shape[:-1], value) for c, value in problem.prior.fixed.items() if c in of_samples}
            out[plain] = np.stack([(columns | fixed)[c] for c in of_samples], axis=-1)
    return out


def unit_of(name: str, effects: tuple[Effect, ...] = (), controls: Sequence[Control] = ("displacement",)) -> str:
    """Unit of a parameter; where several controls differ in it, of each in turn.

    Parameters
    ----------
    name : str
    effects : tuple of Effect
    controls : sequence of {"displacement", "force"}
        What was set in the tests that it belongs to.
    """
    each = []
    for control in controls:
        errors = {"sensor_sd": READ_UNIT[control], "setting_sd": SET_UNIT[control]}
        own = {c: e.unit_under(a, control) for e in effects for c, a in zip(e.columns(), e.amplitudes, strict=True)}
        each.append((UNITS | {LENGTH_EXPONENT: "1"} | errors | own).get(name, "1"))
    return " or ".join(dict.fromkeys(each))


def derived(wire: FreshSample, tension_N: float) -> Derived:
    """Quantities people compare: creep at a tension after some times and in the end, its speed, stiffness."""
    two_minutes, hour, day = wire.creep_mm(tension_N, np.array(list(CREEP_TIMES_S.values())))
    return {
        "tension_N": tension_N,
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
    low, middle, high = (float(q) for q in np.quantile(values, [0.05, 0.5, 0.95]))
    return {"mean": float(values.mean()), "sd": float(values.std(ddof=1)), "q05": low, "q50": middle, "q95": high}


def statistics(values: Array) -> Mixed:
    """Mean, sd, quantiles, effective sample sizes and R-hat of (chains, draws)."""
    q05, q50, q95 = np.quantile(values, [0.05, 0.5, 0.95])
    with np.errstate(invalid="ignore"):
        return {
            "mean": float(values.mean()), "sd": float(values.std(ddof=1)),
            "q05": float(q05), "q50": float(q50), "q95": float(q95),
            "ess_bulk": bulk_ess(values),
            "ess_tail": tail_ess(values),
            "r_hat": r_hat(values),
        }  # fmt: skip


def _warnings(fit: Fit, sample: Sample | None) -> list[NoticeJson]:
    """That the fit has not converged, and what is suspicious, with the experiment's name where there are several."""
    found = [] if fit.chains.converged else [Notice("not-converged", fit.chains.why)]
    if sample is not None:
        found += posterior_checks.warnings(fit, sample)
    else:
        found += [notice.of(s.name) for s in fit.problem.samples for notice in posterior_checks.warnings(fit, s)]
    return to_json(found)


def _hold_ends(fit: Fit) -> HoldEnds | None:
    best = fit.flat[int(fit.log_density.argmax())]
    return hold_ends.cost(fit.problem, best, fit.flat.std(axis=0, ddof=1))


def _summary(fit: Fit, sample: Sample | None) -> SummaryJson:
    first = sample or fit.problem.samples[0]
    controls = [s.protocol.control for s in ([sample] if sample else fit.problem.samples)]
    parameters: dict[str, Parameter] = {}
    for name, values in _variables(fit.problem, fit.theta, sample).items():
        unit = unit_of(name, first.model.effects, controls)
        if values.ndim == 2:
            parameters[name] = {"unit": unit, **statistics(values)}
        else:
            for i, s in enumerate(fit.problem.samples):
                own = unit_of(name, first.model.effects, [s.protocol.control])
                parameters[f"{name}[{s.name}]"] = {"unit": own, **statistics(values[..., i])}
    tension = round(first.model.tension_ref_N, 3)
    wire = FreshSample(fit.problem.parameters(fit.flat, first), first.model, first.protocol.length_mm)
    chains = fit.chains
    return {
        "experiment": sample.name if sample else first.material.replace(" ", "-"),
        "likelihood": fit.problem.likelihood,
        "elastic_law": first.model.law,
        "history": first.model.history,
        "effects": [e.key for e in first.model.effects],
        "converged": chains.converged,
        "convergence": chains.why,
        "warnings": _warnings(fit, sample),
        "parameters": parameters,
        "derived": derived(wire, tension),
        "identifiability": identifiability(fit),
        "extrapolation": extrapolation(fit, tension, sample=fit.problem.samples.index(first)).to_dict(),
        "hold_ends": _hold_ends(fit),
        "likelihood_evaluations": chains.evaluations,
        "kept_evaluations": chains.kept_evaluations,
        "autocorrelation_steps": float(chains.autocorrelation_steps.max()),
        "smallest_ess": float(chains.ess.min()),
        "largest_nested_r_hat": float(chains.r_hat.max()),
        "acceptance": chains.acceptance,
        "learned_move": chains.learned,
        "modes_found": chains.modes,
    }

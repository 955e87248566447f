"""A posterior read back from ``posterior.nc``, with what its fit says against using it.

The only module that makes objects of xarray.
"""

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from wirebayes.effects import catalogue, effect_named
from wirebayes.effects.unknown import Discrepancy
from wirebayes.errors import InputError
from wirebayes.io.readings import READ, SET
from wirebayes.io.run_folder import read_json, stored_results
from wirebayes.json_files.summary import ModelCheckResult
from wirebayes.model.prior import Prior
from wirebayes.model.problem import Problem
from wirebayes.model.sample import LENGTH_EXPONENT, Sample, at_length
from wirebayes.numeric.typing import Array
from wirebayes.result_warnings import Notice, from_json
from wirebayes.results import netcdf
from wirebayes.results.content import READING, SETTING
from wirebayes.results.netcdf import Group
from wirebayes.results.parameters import by_length
from wirebayes.results.stored_check import check_stored
from wirebayes.sentences import p_in_words
from wirebayes.wire.effect import Typical
from wirebayes.wire.model import Model
from wirebayes.wire.protocol import Control, Protocol

if TYPE_CHECKING:
    import xarray as xr

_MODEL = ("posterior", "observed_data", "constant_data")  # groups that say what was fitted, and the draws


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
        own_length = replace(self.sample.model, length_ref_mm=0.0)
        sample = replace(self.sample, model=own_length)
        names: dict[str, Any] = dict.fromkeys(self.draws)
        return Problem((sample,), Prior(names, {}, frozenset()), self.likelihood)  # type: ignore[arg-type]

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
    """Read some groups of a ``posterior.nc``, as each costs time; whatever is wrong there is an `InputError`."""
    with stored_results(path):
        yield netcdf.read_groups(path, groups)


def load_posterior(folder: Path, experiment: str | None = None, own_effects: Path | None = None) -> Stored:
    """Read the posterior of one experiment from a folder that `save_posterior` wrote.

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
        listed_names = ", ".join(names)
        if experiment is None:
            if len(names) > 1:
                raise InputError(f"{path}: holds {listed_names}; say which with --experiment")
            experiment = names[0]
        if experiment not in names:
            raise InputError(f"--experiment {experiment}: not in {path}; it holds {listed_names}")
        stored = _stored(groups, path, names.index(experiment), own_effects)
        doubts = _doubts(groups, stored.sample.name, folder / "summary.json")
        return replace(stored, doubts=doubts)


def _doubts(groups: Mapping[str, Group], name: str, summary: Path) -> tuple[Notice, ...]:
    """What a fit says against using it, and its check, which is in the summary beside it if there was one."""
    out = []
    if not groups["posterior"].attributes.get("converged", 1):
        text = f"the fit of {name} has not converged: nothing that follows from it is to be relied on"
        out.append(Notice("not-converged", text))
    check = read_json(summary).get("model_check") if summary.is_file() else None
    if check and check["passed"] is False:
        out.append(Notice("model-check", _failed_in_words(check, name)))
    return (*out, *_found_missing(name, summary.parent))


def _failed_in_words(check: ModelCheckResult, name: str) -> str:
    """What a failed check says against using the fit."""
    wrong = "what follows from it can be wrong by more than is said"
    if check["p"] is not None and check["p"] > check["alpha"]:
        return f"{name} was fitted at once with samples that differ from it: {wrong}; fit each by itself"
    sure = p_in_words(check["p"] or 0.0, check["simulations"])
    return (
        f"the model fitted to {name} does not describe its readings ({sure}): {wrong}; wirebayes discover looks for "
        "what is missing"
    )


def _found_missing(name: str, folder: Path) -> list[Notice]:
    """What a search says against the plain or the final model in a folder of its results."""
    file = folder.parent.parent / "discovery.json"
    if folder.name not in ("plain", "final") or not file.is_file():
        return []
    report = read_json(file)["experiments"].get(name)
    if report is None:
        return []
    if folder.name == "final" or report["verdict"] == "nothing-missing":
        return [notice.of(name) for notice in from_json(report["warnings"]) if notice.kind == "incomplete"]
    sure = p_in_words(report["p_global"], report["p_simulations"])
    text = (
        f"the plain model of {name} lacks what discover found missing ({sure}): what follows from it can be wrong by "
        "more than is said; the final model has it"
    )
    return [Notice("model-check", text)]


def load_with_priors(folder: Path) -> list[tuple[Stored, dict[str, Array]]]:
    """The posterior of each experiment in a folder by `save_posterior`, beside draws of its prior, each (n,)."""
    path = folder / "posterior.nc"
    loaded = []
    with _opened(path, *_MODEL, "prior") as groups:
        for place in range(len(_names_in(groups, path))):
            loaded.append((_stored(groups, path, place), _prior(groups, place)))
    return loaded


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
    if "reference_C" not in constant.attributes or "controls" not in about:
        raise InputError(f"{path}: written by an older wirebayes, expected a posterior of this version; fit again")

    def own(key: str, of: Group = posterior) -> Any:
        return json.loads(of.attributes[key])[at]

    test = _Test(
        name=own("experiments"),
        length_mm=float(own("lengths_mm")),
        reference_C=own("reference_C", constant),
        control=own("controls"),
    )
    model = _model(about, own_effects, path)
    model = replace(model, effects=tuple(e for e in model.effects if e.acts_on(test.name, test.control)))
    draws, exponent = _draws(posterior, at, model)
    protocol, readings = _measured(constant, observed, test)
    resolution = float(own("resolutions"))
    sample = Sample(test.name, about["material"], protocol, readings[..., None], resolution, model)
    likelihood = about["likelihood"]
    check_stored(draws, sample, likelihood)
    return Stored(draws, sample, likelihood, exponent)


def _draws(posterior: Group, at: int, model: Model) -> tuple[dict[str, Array], Array | None]:
    """Draws of the experiment at this place, at its own length, and the exponent of the length, where it is not 1."""
    about = posterior.attributes
    draws = _one_of(posterior, at)
    fixed = float(about.get(LENGTH_EXPONENT, 1.0))
    exponent = draws.pop(LENGTH_EXPONENT, None)
    if exponent is None and fixed != 1.0:
        exponent = np.full(len(draws["B"]), fixed)
    lengths = json.loads(about["lengths_mm"])
    if len(lengths) == 1:
        return draws, exponent
    length = lengths[at]
    reference = float(np.exp(np.mean(np.log(lengths))))
    power = 1.0 if exponent is None else exponent
    draws = at_length(draws, model.effects, length / reference, power)
    return by_length(draws, model, length, reference), exponent


def _model(about: Mapping[str, Any], own_effects: Path | None, path: Path) -> Model:
    """Law, history and effects of the fit."""
    known = catalogue(own_effects)
    keys = json.loads(about["effects"])
    foreign = [key for key in keys if key.partition("@")[0] not in (*known, Discrepancy.name)]
    if foreign:
        found = f"effects of the user's own, {', '.join(foreign)}"
        raise InputError(f"{path}: found {found}, expected the file that has them, with --own-effects")
    effects = tuple(effect_named(key, known) for key in keys)
    # effects in a file without these refer to 1 N and 1 s
    typical = Typical(float(about.get("typical_tension_N", 1.0)), float(about.get("typical_hold_s", 1.0)))
    return Model(about["elastic_law"], about["history"], effects, float(about["tension_ref_N"]), typical=typical)


@dataclass(frozen=True)
class _Test:
    """One of the experiments of a file."""

    name: str
    length_mm: float
    reference_C: float | None
    control: Control


def _one_of(group: Group, at: int) -> dict[str, Array]:
    """Draws of each parameter, (n,), of the experiment at this place, where there are several."""
    draws = {}
    for name, (dims, values) in group.variables.items():
        own = values.take(at, axis=dims.index("experiment")) if "experiment" in dims else values
        draws[name] = np.ascontiguousarray(own.reshape(-1))
    return draws


def _measured(constant: Group, observed: Group, test: _Test) -> tuple[Protocol, Array]:
    """One experiment's holds, unrecorded ones at their place, and its (H, R) readings, padded with zeros."""
    read_as = READ[test.control] if READ[test.control] in observed else READING
    set_as = SET[test.control] if SET[test.control] in constant else SETTING
    own = _of_experiment(constant, observed, test.name)
    number = constant["number" if "number" in constant else "hold"][own]
    before, unrecorded = _unrecorded(constant, test.name, set_as)
    # An unrecorded hold stands before the recorded one it names; several keep their order.
    place = np.argsort(np.concatenate([before - 0.5, number]), kind="stable")

    def whole(recorded: Array, others: Array | None = None) -> Array:
        if others is None:
            others = np.full((len(before), *recorded.shape[1:]), np.nan)
        return np.concatenate([others, recorded])[place]

    measured = observed[read_as][own]
    width = int(np.isfinite(measured).sum(axis=1).max())
    readings = whole(measured)[:, :width]
    times = whole(constant["time_s"][own])[:, :width]
    mask = np.isfinite(readings)
    if not np.array_equal(mask, np.isfinite(times)):
        raise ValueError("readings and times that do not belong together")
    numbers = whole(number, np.full(len(before), -1))
    warming = None
    if test.reference_C is not None:
        warming = _padded(whole(constant["warming_K"][own]), width)
    protocol = Protocol(
        test.length_mm,
        setting=whole(constant[set_as][own], unrecorded.get(set_as)),
        time_s=np.nan_to_num(times),
        mask=mask,
        duration_s=whole(constant["duration_s"][own], unrecorded.get("duration_s")),
        number=numbers.astype(np.int64),
        warming_K=warming,
        reference_C=test.reference_C,
        control=test.control,
    )
    # a column where a hold went on after its last reading
    return protocol, _padded(readings, protocol.mask.shape[1])


def _padded(values: Array, width: int) -> Array:
    """(H, width) values, cut or padded, zero where there is none."""
    kept = np.nan_to_num(values[:, :width])
    return np.pad(kept, [(0, 0), (0, width - kept.shape[1])])


def _of_experiment(constant: Group, observed: Group, name: str) -> Array:
    """The holds that belong to an experiment."""
    holds = constant["hold"]
    if not np.array_equal(observed["hold"], holds):
        raise ValueError("readings and holds that do not belong together")
    return constant["experiment"] == name if "experiment" in constant else np.full(len(holds), True)


def _unrecorded(constant: Group, name: str, set_as: str) -> tuple[Array, dict[str, Array]]:
    """The unrecorded holds of an experiment: the recorded one that each stands before, what was set, and how long."""
    if "unrecorded_before_hold" not in constant:
        return np.zeros(0, int), {}
    mine = constant["unrecorded_experiment"] == name
    before = constant["unrecorded_before_hold"][mine]
    return before, {key: constant[f"unrecorded_{key}"][mine] for key in (set_as, "duration_s")}


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

    groups = {}
    for name, folder in folders.items():
        for path, group in datatree(folder).to_dict().items():
            groups[f"{name}{path}".rstrip("/")] = group
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

"""From experiments to a posterior: samples, and the prior of every parameter, a default or the user's."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from wirebayes.io.experiment import Experiment, by_material
from wirebayes.model.column_units import parameter_of, unit_of_column
from wirebayes.model.prior import PowerScaled, Prior, from_table, possible, wire_defaults
from wirebayes.model.prior_names import place_of_prior
from wirebayes.model.problem import Problem
from wirebayes.model.sample import LENGTH_EXPONENT, MATERIAL, SAMPLE, Sample
from wirebayes.model.scales import Scales, Units, scales_of
from wirebayes.model.spec import PLAIN_SPEC, ModelSpec
from wirebayes.numeric.any_distribution import ours, scaled
from wirebayes.numeric.distributions import LogUniform
from wirebayes.numeric.means import geometric_mean
from wirebayes.wire.control import READ_UNIT, SET_UNIT
from wirebayes.wire.effect import Amplitude, Effect, Typical
from wirebayes.wire.model import Model, tension_reference
from wirebayes.wire.protocol import Control, Protocol

FINEST = 1e-5  # of the largest tension: no load cell resolves less, and data without any noise need a floor
_POSITIVE = {"k1", "B", "U", "k2", "N", "sensor_sd", "setting_sd"}


def build(
    experiments: Sequence[Experiment],
    effects: Sequence[Effect] = (),
    spec: ModelSpec = PLAIN_SPEC,
    *,
    scales: Scales | None = None,
) -> Problem:
    """The posterior of some experiments, in mm, N and s; those of one material share its parameters.

    Parameters
    ----------
    experiments : sequence of Experiment
    effects : sequence of Effect
        Each acts on every sample; its amplitudes are shared as its scope says (an event acts where its hold is).
    spec : ModelSpec
        Laws, likelihood, and how creep grows with the length.
    scales : Scales, optional
        What default priors refer to; those of the experiments when left out. Part of a test, or a replicate of it, is
        given those of the whole.

    Raises
    ------
    InputError
        If a prior in the file is malformed. (`check_prior_names` finds those that no model has a parameter for.)
    """
    materials = by_material(experiments)
    scales = scales or scales_of(experiments)
    several = len(experiments) > 1
    effects = [effect.on(_acted_on(effect, experiments), scales.range_mm) for effect in effects]
    distributions: dict[str, Any] = {}
    samples: list[Sample] = []
    for material, members in materials.items():
        mark = f"[{material}]" if len(materials) > 1 else ""
        distributions |= _material_priors(members, effects, mark, spec, scales)
        samples += _samples(members, [effect.referred(scales.hold_s) for effect in effects], spec, scales)
    distributions |= _instrument_priors(experiments, effects, scales)
    for experiment in experiments:
        mark = f"[{experiment.name}]" if several else ""
        distributions |= _sample_priors(experiment, effects, mark, spec, scales)
    every = _in_natural_units(distributions, effects, samples, scales)
    stated, told = _apply_tables(every, experiments)
    fixed, free = _fixed_and_free(every)
    logarithmic = _positive(free, effects)
    powers = _default_powers([name for name in free if name not in stated], fixed, scales.units)
    return Problem(
        tuple(samples),
        Prior(free, fixed, logarithmic, powers),
        spec.likelihood,
        scales=scales,
        stated=frozenset(stated),
        told=frozenset(told),
    )


def default_prior(
    length_mm: float, scales: Scales, instead: Mapping[str, Any], control: Control = "displacement"
) -> Prior:
    """The plain model's prior for a wire of this length, in mm, N and s.

    Parameters
    ----------
    scales : Scales
        Of the test, which defaults refer to.
    instead : mapping of name to float or Distribution
        What is stated in place of defaults, in natural units.
    control : {"displacement", "force"}
        What is set in the test.
    """
    units = scales.units
    defaults = wire_defaults(length_mm, scales, control)
    own = {name: unit_of_column(name, ()) for name in defaults} | {
        "sensor_sd": READ_UNIT[control],
        "setting_sd": SET_UNIT[control],
    }
    every = {name: scaled(d, units.of(own[name])) for name, d in defaults.items()} | dict(instead)
    fixed, free = _fixed_and_free(every)
    powers = _default_powers([name for name in free if name not in instead], fixed, units)
    return Prior(free, fixed, frozenset(_POSITIVE & free.keys()), powers)


def _fixed_and_free(every: Mapping[str, Any]) -> tuple[dict[str, float], dict[str, Any]]:
    """Values of fixed parameters, and the distributions of the others."""
    fixed = {name: float(d) for name, d in every.items() if isinstance(d, int | float)}
    return fixed, {name: d for name, d in every.items() if name not in fixed}


def _default_powers(names: Sequence[str], fixed: Mapping[str, float], units: Units) -> dict[str, PowerScaled]:
    """How the defaults of B and k2 change with the units of tension and time in which they are stated."""
    logs = {"B": ("U", float(np.log(units.tension_N))), "k2": ("N", float(np.log(units.time_s)))}
    out = {}
    for name in names:
        base, bracket, mark = name.partition("[")
        if base in logs:
            exponent, log_base = logs[base]
            column = f"{exponent}{bracket}{mark}"
            out[name] = PowerScaled(fixed.get(column, column), log_base)
    return out


def _reference_length(members: Sequence[Experiment]) -> float:
    """Geometric mean of the lengths, mm: B belongs to it."""
    return geometric_mean(e.length_mm for e in members)


def _material_priors(
    members: Sequence[Experiment],
    effects: Sequence[Effect],
    mark: str,
    spec: ModelSpec,
    scales: Scales,
) -> dict[str, Any]:
    """Default priors of what the samples of one material share; `mark` distinguishes materials in the names."""
    defaults = wire_defaults(_reference_length(members), scales)
    tells_stiffness = spec.likelihood == "chain" or any(e.control == "displacement" for e in members)
    out: dict[str, Any] = {}
    for name in MATERIAL:
        if name != "k1" or tells_stiffness:
            out[f"{name}{mark}"] = defaults[name]
    lengths = {e.length_mm for e in members}
    if len(lengths) > 1:
        out[f"{LENGTH_EXPONENT}{mark}"] = spec.length_exponent
    of_wire = [effect for effect in effects if effect.scope == "material"]
    for column, amplitude in _amplitudes(of_wire):
        if not amplitude.of_each_test:
            out[f"{column}{mark}"] = amplitude.prior
    return out


def _acted_on(effect: Effect, experiments: Sequence[Experiment]) -> list[Protocol]:
    """What is done in the tests that an effect acts on."""
    return [e.protocol() for e in experiments if effect.acts_on(e.name, e.control)]


def _instrument_priors(experiments: Sequence[Experiment], effects: Sequence[Effect], scales: Scales) -> dict[str, Any]:
    """Priors of what does not belong to the wire: steps and weights are read by different instruments, each its own."""
    controls = dict.fromkeys(e.control for e in experiments)
    out: dict[str, Any] = {}
    for effect in effects:
        if effect.scope == "material":
            continue
        marks = [""]
        if len(controls) > 1 and effect.scope != "event":
            marks = [f"[{control}]" for control in controls if effect.control in (None, control)]
        for mark in marks:
            read = [e for e in experiments if mark in ("", f"[{e.control}]")]
            own = effect.on(_acted_on(effect, read), scales.range_mm)
            for column, amplitude in _amplitudes([own]):
                if not amplitude.of_each_test:
                    out[f"{column}{mark}"] = amplitude.prior
    return out


def _sample_priors(
    experiment: Experiment, effects: Sequence[Effect], mark: str, spec: ModelSpec, scales: Scales
) -> dict[str, Any]:
    """Default priors of what belongs to one sample alone; `mark` distinguishes samples in the names."""
    zero_mm = scales.zeros_mm.get(experiment.name, 0.0)
    defaults = wire_defaults(experiment.length_mm, scales, experiment.control, zero_mm)
    wanted = SAMPLE if spec.likelihood == "chain" else ("sensor_sd",)
    out: dict[str, Any] = {f"{name}{mark}": defaults[name] for name in wanted}
    for column, amplitude in _amplitudes(_acting_on(experiment, effects)):
        if amplitude.of_each_test:
            out[f"{column}{mark}"] = amplitude.prior
    return out


def _in_natural_units(
    distributions: Mapping[str, Any], effects: Sequence[Effect], samples: Sequence[Sample], scales: Scales
) -> dict[str, Any]:
    """The priors in mm, N and s, of which defaults are in the test's own scales unless an effect says otherwise."""
    natural = {column for column, amplitude in _amplitudes(effects) if amplitude.in_natural_units}
    out = {}
    for name, prior in distributions.items():
        is_in_them = name in natural or isinstance(prior, int | float)
        out[name] = prior if is_in_them else scaled(prior, scales.units.of(unit_of_column(name, samples)))
    return out


def _positive(free: Mapping[str, Any], effects: Sequence[Effect]) -> frozenset[str]:
    """Parameters that are sampled by their logarithm: by their nature positive, and not below zero by their prior.

    A log-uniform prior ends on both sides, where climbs by the logarithm would run into a wall.
    """
    positive = _POSITIVE | {column for column, amplitude in _amplitudes(effects) if amplitude.is_shape}
    out = set()
    for name, distribution in free.items():
        if parameter_of(name) in positive:
            prior = ours(distribution)
            least, _ = prior.support()
            if least >= 0 and not isinstance(prior, LogUniform):
                out.add(name)
    return frozenset(out)


def _amplitudes(effects: Sequence[Effect]) -> list[tuple[str, Amplitude]]:
    """The amplitudes of effects with the names of their columns."""
    return [pair for effect in effects for pair in zip(effect.columns(), effect.amplitudes, strict=True)]


def _samples(members: Sequence[Experiment], effects: Sequence[Effect], spec: ModelSpec, scales: Scales) -> list[Sample]:
    """The experiments of one material as the likelihood sees them."""
    read = [e.tension()[e.protocol().mask] for e in members]
    tension = tension_reference(np.concatenate(read))
    length = _reference_length(members) if len(members) > 1 else 0.0
    typical = Typical(scales.tension_N, scales.hold_s)
    out = []
    for e in members:
        model = Model(spec.law, spec.history, tuple(_acting_on(e, effects)), tension, length, typical)
        finest = max(e.resolution, FINEST * _extent(e))
        readings = e.readings()[..., None]
        out.append(Sample(e.name, e.material, e.protocol(), readings, finest, model))
    return out


def _acting_on(experiment: Experiment, effects: Sequence[Effect]) -> list[Effect]:
    """The effects that act on an experiment."""
    return [effect for effect in effects if effect.acts_on(experiment.name, experiment.control)]


def _extent(experiment: Experiment) -> float:
    """The largest tension that was read, or the range of displacements, whose zero means nothing."""
    read = [hold.readings for hold in experiment.recorded_holds]
    if not read:
        return 0.0
    values = np.concatenate(read)
    return float(np.ptp(values) if experiment.control == "force" else np.abs(values).max())


def _apply_tables(distributions: dict[str, Any], experiments: Sequence[Experiment]) -> tuple[set[str], set[str]]:
    """Put stated priors in place of the defaults.

    Returns
    -------
    set of str, set of str
        The columns that have one, and those of them that readings of other materials tell of.
    """
    stated = set()
    told = set()
    for experiment in experiments:
        marks = experiment.name, experiment.material, experiment.control
        for name, table in experiment.priors.items():
            key = place_of_prior(experiment, name)
            wanted = possible(key, name, from_table(key, table))
            columns = [*(f"{name}[{mark}]" for mark in marks), name]
            column = next((each for each in columns if each in distributions), None)
            if column is not None:
                distributions[column] = wanted
                stated.add(column)
                if name in experiment.told:
                    told.add(column)
    return stated, told

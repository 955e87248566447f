"""From holds to a log posterior: which parameter belongs to which sample, and the batched density.

Columns are named ``k1``, ``preload`` …, effect amplitudes ``effect.parameter``. If several samples are fitted jointly,
a column of one sample is ``preload[sample]`` and one of a material ``k1[material]``; the most specific name is used.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from wirebayes.errors import InputError
from wirebayes.io.experiment import Experiment
from wirebayes.model import likelihoods, single_holds
from wirebayes.model.distributions import scaled
from wirebayes.model.prior import Power, Prior, from_table, possible, wire_defaults
from wirebayes.model.scales import NATURAL, Scales, Units, scales_of
from wirebayes.numeric.means import geometric_mean
from wirebayes.numeric.typing import Array
from wirebayes.strict.hint import hint
from wirebayes.wire.control import READ_UNIT, SET_UNIT
from wirebayes.wire.effect import Amplitude, Effect
from wirebayes.wire.laws import ElasticLaw, History
from wirebayes.wire.model import Model, tension_reference
from wirebayes.wire.protocol import Control, Protocol
from wirebayes.wire.staircase import Linearised, linearise, streamed

Likelihood = Literal["chain", "hold"]

MATERIAL = ("k1", "B", "U", "k2", "N")
SAMPLE = ("preload", "sensor_sd", "setting_sd")
LENGTH_EXPONENT = "creep_length_exponent"
FINEST = 1e-5  # of the largest tension: no load cell resolves less, and data without any noise need a floor
_POSITIVE = {"k1", "B", "U", "k2", "N", "sensor_sd", "setting_sd"}


@dataclass(frozen=True)
class Sample:
    """One experiment made ready for the likelihood.

    Attributes
    ----------
    name, material : str
    protocol : Protocol
    readings : (H, R, 1) array
        N, or mm where the tension is set.
    resolution : float
        Step to which they were rounded, no finer than any instrument resolves.
    model : Model
        With the effects that act on this sample.
    """

    name: str
    material: str
    protocol: Protocol
    readings: Array
    resolution: float
    model: Model

    def parameters(self, likelihood: Likelihood) -> tuple[str, ...]:
        """The plain parameters that its readings depend on: hold by hold no preload, and under weights no k1."""
        if likelihood == "chain":
            return MATERIAL + SAMPLE
        wire = MATERIAL if self.protocol.control == "displacement" else MATERIAL[1:]
        return (*wire, "sensor_sd")

    @property
    def typical_hold_s(self) -> float:
        """Median duration of the recorded holds (a second where all readings are at time zero)."""
        return float(np.median(self.protocol.duration_s[self.protocol.recorded])) or 1.0


@dataclass(frozen=True)
class Problem:
    """A posterior: samples, prior and likelihood.

    Attributes
    ----------
    samples : tuple of Sample
    prior : Prior
        Its names are the columns of every ``(n, d)`` parameter array.
    likelihood : {"chain", "hold"}
    scales : Scales or None
        Of the test, which default priors refer to; None where there is nothing to scale, as for a stored posterior.
    units : Units
        In which parameters, protocols and readings are written.
    stated : frozenset of str
        Parameters whose prior a person stated, in natural units.
    """

    samples: tuple[Sample, ...]
    prior: Prior
    likelihood: Likelihood = "chain"
    scales: Scales | None = None
    units: Units = NATURAL
    stated: frozenset[str] = frozenset()

    @property
    def names(self) -> tuple[str, ...]:
        return self.prior.names

    def column(self, name: str, sample: Sample) -> str:
        """The column, or fixed parameter, that holds a parameter of one sample: the most specific one.

        Raises
        ------
        KeyError
            If there is none.
        """
        marks = sample.name, sample.material, sample.protocol.control
        for candidate in (*(f"{name}[{mark}]" for mark in marks), name):
            if candidate in self.prior.distributions or candidate in self.prior.fixed:
                return candidate
        raise KeyError(name)

    def parameters(self, theta: Array, sample: Sample) -> dict[str, Array]:
        """The parameters of one sample, each (n,), from an (n, d) array of all columns."""
        columns = dict(zip(self.names, np.ascontiguousarray(theta.T), strict=True))
        n = len(theta)

        def find(name: str) -> Array:
            column = self.column(name, sample)
            return columns[column] if column in columns else np.full(n, self.prior.fixed[column])

        out = {name: find(name) for name in sample.parameters(self.likelihood)}
        for effect in sample.model.effects:
            out |= {column: find(column) for column in effect.columns()}
        ratio = sample.protocol.length_mm / (sample.model.length_ref_mm or sample.protocol.length_mm)
        return out if ratio == 1.0 else at_length(out, sample.model.effects, ratio, find(LENGTH_EXPONENT))

    def hold_log_likelihood(self, theta: Array, readings: Sequence[Array] | None = None) -> list[Array]:
        """Per sample the (H, n) log-likelihood of each hold, given those before (chain) or its first reading (hold).

        `readings` replaces the measured ones, per sample (H, R, n), row by row of `theta` (simulated replicates).
        """
        out = []
        for i, sample in enumerate(self.samples):
            own = self.parameters(theta, sample)
            y = sample.readings if readings is None else readings[i]
            variance = likelihoods.reading_variance(own["sensor_sd"], sample.resolution)
            if self.likelihood == "hold":
                out.append(single_holds.hold_by_hold(sample.protocol, own, sample.model, y, variance))
            else:
                line = streamed(sample.protocol, own, sample.model)
                out.append(likelihoods.chain(line, y, sample.protocol.mask, variance, own["setting_sd"]).log_likelihood)
        return out

    def log_likelihood(self, theta: Array, readings: Sequence[Array] | None = None) -> Array:
        """(n,) log-likelihood; -inf where the model cannot be computed."""
        with np.errstate(all="ignore"):
            total: Array = sum(holds.sum(axis=0) for holds in self.hold_log_likelihood(theta, readings))
        return np.where(np.isfinite(total), total, -np.inf)

    def standardised(self, theta: Array, readings: Sequence[Array] | None = None) -> tuple[Array, Array]:
        """(n,) log-likelihood, and (m, n) residuals whose derivatives J give its curvature nearly, as JᵀJ.

        See `wirebayes.model.likelihoods.standardised`; `readings` as for `hold_log_likelihood`.
        """
        values, residuals = [], []
        with np.errstate(all="ignore"):
            for i, sample in enumerate(self.samples):
                y = sample.readings if readings is None else readings[i]
                own = self.parameters(theta, sample)
                variance = likelihoods.reading_variance(own["sensor_sd"], sample.resolution)
                if self.likelihood == "hold":
                    found = single_holds.standardised_hold_by_hold(sample.protocol, own, sample.model, y, variance)
                else:
                    line = streamed(sample.protocol, own, sample.model)
                    found = likelihoods.standardised(line, y, sample.protocol.mask, variance, own["setting_sd"])
                values.append(found[0])
                residuals.append(found[1])
            total: Any = sum(values)
        return np.where(np.isfinite(total), total, -np.inf), np.concatenate(residuals)

    def without_each_hold(self, theta: Array) -> tuple[Array, list[Array]]:
        """(n,) log-likelihood, and per sample the (H, n) of the readings of all holds, of all samples, but one."""
        with np.errstate(all="ignore"):
            if self.likelihood == "hold":
                own = self.hold_log_likelihood(theta)
                whole = np.sum([holds.sum(axis=0) for holds in own], axis=0)
                return whole, [whole - holds for holds in own]
            each, without = [], []
            for sample in self.samples:
                line, variance, setting_sd = self.linearised(theta, sample)
                seen = sample.readings, sample.protocol.mask, variance, setting_sd
                filtered = likelihoods.chain(line, *seen)
                each.append(filtered.log_likelihood.sum(axis=0))
                without.append(likelihoods.without_each_hold(line, filtered, *seen))
            whole = np.sum(each, axis=0)
            return whole, [rest + (whole - own) for rest, own in zip(without, each, strict=True)]

    def leave_one_hold_out(self, theta: Array) -> list[Array]:
        """Per sample the (H, n) log p(readings of a hold | all other readings, parameters); 0 for an unrecorded hold.

        -inf where the model cannot be computed.
        """
        whole, without = self.without_each_hold(theta)
        out = []
        for sample, rest in zip(self.samples, without, strict=True):
            with np.errstate(all="ignore"):
                value = np.where(sample.protocol.recorded[:, None], whole - rest, 0.0)
            out.append(np.where(np.isfinite(value), value, -np.inf))
        return out

    def read_unit(self, sample: Sample) -> float:
        """How many N, or mm where the tension is set, the readings of a sample count as one."""
        return self.units.of(READ_UNIT[sample.protocol.control])

    @property
    def own_units(self) -> Units:
        """Units made of the test's scales; mm, N and s where it has none.

        A stated or fixed B or k2, whose unit depends on U or N, keeps the tension or the time as it is: its prior stays
        simple.
        """
        if self.scales is None:
            return NATURAL
        own = self.scales.units
        known = {column for column, value in self.prior.fixed.items() if value != 0.0}
        named = {column.split("[")[0] for column in self.stated | known}
        return Units(own.length_mm, 1.0 if "B" in named else own.tension_N, 1.0 if "k2" in named else own.time_s)

    def in_units(self, units: Units) -> "Problem":
        """The same posterior written in other units."""
        if units == self.units:
            return self
        samples = tuple(_sample_in(sample, self.units, units) for sample in self.samples)
        return replace(self, samples=samples, prior=self._prior_in(units), units=units)

    def theta_in(self, units: Units, theta: Array) -> Array:
        """(n, d) parameters of this problem in other units."""
        out = theta.copy()
        for i, name in enumerate(self.names):
            out[:, i] *= _ratio(unit_of_column(name, self.samples), self.units, units)
        for name, (exponent, log_ratio) in self._exponents(units).items():
            if name in self.names:
                value = theta[:, self.names.index(exponent)] if isinstance(exponent, str) else exponent
                out[:, self.names.index(name)] *= np.exp(-log_ratio * value)
        return out

    def _exponents(self, units: Units) -> dict[str, Power]:
        """For B and k2 of every material the exponent, and the logarithm of the ratio of the units raised to it."""
        # a difference of logarithms, so that what was added in one unit goes to the last bit in the other
        logs = {
            "B": ("U", np.log(self.units.tension_N) - np.log(units.tension_N)),
            "k2": ("N", np.log(self.units.time_s) - np.log(units.time_s)),
        }
        out = {}
        for name in (*self.names, *self.prior.fixed):
            base, bracket, mark = name.partition("[")
            if base in logs:
                exponent, log_ratio = logs[base]
                column = f"{exponent}{bracket}{mark}"
                out[name] = Power(self.prior.fixed.get(column, column), float(log_ratio))
        return out

    def _prior_in(self, units: Units) -> Prior:
        prior = self.prior
        ratios = {
            name: _ratio(unit_of_column(name, self.samples), self.units, units) for name in (*self.names, *prior.fixed)
        }
        distributions = {name: scaled(d, ratios[name]) for name, d in prior.distributions.items()}
        fixed = {name: value * ratios[name] for name, value in prior.fixed.items()}
        powers = {}
        for name, (exponent, log_ratio) in self._exponents(units).items():
            log_base = prior.powers[name].log_base if name in prior.powers else 0.0
            if log_base + log_ratio != 0.0:
                powers[name] = Power(exponent, log_base + log_ratio)
            if name in fixed and isinstance(exponent, float):
                fixed[name] *= float(np.exp(-log_ratio * exponent))
        return replace(prior, distributions=distributions, fixed=fixed, powers=powers)

    def linearised(self, theta: Array, sample: Sample) -> tuple[Linearised, Array, Array]:
        """A sample's staircase with reading variance and setting error, each (n,)."""
        own = self.parameters(theta, sample)
        return (
            linearise(sample.protocol, own, sample.model),
            likelihoods.reading_variance(own["sensor_sd"], sample.resolution),
            own["setting_sd"],
        )


def build(
    experiments: Sequence[Experiment],
    effects: Sequence[Effect] = (),
    *,
    law: ElasticLaw = "hooke",
    history: History = "saturating",
    likelihood: Likelihood = "chain",
    length_exponent: Any = 1.0,
    scales: Scales | None = None,
) -> Problem:
    """The posterior of some experiments, in mm, N and s; those of one material share its parameters.

    Parameters
    ----------
    experiments : sequence of Experiment
    effects : sequence of Effect
        Each acts on every sample; its amplitudes are shared as its scope says (an event acts where its hold is).
    law, history, likelihood
        See `wirebayes.wire.laws` and `wirebayes.model.likelihoods`.
    length_exponent : float or scipy frozen distribution
        p of B ∝ L0^p among samples of one material: a value, or a prior to learn it.
    scales : Scales, optional
        What default priors refer to; those of the experiments when left out. Part of a test, or a replicate of it, is
        given those of the whole.

    Raises
    ------
    InputError
        If a prior in the file names no parameter, or is malformed.
    """
    materials: dict[str, list[Experiment]] = {}
    for experiment in experiments:
        materials.setdefault(experiment.material, []).append(experiment)
    scales = scales or scales_of(experiments)
    several = len(experiments) > 1
    effects = [
        effect.on([e.protocol() for e in experiments if effect.acts_on(e.name, e.control)]) for effect in effects
    ]
    distributions: dict[str, Any] = {}
    samples: list[Sample] = []
    for material, members in materials.items():
        mark = f"[{material}]" if len(materials) > 1 else ""
        distributions |= _material_priors(members, effects, mark, length_exponent, scales, likelihood)
        samples += _samples(members, [effect.referred(scales.hold_s) for effect in effects], law, history)
    distributions |= _instrument_priors(experiments, effects)
    for experiment in experiments:
        mark = f"[{experiment.name}]" if several else ""
        zero_mm = scales.zeros_mm.get(experiment.name, 0.0)
        defaults = wire_defaults(experiment.length_mm, scales, experiment.control, zero_mm)
        wanted = SAMPLE if likelihood == "chain" else ("sensor_sd",)
        distributions |= {f"{name}{mark}": defaults[name] for name in wanted}
        own = [effect for effect in effects if effect.acts_on(experiment.name, experiment.control)]
        distributions |= {f"{c}{mark}": a.prior for c, a in _amplitudes(own) if a.of_each_test}
    units = scales.units
    learned = {c for e in effects for c, a in zip(e.columns(), e.amplitudes, strict=True) if a.in_natural_units}
    every = {
        name: d if name in learned or not hasattr(d, "dist") else scaled(d, units.of(unit_of_column(name, samples)))
        for name, d in distributions.items()
    }
    stated = _apply_tables(every, experiments, several)
    fixed = {name: float(d) for name, d in every.items() if isinstance(d, int | float)}
    shapes = {c for e in effects for c, a in zip(e.columns(), e.amplitudes, strict=True) if a.is_shape}
    free = {name: d for name, d in every.items() if name not in fixed}
    logarithmic = frozenset(n for n, d in free.items() if n.split("[")[0] in _POSITIVE | shapes and d.support()[0] >= 0)
    powers = _default_powers([name for name in free if name not in stated], fixed, units)
    return Problem(
        tuple(samples), Prior(free, fixed, logarithmic, powers), likelihood, scales=scales, stated=frozenset(stated)
    )


def default_prior(
    length_mm: float, scales: Scales, instead: Mapping[str, Any], control: Control = "displacement"
) -> Prior:
    """The plain model's prior for a wire of this length, in mm, N and s.

    Parameters
    ----------
    length_mm : float
    scales : Scales
        Of the test, which defaults refer to.
    instead : mapping of name to float or scipy frozen distribution
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
    fixed = {name: d for name, d in every.items() if isinstance(d, float)}
    free = {name: d for name, d in every.items() if name not in fixed}
    powers = _default_powers([name for name in free if name not in instead], fixed, units)
    return Prior(free, fixed, frozenset(_POSITIVE & free.keys()), powers)


def _default_powers(names: Sequence[str], fixed: Mapping[str, float], units: Units) -> dict[str, Power]:
    """Of the defaults of B and k2, which speak of the creep at the typical tension and of the hazard after a hold."""
    logs = {"B": ("U", float(np.log(units.tension_N))), "k2": ("N", float(np.log(units.time_s)))}
    out = {}
    for name in names:
        base, bracket, mark = name.partition("[")
        if base in logs:
            exponent, log_base = logs[base]
            column = f"{exponent}{bracket}{mark}"
            out[name] = Power(fixed.get(column, column), log_base)
    return out


_UNITS = {"k1": "N", "B": "mm", "preload": "mm"}
_ERRORS = {"sensor_sd": READ_UNIT, "setting_sd": SET_UNIT}


def unit_of_column(name: str, samples: Sequence[Sample]) -> str:
    """The unit of a column in mm, N and s; of ``B`` and ``k2`` without the part that depends on U and N.

    Parameters
    ----------
    name : str
    samples : sequence of Sample
        Of the problem: what is set and what is read decides the units of errors and of amplitudes of instruments.
    """
    base, _, mark = name.partition("[")
    if base in _UNITS:
        return _UNITS[base]
    own = mark.rstrip("]")
    here = [s for s in samples if s.name == own] or [s for s in samples if s.protocol.control == own] or samples
    if base in _ERRORS:
        return _ERRORS[base][here[0].protocol.control if here else "displacement"]
    for sample in here:
        for effect in sample.model.effects:
            for column, amplitude in zip(effect.columns(), effect.amplitudes, strict=True):
                if column == base:
                    return effect.unit_under(amplitude, sample.protocol.control)
    return "-"


def _ratio(unit: str, old: Units, new: Units) -> float:
    """What a number in old units is multiplied by in new ones."""
    return old.of(unit) / new.of(unit)


def _sample_in(sample: Sample, old: Units, new: Units) -> Sample:
    """The same sample in other units."""
    length, tension, time = (_ratio(unit, old, new) for unit in ("mm", "N", "s"))
    p, model = sample.protocol, sample.model
    set_, read = (_ratio(units[p.control], old, new) for units in (SET_UNIT, READ_UNIT))
    protocol = replace(
        p,
        length_mm=p.length_mm * length,
        setting=p.setting * set_,
        time_s=p.time_s * time,
        duration_s=p.duration_s * time,
    )
    changed = replace(
        model,
        effects=tuple(effect.in_units(tension, time) for effect in model.effects),
        tension_ref_N=model.tension_ref_N * tension,
        length_ref_mm=model.length_ref_mm * length,
    )
    return replace(
        sample,
        protocol=protocol,
        readings=sample.readings * read,
        resolution=sample.resolution * read,
        model=changed,
    )


def _reference_length(members: Sequence[Experiment]) -> float:
    """Geometric mean of the lengths, mm: B belongs to it."""
    return geometric_mean(e.length_mm for e in members)


def _material_priors(
    members: Sequence[Experiment],
    effects: Sequence[Effect],
    mark: str,
    length_exponent: Any,
    scales: Scales,
    likelihood: Likelihood,
) -> dict[str, Any]:
    """Default priors of what the samples of one material share; `mark` distinguishes materials in the names."""
    defaults = wire_defaults(_reference_length(members), scales)
    stiff = likelihood == "chain" or any(e.control == "displacement" for e in members)
    wanted = MATERIAL if stiff else tuple(name for name in MATERIAL if name != "k1")
    out: dict[str, Any] = {f"{name}{mark}": defaults[name] for name in wanted}
    if len({e.length_mm for e in members}) > 1:
        out[f"{LENGTH_EXPONENT}{mark}"] = length_exponent
    of_wire = [effect for effect in effects if effect.scope == "material"]
    return out | {f"{c}{mark}": a.prior for c, a in _amplitudes(of_wire) if not a.of_each_test}


def _instrument_priors(experiments: Sequence[Experiment], effects: Sequence[Effect]) -> dict[str, Any]:
    """Priors of what does not belong to the wire: steps and weights are read by different instruments, each its own."""
    controls = dict.fromkeys(e.control for e in experiments)
    out: dict[str, Any] = {}
    for effect in (effect for effect in effects if effect.scope != "material"):
        apart = len(controls) > 1 and effect.scope != "event"
        marks = [f"[{control}]" for control in controls if effect.control in (None, control)] if apart else [""]
        out |= {f"{c}{mark}": a.prior for mark in marks for c, a in _amplitudes([effect]) if not a.of_each_test}
    return out


def _amplitudes(effects: Sequence[Effect]) -> list[tuple[str, Amplitude]]:
    """The amplitudes of effects with the names of their columns."""
    return [pair for effect in effects for pair in zip(effect.columns(), effect.amplitudes, strict=True)]


def _samples(
    members: Sequence[Experiment], effects: Sequence[Effect], law: ElasticLaw, history: History
) -> list[Sample]:
    """The experiments of one material as the likelihood sees them."""
    tension = tension_reference(np.concatenate([e.tension()[e.protocol().mask] for e in members]))
    length = _reference_length(members) if len(members) > 1 else 0.0
    out = []
    for e in members:
        present = tuple(x for x in effects if x.acts_on(e.name, e.control))
        model = Model(law, history, present, tension, length)
        finest = max(e.resolution, FINEST * _extent(e))
        out.append(Sample(e.name, e.material, e.protocol(), e.readings()[..., None], finest, model))
    return out


def _extent(experiment: Experiment) -> float:
    """The largest tension that was read, or the range of displacements, whose zero means nothing."""
    read = [hold.readings for hold in experiment.recorded_holds]
    if not read:
        return 0.0
    values = np.concatenate(read)
    return float(np.ptp(values) if experiment.control == "force" else np.abs(values).max())


def _apply_tables(distributions: dict[str, Any], experiments: Sequence[Experiment], several: bool) -> set[str]:
    """Put the priors of the files in place of the defaults, and return the columns that have one."""
    stated = set()
    everything = set(MATERIAL) | set(SAMPLE) | {LENGTH_EXPONENT}
    for experiment in experiments:
        for name, table in experiment.priors.items():
            line = experiment.prior_lines.get(name)
            key = f"{experiment.source}{f', line {line}' if line else ''}: prior.{name}"
            wanted = possible(key, name, from_table(key, table))
            marks = experiment.name, experiment.material, experiment.control
            hits = [c for c in (*(f"{name}[{mark}]" for mark in marks), name) if c in distributions]
            if hits:
                distributions[hits[0]] = wanted
                stated.add(hits[0])
            elif name not in everything and "." not in name:
                known = f"one of {', '.join(sorted(everything))}, or effect.parameter"
                raise InputError(f"{key}: found no such parameter{hint(name, sorted(everything))}, expected {known}")
    return stated


def at_length(own: Mapping[str, Array], effects: Sequence[Effect], ratio: float, exponent: Any) -> dict[str, Array]:
    """Parameters of a sample of another length than the reference: whatever is an elongation of the wire has grown.

    The creep amount `B` grows as the ratio to the power `exponent`, an effect's elongation as the ratio itself.

    Parameters
    ----------
    own : mapping of name to (n,) array
        Parameters at the reference length.
    effects : sequence of Effect
        Those of the model; they say which of their amplitudes are elongations.
    ratio : float
        Length of the sample over the reference length.
    exponent : float or (n,) array
        1 where creep is a strain of the whole wire, 0 where it does not depend on the length.

    Returns
    -------
    dict of name to array
    """
    grown = [c for e in effects for c, a in zip(e.columns(), e.amplitudes, strict=True) if a.is_elongation]
    return {**own, "B": own["B"] * ratio**exponent, **{name: own[name] * ratio for name in grown}}


def with_readings(problem: Problem, readings: Sequence[Array]) -> Problem:
    """The same problem with other readings, per sample (H, R, 1)."""
    return replace(
        problem, samples=tuple(replace(s, readings=y) for s, y in zip(problem.samples, readings, strict=True))
    )


def with_protocols(problem: Problem, protocols: Sequence[Protocol], readings: Sequence[Array]) -> Problem:
    """The same parameters on other holds, per sample.

    Parameters
    ----------
    problem : Problem
    protocols : sequence of Protocol
        One a sample, in the problem's order.
    readings : sequence of (H, R, 1) arrays
        One a sample, padded as its protocol is, N.

    Returns
    -------
    Problem
    """
    return replace(
        problem,
        samples=tuple(
            replace(s, protocol=p, readings=y) for s, p, y in zip(problem.samples, protocols, readings, strict=True)
        ),
    )

"""Synthetic tests with known truth: what a bench would have written down, in the format the toolkit reads.

A bench says what was done, a truth what the wire is; whatever the truth leaves open is drawn from the prior. Setting
errors enter the staircase exactly, readings get the sensor's error and are rounded.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from pathlib import Path

import numpy as np

from wirebayes.errors import InputError
from wirebayes.io.experiment import Experiment
from wirebayes.io.experiment_file import Entry, toml_of
from wirebayes.io.readings import READ, SET, Hold
from wirebayes.io.run_folder import write_csv, write_json, write_text
from wirebayes.json_files.truth import TrueWire, TruthJson
from wirebayes.model.build import build
from wirebayes.model.column_units import parameter_of
from wirebayes.model.problem import Problem, with_readings
from wirebayes.model.replicate import rounded
from wirebayes.model.sample import Sample
from wirebayes.model.scales import TYPICAL_K1_N, planned_scales, typical_tension
from wirebayes.model.spec import ModelSpec
from wirebayes.numeric.frozen import frozen
from wirebayes.numeric.means import geometric_mean
from wirebayes.numeric.typing import Array, Floats
from wirebayes.strict.hint import hint
from wirebayes.wire.effect import Effect
from wirebayes.wire.laws import ElasticLaw, History
from wirebayes.wire.model import tension_reference
from wirebayes.wire.protocol import Control
from wirebayes.wire.staircase import simulate
from wirebayes.wire.walk import Theta

FILE, TRUTH = "experiments.toml", "truth.json"
PAPER_TIMES_S = (0.0, 30.0, 60.0, 90.0, 120.0)  # when the paper read its holds


@dataclass(frozen=True)
class Bench:
    """What is done to one sample.

    Attributes
    ----------
    name, material : str
        Samples of one material share its parameters.
    length_mm, resolution_N : float
        Resolution 0 writes tensions as they are.
    displacements_mm : sequence of float
        One a hold; holds are numbered from 1.
    weights_N : sequence of float
        One a hold, in place of displacements: tensions are set, and displacements are read.
    resolution_mm : float
        With weights; 0 writes displacements as they are.
    times_s : sequence of float, or one such sequence a hold
        Reading times since the hold began.
    unrecorded : set of int
        Numbers of holds of which no reading is kept; they last as long as they would have been read.
    temperatures_C : sequence of float
        Temperatures at evenly spaced moments of the test, straight lines between; empty for no log.
    """

    name: str = "simulated"
    material: str = "simulated"
    length_mm: float = 1000.0
    resolution_N: float = 0.01
    displacements_mm: Sequence[float] = tuple(range(1, 13))
    times_s: Sequence[float] | Sequence[Sequence[float]] = PAPER_TIMES_S
    unrecorded: frozenset[int] = frozenset()
    temperatures_C: Sequence[float] = ()
    weights_N: Sequence[float] = ()
    resolution_mm: float = 0.01

    @property
    def control(self) -> Control:
        """What is set."""
        return "force" if len(self.weights_N) else "displacement"

    @property
    def settings(self) -> Sequence[float]:
        """One a hold: displacements, mm, or tensions, N."""
        return self.weights_N if len(self.weights_N) else self.displacements_mm

    @property
    def resolution(self) -> float:
        """The resolution of what is read."""
        return self.resolution_mm if self.control == "force" else self.resolution_N

    def setting(self, control: Control, settings: Sequence[float], resolution: float) -> "Bench":
        """This bench with what is set in each hold.

        Parameters
        ----------
        control : {"displacement", "force"}
        settings : sequence of float
            Displacements, mm, or weights, N.
        resolution : float
            Of what is read then.
        """
        if control == "force":
            return replace(self, weights_N=settings, resolution_mm=resolution)
        return replace(self, displacements_mm=settings, resolution_N=resolution)

    def experiment(self) -> Experiment:
        """The test with readings still at zero."""
        is_ragged = np.ndim(self.times_s[0]) > 0
        each = (
            [np.array(times) for times in self.times_s] if is_ragged else [np.array(self.times_s)] * len(self.settings)
        )
        starts = np.concatenate([[0.0], np.cumsum([times[-1] for times in each])])
        holds = []
        for i, (setting, times) in enumerate(zip(self.settings, each, strict=True)):
            recorded = i + 1 not in self.unrecorded
            kept = times if recorded else times[:0]
            holds.append(
                Hold(
                    i + 1 if len(kept) else None,
                    float(setting),
                    float(times[-1]),
                    frozen(kept.tolist()),
                    frozen([0.0] * len(kept)),
                    self._log(starts[i] + kept, starts[-1]),
                    float(starts[i]),
                    self.control,
                )
            )
        return Experiment(
            self.name, self.material, self.length_mm, self.resolution, tuple(holds), Path(FILE), control=self.control
        )

    def _log(self, time_s: Array, whole_s: float) -> Floats | None:
        """Temperatures at times of a test that lasts so long."""
        if not len(self.temperatures_C):
            return None
        moments = np.linspace(0.0, whole_s, len(self.temperatures_C))
        # logged to a hundredth of a degree, and the wire follows the log
        logged = np.round(np.interp(time_s, moments, self.temperatures_C), 2)
        return frozen(logged.tolist())


@dataclass(frozen=True)
class Truth:
    """What the wire is; parameters that are not named are drawn from the prior.

    Attributes
    ----------
    parameters : mapping of name to value
        ``k1``, ``setting_sd``, ``strain_stiffening.c`` …; ``k1[material]`` or ``preload[name]`` for one of several.
    effects : sequence of Effect
    law, history
        See `wirebayes.wire.laws`.
    """

    parameters: Mapping[str, float] = field(default_factory=dict)
    effects: Sequence[Effect] = ()
    law: ElasticLaw = "hooke"
    history: History = "saturating"


@dataclass(frozen=True)
class Simulated:
    """Synthetic tests.

    Attributes
    ----------
    problem : Problem
        Holds the simulated readings.
    theta : (1, d) array
        The truth, in the problem's columns.
    setting_error : list of (H,) arrays
        Of every hold, mm, or N under weights, per sample.
    noise_free : list of (H, R) arrays
        Readings with the setting errors, before sensor error and rounding.
    """

    problem: Problem
    theta: Array
    setting_error: list[Array]
    noise_free: list[Array]


def draw(benches: Sequence[Bench], truth: Truth = Truth(), seed: int | np.random.SeedSequence = 0) -> Simulated:
    """Simulate tests without writing them.

    Raises
    ------
    InputError
        If a parameter is unknown or impossible.

    Parameters
    ----------
    benches : sequence of Bench
        What was done to each sample. Samples of one material share their wire.
    truth : Truth
        The wire. Parameters that it leaves open are drawn from the prior.
    seed : int or numpy.random.SeedSequence
    """
    rng = np.random.default_rng(seed)
    tests = [bench.experiment() for bench in benches]
    scales = planned_scales(tests, _middle_stiffness(truth))
    spec = ModelSpec(truth.law, truth.history)
    problem = build(tests, truth.effects, spec, scales=scales)
    theta = problem.prior.rvs(1, rng)
    for name, value in truth.parameters.items():
        theta[0, _columns(problem, name, value)] = value
    problem = _referred(problem, theta)
    settings = []
    clean = []
    readings = []
    for sample in problem.samples:
        own = problem.parameters(theta, sample)
        setting, exact, read = _read(sample, own, rng)
        _check_carried(sample, own, read)
        settings.append(setting[:, 0])
        clean.append(exact[..., 0])
        readings.append(read)
    return Simulated(with_readings(problem, readings), theta, settings, clean)


def _read(sample: Sample, own: Theta, rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """Setting errors (H, 1), what would be read without noise, and what is read, (H, R, 1) each."""
    protocol = sample.protocol
    holds = len(protocol.setting)
    setting = rng.normal(size=(holds, 1)) * own["setting_sd"]
    exact = simulate(protocol, own, sample.model, setting)
    noise = rng.normal(size=exact.shape) * own["sensor_sd"]
    read = rounded(exact + noise, sample.resolution)
    recorded = protocol.mask[..., None]
    return setting, exact, np.where(recorded, read, 0.0)


def _check_carried(sample: Sample, own: Theta, read: Array) -> None:
    """Refuse a weight under which the wire has no length."""
    protocol = sample.protocol
    for weight, readings in zip(protocol.setting, read, strict=True):
        if not np.isfinite(readings).all():
            carries = f"a wire with k1 = {own['k1'][0]:g} N, which by the {sample.model.law} law carries less"
            expected = "smaller weights or a larger k1"
            raise InputError(f"{sample.name}, hold of {weight:g} N: found {carries}, expected {expected}")


def _middle_stiffness(truth: Truth) -> float:
    """The stiffness that a truth states, or a typical one, N."""
    stated = [value for name, value in truth.parameters.items() if parameter_of(name) == "k1" and value > 0]
    return geometric_mean(stated) if stated else TYPICAL_K1_N


def _columns(problem: Problem, name: str, value: float) -> list[int]:
    """Columns of a parameter, one or one a sample, which may have the value."""
    names = problem.names
    bare = parameter_of(name)
    columns = []
    for i, column in enumerate(names):
        if name in (column, parameter_of(column)):
            columns.append(i)
    if not columns:
        meant = hint(name, names)
        raise InputError(f"parameter {name}: no such parameter{meant}; there are {', '.join(names)}")
    for i in columns:
        distribution = problem.prior.distributions[names[i]]
        low, high = distribution.support()
        if bare == "setting_sd":
            high = np.inf  # a bench may be worse than its prior
        if not low <= value <= high:
            raise InputError(f"parameter {name}: found {value:g}, expected a number from {low:g} to {high:g}")
    return columns


def write_tests(folder: Path, benches: Sequence[Bench], truth: Truth = Truth(), seed: int = 0) -> Simulated:
    """Write ``experiments.toml``, a CSV a test, and ``truth.json`` into an existing folder.

    Parameters
    ----------
    benches : sequence of Bench
    """
    made = draw(benches, truth, seed)
    for bench, sample in zip(benches, made.problem.samples, strict=True):
        _write_readings(folder / f"{bench.name}.csv", bench.experiment(), sample)
    write_text(folder / FILE, "\n".join(_table(bench) for bench in benches))
    truths = {sample.name: _truth(made, i) for i, sample in enumerate(made.problem.samples)}
    content: TruthJson = {"seed": seed, "experiments": truths, "warnings": []}
    write_json(folder / TRUTH, content)
    return made


def _referred(problem: Problem, theta: Array) -> Problem:
    """The problem with what effects refer to as its own tensions have it, found by a few repetitions."""
    for _ in range(5):
        tensions = [_tensions(problem, theta, sample) for sample in problem.samples]
        typical_N = geometric_mean(typical_tension(own) for own in tensions)
        samples = []
        for sample in problem.samples:
            pairs = zip(tensions, problem.samples, strict=True)
            of_material = [own for own, other in pairs if other.material == sample.material]
            reference = tension_reference(np.concatenate(of_material))
            typical = sample.model.typical._replace(tension_N=typical_N)
            samples.append(replace(sample, model=replace(sample.model, tension_ref_N=reference, typical=typical)))
        problem = replace(problem, samples=tuple(samples))
    return problem


def _tensions(problem: Problem, theta: Array, sample: Sample) -> Array:
    """(k,) tensions of all readings of a sample, as set or without noise."""
    protocol = sample.protocol
    if protocol.control == "force":
        return np.broadcast_to(protocol.setting[:, None], protocol.mask.shape)[protocol.mask]
    return simulate(protocol, problem.parameters(theta, sample), sample.model)[protocol.mask, 0]


def _write_readings(path: Path, experiment: Experiment, sample: Sample) -> None:
    digits = None
    if sample.resolution:
        step = Decimal(repr(sample.resolution)).normalize()
        digits = max(0, -int(step.as_tuple().exponent))
    rows = []
    for hold, readings in zip(experiment.holds, sample.readings[..., 0], strict=True):
        for i, time in enumerate(hold.time_s):
            read = float(readings[i])
            if digits is not None:
                read = round(read, digits)
            read += 0.0  # no minus before a zero
            row = [hold.number, hold.setting, time, read]
            if hold.temperature_C is not None:
                row.append(hold.temperature_C[i])
            rows.append(row)
    control = experiment.control
    header = ["hold", SET[control], "time_s", READ[control], "temperature_C"]
    columns = len(rows[0])
    write_csv(path, header[:columns], rows)


def _table(bench: Bench) -> str:
    experiment = bench.experiment()
    return toml_of(experiment, unrecorded=_gaps(experiment))


def _gaps(experiment: Experiment) -> list[Entry]:
    """Unrecorded holds as an experiment file states them, each by the recorded one that follows it."""
    gaps = []
    following = None
    for hold in reversed(experiment.holds):
        if hold.recorded:
            following = hold.number
        else:
            setting = SET[experiment.control]
            gaps.append({"before_hold": following, setting: hold.setting, "duration_s": hold.duration_s})
    return gaps[::-1]


def _truth(made: Simulated, i: int) -> TrueWire:
    sample = made.problem.samples[i]
    model = sample.model
    protocol = sample.protocol
    own = made.problem.parameters(made.theta, sample)
    parameters = {}
    for name, value in own.items():
        parameters[name] = float(value[0])
    out: TrueWire = {
        "material": sample.material,
        "elastic_law": model.law,
        "history": model.history,
        "effects": [effect.key for effect in model.effects],
        "parameters": parameters,
        "tension_ref_N": model.tension_ref_N,
        "typical_tension_N": model.typical.tension_N,
        "typical_hold_s": model.typical.hold_s,
    }
    noise_free = []
    for row, kept in zip(made.noise_free[i], protocol.mask, strict=True):
        noise_free.append(row[kept])
    error = made.setting_error[i]
    if protocol.control == "force":
        return {**out, "setting_N": error, "noise_free_mm": noise_free}
    return {**out, "setting_mm": error, "noise_free_N": noise_free}

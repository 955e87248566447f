"""What a test would teach before it is done."""

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.random import Generator

from wirebayes._version import __version__
from wirebayes.commands.options import above_zero, check_priors, check_seed, model_spec, names_given, path_of
from wirebayes.commands.plan_content import PlanRequest, plan_content, protocol_content
from wirebayes.commands.predict import find_posterior
from wirebayes.commands.wires import RobotLike, hash_of, identity_of, robot_of
from wirebayes.discovery.next_measurement import other_measurements
from wirebayes.effects import catalogue, source_of
from wirebayes.errors import InputError
from wirebayes.inference.fit import seed_of
from wirebayes.io.experiment import Experiment
from wirebayes.io.experiment_file import read_experiments, select
from wirebayes.io.plan_file import PlanFile, PlannedTest, is_plan, read_plan
from wirebayes.io.readings import Hold
from wirebayes.io.run_folder import CONFIGURATION, open_run, read_json, write_json
from wirebayes.json_files.discovery import DiscoveryJson
from wirebayes.json_files.plain import plain
from wirebayes.model.sample import Sample
from wirebayes.model.spec import PLAIN_SPEC, ModelSpec
from wirebayes.numeric.frozen import frozen
from wirebayes.planning.guess import GuessedWire, from_posterior, from_readings, from_tables
from wirebayes.planning.ranking import Judged, ranked
from wirebayes.planning.sensitivity import sensitivity
from wirebayes.planning.widths import at_centre, expected_widths, middle_tension
from wirebayes.processes.workers import computing
from wirebayes.progress import Progress, silent
from wirebayes.result_warnings import Notice
from wirebayes.results import read_back
from wirebayes.sentences import spoken
from wirebayes.simulation.synthetic import Bench
from wirebayes.strict.files import PathLike
from wirebayes.views.plan import Plan
from wirebayes.views.result import ResultFolder
from wirebayes.wire.effect import Kinds
from wirebayes.wire.laws import ElasticLaw, History

TESTS = 120  # simulated of each protocol: a mean width is then known to some 5 %
_ROBOT_TESTS = 5  # simulated tests whose posteriors move a robot
REPEAT = "again"

Aim = Literal["parameters", "creep"] | Sequence[str]


def plan(
    source: PathLike | Experiment,
    *,
    experiment: str | None = None,
    budget_min: float | None = None,
    robot: RobotLike | None = None,
    aim: Aim | None = None,
    tests: int = TESTS,
    elastic_law: ElasticLaw = "hooke",
    history: History = "saturating",
    own_effects: PathLike | None = None,
    seed: int = 0,
    output: PathLike | None = None,
    progress: Progress | None = None,
) -> Plan:
    """Find what a test would teach before it is done.

    Parameters
    ----------
    source : path, or Experiment
        A plan file with ``[[protocol]]`` tables; or an experiment or its file, then the same test again is compared
        with tests like it; or the folder of a ``fit`` or ``discover``, then its posterior is the guess.
    experiment : str, optional
        Which one, where there are several.
    budget_min : float, optional
        Time there is, minutes; longer tests come last.
    robot : Robot, name or path, optional
        Whose drift within an hour is to be known.
    aim : "parameters", "creep", or two effects, optional
        What the tests are ranked by: how much they say about the material, how well the creep after an hour is known,
        or how well two effects would be distinguished. Left out, it is the plan file's; for a ``discover`` that could
        not decide, the two effects it ranks first; else the parameters.
    tests : int
        Simulated tests of each protocol.
    elastic_law, history
        Of the plain model, as in `fit`; where the guess is a posterior, those of its fit.
    own_effects : path, optional
        A Python file with effects of your own.
    seed : int
    output : path, optional
        Folder for the results, resumed or refused as by `fit`.
    progress : function of (name, done, total), optional

    Returns
    -------
    Plan
        Its `summary` is the content of ``plan.json``.

    Raises
    ------
    InputError
        Something that was given is wrong.

    Examples
    --------
    >>> planned = wb.plan(kite.first(5), tests=20, output="out/plan")
    >>> planned
    Plan(5 protocols, best unload-dense)
    >>> planned.best["parameters"]["k1"]["sd"] < planned.summary()["guess"]["parameters"]["k1"]["sd"]
    True
    """
    spec = model_spec(elastic_law, history)
    seed = check_seed(seed)
    own = path_of(own_effects)
    _check_tests(tests)
    if budget_min is not None:
        above_zero(("--budget-min", budget_min))
    kinds = catalogue(own)
    rng = np.random.default_rng(seed_of(seed, "guess"))
    request = _request(source, experiment, tests, kinds, spec, own, rng)
    spec = request.spec
    if aim is not None:
        request = replace(request, aim=_checked_aim(aim, list(kinds)))
    if budget_min is not None:
        request = replace(request, budget_min=float(budget_min))
    if robot is not None:
        request = replace(request, robot=robot)
    machine = None if request.robot is None else robot_of(request.robot)
    configuration = {
        "command": "plan",
        "version": __version__,
        "seed": seed,
        "elastic_law": spec.law,
        "history": spec.history,
        "own_effects": source_of(own),
        "tests": tests,
        "aim": list(request.aim),
        "budget_min": request.budget_min,
        "robot": _identity(request.robot),
    } | request.about
    place = ResultFolder.at(output)
    with open_run(place.path, configuration) as opened:
        if opened.state == "done":
            return Plan(place, own, computed=False)
        with computing():
            judged = _judged(request, kinds, spec, seed, progress or silent)
        order = ranked(judged, request.aim, request.budget_min)
        rows = [protocol_content(j, request, place_in, machine, spec) for place_in, j in enumerate(order, 1)]
        summary = plan_content(rows, request, machine)
        write_json(opened.directory / "plan.json", summary)
        from wirebayes.report.pictures.plan import widths_and_effects  # matplotlib only where it is needed

        widths_and_effects(plain(summary), opened.directory / "plan.svg")
        opened.finish()
    return Plan(place, own)


def _check_tests(tests: object) -> None:
    if isinstance(tests, bool) or not isinstance(tests, int) or tests < 2:
        raise InputError(f"tests: found {tests!r}, expected a whole number, 2 or more")


def _judged(request: PlanRequest, kinds: Kinds, spec: ModelSpec, seed: int, report: Progress) -> list[Judged]:
    """What each test would teach, and what it would show of missing effects."""
    planned = []
    for test, words in request.tests:
        guess = request.guess.at(test)
        planned.append((at_centre(test, guess, spec), words))
    first, _ = planned[0]
    stated = {  # all state their creep for the same wire
        "tension_N": middle_tension(first),
        "length_mm": request.guess.length_mm,
    }
    kept = 0 if request.robot is None else _ROBOT_TESTS
    judged = []
    for done, (test, words) in enumerate(planned):
        report("protocols", done, len(planned))
        guess = request.guess.at(test)
        own_seed = seed_of(seed, "plan", test.name)
        rng = np.random.default_rng(own_seed)
        try:
            expected = expected_widths(test, guess, rng, spec, **stated, kept_draws=kept)
        except ValueError as error:
            raise InputError(f"{test.source}, protocol {test.name}: {error} at this guess") from None
        seen = sensitivity(test, guess, kinds, rng, spec)
        judged.append(Judged(test, words, expected, seen))
    report("protocols", len(planned), len(planned))
    return judged


def _identity(robot: RobotLike | None) -> str | None:
    """What decides a robot's part in the results: a hash of its content."""
    return None if robot is None else identity_of(robot)


def _request(
    source: PathLike | Experiment,
    name: str | None,
    n: int,
    kinds: Kinds,
    spec: ModelSpec,
    own: Path | None,
    rng: Generator,
) -> PlanRequest:
    """Tests and guess of whatever was given."""
    if isinstance(source, Experiment):
        (measured,) = select([source], name)
        return _of_experiment(measured, n, kinds, spec, rng)
    if not isinstance(source, str | os.PathLike):
        raise InputError(f"source: found {type(source).__name__}, expected a path or an Experiment")
    path = Path(source)
    if path.is_dir():
        return _of_folder(path, name, n, kinds, spec, own)
    if is_plan(path):
        written = read_plan(path, list(kinds))
        return _of_plan(written, name, n, kinds, spec, own, rng)
    read = read_experiments(path)
    first, *others = select(read, name)
    if others:
        names = ", ".join(experiment.name for experiment in (first, *others))
        raise InputError(f"{source}: found the experiments {names}, expected one of them as --experiment")
    return _of_experiment(first, n, kinds, spec, rng)


def _of_experiment(measured: Experiment, n: int, kinds: Kinds, spec: ModelSpec, rng: Generator) -> PlanRequest:
    """The same test again, and others like it."""
    check_priors([measured], kinds, spec=spec)
    guess = from_readings(measured, n, rng, spec)
    about = {"data_sha256": measured.data_hash, "priors": measured.priors}
    return PlanRequest(_like(measured), guess, ("parameters",), None, None, about, spec)


def _of_plan(
    file: PlanFile, name: str | None, n: int, kinds: Kinds, spec: ModelSpec, own: Path | None, rng: Generator
) -> PlanRequest:
    planned = [_experiment(test, file) for test in file.tests]
    for test in planned:
        check_priors([test], kinds)
    about: dict[str, Any] = {}
    if file.posterior is None:
        guess = from_tables(file.guess, file.guess_lines, file.source, planned, n, rng)
    else:
        earlier, sample, _ = _posterior(file.posterior, name, n, own)
        about["posterior"] = hash_of(earlier.draws)
        spec = _spec_of_fit(sample, spec, file.posterior)
        guess = earlier.on_benches_of(planned, rng)
    about["guess"] = file.guess
    about["priors"] = file.priors
    about["material"] = file.material
    about["protocols"] = [vars(test) for test in file.tests]
    tests = [(test, "") for test in planned]
    return PlanRequest(tests, guess, file.aim, file.budget_min, file.robot, about, spec)


def _of_folder(folder: Path, name: str | None, n: int, kinds: Kinds, spec: ModelSpec, own: Path | None) -> PlanRequest:
    """The folder of a fit or discover: the same test again, and others like it, with the priors of that fit."""
    guess, sample, place = _posterior(folder, name, n, own)
    spec = _spec_of_fit(sample, spec, folder)
    measured = replace(_measured(sample, folder), priors=_priors_of_fit(place, sample.name))
    about = {"posterior": hash_of(guess.draws), "priors": measured.priors}
    rivals = [effect for effect in _rivals(folder / "discovery.json", sample.name) if effect in kinds]
    aim = tuple(rivals[:2]) if len(rivals) > 1 else ("parameters",)
    return PlanRequest(_like(measured), guess, aim, None, None, about, spec)


def _spec_of_fit(sample: Sample, asked: ModelSpec, folder: Path) -> ModelSpec:
    """The plain model of an earlier fit, which its draws belong to; an `InputError` where another was asked for."""
    model = sample.model
    options = (
        ("--elastic-law", asked.law, PLAIN_SPEC.law, model.law),
        ("--history", asked.history, PLAIN_SPEC.history, model.history),
    )
    for option, wanted, left_out, fitted in options:
        if wanted not in (left_out, fitted):
            raise InputError(f"{option}: found {wanted}, expected {fitted}, with which {folder} was fitted")
    return replace(asked, law=model.law, history=model.history)


def _priors_of_fit(place: Path, name: str) -> dict[str, dict[str, Any]]:
    """What was stated before a fit whose posterior lies here: its configuration is there or just above."""
    here = place.absolute()
    for folder in (here, *list(here.parents)[:2]):
        file = folder / CONFIGURATION
        if file.is_file():
            priors: dict[str, dict[str, dict[str, Any]]] = read_json(file).get("priors", {})
            return priors.get(name, {})
    return {}


def _rivals(findings: Path, name: str) -> list[str]:
    """The effects between which a discovery did not decide, each once."""
    if not findings.is_file():
        return []
    report: DiscoveryJson = read_json(findings)
    if name not in report["experiments"]:
        return []
    found = report["experiments"][name]
    return list(dict.fromkeys([*found["set"], *found["group"]]))


def _posterior(folder: Path, name: str | None, n: int, own: Path | None) -> tuple[GuessedWire, Sample, Path]:
    """The guess by a fit, what was fitted, and where the posterior lies."""
    discovered = any(folder.glob("**/plain/posterior.nc"))
    model = "plain" if discovered else None
    which, place = find_posterior(folder, name, model)
    stored = read_back.load_posterior(place, which, own)
    if stored.likelihood == "hold":
        message = "found a fit with --likelihood hold, which knows no preload and no setting error, expected a chain"
        raise InputError(f"{folder}: {message}")
    sample = stored.sample
    length_mm = sample.protocol.length_mm
    source = f"the posterior of {sample.name} in {folder.name}"
    guess = from_posterior(stored.draws, length_mm, source, n)
    doubts = (*stored.doubts, *_left_out(sample))
    guess = replace(guess, doubts=doubts, control=sample.protocol.control)
    return guess, sample, place


def _left_out(sample: Sample) -> list[Notice]:
    """That tests are planned without the effects of the fit, if it has any."""
    if not sample.model.effects:
        return []
    effects = ", ".join(spoken(effect.name) for effect in sample.model.effects)
    text = (
        f"{sample.name} was fitted with {effects}: the plan simulates and fits without, and a fit of the whole model "
        "may know the parameters several times less well than is said"
    )
    return [Notice("left-out", text)]


def _experiment(test: PlannedTest, file: PlanFile) -> Experiment:
    bench = Bench(test.name, file.material, test.length_mm, times_s=test.times_s, temperatures_C=test.temperatures_C)
    bench = bench.setting(test.control, test.settings, test.resolution)
    return replace(bench.experiment(), source=file.source, priors=file.priors, prior_lines=file.prior_lines)


def _like(measured: Experiment) -> list[tuple[Experiment, str]]:
    """The same test again, and what else could be done with such a sample."""
    out = [(replace(measured, name=REPEAT), "repeat the test")]
    names = ("unload", "dense", "unload-dense", "half-steps")
    for name, other in zip(names, other_measurements(measured.protocol(), alone=True), strict=True):
        times = tuple(other.times_s.tolist())
        settings = tuple(other.setting.tolist())
        bench = Bench(name, measured.material, measured.length_mm, times_s=times)
        bench = bench.setting(measured.control, settings, measured.resolution)
        test = replace(bench.experiment(), source=measured.source, priors=measured.priors)
        out.append((test, other.words))
    return out


def _measured(sample: Sample, folder: Path) -> Experiment:
    """The experiment of a stored posterior, without its readings' temperatures."""
    protocol = sample.protocol
    holds = tuple(_hold(sample, row) for row in range(len(protocol.mask)))
    return Experiment(
        sample.name, sample.material, protocol.length_mm, sample.resolution, holds, folder, control=protocol.control
    )


def _hold(sample: Sample, row: int) -> Hold:
    """One hold of a stored posterior."""
    protocol = sample.protocol
    mask = protocol.mask[row]
    recorded = bool(mask.any())
    number = int(protocol.number[row]) if recorded else None
    times = protocol.time_s[row][mask]
    readings = sample.readings[row, :, 0][mask]
    temperatures = None
    if protocol.warming_K is not None and protocol.reference_C is not None and recorded:
        warm = protocol.warming_K[row][mask] + protocol.reference_C
        temperatures = frozen(warm.tolist())
    return Hold(
        number,
        float(protocol.setting[row]),
        float(protocol.duration_s[row]),
        frozen(times.tolist()),
        frozen(readings.tolist()),
        temperatures,
        float(protocol.start_s[row]),
        protocol.control,
    )


def _checked_aim(aim: Aim, effects: list[str]) -> tuple[str, ...]:
    words = names_given("--aim", aim)
    if words in (("parameters",), ("creep",)):
        return words
    are_two = len(words) == 2 and words[0] != words[1]
    if are_two and all(word in effects for word in words):
        return words
    expected = "parameters, creep, or two different effects of the catalogue"
    raise InputError(f"--aim: found {', '.join(map(str, words))}, expected {expected}")

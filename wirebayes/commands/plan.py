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
from wirebayes.commands.plan_guess import (
    decided_posterior,
    earlier_posterior,
    experiment_measured,
    guess_by,
    lasts,
    priors_of_fit,
    spec_of_fit,
    undecided_effects,
)
from wirebayes.commands.wires import RobotLike, hash_of, identity_of, robot_of
from wirebayes.discovery.next_measurement import other_measurements
from wirebayes.effects import catalogue, source_of
from wirebayes.errors import InputError
from wirebayes.inference.fit import seed_of
from wirebayes.io.experiment import Experiment
from wirebayes.io.experiment_file import read_experiments, select
from wirebayes.io.plan_file import PlanFile, PlannedTest, is_plan, read_plan
from wirebayes.io.run_folder import open_run, write_json
from wirebayes.json_files.plain import plain
from wirebayes.model.spec import ModelSpec
from wirebayes.planning.guess import from_readings, from_tables
from wirebayes.planning.guessed_test import at_centre, middle_tension
from wirebayes.planning.ranking import Judged, ranked
from wirebayes.planning.sensitivity import sensitivity
from wirebayes.planning.widths import expected_widths
from wirebayes.processes.workers import computing
from wirebayes.progress import Progress, silent
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
    wanted = () if aim is None else _checked_aim(aim, list(kinds))
    request = _request(source, experiment, tests, kinds, spec, own, rng, wanted)
    spec = request.spec
    if wanted:
        request = replace(request, aim=wanted)
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
        rows = [protocol_content(j, request, place_in, machine) for place_in, j in enumerate(order, 1)]
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
    model = request.model
    planned = []
    for test, words in request.tests:
        guess = request.guess.at(test)
        planned.append((at_centre(test, guess, spec, model), words))
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
            expected = expected_widths(test, guess, rng, spec, guessed=model, **stated, kept_draws=kept)
        except ValueError as error:
            raise InputError(f"{test.source}, protocol {test.name}: {error} at this guess") from None
        seen = sensitivity(test, guess, kinds, rng, spec, model)
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
    aim: tuple[str, ...],
) -> PlanRequest:
    """Tests and guess of whatever was given."""
    if isinstance(source, Experiment):
        (measured,) = select([source], name)
        return _of_experiment(measured, n, kinds, spec, rng)
    if not isinstance(source, str | os.PathLike):
        raise InputError(f"source: found {type(source).__name__}, expected a path or an Experiment")
    path = Path(source)
    if path.is_dir():
        return _of_folder(path, name, n, kinds, spec, own, aim)
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
        stored, _ = earlier_posterior(file.posterior, name, own)
        earlier = guess_by(stored, file.posterior, n, ())
        about["posterior"] = hash_of(earlier.draws)
        spec = spec_of_fit(stored.sample, spec, file.posterior)
        guess = earlier.on_benches_of(planned, rng)
    about["guess"] = file.guess
    about["priors"] = file.priors
    about["material"] = file.material
    about["protocols"] = [vars(test) for test in file.tests]
    tests = [(test, "") for test in planned]
    return PlanRequest(tests, guess, file.aim, file.budget_min, file.robot, about, spec)


def _of_folder(
    folder: Path,
    name: str | None,
    n: int,
    kinds: Kinds,
    spec: ModelSpec,
    own: Path | None,
    aim: tuple[str, ...],
) -> PlanRequest:
    """The folder of a fit or discover: the same test again, and others like it, with the priors of that fit."""
    stored, place = decided_posterior(folder, name, own, aim) or earlier_posterior(folder, name, own)
    sample = stored.sample
    lasting = tuple(effect for effect in sample.model.effects if lasts(effect) and effect.name not in aim)
    guess = guess_by(stored, folder, n, lasting)
    spec = spec_of_fit(sample, spec, folder)
    measured = replace(experiment_measured(sample, folder), priors=priors_of_fit(place, sample.name))
    about = {"posterior": hash_of(guess.draws), "priors": measured.priors}
    rivals = [effect for effect in undecided_effects(folder / "discovery.json", sample.name) if effect in kinds]
    of_folder: tuple[str, ...] = ("parameters",)
    if len(rivals) > 1 and not lasting:  # what is in the model is no rival any more
        of_folder = tuple(rivals[:2])
    return PlanRequest(_like(measured), guess, of_folder, None, None, about, spec)


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


def _checked_aim(aim: Aim, effects: list[str]) -> tuple[str, ...]:
    words = names_given("--aim", aim)
    if words in (("parameters",), ("creep",)):
        return words
    are_two = len(words) == 2 and words[0] != words[1]
    if are_two and all(word in effects for word in words):
        return words
    expected = "parameters, creep, or two different effects of the catalogue"
    raise InputError(f"--aim: found {', '.join(map(str, words))}, expected {expected}")

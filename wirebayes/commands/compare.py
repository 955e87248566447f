"""Laws, histories, likelihoods and effects side by side."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from wirebayes._version import __version__
from wirebayes.commands.options import (
    Source,
    check_priors,
    check_seed,
    check_train_holds,
    data_of,
    experiments_of,
    model_spec,
    names_given,
    other_effort,
    path_of,
)
from wirebayes.comparison.candidates import BASE, ModelToCompare, candidates
from wirebayes.comparison.compare import POLICY, Task, judge_all, side_by_side
from wirebayes.effects import catalogue, source_of
from wirebayes.errors import InputError
from wirebayes.inference.policy import Policy
from wirebayes.io.data_checks import of_experiment
from wirebayes.io.experiment import Experiment
from wirebayes.io.run_folder import open_run, read_json, stored_results, write_json
from wirebayes.json_files.comparison import ComparedModels, ComparisonJson, ModelJson
from wirebayes.model.sample import Likelihood
from wirebayes.processes.workers import computing
from wirebayes.progress import Progress, silent
from wirebayes.result_warnings import Notice, notices_by_part
from wirebayes.sentences import counted
from wirebayes.strict.files import PathLike
from wirebayes.views.comparison import Comparison
from wirebayes.views.result import ResultFolder
from wirebayes.wire.effect import Kinds
from wirebayes.wire.laws import ElasticLaw, History

_LEAST_HOLDS = 3  # one is left out, and what creep of an earlier hold carries into a later one shows from two on


def compare(
    source: Source,
    *,
    experiment: str | None = None,
    train_holds: int | None = None,
    elastic_law: ElasticLaw = "hooke",
    history: History = "saturating",
    likelihood: Likelihood = "chain",
    only: str | Sequence[str] = (),
    own_effects: PathLike | None = None,
    seed: int = 0,
    output: PathLike | None = None,
    progress: Progress | None = None,
    policy: Policy | None = None,
) -> Comparison:
    """Compare models on readings that their fits have not seen.

    Every model is judged twice: each hold left out in turn, and the last third of the holds predicted from the rest.

    Parameters
    ----------
    source : path, Experiment, or sequence of Experiment
        What was measured; a path names an experiment file.
    experiment : str, optional
        This experiment only.
    train_holds : int, optional
        Fit the first so many recorded holds only, three or more, and predict all after them.
    elastic_law, history, likelihood
        Of the plain model, as in `fit`.
    only : sequence of str
        Compare only these models with the plain one.
    own_effects : path, optional
        A Python file with effects of your own, which join the comparison.
    seed : int
    output : path, optional
        Folder for the results, resumed or refused as by `fit`.
    progress : function of (name, done, total), optional
    policy : Policy, optional
        How many walkers and draws; what the command uses when left out.

    Returns
    -------
    Comparison
        Its `summary` is the content of ``comparison.json``.

    Raises
    ------
    InputError
        Something that was given is wrong, or fewer than three recorded holds are there or trained on.

    Examples
    --------
    >>> comparison = wb.compare(made.experiments, only="exponential", policy=few, output="out/compare")
    >>> sorted(row["name"] for row in comparison.summary()["experiments"]["wire"]["models"])
    ['exponential', 'plain']
    """
    planned = plan_comparison(
        source,
        experiment=experiment,
        train_holds=train_holds,
        elastic_law=elastic_law,
        history=history,
        likelihood=likelihood,
        only=only,
        own_effects=own_effects,
        seed=seed,
        policy=policy,
    )
    return carry_out(planned, output, progress)


@dataclass(frozen=True)
class ComparisonPlan:
    """A comparison whose every part was checked, and of which nothing is computed yet.

    Attributes
    ----------
    tasks : list of Task
    experiments : list of Experiment
    configuration : dict
        Everything that decides the results.
    seed : int
    policy : Policy
    own_effects : Path or None
    """

    tasks: list[Task]
    experiments: list[Experiment]
    configuration: dict[str, Any]
    seed: int
    policy: Policy
    own_effects: Path | None

    @property
    def warnings(self) -> tuple[Notice, ...]:
        """What is suspicious about the readings, worth knowing before the work begins."""
        return tuple(notice.of(one.name) for one in self.experiments for notice in of_experiment(one))


def plan_comparison(
    source: Source,
    *,
    experiment: str | None,
    train_holds: int | None,
    elastic_law: ElasticLaw,
    history: History,
    likelihood: Likelihood,
    only: str | Sequence[str],
    own_effects: PathLike | None,
    seed: int,
    policy: Policy | None = None,
) -> ComparisonPlan:
    """Check what `compare` is given.

    Parameters
    ----------
    source, experiment, train_holds, elastic_law, history, likelihood, only, own_effects, seed
        As for `wirebayes.compare`.
    policy : Policy, optional
        Another one than that of every comparison, for tests and studies.

    Returns
    -------
    ComparisonPlan

    Raises
    ------
    InputError
        If an option, an experiment, its priors or the name of a model is not usable.
    """
    spec = model_spec(elastic_law, history, likelihood)
    seed = check_seed(seed)
    train_holds = check_train_holds(train_holds)
    own = path_of(own_effects)
    names = names_given("only", only)
    experiments = experiments_of(source, experiment)
    known = catalogue(own)
    base = ModelToCompare(BASE, "", "The plain model.", spec)
    tasks = []
    models = {}
    for one in experiments:
        _check_holds(one, train_holds)
        check_priors([one], known, spec=spec)
        chosen = _chosen(one, base, known, names)
        tasks += [Task(one, candidate, train_holds, own) for candidate in chosen]
        models[one.name] = [candidate.name for candidate in chosen]
    configuration = {
        "command": "compare",
        "version": __version__,
        "seed": seed,
        "train_holds": train_holds,
        "elastic_law": elastic_law,
        "history": history,
        "likelihood": likelihood,
        "own_effects": source_of(own),
        "models": models,
        **data_of(experiments),
        **other_effort(policy),
    }
    return ComparisonPlan(tasks, experiments, configuration, seed, policy or POLICY, own)


def _check_holds(experiment: Experiment, train_holds: int | None) -> None:
    """Refuse a test that has not as many holds as are wanted, or too few to hold some out."""
    recorded = len(experiment.recorded_holds)
    experiment.first(recorded if train_holds is None else train_holds)
    if recorded < _LEAST_HOLDS:
        holds = counted(recorded, "recorded hold")
        found = (
            f"found {holds}, expected {_LEAST_HOLDS} or more: some are held out, and the others tell the models apart"
        )
        raise InputError(f"{experiment.source}, experiment {experiment.name}: {found}")
    if train_holds is not None and train_holds < _LEAST_HOLDS:
        found = f"found --train-holds {train_holds}, expected {_LEAST_HOLDS} or more"
        why = "each of them is left out in turn, and the others tell the models apart"
        raise InputError(f"{experiment.source}, experiment {experiment.name}: {found}: {why}")


def _chosen(experiment: Experiment, base: ModelToCompare, known: Kinds, names: Sequence[str]) -> list[ModelToCompare]:
    """The models to compare; every name that is given must be one of them."""
    chosen = candidates(experiment, base, known, names or None)
    missing = set(names) - {candidate.name for candidate in chosen}
    if missing:
        possible = ", ".join(candidate.name for candidate in candidates(experiment, base, known))
        raise InputError(f"--only {min(missing)}: no such model for {experiment.name}, expected one of {possible}")
    return chosen


def carry_out(plan: ComparisonPlan, output: PathLike | None, progress: Progress | None) -> Comparison:
    """Fit and judge all models of a plan.

    Parameters
    ----------
    plan : ComparisonPlan
    output : path, optional
        Folder of the results; a temporary one when left out. Models judged there already are not judged again.
    progress : callable or None
        Called with a name, what is done and the total.

    Returns
    -------
    Comparison
    """
    place = ResultFolder.at(output)
    path = place.path
    with open_run(path, plan.configuration) as opened:
        if opened.state == "done":
            return Comparison(place, plan.own_effects, computed=False)
        report = progress or silent
        tasks = plan.tasks
        with computing():
            judge_all(tasks, path, plan.seed, plan.policy, report=report)
        tables: dict[str, ComparedModels] = {}
        for one in plan.experiments:
            own_tasks = [task for task in tasks if task.experiment is one]
            files = [path / task.file for task in own_tasks]
            tables[one.name] = _compared(one, path / one.name, files)
        warnings = notices_by_part(tables)
        content: ComparisonJson = {"version": 1, "seed": plan.seed, "experiments": tables, "warnings": warnings}
        write_json(path / "comparison.json", content)
        opened.finish()
    return Comparison(place, plan.own_effects)


def _compared(experiment: Experiment, folder: Path, files: Sequence[Path]) -> ComparedModels:
    """The models of one experiment side by side, from the files of each; their pictures are drawn."""
    from wirebayes.report.pictures import compare as pictures  # matplotlib only where it is needed

    with stored_results(folder):
        models: list[ModelJson] = [read_json(file) for file in files]
        table = side_by_side(models, BASE, of_experiment(experiment))
    pictures.save_pictures(folder, experiment.name, table, models)
    return table

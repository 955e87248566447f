"""What the plain model is missing, added to it where it has a name."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

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
from wirebayes.discovery.investigation import Concluded, Investigation, JointModel, alternative_models, final_models
from wirebayes.discovery.search import catalogue_without, investigate
from wirebayes.discovery.settings import SIMULATIONS, Settings
from wirebayes.effects import catalogue, source_of
from wirebayes.inference.policy import DEFAULT, Policy
from wirebayes.io.experiment import Experiment
from wirebayes.io.next_hold import write_next_hold
from wirebayes.io.run_folder import open_run, read_json, write_bytes, write_json
from wirebayes.json_files.discovery import IntervalJson, ParameterReport
from wirebayes.json_files.summary import Parameter, SummaryJson
from wirebayes.model.spec import ModelSpec
from wirebayes.processes.copies import loaded_meanwhile, prepared_copy
from wirebayes.processes.workers import computing, give_way, workers
from wirebayes.progress import Progress, silent
from wirebayes.result_warnings import from_json, notices_by_part, to_json
from wirebayes.results.jobs import Job, begin, run
from wirebayes.results.mixture import write_mixture
from wirebayes.results.read_back import load_posterior
from wirebayes.strict.files import PathLike
from wirebayes.views.findings import Findings
from wirebayes.views.posterior import POSTERIOR, SUMMARY
from wirebayes.views.result import ResultFolder
from wirebayes.wire.laws import ElasticLaw, History

_PICTURES = "wirebayes.report.pictures.discover"
_GAPS = 10  # steps of niceness, a tenth of the weight
_OTHERS = "undecided"  # folder of the models that a final one shares the probability with


def discover(
    source: Source,
    *,
    experiment: str | None = None,
    train_holds: int | None = None,
    elastic_law: ElasticLaw = "hooke",
    history: History = "saturating",
    without: str | Sequence[str] = (),
    own_effects: PathLike | None = None,
    drop_breaks: bool = False,
    seed: int = 0,
    output: PathLike | None = None,
    progress: Progress | None = None,
    policy: Policy | None = None,
    simulations: int | None = None,
) -> Findings:
    """Find which physical effect the model is missing.

    The experiments are judged together.

    Parameters
    ----------
    source : path, Experiment, or sequence of Experiment
        What was measured; a path names an experiment file.
    experiment : str, optional
        This experiment only.
    train_holds : int, optional
        Use the first so many recorded holds only.
    elastic_law, history
        Of the plain model, as in `fit`.
    without : sequence of str
        Effects to leave out of the catalogue.
    own_effects : path, optional
        A Python file with effects of your own, which join the catalogue.
    drop_breaks : bool
        Leave out the readings of breaks, of sensors at their limit, and of dropouts.
    seed : int
    output : path, optional
        Folder for the results, resumed or refused as by `fit`.
    progress : function of (name, done, total), optional
    policy : Policy, optional
        How many walkers and draws the fits have; what the command uses when left out.
    simulations : int, optional
        Refitted data sets behind the p-value, half of them where these decide; 999 when left out.

    Returns
    -------
    Findings
        ``report`` is the content of ``discovery.json``; ``plain[name]`` and ``final[name]`` are posteriors.

    Raises
    ------
    InputError
        Something that was given is wrong.

    Examples
    --------
    >>> findings = wb.discover(made.experiments, policy=few, simulations=99, output="out/discover")
    >>> findings.report["experiments"]["wire"]["verdict"]
    'nothing-missing'
    """
    spec = model_spec(elastic_law, history)
    seed = check_seed(seed)
    train_holds = check_train_holds(train_holds)
    own = path_of(own_effects)
    left_out = names_given("without", without)
    experiments = experiments_of(source, experiment, train_holds=train_holds, drop_breaks=drop_breaks)
    known = catalogue(own)
    kinds = catalogue_without(left_out, known)
    check_priors(experiments, known, spec=spec)
    configuration = {
        "command": "discover",
        "version": __version__,
        "seed": seed,
        "elastic_law": elastic_law,
        "history": history,
        "without": sorted(left_out),
        "own_effects": source_of(own),
        "train_holds": train_holds,
        **data_of(experiments),
        **other_effort(policy, simulations),
    }
    settings = Settings(spec, kinds, simulations or SIMULATIONS)
    effort = policy or DEFAULT
    report = progress or silent
    place = ResultFolder.at(output)
    with open_run(place.path, configuration) as opened:
        if opened.state == "done":
            return Findings(place, own, computed=False)
        found = _searched_and_sampled(experiments, settings, own, place.path, seed, effort, report)
        write_findings(found, place.path, own)
        for one in experiments:
            write_next_hold(one, place.path / one.name)
        opened.finish()
    return Findings(place, own)


def _searched_and_sampled(
    experiments: Sequence[Experiment],
    settings: Settings,
    own: Path | None,
    output: Path,
    seed: int,
    policy: Policy,
    report: Progress,
) -> Investigation:
    """What was found, and the posteriors of it: the plain ones are begun beside the search, the others at its end."""
    spec = settings.spec
    sampled = partial(run, directory=output, seed=seed, policy=policy)
    plain = partial(sampled, plain_jobs(experiments, spec, own))
    prepare = partial(catalogue, own)
    waits: list[Callable[[Progress], None]] = []
    with computing(), prepared_copy(partial(_in_gaps, plain)) as in_copy:
        with workers(prepare=prepare) as parallel_map, loaded_meanwhile(_PICTURES):

            def concluded(models: Concluded) -> None:
                jobs = jobs_of(models, spec, own)
                wait = begin(jobs, output, seed, policy, parallel_map)
                waits.append(wait)

            found = investigate(experiments, settings, seed, report, parallel_map, concluded)
            for wait in waits:
                wait(report)
        in_copy(plain)
        void = _void(found, experiments, output)
        sampled(plain_jobs(void, spec, own), report=report)
    return found


def _void(found: Investigation, given: Sequence[Experiment], output: Path) -> list[Experiment]:
    """The experiments of which readings were struck out; their plain fits, begun before that, no longer count."""
    hashes = {one.data_hash for one in given}
    struck = [one for one in _experiments(found) if one.data_hash not in hashes]
    for one in struck:
        (output / one.name / "plain" / SUMMARY).unlink()
    return struck


def _experiments(found: Investigation) -> list[Experiment]:
    """The experiments of all final models."""
    return [experiment for block in found.final for experiment in block.experiments]


def _in_gaps(work: Callable[[], object]) -> None:
    """Do some work where the search leaves a core idle."""
    give_way(_GAPS)
    work()


def write_findings(found: Investigation, output: Path, own_effects: Path | None) -> None:
    """Beside the fits: what is undecided, pictures, and ``discovery.json`` with the final posteriors' amplitudes.

    Where no effect was added the final model is the plain one, whose files stand in both folders.

    Parameters
    ----------
    found : Findings
        Of the search; its report gains the amplitudes.
    output : Path
        Folder of the results, which holds the fits already.
    own_effects : Path or None
        File of a user's own effects.
    """
    _finals_that_are_plain(found, output)
    _mixtures(found, output)
    _pictures(found, output, own_effects)
    _posterior_amplitudes(found, output)
    _parameters(found, output)
    _warnings(found, output)
    write_json(output / "discovery.json", found.report)


def plain_jobs(experiments: Sequence[Experiment], spec: ModelSpec, own_effects: Path | None) -> list[Job]:
    """Plain fit of every experiment.

    Parameters
    ----------
    experiments : sequence of Experiment
    spec : ModelSpec
        The plain model.
    own_effects : Path or None
        File of a user's own effects, which the workers load again.
    """
    return [_job("plain", JointModel((e,)), spec, own_effects) for e in experiments]


def jobs_of(found: Concluded, spec: ModelSpec, own_effects: Path | None) -> list[Job]:
    """The final fits that have more effects than the plain ones.

    Where the findings are ambiguous, there is one for each effect that could be the missing one.

    Parameters
    ----------
    found : Concluded
        By the search.
    spec, own_effects
        As for `plain_jobs`.
    """
    models = [("final", model) for model in final_models(found) if model.effects]
    models += [(f"final/{_OTHERS}/{number}", model) for number, model in _others(found)]
    return [_job(kind, model, spec, own_effects) for kind, model in models]


def _job(kind: str, model: JointModel, spec: ModelSpec, own_effects: Path | None) -> Job:
    experiments = model.experiments
    folders = tuple(f"{experiment.name}/{kind}" for experiment in experiments)
    keys = tuple(effect.key for effect in model.effects)
    hashes = {experiment.name: experiment.data_hash for experiment in experiments}
    about = {"data_sha256": hashes}
    return Job(folders[0], experiments, keys, own_effects, spec, about, model.near, folders, model.share)


def _others(found: Concluded) -> list[tuple[int, JointModel]]:
    """The undecided models beside the final ones, each with its number among those of its experiments."""
    out: list[tuple[int, JointModel]] = []
    count: dict[str, int] = {}
    for models in alternative_models(found):
        first = models[0].experiments[0]
        number = 1 + count.get(first.name, 0)
        for model in models:
            out.append((number, model))
            for experiment in model.experiments:
                count[experiment.name] = number
    return out


def _finals_that_are_plain(found: Investigation, output: Path) -> None:
    """Store the plain fit as the final one of every experiment that no effect was added to."""
    for model in final_models(found):
        if model.effects:
            continue
        for experiment in model.experiments:
            plain = output / experiment.name / "plain"
            final = output / experiment.name / "final"
            final.mkdir(exist_ok=True)
            for name in (POSTERIOR, SUMMARY):
                write_bytes(final / name, (plain / name).read_bytes())


def _mixtures(found: Investigation, output: Path) -> None:
    """Say beside each final posterior which other models it shares the probability with."""
    for block, others in zip(found.final, found.undecided, strict=True):
        if not others:
            continue
        members = []
        for number, other in enumerate(others):
            folder = f"{_OTHERS}/{number}" if number else "."
            keys = [effect.key for effect in other.block.effects]
            if other.remains:
                keys.append("discrepancy")
            members.append((folder, other.probability, keys))
        for experiment in block.experiments:
            write_mixture(output / experiment.name / "final", members)


def _posterior_amplitudes(found: Investigation, output: Path) -> None:
    """Amplitudes as the final posterior has them, in place of the search's normal approximation."""
    for experiment in _experiments(found):
        parameters = _parameters_of(output / experiment.name / "final")
        for name, amplitude in found.report["experiments"][experiment.name]["amplitudes"].items():
            column = next(column for column in parameters if column.startswith(f"{name}."))
            of_posterior = parameters[column]
            amplitude["mean"] = of_posterior["mean"]
            amplitude["q05"] = of_posterior["q05"]
            amplitude["q50"] = of_posterior["q50"]
            amplitude["q95"] = of_posterior["q95"]


def _parameters_of(folder: Path) -> dict[str, Parameter]:
    """Parameters of the fit in a folder."""
    summary: SummaryJson = read_json(folder / SUMMARY)
    return summary["parameters"]


def _parameters(found: Investigation, output: Path) -> None:
    """Every parameter before and after, as the two posteriors have it."""
    for name, report in found.report["experiments"].items():
        plain = _parameters_of(output / name / "plain")
        final = _parameters_of(output / name / "final")
        parameters: dict[str, ParameterReport] = {}
        for column, entry in (plain | final).items():
            before = _interval(plain.get(column))
            after = _interval(final.get(column))
            parameters[column] = {"unit": entry["unit"], "plain": before, "final": after}
        report["parameters"] = parameters


def _interval(entry: Parameter | None) -> IntervalJson | None:
    """A parameter of a model, None where the model has no such parameter."""
    return None if entry is None else {"mean": entry["mean"], "q05": entry["q05"], "q95": entry["q95"]}


def _warnings(found: Investigation, output: Path) -> None:
    """What the fits say against themselves joins what the search says; of the same readings it is said once."""
    reports = found.report["experiments"]
    for name, report in reports.items():
        fits: list[SummaryJson] = [read_json(output / name / model / SUMMARY) for model in ("plain", "final")]
        plain, final = (from_json(summary["warnings"]) for summary in fits)
        alone = [notice.of("the final model") for notice in final if notice not in plain]
        report["warnings"] = to_json([*from_json(report["warnings"]), *plain, *alone])
    found.report["warnings"] = notices_by_part(reports)


def _pictures(found: Investigation, output: Path, own_effects: Path | None) -> None:
    """Pictures of readings and models before and after, hold by hold, and one of each finding."""
    from wirebayes.report.drawn import save_together  # matplotlib only where it is needed
    from wirebayes.report.pictures.discover import pictures

    for experiment in _experiments(found):
        folder = output / experiment.name
        plain = load_posterior(folder / "plain", own_effects=own_effects)
        final = load_posterior(folder / "final", own_effects=own_effects)
        verdict = found.report["experiments"][experiment.name]
        save_together(pictures(plain, final, verdict), output)

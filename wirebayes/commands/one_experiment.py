"""One experiment of a batch: fitted, or searched for missing effects, in a folder of its own that comes back as files.

The worker needs no folder in common with the machine that runs the batch, so it may be another machine. Work is sent as
bytes, also within one machine: then arrays have the same memory layout everywhere, and results agree to the last bit.
"""

import pickle
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Lock

from wirebayes._version import __version__
from wirebayes.commands.discover import jobs_of, plain_jobs, write_findings
from wirebayes.discovery.model_check import write_checks
from wirebayes.discovery.search import catalogue_without, investigate
from wirebayes.discovery.settings import ALPHA, Settings
from wirebayes.effects import catalogue
from wirebayes.inference.fit import Fit
from wirebayes.inference.policy import Policy
from wirebayes.io.experiment import Experiment
from wirebayes.io.next_hold import write_next_hold
from wirebayes.io.run_folder import read_json
from wirebayes.json_files.batch import AtTypical, DiscoveryColumns, FitColumns, Row
from wirebayes.json_files.discovery import ExperimentFindings
from wirebayes.json_files.summary import Parameter, SummaryJson
from wirebayes.json_files.values import Quantiles, Statistics
from wirebayes.model.spec import ModelSpec
from wirebayes.numeric.typing import Array
from wirebayes.processes.workers import one_thread_each
from wirebayes.progress import silent
from wirebayes.result_warnings import Notice, to_json
from wirebayes.results.contraction import interval
from wirebayes.results.jobs import Job, fit_job, store
from wirebayes.sentences import p_in_words
from wirebayes.views.posterior import POSTERIOR, SUMMARY

QUANTITIES = ("mean", "sd", "q05", "q50", "q95")
_ALONE = Lock()  # a worker with several threads still draws one picture at a time


@dataclass(frozen=True)
class BatchTask:
    """What is to be done with each experiment.

    Attributes
    ----------
    discover : bool
        Look for what the model is missing; otherwise fit.
    check : bool
        Check the fit's model, where nothing is looked for.
    spec, seed, policy
        As for a fit.
    without : tuple of str
        Effects left out of the catalogue.
    own_effects : Path or None
        Must be there under the same path wherever the work is done.
    simulations : int
        Refitted data sets behind the p-value.
    posteriors : bool
        Keep the draws, not only their summaries.
    scratch : Path or None
        Folder for what is being computed; the system's where it is left out.
    """

    discover: bool
    check: bool
    spec: ModelSpec
    seed: int
    policy: Policy
    without: tuple[str, ...]
    own_effects: Path | None
    simulations: int
    posteriors: bool
    scratch: Path | None = None


@dataclass(frozen=True)
class Done:
    """What came of one experiment: its row of the table and the content of its files by their path."""

    row: Row
    files: dict[str, bytes]


def packed(experiment: Experiment, file: str, task: BatchTask) -> bytes:
    """A piece of work for `do`.

    Parameters
    ----------
    experiment : Experiment
    file : str
        Where it was read, for the table.
    task : BatchTask
        What to do with it.

    Returns
    -------
    bytes
    """
    return pickle.dumps((experiment, file, task))


def do(work: bytes) -> Done:
    """Do one experiment; whatever goes wrong with it stands in its row."""
    one_thread_each()
    with _ALONE:
        experiment, file, task = pickle.loads(work)
        row = first_columns(experiment, file)
        with TemporaryDirectory(prefix="wirebayes-", dir=task.scratch) as scratch:
            folder = Path(scratch)
            try:
                found = _discovered(experiment, task, folder) if task.discover else _fitted(experiment, task, folder)
            except OSError:  # a full disk is not the specimen's fault
                raise
            except Exception as error:  # no specimen may lose the others
                message = f"{type(error).__name__}: {error}".replace(f"{folder}/", "")
                return Done(row | {"error": message}, {})
            return Done({**row, **found}, _files(folder, experiment.name, task.posteriors))


def first_columns(experiment: Experiment, file: str) -> Row:
    """A row before anything is known of its posterior."""
    recorded = experiment.recorded_holds
    readings = sum(hold.time_s.size for hold in recorded)
    return {
        **empty_row(experiment.name, file),
        "material": experiment.material,
        "length_mm": experiment.length_mm,
        "control": experiment.control,
        "holds": len(recorded),
        "readings": readings,
    }


def empty_row(name: str, file: str) -> Row:
    """The row of an experiment of which nothing is known yet."""
    return {
        "name": name,
        "material": None,
        "file": file,
        "length_mm": None,
        "control": None,
        "holds": None,
        "readings": None,
        "converged": None,
        "parameters": {},
        "at_typical": None,
        "verdict": None,
        "effects": [],
        "best_effect": None,
        "p_global": None,
        "check": None,
        "warnings": [],
        "error": None,
    }


def _fitted(experiment: Experiment, task: BatchTask, folder: Path) -> FitColumns:
    about = {"data_file": experiment.source.name, "version": __version__, "data_sha256": _hash(experiment)}
    job = Job(experiment.name, (experiment,), (), task.own_effects, task.spec, about)
    fit = _fit_and_store(job, folder, task, draws=task.posteriors)
    if task.posteriors:
        write_next_hold(experiment, folder / experiment.name)
    if task.check:
        write_checks([job], folder, task.seed, silent, map, task.simulations)
    summary: SummaryJson = read_json(folder / experiment.name / SUMMARY)
    check = summary.get("model_check")
    return _columns(summary, fit, check and check["p"], check and check["passed"])


def _fit_and_store(job: Job, folder: Path, task: BatchTask, *, draws: bool) -> Fit:
    """Fit and store; nothing would go on from a checkpoint in a folder that is gone afterwards."""
    for place in job.folders:
        (folder / place).mkdir(parents=True)
    fit = fit_job(job, task.seed, task.policy)
    store(job, fit, folder, task.seed, task.policy, draws=draws)
    return fit


def _discovered(experiment: Experiment, task: BatchTask, folder: Path) -> DiscoveryColumns:
    kinds = catalogue_without(task.without, catalogue(task.own_effects))
    found = investigate([experiment], Settings(task.spec, kinds, task.simulations), task.seed)
    (job,) = plain_jobs([experiment], task.spec, task.own_effects)
    plain = _fit_and_store(job, folder, task, draws=True)  # pictures show them
    for job in jobs_of(found, task.spec, task.own_effects):
        _fit_and_store(job, folder, task, draws=True)
    write_findings(found, folder, task.own_effects)
    own_folder = folder / experiment.name
    if task.posteriors:
        write_next_hold(experiment, own_folder)
    report = found.report["experiments"][experiment.name]
    summary: SummaryJson = read_json(own_folder / "plain" / SUMMARY)
    # the check of a fit is this global test
    p = report["p_global"]
    return {
        **_columns(summary, plain, p, p > ALPHA),
        "verdict": report["verdict"],
        "effects": report["effects"],
        "best_effect": report["best"],
        "warnings": [*report["warnings"], *to_json(_on_the_plain_model(report, experiment.name))],
    }


def _on_the_plain_model(report: ExperimentFindings, name: str) -> list[Notice]:
    """That a row's parameters lack what was found missing, if anything was."""
    if report["verdict"] == "nothing-missing":
        return []
    sure = p_in_words(report["p_global"], report["p_simulations"])
    text = (
        f"the parameters in the table are those of the plain model, which lacks what was found missing ({sure}): they "
        f"can be wrong by more than is said; those of the final model are in {name}/final/{SUMMARY}"
    )
    return [Notice("model-check", text)]


def _columns(summary: SummaryJson, fit: Fit, p: float | None, passed: bool | None) -> FitColumns:
    parameters = {name: _statistics(parameter) for name, parameter in summary["parameters"].items()}
    check = None
    if passed is not None:
        check = "passed" if passed else "failed"
    return {
        "converged": summary["converged"],
        "parameters": parameters,
        "at_typical": _at_typical(fit),
        "warnings": summary["warnings"],
        "p_global": p,
        "check": check,
    }


def _at_typical(fit: Fit) -> AtTypical:
    """B and k2 at the test's typical tension and after its typical hold."""
    (sample,) = fit.problem.samples
    typical = sample.model.typical
    wire = fit.problem.parameters(fit.flat, sample)
    creep_mm = wire["B"] * typical.tension_N ** wire["U"]
    exponent = wire["k2"] * typical.hold_s ** wire["N"]
    return {
        "tension_N": typical.tension_N,
        "time_s": typical.hold_s,
        "B": _quantiles(creep_mm),
        "k2": _quantiles(exponent),
    }


def _quantiles(values: Array) -> Quantiles:
    low, middle, high = interval(values)
    return {"q05": low, "q50": middle, "q95": high}


def _statistics(parameter: Parameter) -> Statistics:
    return {
        "mean": parameter["mean"],
        "sd": parameter["sd"],
        "q05": parameter["q05"],
        "q50": parameter["q50"],
        "q95": parameter["q95"],
    }


def _hash(experiment: Experiment) -> dict[str, str]:
    return {experiment.name: experiment.data_hash}


def _files(folder: Path, name: str, posteriors: bool) -> dict[str, bytes]:
    """The files by their path below the experiment's own folder."""
    inside = folder / name
    files = {}
    for path in sorted(folder.rglob("*")):
        if path.is_file() and (posteriors or path.name != POSTERIOR):
            place = inside if path.is_relative_to(inside) else folder
            files[path.relative_to(place).as_posix()] = path.read_bytes()
    return files

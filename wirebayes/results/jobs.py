"""Many fits at once: each in its own folder, on all cores, resumed after an interruption."""

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from wirebayes.effects import catalogue, effect_named
from wirebayes.inference.fit import Fit, fit_problem, seed_of
from wirebayes.inference.policy import DEFAULT, Policy
from wirebayes.io.experiment import Experiment
from wirebayes.model.build import build
from wirebayes.model.spec import PLAIN_SPEC, ModelSpec
from wirebayes.processes.workers import ParallelMap, cores, workers
from wirebayes.progress import Progress, silent
from wirebayes.results.store import save_posterior, save_summary


@dataclass(frozen=True)
class Job:
    """One fit to be done.

    Attributes
    ----------
    folder : str
        Where its results go, below the run's folder; also what its seed is made of.
    experiments : tuple of Experiment
    effects : tuple of str
        Keys of effects.
    own_effects : Path or None
        The user's Python file that some of them come from.
    spec : ModelSpec
    provenance : dict
    near : dict, optional
        Parameters known to be good (see `wirebayes.inference.fit.fit_problem`).
    apart : tuple of str
        Folders of the experiments, one each, where they are stored apart; all in one when left out.
    share : float
        Of the draws of an answer, that come from this fit.
    """

    folder: str
    experiments: tuple[Experiment, ...]
    effects: tuple[str, ...] = ()
    own_effects: Path | None = None
    spec: ModelSpec = PLAIN_SPEC
    provenance: dict[str, Any] = field(default_factory=dict)
    near: dict[str, float] | None = None
    apart: tuple[str, ...] = ()
    share: float = 1.0

    @property
    def folders(self) -> tuple[str, ...]:
        """Where results go."""
        return self.apart or (self.folder,)


def run(
    jobs: Sequence[Job],
    directory: Path,
    seed: int,
    *,
    policy: Policy = DEFAULT,
    report: Progress = silent,
    parallel_map: ParallelMap | None = None,
) -> None:
    """Do all fits that are not in the directory yet, on all cores.

    A fit is done when each of its folders has a ``summary.json``. One that was cut off leaves a checkpoint in its
    folder, from which the next call goes on to the same bytes. The results do not depend on how many cores there are.

    Parameters
    ----------
    jobs : sequence of Job
    directory : Path
        Of the run; jobs name their folders within it.
    seed : int
        Of the run; each fit derives its own from it and the name of its folder.
    policy : Policy
        When a fit counts as converged and when it gives up.
    report : callable
        Called with a name, what is done, and the total: the share of one fit that runs alone, or the number of fits.
    parallel_map : callable, optional
        Takes the place of processes that share the work.
    """
    todo = _left(jobs, directory)
    if len(todo) <= 1 or cores() == 1:
        for job in todo:
            one(job, directory, seed, policy, lambda share, name=job.folder: report(name, share, 1.0))  # type: ignore[misc]
        return
    with workers(len(todo)) if parallel_map is None else nullcontext(parallel_map) as parallel_map:
        begin(todo, directory, seed, policy, parallel_map)(report)


def begin(
    jobs: Sequence[Job], directory: Path, seed: int, policy: Policy, parallel_map: ParallelMap
) -> Callable[[Progress], None]:
    """Hand over all fits that are not in the directory yet; what is returned waits for them, and reports the number.

    Parameters
    ----------
    jobs, directory, seed, policy
        As for `run`.
    parallel_map : callable
        A map over processes, which begins at once, or the built-in one, which does the work when it is waited for.
    """
    # those that take longest begin first, so that no core waits for one that began last
    longest = sorted(_left(jobs, directory), key=lambda job: -len(job.experiments) * (1 + len(job.effects)))
    begun = parallel_map(partial(one, directory=directory, seed=seed, policy=policy), longest)

    def wait(report: Progress) -> None:
        for done, _ in enumerate(begun, 1):
            report("fits", done, len(longest))

    return wait


def _left(jobs: Sequence[Job], directory: Path) -> list[Job]:
    """The jobs that are not done yet."""
    return [job for job in jobs if not all((directory / f / "summary.json").exists() for f in job.folders)]


def one(
    job: Job, directory: Path, seed: int, policy: Policy, progress: Callable[[float], None] = lambda share: None
) -> None:
    """Do one fit and store it.

    Parameters
    ----------
    directory : Path
        Of the run; the job's folders are made in it.
    seed : int
        Of the run; the fit's own follows from it and the name of the job's folder.
    progress : callable
        Called with the share of the work that is done, from 0 to 1.
    """
    for place in job.folders:
        (directory / place).mkdir(parents=True, exist_ok=True)
    checkpoint = directory / job.folder / ".checkpoint"
    own_policy = policy.of_share(job.share)
    store(job, fit_job(job, seed, own_policy, checkpoint, progress), directory, seed, own_policy)
    checkpoint.unlink(missing_ok=True)


def fit_job(
    job: Job,
    seed: int,
    policy: Policy,
    checkpoint: Path | None = None,
    progress: Callable[[float], None] = lambda share: None,
) -> Fit:
    """Do one fit.

    Parameters
    ----------
    seed : int
        Of the run; the fit's own follows from it and the name of the job's folder.
    checkpoint : Path, optional
        See `wirebayes.inference.fit.fit_problem`; without one nothing is written meanwhile.
    progress : callable
        Called with the share of the work that is done, from 0 to 1.
    """
    known = catalogue(job.own_effects)
    effects = [effect_named(key, known) for key in job.effects]
    problem = build(job.experiments, effects, job.spec)
    own_seed = seed_of(seed, job.folder)
    return fit_problem(problem, own_seed, policy=policy, checkpoint=checkpoint, progress=progress, near=job.near)


def store(job: Job, result: Fit, directory: Path, seed: int, policy: Policy, *, draws: bool = True) -> None:
    """Write what came of a fit into the job's folders, which exist.

    Parameters
    ----------
    directory : Path
        Of the run.
    seed : int
        Of the run.
    draws : bool
        Write the posterior draws, not only their summary.
    """
    about = job.provenance | {"seed": seed, "policy": vars(policy)}
    samples = result.problem.samples if job.apart else (None,)
    for place, sample in zip(job.folders, samples, strict=True):
        if draws:
            save_posterior(result, directory / place, about, seed=seed_of(seed, job.folder), sample=sample)
        else:
            save_summary(result, directory / place, sample=sample)

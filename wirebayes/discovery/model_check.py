"""Does the fitted model describe its own readings? The check at the end of every fit.

It is the global test of `wirebayes.discovery.global_test`, with the fitted effects in the model: p comes from data sets
simulated at the fit and refitted, so the readings are not used twice, and for one experiment it is the p that
`discover` reports.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from wirebayes.discovery.apart import APART, REFITTED, p_alike
from wirebayes.discovery.global_test import examine
from wirebayes.discovery.screening import TWO
from wirebayes.discovery.settings import ALPHA, SIMULATIONS
from wirebayes.effects import catalogue, effect_named
from wirebayes.errors import InputError
from wirebayes.inference.fit import seed_of
from wirebayes.inference.laplace_fit import fitted
from wirebayes.io.run_folder import write_json
from wirebayes.json_files.discovery import GrossError
from wirebayes.json_files.summary import ModelCheckResult, SummaryJson
from wirebayes.processes.workers import ParallelMap, give_way, workers
from wirebayes.progress import Progress
from wirebayes.result_warnings import Notice, from_json, to_json
from wirebayes.results.jobs import Job
from wirebayes.sentences import p_in_words, spoken

_BESIDE = 3  # steps of niceness, half the weight: two workers of the check leave one of two cores to the sampler
_SHOWN = 3  # most surprising effects that are listed


@dataclass(frozen=True)
class ModelCheck:
    """What the check found.

    Attributes
    ----------
    p : float or None
        Probability of data at least as surprising, were the model right; None where it was not checked.
    alpha : float
        Level that `p` is compared with.
    simulations : int
        Refitted data sets that `p` is a share of.
    surprising : tuple of str
        Effects that the readings ask for most, most surprising first; where the check failed.
    gross_errors : tuple of dict
        Single readings that were set aside in the check: experiment, hold, reading, log Bayes factor.
    reason : str
        Why it was not checked.
    with_effects : bool
        Whether the fitted model has effects.
    samples : int
        To how many samples it was fitted at once.
    p_alike : float or None
        Probability of samples that seem to differ as much, were their parameters the same; None of one sample.
    """

    p: float | None
    alpha: float
    simulations: int = 0
    surprising: tuple[str, ...] = ()
    gross_errors: tuple[GrossError, ...] = ()
    reason: str = ""
    with_effects: bool = False
    samples: int = 1
    p_alike: float | None = None

    @property
    def passed(self) -> bool | None:
        """Whether the model may stand; None where it was not checked."""
        return None if self.p is None else self.p > self.alpha and not self.samples_differ

    @property
    def samples_differ(self) -> bool:
        """Whether samples that were fitted at once do not have the same parameters."""
        return self.p_alike is not None and self.p_alike <= APART

    @property
    def sentence(self) -> str:
        """The result in words, with what to do."""
        if self.p is None:
            return f"The model was not checked against the readings: {self.reason}."
        gross = "".join(f" {text[0].upper()}{text[1:]}." for text in self._gross_errors_in_words())
        return (self._passed_in_words() if self.passed else f"{self._failed_in_words()}.") + gross

    @property
    def notices(self) -> list[Notice]:
        """A notice that the check failed, if it did, and one for every reading that it set aside."""
        failed = [Notice("model-check", self._failed_in_words())] if self.passed is False else []
        return failed + [Notice("gross-error", text) for text in self._gross_errors_in_words()]

    def _gross_errors_in_words(self) -> list[str]:
        return [
            f"reading {g['reading'] + 1} of hold {g['hold']} of {g['experiment']} looks like a gross error; "
            "the model check set it aside, the fit did not: correct or remove it and fit again"
            for g in self.gross_errors
        ]

    @property
    def _p_in_words(self) -> str:
        return "no p" if self.p is None else p_in_words(self.p, self.simulations)

    def _passed_in_words(self) -> str:
        return (
            f"The model describes the readings: {self._p_in_words} in a test against {self.simulations} refitted "
            f"simulations (it fails below {self.alpha:.2g})."
        )

    def _failed_in_words(self) -> str:
        if self.p is not None and self.p > self.alpha:
            return f"The {self._samples_in_words()}: parameters and predictions {_WRONG}; {_EACH}"
        model = "The model with these effects" if self.with_effects else "The plain model"
        directions = ", ".join(map(spoken, self.surprising))
        samples = f", and the {self._samples_in_words()}; {_EACH}" if self.samples_differ else ""
        return (
            f"{model} does not describe the readings ({self._p_in_words}; it fails below {self.alpha:.2g}): "
            f"parameters and predictions {_WRONG}. The readings deviate most towards {directions}{samples}"
        )

    def _samples_in_words(self) -> str:
        sure = p_in_words(self.p_alike or 0.0, REFITTED)
        return f"{self.samples} samples differ, where one set of parameters was fitted to all of them ({sure})"

    def to_dict(self) -> ModelCheckResult:
        """Plain values for JSON."""
        return {
            "passed": self.passed,
            "p": self.p,
            "p_alike": self.p_alike,
            "alpha": self.alpha,
            "simulations": self.simulations,
            "most_surprising": list(self.surprising),
            "gross_errors": list(self.gross_errors),
            "sentence": self.sentence,
        }


_WRONG = "can be wrong by more than their intervals"
_EACH = "fits of each by itself show in what"


def level(tests: int) -> float:
    """Level of each of several tests so that all pass with probability 1 - `ALPHA` if nothing is missing (Šidák)."""
    return ALPHA if tests == 1 else 1.0 - (1.0 - ALPHA) ** (1.0 / tests)


def check_model(
    job: Job, seed: int = 0, *, alpha: float = ALPHA, simulations: int | None = None, parallel_map: ParallelMap = map
) -> ModelCheck:
    """Check a model against the readings it was fitted to.

    Parameters
    ----------
    job : Job
        The fit. Hold by hold is not checked: that likelihood does not say how a test comes about, so no test can be
        simulated from it.
    seed : int
    alpha : float
        See `level`.
    simulations : int
        Refitted data sets behind p: half of them where these decide, more where p is too close to `alpha`.
    parallel_map : function, optional
        The built-in `map`, or one over processes.
    """
    kinds = catalogue(job.own_effects)
    effects = [effect_named(key, kinds) for key in job.effects]
    unchecked = partial(ModelCheck, None, alpha, with_effects=bool(effects))
    if job.spec.likelihood == "hold":
        return unchecked(reason="the hold-by-hold likelihood says nothing of how one hold follows from another")
    if any(e.name not in kinds for e in effects):
        return unchecked(reason="a smooth discrepancy stands in for whatever is missing")
    rng = np.random.default_rng(seed_of(seed, "discover"))
    first = rng.spawn(1)[0]
    # where the check runs beside the sampler, a fit in this process would take turns with it
    (block,) = parallel_map(fitted, [job.experiments], [effects], [job.spec], [first])
    try:
        gate = examine([block], kinds, simulations or SIMULATIONS, rng, alpha=alpha, parallel_map=parallel_map)
    except InputError:
        return unchecked(reason="no further effect could show in these holds")
    of_samples = np.random.default_rng(seed_of(seed, "samples"))
    (alike,) = parallel_map(p_alike, gate.blocks, [of_samples])
    p = gate.test.p
    names = directions(gate.test.surprises)
    failed = p <= alpha
    return ModelCheck(
        p,
        alpha,
        len(gate.test.null),
        names if failed else (),
        tuple(gate.struck),
        "",
        bool(effects),
        len(job.experiments),
        alike,
    )


def directions(surprises: Mapping[str, float]) -> tuple[str, ...]:
    """What readings deviate towards, the most surprising first; a pair of effects is none, but may be all that shows.

    Parameters
    ----------
    surprises : mapping of name to float
        Of the global test.
    """
    order = sorted(surprises, key=lambda name: -surprises[name])
    shown = [name for place, name in enumerate(order) if name != TWO or place == 0]
    return tuple("a smooth discrepancy" if name == "unknown" else name for name in shown[:_SHOWN])


def write_checks(
    jobs: Sequence[Job],
    directory: Path,
    seed: int,
    report: Progress,
    parallel_map: ParallelMap | None,
    simulations: int | None = None,
) -> None:
    """Check all fits of a command and put the result first in their ``summary.json``, as ``model_check``.

    The level is the one that the command as a whole keeps. What was checked before an interruption is not checked
    again.

    Parameters
    ----------
    jobs : sequence of Job
        All with the same file of own effects.
    directory : Path
        Of the run; jobs name their folders within it.
    seed : int
        Of the run.
    report : callable
        Called with a name, the number of fits checked and the number to check.
    parallel_map : callable or None
        Takes the place of processes that share the work.
    simulations : int, optional
        As for `check_model`.
    """
    todo = [job for job in jobs if not is_checked(job, directory)]
    work = partial(check_model, seed=seed, alpha=level(len(jobs)), simulations=simulations)
    prepare = partial(catalogue, jobs[0].own_effects)
    pool = workers(prepare=prepare) if parallel_map is None else nullcontext(parallel_map)
    with pool as parallel_map:
        # One fit shares its simulations among the cores, several are each done on one.
        is_one = len(todo) == 1
        checks = [work(todo[0], parallel_map=parallel_map)] if is_one else parallel_map(work, todo)
        for done, (job, check) in enumerate(zip(todo, checks, strict=True), 1):
            write_check(job, directory, check)
            report("checks", done, len(todo))


@contextmanager
def checked_meanwhile(job: Job, directory: Path, seed: int) -> Iterator[None]:
    """Check the only fit of a command while the block samples it: the check needs no draws, and the other core is free.

    The result is stored at the end of the block, which leaves the fit's ``summary.json``.

    Parameters
    ----------
    job : Job
    directory : Path
        Of the run; the job names its folder within it.
    seed : int
        Of the run.
    """
    if is_checked(job, directory):
        yield
        return
    # the processes are the inner ones: where the block fails, they end at once, and with them the check
    with ThreadPoolExecutor(1) as beside, workers(prepare=partial(_prepared_beside, job.own_effects)) as parallel_map:
        check = beside.submit(check_model, job, seed, parallel_map=parallel_map)
        yield
        write_check(job, directory, check.result())


def _prepared_beside(own_effects: Path | None) -> None:
    """Prepare a worker of a check that goes on beside the sampler, which a fit takes longest for."""
    give_way(_BESIDE)
    catalogue(own_effects)


def is_checked(job: Job, directory: Path) -> bool:
    """Whether the result of a fit's check is stored."""
    path = directory / job.folder / "summary.json"
    return path.exists() and "model_check" in json.loads(path.read_text(encoding="utf-8"))


def write_check(job: Job, directory: Path, check: ModelCheck) -> None:
    """Put the result of a check first in the ``summary.json`` of its fit.

    Parameters
    ----------
    job : Job
    directory : Path
        Of the run; the job names its folder within it.
    check : ModelCheck
    """
    path = directory / job.folder / "summary.json"
    summary: SummaryJson = json.loads(path.read_text(encoding="utf-8"))
    summary["warnings"] = to_json([*check.notices, *from_json(summary["warnings"])])
    write_json(path, {"model_check": check.to_dict(), **summary})

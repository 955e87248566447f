"""The posterior of each experiment, or of all samples of a material together."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any
from unicodedata import normalize

from wirebayes._version import __version__
from wirebayes.commands.options import (
    Source,
    check_history,
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
from wirebayes.discovery.model_check import checked_meanwhile, write_checks
from wirebayes.effects import catalogue, effect_named, source_of
from wirebayes.errors import InputError, shown
from wirebayes.inference.policy import DEFAULT, Policy
from wirebayes.io.experiment import Experiment
from wirebayes.io.next_hold import write_next_holds
from wirebayes.io.run_folder import open_run
from wirebayes.model.sample import Likelihood
from wirebayes.numeric.distributions import Normal
from wirebayes.processes.workers import computing, workers
from wirebayes.progress import Progress, silent
from wirebayes.results.jobs import Job, run
from wirebayes.strict.files import PathLike
from wirebayes.views.posterior import Posterior, Posteriors
from wirebayes.views.result import ResultFolder
from wirebayes.wire.effect import Effect, EventEffect
from wirebayes.wire.laws import ElasticLaw, History


def fit(
    source: Source,
    *,
    experiment: str | None = None,
    train_holds: int | None = None,
    elastic_law: ElasticLaw = "hooke",
    history: History = "saturating",
    likelihood: Likelihood = "chain",
    effects: str | Sequence[str] = (),
    own_effects: PathLike | None = None,
    drop_breaks: bool = False,
    together: str | None = None,
    check: bool = True,
    seed: int = 0,
    output: PathLike | None = None,
    progress: Progress | None = None,
    policy: Policy | None = None,
) -> Posterior | Posteriors:
    """Posterior of a wire's parameters.

    Parameters
    ----------
    source : path, Experiment, or sequence of Experiment
        What was measured; a path names an experiment file.
    experiment : str, optional
        This experiment only.
    train_holds : int, optional
        Fit the first so many recorded holds only.
    elastic_law : {"hooke", "modified"}
        Strain relative to the zero-tension length, eq (1), or to the stretched length, eq (3).
    history : {"saturating", "additive"}
        Creep saturates towards one total amount, or adds a new amount in every hold.
    likelihood : {"chain", "hold"}
        Treat the holds as one history, or each hold separately.
    effects : sequence of str
        Effects to add, by name; ``grip_slip@7`` names its hold, ``grip_slip@TEST:7`` its test too. See `list_effects`.
    own_effects : path, optional
        A Python file with effects of your own.
    together : str, optional
        Fit all samples of this material at once.
    check : bool
        Check each fit against 999 refitted simulations: half of them where these decide, up to four times as many
        where p is close to the level.
    drop_breaks : bool
        Leave out the readings of breaks, of sensors at their limit, and of dropouts.
    seed : int
        Same seed, same machine: same draws.
    output : path, optional
        Folder for the results. It resumes an interrupted fit of the same configuration and refuses another. Without it,
        the results lie in a temporary folder, which lasts as long as the posterior. `write_report` adds the page.
    progress : function of (name, done, total), optional
        Called as the work goes on.
    policy : Policy, optional
        How many walkers and draws; what the command uses when left out.

    Returns
    -------
    Posterior, or Posteriors where there are several experiments

    Raises
    ------
    InputError
        Something that was given is wrong: says where, what was found and what was expected.

    Examples
    --------
    >>> import wirebayes as wb
    >>> few = wb.Policy(walkers=32, ess=300, rounds=2, round_draws=1024, block=20, most_steps=60, r_hat=1.5)
    >>> posterior = wb.fit(
    ...     "experiments.toml", experiment="kite-1.5m", train_holds=5, check=False, policy=few, output="out/fit"
    ... )
    >>> posterior
    Posterior(kite-1.5m, chain hooke saturating, converged)
    >>> posterior.draws()["k1"].ndim
    1
    """
    spec = model_spec(elastic_law, history, likelihood)
    seed = check_seed(seed)
    train_holds = check_train_holds(train_holds)
    own = path_of(own_effects)
    keys = names_given("effects", effects)
    if together is not None and experiment is not None:
        raise InputError(f"--together {together}: found --experiment {experiment} beside it, expected one of the two")
    experiments = experiments_of(source, experiment, train_holds=train_holds, drop_breaks=drop_breaks)
    file = experiments[0].source
    known = catalogue(own)
    added = _effects_of(keys, known)
    groups = _groups(experiments, together, file)
    if together is not None:
        spec = replace(spec, length_exponent=Normal(1.0, 1.0))
    jobs = list[Job]()
    fitted = list[Experiment]()
    for folder, members in groups.items():
        for effect in added:
            _check_possible(effect, members, file, known, history)
        check_priors(members, known, added, spec)
        jobs.append(Job(folder, members, keys, own, spec, _provenance(members, file)))
        fitted += members
    configuration = {
        "command": "fit",
        "version": __version__,
        "seed": seed,
        "likelihood": likelihood,
        "elastic_law": elastic_law,
        "history": history,
        "effects": list(keys),
        "own_effects": source_of(own),
        "train_holds": train_holds,
        "together": together,
        "check": check,
        **data_of(fitted),
        **other_effort(policy),
    }
    place = ResultFolder.at(output)
    with open_run(place.path, configuration) as opened:
        if opened.state != "done":
            _compute(jobs, place.path, seed, check, policy or DEFAULT, progress or silent)
            opened.finish()
    return fits_in(place, list(groups), own, computed=opened.state != "done")


def _effects_of(keys: Sequence[str], known: Mapping[str, type[Effect]]) -> list[Effect]:
    """The effects that were asked for; each may be asked for once."""
    added = [effect_named(key, known) for key in keys]
    names = {effect.name for effect in added}
    if len(names) < len(added):
        raise InputError(f"--effect: found {', '.join(keys)}, expected each effect once")
    return added


def _provenance(members: Sequence[Experiment], file: Path) -> dict[str, Any]:
    """What the files of a fit say of where it comes from."""
    hashes = {e.name: e.data_hash for e in members}
    return {"data_file": file.name, "version": __version__, "data_sha256": hashes}


def _compute(jobs: Sequence[Job], folder: Path, seed: int, check: bool, policy: Policy, report: Progress) -> None:
    """Do the fits, and check them where that is asked for: a single one while it is sampled, several afterwards."""
    with computing():
        if check and len(jobs) == 1:
            with checked_meanwhile(jobs[0], folder, seed):
                run(jobs, folder, seed, policy=policy, report=report)
        else:
            prepare = partial(catalogue, jobs[0].own_effects)
            with workers(len(jobs), prepare) as parallel_map:
                run(jobs, folder, seed, policy=policy, report=report, parallel_map=parallel_map)
                if check:
                    write_checks(jobs, folder, seed, report, parallel_map)
    for job in jobs:
        own_folder = folder / job.folder
        hold_by_hold = job.spec.likelihood == "hold"
        write_next_holds(job.experiments, own_folder, hold_by_hold=hold_by_hold)


def fits_in(
    place: ResultFolder, folders: Sequence[str], own_effects: Path | None, *, computed: bool = False
) -> Posterior | Posteriors:
    """What `fit` returns of a folder that holds these fits.

    Parameters
    ----------
    place : ResultFolder
        The folder.
    folders : sequence of str
        Names of the fits within it.
    own_effects : Path or None
        File of a user's own effects.
    computed : bool
        True where they were computed now, not found done.

    Returns
    -------
    Posterior or Posteriors
        The first where there is one fit.
    """
    alone = len(folders) == 1
    members = {name: Posterior(place, own_effects, computed, name, name, alone) for name in folders}
    return next(iter(members.values())) if alone else Posteriors(place, own_effects, computed, members)


def _groups(experiments: Sequence[Experiment], together: str | None, file: Path) -> dict[str, tuple[Experiment, ...]]:
    """The experiments of each fit, by its folder."""
    if together is None:
        return {experiment.name: (experiment,) for experiment in experiments}
    if not isinstance(together, str):
        raise InputError(f"--together: found {shown(together)}, expected a material")
    material = normalize("NFC", together)  # as it is read from files
    members = tuple(experiment for experiment in experiments if experiment.material == material)
    if not members:
        materials = ", ".join(sorted({experiment.material for experiment in experiments}))
        raise InputError(f"--together {together}: no such material in {file}; it has {materials}")
    return {members[0].material_folder: members}


def _check_hold(effect: EventEffect, members: Sequence[Experiment], found: str, where: str) -> None:
    """An event happens at a recorded hold of an experiment that is fitted."""
    there = [experiment for experiment in members if effect.acts_on(experiment.name, experiment.control)]
    if not there:
        raise InputError(f"{found} experiment {effect.test} {where}")
    possible = type(effect).variants([experiment.protocol() for experiment in there])
    if all(type(effect)(effect.hold) != variant for variant in possible):
        raise InputError(f"{found} recorded hold {effect.hold} {where}")


def _check_possible(
    effect: Effect, members: Sequence[Experiment], file: Path, known: Mapping[str, type[Effect]], history: History
) -> None:
    """An effect that these holds cannot show at all is an error of the user's, not a prior-shaped posterior."""
    check_history(effect, history)
    option = f"--effect {effect.key}"
    if effect.control is not None:
        found = f"an effect of the tests under {effect.control} alone"
        raise InputError(f"{option}: found {found}, expected {effect.name}: a fit has one amplitude a kind")
    if effect.name not in known:
        return  # the flexible discrepancy shows anywhere
    names = ", ".join(experiment.name for experiment in members)
    if isinstance(effect, EventEffect):
        _check_hold(effect, members, f"{option}: found no", f"in {names} of {file}")
        return
    protocols = [experiment.protocol() for experiment in members]
    variants = [variant.key for variant in type(effect).variants(protocols)]
    if effect.key in variants:
        return
    raise InputError(f"{option}: the holds of {names} cannot show it ({effect.shows})")

"""``wirebayes reproduce``, step by step: fits, tables, pictures, page."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from wirebayes._version import __version__
from wirebayes.inference.fit import seed_of
from wirebayes.inference.policy import Policy, describe
from wirebayes.io import paper
from wirebayes.io.experiment import Experiment
from wirebayes.io.run_folder import open_run, write_csv, write_json
from wirebayes.model.build import build
from wirebayes.model.sample import Likelihood
from wirebayes.model.spec import ModelSpec
from wirebayes.paper import claim_steps, identification, pictures, section_4, verdicts
from wirebayes.paper.held_out import Forecast, forecast_held_out
from wirebayes.processes.workers import workers
from wirebayes.progress import Progress, silent
from wirebayes.report.page import write_page
from wirebayes.results.jobs import Job
from wirebayes.results.jobs import run as run_jobs
from wirebayes.results.read_back import Stored, load_posterior

Row = dict[str, Any]
LIKELIHOODS: tuple[Likelihood, ...] = ("chain", "hold")
POLICY = Policy()
_PRIOR_DRAWS = 20_000  # cheap, so many: a 5 % quantile is then one between 4.7 % and 5.3 %


def reproduce(
    directory: Path,
    seed: int = 0,
    report: Progress = silent,
    policy: Policy = POLICY,
) -> list[str]:
    """Everything the paper shows, on its own tables, with posteriors.

    Parameters
    ----------
    directory : Path
        Gets the page, the tables, the pictures, and ``NAME/LIKELIHOOD`` for each fit: of all holds, and of the first
        five with ``-first-5`` behind.
    report : callable
        ``report(name, done, total)``, for a progress bar.
    policy : Policy
        When a fit counts as converged.

    Returns
    -------
    list of str
        A line for each fit that did not converge.

    Raises
    ------
    InputError
        The folder belongs to something else.
    """
    experiments = paper.experiments()
    published = paper.published()
    training = int(published["identification"]["training_holds"])
    with open_run(directory, paper_configuration(experiments, seed, policy)) as run:
        if run.state != "done":
            jobs = fits(experiments, training)
            run_jobs(jobs, directory, seed, policy=policy, report=report)
            _tables_and_pictures(directory, experiments, published, training, seed, report)
            write_page(directory)
            run.finish()
    return _not_converged(directory, fits(experiments, training))


def paper_configuration(experiments: Sequence[Experiment], seed: int, policy: Policy) -> dict[str, Any]:
    """Everything that decides the results.

    Parameters
    ----------
    experiments : sequence of Experiment
        The paper's; their content counts, as a hash.

    Returns
    -------
    dict
        What ``configuration.json`` holds: another one is refused in the same folder.
    """
    return {
        "command": "reproduce",
        "version": __version__,
        "seed": seed,
        "policy": describe(policy),
        "data_sha256": {e.name: e.data_hash for e in experiments},
    }


def fits(experiments: Sequence[Experiment], training: int) -> list[Job]:
    """Every wire under both likelihoods: trained on its first holds, and on all of them."""
    jobs = []
    for suffix, holds in ((f"-first-{training}", training), ("", None)):
        for experiment in experiments:
            shown = experiment if holds is None else experiment.train(holds)
            hashes = {experiment.name: experiment.data_hash}
            provenance = {"version": __version__, "data_sha256": hashes, "train_holds": holds}
            for likelihood in LIKELIHOODS:
                folder = f"{experiment.name}/{likelihood}{suffix}"
                jobs.append(Job(folder, (shown,), spec=ModelSpec(likelihood=likelihood), provenance=provenance))
    return jobs


def _tables_and_pictures(
    directory: Path,
    experiments: Sequence[Experiment],
    published: Mapping[str, Any],
    training: int,
    seed: int,
    report: Progress,
) -> None:
    table_4 = published["table_4"]
    with workers(len(experiments)) as parallel_map:
        rows = identification.identification_rows(experiments, table_4, training, seed, parallel_map)
    write_table(directory, "least_squares", rows)
    report("tables and pictures", 1, 3)
    drawn = pictures.Gallery(directory)
    chains = _of_wires(directory, experiments, table_4, training, seed, drawn)
    write_table(directory, "measured", [_measured_row(experiment) for experiment in experiments])
    report("tables and pictures", 2, 3)
    lengths = {experiment.name: experiment.length_mm for experiment in experiments}
    lines = {name: section_4.as_line(chain) for name, chain in chains.items()}
    robot = section_4.drift_rows(chains, seed)
    write_table(directory, "robot", robot)
    steps = claim_steps.claim_step_rows(section_4.MAPPED, table_4, lengths, lines)
    write_table(directory, "robot_claim", steps)
    write_table(directory, "robot_mass", section_4.needed(chains))
    _draw_robot(drawn, robot, chains, published["pose_claim"]["centre_moves_less_than_mm"])
    drawn.finish()
    report("tables and pictures", 3, 3)


def _of_wires(
    directory: Path,
    experiments: Sequence[Experiment],
    table_4: Mapping[str, Any],
    training: int,
    seed: int,
    drawn: pictures.Gallery,
) -> dict[str, Stored]:
    """Tables and pictures of the wires; the posterior of each as one history."""
    tables: dict[str, list[Row]] = {"posterior": [], "creep": [], "held_out": [], "sampling": []}
    chains: dict[str, Stored] = {}
    for e in experiments:
        full, first = _stored(directory / e.name, training)
        seen = {}
        for likelihood, stored in first.items():
            rng = np.random.default_rng(seed_of(seed, "held out", e.name, likelihood))
            seen[likelihood] = forecast_held_out(stored, e, rng)
        published = table_4[e.name]
        own = _rows(directory, e, full, seen, published, training, seed)
        for name, rows in own.items():
            tables[name] += rows
        chains[e.name] = full["chain"]
        _draw(drawn, e, published, full, first, seen, own["posterior"], seed)
    for name, rows in tables.items():
        write_table(directory, name, rows)
    return chains


def _draw_robot(drawn: pictures.Gallery, rows: list[Row], chains: Mapping[str, Stored], limit_mm: float) -> None:
    section_4.draw_gallery(drawn, rows, limit_mm)
    section_4.draw_poses(drawn, chains, limit_mm)
    section_4.draw_maps(drawn, chains)


def _stored(folder: Path, training: int) -> tuple[dict[str, Stored], dict[str, Stored]]:
    """An experiment's posteriors by likelihood: of all holds, and of the first ones."""
    full = dict[str, Stored]()
    first = dict[str, Stored]()
    for likelihood in LIKELIHOODS:
        full[likelihood] = load_posterior(folder / likelihood)
        first[likelihood] = load_posterior(folder / f"{likelihood}-first-{training}")
    return full, first


def _rows(
    directory: Path,
    experiment: Experiment,
    full: Mapping[str, Stored],
    seen: Mapping[str, Forecast],
    published: Mapping[str, float],
    training: int,
    seed: int,
) -> dict[str, list[Row]]:
    """What each table says of one experiment."""
    out: dict[str, list[Row]] = {"posterior": [], "creep": [], "held_out": [], "sampling": []}
    name = experiment.name
    for likelihood in LIKELIHOODS:
        stored = full[likelihood]
        draws = stored.draws
        tension = stored.sample.tested_tension_N
        prior = build([experiment], (), ModelSpec(likelihood=likelihood)).prior
        rng = np.random.default_rng(seed_of(seed, "prior", name, likelihood))
        before = prior.named_draws(_PRIOR_DRAWS, rng)
        out["posterior"] += verdicts.verdict_rows(name, likelihood, draws, before, prior.powers, published)
        out["creep"] += verdicts.creep_rows(name, likelihood, draws, published, tension, experiment.length_mm)
        out["held_out"].append(_forecast_row(name, likelihood, seen[likelihood]))
        for suffix in ("", f"-first-{training}"):
            sampling = _sampling_row(directory, name, likelihood, suffix)
            out["sampling"].append(sampling)
    return out


def _draw(
    gallery: pictures.Gallery,
    experiment: Experiment,
    published: dict[str, float],
    full: dict[str, Stored],
    first: dict[str, Stored],
    seen: dict[str, Forecast],
    rows: list[Row],
    seed: int,
) -> None:
    rng = np.random.default_rng(seed_of(seed, "pictures", experiment.name))
    gallery.measured(experiment)
    gallery.intervals(experiment, rows)
    gallery.last_hold(experiment, published, first["hold"], rng)
    gallery.unused_holds(experiment, published, seen)
    gallery.ridges(experiment, published, full)
    gallery.prior(experiment, rng)


def _measured_row(experiment: Experiment) -> Row:
    recorded = experiment.recorded_holds
    tension = np.concatenate([hold.tension_N for hold in recorded])
    losses = [1 - hold.tension_N[-1] / hold.tension_N[0] for hold in recorded]
    return {
        "experiment": experiment.name,
        "material": experiment.material,
        "length_mm": experiment.length_mm,
        "holds": len(recorded),
        "unrecorded_holds": len(experiment.holds) - len(recorded),
        "readings": len(tension),
        "smallest_tension_N": tension.min(),
        "largest_tension_N": tension.max(),
        "median_loss_percent": 100 * float(np.median(losses)),
    }


def _forecast_row(name: str, likelihood: str, seen: Forecast) -> Row:
    return {
        "experiment": name,
        "likelihood": likelihood,
        "readings": len(seen.measured_N),
        "rms_N": seen.rms_N,
        "coverage_90": seen.coverage,
        "median_band_width_N": float(np.median(seen.band_N[2] - seen.band_N[0])),
    }


def _sampling_row(directory: Path, name: str, likelihood: str, suffix: str) -> Row:
    summary = _summary(directory / name / f"{likelihood}{suffix}")
    evaluations = summary["likelihood_evaluations"]
    kept = summary["kept_evaluations"]
    ess = summary["smallest_ess"]
    trained_on = suffix.removeprefix("-").replace("-", " ")
    return {
        "experiment": name,
        "likelihood": likelihood,
        "trained_on": trained_on or "all holds",
        "converged": summary["converged"],
        "autocorrelation_steps": summary["autocorrelation_steps"],
        "smallest_ess": ess,
        "largest_nested_r_hat": summary["largest_nested_r_hat"],
        "likelihood_evaluations": evaluations,
        "effective_draws_per_evaluation": ess / evaluations,
        "effective_draws_per_kept_evaluation": ess / kept,
        "modes_found": summary["modes_found"],
    }


def _summary(folder: Path) -> dict[str, Any]:
    """The summary of a fit."""
    content: dict[str, Any] = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    return content


def write_table(directory: Path, name: str, rows: Sequence[Row]) -> None:
    """The same rows as CSV and JSON.

    Parameters
    ----------
    name : str
        Of both files, without its ending.
    rows : sequence of dict
        All with the keys of the first, which make the header; at least one.
    """
    header = list(rows[0])
    write_csv(directory / f"{name}.csv", header, ([row[key] for key in header] for row in rows))
    write_json(directory / f"{name}.json", list(rows))


def _not_converged(directory: Path, jobs: Sequence[Job]) -> list[str]:
    lines = []
    for job in jobs:
        summary = _summary(directory / job.folder)
        if not summary["converged"]:
            lines.append(f"{job.folder}: {summary['convergence']}")
    return lines

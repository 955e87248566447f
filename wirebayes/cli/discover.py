"""``wirebayes discover``: what the plain model is missing, added to it where it has a name."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from wirebayes.cli.options import (
    ElasticLawOption,
    ExperimentFile,
    ExperimentName,
    HistoryOption,
    Output,
    OwnEffects,
    Seed,
    TrainHolds,
)

if TYPE_CHECKING:
    from wirebayes.discovery.search import Findings


def discover(
    file: ExperimentFile,
    output: Output,
    seed: Seed = 0,
    experiment: ExperimentName = None,
    train_holds: TrainHolds = None,
    elastic_law: ElasticLawOption = "hooke",
    history: HistoryOption = "saturating",
    without: Annotated[
        list[str] | None,
        typer.Option("--without", metavar="EFFECT", help="Leave an effect out of the catalogue; may be repeated."),
    ] = None,
    own_effects: OwnEffects = None,
) -> None:
    """Find the missing effect: DIR/discovery.json, pictures, and DIR/NAME/{plain,final}/posterior.nc."""
    from functools import partial

    from wirebayes import __version__
    from wirebayes.cli.progress import progress
    from wirebayes.discovery.search import catalogue_without, investigate
    from wirebayes.discovery.settings import Settings
    from wirebayes.effects import catalogue, source_of
    from wirebayes.io.experiment import read_experiments, select
    from wirebayes.io.run_folder import open_run, read_json, stored_results, write_json
    from wirebayes.results.jobs import run
    from wirebayes.workers import workers

    experiments = select(read_experiments(file), experiment)
    if train_holds is not None:
        experiments = [e.first(train_holds) for e in experiments]
    kinds = catalogue_without(without or (), catalogue(own_effects))
    configuration = {
        "command": "discover", "version": __version__, "seed": seed, "elastic_law": elastic_law, "history": history,
        "without": sorted(without or ()), "own_effects": source_of(own_effects),
        "train_holds": train_holds, "priors": {e.name: e.priors for e in experiments},
        "data_sha256": {e.name: e.data_hash for e in experiments},
    }  # fmt: skip
    opened = open_run(output, configuration)
    if opened.state == "done":
        return
    with progress() as report:
        with workers(prepare=partial(catalogue, own_effects)) as each:
            findings = investigate(experiments, Settings(elastic_law, history, kinds), seed, report, each)
        jobs = _jobs(findings, elastic_law, history, own_effects)
        run(jobs, output, seed, report=report)
    _pictures(findings, output, own_effects)
    _say_posterior(findings, output)
    write_json(output / "discovery.json", findings.report)
    opened.finish()
    for folder in (folder for job in jobs for folder in job.folders):
        file = output / folder / "summary.json"
        with stored_results(file):
            summary = read_json(file)
            for said in summary["warnings"] if folder.endswith("/plain") else ():
                print(f"{folder}: warning: {said}", file=sys.stderr)
            if not summary["converged"]:
                print(f"{folder}: {summary['convergence']}", file=sys.stderr)


def _jobs(findings: "Findings", law, history, own_effects: Path | None):  # type: ignore[no-untyped-def]
    """Plain fit of every experiment, and the final ones."""
    from wirebayes.discovery.search import Joint, final_models
    from wirebayes.results.jobs import Job

    plain = [("plain", Joint((e,))) for block in findings.final for e in block.experiments]
    out = []
    for kind, model in [*plain, *(("final", m) for m in final_models(findings))]:
        folders = tuple(f"{e.name}/{kind}" for e in model.experiments)
        keys = tuple(f.key for f in model.effects)
        provenance = {"data_sha256": {e.name: e.data_hash for e in model.experiments}}
        out.append(Job(folders[0], model.experiments, keys, own_effects, law, history, "chain", 1.0, provenance,
                       model.near, folders))  # fmt: skip
    return out


def _say_posterior(findings: "Findings", output: Path) -> None:
    """Amplitudes as the final posterior has them, in place of the search's normal approximation."""
    from wirebayes.io.run_folder import read_json

    for e in (e for block in findings.final for e in block.experiments):
        parameters = read_json(output / e.name / "final" / "summary.json")["parameters"]
        for name, amplitude in findings.report["experiments"][e.name]["amplitudes"].items():
            column = next(c for c in parameters if c.startswith(f"{name}."))
            amplitude |= {key: parameters[column][key] for key in ("mean", "q05", "q95")}


def _pictures(findings: "Findings", output: Path, own_effects: Path | None) -> None:
    """Before and after, hold by hold, and one of each finding."""
    from wirebayes.report.pictures.discover import before_and_after, pictures_of_findings

    for e in (e for block in findings.final for e in block.experiments):
        verdict = findings.report["experiments"][e.name]
        before_and_after(output / e.name, verdict, output / f"{e.name}.png", own_effects)
        pictures_of_findings(output / e.name, verdict, own_effects)

"""``wirebayes fit``: the posterior of each experiment, or of all samples of a material together."""

import sys
from typing import Annotated

import typer

from wirebayes.cli.options import (
    ElasticLawOption,
    ExperimentFile,
    ExperimentName,
    HistoryOption,
    LikelihoodOption,
    Output,
    OwnEffects,
    Seed,
    TrainHolds,
)


def fit(
    file: ExperimentFile,
    output: Output,
    seed: Seed = 0,
    experiment: ExperimentName = None,
    train_holds: TrainHolds = None,
    elastic_law: ElasticLawOption = "hooke",
    history: HistoryOption = "saturating",
    likelihood: LikelihoodOption = "chain",
    effect: Annotated[
        list[str] | None,
        typer.Option(
            "--effect", metavar="NAME", help="An effect to add (grip_slip@7 names its hold); may be repeated."
        ),
    ] = None,
    own_effects: OwnEffects = None,
    together: Annotated[
        str | None, typer.Option("--together", metavar="MATERIAL", help="Fit all samples of this material at once.")
    ] = None,
    check: Annotated[
        bool,
        typer.Option("--check/--no-check", help="Check each fit against 999 refitted simulations (some 5 to 20 s)."),
    ] = True,
) -> None:
    """Posterior of the wire's parameters: DIR/NAME/posterior.nc and DIR/NAME/summary.json for each experiment."""
    from scipy import stats

    from wirebayes import __version__
    from wirebayes.cli.progress import progress
    from wirebayes.discovery.model_check import write_checks
    from wirebayes.effects import catalogue, named, source_of
    from wirebayes.errors import InputError
    from wirebayes.io.experiment import read_experiments, select
    from wirebayes.io.run_folder import open_run, read_json, stored_results
    from wirebayes.model.problem import build
    from wirebayes.results.jobs import Job, run

    experiments = select(read_experiments(file), experiment)
    if train_holds is not None:
        experiments = [e.first(train_holds) for e in experiments]
    keys = tuple(effect or ())
    known = catalogue(own_effects)
    effects = [named(key, known) for key in keys]
    if len({e.name for e in effects}) < len(effects):
        raise InputError(f"--effect: found {', '.join(keys)}, expected each effect once")
    shared = {"data_file": file.name, "version": __version__}
    if together is not None:
        members = tuple(e for e in experiments if e.material == together)
        if not members:
            materials = ", ".join(sorted({e.material for e in experiments}))
            raise InputError(f"--together {together}: no such material in {file}; it has {materials}")
        groups = {members[0].material_folder: members}
    else:
        groups = {e.name: (e,) for e in experiments}
    jobs = []
    for folder, members in groups.items():
        for e in effects:
            _check_possible(e, members, file, known)
        exponent = stats.norm(1.0, 1.0) if together is not None else 1.0
        build(
            members, effects, law=elastic_law, history=history, likelihood=likelihood, length_exponent=exponent
        )  # checks priors
        provenance = shared | {"data_sha256": {e.name: e.data_hash for e in members}}
        jobs.append(Job(folder, members, keys, own_effects, elastic_law, history, likelihood, exponent, provenance))
    configuration = {
        "command": "fit", "version": __version__, "seed": seed, "likelihood": likelihood, "elastic_law": elastic_law,
        "history": history, "effects": list(keys), "own_effects": source_of(own_effects),
        "train_holds": train_holds, "together": together, "check": check,
        "priors": {e.name: e.priors for members in groups.values() for e in members},
        "data_sha256": {e.name: e.data_hash for members in groups.values() for e in members},
    }  # fmt: skip
    opened = open_run(output, configuration)
    if opened.state != "done":
        with progress() as report:
            run(jobs, output, seed, report=report)
            if check:
                write_checks(jobs, output, seed, report)
        opened.finish()
    for job in jobs:
        path = output / job.folder / "summary.json"
        with stored_results(path):
            summary = read_json(path)
            for said in summary["warnings"]:
                print(f"{job.folder}: warning: {said}", file=sys.stderr)
            if not summary["converged"]:
                print(f"{job.folder}: {summary['convergence']}", file=sys.stderr)
            found = summary.get("model_check", {})
            if found.get("passed") is False or found.get("gross_errors"):
                print(f"{job.folder}: {found['sentence']}", file=sys.stderr)


def _check_possible(effect, members, file, known) -> None:  # type: ignore[no-untyped-def]
    """An effect that these holds cannot show at all is an error of the user's, not a prior-shaped posterior."""
    from wirebayes.errors import InputError
    from wirebayes.wire.effect import EventEffect

    protocols = [e.protocol() for e in members]
    if effect.name not in known:
        return  # the flexible discrepancy shows anywhere
    variants = [v.key for v in type(effect).variants(protocols)]
    if effect.key in variants:
        return
    if isinstance(effect, EventEffect):
        raise InputError(
            f"--effect {effect.key}: no recorded hold {effect.hold} in experiment {members[0].name} of {file}"
        )
    raise InputError(
        f"--effect {effect.key}: the holds of {', '.join(e.name for e in members)} cannot show it ({effect.shows})"
    )

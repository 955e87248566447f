"""`wirebayes compare`: laws, histories, likelihoods and effects side by side."""

from typing import Annotated, Any

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

Only = Annotated[
    list[str] | None,
    typer.Option("--only", metavar="NAME", help="Compare only this model with the plain one; may be repeated."),
]


def compare(
    file: ExperimentFile,
    output: Output,
    seed: Seed = 0,
    experiment: ExperimentName = None,
    train_holds: TrainHolds = None,
    elastic_law: ElasticLawOption = "hooke",
    history: HistoryOption = "saturating",
    likelihood: LikelihoodOption = "chain",
    only: Only = None,
    own_effects: OwnEffects = None,
) -> None:
    """Compare models on readings that their fits have not seen: DIR/comparison.json and pictures.

    Every model is judged twice: each hold left out in turn, and the last third of the holds (with --train-holds K, all
    after the K-th, and none of them is used before) predicted from the rest.
    """
    from wirebayes import __version__
    from wirebayes.cli.progress import progress
    from wirebayes.comparison.candidates import BASE, Candidate, candidates, problem_of
    from wirebayes.comparison.compare import Task, run, side_by_side
    from wirebayes.effects import catalogue, source_of
    from wirebayes.errors import InputError
    from wirebayes.io.data_checks import of_experiments
    from wirebayes.io.experiment import read_experiments, select
    from wirebayes.io.run_folder import open_run, read_json, stored_results, write_json
    from wirebayes.report.pictures import compare as pictures

    experiments = select(read_experiments(file), experiment)
    base = Candidate(BASE, "", "The plain model.", elastic_law, history, likelihood)
    known = catalogue(own_effects)
    tasks = []
    for one in experiments:
        recorded = len(one.recorded_holds)
        one.first(recorded if train_holds is None else train_holds)  # complains where there are not so many
        if recorded < 3:
            raise InputError(f"{file}, experiment {one.name}: found {recorded} recorded holds, expected 3 or more")
        problem_of(base, one, [])  # checks the file's priors
        chosen = candidates(one, base, known, only)
        missing = set(only or ()) - {c.name for c in chosen}
        if missing:
            names = ", ".join(c.name for c in candidates(one, base, known))
            raise InputError(f"--only {min(missing)}: no such model for {one.name}, expected one of {names}")
        tasks += [Task(one, candidate, train_holds, own_effects) for candidate in chosen]
    configuration = {
        "command": "compare", "version": __version__, "seed": seed, "train_holds": train_holds,
        "elastic_law": elastic_law, "history": history, "likelihood": likelihood,
        "own_effects": source_of(own_effects),
        "models": {one.name: [t.candidate.name for t in tasks if t.experiment is one] for one in experiments},
        "priors": {one.name: one.priors for one in experiments},
        "data_sha256": {one.name: one.data_hash for one in experiments},
    }  # fmt: skip
    for said in of_experiments(experiments):
        typer.echo(f"warning: {said}", err=True)
    opened = open_run(output, configuration)
    if opened.state == "done":
        return
    with progress() as report:
        run(tasks, output, seed, report=report)
    content: dict[str, Any] = {"version": 1, "seed": seed, "experiments": {}}
    for one in experiments:
        with stored_results(output / one.name):
            models = [read_json(output / t.file) for t in tasks if t.experiment is one]
            content["experiments"][one.name] = side_by_side(models, BASE)
        pictures.save(output / one.name, one.name, content["experiments"][one.name], models)
    write_json(output / "comparison.json", content)
    opened.finish()
    for name, table in content["experiments"].items():
        for row in table["models"]:
            if row["failed"] is not None or not row["converged"]:
                typer.echo(f"{name}: {row['name']}: {row['failed'] or row['convergence']}", err=True)

"""`wirebayes compare`: laws, histories, likelihoods and effects side by side."""

import sys
from typing import Annotated

import typer

from wirebayes.cli.options import (
    AsJson,
    ElasticLawOption,
    ExperimentFile,
    ExperimentName,
    HistoryOption,
    LikelihoodOption,
    Output,
    OwnEffects,
    Quiet,
    Seed,
    TrainHolds,
    as_typed,
    folder_for,
)

Only = Annotated[
    list[str] | None,
    typer.Option("--only", metavar="NAME", help="Compare only this model with the plain one; may be repeated."),
]


def compare_command(
    file: ExperimentFile,
    output: Output = None,
    seed: Seed = 0,
    experiment: ExperimentName = None,
    train_holds: TrainHolds = None,
    elastic_law: ElasticLawOption = "hooke",
    history: HistoryOption = "saturating",
    likelihood: LikelihoodOption = "chain",
    only: Only = None,
    own_effects: OwnEffects = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Compare models on readings that their fits have not seen: DIR/comparison.json and pictures.

    Every model is judged twice: each hold left out in turn, and the last third of the holds (with --train-holds K, all
    after the K-th, and none of them is used before) predicted from the rest.
    """
    from wirebayes.answers.lines import for_terminal
    from wirebayes.cli.answer import conclude
    from wirebayes.cli.progress import progress
    from wirebayes.commands.compare import carry_out, plan_comparison
    from wirebayes.views.result import Given

    planned = plan_comparison(
        file,
        experiment=experiment,
        train_holds=train_holds,
        elastic_law=elastic_law,
        history=history,
        likelihood=likelihood,
        only=only or (),
        own_effects=own_effects,
        seed=seed,
    )
    said = [f"warning: {notice.text}" for notice in planned.warnings]
    for line in for_terminal(said, sys.stderr):  # before the work, which takes minutes
        typer.echo(line, err=True)
    with progress() as report:
        found = carry_out(planned, folder_for("compare", file, output, experiment), report)
    given = as_typed(file, experiment=experiment, own_effects=own_effects)
    conclude(found, Given(given), as_json=as_json, quiet=quiet, said=said)

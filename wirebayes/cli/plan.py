"""``wirebayes plan``: what a test would teach before it is done."""

from pathlib import Path
from typing import Annotated

import typer

from wirebayes.cli.options import (
    AsJson,
    ElasticLawOption,
    ExperimentName,
    HistoryOption,
    Output,
    OwnEffects,
    Quiet,
    Seed,
    folder_for,
)

Source = Annotated[
    Path, typer.Argument(metavar="FILE.toml", help="A plan, an experiment file, or the folder of a fit or discover.")
]


def plan_command(
    source: Source,
    output: Output = None,
    seed: Seed = 0,
    experiment: ExperimentName = None,
    budget_min: Annotated[
        float | None, typer.Option("--budget-min", metavar="MIN", help="Available time; longer tests come last.")
    ] = None,
    robot: Annotated[
        str | None, typer.Option("--robot", metavar="ROBOT", help="A robot whose drift within an hour is to be known.")
    ] = None,
    aim: Annotated[
        str | None,
        typer.Option("--aim", metavar="AIM", help="Rank by: parameters, creep, or two effects with a comma between."),
    ] = None,
    elastic_law: ElasticLawOption = "hooke",
    history: HistoryOption = "saturating",
    own_effects: OwnEffects = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Predict what tests would teach before they are done, and rank them: DIR/plan.json."""
    from wirebayes.cli.answer import conclude
    from wirebayes.cli.progress import progress
    from wirebayes.commands.plan import plan as run
    from wirebayes.views.result import Given, typed

    with progress() as report:
        planned = run(
            source,
            experiment=experiment,
            budget_min=budget_min,
            robot=robot,
            aim=None if aim is None else aim.split(","),
            elastic_law=elastic_law,
            history=history,
            own_effects=own_effects,
            seed=seed,
            output=folder_for("plan", source, output),
            progress=report,
        )
    conclude(planned, Given(typed(source)), as_json=as_json, quiet=quiet)

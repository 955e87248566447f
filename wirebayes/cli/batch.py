"""``wirebayes batch``: many experiments in one table, each fitted and searched for missing effects."""

from pathlib import Path
from typing import Annotated

import typer

from wirebayes.cli.options import (
    AsJson,
    ElasticLawOption,
    HistoryOption,
    Output,
    OwnEffects,
    Quiet,
    Scheduler,
    Seed,
    TrainHolds,
    Without,
    folder_for,
)

Files = Annotated[list[Path], typer.Argument(metavar="FILE.toml", help="Experiment files.")]


def batch_command(
    files: Files,
    output: Output = None,
    seed: Seed = 0,
    discover: Annotated[
        bool,
        typer.Option("--discover/--no-discover", help="Find what is missing in each, or fit the plain model only."),
    ] = True,
    check: Annotated[
        bool, typer.Option("--check/--no-check", help="With --no-discover: check each fit against simulations.")
    ] = True,
    posteriors: Annotated[
        bool, typer.Option("--posteriors/--no-posteriors", help="Keep the draws (3 MB a fit), or their summaries only.")
    ] = True,
    keep_going: Annotated[
        bool, typer.Option("--keep-going", help="Give an unreadable file a row with its error instead of stopping.")
    ] = False,
    train_holds: TrainHolds = None,
    elastic_law: ElasticLawOption = "hooke",
    history: HistoryOption = "saturating",
    without: Without = None,
    own_effects: OwnEffects = None,
    scheduler: Scheduler = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Fit many experiments and find what each model is missing: DIR/summary.csv and a folder DIR/NAME for each."""
    from wirebayes.cli.answer import conclude
    from wirebayes.cli.progress import progress
    from wirebayes.commands.batch import batch as run
    from wirebayes.views.result import Given, typed

    with progress() as report:
        many = run(
            files,
            discover=discover,
            check=check,
            posteriors=posteriors,
            keep_going=keep_going,
            train_holds=train_holds,
            elastic_law=elastic_law,
            history=history,
            without=without or (),
            own_effects=own_effects,
            scheduler=scheduler,
            seed=seed,
            output=folder_for("batch", files[0], output),
            progress=report,
        )
    conclude(many, Given(typed(files[0])), as_json=as_json, quiet=quiet)

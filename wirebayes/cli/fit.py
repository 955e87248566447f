"""``wirebayes fit``: the posterior of each experiment, or of all samples of a material together."""

from typing import Annotated

import typer

from wirebayes.cli.options import (
    AsJson,
    DropBreaks,
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


def fit_command(
    file: ExperimentFile,
    output: Output = None,
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
        typer.Option("--check/--no-check", help="Check each fit against 500 to 4000 refitted simulations (1 to 10 s)."),
    ] = True,
    drop_breaks: DropBreaks = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Estimate a wire's parameters: DIR/NAME/posterior.nc and DIR/NAME/summary.json for each experiment."""
    from wirebayes.cli.answer import conclude, page_writer
    from wirebayes.cli.progress import progress
    from wirebayes.commands.fit import fit as run
    from wirebayes.views.result import Given

    with page_writer() as write_page:
        with progress() as report:
            fitted = run(
                file,
                experiment=experiment,
                train_holds=train_holds,
                elastic_law=elastic_law,
                history=history,
                likelihood=likelihood,
                effects=effect or (),
                own_effects=own_effects,
                drop_breaks=drop_breaks,
                together=together,
                check=check,
                seed=seed,
                output=folder_for("fit", file, output, experiment),
                progress=report,
            )
        given = as_typed(
            file,
            experiment=experiment,
            train_holds=train_holds,
            elastic_law=elastic_law,
            history=history,
            own_effects=own_effects,
            drop_breaks=drop_breaks,
        )
        conclude(fitted, Given(given), write_page, as_json=as_json, quiet=quiet)

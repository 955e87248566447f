"""``wirebayes discover``: what the plain model is missing, added to it where it has a name."""

from wirebayes.cli.options import (
    AsJson,
    DropBreaks,
    ElasticLawOption,
    ExperimentFile,
    ExperimentName,
    HistoryOption,
    Output,
    OwnEffects,
    Quiet,
    Seed,
    TrainHolds,
    Without,
    folder_for,
)


def discover_command(
    file: ExperimentFile,
    output: Output = None,
    seed: Seed = 0,
    experiment: ExperimentName = None,
    train_holds: TrainHolds = None,
    elastic_law: ElasticLawOption = "hooke",
    history: HistoryOption = "saturating",
    without: Without = None,
    own_effects: OwnEffects = None,
    drop_breaks: DropBreaks = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Find the missing effect: DIR/discovery.json, pictures, and DIR/NAME/{plain,final}/posterior.nc."""
    from wirebayes.cli.answer import conclude
    from wirebayes.cli.progress import progress
    from wirebayes.commands.discover import discover as run
    from wirebayes.views.result import Given, typed

    with progress() as report:
        findings = run(
            file,
            experiment=experiment,
            train_holds=train_holds,
            elastic_law=elastic_law,
            history=history,
            without=without or (),
            own_effects=own_effects,
            drop_breaks=drop_breaks,
            seed=seed,
            output=folder_for("discover", file, output, experiment),
            progress=report,
        )
    conclude(findings, Given(typed(file)), as_json=as_json, quiet=quiet)

"""``wirebayes check``: what was understood of an experiment file."""

from pathlib import Path
from typing import Annotated

import typer

from wirebayes.cli.options import AsJson, DropBreaks, ExperimentFile, ExperimentName, OwnEffects, Quiet, Seed, as_typed


def check_command(
    file: ExperimentFile,
    output: Annotated[
        Path | None,
        typer.Option("--output", metavar="DIR", help="Folder for check.json and a picture of each experiment."),
    ] = None,
    seed: Seed = 0,
    experiment: ExperimentName = None,
    own_effects: OwnEffects = None,
    drop_breaks: DropBreaks = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Report what was understood of an experiment file, what is suspicious, and what such a test can determine.

    Exit code 0 means that the file can be used, 2 that it cannot. With --output: DIR/check.json and DIR/NAME.svg.
    """
    from wirebayes.cli.answer import print_answer
    from wirebayes.cli.progress import progress
    from wirebayes.commands.check import check as run
    from wirebayes.views.result import Given

    with progress() as report:
        checked = run(
            file,
            experiment=experiment,
            own_effects=own_effects,
            drop_breaks=drop_breaks,
            seed=seed,
            output=output,
            progress=report,
        )
    given = as_typed(file, experiment=experiment, own_effects=own_effects, drop_breaks=drop_breaks)
    print_answer(checked, Given(given), as_json=as_json, quiet=quiet, kept=output is not None)

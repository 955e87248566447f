"""``wirebayes init``: a file to start from for one's own measurements."""

from pathlib import Path
from typing import Annotated

import typer

from wirebayes.cli.options import Quiet, Seed


def init_command(
    directory: Annotated[
        Path | None, typer.Argument(metavar="DIR", help="Folder for the files; created if absent.")
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", metavar="DIR", help="The same folder, given as an option.")
    ] = None,
    seed: Seed = 0,
    quiet: Quiet = False,
) -> None:
    """Write a commented experiment file and a small CSV to replace: DIR/my-wire.toml and DIR/my-wire.csv."""
    from wirebayes.commands.new_experiment import new_experiment as run
    from wirebayes.views.result import typed

    given = [folder for folder in (directory, output) if folder is not None]
    if len(given) != 1:
        raise typer.BadParameter(f"found {len(given)} folders, expected one: DIR or --output DIR")
    file = run(given[0])
    if not quiet:
        print(f"Written: {file} and {file.with_suffix('.csv').name}: a small test, to be replaced by yours")
        print(f"Next: wirebayes check {typed(file)}")

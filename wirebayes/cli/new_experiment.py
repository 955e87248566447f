"""``wirebayes init``: a file to start from for one's own measurements."""

from pathlib import Path
from typing import Annotated

import typer

from wirebayes.cli.options import Quiet


def init_command(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="Folder for the files; created if absent.")],
    quiet: Quiet = False,
) -> None:
    """Write a commented experiment file and a small CSV to replace: DIR/my-wire.toml and DIR/my-wire.csv."""
    from wirebayes.commands.new_experiment import new_experiment as run

    file = run(directory)
    if not quiet:
        print(f"Written: {file} and {file.with_suffix('.csv').name}: a small test, to be replaced by yours")
        print(f"Next: wirebayes check {file}")

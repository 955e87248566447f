"""``wirebayes report``: one page of what a folder holds."""

from pathlib import Path
from typing import Annotated

import typer

from wirebayes.cli.options import Seed


def report_command(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="A folder written by another command.")],
    output: Annotated[
        Path | None, typer.Option("--output", metavar="DIR", help="Folder for the page; default: that of the results.")
    ] = None,
    seed: Seed = 0,
) -> None:
    """Write one self-contained page from a folder of results: DIR/report.html."""
    from wirebayes.commands.write_report import write_report

    print(write_report(directory, output=output))

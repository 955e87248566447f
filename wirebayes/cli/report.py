"""``wirebayes report``: one page of what a folder holds."""

from pathlib import Path
from typing import Annotated

import typer


def report_command(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="A folder written by another command.")],
) -> None:
    """Write one self-contained page from a folder of results: DIR/report.html."""
    from wirebayes.commands.write_report import write_report

    print(write_report(directory))

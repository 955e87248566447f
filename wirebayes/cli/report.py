"""``wirebayes report``: one page of what a folder holds."""

from pathlib import Path
from typing import Annotated

import typer


def report(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="A folder that another command wrote.")],
) -> None:
    """One self-contained page of what a folder of results holds: DIR/report.html."""
    from wirebayes.report.page import write

    print(write(directory))

"""``wirebayes app``: the same in a browser on this machine."""

from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from wirebayes.cli.options import Seed
from wirebayes.errors import InputError


def app_command(
    port: Annotated[
        int | None,
        typer.Option(
            "--port", metavar="N", help="Port of the address 127.0.0.1; 0 for any that is free. Default: 8137."
        ),
    ] = None,
    output: Annotated[
        Path, typer.Option("--output", metavar="DIR", help="Folder for all that is dropped and found.")
    ] = Path("wirebayes-app"),
    seed: Seed = 0,
    browse: Annotated[bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")] = True,
) -> None:
    """Drop the file of a bench into a page, see what was understood, fit, discover, and take the results away.

    The page is served to this machine only (127.0.0.1), nothing leaves it, and it needs no network. Ctrl-C ends it.
    Needs: pip install "wirebayes[app]"
    """
    if find_spec("nicegui") is None:
        raise InputError('wirebayes app: found no NiceGUI, expected it installed: pip install "wirebayes[app]"')
    from wirebayes.app.server import serve

    serve(output, port, seed=seed, browse=browse)

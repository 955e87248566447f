"""One page of a folder of results."""

from pathlib import Path
from typing import Any

from wirebayes.commands.options import path_of
from wirebayes.strict.files import PathLike, given_path
from wirebayes.views.result import Result


def write_report(folder: PathLike | Result[Any], *, output: PathLike | None = None) -> Path:
    """Write one self-contained page from a folder of results.

    Parameters
    ----------
    folder : path, or what a function returned
        The folder of a ``fit``, ``compare``, ``discover``, ``batch``, ``plan``, ``pose``, ``calibrate`` or
        ``reproduce``.
    output : path, optional
        Folder for the page, made where it is absent; that of the results when left out.

    Returns
    -------
    Path
        Of ``report.html``; a temporary folder goes with the results that lie in it.

    Raises
    ------
    InputError
        The folder is not one that a command of ours has written, or the page cannot be written.

    Examples
    --------
    >>> wb.write_report(posterior).name
    'report.html'
    """
    from wirebayes.report.page import write_page  # matplotlib only where it is needed

    results = folder.place.path if isinstance(folder, Result) else given_path("folder", folder)
    return write_page(results, path_of(output, "output"))

"""One page of a folder of results."""

from pathlib import Path
from typing import Any

from wirebayes.strict.files import PathLike
from wirebayes.views.result import Result


def write_report(folder: PathLike | Result[Any]) -> Path:
    """Write one self-contained page from a folder of results.

    Parameters
    ----------
    folder : path, or what a function returned
        The folder of a ``fit``, ``compare``, ``discover``, ``batch``, ``plan``, ``pose``, ``calibrate`` or
        ``reproduce``.

    Returns
    -------
    Path
        Of ``report.html`` in that folder; a temporary folder goes with the results that lie in it.

    Raises
    ------
    InputError
        The folder is not one that a command of ours has written.

    Examples
    --------
    >>> wb.write_report(posterior).name
    'report.html'
    """
    from wirebayes.report.page import write_page  # matplotlib only where it is needed

    return write_page(folder.place.path if isinstance(folder, Result) else Path(folder))

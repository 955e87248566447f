"""What a command says at its end: the answer in a few lines, where the results lie, and what to do next."""

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from wirebayes.commands.write_report import write_report
from wirebayes.json_files.plain import plain
from wirebayes.processes.copies import prepared_copy
from wirebayes.views.result import NOTHING, Given, Result

PAGE = "report.html"


PageWriter = Callable[[Path], object]


@contextmanager
def page_writer() -> Iterator[PageWriter]:
    """What writes the page of a folder; what draws it is loaded within the block, while the command computes."""
    with prepared_copy(partial(import_module, "wirebayes.report.page")) as in_copy:
        yield lambda folder: in_copy(write_report, folder)


def conclude(
    result: Result[Any],
    given: Given = NOTHING,
    write_page: PageWriter = write_report,
    *,
    as_json: bool = False,
    quiet: bool = False,
) -> None:
    """Write the page of a command's results and print the answer.

    Parameters
    ----------
    result : Result
    given : Given
    write_page : PageWriter
    as_json : bool
        Print the summary as JSON instead.
    quiet : bool
        Print nothing.
    """
    folder = result.place.path
    if result.computed or not (folder / PAGE).is_file():
        write_page(folder)
    print_answer(result, given, as_json=as_json, quiet=quiet)


def print_answer(
    result: Result[Any], given: Given = NOTHING, *, as_json: bool = False, quiet: bool = False, kept: bool = True
) -> None:
    """Print the answer of a command, as `conclude` does; for results without a page, or not `kept` in a folder, too."""
    folder = result.place.path
    if as_json:
        print(json.dumps(plain(result.summary()), indent=2, ensure_ascii=False, allow_nan=False))
    elif not quiet:
        look = f" (open {folder / PAGE})" if (folder / PAGE).is_file() else ""
        where = [f"Results: {folder}{look}"] if kept else []
        print("\n".join([*result.lines(), *where, f"Next: {result.next_step(given)}"]))

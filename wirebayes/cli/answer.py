"""What a command says at its end: the answer in a few lines, where the results lie, and what to do next."""

import codecs
import json
import sys
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from wirebayes.answers.lines import for_terminal
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
    said: Collection[str] = (),
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
        Print nothing but the warnings.
    said : collection of str
        Warnings that were printed before the work.
    """
    folder = result.place.path
    if result.computed or not (folder / PAGE).is_file():
        write_page(folder)
    print_answer(result, given, as_json=as_json, quiet=quiet, said=said)


def print_answer(
    result: Result[Any],
    given: Given = NOTHING,
    *,
    as_json: bool = False,
    quiet: bool = False,
    kept: bool = True,
    said: Collection[str] = (),
) -> None:
    """Print the answer of a command, what limits it, and what to do next.

    Parameters
    ----------
    result : Result
    given : Given
    as_json, quiet, said
        As for `conclude`.
    kept : bool
        Whether the results lie in a folder that stays.
    """
    shown = not (as_json or quiet)
    if as_json:
        print_json(result.summary())
    if shown:
        print(result, flush=True)  # before the warnings, which go another way
    unsaid = [message for message in result.messages if message not in said]
    for line in for_terminal(unsaid, sys.stderr):
        print(line, file=sys.stderr, flush=True)
    if shown:
        print("\n".join([*(_where(result) if kept else []), *next_lines(result.next_step(given))]))


def print_json(content: object) -> None:
    """Print JSON; letters that the encoding of standard output lacks are written in ASCII, by JSON's own codes."""
    has_all_letters = codecs.lookup(sys.stdout.encoding).name == "utf-8"
    print(json.dumps(plain(content), indent=2, ensure_ascii=not has_all_letters, allow_nan=False))


def _where(result: Result[Any]) -> list[str]:
    """Where the results lie."""
    folder = result.place.path
    look = f" (open {folder / PAGE})" if (folder / PAGE).is_file() else ""
    return [f"Results: {folder}{look}"]


def next_lines(step: str) -> list[str]:
    """The next step, an alternative a line."""
    first, *others = step.splitlines()
    return for_terminal([f"Next: {first}", *(f"  or: {other}" for other in others)])

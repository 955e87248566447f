"""Ctrl-C and SIGTERM: one line, no process and no unfinished file left behind, and the process is gone.

A signal may arrive anywhere: in an import, in a C extension that swallows exceptions, in a library that prints what it
was doing. So nothing is raised. Results are written whole (`wirebayes.io.run_folder`) and fits leave checkpoints,
therefore there is nothing to unwind: the handler tidies up and ends the process.
"""

import os
import signal
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import NoReturn

_WORDS = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated"}
_OURS = ("configuration.json", ".lock")  # every run begins with these
_PATIENCE_S = 2.0  # for a worker to tidy up, before it is killed

_unfinished: set[Path] = set()
_results: Path | None = None  # the folder of the command's results
_held_back = False
_arrived: list[int] = []


def watch(arguments: Sequence[str]) -> None:
    """End this process tidily on SIGINT and SIGTERM: exit codes 130 and 143, one line on stderr.

    Parameters
    ----------
    arguments : sequence of str
        Of the command line: until `results_in` is called, they say where results of an earlier run may lie.
    """

    def last_words(number: int) -> str:
        return f"{_WORDS[signal.Signals(number)]}; {_kept(arguments)}\n"

    _handle(signal.SIGINT, last_words)
    _handle(signal.SIGTERM, last_words)


def watch_silently() -> None:
    """The same for a worker process: its parent speaks, and hears Ctrl-C for both.

    A copy of its parent forgets what that one was doing when it was made: holding signals back, and writing files.
    """
    global _held_back
    _unfinished.clear()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _handle(signal.SIGTERM, lambda number: "")
    _held_back = False  # not before: until then it would speak as its parent does
    for number in _arrived:
        signal.raise_signal(number)


@contextmanager
def held_back() -> Iterator[None]:
    """Let signals wait while processes start, which are not known yet and shall not hear Ctrl-C themselves."""
    global _held_back
    blocks = hasattr(signal, "pthread_sigmask")
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT}) if blocks else set()
    _held_back = True
    try:
        yield
    finally:
        _held_back = False
        if blocks:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        for number in _arrived:
            signal.raise_signal(number)


@contextmanager
def unfinished(path: Path) -> Iterator[None]:
    """Remove a file that is being written if the block does not end."""
    _unfinished.add(path)
    try:
        yield
    except BaseException:
        path.unlink(missing_ok=True)
        raise
    finally:
        _unfinished.discard(path)


def results_in(folder: Path) -> None:
    """Say where a command's results lie, for its last words; folders within it come later and do not count."""
    global _results
    _results = _results or folder


def _handle(which: signal.Signals, last_words) -> None:  # type: ignore[no-untyped-def]
    def handler(number: int, frame: FrameType | None) -> None:
        if _held_back:
            _arrived.append(number)
        else:
            _leave(number, last_words(number))

    signal.signal(which, handler)


def _leave(number: int, words: str) -> NoReturn:
    for each in _WORDS:
        signal.signal(each, signal.SIG_IGN)  # a second Ctrl-C must not cut this short
    if "multiprocessing" in sys.modules:
        from multiprocessing import active_children

        children = active_children()
        for child in children:
            child.terminate()
        for child in children:
            child.join(_PATIENCE_S)
            child.kill()
    for path in list(_unfinished):
        path.unlink(missing_ok=True)
    if words:
        show_cursor = "\r\x1b[?25h\x1b[K" if sys.stderr.isatty() else ""  # a progress bar hides it
        os.write(2, (show_cursor + words).encode())
    os._exit(128 + number)


def _kept(arguments: Sequence[str]) -> str:
    """What there is of results."""
    folder = _results or _named_output(arguments)
    if folder is None or not (folder / "configuration.json").is_file():
        return "no results were kept"
    if (folder / "complete.json").exists():
        return "the results are complete" if _results else "no results were kept"
    if any(path.is_file() and path.name not in _OURS for path in folder.rglob("*")):
        return "run the same command again to go on"
    return "no results were kept"


def _named_output(arguments: Sequence[str]) -> Path | None:
    words = [part for word in arguments for part in (word.split("=", 1) if word.startswith("--output=") else [word])]
    return next((Path(after) for word, after in zip(words, words[1:], strict=False) if word == "--output"), None)

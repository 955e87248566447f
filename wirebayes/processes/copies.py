"""Work shared with copies of this process, which have in memory whatever it has: nothing is loaded or sent anew.

For pieces of some hundredths of a second, such as pictures: a worker of `wirebayes.processes.workers` would take longer
to load what draws them.
"""

import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from wirebayes.processes.interrupt import held_back, watch_silently
from wirebayes.processes.workers import cores

if TYPE_CHECKING:
    from multiprocessing.connection import Connection
    from multiprocessing.process import BaseProcess

T = TypeVar("T")
_THREADS = Path("/proc/self/task")  # one folder a thread; on Linux alone
_BYTES = 4  # of the number of a piece


def in_copies(pieces: Sequence[Callable[[], T]]) -> list[T]:
    """The results of some pieces of work, done on all cores where this process can be copied, in their order.

    A copy has only the thread that made it, and waits for ever for a lock that another one held: a process with several
    threads does all pieces itself, and so does every process where systems other than Linux run. A worker does, too:
    the other cores have work of their own.

    Parameters
    ----------
    pieces : sequence of functions without arguments
        Their results can be pickled.

    Raises
    ------
    Exception
        What a piece raises.
    """
    from multiprocessing import parent_process

    copies = min(cores(), len(pieces)) - 1
    if copies < 1 or parent_process() is not None or not _has_one_thread():
        return [piece() for piece in pieces]
    waiting = _queue(len(pieces))
    started = _started(copies, pieces, waiting)
    done: dict[int, T] = {}
    try:
        for number in _numbers(waiting):
            done[number] = pieces[number]()
    finally:
        os.close(waiting)
        answers: list[dict[int, T] | Exception] = [_answer(process, end) for process, end in started]
    for answer in answers:
        if isinstance(answer, Exception):
            raise answer
        done |= answer
    return [done[number] if number in done else piece() for number, piece in enumerate(pieces)]


def _started(copies: int, pieces: Sequence[Callable[[], T]], waiting: int) -> "list[tuple[BaseProcess, Connection]]":
    """Copies that work on the pieces, each with the end of a pipe where its results arrive."""
    from multiprocessing import get_context

    context = get_context("fork")
    started: list[tuple[BaseProcess, Connection]] = []
    with held_back():
        for _ in range(copies):
            here, there = context.Pipe(duplex=False)
            process = context.Process(target=_work, args=(pieces, waiting, there))
            process.start()
            there.close()
            started.append((process, here))
    return started


def _has_one_thread() -> bool:
    return _THREADS.is_dir() and sum(1 for _ in _THREADS.iterdir()) == 1


def _queue(length: int) -> int:
    """A pipe that holds the numbers of all pieces: whoever is free reads the next one."""
    reading, writing = os.pipe()
    os.write(writing, b"".join(number.to_bytes(_BYTES, "little") for number in range(length)))
    os.close(writing)
    return reading


def _numbers(waiting: int) -> Iterator[int]:
    """Numbers of pieces, until none is left."""
    while number := os.read(waiting, _BYTES):
        yield int.from_bytes(number, "little")


def _work(pieces: Sequence[Callable[[], T]], waiting: int, answers: "Connection") -> None:
    """In a copy: do pieces until none is left, and send all results, or what went wrong."""
    watch_silently()
    try:
        answers.send({number: pieces[number]() for number in _numbers(waiting)})
    except Exception as error:
        answers.send(error)


def _answer(process: "BaseProcess", end: "Connection") -> "dict[int, T] | Exception":
    """What a copy sends before it ends; nothing where it was ended before."""
    try:
        answer: dict[int, T] | Exception = end.recv()
    except EOFError:
        answer = {}
    process.join()
    return answer

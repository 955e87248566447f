"""Work for copies of this process, which have in memory whatever it has: nothing is loaded or sent anew.

`in_copies` is for pieces of some hundredths of a second, such as pictures: a worker of `wirebayes.processes.workers`
would take longer to be sent what they show. `prepared_copy` is for what can begin while this process is busy, and
`loaded_meanwhile` loads here what is needed later, while this process waits.
"""

import os
import pickle
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from importlib import import_module
from threading import Thread
from typing import TYPE_CHECKING, Any, TypeVar

from wirebayes.processes.interrupt import held_back, watch_silently
from wirebayes.processes.workers import cores, may_be_copied

if TYPE_CHECKING:
    from multiprocessing.connection import Connection
    from multiprocessing.process import BaseProcess

T = TypeVar("T")
_BYTES = 4  # of the number of a piece


def in_copies(pieces: Sequence[Callable[[], T]]) -> list[T]:
    """The results of some pieces of work, done on all cores where this process can be copied, in their order.

    A worker cannot: it has a second thread, and the other cores have work of their own.

    Parameters
    ----------
    pieces : sequence of functions without arguments
        Their results can be pickled.

    Raises
    ------
    Exception
        What a piece raises.
    """
    copies = min(cores(), len(pieces)) - 1
    if copies < 1 or not may_be_copied():
        return [piece() for piece in pieces]
    waiting = _queue(len(pieces))
    started = [_with_pipe(_work, pieces, waiting) for _ in range(copies)]
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
    results = []
    for number, piece in enumerate(pieces):
        result = done[number] if number in done else piece()
        results.append(result)
    return results


@contextmanager
def prepared_copy(prepare: Callable[[], object]) -> Iterator[Callable[..., Any]]:
    """Let a copy of this process prepare something while the block runs, for what needs it at the block's end.

    The yielded function takes another one and its arguments, and returns what that returns in the copy, or raises what
    that raises. Where this process cannot be copied, has one core, or the copy is gone, it is done here, unprepared.

    Parameters
    ----------
    prepare : function without arguments
        Such as what loads a module.
    """
    if cores() == 1 or not may_be_copied():
        yield lambda function, *arguments: function(*arguments)
        return
    process, end = _with_pipe(_prepare_and_serve, prepare)

    def ask(function: Callable[..., Any], *arguments: Any) -> Any:
        try:
            end.send((function, arguments))
            answer = end.recv()
        except (EOFError, OSError):
            return function(*arguments)
        if isinstance(answer, Exception):
            raise answer
        return answer

    try:
        yield ask
    finally:
        end.close()
        process.terminate()
        process.join()


@contextmanager
def loaded_meanwhile(module: str) -> Iterator[None]:
    """Load a module while the block runs, which has this process wait for others most of the time.

    Parameters
    ----------
    module : str
        Its full name.
    """
    thread = Thread(target=import_module, args=(module,))
    thread.start()
    try:
        yield
    finally:
        thread.join()


def _with_pipe(function: Callable[..., None], *arguments: object) -> "tuple[BaseProcess, Connection[Any, Any]]":
    """Start a function in a copy of this process, with the far end of a pipe as its last argument."""
    from multiprocessing import get_context

    context = get_context("fork")
    here, there = context.Pipe()
    process = context.Process(target=_begin, args=(here, function, (*arguments, there)))
    with held_back():
        process.start()
    there.close()
    return process, here


def _begin(here: "Connection[Any, Any]", function: Callable[..., None], arguments: tuple[object, ...]) -> None:
    """Let go, in a copy, of the end of the pipe that is its parent's, so that it hears when the parent is gone."""
    watch_silently()
    here.close()
    function(*arguments)


def _prepare_and_serve(prepare: Callable[[], object], there: "Connection[Any, Any]") -> None:
    """Prepare, in a copy, and then do what is asked for until the parent needs no more."""
    try:
        prepare()
    except Exception:
        return  # the parent does it itself, and says what is wrong
    while True:
        try:
            function, arguments = there.recv()
        except EOFError:
            return
        try:
            there.send(function(*arguments))
        except Exception as error:
            there.send(_as_can_be_sent(error))


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


def _work(pieces: Sequence[Callable[[], T]], waiting: int, answers: "Connection[Any, Any]") -> None:
    """Do pieces, in a copy, until none is left, and send all results, or what went wrong."""
    try:
        answers.send({number: pieces[number]() for number in _numbers(waiting)})
    except Exception as error:
        answers.send(_as_can_be_sent(error))


def _as_can_be_sent(error: Exception) -> Exception:
    """An error, or one of the nearest class above its own with the same message, if it cannot be made anew elsewhere.

    Pickle makes an error by calling its class with the message alone, and some want more.
    """
    text = str(error)
    above = [kind for kind in type(error).__mro__[1:] if issubclass(kind, Exception)]
    makers: list[Callable[[], Exception]] = [lambda: error, *(partial(kind, text) for kind in above)]
    for make in makers:
        try:
            sent = make()
            pickle.loads(pickle.dumps(sent))
        except Exception:
            continue
        return sent
    return RuntimeError(text)


def _answer(process: "BaseProcess", end: "Connection[Any, Any]") -> "dict[int, T] | Exception":
    """What a copy sends before it ends; nothing where it was ended before."""
    try:
        answer: dict[int, T] | Exception = end.recv()
    except EOFError:
        answer = {}
    process.join()
    return answer

"""Independent work on all cores; the results do not depend on how many there are."""

import gc
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from time import sleep
from typing import TYPE_CHECKING, Any

from wirebayes._version import __version__
from wirebayes.errors import InputError
from wirebayes.processes.interrupt import held_back, watch_silently

if TYPE_CHECKING:
    from concurrent.futures import Executor, Future
    from multiprocessing.process import BaseProcess

ParallelMap = Callable[..., Iterable[Any]]  # as the built-in `map`
_PATIENCE_S = 10.0  # for a scheduler and its first worker to answer: a cluster's network takes a second at most
_AT_ONCE = 1000  # pieces handed over and not finished: more would only fill the memory of whoever keeps the list
_FORKS = sys.platform == "linux"  # elsewhere system libraries do not survive a fork, or there is none
_THREADS_OF_THIS = Path("/proc/self/task")  # one folder a thread; on Linux alone
_LOOKS, _MOMENT_S = 10, 0.001  # ten times as long as a thread takes to be gone
_TRACKER = "ignore:resource_tracker"
# objects made from one look for cycles of them to the next, as `gc.set_threshold` takes them: what is imported, and
# most of what is computed, stays, and to look at it again and again takes a twentieth of a search, a tenth of a fit
SELDOM = 100_000, 50, 100
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def one_thread_each() -> None:
    """One thread for linear algebra, here and in processes started later, unless the user said otherwise."""
    for name in _THREADS:
        os.environ.setdefault(name, "1")


def cores() -> int:
    """How many this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def may_be_copied() -> bool:
    """Whether a copy of this process would work, and may be made.

    A copy has only the thread that made it, and waits for ever for a lock that another one held. A worker of
    `multiprocessing.Pool` may start no processes. Systems other than Linux do not say how many threads there are.
    """
    from multiprocessing import current_process  # every command imports this module, few start processes

    return not current_process().daemon and _THREADS_OF_THIS.is_dir() and _is_alone()


def _is_alone() -> bool:
    """Whether no other thread runs; one that has just ended is listed for a moment longer."""
    for _ in range(_LOOKS):
        if sum(1 for _ in _THREADS_OF_THIS.iterdir()) == 1:
            return True
        sleep(_MOMENT_S)
    return False


def give_way(steps: int) -> None:
    """Let this process come second where another one wants its core, by so many steps of niceness.

    Three are half of the weight, ten a tenth: on a machine that is busy otherwise, the other work goes first, too.
    """
    if hasattr(os, "nice"):
        os.nice(steps)


def load_early() -> None:
    """Begin to load what processes will need, for a program of several threads, which cannot be copied.

    On Linux its processes are forked from one that loads their modules once for all of them (`wirebayes.preloaded`);
    elsewhere each loads its own when it starts, and nothing happens here.
    """
    if _FORKS:
        _prepared(["wirebayes.preloaded"])


def _prepared(preload: list[str]) -> None:
    """Start what processes are started by, if it does not run yet."""
    one_thread_each()
    # Python's tracker of semaphores removes those of a process that is gone; that it had to is nobody's business.
    ignored = os.environ.get("PYTHONWARNINGS", "")
    if _TRACKER not in ignored:
        os.environ["PYTHONWARNINGS"] = ",".join(filter(None, [ignored, _TRACKER]))
    if not _FORKS:
        return
    from multiprocessing import forkserver, resource_tracker

    safe = os.environ.get("PYTHONSAFEPATH")
    os.environ["PYTHONSAFEPATH"] = "1"  # a user's random.py in this folder is not Python's
    try:
        with held_back():
            resource_tracker.ensure_running()
        with held_back():  # anew, for the tracker's start lets signals through again
            forkserver.set_forkserver_preload(preload)
            forkserver.ensure_running()
    finally:
        if safe is None:
            del os.environ["PYTHONSAFEPATH"]


def _started_anew() -> str:
    """Prepare to start processes that are no copies, and say how that is called."""
    _prepared([])
    return "forkserver" if _FORKS else "spawn"


@contextmanager
def computing() -> Iterator[None]:
    """Compute within the block, whoever called: with one thread for linear algebra, and apart from the user's script.

    Matrices here are small, and several threads only wait for each other: beside other work on the machine everything
    took five times as long. Environment variables say nothing to a numpy that a user's script has loaded before. And
    Python looks for cycles of objects as seldom as in a command.

    Processes that start within the block do not import that script, so it need not guard its top level. A new process
    imports the main module of its parent in case that work was defined there. Ours never is, and a script whose top
    level calls the package would start itself again in each process.
    """
    from threadpoolctl import threadpool_limits  # only for what computes: it looks through all loaded libraries

    main = sys.modules["__main__"]
    known = {name: getattr(main, name) for name in ("__file__", "__spec__") if hasattr(main, name)}
    for name in known:
        setattr(main, name, None)
    before = gc.get_threshold()
    gc.set_threshold(*SELDOM)
    try:
        with threadpool_limits(1):
            yield
    finally:
        gc.set_threshold(*before)
        for name, value in known.items():
            setattr(main, name, value)


@contextmanager
def workers(most: int | None = None, prepare: Callable[[], object] | None = None) -> Iterator[ParallelMap]:
    """A `map` over processes, as many as there are cores.

    There are processes on one core, too: a copy that was sent may be laid out otherwise in memory, and what is computed
    with it differ in the last bit.

    Parameters
    ----------
    most : int, optional
        Pieces of work, where their number is known: no more processes than that, and none for a single piece.
    prepare : function, optional
        Called once in every process before its first piece of work, such as to load a user's own effects.
    """
    if most is not None and most < 2:
        yield map
        return
    with processes(most, prepare) as pool:
        yield pool.map


@contextmanager
def processes(most: int | None = None, prepare: Callable[[], object] | None = None) -> Iterator["Executor"]:
    """Processes of this machine, as many as there are cores and no more than `most`; `prepare` as for `workers`.

    They are copies of this one where it may be copied, which have in memory whatever it has. A worker of
    `multiprocessing.Pool` may not start any: there one thread does the work.
    """
    from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
    from multiprocessing import active_children, current_process, get_context

    if current_process().daemon:
        with ThreadPoolExecutor(1, initializer=prepare) as thread:
            yield thread
        return
    n = cores() if most is None else max(1, min(cores(), most))
    before = active_children()
    how = "fork" if may_be_copied() else _started_anew()
    pool = ProcessPoolExecutor(n, get_context(how), _prepare, (prepare,))
    try:
        with held_back():
            for _ in range(n):
                pool.submit(cores)  # processes start now, not when they are needed
        yield pool
    except BaseException:  # do not wait for work that nobody wants any more
        for process in active_children():
            if process not in before:
                process.terminate()
        pool.shutdown(wait=False, cancel_futures=True)
        raise
    pool.shutdown()


def start_apart(function: Callable[..., object], *arguments: Any) -> "BaseProcess":
    """Start a function in a process of its own, which may start others, is ended by SIGTERM, and ends with this one.

    Parameters
    ----------
    function : function that can be pickled
    arguments
        Of the function.
    """
    from multiprocessing import get_context

    context = get_context(_started_anew())
    process = context.Process(target=_apart, args=(function, arguments))  # type: ignore[attr-defined]
    with held_back():
        process.start()
    return process


def _apart(function: Callable[..., object], arguments: tuple[Any, ...]) -> None:
    _prepare(None)
    function(*arguments)


@contextmanager
def executor(scheduler: str | None = None, most: int | None = None) -> Iterator["Executor"]:
    """Where work is done: the workers of a Dask cluster, or processes of this machine.

    Parameters
    ----------
    scheduler : str, optional
        Address of a Dask scheduler, such as ``tcp://10.0.0.1:8786``. Work whose worker is lost is done again elsewhere.
    most : int, optional
        As for `workers`, on this machine.

    Raises
    ------
    InputError
        No scheduler answers at that address, it has no workers, or Dask is not installed.
    """
    if scheduler is None:
        with processes(most) as pool:
            yield pool
        return
    try:
        from distributed import Client
    except ImportError:
        message = "found no dask.distributed, expected it installed: pip install 'wirebayes[cluster]'"
        raise InputError(f"--scheduler: {message}") from None
    try:
        client = Client(scheduler, timeout=_PATIENCE_S, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        message = f"found no Dask scheduler there ({type(error).__name__}), expected an address such as tcp://HOST:8786"
        raise InputError(f"--scheduler {scheduler}: {message}") from None
    with client:
        try:
            client.wait_for_workers(1, timeout=_PATIENCE_S)
        except TimeoutError:
            raise InputError(f"--scheduler {scheduler}: found no workers there, expected one or more") from None
        versions = client.run(_version, on_error="return")
        # a worker that has just died is still on the scheduler's list, and no reason to stop
        there = {worker: found for worker, found in versions.items() if not isinstance(found, OSError)}
        for worker, found in there.items():
            if isinstance(found, BaseException):
                message = f"found no wirebayes on {worker} ({found}), expected version {__version__} on each"
                raise InputError(f"--scheduler {scheduler}: {message}")
            if found != __version__:
                message = f"found wirebayes {found} on {worker}, expected {__version__}, as here"
                raise InputError(f"--scheduler {scheduler}: {message}")
        if not there:
            raise InputError(f"--scheduler {scheduler}: found no workers there, expected one or more")
        yield client.get_executor(pure=False)


def as_finished(
    pool: "Executor", function: Callable[[Any], Any], work: Iterable[tuple[Any, Any]]
) -> Iterator[tuple[Any, "Future[Any]"]]:
    """Each piece of work's key with its finished future, in the order in which they end.

    Parameters
    ----------
    function : function of one piece of work
    work : iterable of pairs
    """
    from queue import SimpleQueue

    finished: SimpleQueue[Future[Any]] = SimpleQueue()
    pieces, running = iter(work), dict[Any, Any]()

    def hand_over(count: int) -> None:
        for key, piece in islice(pieces, count):
            future = pool.submit(function, piece)
            running[future] = key
            future.add_done_callback(finished.put)

    hand_over(_AT_ONCE)
    while running:
        future = finished.get()
        yield running.pop(future), future
        hand_over(1)


def _version() -> str:
    return __version__


def _prepare(prepare: Callable[[], object] | None) -> None:
    from threading import Thread

    watch_silently()
    Thread(target=_leave_with_parent, daemon=True).start()
    if prepare is not None:
        prepare()


def _leave_with_parent() -> None:
    """A process whose parent was killed would wait for work for ever."""
    from multiprocessing import parent_process

    parent = parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)

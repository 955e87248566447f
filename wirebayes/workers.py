"""Independent work on all cores; what comes out does not depend on how many there are."""

import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any

from wirebayes.interrupt import held_back, watch_silently

Each = Callable[..., Iterable[Any]]  # as the built-in `map`
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def one_thread_each() -> None:
    """One thread for linear algebra, here and in processes started later, unless the user said otherwise."""
    for name in _THREADS:
        os.environ.setdefault(name, "1")


def cores() -> int:
    """How many this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def without_script() -> Iterator[None]:
    """Processes that start within the block do not import the user's script, so it need not guard its top level.

    A new process imports the main module of its parent in case that work was defined there. Ours never is, and a script
    whose top level calls the package would start itself again in each process.
    """
    main = sys.modules["__main__"]
    known = {name: getattr(main, name) for name in ("__file__", "__spec__") if hasattr(main, name)}
    for name in known:
        setattr(main, name, None)
    try:
        yield
    finally:
        for name, value in known.items():
            setattr(main, name, value)


@contextmanager
def workers(most: int | None = None, prepare: Callable[[], object] | None = None) -> Iterator[Each]:
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
    # every command imports this module, few start processes
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import active_children, get_context

    one_thread_each()
    # Python's tracker of semaphores removes those of a process that is gone; that it had to is nobody's business.
    os.environ["PYTHONWARNINGS"] = ",".join(filter(None, [os.environ.get("PYTHONWARNINGS"), "ignore:resource_tracker"]))
    n = cores() if most is None else min(cores(), most)
    before = active_children()
    pool = ProcessPoolExecutor(n, get_context("spawn"), _prepare, (prepare,))
    try:
        with held_back():
            for _ in range(n):
                pool.submit(cores)  # processes start now, not when they are needed
        yield pool.map
    except BaseException:  # do not wait for work that nobody wants any more
        for process in active_children():
            if process not in before:
                process.terminate()
        pool.shutdown(wait=False, cancel_futures=True)
        raise
    pool.shutdown()


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

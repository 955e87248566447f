"""One run at a time in a folder of results: a lock file that says who holds it, and that no dead process can hold.

The system's own lock on the file (``flock``) decides, not that the file is there: it ends with the process that took
it, however that ended, so a file left behind by a killed run is simply taken over. Where the system or its disk has no
such locks, there is none.
"""

import json
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path

from wirebayes.errors import InputError
from wirebayes.processes.interrupt import unfinished

LOCK = ".lock"


@contextmanager
def locked(directory: Path) -> Iterator[None]:
    """Keep other runs out of a folder.

    Parameters
    ----------
    directory : Path
        It exists.

    Raises
    ------
    InputError
        Another run holds it: names its process, its machine and since when.
    """
    path = directory / LOCK
    handle = _taken(path)
    try:
        with unfinished(path):
            os.ftruncate(handle, 0)
            os.pwrite(handle, json.dumps(_myself()).encode(), 0)
            yield
    finally:
        path.unlink(missing_ok=True)  # before it is released: who waits for it finds that the file is another
        os.close(handle)


def _taken(path: Path) -> int:
    while True:
        handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            _lock(handle)
            if _same(handle, path):
                return handle
        except BlockingIOError:
            found = f"in use by {_holder(handle)}"
            os.close(handle)
            expected = "a folder that no other run is writing in; wait for it, or end it"
            raise InputError(f"{path.parent}: found it {found}, expected {expected}") from None
        os.close(handle)


def _lock(handle: int) -> None:
    try:
        import fcntl
    except ImportError:  # not on Windows
        return
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise
    except OSError:  # a network's disk without locks
        return


def _same(handle: int, path: Path) -> bool:
    """Whether the file is still the one that was opened: its last holder may have removed it in between."""
    try:
        return os.path.samestat(os.fstat(handle), os.stat(path))
    except FileNotFoundError:
        return False


def _myself() -> dict[str, str | int]:
    since = datetime.now(UTC).strftime("%Y-%m-%d %H:%M:%S UTC")
    return {"pid": os.getpid(), "host": socket.gethostname(), "since": since}


def _holder(handle: int) -> str:
    try:
        found = json.loads(os.pread(handle, 1000, 0))
        return f"process {found['pid']} on {found['host']} since {found['since']}"
    except (OSError, ValueError, KeyError, TypeError):  # it has only just begun
        return "another process"

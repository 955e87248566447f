"""Writing results: whole files or none, and folders that belong to one configuration.

A folder of results holds ``configuration.json``, the resolved configuration that made it. The same configuration
resumes there, another is refused; so nothing is ever mixed or overwritten.
"""

import csv
import errno
import glob
import io
import json
import os
import re
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from wirebayes._version import __version__
from wirebayes.errors import InputError
from wirebayes.json_files.plain import plain
from wirebayes.processes.interrupt import results_in, unfinished
from wirebayes.processes.lock import LOCK, locked
from wirebayes.strict.files import read_bytes

CONFIGURATION = "configuration.json"
COMPLETE = "complete.json"
_PARTIAL = ".partial"


# The disk is full or a limit reached, the folder read-only or gone, or a file stands where a folder should.
_UNWRITABLE = (
    errno.ENOSPC,
    errno.EDQUOT,
    errno.EFBIG,
    errno.EROFS,
    errno.EACCES,
    errno.EPERM,
    errno.EIO,
    errno.ENOENT,
    errno.ENOTDIR,
    errno.EEXIST,
    errno.ENAMETOOLONG,
)


@contextmanager
def writable(place: Path) -> Iterator[None]:
    """Say in one line where nothing can be written; what was finished before stays.

    Raises
    ------
    InputError
        Instead of the system's error within the block.
    """
    try:
        yield
    except OSError as error:
        if error.errno not in _UNWRITABLE:
            raise
        expected = "a folder to write in, with room for the results; mend that and run the same command again"
        raise InputError(f"{place}: cannot be written ({os.strerror(error.errno)}), expected {expected}") from error


def write_bytes(path: Path, content: bytes) -> None:
    """Write a whole file or nothing: a reader, or a run killed half-way, never meets half of it."""
    with writable(path):
        handle, partial = tempfile.mkstemp(prefix=f".{path.name}.", suffix=_PARTIAL, dir=path.parent)
        with unfinished(Path(partial)):
            with os.fdopen(handle, "wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            os.chmod(partial, 0o666 & ~_umask())  # mkstemp makes private files, results are for everyone
            os.replace(partial, path)


def write_text(path: Path, content: str) -> None:
    """Write a whole UTF-8 text file with line feeds, or nothing; bytes of file names that are no UTF-8 as codes."""
    write_bytes(path, content.encode("utf-8", "backslashreplace"))


def write_json(path: Path, content: Any) -> None:
    """Write JSON: keys in the order given, numbers in their shortest exact form, NaN and infinity as null."""
    write_text(path, json.dumps(plain(content), indent=2, ensure_ascii=False, allow_nan=False) + "\n")


def write_csv(path: Path, header: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Write a CSV with line feeds; floats in their shortest exact form, NaN as an empty cell.

    Parameters
    ----------
    path : Path
        Written whole or not at all.
    header : sequence of str
    rows : iterable of sequences
        As long as the header. None is an empty cell too.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    for row in rows:
        writer.writerow(["" if value is None else value for value in plain(list(row))])
    write_text(path, text.getvalue())


def write_parquet(path: Path, header: Sequence[str], rows: Sequence[Sequence[Any]]) -> None:
    """Write the same table as `write_csv` as Parquet, where pyarrow is installed; otherwise nothing.

    Parameters
    ----------
    header : sequence of str
    rows : sequence of sequences
        As long as the header; a column holds values of one type, or None.
    """
    try:
        from pyarrow import BufferOutputStream, array, table
        from pyarrow.parquet import write_table
    except ImportError:
        return
    columns = {name: array([plain(row[i]) for row in rows]) for i, name in enumerate(header)}
    stream = BufferOutputStream()
    write_table(table(columns), stream)
    write_bytes(path, stream.getvalue().to_pybytes())


def read_json(path: Path, otherwise: str = "") -> Any:
    """A JSON file that a command of ours wrote.

    Parameters
    ----------
    otherwise : str
        What to say where it is absent.

    Raises
    ------
    InputError
        It is absent or not JSON.
    """
    try:
        return json.loads(read_bytes(path))
    except InputError as error:
        absent = otherwise or f"{path}: found no such file, expected the results of a finished command"
        raise (InputError(absent) if not path.exists() else error) from None
    except (ValueError, RecursionError):
        raise InputError(f"{path}: found no valid JSON, expected what the command wrote") from None


@contextmanager
def stored_results(path: Path, instead: str = "run its command again in a new folder") -> Iterator[None]:
    """Blame what is stored, not the code, when something cannot be taken out of it: it was damaged or is another's.

    Libraries raise whatever they like on a damaged file, so every exception counts; it stays the error's cause.

    Parameters
    ----------
    instead : str
        What the user can do.

    Raises
    ------
    InputError
        Instead of any other exception within the block.
    """
    try:
        yield
    except InputError:
        raise
    except Exception as error:
        found = f"{type(error).__name__}: {error}"
        expected = f"what wirebayes {__version__} wrote there, unchanged; {instead}"
        raise InputError(f"{path}: cannot be used ({_short(found, 120)}), expected {expected}") from error


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def clear_leftovers(directory: Path, pattern: str = "**/.*") -> None:
    """Remove what a killed run was writing: files of ours that were never finished."""
    for path in directory.glob(pattern + _PARTIAL):
        path.unlink(missing_ok=True)


def check_file(path: Path) -> None:
    """Refuse a file that could not be written, before the work that would be lost; remove a killed run's leftovers.

    Raises
    ------
    InputError
        Its folder is absent or not writable, or the path is a folder itself.
    """
    if path.is_dir():
        raise InputError(f"{path}: found a folder, expected the name of a file to write")
    if not path.parent.is_dir() or not os.access(path.parent, os.W_OK):
        raise InputError(f"{path}: found no writable folder {path.parent}, expected one to write the file in")
    clear_leftovers(path.parent, f".{glob.escape(path.name)}.*")


@dataclass(frozen=True)
class Run:
    """A folder of results opened for one configuration.

    Attributes
    ----------
    directory : Path
    state : {"new", "resumed", "done"}
        Made just now; begun earlier and not finished; finished earlier.
    """

    directory: Path
    state: Literal["new", "resumed", "done"]

    def finish(self) -> None:
        """Mark the results as complete, so that the same command finds them done."""
        write_json(self.directory / COMPLETE, {"complete": True})


@contextmanager
def open_run(directory: str | Path, configuration: Mapping[str, Any]) -> Iterator[Run]:
    """Open a folder for a configuration, making it when it is absent, and keep other runs out until the block ends.

    Enter it once everything that was given has been checked: before that, nothing should be written.

    Parameters
    ----------
    directory : str or Path
    configuration : mapping
        Everything that decides the results: command, version, options as resolved, seed, hash of the data.

    Yields
    ------
    Run

    Raises
    ------
    InputError
        The folder belongs to another configuration (names what differs) or to something else, cannot be made, or
        another run is writing in it; or its disk is full, whenever that happens.
    """
    directory = Path(directory)
    wanted = plain(configuration)
    if check_run(directory, wanted) == "done":
        results_in(directory)
        yield Run(directory, "done")
        return
    with writable(directory):
        directory.mkdir(parents=True, exist_ok=True)
        with locked(directory):
            state = check_run(directory, wanted)  # it may have been finished a moment ago
            if state == "new":
                write_json(directory / CONFIGURATION, wanted)
            results_in(directory)
            clear_leftovers(directory)
            yield Run(directory, state)


def check_links(directory: Path) -> None:
    """Refuse a folder to be made where a link leads to nothing."""
    for place in (directory, *directory.parents):
        if place.is_symlink() and not place.exists():
            found = f"a link to {os.readlink(place)}, which is not there"
            raise InputError(f"{place}: found {found}, expected a folder, or no such link")


def check_run(directory: Path, configuration: Mapping[str, Any]) -> Literal["new", "resumed", "done"]:
    """State in which `open_run` would find a folder; writes nothing and raises as `open_run` does."""
    expected = "a new or empty folder, or one made with the same configuration"
    try:
        present = sorted(
            path.name for path in directory.iterdir() if path.name != LOCK and not path.name.endswith(_PARTIAL)
        )
    except FileNotFoundError:
        check_links(directory)
        return "new"
    except NotADirectoryError:
        raise InputError(f"{directory}: found a file, expected a folder") from None
    except OSError as error:
        raise InputError(f"{directory}: cannot be read ({error.strerror}), expected a readable folder") from None
    if not present:
        return "new"
    stored = directory / CONFIGURATION
    if CONFIGURATION not in present:
        raise InputError(f"{directory}: found {present[0]} but no {CONFIGURATION}, expected {expected}")
    try:
        found = json.loads(stored.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        raise InputError(f"{stored}: found no readable configuration, expected {expected}") from None
    different = differences(found, plain(configuration))
    if different:
        listed = "; ".join(different[:3]) + (f"; and {len(different) - 3} more" if len(different) > 3 else "")
        raise InputError(f"{directory}: made with another configuration: {listed}; expected {expected}")
    return "done" if COMPLETE in present else "resumed"


def differences(found: Any, wanted: Any, key: str = "") -> list[str]:
    """What differs between two configurations, one short phrase for each key.

    Parameters
    ----------
    found, wanted : JSON values
        The configuration that a folder has, and the one that was requested.
    key : str
        Where they stand; empty for whole configurations.

    Returns
    -------
    list of str
        Empty where they agree.
    """
    if isinstance(found, list) and isinstance(wanted, dict):  # stored before options had names, in the order of now
        if len(found) != len(wanted):
            return [f"{key} are others there, stored without their names"]
        found = dict(zip(wanted, found, strict=True))
    if isinstance(found, dict) and found and wanted == _ABSENT:
        wanted = {}
    if isinstance(wanted, dict) and wanted and found == _ABSENT:
        found = {}
    if isinstance(found, dict) and isinstance(wanted, dict):
        phrases = []
        for name in dict.fromkeys([*wanted, *found]):
            below = _below(key, name)
            phrases += differences(_value(found, name), _value(wanted, name), below)
        return phrases
    if found == wanted:
        return []
    if _is_checksum(found) and _is_checksum(wanted):
        return [f"{key.removeprefix('raw.') or 'content'} has changed since"]
    return [f"{key or 'content'} is {_short(found)} there, {_short(wanted)} here"]


def _is_checksum(value: Any) -> bool:
    """Whether a value stands for a file's content (SHA-256)."""
    return isinstance(value, str) and re.fullmatch(r"[0-9a-f]{64}", value) is not None


_ABSENT = "nothing"


def _value(side: Mapping[str, Any], name: str) -> Any:
    """A value of a configuration; an option that is absent is unset."""
    return side.get(name, None if name.startswith("--") else _ABSENT)


def _below(key: str, name: str) -> str:
    """Where a value stands; the name of an option is enough."""
    return f"{key}.{name}" if key and not name.startswith("--") else name


def _short(value: Any, most: int = 40) -> str:
    text = "unset" if value is None else value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
    return text if len(text) <= most else text[: most - 3] + "..."

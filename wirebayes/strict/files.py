"""Files named by a user, read whole: absent, unreadable, endless and foreign ones end in a one-line error."""

import csv
import io
import os
import re
import stat
from pathlib import Path

from wirebayes.errors import InputError, shown

PathLike = str | os.PathLike[str]
_NEWLINE = re.compile(r"\r\n|\n|\r")


def given_path(name: str, value: PathLike) -> Path:
    """The path that an argument gives.

    Parameters
    ----------
    name : str
        Of the argument, for the message.
    value : path

    Raises
    ------
    InputError
        It is no path.
    """
    if not isinstance(value, str | os.PathLike):
        raise InputError(f"{name}: found {shown(value)}, expected a path")
    return Path(value)


def read_bytes(path: Path) -> bytes:
    """The content of a file.

    Raises
    ------
    InputError
        Missing, unreadable, a folder, a pipe or a device.
    """
    try:
        if not stat.S_ISREG(path.stat().st_mode) and not path.is_dir():  # reading may never end
            raise InputError(f"{path}: found a pipe or a device, expected a file")
        return path.read_bytes()
    except FileNotFoundError:
        raise InputError(f"{path}: found no such file, expected a readable file") from None
    except IsADirectoryError:
        raise InputError(f"{path}: found a folder, expected a file") from None
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise InputError(f"{path}: cannot be read ({reason}), expected a readable file") from None


def read_text(path: Path, expected: str = "text") -> str:
    """The text of a UTF-8 file, without its byte-order mark; `expected` says what an empty file should hold.

    Raises
    ------
    InputError
        Missing, unreadable, empty, or not UTF-8 (names the line of the first bad byte).
    """
    raw = read_bytes(path)
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = len(_NEWLINE.split(raw[: error.start].decode("utf-8", "replace")))
        found = f"byte 0x{error.object[error.start]:02x}"
        raise InputError(f"{path}, line {line}: found {found}, expected UTF-8 text") from None
    if not text.strip():
        raise InputError(f"{path}, line 1, column 1: found an empty file, expected {expected}")
    return text


def csv_rows(source: Path, text: str) -> list[tuple[int, list[str]]]:
    """The rows of a CSV that are not empty, each with the number of its last line.

    Raises
    ------
    InputError
        A row cannot be divided into cells.
    """
    lines = csv.reader(io.StringIO(text, newline=""))
    try:
        return [(lines.line_num, row) for row in lines if row]
    except csv.Error as error:
        raise InputError(
            f"{source}, line {lines.line_num}: found no CSV ({error}), expected cells with commas"
        ) from None

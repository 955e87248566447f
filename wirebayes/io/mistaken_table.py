"""A table of readings given where an experiment file is expected: which file reads it, or how one is made of it."""

import re
import shlex
import tomllib
from pathlib import Path

from wirebayes.errors import InputError
from wirebayes.strict.files import read_bytes

_WORKBOOKS = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")  # how files of Excel begin, those before 2007 with the second
_BEGINNING = 1 << 16  # bytes in which a preamble ends and readings begin
_BETWEEN = re.compile(r"[;,\t ]+")
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", re.ASCII)
_ROWS = 3  # as many as a test needs readings


def complaint(path: Path, wrong: InputError) -> InputError:
    """What to say of a file that is no experiment file.

    Parameters
    ----------
    wrong : InputError
        What its reader said.

    Returns
    -------
    InputError
        That of the reader, unless the file is a table of readings: then with the experiment file beside it that reads
        it, or the command that makes one.
    """
    if not is_table_file(path):
        return wrong
    found = f"{path}: found a table of readings"
    reader = _reader(path)
    if reader is not None:
        return InputError(f"{found}, expected the experiment file that names it: {reader}")
    command = f"wirebayes import {shlex.quote(str(path))} --output FOLDER --length-mm LENGTH"
    return InputError(f"{found}, expected an experiment file, which this makes of it: {command}")


def is_table_file(path: Path) -> bool:
    """Whether a file is a workbook, or a text with rows of numbers."""
    beginning = read_bytes(path)[:_BEGINNING]
    if beginning.startswith(_WORKBOOKS):
        return True
    text = beginning.replace(b"\0", b"").decode("latin-1")  # digits are the same in every encoding, but for the zeros
    return path.suffix.lower() != ".toml" and sum(map(_is_row, text.splitlines())) >= _ROWS


def _is_row(line: str) -> bool:
    """Whether a line holds two numbers or more, as a reading and what it is of do."""
    return sum(_NUMBER.fullmatch(cell.strip("\"'")) is not None for cell in _BETWEEN.split(line)) > 1


def _reader(path: Path) -> Path | None:
    """The first experiment file beside a table that names it as its readings."""
    for beside in sorted(path.parent.glob("*.toml")):
        try:
            content = tomllib.loads(beside.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            continue
        tests = content.get("experiment")
        for test in tests if isinstance(tests, list) else []:
            named = test.get("readings") if isinstance(test, dict) else None
            if isinstance(named, str) and named and (beside.parent / named).resolve() == path.resolve():
                return beside
    return None

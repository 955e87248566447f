"""Sentences in lines that a terminal shows whole."""

import re
import shutil
import sys
from collections.abc import Iterable
from textwrap import wrap
from typing import TextIO

LETTERS = 100  # in a line at most, on terminals that have room for more: longer ones are hard to read
# not to be broken: a value with its interval and unit, a number with its unit, a unit in brackets
_PIECE = re.compile(r"(?:\w+ )?\S+ \[[^]]*\](?: [^\s\d(]\S*)?|\d (?=[^\W\d])|\(\w+ \w+\)")
_COMMAND = re.compile(r"(Next|  or): wirebayes ")
_FIXED = "\u00a0"  # stands for a space at which no line is broken


def for_terminal(lines: Iterable[str], stream: TextIO | None = None) -> list[str]:
    """Lines as wide as the terminal at most; whole where none is, as in a pipe or a file.

    Parameters
    ----------
    lines : iterable of str
    stream : text stream, optional
        To which they go; standard output when left out.
    """
    if not (stream or sys.stdout).isatty():
        return list(lines)
    columns = min(shutil.get_terminal_size().columns, LETTERS)
    return [part for line in lines for part in in_columns(line, columns)]


def in_columns(line: str, columns: int) -> list[str]:
    """A line in lines of so many letters at most, those that go on indented: a number stays with its interval and unit.

    What stands behind *Next* stays in one line if it is a command, to be copied.

    Parameters
    ----------
    line : str
    columns : int
    """
    if _COMMAND.match(line):
        return [line]
    indent = len(line) - len(line.lstrip())
    whole = _PIECE.sub(lambda piece: piece[0].replace(" ", _FIXED), line)
    parts = wrap(whole, columns, subsequent_indent=" " * (indent + 2), break_long_words=False, break_on_hyphens=False)
    return [part.replace(_FIXED, " ") for part in parts] or [line]

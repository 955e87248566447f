"""Cells as a file has them, each with its place, before they are interpreted."""

import re
from dataclasses import dataclass
from pathlib import Path

_SPACES = " \u00a0\u2009\u202f"
_NUMBER = re.compile(rf"[+\-\u2212]?(\d{{1,3}}([.,'\u2019{_SPACES}]\d{{3}})+|\d*)([.,]\d*)?([eE][+-]?\d+)?")
_CLOCK = r"\d+:\d{1,2}(:\d{1,2})?([.,]\d+)?"
_MOMENT = re.compile(rf"(\d{{4}}-\d{{1,2}}-\d{{1,2}}|\d{{1,2}}[./]\d{{1,2}}[./]\d{{2,4}})([T ]+{_CLOCK})?|{_CLOCK}")


@dataclass(frozen=True)
class Row:
    """One line of a file.

    Attributes
    ----------
    line : int
        Counted from 1, as editors and spreadsheets do.
    cells : tuple of str
        Without spaces round them.
    comment : bool
        Whether it began with a comment sign, which `cells` leave out.
    """

    line: int
    cells: tuple[str, ...]
    comment: bool = False

    @property
    def filled(self) -> list[str]:
        """The cells that hold something."""
        return [cell for cell in self.cells if cell]

    def cell(self, column: int) -> str:
        """A cell, empty where the line is shorter."""
        return self.cells[column] if column < len(self.cells) else ""


@dataclass(frozen=True)
class Sheet:
    """A file as rows of cells.

    Attributes
    ----------
    path : Path
    rows : tuple of Row
        Those that hold something.
    lettered : bool
        Whether people know its columns by letters.
    described : str
        How it was read: delimiter or sheet.
    """

    path: Path
    rows: tuple[Row, ...]
    lettered: bool = False
    described: str = ""

    def column_name(self, column: int) -> str:
        """A column as people count it."""
        return letters(column) if self.lettered else str(column + 1)


def letters(column: int) -> str:
    """A spreadsheet's name of a column counted from 0: A, B, …, Z, AA."""
    name, left = "", column + 1
    while left:
        left, digit = divmod(left - 1, 26)
        name = chr(ord("A") + digit) + name
    return name


def is_number(cell: str) -> bool:
    """Whether a cell looks like a number in any country's writing."""
    return bool(_NUMBER.fullmatch(cell)) and any(c.isdigit() for c in cell.lower().partition("e")[0])


def is_moment(cell: str) -> bool:
    """Whether a cell looks like a date or a clock."""
    return bool(_MOMENT.fullmatch(cell))


def is_value(cell: str) -> bool:
    """Whether a cell looks like something measured."""
    return is_number(cell) or is_moment(cell)

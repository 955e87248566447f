"""Cells as a file has them, each with its place, before they are interpreted."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from wirebayes.io.bench.compound_times import is_spelt

_SPACES = " \u00a0\u2009\u202f"
_NUMBER = re.compile(  # with a digit before its exponent
    rf"(?=[^eE]*\d)[+\-\u2212]?(\d{{1,3}}([.,'\u2019{_SPACES}]\d{{3}})+|\d*)([.,]\d*)?([eE][+-]?\d+)?"
)
_OF_INCH = re.compile(r"(?:(\d+)[ -])?(\d+)/(2|4|8|16|32|64)")
# By the first three letters of their names in English and German.
MONTHS = {
    "jan": 1, "feb": 2, "mar": 3, "apr": 4, "may": 5, "jun": 6, "jul": 7, "aug": 8, "sep": 9, "oct": 10, "nov": 11,
    "dec": 12, "mär": 3, "mrz": 3, "mai": 5, "okt": 10, "dez": 12,
}  # fmt: skip
_DATE = (
    r"(?P<year_first>\d{4}(?P<sign>[-./])\d{1,2}(?P=sign)\d{1,2})|(?P<compact>\d{8}(?=[T ]+\d))"
    r"|(?P<year_last>\d{1,2}[./]\d{1,2}[./]\d{2,4}|\d{1,2}-\d{1,2}-\d{4})"
    rf"|(?P<named>\d{{1,2}}[-. /]{{1,2}}({'|'.join(MONTHS)})[^\W\d_]{{0,6}}[-. /]{{1,2}}(\d{{4}}|\d{{2}}))"
)
_CLOCK = (
    r"(?P<first>\d{1,12}):(?P<second>\d{1,2})(:(?P<third>\d{1,2}))?"
    r"(([.,]|(?<=\d:\d\d:\d\d):(?=\d{3}(?!\d)))(?P<fraction>\d+))?"
    r"( ?(?P<half>[ap])\.?m\.?)?(?(date) ?(?P<zone>Z|UTC|[+\-\u2212]\d{2}(:?\d{2})?)?)"
)
# 2026年6月14日 9時58分0秒 in Japanese, and in Chinese
_EAST_ASIAN = str.maketrans({"年": "-", "月": "-", "日": " ", "時": ":", "时": ":", "点": ":", "分": ":", "秒": " "})
_EAST_ASIAN_SIGNS = {"年", "時", "时"}
_MOMENT = re.compile(rf"(?P<date>{_DATE})([T ]+{_CLOCK})?", re.IGNORECASE)
_BARE_CLOCK = re.compile(rf"(?P<date>(?!))?{_CLOCK}", re.IGNORECASE)  # the same groups, without a date


@dataclass(frozen=True)
class SheetRow:
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

    @cached_property
    def may_be_a_reading(self) -> bool:
        """Whether its cells are measured, as `is_measured` says; asked several times of every row."""
        return is_measured(self.filled)

    def cell(self, column: int) -> str:
        """A cell, empty where the line is shorter."""
        return self.cells[column] if column < len(self.cells) else ""


@dataclass(frozen=True)
class Sheet:
    """A file as rows of cells.

    Attributes
    ----------
    path : Path
    rows : tuple of SheetRow
        Those that hold something.
    lettered : bool
        Whether people know its columns by letters.
    described : str
        How it was read: delimiter or sheet.
    encoding : str
        Of a text file.
    """

    path: Path
    rows: tuple[SheetRow, ...]
    lettered: bool = False
    described: str = ""
    encoding: str = "utf-8"

    def column_name(self, column: int) -> str:
        """A column as people count it."""
        return letters(column) if self.lettered else str(column + 1)

    def also(self, described: str) -> "Sheet":
        """The sheet with one thing more to say of how it was read."""
        return replace(self, described=f"{self.described}, {described}")


def letters(column: int) -> str:
    """A spreadsheet's name of a column counted from 0: A, B, …, Z, AA."""
    name, left = "", column + 1
    while left:
        left, digit = divmod(left - 1, 26)
        name = chr(ord("A") + digit) + name
    return name


def is_number(cell: str) -> bool:
    """Whether a cell looks like a number in any country's writing."""
    return _NUMBER.fullmatch(cell) is not None


def of_fraction(cell: str) -> str | None:
    """The number of a length as rulers in inches have it, ``12 5/8``; None of other cells."""
    found = _OF_INCH.fullmatch(cell)
    return f"{int(found[1] or 0) + int(found[2]) / int(found[3]):.6f}".rstrip("0") if found else None


def moment(cell: str) -> re.Match[str] | None:
    """The parts of a cell that is a clock, a date, or both: the groups of the patterns above; None where it is none."""
    if is_number(cell):  # as most cells of long files are
        return None
    if not _EAST_ASIAN_SIGNS.isdisjoint(cell):
        cell = cell.translate(_EAST_ASIAN).strip(" :")
    return _BARE_CLOCK.fullmatch(cell) or _MOMENT.fullmatch(cell)


def is_moment(cell: str) -> bool:
    """Whether a cell looks like a date, a clock or a time in several units."""
    return moment(cell) is not None or is_spelt(cell)


def is_measured(cells: Sequence[str]) -> bool:
    """Whether cells may be those of a reading: two values or more, and no more words than values.

    A word and a number may be a title, or a mean below the readings.
    """
    values = sum(map(is_value, cells))
    return values >= 2 and 2 * values >= len(cells)


def is_value(cell: str) -> bool:
    """Whether a cell looks like something measured."""
    return is_number(cell) or is_moment(cell)

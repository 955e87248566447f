"""A CSV of plain numbers, split into cells: every complaint names the file, the line and the column.

Readings, protocols, histories of robots and calibration sessions are all read so; columns in memory become the same
table (`wirebayes.strict.columns`). What a column means is known to whoever asks for it.
"""

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from wirebayes.errors import InputError, shown
from wirebayes.numeric.typing import Floats
from wirebayes.sentences import counted
from wirebayes.strict.files import csv_rows, read_text
from wirebayes.strict.hint import hint

# No bench comes near these: beyond them numbers are typing mistakes, and soon their squares overflow.
LARGEST = {
    "displacement_mm": 1e8,  # 100 km
    "time_s": 1e10,  # three hundred years
    "tension_N": 1e9,  # 100,000 t, several times the largest bridge's main cable
    "temperature_C": 1e4,  # above the boiling point of every wire
}
LARGEST_READING = 1e9  # metres, seconds, newtons of a robot: nothing that is measured comes near
_NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_WHOLE = re.compile(r"\d{1,9}", re.ASCII)
_NEWLINE = re.compile(r"\r\n|\n|\r")


@dataclass(frozen=True)
class Header:
    """The columns that a table must and may have; groups come whole or not at all.

    Attributes
    ----------
    required : tuple of str
    groups : tuple of tuple of str
    """

    required: tuple[str, ...]
    groups: tuple[tuple[str, ...], ...] = ()

    @property
    def known(self) -> tuple[str, ...]:
        """Every name."""
        return (*self.required, *(name for group in self.groups for name in group))

    def __str__(self) -> str:
        optional = [group[0] if len(group) == 1 else f"{group[0]}…{group[-1]}" for group in self.groups]
        return ",".join(self.required) + (f" (and optionally {', '.join(optional)})" if optional else "")


@dataclass(frozen=True)
class Numbers:
    """What the cells of a column may hold.

    Attributes
    ----------
    expected : str
        As a message says it.
    least, most : float
    above : float
        The number must be greater.
    whole : bool
    empty : bool
        An empty cell is NaN.
    """

    expected: str = f"a number of at most {LARGEST_READING:.0e} in size"
    least: float = -LARGEST_READING
    most: float = LARGEST_READING
    above: float = -math.inf
    whole: bool = False
    empty: bool = False

    def hold(self, value: float) -> bool:
        """Whether a number may stand there; NaN never."""
        return self.least <= value <= self.most and self.above < value and not (self.whole and value != int(value))


@dataclass(frozen=True)
class CsvTable:
    """A CSV split into fields; `complain` turns a row and a column into a place a person can find.

    Attributes
    ----------
    path : Path
    header : list of str
    rows : list of list of str
    header_line : int
    lines : sequence of int
        On which line of the file each row stands; empty where none is left out.
    """

    path: Path
    header: list[str]
    rows: list[list[str]]
    header_line: int = field(default=1, kw_only=True)
    lines: Sequence[int] = field(default=(), kw_only=True)

    def line(self, row: int) -> int:
        """The line of the file on which a row stands."""
        return self.lines[row] if self.lines else row + 2

    def place(self, row: int, column: str) -> str:
        """Where a cell stands; the header where there is no such column."""
        if column not in self.header:
            return f"line {self.header_line}, header"
        return f"line {self.line(row)}, column {self.header.index(column) + 1} ({column})"

    def header_place(self, column: int | None = None) -> str:
        """Where the header stands, or one of its names, counted from 0."""
        return f"line {self.header_line}" + ("" if column is None else f", column {column + 1}")

    def check_header(self, header: Header) -> None:
        """Refuse columns that are not known, twice there or missing."""
        for position, name in enumerate(self.header):
            where = f"{self.path}, {self.header_place(position)}"
            if name not in header.known:
                meant = hint(name, header.known)
                raise InputError(f"{where}: found {shown(name)}{meant}, expected a header of {header}")
            if name in self.header[:position]:
                raise InputError(f"{where}: found {name} a second time, expected it once")
        self._check_complete(header.required, header)
        for group in header.groups:
            is_begun = not set(group).isdisjoint(self.header)
            if is_begun:
                self._check_complete(group, header)

    def _check_complete(self, names: Sequence[str], header: Header) -> None:
        """Refuse a header that lacks one of some names."""
        for name in names:
            if name not in self.header:
                where = f"{self.path}, {self.header_place()}"
                raise InputError(f"{where}: found no column {name}, expected a header of {header}")

    def complain(self, row: int, column: str, found: str, expected: str) -> InputError:
        """The error for one cell.

        Parameters
        ----------
        row : int
            Position among the rows of readings, from 0.
        found, expected : str
            As the message shows them: what stands there, and what should.

        Returns
        -------
        InputError
            With the file, the line and the column; the caller raises it.
        """
        return InputError(f"{self.path}, {self.place(row, column)}: found {found}, expected {expected}")

    def cell(self, row: int, column: str) -> str:
        """What a cell says."""
        return self.rows[row][self.header.index(column)]

    def number(self, row: int, column: str) -> float:
        """A finite number of a size that this column may have."""
        text = self.cell(row, column)
        if not _NUMBER.fullmatch(text):
            raise self.complain(row, column, shown(text) if text else "an empty cell", "a finite decimal number")
        value = float(text)
        if not abs(value) <= LARGEST[column]:
            raise self.complain(row, column, shown(text), f"a number of at most {LARGEST[column]:.0e} in size")
        return value

    def whole(self, row: int, column: str) -> int:
        """A whole number, 0 or more, of at most nine digits."""
        text = self.cell(row, column)
        if not _WHOLE.fullmatch(text):
            found = shown(text) if text else "an empty cell"
            raise self.complain(row, column, found, "a whole number from 0 to 999999999")
        return int(text)

    def numbers(self, allowed: Callable[[str], Numbers]) -> Floats:
        """Every cell as a number.

        Parameters
        ----------
        allowed : callable
            Of a column's name to what its cells may hold.

        Returns
        -------
        (rows, columns) array
            NaN where a cell may be empty and is.
        """
        columns = [(name, allowed(name)) for name in self.header]
        values = []
        for row in range(len(self.rows)):
            values.append([self._value(row, name, kind) for name, kind in columns])
        return np.array(values, float).reshape(len(self.rows), len(columns))

    def _value(self, row: int, column: str, allowed: Numbers) -> float:
        text = self.cell(row, column)
        if not text and allowed.empty:
            return math.nan
        value = float(text) if _NUMBER.fullmatch(text) else math.nan
        if not allowed.hold(value):
            no_number = allowed.empty and math.isnan(value)
            expected = f"an empty cell or {allowed.expected}" if no_number else allowed.expected
            raise self.complain(row, column, shown(text) if text else "an empty cell", expected)
        return value


def read_table(path: Path, required: Sequence[str], optional: Sequence[str]) -> CsvTable:
    """Split a CSV into cells, each column once and every row as long as the header.

    Parameters
    ----------
    required, optional : sequence of str
        Names of the columns.

    Raises
    ------
    InputError
        With the file, line and column, what was found and what was expected.
    """
    header = Header(tuple(required), tuple((name,) for name in optional))
    lines = _NEWLINE.split(read_text(path, f"a header of {header} and a line for each reading"))
    while not lines[-1].strip():
        lines.pop()
    cells = []
    for line in lines:
        cells.append([_unquoted(cell.strip()) for cell in line.split(",")])
    names, *rows = cells
    table = CsvTable(path, names, rows)
    table.check_header(header)
    _check_lengths(table)
    if not rows:
        raise InputError(f"{path}, line 2: found no readings, expected at least one")
    return table


def _unquoted(cell: str) -> str:
    """A cell without the quotes around it, as R writes the names of columns."""
    return cell[1:-1] if len(cell) > 1 and cell[0] == cell[-1] == '"' else cell


def csv_table(source: Path, text: str) -> CsvTable:
    """The text of another program's CSV, split into cells: they may be quoted, and empty lines are passed over.

    The header is not checked (`CsvTable.check_header`).

    Raises
    ------
    InputError
        It is no CSV, its columns are not divided by commas, or a row is longer or shorter than the header.
    """
    lines, rows = [], []
    for line, cells in csv_rows(source, text):
        row = [cell.strip() for cell in cells]
        if any(row):
            lines.append(line)
            rows.append(row)
    if not rows:
        raise InputError(f"{source}, line 1: found nothing, expected a header and rows of numbers")
    header_line, header = lines.pop(0), rows.pop(0)
    _refuse_other_separators(source, header_line, header)
    table = CsvTable(source, header, rows, header_line=header_line, lines=lines)
    _check_lengths(table)
    return table


def _refuse_other_separators(source: Path, line: int, header: list[str]) -> None:
    """Refuse a header of one cell that holds several names, as spreadsheets of some countries write it."""
    for separator, name in ((";", "semicolons"), ("\t", "tabs")):
        if len(header) == 1 and separator in header[0]:
            raise InputError(
                f"{source}, line {line}: found {name} between the columns, expected commas between them, "
                "and points in the numbers"
            )


def _check_lengths(table: CsvTable) -> None:
    """Refuse a row that is longer or shorter than the header."""
    wanted = len(table.header)
    many = counted(wanted, "field")
    for row, cells in enumerate(table.rows):
        if len(cells) != wanted:
            found = counted(len(cells), "field") if any(cells) or len(cells) > 1 else "a blank line"
            where = f"{table.path}, line {table.line(row)}, column {min(len(cells), wanted)}"
            raise InputError(f"{where}: found {found}, expected {many} ({','.join(table.header)})")

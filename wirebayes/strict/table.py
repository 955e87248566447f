"""A CSV of plain numbers, split into cells: every complaint names the file, the line and the column."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from wirebayes.errors import InputError, shown
from wirebayes.sentences import counted
from wirebayes.strict.files import read_text
from wirebayes.strict.hint import hint

# No bench comes near these: beyond them numbers are typing mistakes, and soon their squares overflow.
LARGEST = {
    "displacement_mm": 1e8,  # 100 km
    "time_s": 1e10,  # three hundred years
    "tension_N": 1e9,  # 100,000 t, several times the largest bridge's main cable
    "temperature_C": 1e4,  # above the boiling point of every wire
}
_NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_WHOLE = re.compile(r"\d{1,9}", re.ASCII)
_NEWLINE = re.compile(r"\r\n|\n|\r")


@dataclass(frozen=True)
class Table:
    """A CSV split into fields; `complain` turns a row and a column into a place a person can find.

    Attributes
    ----------
    path : Path
    header : list of str
    rows : list of list of str
    """

    path: Path
    header: list[str]
    rows: list[list[str]]

    def place(self, row: int, column: str) -> str:
        """Where a cell stands; the header where there is no such column."""
        if column not in self.header:
            return "line 1, header"
        return f"line {row + 2}, column {self.header.index(column) + 1} ({column})"

    def complain(self, row: int, column: str, found: str, expected: str) -> InputError:
        """The error for one cell.

        Parameters
        ----------
        row : int
            Position among the rows of readings, from 0.
        column : str
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


def read_table(path: Path, required: Sequence[str], optional: Sequence[str]) -> Table:
    """Split a CSV into cells, each column once and every row as long as the header.

    Parameters
    ----------
    path : Path
    required, optional : sequence of str
        Names of the columns.

    Raises
    ------
    InputError
        With the file, line and column, what was found and what was expected.
    """
    known = (*required, *optional)
    expected = ",".join(required) + f" (and optionally {', '.join(optional)})"
    lines = _NEWLINE.split(read_text(path, f"a header of {expected} and a line for each reading"))
    while not lines[-1].strip():
        lines.pop()
    header = [field.strip() for field in lines[0].split(",")]
    for column, name in enumerate(header, start=1):
        if name not in known:
            meant = hint(name, known)
            raise InputError(
                f"{path}, line 1, column {column}: found {shown(name)}{meant}, expected a header of {expected}"
            )
        if name in header[: column - 1]:
            raise InputError(f"{path}, line 1, column {column}: found {name} a second time, expected it once")
    for name in required:
        if name not in header:
            raise InputError(f"{path}, line 1: found no column {name}, expected a header of {expected}")
    rows = []
    for number, line in enumerate(lines[1:], start=2):
        fields = [field.strip() for field in line.split(",")]
        if len(fields) != len(header):
            found = counted(len(fields), "field") if line.strip() else "a blank line"
            column = min(len(fields), len(header))
            expected = f"{len(header)} fields ({','.join(header)})"
            raise InputError(f"{path}, line {number}, column {column}: found {found}, expected {expected}")
        rows.append(fields)
    if not rows:
        raise InputError(f"{path}, line 2: found no readings, expected at least one")
    return Table(path, header, rows)

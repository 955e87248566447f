"""Numbers that stand for no reading: 9999 or -999.9, which loggers write where nothing was measured, and 9.9E37."""

import re
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from wirebayes.errors import shown
from wirebayes.io.bench.columns import Column
from wirebayes.io.bench.complete_rows import WHERE_MISSING
from wirebayes.io.bench.numerals import plain_number
from wirebayes.io.bench.quantities import Role
from wirebayes.io.bench.table import RawTable
from wirebayes.io.bench.undecided import Decimal
from wirebayes.numeric.typing import Bools
from wirebayes.sentences import counted

_NINES = re.compile(r"[+-]?9{3,}(\.[90]*|\.25)?")  # -999.25 in logs of wells
BEYOND = 2.0  # times the largest of the other numbers: a reading of nines alone so far off was not read
OVERLOAD = 9e36  # multimeters write 9.9E37 where they are at their limit, and 9.91E37 where they have no number


def without_marks(
    table: RawTable, columns: Mapping[Role, Column], decimal: Decimal, drop_breaks: bool
) -> tuple[RawTable, list[str]]:
    """The table without rows in which a number stands for no displacement or no tension.

    Parameters
    ----------
    table : RawTable
    columns : dict of Role to Column
        Those of which numbers are read.
    decimal : {"point", "comma"}
    drop_breaks : bool
        Whether such rows are to be left out.

    Returns
    -------
    RawTable, list of str
        And how many were left out, in a sentence.

    Raises
    ------
    InputError
        There is such a number, and it is not to be left out, or it stands for a temperature.
    """
    left_out = np.zeros(len(table.rows), dtype=bool)
    for role, column in columns.items():
        if role in ("hold", "time"):
            continue
        marked = _marked(table.column(column.index), decimal)
        may_be_empty = role != "temperature"
        if marked.any() and not (may_be_empty and drop_breaks):
            row = table.rows[int(marked.argmax())]
            cell = shown(row.cell(column.index))
            expected = "a number that was read"
            if may_be_empty:
                expected += WHERE_MISSING
            raise table.complain(row.line, column.index, f"{cell}, far beyond all other numbers", expected)
        left_out |= marked
    if not left_out.any():
        return table, []
    kept = []
    for row, gone in zip(table.rows, left_out, strict=True):
        if not gone:
            kept.append(row)
    first = table.rows[int(left_out.argmax())]
    line = table.line_text(first.line)
    rows = counted(int(left_out.sum()), "row")
    note = f"left out: {rows} in which a number such as 9999 stands for none, from line {line} on"
    return replace(table, rows=tuple(kept)), [note]


def _marked(cells: list[str], decimal: Decimal) -> Bools:
    """Which cells of a column hold a number that stands for none."""
    if not any("999" in cell or "e" in cell.lower() for cell in cells):
        return np.zeros(len(cells), dtype=bool)
    numbers = [plain_number(cell, decimal) for cell in cells]
    return stand_for_none(numbers)


def stand_for_none(numbers: list[str | None]) -> Bools:
    """Which numbers of a column stand for none: nines alone or an overload, far beyond all others; None: no number."""
    size = np.array([np.nan if number is None else abs(float(number)) for number in numbers])
    nines = np.array([number is not None and bool(_NINES.fullmatch(number)) for number in numbers], dtype=bool)
    candidates = nines | (size >= OVERLOAD)
    others = size[~candidates & np.isfinite(size)]
    if not candidates.any() or not len(others):
        return np.zeros(len(numbers), dtype=bool)
    return candidates & (size > BEYOND * others.max())

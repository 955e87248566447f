"""The rows of a table that are readings: gaps filled, repetitions left out."""

import re
from dataclasses import replace
from itertools import pairwise

from wirebayes.io.bench.columns import Columns
from wirebayes.io.bench.quantities import Role
from wirebayes.io.bench.sheet import SheetRow, is_value
from wirebayes.io.bench.stamps import is_coarse
from wirebayes.io.bench.table import RawTable
from wirebayes.io.bench.unread import speaks_of_specimens
from wirebayes.io.bench.words import are_a_statistic, speaks_of_a_quantity
from wirebayes.sentences import counted, listed

_SHOWN = 3  # lines that a note names
# from its first letter on, and none that stands for a missing number
_WORD = re.compile(r"(?<![^\W\d_])(?!nan|null|none)[^\W\d_]{3,}", re.IGNORECASE)
WHERE_MISSING = "; where a reading is missing, delete its row, or leave all such rows out by --drop-breaks"


def complete_rows(table: RawTable, columns: Columns, drop_breaks: bool) -> tuple[RawTable, list[str]]:
    """Without rows that hold nothing of what is read, exact repetitions, and empty cells of a hold's later rows.

    Parameters
    ----------
    table : RawTable
    columns : dict of Role to Column
        Those that are read.
    drop_breaks : bool
        Whether rows with a word such as ``NaN``, a dash or nothing in place of a time, a setting or a reading are left
        out, too.
    """
    indices = [column.index for column in columns.values()]
    rows, below = _without_what_is_below(table, indices)
    rows, words = _without_words(rows, columns)
    weights_once = _weights_are_written_once(rows, columns)
    what: Role = "tension" if weights_once else "displacement"
    written_once = [columns[role].index for role in ("hold", what) if role in columns]
    filled = _filled(rows, table, written_once)
    missing = {row.line for row in filled if drop_breaks and _is_missing(row, columns)}
    read = [row for row in filled if row.line not in missing]
    kept = _without_repetitions(read, table, columns["time"].index)
    gaps = _count_filled(filled, rows, indices)
    repeated = len(read) - len(kept)

    notes = []
    if below:
        notes.append(f"{counted(below, 'line')} under the readings left out")
    if words:
        notes.append(f"{_lines_of(words, table)} left out: words or statistics in place of readings")
    if missing:
        first = table.line_text(min(missing))
        notes.append(f"left out: {counted(len(missing), 'row')} without a reading, from line {first} on")
    if gaps:
        called = "weight" if weights_once else what
        notes.append(f"{gaps} empty cells of hold or {called} filled with the value above them")
    if repeated:
        notes.append(f"rows that repeat the row above left out: {repeated}")
    _check_no_cell_is_empty(kept, table, columns)
    return replace(table, rows=tuple(kept)), notes


def _count_filled(filled: list[SheetRow], rows: list[SheetRow], indices: list[int]) -> int:
    """How many cells were filled."""
    return sum(after.cells[i] != row.cell(i) for after, row in zip(filled, rows, strict=True) for i in indices)


def _without_what_is_below(table: RawTable, indices: list[int]) -> tuple[list[SheetRow], int]:
    """Rows in which something is read, and how many lines without numbers stand under them."""
    rows = list(table.rows)
    while rows and not any(is_value(rows[-1].cell(i)) for i in indices):
        rows.pop()
    below = len(table.rows) - len(rows)
    return [row for row in rows if any(row.cell(i) for i in indices)], below


def _without_words(rows: list[SheetRow], columns: Columns) -> tuple[list[SheetRow], list[SheetRow]]:
    """Rows without those that name a part of the test, such as ``Cycle 2``, or a statistic below; and these.

    Those are rows without a time, in which words stand where numbers are read: ``Points: | 9`` between blocks; or where
    the words there speak of a quantity or a specimen. A reading whose time is missing is none, whatever its hold is
    called.
    """
    end = len(rows)
    while end and are_a_statistic(rows[end - 1].filled):
        end -= 1
    words = [row for row in rows[:end] if _is_of_words(row, columns)]
    lines = {row.line for row in words}
    return [row for row in rows[:end] if row.line not in lines], [*words, *rows[end:]]


def _is_of_words(row: SheetRow, columns: Columns) -> bool:
    cells = [row.cell(column.index) for column in columns.values()]
    time, displacement, tension = (row.cell(columns[role].index) for role in ("time", "displacement", "tension"))
    if is_value(displacement) or is_value(tension):
        both = is_value(displacement) and is_value(tension)
        has_time = any(c.isdigit() for c in time)
        return not (both or has_time) and any(map(_WORD.search, cells))
    if any(map(_is_title, (time, displacement, tension))) or not any(map(is_value, cells)):
        return True
    return not any(c.isdigit() for c in time) and any(map(_WORD.search, cells))


def _is_title(cell: str) -> bool:
    """Whether a cell speaks of a quantity or a specimen, and is no number of one."""
    return bool(_WORD.search(cell)) and (speaks_of_a_quantity(cell) or speaks_of_specimens(cell))


def _is_missing(row: SheetRow, columns: Columns) -> bool:
    """Whether nothing, a word or a dash stands where a time, a setting or a reading belongs."""
    cells = [row.cell(columns[role].index) for role in ("time", "displacement", "tension")]
    return not all(any(c.isdigit() for c in cell) for cell in cells)


def _lines_of(rows: list[SheetRow], table: RawTable) -> str:
    """Lines as a sentence names them, with what begins each."""
    shown = [f"{table.line_text(row.line)} ({row.filled[0]})" for row in rows[:_SHOWN]]
    more = [] if len(rows) <= _SHOWN else [f"{len(rows) - _SHOWN} more"]
    return f"line{'s' * (len(rows) > 1)} {listed([*shown, *more])}"


def _weights_are_written_once(rows: list[SheetRow], columns: Columns) -> bool:
    """Whether a weight stands in the first row of its hold only, while the displacement is read in every row.

    Where most tensions are missing the displacement is what was read, if it changes where they are.
    """
    tension, displacement = columns["tension"].index, columns["displacement"].index
    bare = [i for i, row in enumerate(rows) if not row.cell(tension)]
    if not rows or 0 in bare or 2 * len(bare) <= len(rows) or not all(row.cell(displacement) for row in rows):
        return False
    changes = sum(rows[i].cell(displacement) != rows[i - 1].cell(displacement) for i in bare)
    return 2 * changes > len(bare)


def _filled(rows: list[SheetRow], table: RawTable, may_be_left_out: list[int]) -> list[SheetRow]:
    """Rows with the cells of the row above where they have none of what may be left out."""
    last = dict.fromkeys(may_be_left_out, "")
    filled = []
    for row in rows:
        cells = list(row.cells) + [""] * (len(table.header) - len(row.cells))
        for index in may_be_left_out:
            cells[index] = last[index] = cells[index] or last[index]
        filled.append(replace(row, cells=tuple(cells)))
    return filled


def _without_repetitions(rows: list[SheetRow], table: RawTable, time: int) -> list[SheetRow]:
    """Rows that do not repeat the one above; with coarse times those are readings that agree, not copies."""
    kept = [row for i, row in enumerate(rows) if not i or row.cells != rows[i - 1].cells]
    times = [row.cells[time] for row in kept]
    repeating = any(a == b for a, b in pairwise(times))
    return rows if repeating and is_coarse(replace(table, rows=tuple(rows)), time) else kept


def _check_no_cell_is_empty(rows: list[SheetRow], table: RawTable, columns: Columns) -> None:
    for row in rows:
        for role, column in columns.items():
            if not row.cells[column.index]:
                expected = f"a value here or in a line above{WHERE_MISSING}"
                if role in ("time", "tension"):
                    expected = f"a number{WHERE_MISSING}"
                elif role == "temperature":
                    expected = f'a number, or --map "{column.header}=ignore" to go without temperatures'
                raise table.complain(row.line, column.index, "an empty cell", expected)

"""The rows of a table that are readings: gaps filled, repetitions left out."""

from dataclasses import replace

from wirebayes.io.bench.columns import Column
from wirebayes.io.bench.quantities import Role
from wirebayes.io.bench.sheet import is_value
from wirebayes.io.bench.stamps import is_coarse
from wirebayes.io.bench.table import RawTable
from wirebayes.sentences import counted

WHERE_MISSING = "; where a reading is missing, delete its row"


def complete(table: RawTable, columns: dict[Role, Column]) -> tuple[RawTable, list[str]]:
    """Without rows that hold nothing of what is read, exact repetitions, and empty cells of a hold's later rows."""
    notes, rows = [], list(table.rows)
    indices = [column.index for column in columns.values()]
    measured = [columns[role].index for role in ("time", "tension")]
    while rows and not any(is_value(rows[-1].cell(i)) for i in indices):
        rows.pop()  # what stands under the readings
    below = len(table.rows) - len(rows)
    rows = [row for row in rows if any(row.cell(i) for i in indices)]
    if below:
        notes.append(f"{counted(below, 'line')} under the readings left out")
    filled = []
    last = dict.fromkeys(indices, "")
    for row in rows:
        cells = list(row.cells) + [""] * (len(table.header) - len(row.cells))
        for role in ("hold", "displacement"):
            if role in columns and not cells[columns[role].index]:
                cells[columns[role].index] = last[columns[role].index]
        last = {index: cells[index] for index in indices}
        filled.append(replace(row, cells=tuple(cells)))
    gaps = sum(a.cells[i] != b.cell(i) for a, b in zip(filled, rows, strict=True) for i in indices)
    if gaps:
        notes.append(f"{gaps} empty cells of hold or displacement filled with the value above them")
    kept = [row for i, row in enumerate(filled) if not i or row.cells != filled[i - 1].cells]
    times = [row.cells[columns["time"].index] for row in kept]
    repeating = any(a == b for a, b in zip(times, times[1:], strict=False))
    if repeating and is_coarse(replace(table, rows=tuple(filled)), columns["time"].index):
        kept = filled  # readings that agree, not copies
    if len(kept) < len(filled):
        notes.append(f"rows that repeat the row above left out: {len(filled) - len(kept)}")
    for row in kept:
        for index in indices:
            if not row.cells[index]:
                missing = f"a number{WHERE_MISSING}" if index in measured else "a value here or in a line above"
                raise table.complain(row.line, index, "an empty cell", missing)
    return replace(table, rows=tuple(kept)), notes

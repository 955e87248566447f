"""Specimens whose tests follow each other in one table: told apart by a column that names them."""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from wirebayes.errors import shown
from wirebayes.io.bench.columns import ignored
from wirebayes.io.bench.table import RawTable
from wirebayes.io.bench.table_numbers import Recorded
from wirebayes.io.bench.undecided import Specimens, Undecided
from wirebayes.io.bench.unread import speaks_of_specimens
from wirebayes.numeric.typing import Floats, Ints

WHOLE_TEST = 0.5  # of the displacement's range within each specimen: blocks and phases of one test have less
MOSTLY = 0.5  # of the rows: tensions that stay are weights
BACK = 0.25  # of that range from where the specimen before began: the next one begins near there


def tests_of_specimens(recorded: Recorded, mapping: Sequence[str], stated: Specimens | None) -> list[RawTable]:
    """The table of each specimen.

    A column tells them apart that changes where the displacement begins again, after a test of about the same range.
    Its header or its cells speak of specimens; where neither does, they must be words, and the time must begin again
    too: a number may be a cycle's. Then the user is asked.

    Parameters
    ----------
    recorded : Recorded
        What the table holds.
    mapping : sequence of str
        What the user says of columns; one that is ignored tells nothing apart.
    stated : {"several", "one"} or None
        Of which tests are, where the user says so.

    Returns
    -------
    list of RawTable
        The only one is the table itself.

    Raises
    ------
    Undecided
    """
    table = recorded.table
    said = ignored(table, mapping) | {column.index for column in recorded.columns.values()}
    left = [i for i, name in enumerate(table.header) if name and i not in said and any(table.column(i))]
    for index in left if stated != "one" else []:
        labels = _filled(table.column(index))
        changes = np.array([i for i in range(1, len(labels)) if labels[i] != labels[i - 1]], dtype=np.int64)
        names = [labels[i] for i in (0, *changes)]
        if not _begins_again(recorded, changes) or len(set(names)) < len(names):
            continue
        certain = stated == "several" or any(map(speaks_of_specimens, (table.header[index], *names)))
        if not certain and _may_be_specimens(names, recorded.values["time"], changes):
            raise _which(table, index, int(changes[0]), names)
        if certain:
            return _tables(table, index, changes, names)
    return [table]


def _tables(table: RawTable, index: int, changes: Ints, names: Sequence[str]) -> list[RawTable]:
    """The rows between changes of a column, each under the name of a specimen, without that column."""
    header = tuple("" if i == index else name for i, name in enumerate(table.header))
    rows = np.split(np.arange(len(table.rows)), changes)
    return [
        replace(table, header=header, rows=tuple(table.rows[i] for i in own), specimen=name)
        for own, name in zip(rows, names, strict=True)
    ]


def _filled(labels: Sequence[str]) -> list[str]:
    """Labels, each empty one as the one above: merged cells."""
    filled = [*labels]
    for i in range(1, len(filled)):
        filled[i] = filled[i] or filled[i - 1]
    return filled


def _begins_again(recorded: Recorded, changes: Ints) -> bool:
    """Whether what was set begins again at each of some rows; of one setting, whether times do."""
    if not len(changes):
        return False
    time, tension = recorded.values["time"], recorded.values["tension"]
    are_weights = np.mean(np.diff(tension) == 0.0) > MOSTLY
    setting = tension if are_weights else recorded.values["displacement"]
    if np.ptp(setting) == 0.0:
        return bool((time[changes] < time[changes - 1]).all())
    return _is_repeated(setting, changes)


def _is_repeated(values: Floats, changes: Ints) -> bool:
    begins = np.concatenate([[0], changes])
    whole = float(np.ptp(values))
    ranges = np.maximum.reduceat(values, begins) - np.minimum.reduceat(values, begins)
    return bool(ranges.min() >= WHOLE_TEST * whole and (np.abs(np.diff(values[begins])) <= BACK * whole).all())


def _may_be_specimens(names: Sequence[str], time: Floats, changes: Ints) -> bool:
    without_numbers = {re.sub(r"\d+", "", name) for name in names}
    return len(without_numbers) == len(names) and bool((time[changes] < time[changes - 1]).all())


def _which(table: RawTable, index: int, row: int, names: Sequence[str]) -> Undecided:
    place = table.place(table.rows[row].line, index)
    found = f"found {shown(names[1])} after {shown(names[0])} where the displacement begins again"
    answers = {"--specimens several": "specimens of their own", "--specimens one": "one specimen"}
    return Undecided(f"{table.sheet.path}, {place}: {found}", "what they are of", answers)

"""Specimens whose tests follow each other in one table: told apart by a column that names them, or numbers holds."""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from wirebayes.errors import shown
from wirebayes.io.bench.mapping import ignored
from wirebayes.io.bench.sheet import is_number
from wirebayes.io.bench.table import RawTable
from wirebayes.io.bench.table_numbers import Recorded
from wirebayes.io.bench.undecided import Specimens, Undecided
from wirebayes.io.bench.unread import speaks_of_specimens
from wirebayes.numeric.typing import Floats, Ints

WHOLE_TEST = 0.5  # of the displacement's range within each specimen: blocks and phases of one test have less
MOSTLY = 0.5  # of the rows: tensions that stay are weights
FEWEST = 3  # readings of a test
BACK = 0.25  # of that range from where the specimen before began: the next one begins near there


def tests_of_specimens(recorded: Recorded, mapping: Sequence[str], stated: Specimens | None) -> list[RawTable]:
    """The table of each specimen.

    A column tells them apart whose header or cells speak of specimens, and that changes where the displacement begins
    again, after a test of about the same range. Where it does not, but times begin again, the user is asked; and where
    the column speaks of no specimens, but holds words, and both begin again: a number may be a cycle's. So is the user
    where numbers of holds begin again together with the displacement and times.

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
    if stated == "one":
        return [table]
    said = ignored(table, mapping) | {column.index for column in recorded.columns.values()}
    for index, header in enumerate(table.header):
        if not header or index in said:
            continue
        labels = _filled(table.column(index))
        changes = _changes(labels)
        names = [labels[i] for i in (0, *changes)]
        if not len(changes) or len(set(names)) < len(names):
            continue
        are_named = any(map(speaks_of_specimens, (header, *names)))
        is_repeated = _begins_again(recorded, changes)
        times_restart = _restart(recorded.values["time"], changes)
        if are_named and is_repeated:
            return _tables(table, index, changes, names)
        may_be_names = are_named or (is_repeated and _are_words(names))
        if not times_restart or not may_be_names:
            continue
        if stated == "several":
            return _tables(table, index, changes, names)
        raise _which(table, index, int(changes[0]), names, is_repeated)
    return _by_hold_numbers(recorded, stated)


def _changes(labels: Sequence[str]) -> Ints:
    """The rows in which a label is another than in the row before."""
    rows = [i for i in range(1, len(labels)) if labels[i] != labels[i - 1]]
    return np.array(rows, dtype=np.int64)


def _by_hold_numbers(recorded: Recorded, stated: Specimens | None) -> list[RawTable]:
    """The table of each specimen, where the numbers of holds begin again with times and with what is set."""
    table = recorded.table
    if recorded.hold is None:
        return [table]
    index = recorded.columns["hold"].index
    labels = table.column(index)
    if not all(map(is_number, labels)):  # words name levels
        return [table]
    changes = np.flatnonzero(np.diff(recorded.hold) < 0) + 1
    if not len(changes):
        return [table]
    time = recorded.values["time"]
    times_fall = time[changes] < time[changes - 1]
    if not times_fall.all() or not _begins_again(recorded, changes):
        return [table]
    if stated == "several":
        names = [str(number) for number in range(1, len(changes) + 2)]
        return _split(table, changes, names)
    row = int(changes[0])
    raise _which(table, index, row, labels[row - 1 : row + 1], is_repeated=True)


def _tables(table: RawTable, index: int, changes: Ints, names: Sequence[str]) -> list[RawTable]:
    """The rows between changes of a column, each under the name of a specimen, without that column."""
    header = tuple("" if i == index else name for i, name in enumerate(table.header))
    return _split(replace(table, header=header), changes, names)


def _split(table: RawTable, changes: Ints, names: Sequence[str]) -> list[RawTable]:
    """The rows from each change to the next, each under the name of a specimen."""
    rows = np.split(np.arange(len(table.rows)), changes)
    return [
        replace(table, rows=tuple(table.rows[i] for i in own), specimen=name)
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
    time, tension = recorded.values["time"], recorded.values["tension"]
    are_weights = np.mean(np.diff(tension) == 0.0) > MOSTLY
    setting = tension if are_weights else recorded.values["displacement"]
    if np.ptp(setting) == 0.0:
        return _restart(time, changes)
    return _is_repeated(setting, changes)


def _restart(time: Floats, changes: Ints) -> bool:
    """Whether times begin again at each of some rows, with more than a reading or two between them."""
    sizes = np.diff([0, *changes, len(time)])
    return bool(sizes.min() >= FEWEST and (time[changes] < time[changes - 1]).all())


def _is_repeated(values: Floats, changes: Ints) -> bool:
    begins = np.concatenate([[0], changes])
    whole = float(np.ptp(values))
    ranges = np.maximum.reduceat(values, begins) - np.minimum.reduceat(values, begins)
    return bool(ranges.min() >= WHOLE_TEST * whole and (np.abs(np.diff(values[begins])) <= BACK * whole).all())


def _are_words(names: Sequence[str]) -> bool:
    return len({re.sub(r"\d+", "", name) for name in names}) == len(names)


def _which(table: RawTable, index: int, row: int, names: Sequence[str], is_repeated: bool) -> Undecided:
    where = table.where(table.rows[row].line, index)
    again = "what was set begins" if is_repeated else "times begin"
    found = f"found {shown(names[1])} after {shown(names[0])} where {again} again"
    answers = {"--specimens several": "specimens of their own", "--specimens one": "one specimen"}
    return Undecided(f"{where}: {found}", "what they are of", answers)

"""Columns that are not read: they are named, and one of them may say that the file holds several specimens."""

import re
from collections.abc import Mapping, Sequence

import numpy as np

from wirebayes.errors import shown
from wirebayes.io.bench.columns import Column, ignored
from wirebayes.io.bench.header import is_copy
from wirebayes.io.bench.quantities import Role
from wirebayes.io.bench.table import RawTable
from wirebayes.io.bench.words import plain_letters
from wirebayes.numeric.typing import Floats
from wirebayes.sentences import listed

# What a specimen is called, in the languages of the columns, without accents.
_SPECIMEN = (
    "specimen", "sample", "probe", "prufling", "muster", "eprouvette", "echantillon", "probeta", "muestra", "provino",
    "campione", "amostra", "provete", "proefstuk", "monster", "wire", "draht", "draad", "filo", "hilo",
    "試料", "試験片", "试样",
)  # fmt: skip
_PREFIX = 5  # letters of a word that may begin another one, as in Probennummer or SampleID
WHOLE_TEST = 0.5  # of the displacement's range within each specimen: blocks and phases of one test have less
BACK = 0.25  # of that range from where the specimen before began: the next one begins near there


def unread(
    table: RawTable, columns: Mapping[Role, Column], mapping: Sequence[str], displacement_mm: Floats, time_s: Floats
) -> list[str]:
    """Name the columns that are not read.

    Parameters
    ----------
    columns : dict of Role to Column
        Those that are read.
    mapping : sequence of str
        What the user says; a column that is said to be ignored is named, and asked no further.
    displacement_mm, time_s : (r,) array
        Of the table's rows.

    Returns
    -------
    list of str
        A sentence; none where everything is read.

    Raises
    ------
    InputError
        A column numbers or names specimens whose tests follow each other.
    """
    read = {column.index for column in columns.values()}
    left = [i for i, name in enumerate(table.header) if name and i not in read and any(table.column(i))]
    said = ignored(table, mapping)
    for index in left:
        if index not in said:
            _check_one_specimen(table, index, displacement_mm, time_s)
    names = [repr(table.header[i]) + _same_as(table, i, columns) for i in left]
    return [f"not read: {listed(names)}"] if left else []


def _same_as(table: RawTable, index: int, columns: Mapping[Role, Column]) -> str:
    """Which of the columns that are read a column repeats."""
    copied = next((c for c in columns.values() if is_copy(table, index, c.index)), None)
    return f" (the same numbers as {copied.header!r})" if copied else ""


def _check_one_specimen(table: RawTable, index: int, x: Floats, time: Floats) -> None:
    """Refuse a column that changes where the displacement begins again, after a test of about the same range.

    Where neither its header nor its cells speak of specimens, they must be words, and the time must begin again too: a
    number may be a cycle's.
    """
    labels = table.column(index)
    for i in range(1, len(labels)):
        labels[i] = labels[i] or labels[i - 1]  # merged cells
    changes = np.array([i for i in range(1, len(labels)) if labels[i] != labels[i - 1]], dtype=np.int64)
    begins = np.concatenate([[0], changes])
    whole = float(np.ptp(x))
    ranges = np.maximum.reduceat(x, begins) - np.minimum.reduceat(x, begins)
    back = np.abs(np.diff(x[begins])) <= BACK * whole
    if not len(changes) or whole == 0.0 or ranges.min() < WHOLE_TEST * whole or not back.all():
        return
    names = [labels[i] for i in begins]
    if len(set(names)) < len(names):
        return
    if not any(map(speaks_of_specimens, (table.header[index], *names))):
        without_numbers = {re.sub(r"\d+", "", name) for name in names}
        if len(without_numbers) < len(names) or not (time[changes] < time[changes - 1]).all():
            return
    row, name = int(changes[0]), table.header[index]
    found = f"{shown(names[1])} after {shown(names[0])} where the displacement begins again"
    expected = f'one specimen in a file; split the file, or --map "{name}=ignore" if it is one specimen'
    raise table.complain(table.rows[row].line, index, found, expected)


def speaks_of_specimens(text: str) -> bool:
    """Whether a text holds a word for a specimen."""
    words = re.findall(r"[^\W\d_]+", plain_letters(text))
    return any(w == known or (len(known) >= _PREFIX and w.startswith(known)) for w in words for known in _SPECIMEN)

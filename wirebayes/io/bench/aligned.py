"""Columns of fixed width: where a line has fewer numbers than others, its columns are told by where they stand."""

import re
from collections import Counter
from collections.abc import Sequence

import numpy as np

from wirebayes.io.bench.sheet import is_value
from wirebayes.numeric.typing import Ints

_FEWEST = 3  # full lines that show where columns stand


def with_gaps(lines: Sequence[str], split: Sequence[list[str]]) -> list[list[str]] | None:
    """Cells of lines between spaces, with empty ones where lines that stand in columns leave one blank.

    Parameters
    ----------
    lines : sequence of str
    split : sequence of list of str
        Their cells.

    Returns
    -------
    list of list of str or None
        None where no line has fewer numbers than others, or where numbers do not stand in columns.
    """
    if not _differ_in_count(split):
        return None  # most files: nothing to look at line by line
    places: dict[int, list[tuple[int, int]]] = {}
    for i, cells in enumerate(split):
        found = _places(lines[i])
        if len(found) == len(cells) > 0:
            places[i] = found
    numbers = [i for i in places if all(map(is_value, split[i]))]
    most = max((len(split[i]) for i in numbers), default=0)
    full = [i for i in numbers if len(split[i]) == most]
    if len(full) < _FEWEST:
        return None
    begin_at = full[0] - _rows_before(numbers, full[0])
    short = [i for i in numbers if len(split[i]) < most and i > begin_at]
    if not short:
        return None
    stands = np.array([places[i] for i in full])
    begin = stands[..., 0].min(axis=0)
    end = stands[..., 1].max(axis=0)
    overlap = end[:-1] > begin[1:]
    if overlap.any():
        return None
    out = list(split)
    for i in short:
        in_columns = _in_columns(split[i], places[i], begin, end)
        if in_columns is None:
            return None
        out[i] = in_columns
    return out


def _differ_in_count(split: Sequence[list[str]]) -> bool:
    """Whether lines have different numbers of cells, from the first on that has as many as most."""
    counts = [len(cells) for cells in split]
    usual = Counter(filter(None, counts)).most_common(1)
    if not usual:
        return False
    first = counts.index(usual[0][0])
    return len(set(counts[first:]) - {0}) > 1


def _in_columns(cells: list[str], places: list[tuple[int, int]], begin: Ints, end: Ints) -> list[str] | None:
    """Cells by the columns in which they stand, with empty ones between; None where one stands in none or several."""
    out = [""] * len(begin)
    filled = set()
    for cell, (first, last) in zip(cells, places, strict=True):
        columns = np.flatnonzero((begin < last) & (first < end))
        if len(columns) != 1:
            return None
        column = int(columns[0])
        out[column] = cell
        filled.add(column)
    return out if len(filled) == len(cells) else None


def _places(line: str) -> list[tuple[int, int]]:
    """Where each word of a line begins and ends."""
    return [found.span() for found in re.finditer(r"\S+", line.expandtabs())]


def _rows_before(numbers: Sequence[int], row: int) -> int:
    """How many lines of numbers stand right above one, plus one."""
    known, above = set(numbers), 1
    while row - above in known:
        above += 1
    return above

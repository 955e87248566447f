"""Columns of fixed width: where a line has fewer numbers than others, its columns are told by where they stand."""

import re
from collections import Counter
from collections.abc import Sequence

import numpy as np

from wirebayes.io.bench.sheet import is_value

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
    counts = [len(cells) for cells in split]
    usual = Counter(filter(None, counts)).most_common(1)
    if not usual or len(set(filter(None, counts[counts.index(usual[0][0]) :]))) == 1:
        return None  # most files: nothing to look at line by line
    places = {i: found for i, cells in enumerate(split) if len(found := _places(lines[i])) == len(cells) > 0}
    numbers = [i for i in places if all(map(is_value, split[i]))]
    most = max((len(split[i]) for i in numbers), default=0)
    full = [i for i in numbers if len(split[i]) == most]
    short = [i for i in numbers if len(split[i]) < most and i > full[0] - _rows_before(numbers, full[0])]
    if not short or len(full) < _FEWEST:
        return None
    stands = np.array([places[i] for i in full])
    begin, end = stands[..., 0].min(axis=0), stands[..., 1].max(axis=0)
    if (end[:-1] > begin[1:]).any():
        return None
    out = list(split)
    for i in short:
        columns = [np.flatnonzero((begin < b) & (a < end)) for a, b in places[i]]
        of_column = {int(found[0]): cell for found, cell in zip(columns, split[i], strict=True) if len(found) == 1}
        if len(of_column) < len(split[i]):
            return None
        out[i] = [of_column.get(column, "") for column in range(most)]
    return out


def _places(line: str) -> list[tuple[int, int]]:
    """Where each word of a line begins and ends."""
    return [found.span() for found in re.finditer(r"\S+", line.expandtabs())]


def _rows_before(numbers: Sequence[int], row: int) -> int:
    """How many lines of numbers stand right above one, plus one."""
    known, above = set(numbers), 1
    while row - above in known:
        above += 1
    return above

"""A last line that a logger did not finish: it has no end, and fewer cells or digits than every line above it."""

import re
from collections.abc import Sequence

from wirebayes.io.bench.sheet import SheetRow, is_value

_SHOWN = 50  # lines above that show the habit
_FEWEST = 10  # of them
_DECIMALS = re.compile(r"[-+−]?\d+[.,](\d+)")


def without_cut_line(rows: Sequence[SheetRow]) -> tuple[tuple[SheetRow, ...], bool]:
    """The rows without a last one that was cut off, and whether there was one.

    Parameters
    ----------
    rows : sequence of SheetRow
        Of a file whose last line has no end.
    """
    rows = tuple(rows)
    above = [row.cells for row in rows[-1 - _SHOWN : -1] if not row.comment and row.may_be_a_reading]
    if len(above) < _FEWEST or not is_value(rows[-1].cells[0]):
        return rows, False
    if _is_cut(rows[-1].cells, above):
        return rows[:-1], True
    return rows, False


def _is_cut(last: Sequence[str], above: Sequence[Sequence[str]]) -> bool:
    """Whether a line has fewer cells than all above it, or fewer digits in its last cell."""
    widths = {len(cells) for cells in above}
    if len(widths) > 1:
        return False
    (width,) = widths
    if len(last) != width:
        return len(last) < width
    digits = {_decimals(cells[-1]) for cells in above}
    if len(digits) > 1:
        return False
    (usual,) = digits
    cell = last[-1]
    if "e" in cell.lower():
        return False
    return _decimals(cell) < usual


def _decimals(cell: str) -> int:
    """Digits behind a number's decimal sign."""
    found = _DECIMALS.fullmatch(cell)
    return len(found[1]) if found else 0

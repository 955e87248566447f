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
    above = [row.cells for row in rows[-1 - _SHOWN : -1] if not row.comment and row.may_be_a_reading]
    widths = {len(cells) for cells in above}
    if len(above) < _FEWEST or len(widths) > 1 or not is_value(rows[-1].cells[0]):
        return tuple(rows), False
    (width,) = widths
    last = rows[-1].cells
    digits = {_decimals(cells[-1]) for cells in above}
    is_short = len(last) < width
    if len(last) == width and len(digits) == 1:
        usual, own = digits.pop(), _decimals(last[-1])
        is_short = usual > 0 and own < usual and "e" not in last[-1].lower()
    return (tuple(rows[:-1]), True) if is_short else (tuple(rows), False)


def _decimals(cell: str) -> int:
    """Digits behind a number's decimal sign."""
    found = _DECIMALS.fullmatch(cell)
    return len(found[1]) if found else 0

"""Which sign is the decimal one, inferred from all numbers that are read of a file.

A comma followed by three digits may be either; so may a point where semicolons separate. Any other number that can be
read in only one way decides for all of them. Clocks and columns that are not read decide nothing: ``1,30`` may be an
hour and a half, and ``14.06`` a day.
"""

import re
from collections.abc import Sequence

from wirebayes.io.bench.sheet import is_number
from wirebayes.io.bench.table import RawTable
from wirebayes.io.bench.undecided import Decimal, Undecided

_GROUPED = r"[+\-\u2212]?[1-9]\d{{0,2}}({sign}\d{{3}})+"
_EITHER = r"[+\-\u2212]?[1-9]\d{{0,2}}{sign}\d{{3}}"
_OTHER_GROUPS = re.compile(r"(?<=\d)['\u2019 \u00a0\u2009\u202f](?=\d{3})")
_COUNT = re.compile(
    r"[+\-\u2212]?(\d+|[1-9]\d{0,2}(['\u2019 \u00a0\u2009\u202f]\d{3})+"
    r"|[1-9]\d{0,2}(?P<sign>[.,])\d{3}((?P=sign)\d{3})+)"
)
_SELDOM = 0.1  # of the cells of a column: a misprint is no habit
_BEYOND = 10.0  # times the largest of the other numbers, which readings do not grow by from one to the next
_SIGNS: dict[Decimal, str] = {"comma": ",", "point": "."}
_OTHER: dict[Decimal, Decimal] = {"comma": "point", "point": "comma"}


def decimal_sign(table: RawTable, columns: Sequence[int], stated: Decimal | None) -> Decimal:
    """The decimal sign of a table.

    Parameters
    ----------
    columns : sequence of int
        Those of which numbers are read.
    stated : {"point", "comma"} or None
        What the user says.

    Raises
    ------
    Undecided
        Every number with a comma could be thousands or a fraction.
    """
    if stated is not None:
        return "point" if table.sheet.lettered else stated  # cells of text in a workbook were read with it
    signed = []
    for row in table.rows:
        for column in columns:
            cell = row.cell(column)
            if ("," in cell or "." in cell) and is_number(cell):
                signed.append((row.line, column, cell))
    if table.sheet.lettered:  # numbers of a workbook have a point whatever was typed as text
        signed = [found for found in signed if "," in found[2]]
    for sign in _SIGNS:
        if any(proves(cell, sign) for _, _, cell in signed):
            return sign
    # what is left could be grouped thousands: trusted only for a point that no habit of commas makes doubtful
    semicolons = "semicolon" in table.sheet.described
    doubtful = next((found for found in signed if "," in found[2] or semicolons), None)
    if doubtful is None:
        return "point"
    line, column, cell = doubtful
    sign = "comma" if "," in cell else "point"
    other = _OTHER[sign]
    whole, fraction = plain_number(cell, other), plain_number(cell, sign)
    raise Undecided(
        f"{table.where(line, column)}: found {cell!r}, which is {fraction} or {whole}",
        "which",
        {f"--decimal {sign}": f"{cell} is {fraction}", f"--decimal {other}": f"{cell} is {whole}"},
    )


def check_signs(table: RawTable, columns: Sequence[int], decimal: Decimal) -> None:
    """Refuse a number with the other sign whose thousands are far beyond all other numbers: its fraction is not.

    Parameters
    ----------
    table : RawTable
    columns : sequence of int
        Those of which numbers are read.
    decimal : {"point", "comma"}
        The decimal sign of the table.

    Raises
    ------
    InputError
    """
    other = _SIGNS[_OTHER[decimal]]
    for column in columns:
        cells = table.column(column)
        if not any(other in cell for cell in cells):
            continue  # as in most long files
        row = _far_beyond(cells, decimal)
        if row is not None:
            expected = f"the decimal {decimal}, as elsewhere in the file"
            raise table.complain(table.rows[row].line, column, repr(cells[row]), expected)


def _far_beyond(cells: Sequence[str], decimal: Decimal) -> int | None:
    """The first of some seldom numbers with the other sign that is too large as thousands, and not as a fraction."""
    other = _OTHER[decimal]
    either = re.compile(_EITHER.format(sign=re.escape(_SIGNS[other])))
    grouped, others = [], []
    for i, cell in enumerate(cells):
        if either.fullmatch(cell):
            grouped.append(i)
        else:
            others.append(cell)
    if not 0 < len(grouped) < _SELDOM * len(cells):
        return None
    with_fraction = sum(_SIGNS[decimal] in cell for cell in others)
    if 2 * with_fraction < len(others):
        return None
    largest = max((_size(cell, decimal) for cell in others), default=0.0)
    limit = _BEYOND * largest
    for i in grouped:
        whole = _size(cells[i], decimal)
        fraction = _size(cells[i], other)
        if whole > limit >= _BEYOND * fraction:
            return i
    return None


def _size(cell: str, decimal: Decimal) -> float:
    """How large the number in a cell is; zero where there is none."""
    number = plain_number(cell, decimal)
    return 0.0 if number is None else abs(float(number))


def is_count(cell: str) -> bool:
    """Whether a cell is a whole number in any country's writing, its thousands grouped by what is no decimal sign."""
    return bool(_COUNT.fullmatch(cell))


def proves(cell: str, decimal: Decimal) -> bool:
    """Whether a number can be read with this decimal sign only.

    Parameters
    ----------
    cell : str
        A number in any country's writing.
    decimal : {"point", "comma"}
        The decimal sign.
    """
    sign, other = _SIGNS[decimal], _SIGNS[_OTHER[decimal]]
    if sign in cell and other in cell:
        return cell.rindex(sign) > cell.rindex(other)
    if cell.count(other) > 1:  # 1.234.567
        return True
    return cell.count(sign) == 1 and not re.fullmatch(_EITHER.format(sign=re.escape(sign)), cell)


def plain_number(cell: str, decimal: Decimal) -> str | None:
    """A number as Python spells it, or None where a cell is none with this decimal sign."""
    if not is_number(cell):
        return None
    text = _OTHER_GROUPS.sub("", cell.replace("\u2212", "-"))
    sign, other = _SIGNS[decimal], _SIGNS[_OTHER[decimal]]
    if other in text:
        whole, _, fraction = text.partition(sign)
        grouped = _GROUPED.format(sign=re.escape(other))
        if other in fraction or not re.fullmatch(grouped, whole):
            return None
        text = whole.replace(other, "")
        if fraction:
            text += sign + fraction
    if text.count(sign) > 1:
        return None
    return text.replace(sign, ".")

"""Workbooks (xlsx) as cells: numbers as Excel shows them to fifteen digits, times and dates as text."""

import io
import warnings
from collections.abc import Collection, Mapping
from datetime import date, datetime, time, timedelta
from pathlib import Path
from typing import Any

from wirebayes.errors import InputError
from wirebayes.io.bench.cell_units import bare
from wirebayes.io.bench.numerals import plain_number, proves
from wirebayes.io.bench.sheet import Sheet, SheetRow, is_number, is_value
from wirebayes.io.bench.undecided import Decimal, Undecided
from wirebayes.strict.hint import hint

_FIRST_DAY = datetime(1899, 12, 31)  # number 0 of a spreadsheet that shows times alone
_FIRST_MONTH = datetime(1900, 2, 1)  # no test is as old
SIGNATURE = b"PK\x03\x04"
OLD_EXCEL = b"\xd0\xcf\x11\xe0"


def sheet_of_workbook(path: Path, raw: bytes, chosen: str | None, decimal: Decimal | None) -> Sheet:
    """The cells of the sheet that holds readings, or of the one named.

    Raises
    ------
    InputError
        It is no workbook, there is no such sheet, or no readings; `Undecided` where several sheets hold some.

    Parameters
    ----------
    path : Path
        Named in messages.
    raw : bytes
        Content of the file.
    chosen : str or None
        Name of a sheet; left out, the only one with readings is taken.
    decimal : {"point", "comma"} or None
        The decimal sign of numbers that stand in cells of text, if the user says it.
    """
    rows = _rows_of_sheets(path, raw, decimal)
    if chosen is not None:
        if chosen not in rows:
            names = list(rows)
            found = f"no sheet {chosen!r}{hint(chosen, names)}"
            raise InputError(f"{path}: found {found}, expected one of {', '.join(names)}")
        return Sheet(path, rows[chosen], lettered=True, described=f"sheet {chosen}")
    full = []
    for name, found_rows in rows.items():
        measured = sum(map(_measured, found_rows))
        if measured > 1:
            full.append(name)
    if not full:
        raise InputError(f"{path}: found no sheet with columns of numbers, expected a header and readings")
    if len(full) > 1:
        answers = {f"--sheet {name}": f"the readings of sheet {name}" for name in full}
        raise Undecided(f"{path}: found readings in {len(full)} sheets", "which one to read", answers)
    (only,) = full
    return Sheet(path, rows[only], lettered=True, described=f"sheet {only}")


def _rows_of_sheets(path: Path, raw: bytes, decimal: Decimal | None) -> dict[str, tuple[SheetRow, ...]]:
    """The rows of each sheet of a workbook."""
    import openpyxl

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of styles and extensions that do not concern cells
            book = openpyxl.load_workbook(io.BytesIO(raw), read_only=True, data_only=True)
            return {sheet.title: _rows(sheet, decimal) for sheet in book.worksheets}
    except Exception as error:  # whatever a damaged archive raises
        found = f"no workbook that can be opened ({type(error).__name__})"
        raise InputError(f"{path}: found {found}, expected xlsx or text; save it as CSV") from error


def _measured(row: SheetRow) -> bool:
    return sum(is_value(bare(cell)) for cell in row.filled) >= 2


def _rows(sheet: Any, decimal: Decimal | None) -> tuple[SheetRow, ...]:
    """The rows of a sheet that hold something.

    Numbers that were typed as text become numbers like those beside them, which have no sign of their own.
    """
    cells = [[*row] for row in sheet.iter_rows()]
    typed = {cell.value.strip() for row in cells for cell in row if isinstance(cell.value, str)}
    with_comma = _numbers_with_comma(typed, decimal)
    out = []
    for line, of_line in enumerate(cells, start=1):
        texts = [_text(cell, with_comma) for cell in of_line]
        while texts and not texts[-1]:
            texts.pop()
        if not texts:
            continue
        comment = texts[0].startswith("#") and not texts[0].startswith("#N")  # "#N/A" is Excel's, not a person's
        if comment:
            texts[0] = texts[0].lstrip("# ")
        out.append(SheetRow(line, tuple(texts), comment))
    return tuple(out)


def _numbers_with_comma(typed: Collection[str], decimal: Decimal | None) -> dict[str, str]:
    """Numbers among cells of text whose decimal sign is a comma, with a point in its place.

    One that may have thousands in place of a fraction is among them if others show a comma, and none a point.
    """
    if decimal == "point":
        return {}
    numbers = [text for text in typed if is_number(text)]
    show = [text for text in numbers if proves(text, "comma")]
    all_of_them = decimal == "comma" or (show and not any(proves(text, "point") for text in numbers))
    read = {text: plain_number(text, "comma") for text in (numbers if all_of_them else show)}
    return {text: number for text, number in read.items() if number is not None}


def _text(cell: Any, with_comma: Mapping[str, str]) -> str:
    value = cell.value
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value)
    if isinstance(value, int | float):
        return f"{value:.15g}"  # what Excel keeps; more are the binary's
    if isinstance(value, time) and "s" not in str(cell.number_format):
        return f"{value.hour}:{value.minute:02d}"  # typed without seconds: hours and minutes, or what?
    if isinstance(value, timedelta):
        hours, rest = divmod(round(value.total_seconds(), 6), 3600.0)
        minutes, seconds = divmod(rest, 60.0)
        return f"{hours:.0f}:{minutes:02.0f}:{seconds:09.6f}"
    if isinstance(value, datetime) and value < _FIRST_MONTH:  # a time that went on beyond 24 hours
        hours = 24 * (value - _FIRST_DAY).days + value.hour
        return f"{hours}:{value.minute:02d}:{value.second:02d}.{value.microsecond:06d}"
    if isinstance(value, datetime):
        return value.isoformat(sep=" ")
    if isinstance(value, date | time):
        return value.isoformat()
    text = " ".join(str(value).split())  # headers are broken into lines now and then
    return with_comma.get(text, text)

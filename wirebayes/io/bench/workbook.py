"""Workbooks (xlsx) as cells: numbers as Excel shows them to fifteen digits, times and dates as text."""

import io
import warnings
from datetime import date, datetime, time, timedelta
from pathlib import Path
from typing import Any

from wirebayes.errors import InputError
from wirebayes.io.bench.cell_units import bare
from wirebayes.io.bench.sheet import Sheet, SheetRow, is_value
from wirebayes.io.bench.undecided import Undecided
from wirebayes.strict.hint import hint

SIGNATURE = b"PK\x03\x04"
OLD_EXCEL = b"\xd0\xcf\x11\xe0"


def sheet_of_workbook(path: Path, raw: bytes, chosen: str | None) -> Sheet:
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
    """
    rows = _rows_of_sheets(path, raw)
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


def _rows_of_sheets(path: Path, raw: bytes) -> dict[str, tuple[SheetRow, ...]]:
    """The rows of each sheet of a workbook."""
    import openpyxl

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of styles and extensions that do not concern cells
            book = openpyxl.load_workbook(io.BytesIO(raw), read_only=True, data_only=True)
            return {sheet.title: _rows(sheet) for sheet in book.worksheets}
    except Exception as error:  # whatever a damaged archive raises
        found = f"no workbook that can be opened ({type(error).__name__})"
        raise InputError(f"{path}: found {found}, expected xlsx or text; save it as CSV") from error


def _measured(row: SheetRow) -> bool:
    return sum(is_value(bare(cell)) for cell in row.filled) >= 2


def _rows(sheet: Any) -> tuple[SheetRow, ...]:
    out = []
    for line, cells in enumerate(sheet.iter_rows(), start=1):
        texts = [_text(cell) for cell in cells]
        while texts and not texts[-1]:
            texts.pop()
        if not texts:
            continue
        comment = texts[0].startswith("#") and not texts[0].startswith("#N")  # "#N/A" is Excel's, not a person's
        if comment:
            texts[0] = texts[0].lstrip("# ")
        out.append(SheetRow(line, tuple(texts), comment))
    return tuple(out)


def _text(cell: Any) -> str:
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
    if isinstance(value, datetime):
        return value.isoformat(sep=" ")
    if isinstance(value, date | time):
        return value.isoformat()
    return " ".join(str(value).split())  # headers are broken into lines now and then

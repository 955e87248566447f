"""Columns in memory as the table that the readers of files check: a DataFrame, or a mapping of name to values."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wirebayes.errors import InputError
from wirebayes.strict.table import CsvTable


def is_table(value: Any) -> bool:
    """Whether something is a mapping of columns or a DataFrame."""
    return isinstance(value, Mapping) or hasattr(value, "columns")


def names_of(columns: Any) -> list[Any]:
    """Names of the columns of a DataFrame or mapping."""
    return list(columns.columns) if hasattr(columns, "columns") else list(columns)


def columns_table(columns: Any, source: Path, may_be_empty: Callable[[str], bool]) -> CsvTable:
    """Columns as a table whose header is not checked yet.

    Parameters
    ----------
    columns : DataFrame, or mapping of name to (r,) array
    source : Path
        What errors call it.
    may_be_empty : callable
        Of a column's name to whether NaN or None means there that there is nothing.

    Raises
    ------
    InputError
        It is no table, or a column is not one value a row.
    """
    if not is_table(columns):
        raise InputError(f"{source}: found {type(columns).__name__}, expected a file, a DataFrame or columns by name")
    keys = names_of(columns)
    header = [str(key) for key in keys]
    texts: list[list[str]] = []
    for name, key in zip(header, keys, strict=True):
        where = f"{source}, column {name}"
        values = _objects(columns[key])
        count = len(texts[0]) if texts else None
        expected = "one value for each row" if count is None else f"{count} as in {header[0]}"
        if values.ndim != 1:
            raise InputError(f"{where}: found an array of shape {values.shape}, expected {expected}")
        if count not in (None, len(values)):
            raise InputError(f"{where}: found {len(values)} values, expected {expected}")
        empty = may_be_empty(name)
        texts.append([_text(value, empty=empty) for value in values])
    rows = [list(row) for row in zip(*texts, strict=True)]
    return _Columns(source, header, rows)


@dataclass(frozen=True)
class _Columns(CsvTable):
    """A table without lines: its rows are counted from 0, as indices are."""

    def place(self, row: int, column: str) -> str:
        return f"row {row} (from 0), column {column}" if column in self.header else f"column {column}"

    def header_place(self, column: int | None = None) -> str:
        return "columns"


def _objects(values: Any) -> NDArray[np.object_]:
    """Values of a column, those that a mask hides as NaN."""
    if np.ma.isMaskedArray(values):
        values = np.ma.filled(values.astype(object), np.nan)
    if isinstance(values, Iterator):
        values = list(values)
    return np.asarray(values, dtype=object)


def _text(value: Any, *, empty: bool) -> str:
    """A value as a file would spell it; a whole number without a point, because columns with gaps are floats."""
    value = value.item() if isinstance(value, np.generic) else value
    if value is None or str(value) in ("nan", "<NA>", "NaT"):
        return "" if empty else "nan"
    if isinstance(value, float) and value.is_integer() and abs(value) < 1e15:
        return str(int(value))
    return value.strip() if isinstance(value, str) else repr(value)

"""A robot's tables that are given in memory, as the text of the file that would hold them: one reader checks both."""

import csv
import io
from collections.abc import Callable, Mapping
from typing import Any

from wirebayes.errors import InputError
from wirebayes.json_files.plain import plain


def names_of(source: str, columns: Any) -> list[str]:
    """Names of the columns of a DataFrame or mapping; errors call it `source`."""
    if not is_table(columns):
        raise InputError(f"{source}: found {type(columns).__name__}, expected a file, a DataFrame or columns by name")
    return [str(name) for name in (columns.columns if hasattr(columns, "columns") else columns)]


def as_csv(source: str, columns: Any, order: Callable[[list[str]], list[str]] = lambda names: names) -> str:
    """Columns as CSV, in an order made of their names.

    Raises
    ------
    InputError
        They are no table, or of different lengths.

    Parameters
    ----------
    source : str
        What errors call the table.
    columns : mapping of name to values, or DataFrame
    order : callable
        Of the list of names to the list in the order that the file has.

    Returns
    -------
    str
    """
    names = order(names_of(source, columns))
    values = [plain(list(columns[name])) for name in names]
    rows = sorted({len(column) for column in values})
    if len(rows) > 1:
        raise InputError(f"{source}: found columns of {rows} rows, expected as many in each")
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(names)
    writer.writerows(["" if value is None else value for value in row] for row in zip(*values, strict=True))
    return text.getvalue()


def row_place(line: int) -> str:
    """Where a line of `as_csv` stands in the columns."""
    return "columns" if line == 1 else f"row {line - 2} (from 0)"


def is_table(value: Any) -> bool:
    """Whether something is a mapping of columns or a DataFrame."""
    return isinstance(value, Mapping) or hasattr(value, "columns")

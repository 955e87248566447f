"""Records in JSON, as web loggers and scripts write them: one object a line, or a list of objects, or lists by name."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from wirebayes.io.bench.sheet import Sheet, SheetRow

_BETWEEN = " \t\r\n,[]"  # objects of a list, or lines


def are_records(text: str) -> bool:
    """Whether a text holds JSON objects and nothing else."""
    if text.strip(" \t\r\n[")[:1] != "{":
        return False
    try:
        return sum(1 for _ in _objects(text)) > 0
    except ValueError:
        return False


def sheet_of_records(path: Path, text: str, encoding: str) -> Sheet:
    """Names of all objects as a header, and a row for each of them, with the line that it begins on.

    Parameters
    ----------
    path : Path
        Named in messages.
    text : str
    encoding : str
        In which it was written.
    """
    found = [(line, _flat(record)) for line, record in _objects(text)]
    if len(found) == 1:
        line, record = found[0]
        if all(isinstance(value, list) for value in record.values()):
            found = [(line, row) for row in _rows_of(record)]
    every_name = [name for _, record in found for name in record]
    names = tuple(dict.fromkeys(every_name))
    rows = [SheetRow(1, names)]
    for line, record in found:
        cells = tuple(_text(record.get(name)) for name in names)
        rows.append(SheetRow(line, cells))
    return Sheet(path, tuple(rows), described="records in JSON", encoding=encoding)


def _rows_of(lists: dict[str, list[Any]]) -> list[dict[str, Any]]:
    """The rows of a table that is written as a list a column; a list that ends early has no cells in the last rows."""
    longest = max(map(len, lists.values()), default=0)
    rows = []
    for i in range(longest):
        rows.append({name: values[i] for name, values in lists.items() if i < len(values)})
    return rows


def _objects(text: str) -> Iterator[tuple[int, dict[str, Any]]]:
    """Each object, and the line that it begins on."""
    decoder = json.JSONDecoder()
    at = 0
    line = 1
    while at < len(text):
        if text[at] in _BETWEEN:
            line += text[at] == "\n"
            at += 1
            continue
        record, end = decoder.raw_decode(text, at)
        if not isinstance(record, dict):
            raise ValueError("no object")
        yield line, record
        line += text.count("\n", at, end)
        at = end


def _flat(record: dict[str, Any]) -> dict[str, Any]:
    """An object without objects in it: ``{"load": {"N": 5}}`` has the name load N."""
    flat: dict[str, Any] = {}
    for name, value in record.items():
        if isinstance(value, dict):
            flat |= {f"{name} {inner}": each for inner, each in _flat(value).items()}
        else:
            flat[name] = value
    return flat


def _text(value: Any) -> str:
    return "" if value is None else str(value).strip()

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
    if len(found) == 1 and all(isinstance(value, list) for value in found[0][1].values()):
        line, lists = found[0]
        longest = max((len(values) for values in lists.values()), default=0)
        found = [(line, {k: v[i] for k, v in lists.items() if i < len(v)}) for i in range(longest)]
    names = tuple(dict.fromkeys(name for _, record in found for name in record))
    rows = [SheetRow(line, tuple(_text(record.get(name)) for name in names)) for line, record in found]
    return Sheet(path, (SheetRow(1, names), *rows), described="records in JSON", encoding=encoding)


def _objects(text: str) -> Iterator[tuple[int, dict[str, Any]]]:
    """Each object, and the line that it begins on."""
    decoder, at, line = json.JSONDecoder(), 0, 1
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

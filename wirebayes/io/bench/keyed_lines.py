"""Lines that name each value, as a microcontroller prints them: ``t=1.2 F=3.4`` or ``Time: 1.2 s, Force: 3.4 N``."""

import re
from collections.abc import Sequence
from pathlib import Path

from wirebayes.errors import InputError
from wirebayes.io.bench.quantities import ROLES, quantity_unit
from wirebayes.io.bench.sheet import Sheet, SheetRow

FEWEST = 3  # such lines; a preamble of two keys in a line is rarer
SHARE = 0.5  # of the lines that hold something
_PAIR = re.compile(
    r"[\s,;|]*(?P<key>[^\W\d](?:[\w. /-]*[\w)])?)\s*[=:]\s*(?P<value>\d{1,2}:\d\d:\d\d(?:[.,]\d+)?"
    r"|[+\-\u2212]?\d(?:[\d.,]*\d)?(?:[eE][+-]?\d+)?)(?:\s*(?P<unit>[^\s\d,;|=:]+)(?!\s*[=:]))?(?=[\s,;|]|$)"
)


# What loggers put before a line: when it was written, and how grave it is.
_STAMP = re.compile(
    r"\s*(?P<open>\[)?(?P<stamp>(?:\d{4}-\d\d-\d\d[T ])?\d{1,2}:\d\d:\d\d(?:[.,]\d+)?(?:Z|[+-]\d\d:?\d\d)?"
    r"|(?(open)\s*\d+[.,]\d+|(?!)))(?(open)\])(?![\w.:])[\s,;|:-]*(?:\[?(?:DEBUG|INFO|WARN|WARNING|ERROR)\]?[\s,;|:-]+)?"
)
_STAMPED = "timestamp"
_AROUND = re.compile(r"^\s*-\s+(?=[{\"'\w])|[{}'\"]")  # of a list in YAML, of a dict in Python


def _pairs(line: str) -> list[tuple[str, str, str]]:
    """Key, value and unit of each pair of a line; none where the line is anything else."""
    found = []
    at = 0
    stamp = _STAMP.match(line)
    if stamp is not None:
        found.append((_STAMPED, stamp["stamp"].strip(), ""))
        at = stamp.end()
    line = line[:at] + _AROUND.sub("", line[at:])
    while line[at:].strip(" \t,;|"):
        match = _PAIR.match(line, at)
        if match is None:
            return []
        at = match.end()
        unit = match["unit"] or ""
        if unit and not any(quantity_unit(unit, role) for role in ROLES):
            unit = ""
            at = match.start("unit")  # the next key begins there
        found.append((match["key"], match["value"], unit))
    keys = {key for key, _, _ in found}
    if len(found) < 2 or len(keys) < len(found):
        return []
    return found


def are_keyed(lines: Sequence[str]) -> bool:
    """Whether most lines that hold something are pairs of keys and values, with the same keys."""
    filled = [line for line in lines if line.strip()]
    keyed = [pairs for line in filled if (pairs := _pairs(line))]
    if len(keyed) < max(FEWEST, SHARE * len(filled)):
        return False
    shared = set.intersection(*({key for key, _, _ in pairs} for pairs in keyed))
    return len(shared) > 1


def sheet_of_keyed(path: Path, lines: Sequence[str], encoding: str) -> Sheet:
    """Keys as a header, values as cells under it; other lines as they stand.

    Parameters
    ----------
    path : Path
        Named in messages.
    lines : sequence of str
    encoding : str
        In which it was written.

    Raises
    ------
    InputError
        A key has two units.
    """
    read = [_pairs(line) for line in lines]
    units = _units_of_keys(path, read)
    header = tuple(f"{key} [{unit}]" if unit else key for key, unit in units.items())
    rows = []
    headed = False
    for number, (line, pairs) in enumerate(zip(lines, read, strict=True), start=1):
        if pairs and not headed:
            rows.append(SheetRow(number, header))
            headed = True
        cells = [line.strip()]
        if pairs:
            values = {key: value for key, value, _ in pairs}
            cells = [values.get(key, "") for key in units]
        if any(cells):
            rows.append(SheetRow(number, tuple(cells)))
    return Sheet(path, tuple(rows), described="a name before each value", encoding=encoding)


def _units_of_keys(path: Path, read: Sequence[list[tuple[str, str, str]]]) -> dict[str, str]:
    """The unit of each key, empty where it has none."""
    units: dict[str, str] = {}
    for number, pairs in enumerate(read, start=1):
        for key, _, unit in pairs:
            known = units.setdefault(key, unit)
            if known != unit:
                found = f"{key} in {unit or 'no unit'}"
                raise InputError(f"{path}, line {number}: found {found}, expected {known or 'none'} as before")
    return units

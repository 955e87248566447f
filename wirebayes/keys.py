"""One TOML table asked for its keys, so that every complaint says where it stands."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from wirebayes.errors import InputError
from wirebayes.readings import nearest, shown


@dataclass(frozen=True)
class Keys:
    """One TOML table of an experiment file.

    Attributes
    ----------
    source : Path
    text : str
        The whole file, to find lines in: the parser does not keep them.
    index : int or None
        Which ``[[experiment]]`` the table belongs to, from 0; None for the top level.
    table : dict
    name : str
        The experiment's name, where it has one.
    prefix : str
        The way from the experiment to this table.
    """

    source: Path
    text: str
    index: int | None
    table: dict[str, Any]
    name: str = ""
    prefix: str = ""

    def complain(self, key: str, found: str, expected: str) -> InputError:
        place = str(self.source)
        if self.index is not None:
            line = self._line(key)
            place += f", line {line}" if line else ""
            place += f", experiment {_printable(self.name) or self.index + 1}"
        return InputError(f"{place}, key {self.prefix}{_printable(key)}: found {found}, expected {expected}")

    def _line(self, key: str) -> int | None:
        """Line of a key in its [[experiment]]."""
        top = (self.prefix + key).split("[")[0].split(".")[0]
        seen = -1
        for number, line in enumerate(self.text.split("\n"), start=1):
            seen += line.strip().startswith("[[experiment]]")
            if seen == self.index and re.match(rf"\s*[\"']?{re.escape(top)}[\"']?\s*[=.]", line):
                return number
        return None

    def only(self, known: tuple[str, ...]) -> None:
        for key in self.table:
            if key not in known:
                hint = nearest(key, known)
                raise self.complain(key, f"an unknown key{hint}", "only " + ", ".join(known))

    def value(self, key: str, expected: str) -> Any:
        if key not in self.table:
            raise self.complain(key, "nothing", expected)
        return self.table[key]

    def string(self, key: str, expected: str) -> str:
        value = self.value(key, expected)
        if not isinstance(value, str) or not value.strip():
            raise self.complain(key, shown(value), expected)
        return value

    def number(self, key: str, expected: str, above: float | None = None, least: float | None = None) -> float:
        value = self.value(key, expected)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.complain(key, shown(value), expected)
        try:
            number = float(value)
        except OverflowError:
            raise self.complain(key, shown(value), expected) from None
        if not np.isfinite(number) or (above is not None and number <= above) or (least is not None and number < least):
            raise self.complain(key, shown(value), expected)
        return number

    def priors(self) -> dict[str, dict[str, Any]]:
        """The ``[prior]`` table, left as written: what a prior may say is known to the statistics alone."""
        tables = self.table.get("prior", {})
        expected = "a table of tables, one for each parameter"
        if not isinstance(tables, dict):
            raise self.complain("prior", shown(tables), expected)
        for name, table in tables.items():
            if not isinstance(table, dict):
                raise self.complain(f"prior.{name}", shown(table), "a table, such as { fixed = 1.0 }")
        return tables


def _printable(text: str) -> str:
    """A name as it is, or quoted where it would break the line."""
    return text if text.isprintable() else repr(text)

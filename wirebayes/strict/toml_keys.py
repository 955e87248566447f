"""The keys of one TOML table, read so that every error says where it stands."""

import re
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from wirebayes.errors import InputError, shown
from wirebayes.strict.hint import hint


@dataclass(frozen=True)
class Keys:
    """One TOML table of an experiment file.

    Attributes
    ----------
    source : Path
    text : str
        The whole file, to find lines in: the parser does not keep them.
    index : int or None
        Which ``[[experiment]]`` (or other `kind`) the table belongs to, from 0; None for the top level.
    table : dict
    name : str
        The experiment's name, where it has one.
    prefix : str
        The way from the experiment to this table.
    kind : str
        What the tables of the file are called.
    """

    source: Path
    text: str
    index: int | None
    table: dict[str, Any]
    name: str = ""
    prefix: str = ""
    kind: str = "experiment"

    def complain(self, key: str, found: str, expected: str) -> InputError:
        """The error for one key of the table.

        Parameters
        ----------
        key : str
        found, expected : str
            As the message shows them: what stands there, and what should.

        Returns
        -------
        InputError
            With the file, the line, the table and the key; the caller raises it.
        """
        place = f"{self.source}, line {self.line(key)}"
        if self.index is not None:
            place += f", {self.kind} {_printable(self.name) or self.index + 1}"
        return InputError(f"{place}, key {self.prefix}{_printable(key)}: found {found}, expected {expected}")

    def line(self, key: str) -> int:
        """The line on which a key stands."""
        return line_of(self.text, self.prefix + key, self.index, self.kind)

    def only(self, known: tuple[str, ...]) -> None:
        for key in self.table:
            if key not in known:
                meant = hint(key, known)
                raise self.complain(key, f"an unknown key{meant}", "only " + ", ".join(known))

    def value(self, key: str, expected: str) -> Any:
        if key not in self.table:
            raise self.complain(key, "nothing", expected)
        return self.table[key]

    def string(self, key: str, expected: str) -> str:
        value = self.value(key, expected)
        if not isinstance(value, str) or not value.strip():
            raise self.complain(key, shown(value), expected)
        return value

    def number(
        self, key: str, expected: str, above: float = -np.inf, least: float = -np.inf, most: float = np.inf
    ) -> float:
        """A finite number within limits.

        Parameters
        ----------
        key : str
        expected : str
            What the message says is expected.
        above : float
            The number must be greater.
        least, most : float
            The number must not be less, nor more.

        Raises
        ------
        InputError
            If the key is missing, no number or beyond the limits.
        """
        value = self.value(key, expected)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.complain(key, shown(value), expected)
        try:
            number = float(value)
        except OverflowError:
            raise self.complain(key, shown(value), expected) from None
        if not (np.isfinite(number) and above < number and least <= number <= most):
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


def line_of(text: str, key: str, index: int | None = None, kind: str = "experiment") -> int:
    """The line of a TOML file on which a key stands; of the innermost table found on the way to it otherwise.

    Parameters
    ----------
    text : str
    key : str
        With the names of its tables, such as ``prior.k1.sd``.
    index : int, optional
        The ``[[experiment]]`` to look in, from 0; without it the whole file.
    kind : str
        What such tables are called.
    """
    lines = text.split("\n")
    tables = [at for at, line in enumerate(lines) if line.strip().startswith(f"[[{kind}]]")]
    begin, end = 0, len(lines)
    if index is not None and index < len(tables):
        begin, end = tables[index], [*tables, end][index + 1]
    for part in re.split(r"[.\[]", key):
        word = rf"(?<![\w-]){re.escape(part)}(?![\w-])"
        spelled = re.compile(rf"^\s*\[.*{word}.*\]|{word}[\"']?\s*[=.]")
        begin = next((at for at in range(begin, end) if spelled.search(lines[at])), begin)
    return begin + 1


def read_toml(source: Path, text: str) -> dict[str, Any]:
    """A TOML document.

    Raises
    ------
    InputError
        With the line and column of what is no TOML.
    """
    try:
        return tomllib.loads(text)
    except RecursionError:
        depth = [line.count("[") + line.count("{") for line in text.split("\n")]
        place, found = f"line {int(np.argmax(depth)) + 1}", "values nested too deeply"
    except ValueError as error:  # TOMLDecodeError, or a number of thousands of digits
        at = re.fullmatch(r"(.*?) \((?:at line (\d+), column (\d+)|at end of document)\)", str(error), re.DOTALL)
        if at and at[2]:
            place, found = f"line {at[2]}, column {at[3]}", f"a TOML error ({_lower(at[1])})"
        elif at:
            lines = text.rstrip().split("\n")
            place, found = f"line {len(lines)}, column {len(lines[-1]) + 1}", f"the end of the file ({_lower(at[1])})"
        else:
            longest = max(re.finditer(r"\d+", text), key=lambda run: len(run[0]))
            before = text[: longest.start()].split("\n")
            place = f"line {len(before)}, column {len(before[-1]) + 1}"
            found = "a TOML error (a number of thousands of digits)"
    raise InputError(f"{source}, {place}: found {found}, expected valid TOML")


def _lower(message: str) -> str:
    return message[:1].lower() + message[1:]


def _printable(text: str) -> str:
    """A name as it is, or quoted where it would break the line."""
    return text if text.isprintable() else repr(text)

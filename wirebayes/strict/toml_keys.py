"""The keys of one TOML table, read so that every error says where it stands: experiments, plans and robots alike."""

import math
import re
import tomllib
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Self

import numpy as np

from wirebayes.errors import InputError, shown
from wirebayes.strict.hint import hint

LARGEST_NUMBER = 1e12  # no length, mass, stiffness or time comes near, and its square does not overflow


@dataclass(frozen=True)
class Keys:
    """One TOML table of a file, which remembers the keys that were asked for.

    Attributes
    ----------
    source : Path
    text : str
        The whole file, to find lines in: the parser does not keep them.
    index : int or None
        Which ``[[experiment]]`` (or other `kind`) the table belongs to, from 0; None for the top level.
    table : dict
    name : str
        What errors call the experiment; empty where the prefix says it.
    prefix : str
        The way from the experiment to this table.
    kind : str
        What the tables of the file are called.
    asked : set of str
        Keys whose values were asked for.
    """

    source: Path
    text: str
    index: int | None
    table: dict[str, Any]
    name: str = ""
    prefix: str = ""
    kind: str = "experiment"
    asked: set[str] = field(default_factory=set, compare=False)

    @classmethod
    def of_file(cls, source: Path, text: str) -> Self:
        """The top level of a TOML file."""
        return cls(source, text, None, read_toml(source, text))

    def complain(self, key: str, found: str, expected: str) -> InputError:
        """The error for one key of the table.

        Parameters
        ----------
        found, expected : str
            As the message shows them: what stands there, and what should.

        Returns
        -------
        InputError
            With the file, the line, the table and the key; the caller raises it.
        """
        place = f"{self.source}, line {self.line(key)}"
        if self.name:
            place += f", {self.kind} {_printable(self.name)}"
        return InputError(f"{place}, key {self.prefix}{_printable(key)}: found {found}, expected {expected}")

    def line(self, key: str) -> int:
        """The line on which a key stands."""
        return line_of(self.text, self.prefix + key, self.index, self.kind)

    def only(self, known: tuple[str, ...]) -> None:
        for key in self.table:
            if key not in known:
                meant = hint(key, known)
                raise self.complain(key, f"an unknown key{meant}", "only " + ", ".join(known))

    def finish(self) -> None:
        """Refuse the keys that nobody asked for."""
        self.only(tuple(sorted(self.asked)))

    def tables(self, kind: str, least: int = 1) -> list[Self]:
        """The ``[[kind]]`` tables of a file, each called by its name or its number.

        Raises
        ------
        InputError
            There are fewer than `least`.
        """
        expected = f"at least {_COUNT[least]} [[{kind}]]"
        given = self.value(kind, expected)
        if isinstance(given, dict):
            raise self.complain(kind, "a single table", expected)
        are_tables = isinstance(given, list) and all(isinstance(table, dict) for table in given)
        if not are_tables or len(given) < least:
            found = f"{len(given)} [[{kind}]]" if are_tables and given else shown(given)
            raise self.complain(kind, found, expected)
        tables = []
        for index, table in enumerate(given):
            name = _called(table, index)
            own = replace(self, index=index, table=table, name=name, kind=kind, asked=set())
            tables.append(own)
        return tables

    def inside(self, key: str, default: dict[str, Any] | None = None, expected: str = "a table") -> Self:
        """The table under a key.

        Parameters
        ----------
        default : dict, optional
            For a key that is missing; without a default that is an error.
        expected : str
            What the message says is expected.
        """
        table = self.value(key, expected, default)
        if not isinstance(table, dict):
            raise self.complain(key, shown(table), expected)
        return replace(self, table=table, prefix=f"{self.prefix}{key}.", asked=set())

    def elements(self, key: str, expected: str) -> list[Self]:
        """The tables of a list under a key, which may be missing."""
        entries = self.value(key, expected, [])
        if not isinstance(entries, list):
            raise self.complain(key, shown(entries), expected)
        elements = []
        for index, entry in enumerate(entries):
            if not isinstance(entry, dict):
                raise self.complain(f"{key}[{index}]", shown(entry), expected)
            prefix = f"{self.prefix}{key}[{index}]."
            elements.append(replace(self, table=entry, prefix=prefix, asked=set()))
        return elements

    def value(self, key: str, expected: str, default: Any = None) -> Any:
        """What stands under a key, which counts as known from then on.

        Parameters
        ----------
        expected : str
            What the message says is expected.
        default : any, optional
            For a key that is missing; without a default that is an error.
        """
        self.asked.add(key)
        if key in self.table:
            return self.table[key]
        if default is None:
            self._refuse_other_unit(key)
            raise self.complain(key, "no such key", expected)
        return default

    def _refuse_other_unit(self, key: str) -> None:
        """Refuse the key that stands in the place of a missing one and names another unit."""
        stem = key.rpartition("_")[0]
        for other in self.table:
            if stem and other.rpartition("_")[0] == stem:
                raise self.complain(other, f"an unknown key{hint(other, (key,))}", key)

    def string(
        self, key: str, expected: str = "a text", default: str | None = None, among: tuple[str, ...] = ()
    ) -> str:
        """A text that is not blank, one of some where there is a choice.

        Parameters
        ----------
        expected : str
            What the message says is expected, where there is no choice.
        default : str, optional
            For a key that is missing; without a default that is an error.
        among : tuple of str
            The texts allowed; empty for any.
        """
        if among:
            expected = "one of " + ", ".join(among)
        value = self.value(key, expected, default)
        if not isinstance(value, str) or not value.strip() or (among and value not in among):
            raise self.complain(key, shown(value), expected)
        return value

    def number(
        self,
        key: str,
        expected: str = "",
        *,
        above: float = -math.inf,
        least: float = -LARGEST_NUMBER,
        most: float = LARGEST_NUMBER,
        default: float | None = None,
    ) -> float:
        """A finite number within limits.

        Parameters
        ----------
        expected : str
            What the message says is expected; without it the limits.
        above : float
            The number must be greater.
        least, most : float
            The number must not be less, nor more.
        default : float, optional
            For a key that is missing; without a default that is an error.

        Raises
        ------
        InputError
            If the key is missing, no number or beyond the limits.
        """
        expected = expected or _within(above, least, most)
        value = self.value(key, expected, default)
        number = _finite(value)
        if number is None or not (above < number and least <= number <= most):
            raise self.complain(key, shown(value), expected)
        return number

    def whole(self, key: str, expected: str, least: int, most: int) -> int:
        """A whole number within limits.

        Parameters
        ----------
        expected : str
            What the message says is expected.
        least, most : int
        """
        value = self.value(key, expected)
        if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
            raise self.complain(key, shown(value), expected)
        return value

    def numbers(
        self, key: str, expected: str, count: int | None = None, default: list[float] | None = None
    ) -> list[float]:
        """A list of finite numbers.

        Parameters
        ----------
        expected : str
            What the message says is expected.
        count : int, optional
            How many there must be.
        default : list of float, optional
            For a key that is missing; without a default that is an error.
        """
        values = self.value(key, expected, default)
        if not isinstance(values, list) or (count is not None and len(values) != count):
            raise self.complain(key, shown(values), expected)
        numbers = []
        for value in values:
            number = _finite(value)
            if number is None or abs(number) > LARGEST_NUMBER:
                raise self.complain(key, shown(value), expected)
            numbers.append(number)
        return numbers

    def priors(self) -> dict[str, dict[str, Any]]:
        """The ``[prior]`` table by parameter: what a prior may say is known to the statistics alone.

        ``[prior.toe.w]`` is a table in a table to TOML, and the same as ``[prior."toe.w"]`` here.
        """
        tables = self.table.get("prior", {})
        expected = "a table of tables, one for each parameter"
        if not isinstance(tables, dict):
            raise self.complain("prior", shown(tables), expected)
        found: dict[str, dict[str, Any]] = {}
        for name, table in tables.items():
            if not isinstance(table, dict):
                raise self.complain(f"prior.{name}", shown(table), "a table, such as { fixed = 1.0 }")
            of_effect = bool(table) and all(isinstance(inner, dict) for inner in table.values())
            own = {f"{name}.{parameter}": inner for parameter, inner in table.items()} if of_effect else {name: table}
            for parameter in found.keys() & own.keys():
                raise self.complain(f"prior.{parameter}", "it a second time", "one prior of each parameter")
            found |= own
        return found


def line_of(text: str, key: str, index: int | None, kind: str) -> int:
    """The line of a TOML file on which a key stands; of the innermost table found on the way to it otherwise.

    Parameters
    ----------
    key : str
        With the names of its tables, such as ``prior.k1.sd``.
    index : int or None
        The ``[[experiment]]`` to look in, from 0; without it the whole file.
    kind : str
        What such tables are called.
    """
    lines = text.split("\n")
    tables = [at for at, line in enumerate(lines) if line.strip().startswith(f"[[{kind}]]")]
    begin, end = 0, len(lines)
    if index is not None and index < len(tables):
        begin, end = tables[index], [*tables, end][index + 1]
    for part in re.sub(r"\[\d+\]", "", key).split("."):
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
        place, found = _deepest(text)
    except ValueError as error:  # TOMLDecodeError, or a number of thousands of digits
        place, found = _where(str(error), text)
    raise InputError(f"{source}, {place}: found {found}, expected valid TOML")


def _deepest(text: str) -> tuple[str, str]:
    """The line with most brackets, and what is wrong with it."""
    depth = [line.count("[") + line.count("{") for line in text.split("\n")]
    return f"line {int(np.argmax(depth)) + 1}", "values nested too deeply"


def _where(error: str, text: str) -> tuple[str, str]:
    """Where the parser found an error, and which."""
    told = re.fullmatch(r"(.*?) \((?:at line (\d+), column (\d+)|at end of document)\)", error, re.DOTALL)
    if told is None:
        longest = max(re.finditer(r"\d+", text), key=lambda run: len(run[0]))
        return _end_of(text[: longest.start()]), "a TOML error (a number of thousands of digits)"
    what, line, column = told.groups()
    if line:
        return f"line {line}, column {column}", f"a TOML error ({_lower(what)})"
    return _end_of(text.rstrip()), f"the end of the file ({_lower(what)})"


def _end_of(text: str) -> str:
    """The place behind a text."""
    lines = text.split("\n")
    return f"line {len(lines)}, column {len(lines[-1]) + 1}"


_COUNT = {1: "one", 2: "two"}  # in words, as messages have it


def _called(table: dict[str, Any], index: int) -> str:
    """What errors call a table of a list: its name, or its number from 1."""
    name = table.get("name")
    return name if isinstance(name, str) and name else str(index + 1)


def _finite(value: Any) -> float | None:
    """A number of a file; None for what is no finite one."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if math.isfinite(number) else None


def _within(above: float, least: float, most: float) -> str:
    """What is expected of a number, from its limits."""
    size = f"{most:.0e} in size"
    if above > -math.inf:
        return f"a number above {above:g}, at most {size}"
    if least > -LARGEST_NUMBER:
        return f"a number of at least {least:g}, at most {size}"
    return f"a number of at most {size}"


def _lower(message: str) -> str:
    return message[:1].lower() + message[1:]


def _printable(text: str) -> str:
    """A name as it is, or quoted where it would break the line."""
    return text if text.isprintable() else repr(text)

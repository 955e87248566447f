"""Two interpretations are possible, and nothing in the file decides: a person may choose, a program gets an error."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from wirebayes.errors import InputError
from wirebayes.sentences import listed
from wirebayes.wire.protocol import Control

Decimal = Literal["point", "comma"]
TimeSince = Literal["hold", "test"]
Specimens = Literal["several", "one"]


@dataclass(frozen=True)
class Choices:
    """What a user says of raw files, beyond what stands in them.

    Attributes
    ----------
    mapping : tuple of str
        ``HEADER=COLUMN`` or ``HEADER=COLUMN [UNIT]``.
    decimal : {"point", "comma"} or None
        The decimal sign.
    time_since : {"hold", "test"} or None
        What times count from.
    sheet : str or None
        Of a workbook.
    zero_mm : float
        Reading of the displacement where the wire has its zero-tension length.
    control : {"displacement", "force"} or None
        What was set in each hold.
    specimens : {"several", "one"} or None
        Of which columns stand side by side, or tests one below another.
    each_file : str or None
        What each of several files is: hold or test, or the setting of the hold in each.
    drop_breaks : bool
        Whether rows of readings that are missing are left out.
    """

    mapping: tuple[str, ...] = ()
    decimal: Decimal | None = None
    time_since: TimeSince | None = None
    sheet: str | None = None
    zero_mm: float | None = None
    control: Control | None = None
    specimens: Specimens | None = None
    each_file: str | None = None
    drop_breaks: bool = False

    def with_option(self, option: str) -> "Choices":
        """These choices and one more, as the command line spells it: ``--decimal comma``."""
        name, _, value = option.removeprefix("--").partition(" ")
        if name == "map":
            return replace(self, mapping=(*self.mapping, value))
        changed = {name.replace("-", "_"): float(value) if name == "zero-mm" else value}
        return replace(self, **changed)  # type: ignore[arg-type]


class Undecided(InputError):
    """Several readings are possible.

    Parameters
    ----------
    found : str
        Where and what.
    question : str
        What is to be decided, in the words of a person who asks.
    answers : mapping of str to str
        What each answer means, by the option that says so.
    others : sequence of Undecided
        What will have to be decided besides, so that all can be said at once.
    message : str, optional
        What the error says instead of listing the answers.
    """

    def __init__(
        self,
        found: str,
        question: str,
        answers: Mapping[str, str],
        others: Sequence["Undecided"] = (),
        message: str | None = None,
    ) -> None:
        options = listed([quoted(option) for option in answers], "or")
        path = found.partition(", ")[0] + ", "
        more = "; ".join(other.found.removeprefix(path) for other in others)
        besides = f"; besides, undecided: {more}" if more else ""
        super().__init__(message or f"{found}, expected {options} to say {question}{besides}")
        self.found: str = found
        self.question, self.answers = question, dict(answers)
        self.others: tuple[Undecided, ...] = tuple(others)


def quoted(option: str) -> str:
    """An option as a shell takes it."""
    name, _, value = option.partition(" ")
    is_one_word = name != "--map" and re.fullmatch(r"[\w.+-]*", value)
    return option if is_one_word else f'{name} "{value}"'

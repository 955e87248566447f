"""Warnings that a result carries from where they arise to terminal, page and JSON: a kind, and a sentence.

What is advised next and what a page shows first depend on the kinds, never on words in a sentence.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypedDict


@dataclass(frozen=True)
class Kind:
    """One kind of warning.

    Attributes
    ----------
    meaning : str
        In a sentence.
    first : bool
        Whether it changes what the answer is worth: a page shows it before the answer.
    """

    meaning: str
    first: bool


KINDS = {
    "model-check": Kind(
        "The model does not describe the readings it was fitted to: parameters, intervals and all that follows from "
        "them can be wrong by more than they say.",
        True,
    ),
    "incomplete": Kind(
        "Something is probably missing in the model that the readings do not establish: its intervals and predictions "
        "do without it, and can be wrong by more than they say.",
        True,
    ),
    "not-converged": Kind("A sampler or a search did not converge: its numbers are not to be used.", True),
    "misfit": Kind("Readings deviate from the model that should explain them by more than their stated errors.", True),
    "failed": Kind("Something could not be computed at all, for the reason given.", True),
    "unheld": Kind("No tensions hold the platform at a pose, for some or all of the draws.", True),
    "uncarried": Kind("No wire carries any weight, and the robot's file names no table or rail that does.", True),
    "fall": Kind("The platform falls or loses its hold, or is close to it.", True),
    "slack": Kind("A wire goes slack, or keeps little of its tension.", True),
    "break": Kind(
        "The tension falls to nothing, or a displacement under weights jumps, and stays there: the wire broke or "
        "slipped.",
        True,
    ),
    "saturation": Kind("A sensor or its amplifier stood at its upper limit while the setting moved.", True),
    "clipped": Kind("A sensor or its amplifier stood at its lower limit while the setting moved.", True),
    "tared": Kind(
        "The tension falls to nothing and rises from there: the sensor was zeroed, or the wire slipped.", True
    ),
    "dropout": Kind("The tension falls to nothing for some readings and comes back.", True),
    "gross-error": Kind("A single reading looks wrong, and was set aside where it would have decided.", True),
    "data": Kind(
        "Readings are not what a bench gives: their order, units, signs or noise; or what the file states contradicts "
        "them.",
        True,
    ),
    "prior": Kind("The prior decides the answer, or contradicts the readings.", True),
    "few-holds": Kind("There are fewer than three holds: no effect can be established.", True),
    "hold-ends": Kind(
        "It is not known when holds ended, or a rest may have been counted as part of a hold, and this matters: a "
        "parameter would change by more than its standard deviation, and by enough to count.",
        False,
    ),
    "extrapolation": Kind(
        "The answer goes beyond the tensions, times or lengths that were tested, or farther than the stiffness at a "
        "pose foresees.",
        False,
    ),
    "left-out": Kind("Something that is known about the wire or the robot is not used in the answer.", False),
    "geometry": Kind(
        "The request does not fit the robot, such as more wire than a drum holds, or its file contradicts itself.",
        False,
    ),
    "sag": Kind("A wire's own weight matters, but the statics leaves it out.", False),
    "clock": Kind(
        "The answer depends on when the creep of a moving wire starts anew, which no test of holds can show.", False
    ),
    "few-draws": Kind("Few posterior draws agree with the readings: the ends of the bands are rough.", False),
    "budget": Kind("No test fits into the available time.", False),
}
"""The kinds of warnings, gravest first."""


@dataclass(frozen=True)
class Notice:
    """A warning.

    Attributes
    ----------
    kind : str
        One of `KINDS`.
    text : str
        A sentence without its full stop: what, where, what to change.

    Raises
    ------
    ValueError
        There is no such kind.
    """

    kind: str
    text: str

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise ValueError(f"no kind of warning: {self.kind}")

    @property
    def first(self) -> bool:
        """Whether a page shows it before the answer."""
        return KINDS[self.kind].first

    def of(self, name: str) -> "Notice":
        """The same warning with the name of what it is about before it.

        Parameters
        ----------
        name : str
            Of an experiment, a model or a wire.
        """
        return Notice(self.kind, f"{name}: {self.text}")


class NoticeJson(TypedDict):
    """A warning as files hold it."""

    kind: str
    text: str


class Warned(TypedDict):
    """What every JSON file of results has."""

    warnings: list[NoticeJson]


def warns_of(warned: Warned, kind: str) -> bool:
    """Whether a file of results, or a part of it, has a warning of a kind."""
    return any(notice["kind"] == kind for notice in warned["warnings"])


def to_json(notices: Iterable[Notice]) -> list[NoticeJson]:
    """Warnings as files hold them, the gravest kinds first, each once.

    Parameters
    ----------
    notices : iterable of Notice
    """
    order = list(KINDS)
    ranked = sorted(dict.fromkeys(notices), key=lambda notice: order.index(notice.kind))
    return [{"kind": notice.kind, "text": notice.text} for notice in ranked]


def from_json(stored: Sequence[NoticeJson]) -> tuple[Notice, ...]:
    """Warnings of a file.

    Parameters
    ----------
    stored : sequence of dict
    """
    return tuple(Notice(entry["kind"], entry["text"]) for entry in stored)


def notices_by_part(parts: Mapping[str, Warned]) -> list[NoticeJson]:
    """The warnings of several parts of a result, each with the part's name before it.

    Parameters
    ----------
    parts : mapping of name to dict
        Experiments, say; each with its own ``warnings``.
    """
    return to_json(notice.of(name) for name, part in parts.items() for notice in from_json(part["warnings"]))

"""Planned tests, ranked by what they would teach within the available time."""

from collections.abc import Sequence
from dataclasses import dataclass

from wirebayes.io.experiment import Experiment
from wirebayes.planning.sensitivity import Sensitivity
from wirebayes.planning.widths import Expected


@dataclass(frozen=True)
class Judged:
    """A planned test and what it would teach.

    Attributes
    ----------
    test : Experiment
    words : str
        What is done, in words; empty where the plan file says it.
    expected : Expected
    sensitivity : Sensitivity
    """

    test: Experiment
    words: str
    expected: Expected
    sensitivity: Sensitivity

    @property
    def duration_min(self) -> float:
        """How long the holds last together."""
        return sum(hold.duration_s for hold in self.test.holds) / 60.0

    def score(self, aim: Sequence[str]) -> float:
        """What is to be as large as possible: bits, the narrowness of the creep after an hour, or δ between effects."""
        if tuple(aim) == ("parameters",):
            return self.expected.information_bits
        if tuple(aim) == ("creep",):
            return 1.0 / max(self.expected.widths["creep_1h_mm"]["sd"], 1e-300)
        one, other = aim
        return self.sensitivity.apart(one, other)


def ranked(tests: Sequence[Judged], aim: Sequence[str], budget_min: float | None) -> list[Judged]:
    """The tests within the budget, best first, then the others, best first.

    Parameters
    ----------
    tests : sequence of Judged
    aim : sequence of str
        ``("parameters",)``, ``("creep",)``, or the names of two effects to be distinguished; it decides the score.
    budget_min : float or None
        Longest test that is possible, minutes; None sets no limit.

    Returns
    -------
    list of Judged
        Among equal scores the shorter test comes first.
    """

    def order(judged: Judged) -> tuple[bool, float, float]:
        return too_long(judged, budget_min), -judged.score(aim), judged.duration_min

    return sorted(tests, key=order)


def too_long(judged: Judged, budget_min: float | None) -> bool:
    """Whether a test takes more than the time there is."""
    return budget_min is not None and judged.duration_min > budget_min

"""What is said of one material, from its judgement and its probabilities."""

import pytest

from wirebayes.discovery.judgement import Evidence, Judgement
from wirebayes.discovery.material_answer import MaterialAnswer
from wirebayes.json_files.discovery import Remainder, Verdict

NOTHING_LEFT: Remainder = {"probability": 0.0, "where": [], "p": None, "leave_one_hold_out": None}


def said(verdict: Verdict, shares: dict[str, float]) -> MaterialAnswer:
    found = Evidence(
        p=0.001, nothing=0.0, families=(), shares=shares, best_gain=None, remainder=0.0, remainder_gain=None
    )
    return MaterialAnswer(Judgement(verdict), [], [], found, NOTHING_LEFT)


@pytest.mark.parametrize(("toe", "best"), [(0.51, "toe"), (0.49, "unknown")])
def test_the_most_probable_answer_need_not_be_the_verdict(toe: float, best: str) -> None:
    answer = said("unknown", {"toe": toe, "unknown": 1.0 - toe})
    assert answer.best == best and set(answer.set) == {"toe", "unknown"}


def test_where_nothing_is_missing_nothing_is_probable() -> None:
    answer = said("nothing-missing", {"toe": 1.0})
    assert answer.best is None and answer.set == [] and answer.shares == {}

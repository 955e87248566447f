"""A prediction of a wire that is let back says so where the fit leaves out, or was not shown, what it gives back."""

from types import SimpleNamespace

import numpy as np
import pytest

from wirebayes.prediction.given_back import let_back


@pytest.mark.parametrize(
    ("likelihood", "fresh", "asked", "hold"),
    [
        ("hold", False, {4: 3.5}, None),
        ("hold", False, {4: 2.9}, 4),
        ("hold", False, {4: 3.5, 5: 1.0, 6: 4.0}, 5),
        ("hold", False, {1: 1.0, 2: 2.0}, None),
        ("hold", True, {1: 2.9}, None),
        ("hold", True, {1: 2.9, 2: 2.8}, 2),
        ("chain", False, {4: 2.9}, None),  # the test falls from 5 to 1
    ],
)
def test_a_hold_that_is_set_lower_is_warned_of(likelihood, fresh, asked, hold):
    protocol = SimpleNamespace(number=np.array([-1, 1, 2, 3]), setting=np.array([5.0, 1.0, 2.0, 3.0]))
    stored = SimpleNamespace(likelihood=likelihood, sample=SimpleNamespace(protocol=protocol))
    rows = [["wire", number, setting, time] for number, setting in asked.items() for time in (0.0, 60.0)]
    notices = let_back(rows, stored, fresh=fresh)
    assert [notice.kind for notice in notices] == ["left-out"] * (hold is not None)
    assert all(notice.text.startswith(f"hold {hold} is set lower than the one before") for notice in notices)


@pytest.mark.parametrize(
    ("tested", "fresh", "asked", "said"),
    [
        ([1.0, 2.0, 3.0], False, {4: 2.9}, True),
        ([1.0, 2.0, 3.0], False, {4: 3.0, 5: 4.0}, False),
        ([1.0, 2.0, 3.0], True, {1: 4.0, 2: 1.0}, True),
        ([1.0, 3.0, 2.0], False, {4: 1.0}, False),
        ([2.0, 2.0, 2.0], False, {4: 1.0}, True),
    ],
)
def test_what_no_falling_hold_has_shown_is_said(tested, fresh, asked, said):
    """Of 60 simulated wires that keep their creep, rising holds showed it in 2 of 20 checks; bands had 60 to 70 %."""
    protocol = SimpleNamespace(number=np.array([1, 2, 3]), setting=np.array(tested))
    stored = SimpleNamespace(likelihood="chain", sample=SimpleNamespace(protocol=protocol))
    rows = [["wire", number, setting, time] for number, setting in asked.items() for time in (0.0, 60.0)]
    assert [notice.kind for notice in let_back(rows, stored, fresh=fresh)] == ["extrapolation"] * said

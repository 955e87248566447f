"""A prediction hold by hold of a wire that is let back leaves out what the wire gives back, and says so."""

from types import SimpleNamespace

import numpy as np
import pytest

from wirebayes.prediction.given_back import not_given_back


@pytest.mark.parametrize(
    ("likelihood", "fresh", "asked", "hold"),
    [
        ("hold", False, {4: 3.5}, None),
        ("hold", False, {4: 2.9}, 4),
        ("hold", False, {4: 3.5, 5: 1.0, 6: 4.0}, 5),
        ("hold", False, {1: 1.0, 2: 2.0}, None),
        ("hold", True, {1: 2.9}, None),
        ("hold", True, {1: 2.9, 2: 2.8}, 2),
        ("chain", False, {4: 2.9}, None),
    ],
)
def test_a_hold_that_is_set_lower_is_warned_of(likelihood, fresh, asked, hold):
    protocol = SimpleNamespace(number=np.array([-1, 1, 2, 3]), setting=np.array([5.0, 1.0, 2.0, 3.0]))
    stored = SimpleNamespace(likelihood=likelihood, sample=SimpleNamespace(protocol=protocol))
    rows = [["wire", number, setting, time] for number, setting in asked.items() for time in (0.0, 60.0)]
    notices = not_given_back(rows, stored, fresh=fresh)
    assert [notice.kind for notice in notices] == ["left-out"] * (hold is not None)
    assert all(notice.text.startswith(f"hold {hold} is set lower than the one before") for notice in notices)

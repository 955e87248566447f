"""On which draws, after which load and at which times controllers and calibrations are tried."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from wirebayes.robot.pose import controllers
from wirebayes.robot.pose.request import PoseRequest


def test_a_calibration_is_tried_on_three_hundred_draws_from_its_end_to_a_day() -> None:
    """Evenly spread draws, the first and the last among them; times from zero on, eight a decade."""
    chosen: list[np.ndarray] = []

    def part(rows: np.ndarray) -> None:
        chosen.append(rows)
        raise InterruptedError

    request = PoseRequest(np.zeros(3), np.eye(3), np.array([0.0, 60.0]))
    for count in (1000, 7):
        line: Any = SimpleNamespace(count=count, part=part)
        with pytest.raises(InterruptedError):
            controllers.between_calibrations(None, line, request, np.random.default_rng(0))  # type: ignore[arg-type]
    assert len(chosen[0]) == 300 and (chosen[0][0], chosen[0][-1]) == (0, 999) and set(np.diff(chosen[0])) == {3, 4}
    assert chosen[1].tolist() == list(range(7))
    since = controllers._SINCE_S
    assert since[0] == 0.0 and since[1] == 1.0 and since[-1] == pytest.approx(1e5)
    assert np.diff(np.log10(since[1:])) == pytest.approx([1 / 8] * 40) and controllers.HISTORIES_S == (0.0, 3600.0)

"""A fixed point found in turns: approached slowly, swung around, or both, it is reached in bounded rounds."""

import numpy as np
import pytest

from wirebayes.robot.self_calibration import approach
from wirebayes.robot.self_calibration.approach import onward
from wirebayes.robot.self_calibration.equations import State


def state(values: np.ndarray) -> State:
    """Two unknowns of the robot, and a tension of 0.1 N a unit."""
    return State(values[:2], np.zeros((1, 3)), np.eye(3)[None], 0.1 * values[2:, None])


def rounds(slopes: np.ndarray, start: np.ndarray) -> int:
    """How many evaluations of x -> slopes x bring all components below a thousandth."""
    passed = [state(start)]
    for count in range(1, 1000):
        last = passed[-1]
        values = np.concatenate([last.white, last.pull_N[:, 0] / 0.1])
        if np.abs(values).max() < 1e-3:
            return count
        passed = onward(passed, state(slopes * values), np.ones(2), 0.1)
    return 1000


@pytest.mark.parametrize("slopes", [(0.98, 0.2, -0.3), (0.2, -0.3, 0.97)])  # an unknown, and a tension
def test_a_slow_direction_is_gone_in_jumps(slopes: tuple[float, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    with_jumps = rounds(np.array(slopes), np.array([1.0, -0.5, 0.8]))
    monkeypatch.setattr(approach, "_SLOW", np.inf)
    assert with_jumps < rounds(np.array(slopes), np.array([1.0, -0.5, 0.8])) / 3


def test_what_swings_about_the_end_comes_to_rest() -> None:
    assert rounds(np.array([-1.2, 0.3, -0.9]), np.array([1.0, 1.0, 1.0])) < 25


@pytest.mark.parametrize(("cosine", "jumps"), [(0.975, True), (0.965, False)])
def test_only_steps_in_one_direction_are_followed(cosine: float, jumps: bool) -> None:
    turned = 0.9 * np.array([cosine, np.sqrt(1.0 - cosine**2), 0.0])
    places = [np.zeros(3), np.array([1.0, 0.0, 0.0])]
    reached = places[1] + 2.0 * turned  # half of which is gone
    assert (len(onward([state(p) for p in places], state(reached), np.ones(2), 0.1)) == 1) == jumps


@pytest.mark.parametrize(("ratio", "jumps"), [(0.51, True), (0.49, False)])
def test_where_steps_shorten_fast_none_is_skipped(ratio: float, jumps: bool) -> None:
    places = [np.zeros(3), np.array([1.0, 0.0, 0.0])]
    reached = places[1] + 2.0 * ratio * places[1]
    passed = onward([state(p) for p in places], state(reached), np.ones(2), 0.1)
    assert (len(passed) == 1) == jumps
    if jumps:  # to where the sum of all steps ends
        assert passed[0].white[0] == pytest.approx(1.0 / (1.0 - ratio))


def test_a_jump_has_an_end() -> None:
    """Of steps that do not shorten, thirty."""
    places = [np.zeros(3), np.array([1.0, 0.0, 0.0])]
    (far,) = onward([state(p) for p in places], state(np.array([3.0, 0.0, 0.0])), np.ones(2), 0.1)
    assert far.white[0] == pytest.approx(32.0)

"""A word about dynamics where the inertial force is more than a twentieth of the weight."""

import numpy as np
import pytest

from wirebayes.robot.history.doubts import _accelerations, _dynamics
from wirebayes.robot.mechanics.description import GRAVITY


@pytest.mark.parametrize(("share", "told"), [(0.049, False), (0.051, True), (20.0 / GRAVITY, True)])
def test_the_warning_begins_at_a_twentieth_of_the_weight(share, told):
    rng = np.random.default_rng(3)
    for _ in range(5):
        way = rng.standard_normal(3)
        way /= np.linalg.norm(way)
        times = np.linspace(0.0, rng.uniform(0.2, 20.0), 30)
        position = rng.standard_normal(3) + 0.5 * share * GRAVITY * times[:, None] ** 2 * way
        found = _dynamics(times, position)
        assert bool(found) is told
        assert all(notice.kind == "left-out" for notice in found)


def test_lost_poses_and_short_histories_say_nothing():
    assert not _dynamics(np.array([0.0, 1.0]), np.zeros((2, 3)))
    assert not _dynamics(np.arange(4.0), np.full((4, 3), np.nan))


def _on(times_s, coordinate_m):
    """Positions along a line that is no axis."""
    return np.outer(coordinate_m, [0.6, 0.0, 0.8])


def test_a_steady_acceleration_is_found_however_unequal_the_steps():
    times = np.cumsum(np.random.default_rng(4).uniform(0.1, 2.0, 40))
    found = _accelerations(times, _on(times, 1.0 + 0.3 * times + 0.5 * 0.7 * times**2))
    np.testing.assert_allclose(found, 0.7, rtol=1e-9)


@pytest.mark.parametrize("rest_s", [1.0, 100.0, 1e4])
def test_a_long_rest_beside_a_fast_move_hides_nothing(rest_s):
    """From rest to rest by full acceleration and full braking, and from rest at a steady acceleration."""
    times = np.array([0.0, rest_s, rest_s + 1.0, 2.0 * rest_s + 1.0])
    shuttled = _accelerations(times, _on(times, [0.0, 0.0, 1.0, 1.0]))
    np.testing.assert_allclose(shuttled, 4.0)
    set_out = _accelerations(times[:3], _on(times[:3], [0.0, 1e-12, 1.0]))
    np.testing.assert_allclose(set_out, 2.0)
    braked = _accelerations(times[1:], _on(times[1:], [0.0, 1.0, 1.0]))
    np.testing.assert_allclose(braked, 2.0)


def test_a_move_beside_a_pose_that_was_lost_is_judged_by_its_other_end():
    times = np.array([0.0, 1.0, 2.0, 3.0, 4.0])
    found = _accelerations(times, _on(times, [0.0, 0.0, 1.0, np.nan, 1.0]))
    np.testing.assert_allclose(found[:2], 2.0)


def _stepped(move_s, way_m=0.05):
    """Two moves between stops of a minute, as a log that has a row at the end of each stop and one behind it."""
    starts = np.array([0.0, 60.0, 120.0])
    times = np.sort(np.concatenate([starts + move_s, starts + 60.0]))
    return times, _on(times, way_m * np.repeat([0.0, 1.0, 2.0], 2))


@pytest.mark.parametrize(("times_gravity", "told"), [(49.0, "% of its weight"), (51.0, "no platform is so fast")])
def test_moves_faster_than_any_platform_have_no_inertia_that_could_be_told(times_gravity, told):
    """From rest to rest within a time, a way takes four times itself over the time squared."""
    times, position = _stepped(np.sqrt(4.0 * 0.05 / (times_gravity * GRAVITY)))
    (notice,) = _dynamics(times, position)
    assert told in notice.text and notice.kind == "left-out"


def test_moves_without_a_duration_are_counted_and_hide_no_other():
    times, position = _stepped(0.001)
    (notice,) = _dynamics(times, position)
    assert "from 60 s on the log leaves 0.001 s for 50 mm, and in 1 other move:" in notice.text
    shuttled = np.concatenate([times, times[-1] + np.array([0.5, 60.0])])
    back = np.concatenate([position, position[:1], position[:1]])
    timeless, real = _dynamics(shuttled, back)
    assert "no platform is so fast" in timeless.text and "at 180 s it takes 16 % of its weight" in real.text


def test_a_pose_that_was_lost_beside_a_move_without_a_duration_is_no_move():
    times, position = _stepped(0.001)
    position[2:4] = np.nan
    position[4:] = position[5]
    assert not _dynamics(times, position)
    position[3] = position[4] + 1.0
    (notice,) = _dynamics(times[2:], position[2:])
    assert "no platform is so fast" in notice.text

"""A word about dynamics where the inertial force is more than a twentieth of the weight."""

import numpy as np
import pytest

from wirebayes.robot.history.doubts import _dynamics
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

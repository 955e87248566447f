"""How unusual a probability integral transform is, of one reading, where it can be worked out."""

import numpy as np
import pytest

from wirebayes.prediction.held_out import pit_band

DRAWS = np.random.default_rng(0).permutation((np.arange(2000) + 0.5) / 2000)[None]  # evenly from 0 to 1


@pytest.mark.parametrize("u", [0.005, 0.03, 0.25, 0.5, 0.8, 0.97, 0.995])
def test_one_reading_is_as_unusual_as_it_lies_far_out_on_either_side(u: float) -> None:
    """At the share u of its prediction: its course is 0 below u and 1 above, so p = 2 min(u, 1 - u), to the grid."""
    assert pit_band(DRAWS, np.array([u]))[1] == pytest.approx(2.0 * min(u, 1.0 - u), abs=0.025)


def test_a_reading_beyond_all_draws_is_as_unusual_as_can_be() -> None:
    assert pit_band(DRAWS, np.array([7.0]))[1] <= 0.02 and pit_band(DRAWS, np.array([-7.0]))[1] <= 0.02


@pytest.mark.parametrize(("probability", "sure"), [(0.9, 0.05), (0.5, 0.25)])
def test_the_band_of_one_reading_is_sure_only_where_few_draws_cross(probability: float, sure: float) -> None:
    """A course steps from 0 to 1 at its u: within 90 % of them none has at .05 and all have at .95."""
    level, low, high = pit_band(DRAWS, np.array([0.5]), probability)[0]
    assert level.tolist() == np.linspace(0.0, 1.0, 101).tolist()
    assert (high[level < sure - 0.02] == 0.0).all() and (high[level > sure + 0.02] == 1.0).all()
    assert (low[level < 1.0 - sure - 0.02] == 0.0).all() and (low[level > 1.0 - sure + 0.02] == 1.0).all()


def test_a_band_narrows_with_the_readings() -> None:
    """Of 400 independent ones the share at .5 has a standard deviation of .025; pointwise 95 % would be ±.049."""
    draws = np.random.default_rng(1).normal(size=(400, 1000))
    level, low, high = pit_band(draws, draws[:, 0])[0]
    middle = np.abs(level - 0.5).argmin()
    assert 0.055 < 0.5 - low[middle] < 0.085 and 0.055 < high[middle] - 0.5 < 0.085

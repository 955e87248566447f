"""The top of a profile of evidence: its width, its integral, and whether its neighbours are close enough."""

from typing import Any

import numpy as np
import pytest
from scipy import stats

from wirebayes.discovery.profile import Profile, Top, has_near_neighbours, integral_of, top_of


def width(value: list[float], grid: Any = (0.0, 1.0, 3.0, 4.0, 9.0)) -> Any:
    top = top_of(Profile(np.array(grid), np.array(value), []), 7.0)
    return top and top.sd


def test_a_width_is_that_of_the_parabola_through_the_top_on_any_grid() -> None:
    grid = np.array([0.0, 1.0, 3.0, 4.0, 9.0])
    for top in (1.2, 2.9, 4.5):
        assert width(list(-0.5 * ((grid - top) / 2.0) ** 2)) == pytest.approx(2.0)
    # what lies farther out does not matter, but next to the top it must be known
    assert width([-3.0, -1.0, 0.0, -0.5, -np.inf]) < 7.0
    assert width([-3.0, -1.0, 0.0, -np.inf, -1.0]) is None
    assert width([-3.0, -np.inf, 0.0, -1.0, -1.0]) is None
    # at an end there is no parabola
    assert width([0.0, -1.0, -2.0, -3.0, -4.0]) == width([-4.0, -3.0, -2.0, -1.0, 0.0]) is None
    # what is near the top may bend upwards
    assert width([-0.05, -0.9, 0.0, -0.9, -0.05], (0.0, 1.0, 2.0, 3.0, 4.0)) is None


@pytest.mark.parametrize("top", [0.3, 1.5])
@pytest.mark.parametrize("ends", [(0.0, np.inf), (0.0, 2.0), (-np.inf, np.inf)])
def test_of_a_parabola_counts_what_lies_between_the_ends_of_the_prior(top: float, ends: tuple[float, float]) -> None:
    """An amplitude that cannot be negative, with its top near none: half of a normal curve is not possible."""
    grid = np.array([0.0, 0.25, 0.5, 1.0, 2.0])
    value = 3.0 - 0.5 * ((grid - top) / 0.8) ** 2
    found = top_of(Profile(grid, value, []), 1.0)
    assert found is not None and found.amplitude == pytest.approx(top) and found.value == pytest.approx(3.0)
    inside = stats.norm(top, 0.8).cdf(ends[1]) - stats.norm(top, 0.8).cdf(ends[0])
    assert found.log_integral(*ends) == pytest.approx(3.0 + np.log(0.8 * np.sqrt(2.0 * np.pi) * inside))
    assert np.isfinite(Top(-50.0, 1.0, 0.0).log_integral(0.0, np.inf))


@pytest.mark.parametrize(("drop", "close"), [(1.19, True), (1.21, False)])
def test_neighbours_within_a_nat_or_so_are_close_enough(drop: float, close: bool) -> None:
    grid = np.array([0.0, 1.0, 2.0, 9.0])
    assert has_near_neighbours(Profile(grid, np.array([-0.5, 0.0, -drop, -50.0]), [])) == close
    assert has_near_neighbours(Profile(grid, np.array([0.0, -drop, -9.0, -50.0]), [])) == close


@pytest.mark.parametrize(("slope", "top"), [(3.0, 1.0), (-3.0, 0.0), (0.0, None)])
def test_an_amplitude_at_its_end_is_integrated(slope: float, top: float | None) -> None:
    """A share from 0 to 1 whose evidence grows or falls all the way: no parabola has its top there."""
    grid = np.linspace(0.05, 1.0, 20)
    profile = Profile(grid, 7.0 + slope * grid, [])
    assert top is None or abs(grid[profile.best] - top) < 0.06
    log_bayes, sd = integral_of(profile, 0.0, 100.0)
    exact = (np.exp(slope) - 1.0) / slope if slope else 1.0
    assert log_bayes == pytest.approx(7.0 + np.log(exact), abs=0.01 if slope >= 0 else 0.02)
    assert 0.2 < sd < 0.3


@pytest.mark.parametrize("jitter", [0.0, 1e-3])
def test_the_width_bears_what_climbs_leave_over(jitter: float) -> None:
    """Amplitudes crowded about the top, a thousandth of a nat between climbs; what lies lower than a nat is skewed."""
    grid = np.array([-4.0, -1.2, -0.5, -0.05, -0.02, 0.0, 0.03, 0.06, 0.6, 1.3, 5.0])
    value = -0.5 * grid**2 + jitter * np.array([0, 0, 0, 1, -1, 1, -1, 1, 0, 0, 0])
    value[[0, -1]] += 3.0
    found = top_of(Profile(grid, value, []), 1.0)
    assert found is not None and found.sd == pytest.approx(1.0, rel=0.03)
    assert top_of(Profile(grid[:6], value[:6], []), 7.0) is None  # at the end of the grid there is no parabola

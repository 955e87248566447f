"""A posterior that would move with its prior is said to lean on it."""

import numpy as np
import pytest
from scipy import stats

from wirebayes.model.prior import PowerScaled, Prior
from wirebayes.results.prior_influence import leaning

RNG = np.random.default_rng(0)


def draws(sd: float) -> np.ndarray:
    return stats.norm.ppf((np.arange(20000) + 0.5) / 20000)[:, None] * sd


@pytest.mark.parametrize(("sd", "leans"), [(0.88, False), (0.93, True)])
def test_a_normal_posterior_leans_where_its_interval_would_move_by_a_standard_deviation(sd: float, leans: bool) -> None:
    """Of a posterior of variance v under a prior of one, a prior of sd two makes v / (1 - 3/4 v): at v = .904²."""
    prior = Prior({"preload": stats.norm(0.0, 1.0)}, {}, frozenset())
    found = leaning(prior, draws(sd), prior.names)
    assert bool(found) == leans
    assert all(notice.kind == "prior" and "preload" in notice.text for notice in found)


def test_another_parameter_may_lean_on_a_prior() -> None:
    one = draws(0.97)[:, 0]
    theta = np.column_stack([np.exp(one), np.exp(-one + 0.01 * RNG.normal(size=len(one)))])
    free = {"B": stats.lognorm(1.0), "k2": stats.lognorm(50.0)}
    (found,) = leaning(Prior(free, {}, frozenset(free)), theta, ("B",))
    assert "the prior of B" in found.text and "B and k2" in found.text


def test_what_is_known_of_a_parameter_of_another_s_unit_is_its_product() -> None:
    """B times 4 to the power U is known well; B itself varies with U as widely as its prior at 1 N would."""
    U = RNG.normal(1.0, 0.7, 20000)
    theta = np.column_stack([np.exp(0.05 * RNG.normal(size=20000) - U * np.log(4.0)), U])
    free = {"B": stats.lognorm(1.0), "U": stats.uniform(-9.0, 20.0)}
    prior = Prior(free, {}, frozenset({"B"}), {"B": PowerScaled("U", float(np.log(4.0)))})
    assert leaning(prior, theta, prior.names) == []


@pytest.mark.parametrize("newtons", [0.001, 0.8, 1.0, 1.25, 1000.0])
def test_what_leans_is_the_same_in_any_unit_of_tension(newtons: float) -> None:
    """B at the test's tension does not lean; at a newton that is a little more or less it would move with U."""
    U = 0.97 * draws(1.0)[:, 0]
    B = np.exp(0.05 * RNG.permutation(U)) * newtons**-U
    free = {"B": stats.lognorm(1.0), "U": stats.norm(0.0, 1.0)}
    prior = Prior(free, {}, frozenset({"B"}), {"B": PowerScaled("U", float(np.log(newtons)))})
    (found,) = leaning(prior, np.column_stack([B, U]), prior.names)
    assert "the prior of U" in found.text and "the interval of U would" in found.text


@pytest.mark.parametrize(
    ("noise", "other", "leans"),
    [
        ("setting_sd", "preload", False),
        ("sensor_sd[a]", "setting_sd[a]", False),
        ("setting_sd", "k1", True),
        ("preload", "setting_sd", True),
    ],
)
def test_the_prior_of_a_noise_may_decide_what_is_known_of_it(noise: str, other: str, leans: bool) -> None:
    """It is said where an interval of the wire would move, too."""
    one = draws(0.97)[:, 0]
    theta = np.column_stack([np.exp(one), np.exp(one + 0.01 * RNG.normal(size=len(one)))])
    free = {noise: stats.lognorm(1.0), other: stats.lognorm(50.0)}
    assert bool(leaning(Prior(free, {}, frozenset(free)), theta, (noise,))) == leans

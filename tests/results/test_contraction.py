"""Posterior contraction against its definition, and the words for it at their thresholds."""

import numpy as np
import pytest

from wirebayes.results.contraction import contraction, interval, source


def test_an_interval_is_the_median_between_the_ends_of_the_middle_nine_tenths() -> None:
    assert interval(np.arange(101.0)) == (5.0, 50.0, 95.0)


def test_contraction_is_the_share_of_variance_taken_away_of_the_logarithm_if_positive() -> None:
    rng = np.random.default_rng(0)
    before, after = 1.5 * rng.normal(size=200_000), 3.0 + 0.3 * rng.normal(size=200_000)
    assert contraction(after, before) == pytest.approx(1 - 0.3**2 / 1.5**2, abs=0.001)
    assert contraction(np.exp(after), np.exp(before)) == pytest.approx(1 - 0.3**2 / 1.5**2, abs=0.001)
    assert contraction(before, before) == 0.0
    assert contraction(np.exp(2.0 * before), np.exp(before)) == pytest.approx(-3.0)


@pytest.mark.parametrize(
    ("value", "word"),
    [(-1.0, "prior"), (0.29, "prior"), (0.3, "data and prior"), (0.89, "data and prior"), (0.9, "data")],
)
def test_who_determines_a_quantity(value: float, word: str) -> None:
    assert source(value) == word


def test_a_quantity_that_may_be_zero_is_compared_as_it_is() -> None:
    """In the posterior or in the prior; no logarithm is taken then."""
    before, after = np.array([1.0, 2.0, 3.0, 6.0]), np.array([2.0, 3.0, 4.0])
    positive = 1.0 - np.var(np.log(after), ddof=1) / np.var(np.log(before), ddof=1)
    assert contraction(after, before) == pytest.approx(positive)
    for zero in (0.0, -1.0):
        for a, b in ((np.append(after, zero), before), (after, np.append(before, zero))):
            assert contraction(a, b) == pytest.approx(1.0 - np.var(a, ddof=1) / np.var(b, ddof=1))

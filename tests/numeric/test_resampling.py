"""Draws from weighted ones: as often as weights say, none too often, and how far weights may go."""

import numpy as np
import pytest

from wirebayes.numeric.resampling import effective_number, next_power, systematic_rows, thinned, truncated_rows


def test_a_row_comes_as_often_as_its_weight_says_to_within_one() -> None:
    rng = np.random.default_rng(0)
    for _ in range(50):
        weight = rng.exponential(size=7) * rng.integers(0, 2, 7) + 1e-3 * np.eye(7)[3]
        rows = systematic_rows(weight, 40, rng)
        expected = 40 * weight / weight.sum()
        assert (np.diff(rows) >= 0).all()
        assert (np.abs(np.bincount(rows, minlength=7) - expected) < 1).all()


def test_the_mean_number_of_draws_is_the_weight() -> None:
    rng = np.random.default_rng(1)
    weight = np.array([0.05, 0.0, 0.6, 0.35])
    counts = sum(np.bincount(systematic_rows(weight, 3, rng), minlength=4) for _ in range(4000))
    assert np.abs(counts / 12000 - weight).max() < 0.01


def test_no_row_counts_for_more_than_the_root_of_all() -> None:
    """Of 400 rows one has nearly all weight; twenty times the mean is left to it, a share of 20 / 21."""
    log_weight = np.full(400, 0.0)
    log_weight[7] = 50.0
    weight = np.exp(log_weight - 50.0)
    capped = np.minimum(weight, 20.0 * weight.mean())
    rows = truncated_rows(log_weight, 10_000, np.random.default_rng(0))
    assert np.mean(rows == 7) == pytest.approx(capped[7] / capped.sum(), abs=1e-3)
    even = truncated_rows(np.zeros(400), 4000, np.random.default_rng(0))
    assert (np.bincount(even, minlength=400) == 10).all()
    assert np.abs(np.corrcoef(even, np.arange(4000))[0, 1]) < 0.1  # in random order


class Last:
    """The largest number that a generator draws."""

    def uniform(self) -> float:
        return float(np.nextafter(1.0, 0.0))


def test_rounding_leads_to_no_row_beyond_the_last() -> None:
    weight = np.full(49, 1 / 49)
    assert systematic_rows(weight, 10_000, Last())[-1] == 48  # type: ignore[arg-type]


@pytest.mark.parametrize("share", [0.2, 0.5])
def test_the_next_power_leaves_as_many_rows_effective_as_asked(share: float) -> None:
    log_weight = np.random.default_rng(2).normal(scale=30.0, size=500)
    power = next_power(log_weight, 1.0, share)
    weight = np.exp(power * log_weight)
    assert 0.0 < power < 1.0 and weight.sum() ** 2 / (weight**2).sum() == pytest.approx(share * 500, rel=1e-6)
    assert next_power(log_weight, 0.5 * power, share) == 0.5 * power  # more than asked for is allowed


def test_a_power_is_never_nothing() -> None:
    log_weight = np.where(np.arange(10) < 1, 0.0, -np.inf)
    assert 0.0 < next_power(log_weight, 1.0, 0.5) < 1e-15


def test_thinned_weights_are_the_old_ones_on_average():
    """Heavy rows stay as they are, light ones are drawn and count as much as the threshold."""
    weight = np.array([5.0, 0.1, 0.2, 3.0, 0.3, 0.4, 0.05, 0.05])
    total = np.zeros(len(weight))
    for seed in range(4000):
        rows, new = thinned(weight, 4, np.random.default_rng(seed))
        assert len(rows) == len(np.unique(rows)) == 4
        assert new.sum() == pytest.approx(weight.sum())
        assert dict(zip(rows, new, strict=True)).items() >= {0: 5.0, 3: 3.0}.items()
        assert new[2:] == pytest.approx(1.1 / 2)
        total[rows] += new
    assert total / 4000 == pytest.approx(weight, abs=0.02)


@pytest.mark.parametrize(("n", "kept"), [(8, 8), (9, 8), (7, 7), (1, 1)])
def test_no_more_rows_are_kept_than_wanted(n, kept):
    weight = np.random.default_rng(0).exponential(size=8)
    rows, new = thinned(weight, n, np.random.default_rng(1))
    assert len(rows) == kept and new.sum() == pytest.approx(weight.sum())
    assert (n < 8) or np.array_equal(new, weight)


def test_the_effective_number_counts_equal_weights():
    assert effective_number(np.array([2.0, 2.0, 2.0, 0.0])) == pytest.approx(3.0)

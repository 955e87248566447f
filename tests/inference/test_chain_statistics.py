"""Statistics of draws against ArviZ's."""

import numpy as np
import pytest
from arviz_stats.base import array_stats

from wirebayes.inference.chain_statistics import (
    bulk_ess,
    cumulative_distance,
    pareto_fit,
    pareto_smoothed,
    power_scaled,
    power_sensitivity,
    r_hat,
    tail_ess,
)


def chains(memory: float, n: int, m: int = 4, seed: int = 0) -> np.ndarray:
    """Autoregressive draws: (m, n)."""
    noise = np.random.default_rng(seed).normal(size=(m, n))
    values = np.empty_like(noise)
    values[:, 0] = noise[:, 0]
    for i in range(1, n):
        values[:, i] = memory * values[:, i - 1] + np.sqrt(1 - memory**2) * noise[:, i]
    return values


DRAWS = {
    "independent": chains(0.0, 1000),
    "slow": chains(0.97, 1000),
    "back and forth": chains(-0.6, 1000),
    "an odd number": chains(0.5, 333),
    "few": chains(0.3, 12),
    "of many walkers": chains(0.8, 40, m=128),
    "of one chain": chains(0.9, 500, m=1),
    "repeated": np.round(chains(0.7, 600), 1),
    "apart": chains(0.2, 400) + np.array([0.0, 0.0, 0.0, 1.5])[:, None],
    "one wider": chains(0.2, 400) * np.array([1.0, 1.0, 1.0, 4.0])[:, None],
    "heavy tails": np.tan(1.5 * chains(0.4, 700)),
}


@pytest.mark.parametrize("kind", DRAWS)
def test_as_arviz_says(kind: str) -> None:
    values = DRAWS[kind]
    assert bulk_ess(values) == pytest.approx(float(array_stats.ess(values, method="bulk")), rel=1e-9)
    assert tail_ess(values) == pytest.approx(float(array_stats.ess(values, method="tail", prob=(0.05, 0.95))), rel=1e-9)
    if len(values) > 1:
        assert r_hat(values) == pytest.approx(float(array_stats.rhat(values)), rel=1e-9)


def test_as_arviz_says_of_short_chains_of_any_length() -> None:
    """Where the correlation lasts as long as the chain, the sum ends with the lags."""
    for n in range(8, 60):
        values = chains(0.9 if n % 3 else -0.3, n, m=1 + n % 4, seed=n)
        assert bulk_ess(values) == pytest.approx(float(array_stats.ess(values, method="bulk")), rel=1e-9), n
        tail = float(array_stats.ess(values, method="tail", prob=(0.05, 0.95)))
        assert tail_ess(values) == pytest.approx(tail, rel=1e-9), n


def test_draws_that_do_not_move() -> None:
    still = np.full((4, 100), 2.0)
    assert bulk_ess(still) == float(array_stats.ess(still, method="bulk")) == 400.0
    with np.errstate(invalid="ignore"):
        assert np.isnan(r_hat(still))


@pytest.mark.parametrize("n", [100, 225, 226, 4000])
@pytest.mark.parametrize("spread", [1e-3, 0.5, 3.0])
@pytest.mark.parametrize("share", [0.5, 1.0, 9.0])
def test_smoothed_weights_and_the_shape_of_their_tail(n: int, spread: float, share: float) -> None:
    log_ratio = spread * np.random.default_rng(n).normal(size=n)
    weight, k = pareto_smoothed(log_ratio, share)
    expected, expected_k = array_stats.psislw(-log_ratio, r_eff=share)
    assert k == pytest.approx(float(expected_k), abs=1e-9)
    np.testing.assert_allclose(weight, expected, atol=1e-9)


def test_a_tail_of_too_few_draws_or_of_one_value_has_no_shape() -> None:
    assert np.isnan(pareto_smoothed(np.arange(20.0))[1])
    weight, k = pareto_smoothed(np.where(np.arange(1000) < 500, 0.0, -1.0))
    assert np.isnan(k) and np.exp(weight).sum() == pytest.approx(1.0)


@pytest.mark.parametrize(("on_the_threshold", "known"), [(4, True), (5, False)])
def test_a_tail_of_which_a_quarter_stands_on_the_threshold_has_no_shape(on_the_threshold: int, known: bool) -> None:
    excess = np.maximum(np.arange(20.0) - on_the_threshold + 1.0, 0.0)
    with np.errstate(all="raise"):
        assert np.isfinite(pareto_fit(excess)).all() == known


def test_a_known_tail() -> None:
    """Of ten thousand values of a generalised Pareto distribution of shape 0.4 and scale 2."""
    level = (np.arange(10_000) + 0.5) / 10_000
    shape, scale = pareto_fit(2.0 * np.expm1(-0.4 * np.log1p(-level)) / 0.4)
    assert (shape, scale) == (pytest.approx(0.4, abs=0.01), pytest.approx(2.0, rel=0.01))


@pytest.mark.parametrize("power", [1 / 1.1, 1.1, 2.0])
@pytest.mark.parametrize("n", [200, 3000])
def test_power_scaling(n: int, power: float) -> None:
    values = np.random.default_rng(3).normal(size=n)
    log_component = -0.5 * (values - 1.0) ** 2
    ours = power_scaled(log_component, power)
    np.testing.assert_allclose(ours, array_stats.power_scale_lw(log_component, alpha=power), atol=1e-9)
    other = np.exp(power_scaled(log_component, 1 / power))
    weights = (np.exp(ours), other) if power < 1 else (other, np.exp(ours))
    powers = (min(power, 1 / power), max(power, 1 / power))
    arviz = array_stats.power_scale_sense(values[None], *(w[None] for w in weights), *powers)
    assert power_sensitivity(values, *weights, powers) == pytest.approx(float(arviz), abs=1e-9)


def test_distance_of_the_same_draws_is_none_and_of_two_halves_nearly_one() -> None:
    values = np.sort(np.random.default_rng(0).normal(size=1000))
    assert cumulative_distance(values, np.ones(1000)) == pytest.approx(0.0, abs=1e-6)
    last = np.where(np.arange(1000) == 999, 1.0, 1e-12)
    assert 0.6 < cumulative_distance(values, last) < 1.0

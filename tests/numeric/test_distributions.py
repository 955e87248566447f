"""Distributions for priors are scipy's: draws to the last bit, densities, quantiles and moments within rounding."""

import numpy as np
import pytest
from scipy import integrate, stats

from wirebayes.numeric.any_distribution import finite_spread, log_density_of, ours, scaled
from wirebayes.numeric.distributions import Distribution, LogitNormal

KNOWN = {
    "Normal": stats.norm(0.5, 2.0),
    "HalfNormal": stats.halfnorm(0.1, 0.3),
    "HalfCauchy": stats.halfcauchy(0.0, 2.5),
    "LogNormal": stats.lognorm(1.2, scale=0.03),
    "Uniform": stats.uniform(-1.0, 3.0),
    "LogUniform": stats.loguniform(0.3, 6.0),
    "TruncatedNormal": stats.truncnorm(-3.0, np.inf, loc=0.0, scale=0.3),
    "TruncatedNormal, its upper tail": stats.truncnorm(1.5, np.inf, loc=1.0, scale=0.3),
    "TruncatedNormal, hardly": stats.truncnorm(-7.9, np.inf, loc=7.9, scale=1.0),
}
SHARES = np.concatenate([[0.0, 1e-12], np.linspace(0.01, 0.99, 99), [1.0 - 1e-12, 1.0]])
given = pytest.mark.parametrize(("name", "theirs"), KNOWN.items(), ids=list(KNOWN))


@given
def test_draws_are_those_of_scipy_to_the_last_bit(name, theirs):
    mine = ours(theirs)
    assert type(mine).__name__ == name.split(",")[0]
    drawn = mine.rvs(2000, random_state=np.random.default_rng(3))
    assert np.array_equal(drawn, theirs.rvs(size=2000, random_state=np.random.default_rng(3)))


@given
def test_a_seed_stands_for_a_generator(name, theirs):
    mine = ours(theirs)
    assert np.array_equal(mine.rvs(3, random_state=7), mine.rvs(3, random_state=np.random.default_rng(7)))
    assert np.isfinite(mine.rvs())


@given
def test_densities_quantiles_and_moments_are_those_of_scipy(name, theirs):
    mine = ours(theirs)
    x = np.concatenate([theirs.rvs(100, random_state=0), [-3.0, 0.0, 1e-12, 1.0, 7.0]])
    assert mine.support() == pytest.approx(theirs.support(), rel=1e-15)
    assert mine.logpdf(x) == pytest.approx(theirs.logpdf(x), rel=1e-12)
    assert mine.cdf(x) == pytest.approx(theirs.cdf(x), rel=1e-12, abs=1e-15)
    assert mine.ppf(SHARES) == pytest.approx(theirs.ppf(SHARES), rel=1e-12, abs=1e-15)
    moments = (mine.mean(), mine.std(), mine.median())
    assert moments == pytest.approx((theirs.mean(), theirs.std(), theirs.median()), rel=1e-12)


@given
def test_a_factor_scales_the_number_not_its_shares(name, theirs):
    assert scaled(theirs, 40.0).ppf(SHARES) == pytest.approx(40.0 * theirs.ppf(SHARES), rel=1e-12)


def test_a_share_whose_logit_is_normal():
    of = LogitNormal(-2.5, 1.2, 0.4)
    assert of.cdf(of.ppf(SHARES)) == pytest.approx(SHARES, rel=1e-12)
    logit = stats.norm(-2.5, 1.2)
    x = np.array([1e-3, 0.05, 0.39])
    share = x / 0.4
    expected = logit.logpdf(np.log(share / (1 - share))) - np.log(share * (1 - share)) - np.log(0.4)
    assert of.logpdf(x) == pytest.approx(expected, rel=1e-12)
    assert np.isneginf(of.logpdf([-0.1, 0.4, 0.5])).all()
    mean = integrate.quad(lambda q: of.ppf(q), 0.0, 1.0, epsabs=1e-13)[0]
    square = integrate.quad(lambda q: of.ppf(q) ** 2, 0.0, 1.0, epsabs=1e-13)[0]
    assert (of.mean(), of.std()) == pytest.approx((mean, np.sqrt(square - mean**2)), rel=1e-8)


@pytest.mark.parametrize("other", [stats.beta(1.0, 30.0), stats.lognorm(0.5, loc=1.0, scale=2.0), stats.halflogistic()])
def test_any_other_distribution_of_scipy_serves_as_it_is(other):
    assert ours(other) is other and not isinstance(other, Distribution)
    x = np.array([0.01, 0.3, 1.4, 9.0])
    assert log_density_of(other)(x) == pytest.approx(other.logpdf(x), rel=1e-15)
    assert scaled(other, 3.0).ppf(SHARES[1:-1]) == pytest.approx(3.0 * other.ppf(SHARES[1:-1]), rel=1e-12)


def test_a_spread_is_finite_where_the_standard_deviation_is_not():
    assert finite_spread(stats.norm(3.0, 2.0)) == pytest.approx(2.0)
    within = stats.halfcauchy(scale=2.5)
    low, high = within.ppf(stats.norm.cdf([-1.0, 1.0]))
    assert finite_spread(within) == pytest.approx(0.5 * (high - low))

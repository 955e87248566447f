"""One prior object for sampling, calibration and prediction agrees with scipy; a wrong table is named."""

import numpy as np
import pytest
from scipy import stats

from wirebayes.errors import InputError
from wirebayes.model.prior import PowerScaled, Prior, from_table, possible, wire_defaults
from wirebayes.model.scales import Scales
from wirebayes.numeric.any_distribution import log_density_of
from wirebayes.numeric.distributions import Normal, TruncatedNormal

SCALES = Scales(step_mm=0.5, range_mm=6.0, tension_N=4.0, hold_s=90.0, step_N=1.0)

FORMS = [
    stats.norm(0.5, 2.0),
    stats.halfnorm(0.0, 0.3),
    stats.lognorm(1.2, scale=0.03),
    stats.uniform(-1.0, 3.0),
    stats.beta(1.0, 30.0),
    stats.lognorm(0.5, loc=1.0, scale=2.0),
]


@pytest.mark.parametrize("form", FORMS)
def test_the_fast_density_is_scipy_s_inside_and_outside(form):
    x = np.concatenate([form.rvs(50, random_state=0), [-3.0, 0.0, 1e-12, 1.0, 7.0]])
    assert log_density_of(form)(x) == pytest.approx(form.logpdf(x), rel=1e-12)


def test_draws_quantiles_and_density_belong_to_one_distribution():
    prior = Prior(wire_defaults(1000.0, SCALES), {}, frozenset())
    draws = prior.rvs(4000, np.random.default_rng(0))
    for i, distribution in enumerate(prior.distributions.values()):
        # Kolmogorov-Smirnov at a level that eight tests together miss once in ten thousand
        assert stats.kstest(draws[:, i], distribution.cdf).pvalue > 1e-5
    cube = np.random.default_rng(1).uniform(size=(100, len(prior.names)))
    theta = prior.ppf(cube)
    for i, distribution in enumerate(prior.distributions.values()):
        assert distribution.cdf(theta[:, i]) == pytest.approx(cube[:, i], rel=1e-9)
    expected = sum(d.logpdf(theta[:, i]) for i, d in enumerate(prior.distributions.values()))
    assert prior.log_density()(theta) == pytest.approx(expected, rel=1e-12)


def test_the_stated_ranges_are_the_5_and_95_percent_points():
    stated = {
        "k1": (0.13, 18),
        "B": (0.013, 1.8),
        "U": (0.16, 1.6),
        "k2": (0.059, 8.3),
        "N": (0.31, 1.4),
        "preload": (-0.39, 0.59),
        "sensor_sd": (0.00025, 0.035),
        "setting_sd": (0.004, 0.16),
    }
    length, steps = 1000.0 / SCALES.range_mm, SCALES.range_mm / SCALES.step_mm
    unit = {"k1": length, "B": 0.5 * steps, "preload": steps}
    for name, distribution in wire_defaults(1000.0, SCALES).items():
        found = distribution.ppf([0.05, 0.95]) / unit.get(name, 1.0)
        assert found == pytest.approx(stated[name], rel=0.15), name


def test_a_setting_error_is_at_most_half_a_step():
    distribution = wire_defaults(1000.0, SCALES)["setting_sd"]
    assert distribution.support() == (0.0, 0.5)
    assert np.isneginf(log_density_of(distribution)(np.array([0.5, 0.6]))).all()
    weights = wire_defaults(1000.0, SCALES, "force")["setting_sd"]
    assert weights.support()[1] == 0.5 * SCALES.step_N / SCALES.tension_N


def test_a_power_makes_what_is_known_of_a_parameter_of_its_unit():
    """Creep at 4 N is log-normal, whatever U; B in mm N^-U is not."""
    free = {"B": stats.lognorm(0.5, scale=2.0), "U": stats.norm(1.0, 0.3)}
    prior = Prior(free, {}, frozenset(), {"B": PowerScaled("U", np.log(4.0))})
    theta = prior.rvs(4000, np.random.default_rng(0))
    creep = theta[:, 0] * 4.0 ** theta[:, 1]
    assert stats.kstest(creep, free["B"].cdf).pvalue > 1e-5
    expected = free["B"].logpdf(creep) + theta[:, 1] * np.log(4.0) + free["U"].logpdf(theta[:, 1])
    assert prior.log_density()(theta) == pytest.approx(expected, rel=1e-12)


def test_tables_become_distributions_and_fixed_values():
    made = from_table("prior.k1", {"distribution": "log-normal", "median": 700.0, "sd_log": 0.3})
    assert made.median() == pytest.approx(700.0)
    assert from_table("prior.N", {"fixed": 1}) == 1.0
    assert from_table("prior.U", {"distribution": "uniform", "low": 0.1, "high": 0.9}).support() == pytest.approx(
        (0.1, 0.9)
    )
    assert from_table("prior.p", {"distribution": "normal", "mean": 1.0, "sd": 2.0}).std() == pytest.approx(2.0)
    assert from_table("prior.p", {"distribution": "half-normal", "sd": 2.0}).support()[0] == 0.0


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (3.0, "expected a table"),
        ({}, "prior.k1.distribution: found no such key, expected one of normal"),
        ({"distribution": "gamma"}, "expected one of normal, half-normal, log-normal, uniform"),
        ({"distribution": "normal", "mean": 1.0}, "expected mean, sd of a normal distribution"),
        ({"distribution": "normal", "mean": 1.0, "sd": 1.0, "low": 0.0}, "expected mean, sd of a normal distribution"),
        ({"distribution": "normal", "mean": 1.0, "sd": 0.0}, "prior.k1.sd: found 0.0"),
        ({"distribution": "normal", "mean": "1", "sd": 1.0}, "prior.k1.mean: found '1'"),
        ({"distribution": "normal", "mean": True, "sd": 1.0}, "expected a finite number"),
        ({"distribution": "log-normal", "median": -1.0, "sd_log": 1.0}, "prior.k1.median"),
        ({"distribution": "uniform", "low": 1.0, "high": 1.0}, "above low = 1.0"),
        ({"fixed": float("nan")}, "prior.k1.fixed"),
    ],
)
def test_a_malformed_table_is_named_with_what_was_expected(table, message):
    with pytest.raises(InputError) as complaint:
        from_table("prior.k1", table)
    assert "prior.k1" in str(complaint.value)
    assert message in str(complaint.value)
    assert len(str(complaint.value).splitlines()) == 1


NORMAL = {"distribution": "normal", "sd": 0.01}


@pytest.mark.parametrize(
    ("name", "table", "message"),
    [
        ("k1", {"fixed": 0.0}, "prior.k1.fixed: found 0, expected a number above 0"),
        ("N", {"fixed": -1.0}, "prior.N.fixed: found -1, expected a number above 0"),
        ("B", {"fixed": -1.0}, "prior.B.fixed: found -1, expected 0 or more"),
        ("k2", {"distribution": "uniform", "low": -5.0, "high": 1.0}, "prior.k2.low: found -5, expected 0 or more"),
        ("setting_sd", NORMAL | {"mean": -1e-9}, "prior.setting_sd.mean: found -1e-09, expected 0 or more"),
    ],
)
def test_a_prior_of_what_is_never_negative_has_no_values_below_zero(name, table, message):
    with pytest.raises(InputError, match=message):
        possible(f"prior.{name}", name, from_table(f"prior.{name}", table))
    for free in ("preload", "U", "toe.w"):
        assert possible("prior", free, from_table("prior", NORMAL | {"mean": -3.0})).mean() == -3.0


@pytest.mark.parametrize("name", ["B", "k2", "sensor_sd"])
def test_nothing_creeps_and_nothing_errs_where_that_is_stated(name):
    assert possible(f"prior.{name}", name, from_table(f"prior.{name}", {"fixed": 0.0})) == 0.0


@pytest.mark.parametrize(("mean", "cut"), [(0.0, True), (0.01, True), (0.0799, True), (0.0801, False)])
def test_a_normal_prior_is_cut_off_at_zero_where_some_of_it_is_below(mean, cut):
    made = possible("prior.sensor_sd", "sensor_sd", from_table("prior.sensor_sd", NORMAL | {"mean": mean}))
    assert isinstance(made, TruncatedNormal if cut else Normal)
    x = np.linspace(-0.01, 0.2, 400)
    whole = stats.norm(mean, 0.01)
    expected = np.where(x >= 0, whole.logpdf(x) - whole.logsf(0.0), -np.inf)
    if cut:
        assert log_density_of(made)(x) == pytest.approx(expected, rel=1e-9)
        assert made.logpdf(x) == pytest.approx(expected, rel=1e-9)

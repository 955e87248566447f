"""Expected widths: those that the sampler finds, narrower for more readings, the same creep for other lengths."""

from dataclasses import replace

import numpy as np
import pytest

from tests.rescaled import rewritten
from wirebayes.inference.climb import climb
from wirebayes.inference.fit import fit_problem
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.inference.policy import Policy
from wirebayes.model.build import build
from wirebayes.model.problem import with_readings
from wirebayes.model.replicate import readings
from wirebayes.model.scales import Units
from wirebayes.model.spec import PLAIN_SPEC
from wirebayes.planning import widths
from wirebayes.planning.guessed_test import at_centre, middle_tension
from wirebayes.planning.widths import expected_widths
from wirebayes.simulation.synthetic import Bench

CENTRE = {
    "k1": 1500.0,
    "B": 0.3,
    "U": 0.6,
    "k2": 0.03,
    "N": 0.7,
    "preload": 0.5,
    "sensor_sd": 0.008,
    "setting_sd": 0.015,
}
RIDGE = Bench("ridge", displacements_mm=(0.5, 1.5, 3.0, 4.0, 5.0), times_s=(0.0, 15.0, 40.0))


def guess(n, spread=0.05):
    rng = np.random.default_rng(0)
    return {name: value * np.exp(spread * rng.normal(size=n)) for name, value in CENTRE.items()}


def planned(bench, n=16, **options):
    test = at_centre(bench.experiment(), guess(n), PLAIN_SPEC)
    return expected_widths(test, guess(n), np.random.default_rng(1), **options)


def planned_over_sampled(bench):
    """Lengths of 90 % intervals of one simulated test's posterior: as a plan finds them, and by the sampler."""
    test = at_centre(bench.experiment(), guess(5), PLAIN_SPEC)
    problem = build([test])
    theta = np.array([[CENTRE[name] for name in problem.names]])
    y = readings(problem, theta, problem.samples[0], np.random.default_rng(3))
    target = LogPosterior(problem)
    found = climb(target.rowwise([y])[0], target.coordinates.to_sampled(theta), iterations=40, tolerance=1e-3)
    draws, weight = widths._weighted(target, found.z, found.covariance, y, np.random.default_rng(4))
    ours = np.array([widths._row_widths(column[None], weight)[0, 1] for column in draws.T])
    policy = Policy(ensembles=2, walkers=64, ess=800, rounds=3, most_rounds=5, round_draws=2048, most_steps=200)
    low, high = np.quantile(fit_problem(with_readings(problem, [y]), 5, policy=policy).flat, [0.05, 0.95], axis=0)
    return ours / (high - low)


def test_a_bent_posterior_is_as_wide_as_the_sampler_finds_it():
    ratio = planned_over_sampled(RIDGE)
    # fifteen readings for eight parameters: tails are long, and each length is known to some 10 % on either side
    np.testing.assert_allclose(ratio, 1.0, atol=0.3)
    assert abs(np.log(ratio)).mean() < 0.1


def test_without_weights_it_would_not_be(monkeypatch):
    monkeypatch.setattr(widths, "_DRAWS", (3000,))

    def even(target, density, centre, covariance, k, rng):
        points, weight = one_round(target, density, centre, covariance, k, rng)
        return points, np.full_like(weight, 1.0 / k)

    one_round = widths._round
    monkeypatch.setattr(widths, "_round", even)
    assert abs(np.log(planned_over_sampled(RIDGE))).mean() > 0.2  # twice what is allowed


@pytest.mark.parametrize("by", [Units(256.0, 1.0, 1.0), Units(1.0, 1024.0, 1.0), Units(3.0, 700.0, 60.0)])
def test_what_a_test_teaches_does_not_depend_on_units(by):
    """The same wire and test in other lengths, tensions and times: as many bits, and widths that are as many times."""
    test, here = at_centre(RIDGE.experiment(), guess(8), PLAIN_SPEC), guess(8)
    length, tension, time = by.length_mm, by.tension_N, by.time_s
    units = {"k1": tension, "sensor_sd": tension, "preload": length, "setting_sd": length}
    units |= {"B": length * tension ** -here["U"], "k2": time ** -here["N"]}
    there = {name: values * units.get(name, 1.0) for name, values in here.items()}
    one = expected_widths(test, here, np.random.default_rng(1))
    other = expected_widths(rewritten(test, by), there, np.random.default_rng(1))
    assert other.information_bits == pytest.approx(one.information_bits, abs=1e-3)
    for name, factor in {"k1": tension, "preload": length, "U": 1.0, "creep_longest_hold_mm": length}.items():
        assert other.widths[name]["sd"] == pytest.approx(one.widths[name]["sd"] * factor, rel=1e-3)


def test_more_readings_and_longer_holds_teach_more():
    few = planned(Bench("few", times_s=(0.0, 60.0, 120.0)))
    many = planned(Bench("many", times_s=tuple(np.linspace(0, 120, 25))))
    assert many.widths["sensor_sd"]["sd"] < 0.5 * few.widths["sensor_sd"]["sd"]
    assert many.information_bits > few.information_bits
    long = planned(Bench("long", times_s=tuple(np.linspace(0, 1200, 25))))
    assert long.widths["B"]["sd"] < 0.7 * many.widths["B"]["sd"]
    assert long.information_bits > many.information_bits


def test_creep_is_stated_for_one_tension_and_length():
    bench = Bench("a", displacements_mm=(1, 2, 3, 4))
    test = at_centre(bench.experiment(), guess(5), PLAIN_SPEC)
    assert middle_tension(test) == pytest.approx(np.median([h.tension_N[0] for h in test.recorded_holds]))
    own, twice = planned(bench), planned(bench, length_mm=2000.0)
    ratio = twice.widths["creep_1h_mm"]["sd"] / own.widths["creep_1h_mm"]["sd"]
    assert ratio == pytest.approx(2.0)
    assert twice.widths["k1"] == own.widths["k1"]


def test_a_fixed_parameter_has_no_width_and_priors_of_the_fit_count():
    test = at_centre(RIDGE.experiment(), guess(20), PLAIN_SPEC)
    loose = expected_widths(test, guess(20), np.random.default_rng(1))
    fixed = replace(
        test, priors={"N": {"fixed": 0.7}, "k2": {"distribution": "log-normal", "median": 0.03, "sd_log": 0.01}}
    )
    tight = expected_widths(fixed, guess(20) | {"N": np.full(20, 0.7)}, np.random.default_rng(1))
    assert "N" not in tight.widths
    assert tight.widths["k2"]["sd"] < 0.1 * loose.widths["k2"]["sd"]


def test_the_same_seed_gives_the_same_widths_and_draws_are_kept():
    one, other = planned(RIDGE, kept_draws=2), planned(RIDGE, kept_draws=2)
    assert one.widths == other.widths
    assert [len(d["k1"]) for d in one.draws] == [widths._KEPT] * 2
    assert one.tests == 16


def test_truths_that_the_priors_exclude_are_left_out():
    test = at_centre(RIDGE.experiment(), guess(20), PLAIN_SPEC)
    never = replace(test, priors={"k1": {"distribution": "uniform", "low": 1.0, "high": 2.0}})
    with pytest.raises(ValueError, match="no simulated test could be fitted"):
        expected_widths(never, guess(20), np.random.default_rng(1))

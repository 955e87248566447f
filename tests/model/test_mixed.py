"""Steps and weights of one wire together: the wire is one, and each kind of test has its own instruments."""

from dataclasses import replace

import numpy as np
import pytest

import wirebayes as wb
from wirebayes.discovery.probes import forms
from wirebayes.discovery.screening import candidate_probes
from wirebayes.discovery.search import investigate
from wirebayes.discovery.settings import Settings
from wirebayes.effects import CATALOGUE, effect_named
from wirebayes.errors import InputError
from wirebayes.inference.laplace_fit import fitted
from wirebayes.io.arrays import from_arrays
from wirebayes.io.experiment import Experiment
from wirebayes.model.build import build
from wirebayes.model.column_units import unit_of_column
from wirebayes.model.spec import PLAIN_SPEC

TIMES = (0.0, 30.0, 60.0, 120.0)
STEPS, WEIGHTS = (1.0, 2.0, 3.0, 4.0, 5.0), (1.0, 2.0, 3.0, 4.0)
DRIFT_N, DRIFT_MM = 2e-4, -1e-4  # a second, of the cell and of the gauge
SENSOR_N, SENSOR_MM = 0.004, 0.004


def test_of(control: str, name: str, drift: float, seed: int) -> Experiment:
    """A wire of 1 m, k1 900 N, whose reading drifts; the model's own equations, written down again."""
    k1, B, U, k2, N, L = 900.0, 0.3, 0.9, 0.05, 0.8, 1000.0
    rng, e, start = np.random.default_rng(seed), 0.0, 0.0
    holds, x, t, read = [], [], [], []
    for j, value in enumerate(STEPS if control == "displacement" else WEIGHTS, start=1):
        tension = k1 * (value - e) / (L + e) if control == "displacement" else value
        goal = B * tension**U
        for time in TIMES:
            length = L + e + (goal - e) * -np.expm1(-k2 * time**N)
            true = k1 * ((L + value) / length - 1.0) if control == "displacement" else length * (1.0 + value / k1) - L
            noise = rng.normal(0.0, SENSOR_N if control == "displacement" else SENSOR_MM)
            holds.append(j), x.append(value), t.append(time), read.append(true + drift * (start + time) + noise)
        e += (goal - e) * -np.expm1(-k2 * TIMES[-1] ** N)
        start += TIMES[-1]
    displacement, tension = (x, read) if control == "displacement" else (read, x)
    return from_arrays(holds, displacement, t, tension, length_mm=L, name=name, material="line", control=control)


test_of.__test__ = False  # type: ignore[attr-defined]


@pytest.fixture(scope="module")
def pair() -> list[Experiment]:
    return [test_of("displacement", "steps", DRIFT_N, 1), test_of("force", "hung", DRIFT_MM, 2)]


def test_an_instrument_belongs_to_the_tests_that_it_reads(pair):
    problem = build([*pair, test_of("force", "again", 0.0, 3)], [effect_named("sensor_drift"), effect_named("toe")])
    of_effects = [name for name in problem.names if "." in name]
    assert of_effects == ["toe.w", "sensor_drift.a[displacement]", "sensor_drift.a[force]"]
    assert [problem.column("sensor_drift.a", s) for s in problem.samples] == [
        "sensor_drift.a[displacement]",
        "sensor_drift.a[force]",
        "sensor_drift.a[force]",
    ]
    units = [unit_of_column(f"sensor_drift.a[{c}]", problem.samples) for c in ("displacement", "force")]
    assert units == ["N/s", "mm/s"]


def test_tests_of_one_kind_share_the_amplitude_as_before(pair):
    names = build([pair[0], test_of("displacement", "more", 0.0, 4)], [effect_named("sensor_drift")]).names
    assert "sensor_drift.a" in names


def test_the_likelihood_is_that_of_each_test_with_its_own_drift(pair):
    effect = effect_named("sensor_drift")
    both, alone = build(pair, [effect]), [build([test], [effect]) for test in pair]
    theta = both.prior.rvs(20, np.random.default_rng(0))
    columns = dict(zip(both.names, theta.T, strict=True))
    expected = np.zeros(20)
    for one, sample in zip(alone, both.samples, strict=True):
        own = np.column_stack([columns[both.column(name, sample)] for name in one.names])
        expected += one.log_likelihood(own)
    assert both.log_likelihood(theta) == pytest.approx(expected, rel=1e-12)


def test_an_effect_of_one_kind_of_test_is_in_no_other(pair):
    gauge = effect_named("sensor_drift@force")
    problem = build(pair, [gauge])
    assert [name for name in problem.names if "." in name] == ["sensor_drift.a[force]"]
    assert [[e.key for e in s.model.effects] for s in problem.samples] == [[], ["sensor_drift@force"]]
    assert (gauge.key, gauge.acts_on("hung", "force"), gauge.acts_on("steps", "displacement")) == (
        "sensor_drift@force",
        True,
        False,
    )
    with pytest.raises(InputError, match="toe takes no '@'"):  # the wire is the same under both
        effect_named("toe@force")


def test_a_search_looks_for_the_fault_of_each_instrument_apart(pair):
    block = fitted(pair, (), PLAIN_SPEC, np.random.default_rng(0))
    kinds = {name: CATALOGUE[name] for name in ("sensor_drift", "toe")}
    trials, candidates = candidate_probes([block], kinds)
    assert all(c.blocks == (0,) and c.shared for c in candidates)
    of_key = {trial.effect.key: k for k, trial in enumerate(trials)}
    seen = forms(block.target, block.z, trials)
    assert {key: [bool(np.any(shape[..., k])) for shape in seen] for key, k in of_key.items()} == {
        "toe": [True, True],
        "sensor_drift@displacement": [True, False],
        "sensor_drift@force": [False, True],
    }
    units = {key: block.unit(trials[k].effect) for key, k in of_key.items()}
    assert units == {"toe": "mm", "sensor_drift@displacement": "N/s", "sensor_drift@force": "mm/s"}


def test_tests_of_one_kind_are_searched_as_one(pair):
    block = fitted(pair[:1], (), PLAIN_SPEC, np.random.default_rng(0))
    trials, _ = candidate_probes([block], {"sensor_drift": CATALOGUE["sensor_drift"]})
    assert [t.effect.key for t in trials] == ["sensor_drift"]


@pytest.mark.slow
def test_a_gauge_that_drifts_is_named_where_it_reads():
    tests = [test_of("displacement", "steps", 0.0, 1), test_of("force", "hung", 8.0 * DRIFT_MM, 2)]
    steps, hung = investigate(tests, Settings(simulations=199)).report["experiments"].values()
    assert (hung["verdict"], hung["effects"]) == ("named", ["sensor_drift"])
    size = hung["amplitudes"]["sensor_drift"]
    assert size["unit"] == "mm/s" and size["q05"] < 8.0 * DRIFT_MM < size["q95"]
    assert steps["amplitudes"] == {}


@pytest.mark.slow
def test_both_drifts_and_the_wire_are_found_together(pair):
    few = wb.Policy(walkers=64, ess=1000.0)
    found = wb.fit(pair, together="line", effects=["sensor_drift"], check=False, policy=few).summary()
    assert found["converged"]
    for name, truth, unit in (
        ("sensor_drift.a[steps]", DRIFT_N, "N/s"),
        ("sensor_drift.a[hung]", DRIFT_MM, "mm/s"),
        ("k1", 900.0, "N"),
    ):
        one = found["parameters"][name]
        assert one["unit"] == unit and abs(one["mean"] - truth) < 3.0 * one["sd"]


def test_a_prior_in_one_file_is_of_its_own_instrument(pair):
    stated = replace(pair[1], priors={"sensor_drift.a": {"fixed": 0.0}})
    problem = build([pair[0], stated], [effect_named("sensor_drift")])
    assert "sensor_drift.a[displacement]" in problem.names and problem.prior.fixed == {"sensor_drift.a[force]": 0.0}

"""The same test in other units has the same answer: nothing in the toolkit has a scale of its own."""

from dataclasses import replace

import numpy as np
import pytest

from tests.rescaled import FACTORS, KINDS, drawn, factors, rewritten
from wirebayes.inference.fit import fit_problem
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.inference.policy import Policy
from wirebayes.io.arrays import from_arrays
from wirebayes.io.experiment import Experiment
from wirebayes.model.build import build
from wirebayes.model.scales import NATURAL, Units, scales_of
from wirebayes.numeric.means import geometric_mean
from wirebayes.simulation.synthetic import Bench, Truth, draw


def simulated(seed: int, names: tuple[str, ...] = ("a",)) -> list[Experiment]:
    """Steps up and down with readings of their own and rests, samples of different lengths."""
    rng = np.random.default_rng(seed)
    benches = [
        Bench(
            name,
            length_mm=700.0 + 300.0 * i,
            resolution_N=0.0,
            displacements_mm=(1, 2.5, 3, 4, 6, 5.0, 7.5),
            times_s=[[0.0, 20.0 + j, 75.0] for j in range(7)],
        )
        for i, name in enumerate(names)
    ]
    made = draw(benches, Truth({"k1": 900.0, "sensor_sd": 0.01, "setting_sd": 0.03, "preload": 0.5}), seed)
    return [
        from_arrays(
            [n for n in sample.protocol.number for _ in range(4)],
            [x for x in sample.protocol.setting for _ in range(4)],
            [t for row in sample.protocol.time_s for t in (*row, row[-1] + 15.0)],
            [y for row in sample.readings[..., 0] for y in (*row, np.nan)],
            length_mm=sample.protocol.length_mm,
            name=sample.name,
            material="line",
            resolution_N=0.01 * rng.uniform(),
        )
        for sample in made.problem.samples
    ]


def under_weights(seed: int) -> list[Experiment]:
    rng = np.random.default_rng(seed)
    holds, x, t, y, carried = [], [], [], [], 0.0
    for j, weight in enumerate((1.0, 2.0, 4.0, 3.0, 5.0)):
        times = np.array([0.0, 10.0, 60.0, 200.0])
        crept = carried + (0.08 * weight**0.9 - carried) * (1.0 - np.exp(-0.05 * times**0.7))
        read = (1000.0 + crept) * (1.0 + weight / 800.0) - 1000.3 + 0.005 * rng.normal(size=4)
        holds += [j + 1] * 4
        x += read.tolist()
        t += times.tolist()
        y += [weight] * 4
        carried = crept[-1]
    return [from_arrays(holds, x, t, y, length_mm=1000.0, name="w", material="line", control="force")]


NUMBER, FEW = 48, 15
LIKELIHOODS = ("chain", "hold")
UNIT = {"tension": "tension_N", "length": "length_mm", "time": "time_s"}
HASTY = Policy(ensembles=2, walkers=32, ess=100, rounds=2, most_rounds=2, round_draws=512, most_steps=32)
EVERY = [pytest.param(index, marks=[pytest.mark.slow] if index >= FEW else []) for index in range(NUMBER)]


def test_the_drawn_tests_are_of_every_kind():
    made = [drawn(index) for index in range(NUMBER)]
    assert {(d.kind, d.likelihood) for d in made} == {
        (kind, likelihood) for kind in KINDS for likelihood in LIKELIHOODS
    }
    assert {(d.kind, d.rests) for d in made} == {(kind, rests) for kind in KINDS for rests in (True, False)}
    assert len({effect.name for d in made for effect in d.effects}) > 15
    for name, (low, high) in FACTORS.items():
        reached = [np.log10(getattr(factors(i, powers_of_two=False), UNIT[name])) for i in range(NUMBER)]
        assert min(reached) < low + 1.0 and max(reached) > high - 1.0


@pytest.mark.parametrize("index", EVERY)
def test_for_powers_of_two_the_problem_in_its_own_units_has_the_same_bits(index):
    case = drawn(index)
    one, other = (case.problem(by) for by in (NATURAL, factors(index, powers_of_two=True)))
    one, other = one.in_units(one.own_units), other.in_units(other.own_units)
    for a, b in zip(one.samples, other.samples, strict=True):
        for field in ("length_mm", "setting", "time_s", "mask", "duration_s"):
            np.testing.assert_array_equal(getattr(a.protocol, field), getattr(b.protocol, field))
        np.testing.assert_array_equal(a.readings, b.readings)
        assert a.resolution == b.resolution and a.model == b.model
    z = LogPosterior(one).coordinates.to_sampled(one.prior.rvs(50, np.random.default_rng(0)))
    np.testing.assert_array_equal(LogPosterior(one)(z), LogPosterior(other)(z))


@pytest.mark.parametrize("index", EVERY)
def test_for_other_factors_the_log_posterior_is_the_same_at_mapped_parameters(index):
    case = drawn(index)
    one, other = (case.problem(by) for by in (NATURAL, factors(index, powers_of_two=False)))
    one, other = one.in_units(one.own_units), other.in_units(other.own_units)
    theta = one.prior.rvs(100, np.random.default_rng(0))
    for a, b in ((one, other), (one, one.in_units(NATURAL).in_units(one.units))):
        target, again = LogPosterior(a), LogPosterior(b)
        value = target(target.coordinates.to_sampled(theta))
        mapped = again(again.coordinates.to_sampled(theta))
        np.testing.assert_allclose(mapped, value, rtol=1e-6, atol=1e-9)  # squares of a million errors are among them


@pytest.mark.parametrize("index", [1, 4, *(pytest.param(index, marks=pytest.mark.slow) for index in range(5, NUMBER))])
def test_for_powers_of_two_the_draws_are_the_same_to_the_last_bit(index):
    case, by = drawn(index), factors(index, powers_of_two=True)
    one, other = (fit_problem(case.problem(units), 3, policy=HASTY).chains for units in (NATURAL, by))
    np.testing.assert_array_equal(one.z, other.z)
    assert one.evaluations == other.evaluations


@pytest.mark.parametrize("index", [0, 2])
def test_a_start_in_other_units_leads_to_the_same_draws(index):
    """A start is converted from what a search found, which changes its last digits."""
    problem = drawn(index).problem()
    first = fit_problem(problem, 3, policy=HASTY)
    best = first.flat[np.argmax(first.log_density)]
    starts = [dict(zip(problem.names, best * (1.0 + change), strict=True)) for change in (0.0, 1e-15, -1e-15)]
    one, *others = (fit_problem(problem, 4, policy=HASTY, near=start).chains.z for start in starts)
    for other in others:
        np.testing.assert_array_equal(one, other)


def draws(case, by, policy):
    """Parameters of a fit of the tests in other units, each in the units that the tests have of their own."""
    problem = case.problem(by)
    z = fit_problem(problem, 3, policy=policy).chains.z
    target = LogPosterior(problem.in_units(problem.own_units))
    return target.coordinates.to_natural(z.reshape(-1, z.shape[-1]))


@pytest.mark.slow
@pytest.mark.parametrize("index", range(FEW))
def test_for_other_factors_means_and_quantiles_are_the_same(index):
    """Means within a tenth of a standard deviation; quantiles hold the same share, to five of its standard errors."""
    case, effective = drawn(index), 8000.0
    policy = Policy(ess=effective)
    one, other = (draws(case, by, policy) for by in (NATURAL, factors(index, powers_of_two=False)))
    np.testing.assert_array_less(np.abs(other.mean(axis=0) - one.mean(axis=0)), 0.1 * one.std(axis=0))
    for level in (0.05, 0.5, 0.95):
        share = (other <= np.quantile(one, level, axis=0)).mean(axis=0)
        error = np.sqrt(2.0 * level * (1.0 - level) / effective)
        np.testing.assert_array_less(np.abs(share - level), 5.0 * error)


def test_a_fit_in_other_units_has_the_same_draws():
    (experiment,) = simulated(7)
    by = Units(2.0**7, 2.0**-10, 2.0**6)
    one, other = (fit_problem(build([e]), 3, policy=HASTY) for e in (experiment, rewritten(experiment, by)))
    U, N = (one.flat[:, one.problem.names.index(name)] for name in ("U", "N"))
    units = {
        "k1": by.tension_N,
        "B": by.length_mm * by.tension_N**-U,
        "U": 1.0,
        "k2": by.time_s**-N,
        "N": 1.0,
        "preload": by.length_mm,
        "sensor_sd": by.tension_N,
        "setting_sd": by.length_mm,
    }
    for i, name in enumerate(one.problem.names):
        np.testing.assert_allclose(other.flat[:, i], one.flat[:, i] * units[name], rtol=1e-12)


def test_scales_are_those_of_the_test():
    (experiment,) = simulated(1)
    found = scales_of([experiment])
    assert (found.step_mm, found.range_mm, found.hold_s) == (1.25, 7.5, 90.0)
    weights = scales_of(under_weights(5))
    assert (weights.tension_N, weights.step_N, weights.hold_s) == (3.0, 1.5, 200.0)


def shifted(experiment: Experiment, by_mm: float) -> Experiment:
    """The same test under weights, read on a gauge with another zero."""
    holds = [replace(hold, readings=hold.readings + by_mm) for hold in experiment.holds]
    return replace(experiment, holds=tuple(holds))


@pytest.mark.parametrize("by_mm", [520.0, -30.0])
@pytest.mark.parametrize("holds", [1, 2, 5])
def test_under_weights_the_zero_of_the_gauge_moves_the_preload_and_nothing_else(by_mm, holds):
    experiment = under_weights(8)[0].first(holds)
    one, other = build([experiment]), build([shifted(experiment, by_mm)])
    assert other.units.length_mm == one.units.length_mm
    np.testing.assert_allclose(other.scales.range_mm, one.scales.range_mm, rtol=1e-9)
    theta = one.prior.rvs(200, np.random.default_rng(0))
    moved = theta.copy()
    moved[:, one.names.index("preload")] -= by_mm
    np.testing.assert_allclose(other.prior.log_density()(moved), one.prior.log_density()(theta), rtol=1e-6)
    np.testing.assert_allclose(other.log_likelihood(moved), one.log_likelihood(theta), rtol=1e-6)


def test_under_weights_the_range_reaches_from_the_wire_without_tension():
    holds, weights, x = [1] * 3 + [2] * 3, [4.0] * 3 + [8.0] * 3, [14.0, 14.0, 14.1, 18.0, 18.0, 18.1]
    times = [0.0, 1.0, 2.0] * 2
    tested = from_arrays(holds, x, times, weights, length_mm=1000.0, name="w", material="line", control="force")
    found = scales_of([tested])
    assert found.range_mm == pytest.approx(8.2) and found.zeros_mm["w"] == pytest.approx(9.9)
    single = scales_of([tested.first(1)])  # creep of .1 mm is taken for a tenth of the stretch
    assert single.range_mm == pytest.approx(1.0) == single.step_mm


def test_under_weights_holds_that_begin_alike_have_no_step_of_their_own():
    """A coarse gauge: where it stands is not how far it moves."""
    times, x = [0.0, 1.0, 2.0] * 2, [12.0, 12.0, 12.5, 12.0, 12.5, 12.5]
    made = from_arrays(
        [1] * 3 + [2] * 3, x, times, [4.0] * 3 + [4.1] * 3, length_mm=1e3, name="w", material="m", control="force"
    )
    assert scales_of([made]).step_mm == scales_of([made]).range_mm == scales_of([shifted(made, 300.0)]).step_mm


def test_under_weights_a_weight_that_stays_on_is_no_step():
    """Each weight is read in three holds one after the other; between them the wire creeps by a tenth of a mm."""
    holds = np.repeat(np.arange(1, 10), 2).tolist()
    weights = np.repeat([4.0, 8.0, 12.0], 6).tolist()
    x = [14.0, 14.1, 14.1, 14.2, 14.2, 14.3, 18.0, 18.1, 18.1, 18.2, 18.2, 18.3, 22.0, 22.1, 22.1, 22.2, 22.2, 22.3]
    times = [0.0, 60.0] * 9
    cut = from_arrays(holds, x, times, weights, length_mm=1000.0, name="w", material="line", control="force")
    assert scales_of([cut]).step_mm == pytest.approx(3.8)
    assert scales_of([cut.first(3)]).step_mm == scales_of([cut.first(3)]).range_mm


@pytest.mark.parametrize("factor", [2.0**-30, 2.0**7])
def test_a_geometric_mean_is_multiplied_to_the_last_bit(factor):
    values = [0.3, 7.0, 11.3]
    assert geometric_mean(values) == pytest.approx(np.exp(np.mean(np.log(values))), rel=1e-15)
    assert geometric_mean([factor * v for v in values]) == factor * geometric_mean(values)

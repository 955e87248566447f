"""Climbs: steps by residuals and by differences, and where they end; a search finds what matters; rows far apart."""

from dataclasses import replace

import numpy as np
import pytest

from tests.statistical.targets import Silent
from wirebayes.effects import effect_named
from wirebayes.inference import climb as climbing
from wirebayes.inference import modes
from wirebayes.inference.climb import climb
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.inference.modes import search
from wirebayes.inference.optimum import Ends, Optimum
from wirebayes.inference.weighted_posterior import witnessed
from wirebayes.io.paper import experiments
from wirebayes.model.build import build
from wirebayes.model.linear_amplitudes import integrated
from wirebayes.model.problem import with_readings
from wirebayes.model.spec import ModelSpec
from wirebayes.numeric.spread_rows import spread_rows
from wirebayes.prediction.left_out_density import without_hold
from wirebayes.simulation.synthetic import Bench, Truth, draw


def test_rows_are_spread_and_never_repeated():
    x = np.repeat(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 5.0]]), 4, axis=0)
    for wanted, found in ((2, 2), (3, 3), (5, 3)):
        rows = spread_rows(x, wanted, np.random.default_rng(wanted))
        assert len(rows) == found == len(np.unique(x[rows], axis=0))


def simulated(*effects, likelihood="chain"):
    made = draw([Bench()], Truth({"k1": 900.0, "B": 0.4, "U": 0.7, "k2": 0.03, "N": 0.6}), seed=4)
    problem = build([Bench().experiment()], [effect_named(e) for e in effects], spec=ModelSpec(likelihood=likelihood))
    return LogPosterior(integrated(with_readings(problem, [s.readings for s in made.problem.samples])))


@pytest.mark.parametrize(
    "effects, likelihood", [((), "chain"), ((), "hold"), (("toe",), "chain"), (("sensor_drift",), "chain")]
)
def test_residuals_and_differences_lead_to_the_same_place(effects, likelihood):
    """From the same starts, one of them far out; where both end, value and curvature agree."""
    target = simulated(*effects, likelihood=likelihood)
    density, residuals = target.rowwise()
    begin = target.coordinates.to_sampled(target.problem.prior.rvs(400, np.random.default_rng(1)))
    value = density(begin, np.arange(len(begin)))
    assert residuals(begin, np.arange(len(begin)))[0] == pytest.approx(value, rel=1e-9)
    highest = np.argsort(-value)[[0, 1, 100]]
    found, cost = [], []
    for how in (residuals, None):
        before = target.evaluations
        found.append(climb(density, begin[highest], how, iterations=200))
        cost.append(target.evaluations - before)
    best, other = (f.z[np.argmax(f.log_density)] for f in found)
    assert found[0].converged.any() and density(best[None], [0]) == pytest.approx(density(other[None], [0]), abs=1e-3)
    if np.abs(best - other).max() < 1e-2:
        ends = [f.curvature[np.argmax(f.log_density)] for f in found]
        assert np.diag(ends[0]) == pytest.approx(np.diag(ends[1]), rel=0.05)
    assert cost[0] < cost[1]


def test_every_row_climbs_with_its_own_readings():
    target = simulated()
    [measured] = [s.readings for s in target.problem.samples]
    readings = np.concatenate([measured, 1.1 * measured], axis=-1)
    density, residuals = target.rowwise([readings])
    start = np.repeat(target.coordinates.to_sampled(target.problem.prior.rvs(1, np.random.default_rng(0))), 2, axis=0)
    together = climb(density, start, residuals, tolerance=1e-9)
    for row in range(2):
        alone = climb(*_only(target, readings[..., [row]], start[[row]]), tolerance=1e-9)
        assert together.log_density[row] == pytest.approx(alone.log_density[0], abs=1e-5)
    assert together.log_density[0] != pytest.approx(together.log_density[1], abs=0.1)


def _only(target, readings, start):
    density, residuals = target.rowwise([readings])
    return density, start, residuals


def misled(factor):
    """-x²/2, whose residuals promise a step that many times too long."""

    def density(x, rows):
        return -0.5 * (x**2).sum(axis=1)

    return density, lambda x, rows: (density(x, rows), x.T / np.sqrt(factor))


@pytest.mark.parametrize("factor, after", [(1.0, 0.0), (1.7, -0.7), (1.8, 1.0 - 1.8 / 2.8), (5.0, 1.0 - 5.0 / 6.0)])
def test_a_step_is_taken_that_gains_a_quarter_of_its_promise(factor, after):
    """The gain over the promise is 2 - factor; else the best of several damped steps is taken, here the first."""
    density, residuals = misled(factor)
    found = climb(density, np.array([[0.3]]), residuals, iterations=2, curvature_at_end=False)
    assert found.z[0, 0] == pytest.approx(0.3 * after, abs=1e-6)


def test_damping_outlasts_the_step_that_needed_it_and_then_fades():
    """The place of a damped step is looked at anew; the next step is damped as well, the one after it no longer."""
    density, residuals = misled(1.8)
    several = []

    def counted(x, rows):
        several.append(len(x))
        return density(x, rows)

    places = []
    for iterations in range(1, 6):
        several.clear()
        found = climb(counted, np.array([[0.3]]), residuals, iterations=iterations, curvature_at_end=False)
        places.append((found.z[0, 0] / 0.3, len(several)))
    left = 1.0 - 1.8 / 2.8
    for (found, cost), (place, times) in zip(
        places, [(1, 0), (left, 1), (left, 1), (left**2, 1), (left**3, 2)], strict=True
    ):
        assert found == pytest.approx(place, abs=1e-6) and cost == times


@pytest.mark.parametrize("behind, given_up", [(19.5, False), (20.5, True)])
def test_a_row_is_given_up_that_lies_behind_by_more_than_it_may_gain(behind, given_up):
    """The other row is at the top; this one promises a nat, ten of which, and ten more, may be missing."""
    start = np.array([[0.0], [np.sqrt(2.0)]])

    def density(x, rows):
        return -0.5 * (x**2).sum(axis=1) - np.where(rows == 1, behind - 1.0, 0.0)

    found = climb(density, start, lambda x, rows: (density(x, rows), x.T), reach=10.0)
    assert np.isinf(found.log_density[1]) == given_up and found.converged[1] != given_up


def test_a_step_out_of_the_support_is_shortened_and_a_start_outside_is_left():
    def density(x, rows):
        return np.where(np.abs(x[:, 0]) < 1.0, np.log(np.maximum(1.0 - x[:, 0] ** 2, 1e-300)), -np.inf)

    start = np.array([[0.9], [1.5]])
    found = climb(density, start, lambda x, rows: (density(x, rows), 0.1 * x.T), tolerance=1e-8, iterations=500)
    assert found.z[:, 0] == pytest.approx([0.0, 1.5], abs=1e-3)
    assert found.converged.tolist() == [True, False] and np.isfinite(found.log_density).tolist() == [True, False]


@pytest.mark.parametrize("tolerance, converged", [(0.011, True), (0.009, False)])
def test_a_climb_ends_where_half_the_squared_decrement_is_below_the_tolerance(tolerance, converged):
    density, residuals = misled(1.0)
    start = np.array([[np.sqrt(0.02)]])
    found = climb(density, start, residuals, iterations=1, tolerance=tolerance)
    assert found.converged[0] == converged and found.z[0, 0] == start[0, 0]


def test_the_curvature_at_the_end_is_that_of_the_density_whatever_the_residuals_say():
    density, residuals = misled(1.5)
    start = np.array([[0.5, -0.2]])
    assert climb(density, start, residuals).curvature[0] == pytest.approx(np.eye(2), abs=1e-5)
    rough = climb(density, start, residuals, curvature_at_end=False).curvature[0]
    assert rough == pytest.approx(np.eye(2) / 1.5, abs=1e-5)


@pytest.mark.parametrize("effects", [(), ("toe", "thermal_expansion", "superposition", "clamp_transient")])
def test_the_residuals_of_the_prior_have_its_curvature(effects):
    """At the middle of the prior, where no residual is left to bend."""
    built = build([Bench().experiment()], [effect_named(e) for e in effects])
    built = built.in_units(built.own_units)
    target = LogPosterior(Silent(built.samples, built.prior, built.likelihood))
    density, residuals = target.rowwise()
    middle = np.array([[d.median() for d in built.prior.distributions.values()]])
    z = target.coordinates.to_sampled(middle)
    found = climb(density, z, residuals, tolerance=1e-10)
    assert found.converged[0] and np.abs(found.z - z).max() < 1e-3
    slopes = [residuals(z + m, [0])[1] - residuals(z - m, [0])[1] for m in 1e-5 * np.eye(z.shape[1])]
    slopes = np.hstack(slopes) / 2e-5
    assert slopes.T @ slopes == pytest.approx(found.curvature[0], rel=2e-3, abs=2e-3)


def _one_time_constant(data):
    """Fitted to a wire with a toe, what explains the residuals may be the setting errors or the sensor's noise."""
    if data == "nylon":
        experiment = next(e for e in experiments() if e.name == "nylon-1.5m")
        problem = build([experiment])
        return replace(problem, prior=_with_n_fixed(problem.prior))
    bench = Bench(length_mm=1500.0)
    truth = {"k1": 1550.0, "B": 0.56, "U": 1.1, "k2": 0.032, "N": 0.58, "toe.w": 2.85, "preload": 3.2}
    made = draw(
        [bench], Truth(truth | {"setting_sd": 0.015, "sensor_sd": 0.0057}, effects=(effect_named("toe"),)), seed=data
    )
    problem = build([bench.experiment()])
    seen = with_readings(problem, [s.readings for s in made.problem.samples])
    return replace(seen, prior=_with_n_fixed(seen.prior))


def _with_n_fixed(prior):
    free = {name: d for name, d in prior.distributions.items() if name != "N"}
    return replace(prior, distributions=free, fixed=prior.fixed | {"N": 1.0}, logarithmic=prior.logarithmic - {"N"})


@pytest.mark.parametrize("data", [0, 1, 3])
def test_a_search_finds_the_mode_with_most_of_the_mass(data):
    """Which one that is, hundreds of climbs from prior draws tell; a third of them end elsewhere."""
    target = LogPosterior(integrated(_one_time_constant(data)))
    density, residuals = target.rowwise()
    start = target.coordinates.to_sampled(target.problem.prior.rvs(400, np.random.default_rng(0)))
    ended = climb(density, start[np.isfinite(target(start))], residuals, curvature_at_end=False)
    there = ended.log_density > ended.log_density.max() - 0.1
    assert there.mean() < 0.8
    before = target.evaluations
    found = [search(target, np.random.default_rng(seed)).modes.log_density[0] for seed in range(5)]
    # of five climbs by luck all would end there in one case of six
    assert (np.array(found) > ended.log_density.max() - 0.01).all()
    assert target.evaluations - before < 5 * 12_000


def alone(target):
    return modes._SideBySide(target, 1, None)


def test_with_a_ratio_kept_starts_are_led_to_it_and_without_noises_they_stay():
    target = simulated()
    start = target.coordinates.to_sampled(target.problem.prior.rvs(6, np.random.default_rng(3)))
    [led] = alone(target).with_ratios([start])
    [pair] = target.coordinates.noises
    ratio = (led[:, pair.setting] - led[:, pair.sensor] - pair.middle) / pair.spread
    assert ratio == pytest.approx(np.tile([1.3, -1.3, 0.0], 2))
    assert (target(led) > target(start)).all()
    holds = simulated(likelihood="hold")
    begin = holds.coordinates.to_sampled(holds.problem.prior.rvs(6, np.random.default_rng(3)))
    assert holds.coordinates.noises == () and alone(holds).with_ratios([begin])[0] is begin


@pytest.mark.parametrize(
    "likelihood, fixed", [("chain", ()), ("hold", ()), ("chain", ("sensor_sd",)), ("chain", "both")]
)
def test_further_climbs_begin_with_the_noises_held_near_those_of_the_best_mode(likelihood, fixed, monkeypatch):
    """Setting errors e³ times larger, the sensor's noise e times smaller, whichever of the two are not fixed.

    No derivative is taken by these, for it would say nothing.
    """
    target = simulated(likelihood=likelihood)
    if fixed:
        named_so = ("sensor_sd", "setting_sd") if fixed == "both" else fixed
        prior = target.problem.prior
        free = {name: d for name, d in prior.distributions.items() if name not in named_so}
        prior = replace(
            prior,
            distributions=free,
            fixed=prior.fixed | dict.fromkeys(named_so, 0.02),
            logarithmic=prior.logarithmic - set(named_so),
        )
        target = LogPosterior(replace(target.problem, prior=prior))
    names = target.problem.names
    one = alone(target)
    found = one.climbed([modes._prior(target, 3, np.random.default_rng(1))], [])
    begun = []
    monkeypatch.setattr(one, "climbed", lambda begin, before: begun.extend(begin) or found)
    by, look = [], climbing._by_residuals
    monkeypatch.setattr(climbing, "_by_residuals", lambda of, z, *more: by.append(z.shape[1]) or look(of, z, *more))
    begin = modes._prior(target, 20, np.random.default_rng(2))
    assert one.further(found, [begin])[0].z == pytest.approx(found[0].z)
    best = found[0].z[np.argmax(found[0].log_evidence)]
    for name, shift in (("setting_sd", 3.0), ("sensor_sd", -1.0)):
        if name in names:
            assert begun[0][:, names.index(name)] == pytest.approx(best[names.index(name)] + shift)
    if fixed == "both":
        assert begun[0] is begin
    else:
        assert 0 < len(begun[0]) < 20  # those that come to the same place go on as one
        assert set(by) == {len(names) - len({"sensor_sd", "setting_sd"} & set(names))}


@pytest.mark.parametrize(
    "wire, effects, history, hold, place, least",
    [
        (2, (), "additive", 1, [1689.0, 1.168, 0.338, 0.016, 0.52, -0.636, 0.005, 0.579], 6),
        (3, ("steady_creep",), "saturating", 0, [6098.0, 1.059, 0.646, 0.139, 0.404, 8e-5, 0.912, 0.0236, 0.18], 4),
    ],
)
def test_a_search_finds_a_narrow_mode_that_matters_where_a_hold_is_left_out(wire, effects, history, hold, place, least):
    """Without the kite line's first hold, steady creep has a mode of most of the mass that a hundredth of climbs from
    prior draws reach; nylon's additive creep, without its second, one that climbs with the noises free often miss.
    A climb from near that mode tells how high it is."""
    whole = experiments()[wire]
    problem = build(
        [whole.train(len(whole.recorded_holds))],
        [effect_named(key) for key in effects],
        spec=ModelSpec(history=history),
    )
    [sample] = problem.samples
    target = LogPosterior(integrated(without_hold(problem, 0, int(np.flatnonzero(sample.protocol.recorded)[hold]))))
    there = climb(target.rowwise()[0], target.coordinates.to_sampled(np.array([place])), target.rowwise()[1])
    found = [modes.searches(target, np.random.default_rng(seed), 1, starts=72)[0] for seed in range(6)]
    assert sum(f.log_evidence.max() > there.log_evidence[0] - 0.1 for f in found) >= least


def test_starts_are_spread_over_rates_and_powers_of_creep():
    """Nine starts: every pair of slow, middle and fast with a small, middle and large power."""
    target = simulated()
    z = target.coordinates.to_sampled(target.problem.prior.rvs(1000, np.random.default_rng(3)))
    chosen = modes._spread(target, z, 9, np.random.default_rng(0))
    [rate], [power] = target.coordinates.kinds_of_creep
    rank = np.stack([np.searchsorted(np.sort(z[:, i]), chosen[:, i]) / len(z) for i in (rate, power)], axis=1)
    level = np.select([rank < 0.25, rank > 0.75], [0, 2], 1)
    assert len({tuple(pair) for pair in level}) == 9 and (level[:3, 0] == 0).all() and (level[3:6, 0] == 2).all()


def quartic(evaluated):
    """A hill whose curvature vanishes at its top; `evaluated` gets the number of points of every call."""

    def density(z, rows):
        evaluated.append(len(z))
        return -0.5 * (z**2).sum(axis=1) ** 2

    return density


def test_a_climb_is_given_up_where_a_mode_is_known_and_no_other_with_it():
    start, known = (
        np.array([[3.0, 3.0], [-3.0, 3.0]]),
        Optimum(*(np.zeros((1, 2)), np.zeros(1), np.eye(2)[None], np.ones(1, bool))),
    )
    nothing = known.rows([])
    whole_cost, cost = [], []
    whole = climb(quartic(whole_cost), start, of=np.arange(2))
    left = climb(quartic(cost), start, of=np.arange(2), known=[nothing, known])
    assert whole.converged.all() and left.converged.tolist() == [True, False]
    assert np.isinf(left.log_density).tolist() == [False, True] and left.z[0] == pytest.approx(whole.z[0])
    assert sum(cost) < 0.8 * sum(whole_cost)


@pytest.mark.parametrize("of, both", [([0, 0], False), ([0, 1], True), (None, True)])
def test_of_climbs_on_one_density_those_that_come_to_the_same_place_are_given_up(of, both):
    start = np.array([[0.5, 0.0], [8.0, 6.0]])

    def density(z, rows):
        return -np.sqrt(1.0 + (z**2).sum(axis=1))

    found = climb(density, start, of=None if of is None else np.array(of), tolerance=1e-8)
    assert found.converged.tolist() == [True, both] and found.z[0] == pytest.approx([0.0, 0.0], abs=1e-3)


@pytest.mark.parametrize(
    "apart, higher, which, near",
    [(1.99, -1.0, 0, True), (2.01, -1.0, 0, False), (1.99, 1e-9, 0, False), (1.99, -1.0, 1, False)],
)
def test_a_place_is_near_an_end_within_two_standard_deviations_and_below_it(apart, higher, which, near):
    end = Optimum(np.array([[1.0, 2.0]]), np.array([5.0]), np.diag([4.0, 1.0])[None], np.ones(1, bool))
    ends = Ends.of([end])
    for place in ([1.0 + 0.5 * apart, 2.0], [1.0, 2.0 - apart]):
        assert ends.near(np.array([which]), np.array([place]), np.array([5.0 + higher]))[0] == near


def test_searches_side_by_side_find_what_each_finds_alone():
    """Of two sets of readings, one of them without a hold."""
    target = simulated()
    [measured] = [s.readings for s in target.problem.samples]
    readings = np.repeat(measured, 2, axis=2)
    readings[4, :, 1] = np.nan
    together = modes.searches(target, np.random.default_rng(0), 2, [readings])
    for i, found in enumerate(together):
        density, residuals = target.rowwise([readings[..., [i]]])
        alone = climb(density, found.z[:1], residuals)
        assert found.log_density[0] == pytest.approx(alone.log_density[0], abs=1e-4)
        other = modes.searches(target, np.random.default_rng(1), 1, [readings[..., [i]]])[0]
        assert other.log_density[0] == pytest.approx(found.log_density[0], abs=1e-3)
    assert together[1].log_density[0] != pytest.approx(together[0].log_density[0], abs=0.1)


def test_where_the_first_hold_is_nearly_slack_the_best_mode_has_the_evidence_that_draws_give():
    """A threshold of creep beside the edge of slack: climbs that met the edge as a wall ended 13 nats too low."""
    bench = Bench(displacements_mm=(1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0))
    wire = {"k1": 4000.0, "B": 0.4, "U": 0.9, "k2": 0.04, "N": 0.4, "creep_threshold.tau_c": 1.0}
    truth = Truth(wire | {"preload": -0.9, "setting_sd": 0.05, "sensor_sd": 0.01}, (effect_named("creep_threshold"),))
    problem = draw([bench], truth, 3).problem
    target = LogPosterior(integrated(problem.in_units(problem.own_units)))
    found = modes.modes(target, np.random.default_rng(0))
    by_draws = witnessed(target, np.random.default_rng(0), 500)
    assert by_draws.settled[0]
    assert found.log_evidence.max() == pytest.approx(by_draws.log_integral[0], abs=2.5)

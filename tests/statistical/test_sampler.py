"""The sampler on analytic targets: first and second moments over independent runs, and broken ones that must fail."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from tests.simulated import simulated_tests
from tests.statistical.targets import SHARE, TARGETS, Analytic, corners, funnel, gaussian, grid, share, sixteen_modes
from wirebayes.effects import catalogue, effect_named
from wirebayes.inference import convergence
from wirebayes.inference.fit import fit_problem
from wirebayes.inference.modes import search
from wirebayes.inference.optimum import Optimum
from wirebayes.inference.policy import Policy
from wirebayes.inference.sampler import burn_in, kept, moves, proposal, stop_rule
from wirebayes.inference.sampler import state as sampler_state
from wirebayes.inference.sampler.ensemble import sample_posterior
from wirebayes.io import paper
from wirebayes.model.build import build
from wirebayes.simulation.synthetic import Bench, Truth

pytestmark = pytest.mark.statistical
SMALL = Policy(ensembles=4, walkers=48, ess=300.0, rounds=3, round_draws=2304, most_rounds=4, block=24, most_steps=240)
HASTY = Policy(walkers=64, ess=20_000.0, rounds=1, round_draws=256, most_rounds=1)  # one round teaches next to nothing
RUNS, FEW = 24, 10  # few where the draws of one are many, or far off


def limit(runs=RUNS):
    """The |t| that any of 16 moments exceeds by chance once in three hundred tests."""
    return stats.t.isf(0.5 / 300.0 / 16.0, runs - 1)


def worst(target_of, policy=SMALL, runs=RUNS):
    """Largest |t| over the first and second moments of all coordinates, from the spread of independent runs; and the
    ratio of spread to what the reported effective sample sizes promise, of means or of shares in the tails, whichever
    is larger. Of runs whose search found every hill; how many miss one is a test of its own."""
    draws, promised = [], []
    for seed in range(runs):
        target = target_of()
        chains = sample_posterior(target, 1000 + seed, policy)
        if chains.modes < target.hills:
            continue
        draws.append(chains.z.reshape(-1, chains.z.shape[-1]))
        promised.append(1.0 / chains.ess)
    estimates = np.array([np.concatenate([z.mean(axis=0), (z**2).mean(axis=0)]) for z in draws])
    truth = np.concatenate([target.mean, target.second])
    t = np.abs(estimates.mean(axis=0) - truth) / (estimates.std(axis=0, ddof=1) / np.sqrt(len(estimates)))
    every = np.concatenate(draws)
    low, high = np.quantile(every, [0.05, 0.95], axis=0)
    spreads = []
    for of in (lambda z: z, lambda z: z < low, lambda z: z > high):
        means = np.array([of(z).mean(axis=0) for z in draws])
        spreads.append(np.sqrt((means.var(axis=0, ddof=1) / of(every).var(axis=0)).mean() / np.mean(promised)))
    return t.max(), max(spreads)


@pytest.mark.parametrize("name", ["gaussian", "two_modes"])
def test_moments_are_right_within_monte_carlo_error(name):
    t, ratio = worst(TARGETS[name])
    assert t < limit()
    assert 0.6 < ratio < 1.7


def test_a_search_seldom_misses_a_mode_ten_standard_deviations_away():
    """17 of 1,400 of these do, and 9 of 800 did before climbs began at prior draws. At that rate five of 100 happen
    once in a hundred times."""
    missed = 0
    for seed in range(100):
        ends = search(TARGETS["two_modes"](), np.random.default_rng(seed)).modes.z[:, 0]
        missed += not (np.abs(ends).min() < 0.1 and np.abs(ends - 10.0).min() < 0.1)
    assert missed < 5


@pytest.mark.slow
@pytest.mark.parametrize("name", TARGETS)
def test_moments_are_right_over_many_runs_with_the_policy_s_own_numbers(name):
    policy = Policy(most_steps=800)
    t, ratio = worst(TARGETS[name], policy, runs=60)
    print(f"{name}: largest |t| {t:.2f}, spread over promised {ratio:.2f}")
    assert t < limit()
    assert 0.6 < ratio < 1.5


@pytest.mark.slow
@pytest.mark.parametrize("d", [12, 18, 24])
def test_moments_are_right_in_as_many_dimensions_as_samples_fitted_together_have(d):
    """Two samples of one material have 12 parameters, six have 24, partial pooling of two has 18."""
    policy = Policy(most_steps=800)
    t, ratio = worst(lambda: gaussian(d), policy)
    print(f"{d} dimensions: largest |t| {t:.2f}, spread over promised {ratio:.2f}")
    assert t < limit()
    assert 0.6 < ratio < 1.7


def test_a_proposal_that_proves_poor_is_learned_once_more_before_draws_are_kept(monkeypatch):
    again = sample_posterior(TARGETS["two_modes"](), 3, HASTY)
    t, ratio = worst(gaussian, HASTY, FEW)
    assert t < limit(FEW)
    assert 0.6 < ratio < 1.7
    monkeypatch.setattr(stop_rule, "worth_a_new_start", lambda state: False)
    monkeypatch.setattr(stop_rule, "worth_refining", lambda state, policy: False)
    stubborn = sample_posterior(TARGETS["two_modes"](), 3, HASTY)
    assert again.converged and stubborn.converged
    assert again.kept_evaluations == again.log_density.size  # none of those kept before
    assert again.ess.min() / again.kept_evaluations > 2.0 * stubborn.ess.min() / stubborn.kept_evaluations
    assert again.evaluations < 0.6 * stubborn.evaluations


class _ForgetsTheProposal(moves.PoolMove):
    """Weighs by the posterior alone: takes the proposal for even."""

    def _log_proposal(self, pool):
        return np.zeros(pool.shape[:2])


def test_a_sampler_that_forgets_the_proposal_s_density_fails(monkeypatch):
    monkeypatch.setattr(sampler_state, "PoolMove", _ForgetsTheProposal)
    t, _ = worst(gaussian, runs=FEW)
    assert t > limit(FEW)


@pytest.mark.slow
def test_adapting_while_draws_are_kept_would_be_noticed(monkeypatch):
    """Walkers set back to good places during the kept steps, which only burn-in may do, shrink the second moments."""

    def wrong(target, state, policy, more=kept.more):
        positions, values = state.walkers.positions.copy(), state.walkers.values.copy()
        low = values < np.median(values)
        positions[low], values[low] = positions[values.argmax()], values.max()
        return more(target, replace(state, walkers=replace(state.walkers, positions=positions, values=values)), policy)

    monkeypatch.setattr(kept, "more", wrong)
    monkeypatch.setattr(kept, "block_steps", lambda state, policy: 1 if state.kept.z else 2)
    t, _ = worst(gaussian, Policy(**{**SMALL.__dict__, "most_steps": 24, "ess": 1e9}))
    assert t > limit()


def funnels(neck, runs):
    """Of the runs that call themselves converged, (n, 3): E[v²] / 9 and the shares of 5 % in the neck and the mouth."""
    found = []
    for seed in range(runs):
        chains = sample_posterior(funnel(neck), seed, Policy(most_steps=800))
        if chains.converged:
            v = chains.z[..., neck] / 3.0
            found.append([(v**2).mean(), (v < -1.645).mean(), (v > 1.645).mean()])
    return np.array(found).reshape(-1, 3)


@pytest.mark.parametrize("runs", [4, pytest.param(40, marks=pytest.mark.slow)])
def test_a_funnel_comes_out_right_or_is_refused(runs):
    found = funnels(0, runs)
    print(f"{len(found)} of {runs} converged: {found.mean(axis=0)} ± {found.std(axis=0)}")
    assert len(found) >= runs / 2
    # a neck half explored has a share of .02 to .03; Monte-Carlo errors of a run are .05 and .004
    assert found[:, 0].min() > 0.85 and found[:, 0].max() < 1.15
    assert found[:, 1:].min() > 0.035 and found[:, 1:].max() < 0.065
    assert found.mean(axis=0) == pytest.approx([1.0, 0.05, 0.05], rel=0.08)


@pytest.mark.slow
def test_a_funnel_whose_neck_is_taken_for_its_last_coordinate_is_refused():
    found = funnels(5, 20)
    assert not len(found) or (found[:, 1].min() > 0.035 and found[:, 0].min() > 0.85)


def test_without_witness_excess_and_tails_the_sampler_believes_a_funnel_without_a_neck(monkeypatch):
    monkeypatch.setattr(proposal, "with_excess", lambda of, *drawn: of)
    monkeypatch.setattr(stop_rule, "OUTWEIGHS", np.inf)
    monkeypatch.setattr(stop_rule, "slowest_autocorrelation_steps", convergence.autocorrelation_steps)
    assert funnels(0, 2)[:, 1].min() < 0.02


@pytest.mark.parametrize(
    ("centres", "runs"),
    [
        (corners(), 1),
        (grid(), 1),
        *(pytest.param(c, 20, marks=pytest.mark.slow) for c in (corners(), grid(), grid(20.0))),
        pytest.param(
            corners(20.0),
            20,
            marks=[pytest.mark.slow, pytest.mark.xfail(reason="the search misses hills so far apart")],
        ),
    ],
)
def test_sixteen_modes_have_their_shares_or_are_refused(centres, runs):
    converged = 0
    for seed in range(runs):
        chains = sample_posterior(sixteen_modes(centres), seed, Policy(most_steps=800))
        z = chains.z.reshape(-1, centres.shape[1])
        nearest = (((z[:, None] - centres) ** 2).sum(axis=2)).argmin(axis=1)
        share = np.bincount(nearest, minlength=16) / len(z)
        converged += chains.converged
        if chains.converged:  # 0.0625 each, with 4000 effective draws known to 0.004
            assert share.min() > 0.044 and share.max() < 0.081
    print(f"{converged} of {runs} converged")
    assert converged >= runs / 2


def test_a_tail_that_the_proposal_overlooked_at_first_comes_out_or_the_fit_is_refused():
    """The second relaxation's amplitude on nylon; truth by importance sampling with 99,000 effective draws.

    Without the witness against overlooked places this seed is believed 0.26 standard deviations off. Half of all seeds
    are refused; which ones depends on the last digits of the machine.
    """
    (nylon,) = (experiment for experiment in paper.experiments() if experiment.name == "nylon-1.5m")
    found = fit_problem(build([nylon], [effect_named("second_relaxation", catalogue(None))]), 6)
    amplitude = found.flat[:, found.problem.names.index("second_relaxation.A")]
    if found.chains.converged:
        assert abs(amplitude.mean() - 0.0586) < 0.1 * 0.0622  # mean and standard deviation


@pytest.mark.parametrize("seed", [6, 7, 12])
def test_positions_without_an_error_do_not_keep_a_fit_from_converging(seed):
    """A servo sets them exactly, so the setting error is the end of a funnel.

    The search leaves many places at its wide end, which holds next to nothing; the proposal made too little of them.
    """
    truth = {"k1": 9000.0, "B": 2e-3, "U": 0.8, "k2": 0.02, "N": 0.5, "preload": 0.0}
    servo = Truth({**truth, "sensor_sd": 0.05, "setting_sd": 1e-6})
    times_s = tuple(np.geomspace(1.0, 1800.0, 40))
    bench = Bench(length_mm=500.0, resolution_N=0.001, displacements_mm=tuple(range(1, 9)), times_s=times_s)
    assert fit_problem(build(simulated_tests([bench], servo, seed)), seed).converged


def fake(draws):
    """A state that kept (ensembles, steps, walkers, d) draws of a Gaussian, and the target that it came from."""
    ensembles, steps, walkers_, d = draws.shape
    z = np.moveaxis(draws, 0, 1).reshape(steps, ensembles * walkers_, d)
    state = sampler_state.Sampling(
        sampler_state.Walkers(z[-1], np.zeros(len(z[-1])), None),
        sampler_state.Learned(None, None, 1, trusted=False),
        np.random.default_rng(0),
        0,
        sampler_state.Kept((z,), (np.zeros(z.shape[:2]),)),
    )
    return state, SimpleNamespace(coordinates=gaussian(d).coordinates, problem=gaussian(d).problem)


def looked(draws, **settings):
    state, target = fake(draws)
    return stop_rule.apply(target, state, Policy(ensembles=4, walkers=draws.shape[2], most_steps=10_000, **settings))


def test_a_chain_that_gives_enough_draws_is_believed_and_one_with_too_few_is_not():
    x = np.random.default_rng(3).normal(size=(4, 100, 64, 2))
    assert looked(x, ess=20_000.0).finished and looked(x, ess=20_000.0).converged
    assert not looked(x, ess=40_000.0).finished


def test_an_ensemble_that_stands_apart_is_not_believed_however_many_draws_there_are():
    x = np.random.default_rng(4).normal(size=(4, 100, 64, 2))
    x[0, ..., 1] += 0.4  # R-hat of 1.02 by the walkers' spread, when ESS alone would do
    state = looked(np.repeat(x, 8, axis=1), ess=50.0)
    assert (state.diagnostics.ess > 50.0).all() and state.diagnostics.r_hat.max() > 1.01
    assert not state.finished


def test_a_chain_shorter_than_five_autocorrelation_times_is_not_believed():
    x = first_order(0.95, (4, 120, 256, 2), np.random.default_rng(5))  # 39 steps remember: three times as long
    state = looked(x, ess=1000.0)
    assert (state.diagnostics.ess > 1000.0).all() and (state.diagnostics.r_hat < 1.01).all()
    assert not state.finished
    longer = looked(first_order(0.95, (4, 400, 256, 2), np.random.default_rng(6)), ess=1000.0)
    assert longer.finished and longer.converged


def first_order(rho, shape, rng):
    x = np.empty(shape)
    x[:, 0] = rng.normal(size=x[:, 0].shape)
    for i in range(1, shape[1]):
        x[:, i] = rho * x[:, i - 1] + np.sqrt(1 - rho**2) * rng.normal(size=x[:, i].shape)
    return x


@pytest.mark.parametrize("rho", [0.0, 0.6, 0.9, 0.97])
def test_the_autocorrelation_time_of_a_first_order_process(rho):
    x = first_order(rho, (4, 1000, 500, 2), np.random.default_rng(1))
    assert convergence.autocorrelation_steps(x) == pytest.approx((1 + rho) / (1 - rho), rel=0.1)


def test_walkers_that_stay_apart_are_seen_by_both_diagnostics():
    rng = np.random.default_rng(2)
    x = first_order(0.5, (4, 400, 32, 1), rng)
    assert convergence.nested_r_hat(x)[0] < 1.005
    time = convergence.autocorrelation_steps(x)[0]
    alone = x.copy()
    alone[:, :, :2] += 6.0  # two walkers of every ensemble in a place of their own
    assert convergence.autocorrelation_steps(alone)[0] > 10 * time
    x[0] += 0.5  # one whole ensemble elsewhere
    assert convergence.nested_r_hat(x)[0] > 1.02


def test_no_walker_is_left_in_a_far_mode_of_no_weight():
    """A second mode e^-30 as high, where a twentieth of the walkers start."""
    shift = 20.0 * np.eye(8)[0]

    def density(z):
        return np.logaddexp(-0.5 * (z**2).sum(axis=1), -0.5 * ((z - shift) ** 2).sum(axis=1) - 30.0)

    found = Optimum(np.array([0.0 * shift, shift]), np.array([0.0, -30.0]), np.array([np.eye(8)] * 2), np.ones(2, bool))
    # a single step of burn-in has no time to bring them back by itself
    hasty = Policy(**{**SMALL.__dict__, "rounds": 1, "round_draws": 192, "most_rounds": 1})
    runs = [sample_posterior(Analytic(density, np.zeros(8), np.ones(8)), seed, hasty, found=found) for seed in range(4)]
    assert all(np.abs(chains.z[..., 0]).max() < 10.0 for chains in runs)


def ridge(z):
    """A shell: no mixture of a few ellipsoids resembles it."""
    radius = np.sqrt((z**2).sum(axis=1))
    return -0.5 * ((radius - 20.0) / 0.05) ** 2


def test_a_poor_learned_move_gives_way_to_differential_evolution_and_a_hopeless_chain_is_called_so():
    target = Analytic(ridge, np.zeros(8), np.ones(8))
    policy = Policy(**{**SMALL.__dict__, "most_steps": 72, "acceptance": 0.2})
    chains = sample_posterior(target, 1, policy)
    assert not chains.learned
    assert not chains.converged
    assert chains.why.startswith("not converged after 72 steps: x")
    assert "wanted 300" in chains.why


def test_no_answer_depends_on_what_ran_before():
    first = sample_posterior(gaussian(), 5, SMALL)
    sample_posterior(TARGETS["banana"](), 6, SMALL)
    np.random.seed(99)  # noqa: NPY002 - a stranger's use of the global generator
    again = sample_posterior(gaussian(), 5, SMALL)
    assert first.z.tobytes() == again.z.tobytes()
    assert sample_posterior(gaussian(), 7, SMALL).z.tobytes() != first.z.tobytes()


class Killed(Exception):
    pass


PATIENT = Policy(**{**SMALL.__dict__, "ess": 12000.0})


@pytest.mark.parametrize(("policy", "blow"), [(PATIENT, 1), (PATIENT, 2), (HASTY, 3), (HASTY, 4)])
def test_a_killed_run_goes_on_to_the_same_bytes(policy, blow, tmp_path, monkeypatch):
    whole = sample_posterior(gaussian(), 11, policy)
    path = tmp_path / "checkpoint"
    calls = 0

    def mortal(*arguments, advance=sampler_state.advance):
        nonlocal calls
        calls += 1
        if calls == blow:
            raise Killed
        return advance(*arguments)

    monkeypatch.setattr(burn_in, "advance", mortal)
    monkeypatch.setattr(kept, "advance", mortal)
    with pytest.raises(Killed):
        sample_posterior(gaussian(), 11, policy, checkpoint=path)
    monkeypatch.undo()
    resumed = sample_posterior(gaussian(), 11, policy, checkpoint=path)
    for name in ("z", "log_density", "ess", "r_hat"):
        assert getattr(resumed, name).tobytes() == getattr(whole, name).tobytes()
    assert (resumed.evaluations, resumed.why) == (whole.evaluations, whole.why)
    finished = sample_posterior(gaussian(), 11, policy, checkpoint=path)
    assert finished.z.tobytes() == whole.z.tobytes()


def test_where_an_amount_is_next_to_nothing_there_are_as_many_draws_as_there_should_be():
    """The score of the amount has a long tail there, and what follows the amount no longer changes."""
    level, runs = 0.005, 8
    expected = SHARE.cdf(level)
    found = []
    for seed in range(runs):
        chains = sample_posterior(share(), seed, Policy(ess=2000.0))
        assert chains.converged
        found.append((stats.norm.cdf(chains.z[..., 0]) < level).mean())
    error = np.sqrt(expected * (1.0 - expected) / 2000.0)
    assert abs(np.mean(found) - expected) < 4.0 * error / np.sqrt(runs)
    assert np.std(found, ddof=1) < 2.0 * error

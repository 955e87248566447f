"""Leaving holds out where the densities are written down: when to refit, which draws, and what an error is."""

from types import SimpleNamespace
from typing import Any

import arviz_base
import arviz_stats
import numpy as np
import pytest
from scipy import stats
from scipy.integrate import quad
from scipy.special import expit

from wirebayes.inference.policy import Policy
from wirebayes.io.paper import experiments
from wirebayes.model.build import build
from wirebayes.model.problem import Problem
from wirebayes.prediction import leave_one_hold_out as module
from wirebayes.prediction.leave_one_hold_out import (
    REFIT,
    LeftOutHolds,
    evenly_thinned,
    log_mean,
    smoothed_leave_one_hold_out,
    standard_error,
)
from wirebayes.prediction.left_out_density import without_hold


def _zeros(problem: Problem, draws: int = 500) -> Any:
    """A posterior of which only the number of its draws matters."""
    return SimpleNamespace(problem=problem, flat=np.zeros((draws, len(problem.names))))


@pytest.mark.parametrize(("converging", "shared"), [(True, 10.1), (False, 10.1), (True, 9.9)])
@pytest.mark.parametrize(("tail", "sampled"), [(0.49, False), (0.5, False), (0.51, True), (np.nan, True)])
def test_a_heavy_tail_of_the_importance_ratios_asks_for_sampling(
    tail: float, sampled: bool, converging: bool, shared: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Above Pareto k of 0.5, or where it is not defined; what was not sampled counts as converged.

    What is not settled by weights is fitted. A bridge on fewer than ten draws does not replace what weights say.
    """
    rng = np.random.default_rng(0)
    log_p, without = rng.normal(size=(4, 500)), rng.normal(size=500)
    problem = build([experiments()[1].train(4)])
    monkeypatch.setattr(Problem, "leave_one_hold_out", lambda self, theta: [np.vstack([log_p, without])])
    monkeypatch.setattr(module, "pareto_smoothed", lambda log_ratio: (log_ratio, tail))
    known = np.log(stats.hmean(np.exp(log_p), axis=1))  # weights 1/p: the harmonic mean

    def ratios(problem: Problem, holds: list, draws: np.ndarray, seed: int, doubtful: np.ndarray) -> tuple:
        assert holds == [(0, j) for j in range(4)] and len(draws) == 500 and doubtful.all()
        return np.array([1.0, 2.0, 3.0, 4.0]), np.array([True, True, False, True])

    def fit_without(problem: Problem, seed: int, policy: Policy, rough: np.ndarray) -> SimpleNamespace:
        fitted.append(int(np.flatnonzero(~problem.samples[0].protocol.mask.any(axis=1))[-1]))
        return SimpleNamespace(flat=np.zeros((500, 8)), converged=converging)

    fitted: list[int] = []
    monkeypatch.setattr(module, "fit_problem", fit_without)
    monkeypatch.setattr(module, "log_mean", lambda low, high: (7.0, shared))
    monkeypatch.setattr(module, "log_densities", ratios)
    stub = _zeros(problem)
    shares: list[float] = []
    found = smoothed_leave_one_hold_out(stub, progress=shares.append)
    assert list(found.refitted) == [sampled] * 4 and found.converged is (converging and shared > 10.0 or not sampled)
    assert fitted == [2] * sampled and shares == [0.0] * sampled + [1.0]
    assert found.elpd == pytest.approx([1.0, 2.0, 7.0 if shared > 10.0 else 3.0, 4.0] if sampled else known)


def test_where_one_hold_s_tail_is_heavy_all_are_sampled_together(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tails look light where no draw reaches what is likely only without a hold; a search asks of the heavy ones."""
    problem, asked = build([experiments()[1].train(4)]), []
    monkeypatch.setattr(Problem, "leave_one_hold_out", lambda self, theta: [np.ones((4, 500)) * np.arange(500)])
    tails = iter([0.1, 0.6, 0.2, 0.3])
    monkeypatch.setattr(module, "pareto_smoothed", lambda log_ratio: (log_ratio, next(tails)))

    def together(problem: Problem, holds: list, draws: np.ndarray, seed: int, doubtful: np.ndarray) -> tuple:
        asked.append(doubtful.tolist())
        return np.arange(4.0), np.array([True, True, True, False])

    monkeypatch.setattr(module, "log_densities", together)
    found = smoothed_leave_one_hold_out(_zeros(problem))
    assert asked == [[False, True, False, False]] and found.elpd[:3].tolist() == [0.0, 1.0, 2.0]
    # weights of a light tail stand where the common proposal says nothing
    assert found.elpd[3] != 3.0 and found.refitted.tolist() == [True, True, True, False] and found.converged


def test_weights_that_are_no_numbers_ask_for_sampling(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = build([experiments()[1].train(4)])
    log_p = np.random.default_rng(0).normal(size=(4, 500))
    monkeypatch.setattr(Problem, "leave_one_hold_out", lambda self, theta: [log_p])
    monkeypatch.setattr(module, "pareto_smoothed", lambda log_ratio: (np.nan * log_ratio, 0.1))
    monkeypatch.setattr(module, "log_densities", lambda *given: (np.arange(4.0), np.ones(4, bool)))
    found = smoothed_leave_one_hold_out(_zeros(problem))
    assert found.refitted.all() and found.elpd.tolist() == [0.0, 1.0, 2.0, 3.0]


def test_with_exact_every_hold_is_fitted_without(monkeypatch: pytest.MonkeyPatch) -> None:
    """A bridge between its draws and those of the full posterior; one that did not converge is said."""
    log_p = np.random.default_rng(0).normal(size=(4, 500))
    problem = build([experiments()[1].train(4)])
    monkeypatch.setattr(Problem, "leave_one_hold_out", lambda self, theta: [log_p])
    asked: list[int] = []

    def fit_without(problem: Problem, seed: int, policy: Policy, rough: np.ndarray) -> SimpleNamespace:
        asked.append(int(np.flatnonzero(~problem.samples[0].protocol.mask.any(axis=1))[-1]))
        return SimpleNamespace(flat=np.zeros((500, 8)), converged=len(asked) != 2)

    monkeypatch.setattr(module, "fit_problem", fit_without)
    monkeypatch.setattr(module, "log_mean", lambda low, high: (2.0, 1e3))
    stub = _zeros(problem)
    shares: list[float] = []
    found = smoothed_leave_one_hold_out(stub, exact=True, progress=shares.append)
    assert asked == [0, 1, 2, 3] and shares == [0.0, 0.25, 0.5, 0.75, 1.0]
    assert found.elpd.tolist() == [2.0] * 4 and found.refitted.all() and not found.converged


def test_a_hold_of_one_reading_that_is_given_has_nothing_to_predict(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = build([experiments()[1].train(4)])
    monkeypatch.setattr(Problem, "leave_one_hold_out", lambda self, theta: [np.zeros((4, 500))])
    found = smoothed_leave_one_hold_out(_zeros(problem))
    assert found.elpd.tolist() == [0.0] * 4 and found.pareto_k.tolist() == [0.0] * 4 and not found.refitted.any()


def test_a_hold_is_left_out_of_its_own_sample_alone() -> None:
    problem = build(experiments()[:3])
    for sample in range(3):
        without = without_hold(problem, sample, 1)
        assert len(without.samples) == 3 and not without.samples[sample].protocol.mask[1].any()
        assert all(without.samples[i] is problem.samples[i] for i in range(3) if i != sample)


def test_where_the_model_cannot_be_computed_a_hold_has_no_density(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = build([experiments()[1].train(4)])
    whole, without = np.array([1.0, np.nan, -np.inf]), np.zeros((4, 3))
    monkeypatch.setattr(Problem, "without_each_hold", lambda self, theta: (whole, [without]))
    assert problem.leave_one_hold_out(np.empty(0))[0].tolist() == [[1.0, -np.inf, -np.inf]] * 4


def test_thinned_rows_reach_from_the_first_to_the_last() -> None:
    rows = np.arange(9001.0)[:, None]
    few = evenly_thinned(rows, 10)
    assert few[:, 0].tolist() == [round(9000 * i / 9) for i in range(10)]
    assert len(evenly_thinned(rows)) == 4000 and evenly_thinned(rows[:7]).tolist() == rows[:7].tolist()


def test_one_hold_has_no_standard_error() -> None:
    assert np.isnan(standard_error(np.array([3.0])))
    assert standard_error(np.array([1.0, 3.0])) == pytest.approx(2.0)  # sd √2, times √2


def test_importance_weights_are_smoothed_as_arviz_smooths_them(monkeypatch: pytest.MonkeyPatch) -> None:
    """ArviZ's own leave-one-out on the same log densities; raw weights are off by more than the tolerance."""
    rng = np.random.default_rng(5)
    log_p = -0.5 * (np.array([0.5, 1.0, 2.0, 2.5])[:, None] + rng.normal(scale=0.35, size=(4, 4000))) ** 2
    problem = build([experiments()[1].train(4)])
    monkeypatch.setattr(Problem, "leave_one_hold_out", lambda self, theta: [log_p])
    found = smoothed_leave_one_hold_out(_zeros(problem, 4000))
    assert not found.refitted.any()
    one = {"posterior": {"x": np.zeros((1, 4000))}, "log_likelihood": {"y": log_p.T[None]}}
    reference = arviz_stats.loo(arviz_base.from_dict(one), pointwise=True, reff=1.0)
    np.testing.assert_allclose(found.elpd, reference.elpd_i, atol=1e-9)
    np.testing.assert_allclose(found.pareto_k, reference.pareto_k, atol=1e-9)
    raw = np.log(4000) - np.log(np.exp(-log_p).sum(axis=1))
    assert np.abs(raw - found.elpd).max() > 1e-5


@pytest.mark.parametrize(("centre", "width"), [(0.0, 1.0), (3.0, 0.3)])
def test_log_mean_is_the_normalising_constant_of_a_normal(centre: float, width: float) -> None:
    """A normal bump far out in a standard normal: its mean is known, and few draws of the standard normal see it."""
    rng = np.random.default_rng(3)
    variance = 1.0 / (1.0 + width**-2)

    def log_p(x: np.ndarray) -> np.ndarray:
        return -0.5 * ((x - centre) / width) ** 2

    weighted = variance * centre / width**2 + np.sqrt(variance) * rng.normal(size=(400, 3000))
    estimates = [log_mean(log_p(rng.normal(size=4000)), log_p(draws))[0] for draws in weighted]
    truth = 0.5 * np.log(width**2 / (1.0 + width**2)) - 0.5 * centre**2 / (1.0 + width**2)
    # the estimate is unbiased in the mean itself; 5 standard errors of 400 runs
    shares = np.exp(np.array(estimates) - truth)
    assert abs(shares.mean() - 1.0) < 5.0 * shares.std() / 20.0 + 0.01
    plain = [np.log(np.exp(log_p(rng.normal(size=4000))).mean()) for _ in range(400)]
    assert np.std(estimates) < (0.7 * np.std(plain) if centre else 0.01)


def test_log_mean_bears_draws_where_the_density_is_zero() -> None:
    rng = np.random.default_rng(4)
    log_p = np.where(rng.uniform(size=20000) < 0.25, 0.0, -np.inf)
    assert log_mean(log_p, np.zeros(5000))[0] == pytest.approx(np.log(0.25), abs=0.05)


@pytest.mark.parametrize("centre", [2.0, 4.0, 5.0])
def test_the_draws_that_a_bridge_stands_on_say_how_well_it_is_known(centre: float) -> None:
    """Two standard normals apart: what they share by quadrature, and a variance of nearly its inverse."""
    rng = np.random.default_rng(6)
    found = []
    for _ in range(200):
        one, other = rng.normal(size=1000), centre + rng.normal(size=1000)
        found.append(log_mean(centre * one, centre * other))
    values, shared = np.array(found).T
    common = quad(lambda x: stats.norm.pdf(x) * expit(centre * (x - 0.5 * centre)), -10.0, 15.0)[0]
    assert shared.mean() == pytest.approx(1000.0 * common, rel=0.05)
    assert 0.4 < np.var(values) * shared.mean() < 1.2


def test_the_total_and_its_standard_error() -> None:
    none = np.zeros(4)
    one = LeftOutHolds(("a",) * 4, np.arange(1, 5), np.array([3.0, 2.0, 5.0, 2.0]), none, none > 0)
    assert one.total == 12.0 and one.se == pytest.approx(2 * np.std([3, 2, 5, 2], ddof=1)) and one.converged


@pytest.mark.parametrize("seed", [0, 1])
def test_a_bridge_between_two_lots_of_draws_balances_them(seed: int) -> None:
    """With n draws of the one and m of the other, the root of sum 1/(1 + m/n r/p) = sum 1/(1 + n/m p/r) is r."""
    rng = np.random.default_rng(seed)
    one, other = rng.normal(size=300), 0.5 + rng.normal(size=200)
    r = np.exp(log_mean(one, other)[0])
    from_one = (1.0 / (1.0 + 200.0 / 300.0 * np.exp(one) / r) * np.exp(one)).mean()
    from_other = (1.0 / (1.0 + 200.0 / 300.0 * np.exp(other) / r)).mean()
    assert from_one / from_other == pytest.approx(r, rel=1e-9)
    # far from zero, and of densities that are all the same
    assert log_mean(one - 2000.0, other - 2000.0)[0] == pytest.approx(np.log(r) - 2000.0, rel=1e-12)
    for n, m in ((300, 200), (1, 1), (3000, 1), (1, 3000)):  # however few there are of either
        assert log_mean(np.full(n, -7.0), np.full(m, -7.0))[0] == pytest.approx(-7.0)


def test_what_is_sampled_without_holds_has_seeds_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """One for each hold, or one for all that are sampled together; zero where none is given."""
    problem = build([experiments()[1].train(4)])
    monkeypatch.setattr(Problem, "leave_one_hold_out", lambda self, theta: [np.ones((4, 500)) * np.arange(500)])
    monkeypatch.setattr(module, "pareto_smoothed", lambda log_ratio: (log_ratio, 0.9))
    monkeypatch.setattr(module, "log_mean", lambda low, high: (2.0, 1e3))
    asked: list[tuple[int, object]] = []

    def together(problem: Problem, holds: list, draws: np.ndarray, seed: int, doubtful: np.ndarray) -> tuple:
        asked.append((seed, None))
        return np.zeros(4), np.ones(4, bool)

    def alone(problem: Problem, seed: int, policy: Policy, rough: np.ndarray) -> SimpleNamespace:
        asked.append((seed, policy))
        return SimpleNamespace(flat=np.zeros((500, 8)), converged=True)

    monkeypatch.setattr(module, "log_densities", together)
    monkeypatch.setattr(module, "fit_problem", alone)
    stub = _zeros(problem)
    for given in ({}, {"seed": 0}, {"seed": 1}):
        smoothed_leave_one_hold_out(stub, **given)
    seeds = [seed for seed, _ in asked]
    assert seeds[0] == seeds[1] != seeds[2]
    asked.clear()
    for given in ({}, {"seed": 0}):
        smoothed_leave_one_hold_out(stub, exact=True, **given)
    assert asked[:4] == asked[4:] and len({seed for seed, _ in asked}) == 4
    # a quarter of a fit's draws, from fewer walkers
    assert all(policy is REFIT for _, policy in asked) and REFIT.ess == Policy().ess / 4.0
    assert (REFIT.walkers, REFIT.round_draws) == (Policy().walkers / 2, Policy().round_draws / 2)

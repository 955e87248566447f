"""Leaving holds out where the densities are written down: when to refit, which draws, and what an error is."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from wirebayes.inference.policy import Policy
from wirebayes.io.paper import experiments
from wirebayes.model.problem import Problem, build
from wirebayes.prediction import leave_one_hold_out as module
from wirebayes.prediction.leave_one_hold_out import smoothed_leave_one_hold_out, standard_error, thinned, without_hold


@pytest.mark.parametrize(("tail", "sampled"), [(0.49, False), (0.51, True), (np.nan, True)])
def test_a_heavy_tail_of_the_importance_ratios_asks_for_sampling(
    tail: float, sampled: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Above Pareto k of 0.5, or where it is not defined; what was not sampled counts as converged."""
    rng = np.random.default_rng(0)
    log_p, without = rng.normal(size=(4, 500)), rng.normal(size=500)
    problem = build([experiments()[1].train(4)])
    monkeypatch.setattr(Problem, "leave_one_hold_out", lambda self, theta: [np.vstack([log_p, without])])
    monkeypatch.setattr(module, "_statistics", SimpleNamespace(psislw=lambda values: (-values, tail)))
    known = np.log(stats.hmean(np.exp(log_p), axis=1))  # weights 1/p: the harmonic mean

    def ratios(problem: Problem, holds: list, draws: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray]:
        assert holds == [(0, j) for j in range(4)] and len(draws) == 500
        return np.array([1.0, 2.0, 3.0, 4.0]), np.array([True, True, False, True])

    monkeypatch.setattr(module, "log_densities", ratios)
    stub = SimpleNamespace(problem=problem, flat=np.zeros((500, len(problem.names))))
    shares: list[float] = []
    found = smoothed_leave_one_hold_out(stub, progress=shares.append)  # type: ignore[arg-type]
    assert list(found.refitted) == [sampled] * 4 and found.converged is not sampled and shares == [1.0]
    assert found.elpd == pytest.approx([1.0, 2.0, 3.0, 4.0] if sampled else known)


def test_with_exact_every_hold_is_fitted_without(monkeypatch: pytest.MonkeyPatch) -> None:
    """A bridge between its draws and those of the full posterior; one that did not converge is said."""
    log_p = np.random.default_rng(0).normal(size=(4, 500))
    problem = build([experiments()[1].train(4)])
    monkeypatch.setattr(Problem, "leave_one_hold_out", lambda self, theta: [log_p])
    asked: list[int] = []

    def fit_without(problem: Problem, seed: int, policy: Policy, rough: np.ndarray) -> SimpleNamespace:
        asked.append(int(np.flatnonzero(~problem.samples[0].protocol.mask.any(axis=1))[-1]))
        return SimpleNamespace(flat=np.zeros((500, 8)), chains=SimpleNamespace(converged=len(asked) != 2))

    monkeypatch.setattr(module, "fit", fit_without)
    monkeypatch.setattr(module, "log_mean", lambda low, high: 2.0)
    stub = SimpleNamespace(problem=problem, flat=np.zeros((500, len(problem.names))))
    shares: list[float] = []
    found = smoothed_leave_one_hold_out(stub, exact=True, progress=shares.append)  # type: ignore[arg-type]
    assert asked == [0, 1, 2, 3] and shares == [0.0, 0.25, 0.5, 0.75, 1.0]
    assert found.elpd.tolist() == [2.0] * 4 and found.refitted.all() and not found.converged


def test_a_hold_of_one_reading_that_is_given_has_nothing_to_predict(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = build([experiments()[1].train(4)])
    monkeypatch.setattr(Problem, "leave_one_hold_out", lambda self, theta: [np.zeros((4, 500))])
    stub = SimpleNamespace(problem=problem, flat=np.zeros((500, len(problem.names))))
    found = smoothed_leave_one_hold_out(stub)  # type: ignore[arg-type]
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
    few = thinned(rows, 10)
    assert few[:, 0].tolist() == [round(9000 * i / 9) for i in range(10)]
    assert len(thinned(rows)) == 4000 and thinned(rows[:7]).tolist() == rows[:7].tolist()


def test_one_hold_has_no_standard_error() -> None:
    assert np.isnan(standard_error(np.array([3.0])))
    assert standard_error(np.array([1.0, 3.0])) == pytest.approx(2.0)  # sd √2, times √2

"""Leave one hold out by importance sampling against posteriors that never saw the hold."""

from types import SimpleNamespace

import arviz_base
import arviz_stats
import numpy as np
import pytest

from wirebayes.inference.fit import Fit, fit
from wirebayes.inference.policy import Policy
from wirebayes.io.paper import experiments
from wirebayes.model.problem import Problem, build
from wirebayes.prediction.leave_one_hold_out import (
    LeftOut,
    difference,
    log_mean,
    smoothed_leave_one_hold_out,
    without_hold,
)

QUICK = Policy(ensembles=2, walkers=64, ess=500.0, r_hat=1.05, most_steps=200)


@pytest.fixture(scope="module")
def fitted() -> Fit:
    # with few draws, the shape of the importance ratios' tail is anybody's guess
    return fit(build([experiments()[0]]), 2)


@pytest.mark.statistical
def test_importance_sampling_agrees_with_refitting_without_the_hold(fitted: Fit) -> None:
    fast = smoothed_leave_one_hold_out(fitted, policy=QUICK)
    exact = smoothed_leave_one_hold_out(fitted, policy=QUICK, exact=True)
    assert exact.refitted.all() and not fast.refitted.all()
    assert list(fast.hold) == [1, 2, 3, 4, *range(6, 14)]
    easy = ~fast.refitted
    # Monte-Carlo error of 500 effective draws at Pareto k up to 0.5
    assert np.abs(fast.elpd - exact.elpd)[easy].max() < 0.25
    # leaving a hold out costs: the density that has seen it is higher in sum
    recorded = fitted.problem.samples[0].protocol.recorded
    seen = np.log(np.exp(fitted.problem.leave_one_hold_out(fitted.flat)[0]).mean(axis=1))[recorded]
    assert fast.total < seen.sum() - 1.0


def test_importance_weights_are_smoothed_as_arviz_smooths_them(monkeypatch: pytest.MonkeyPatch) -> None:
    """ArviZ's own leave-one-out on the same log densities; raw weights are off by more than the tolerance."""
    rng = np.random.default_rng(5)
    log_p = -0.5 * (np.array([0.5, 1.0, 2.0, 2.5])[:, None] + rng.normal(scale=0.35, size=(4, 4000))) ** 2
    problem = build([experiments()[1].train(4)])
    monkeypatch.setattr(Problem, "leave_one_hold_out", lambda self, theta: [log_p])
    stub = SimpleNamespace(problem=problem, flat=np.zeros((4000, len(problem.names))))
    found = smoothed_leave_one_hold_out(stub)  # type: ignore[arg-type]
    assert not found.refitted.any()
    one = {"posterior": {"x": np.zeros((1, 4000))}, "log_likelihood": {"y": log_p.T[None]}}
    reference = arviz_stats.loo(arviz_base.from_dict(one), pointwise=True, reff=1.0)
    np.testing.assert_allclose(found.elpd, reference.elpd_i, atol=1e-9)
    np.testing.assert_allclose(found.pareto_k, reference.pareto_k, atol=1e-9)
    raw = np.log(4000) - np.log(np.exp(-log_p).sum(axis=1))
    assert np.abs(raw - found.elpd).max() > 1e-5


def test_a_hold_left_out_still_happened(fitted: Fit) -> None:
    problem = fitted.problem
    rows = fitted.flat[:50]
    without = without_hold(problem, 0, 2)
    assert not without.samples[0].protocol.mask[2].any()
    assert np.array_equal(without.samples[0].protocol.duration_s, problem.samples[0].protocol.duration_s)
    before, after = problem.hold_log_likelihood(rows)[0], without.hold_log_likelihood(rows)[0]
    # p(all) = p(all but the hold) p(hold | all but it): the chain rule, computed in two independent ways
    assert np.allclose(before.sum(axis=0) - after.sum(axis=0), problem.leave_one_hold_out(rows)[0][2], atol=1e-6)


@pytest.mark.parametrize(("centre", "width"), [(0.0, 1.0), (3.0, 0.3)])
def test_log_mean_is_the_normalising_constant_of_a_normal(centre: float, width: float) -> None:
    """A normal bump far out in a standard normal: its mean is known, and few draws of the standard normal see it."""
    rng = np.random.default_rng(3)
    variance = 1.0 / (1.0 + width**-2)

    def log_p(x: np.ndarray) -> np.ndarray:
        return -0.5 * ((x - centre) / width) ** 2

    weighted = variance * centre / width**2 + np.sqrt(variance) * rng.normal(size=(400, 3000))
    estimates = [log_mean(log_p(rng.normal(size=4000)), log_p(draws)) for draws in weighted]
    truth = 0.5 * np.log(width**2 / (1.0 + width**2)) - 0.5 * centre**2 / (1.0 + width**2)
    # the estimate is unbiased in the mean itself; 5 standard errors of 400 runs
    shares = np.exp(np.array(estimates) - truth)
    assert abs(shares.mean() - 1.0) < 5.0 * shares.std() / 20.0 + 0.01
    plain = [np.log(np.exp(log_p(rng.normal(size=4000))).mean()) for _ in range(400)]
    assert np.std(estimates) < (0.7 * np.std(plain) if centre else 0.01)


def test_log_mean_bears_draws_where_the_density_is_zero() -> None:
    rng = np.random.default_rng(4)
    log_p = np.where(rng.uniform(size=20000) < 0.25, 0.0, -np.inf)
    assert log_mean(log_p, np.zeros(5000)) == pytest.approx(np.log(0.25), abs=0.05)


def test_difference_and_its_standard_error() -> None:
    hold = np.array([1, 2, 3, 4])
    names, none = ("a",) * 4, np.zeros(4)
    one = LeftOut(names, hold, np.array([3.0, 2.0, 5.0, 2.0]), none, none > 0)
    other = LeftOut(names, hold, np.array([2.0, 2.0, 2.0, 2.0]), none, none > 0)
    total, se = difference(one, other)
    assert total == 4.0
    assert se == pytest.approx(2 * np.std([1, 0, 3, 0], ddof=1))
    with pytest.raises(ValueError, match="same holds"):
        difference(one, LeftOut(names, hold + 1, none, none, none > 0))

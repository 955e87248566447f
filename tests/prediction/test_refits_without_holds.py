"""Leave one hold out by importance sampling against posteriors that never saw the hold."""

import numpy as np
import pytest

from wirebayes.inference.fit import Fit, fit_problem
from wirebayes.inference.policy import Policy
from wirebayes.io.paper import experiments
from wirebayes.model.build import build
from wirebayes.prediction.leave_one_hold_out import LARGEST_K, smoothed_leave_one_hold_out
from wirebayes.prediction.left_out_density import without_hold

QUICK = Policy(ensembles=2, walkers=64, ess=500.0, r_hat=1.05, most_steps=200)


@pytest.fixture(scope="module")
def fitted() -> Fit:
    # of this wire some holds are easy and some are not, whatever the draws; with few of them, the shape of the
    # importance ratios' tail is anybody's guess
    return fit_problem(build([experiments()[1]]), 2)


@pytest.mark.statistical
def test_importance_sampling_agrees_with_refitting_without_the_hold(fitted: Fit) -> None:
    fast = smoothed_leave_one_hold_out(fitted, policy=QUICK)
    exact = smoothed_leave_one_hold_out(fitted, policy=QUICK, exact=True)
    assert exact.refitted.all() and list(fast.hold) == list(range(1, 13))
    easy = fast.pareto_k <= LARGEST_K
    assert easy.any() and not easy.all() and fast.refitted.all()  # with one that is not, all are sampled together
    # Monte-Carlo error of 400 effective draws, and of a bridge from 1,000
    assert np.abs(fast.elpd - exact.elpd)[easy].max() < 0.25
    # leaving a hold out costs: the density that has seen it is higher in sum
    recorded = fitted.problem.samples[0].protocol.recorded
    seen = np.log(np.exp(fitted.problem.leave_one_hold_out(fitted.flat)[0]).mean(axis=1))[recorded]
    assert fast.total < seen.sum() - 1.0


def test_a_hold_left_out_still_happened(fitted: Fit) -> None:
    problem = fitted.problem
    rows = fitted.flat[:50]
    without = without_hold(problem, 0, 2)
    assert not without.samples[0].protocol.mask[2].any()
    assert np.array_equal(without.samples[0].protocol.duration_s, problem.samples[0].protocol.duration_s)
    before, after = problem.hold_log_likelihood(rows)[0], without.hold_log_likelihood(rows)[0]
    # p(all) = p(all but the hold) p(hold | all but it): the chain rule, computed in two independent ways
    assert np.allclose(before.sum(axis=0) - after.sum(axis=0), problem.leave_one_hold_out(rows)[0][2], atol=1e-6)

"""Specimens that are alike but not the same: the prior's density against simulation, and its limits."""

import numpy as np
import pytest
from scipy import stats

from wirebayes.io.paper import experiments
from wirebayes.model.pooling import pooled
from wirebayes.model.problem import Problem, build

SPREAD = stats.lognorm(0.5, scale=0.1)


def roc() -> Problem:
    return build(experiments()[:2])


def test_density_is_the_line_times_the_specimens() -> None:
    problem = pooled(roc(), ("k1",), SPREAD)
    rows = problem.prior.rvs(20, np.random.default_rng(0))
    column = {name: rows[:, i] for i, name in enumerate(problem.names)}
    expected = sum(
        d.logpdf(column[name]) for name, d in problem.prior.distributions.items() if not name.startswith("k1[")
    )
    for name in ("k1[roc-line-1m]", "k1[roc-line-1.71m]"):
        expected = expected + stats.lognorm(column["spread_k1"], scale=column["k1"]).logpdf(column[name])
    assert problem.prior.log_density()(rows) == pytest.approx(expected, rel=1e-10)
    rows[0, problem.names.index("k1[roc-line-1m]")] = -1.0
    assert problem.prior.log_density()(rows)[0] == -np.inf


def test_draws_spread_about_their_line() -> None:
    problem = pooled(roc(), ("k1", "B"), SPREAD)
    rows = problem.prior.rvs(40000, np.random.default_rng(1))
    column = {name: rows[:, i] for i, name in enumerate(problem.names)}
    for name in ("k1", "B"):
        first, second = (np.log(column[f"{name}[{s}]"] / column[name]) / column[f"spread_{name}"]
                         for s in ("roc-line-1m", "roc-line-1.71m"))  # fmt: skip
        for deviation in (first, second):
            assert stats.kstest(deviation, "norm").pvalue > 1e-4
        assert abs(np.corrcoef(first, second)[0, 1]) < 0.03


def test_likelihood_sees_each_specimens_own_value() -> None:
    plain, problem = roc(), pooled(roc(), ("k1",), SPREAD)
    rows = plain.prior.rvs(5, np.random.default_rng(2))
    column = {name: rows[:, i] for i, name in enumerate(plain.names)}
    column |= {"spread_k1": np.full(5, 0.1), "k1[roc-line-1m]": column["k1"], "k1[roc-line-1.71m]": column["k1"]}
    alike = np.stack([column[name] for name in problem.names], axis=1)
    assert problem.log_likelihood(alike) == pytest.approx(plain.log_likelihood(rows))
    alike[:, problem.names.index("k1")] *= 2.0  # the line's value alone says nothing
    assert problem.log_likelihood(alike) == pytest.approx(plain.log_likelihood(rows))
    before = problem.hold_log_likelihood(alike)
    alike[:, problem.names.index("k1[roc-line-1m]")] *= 1.01
    after = problem.hold_log_likelihood(alike)
    assert not np.allclose(before[0], after[0]) and np.array_equal(before[1], after[1])

"""Scores of held-out holds against closed forms, and bands against readings they must and must not cover."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from tests.model.dense import given
from wirebayes.inference.fit import Fit, fit_problem
from wirebayes.inference.policy import Policy
from wirebayes.io.experiment import Experiment
from wirebayes.io.paper import experiments
from wirebayes.model.build import build
from wirebayes.model.spec import ModelSpec
from wirebayes.prediction.held_out import Scores, _log_mean, _scores, held_out, pit_band, two_thirds
from wirebayes.wire.staircase import simulate

QUICK = Policy(ensembles=2, walkers=64, ess=500.0, r_hat=1.05, most_steps=200)


@pytest.fixture(scope="module")
def fitted() -> Fit:
    return fit_problem(build([experiments()[1].train(8)]), 1, policy=QUICK)


def at_one_point(fitted: Fit) -> Fit:
    """A posterior that is a single point, so that the predictive is a known normal."""
    return replace(fitted, theta=np.tile(np.median(fitted.flat, axis=0), (2, 2000, 1)))


def dense_conditional(fitted: Fit, experiment: Experiment) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean and covariance of the readings to come given the trained ones, and the measured ones."""
    truth = dict(zip(fitted.problem.names, np.median(fitted.flat, axis=0), strict=True))
    trained = len(fitted.problem.samples[0].protocol.number)
    protocol = experiment.protocol()
    holds, step = len(protocol.number), 1e-6
    many = {name: np.full(holds, value) for name, value in truth.items()}
    jacobian = (
        simulate(protocol, many, setting_error=step * np.eye(holds))
        - simulate(protocol, many, setting_error=-step * np.eye(holds))
    ) / (2 * step)
    nominal = simulate(protocol, {name: value[:1] for name, value in many.items()})[..., 0]
    past = np.arange(holds) < trained
    j = jacobian.reshape(-1, holds)
    v = (truth["sensor_sd"] ** 2 + 0.01**2 / 12) * np.eye(len(j)) + truth["setting_sd"] ** 2 * j @ j.T
    rows = np.repeat(past, protocol.time_s.shape[1])
    gain, left = given(v, rows)
    residual = (experiment.tension() - nominal).ravel()
    mean = nominal.ravel()[~rows] + gain @ residual[rows]
    return mean, left, experiment.tension().ravel()[~rows]


def test_log_scores_are_those_of_the_dense_normal(fitted: Fit) -> None:
    experiment = experiments()[1]
    result = held_out(at_one_point(fitted), experiment, np.random.default_rng(0))
    mean, cov, measured = dense_conditional(fitted, experiment)
    assert result.free is not None
    assert result.free.elpd_together == pytest.approx(stats.multivariate_normal(mean, cov).logpdf(measured), abs=1e-4)
    for i in range(4):
        rows = slice(5 * i, 5 * i + 5)
        whole = stats.multivariate_normal(mean[rows], cov[rows, rows]).logpdf(measured[rows])
        first = stats.norm(mean[5 * i], np.sqrt(cov[5 * i, 5 * i])).logpdf(measured[5 * i])
        assert result.free.elpd[i] == pytest.approx(whole, abs=1e-4)
        assert result.given.elpd[i] == pytest.approx(whole - first, abs=1e-4)
    assert result.trained == 8
    assert list(np.unique(result.given.hold)) == [9, 10, 11, 12]
    assert len(result.given.observed_N) == 16


def test_predictive_moments_and_transform_are_those_of_the_dense_normal(fitted: Fit) -> None:
    experiment = experiments()[1]
    free = held_out(at_one_point(fitted), experiment, np.random.default_rng(0)).free
    mean, cov, measured = dense_conditional(fitted, experiment)
    assert free is not None
    sd = np.sqrt(np.diag(cov))
    assert np.abs((free.mean_N - mean) / sd).max() < 5 / np.sqrt(4000)
    assert np.abs(free.pit - stats.norm.cdf((measured - mean) / sd)).max() < 0.05
    inside = np.abs((measured - mean) / sd) < stats.norm.ppf(0.95)
    assert free.coverage()[0.9] == pytest.approx(inside.mean(), abs=0.11)


def test_central_intervals_hold_the_share_they_name() -> None:
    """Standard normal predictive; readings at 200 evenly spaced quantiles of it, so that the shares are known."""
    draws = stats.norm.ppf((np.arange(4000) + 0.5) / 4000)
    readings = stats.norm.ppf((np.arange(200) + 0.5) / 200)[:, None]
    mask, times = np.ones((200, 1), bool), np.zeros((200, 1))
    found = _scores(np.tile(draws, (200, 1, 1)), mask, np.arange(200), times, readings, np.zeros(200), 0.0)
    assert found.coverage() == {0.5: 0.5, 0.9: 0.9, 0.99: 0.99}
    assert found.pit == pytest.approx((np.arange(200) + 0.5) / 200, abs=1 / 4000)


def test_hold_by_hold_has_no_free_prediction() -> None:
    experiment = experiments()[1]
    fitted = fit_problem(build([experiment.train(8)], spec=ModelSpec(likelihood="hold")), 1, policy=QUICK)
    result = held_out(fitted, experiment, np.random.default_rng(0))
    assert result.free is None
    assert result.given.rmse_N < 0.05


@pytest.mark.statistical
def test_transform_band_holds_as_often_as_it_says_with_dependent_readings() -> None:
    rng = np.random.default_rng(7)
    shared = 0.8 * np.tile(np.eye(4), 5).T.reshape(20, 4)  # five readings share an error

    def draws(n: int) -> np.ndarray:
        return shared @ rng.normal(size=(4, n)) + 0.4 * rng.normal(size=(20, n))

    predictive = draws(800)
    trials = 200
    outside = sum(pit_band(predictive, observed)[1] < 0.05 for observed in draws(trials).T)
    assert stats.binomtest(outside, trials, 0.05).pvalue > 0.001
    # a predictive that is too narrow is caught, one shifted by two sd too
    assert pit_band(predictive, draws(1)[:, 0] * 4)[1] < 0.05
    assert pit_band(predictive, draws(1)[:, 0] + 2.0)[1] < 0.05


def test_band_itself_covers_the_diagonal_and_is_ordered() -> None:
    rng = np.random.default_rng(8)
    band, p = pit_band(rng.normal(size=(30, 1000)), rng.normal(size=30))
    level, low, high = band
    assert np.all(low <= level + 0.03) and np.all(level <= high + 0.03) and np.all(low <= high)
    assert 0 <= p <= 1


def test_scores_are_moments_quantiles_and_ranks_of_the_draws_of_each_reading() -> None:
    """A draw that equals the reading does not lie below it; the spread has the divisor of a sample."""
    draws = np.zeros((2, 2, 4))
    draws[0, 1], draws[1, 0] = [1.0, 2.0, 2.0, 5.0], [4.0, 8.0, 6.0, 10.0]
    rows = np.array([[False, True], [True, False]])
    tension, times = np.array([[0.0, 2.0], [9.0, 0.0]]), np.array([[0.0, 30.0], [60.0, 90.0]])
    found = _scores(draws, rows, np.array([7, 8]), times, tension, np.array([1.0, 2.0]), 2.5)
    assert found.hold.tolist() == [7, 8] and found.time_s.tolist() == [30.0, 60.0]
    assert found.observed_N.tolist() == [2.0, 9.0] and found.mean_N.tolist() == [2.5, 7.0]
    assert found.sd_N == pytest.approx([np.sqrt(3.0), np.sqrt(20.0 / 3.0)])
    assert found.pit.tolist() == [0.25, 0.75]
    assert found.quantiles_N[3].tolist() == [2.0, 7.0] and found.quantiles_N.shape == (7, 2)
    assert found.rmse_N == pytest.approx(np.sqrt((0.5**2 + 2.0**2) / 2.0))
    assert found.elpd.tolist() == [1.0, 2.0] and found.elpd_together == 2.5


def test_a_reading_at_the_end_of_an_interval_lies_inside() -> None:
    ends = np.array([-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0])
    nothing = np.zeros(0)
    for reading, inside in ((1.0, 1.0), (-1.0, 1.0), (1.5, 0.0), (-1.5, 0.0)):
        at = np.array([reading])
        found = Scores(np.ones(1, int), at, at, at, at, ends[:, None], at, nothing, 0.0, nothing, 0.0)
        assert found.coverage() == {0.5: inside, 0.9: 1.0, 0.99: 1.0}


@pytest.mark.parametrize("probability", [None, 0.8])
def test_the_band_by_counting(probability: float | None) -> None:
    """Every course compared with all others at each level, one by one."""
    rng = np.random.default_rng(3)
    draws, observed = rng.normal(size=(4, 1)) + rng.normal(size=(4, 30)), np.array([0.0, 2.0, -1.0, 0.5])
    band, p = pit_band(draws, observed) if probability is None else pit_band(draws, observed, probability)
    levels = [i / 100 for i in range(101)]

    def course(ranks: list[float]) -> list[float]:
        return [sum(rank <= level for rank in ranks) / 4 for level in levels]

    courses = [course([(sum(row < row[i]) + 0.5) / 30 for row in draws]) for i in range(30)]
    own = course([sum(row < y) / 30 for row, y in zip(draws, observed, strict=True)])

    def extreme(one: list[float]) -> float:
        below = min(sum(other[k] <= one[k] for other in courses) for k in range(101))
        above = min(sum(other[k] >= one[k] for other in courses) for k in range(101))
        return 2.0 * min(below, above) / 30

    each = [extreme(one) for one in courses]
    assert p == pytest.approx(np.mean([value <= extreme(own) for value in each]))
    pointwise = np.quantile(each, 1.0 - (probability or 0.95))
    ends = np.quantile(courses, [pointwise / 2.0, 1.0 - pointwise / 2.0], axis=0)
    assert band == pytest.approx(np.vstack([levels, ends]))


def test_hold_by_hold_later_readings_are_scored_given_the_first() -> None:
    """At two points in turn: the logarithm of the mean of two densities, for each hold to come."""
    experiment = experiments()[1]
    problem = build([experiment.train(8)], spec=ModelSpec(likelihood="hold"))
    at = {"k1": 700.0, "B": 0.21, "U": 0.6, "k2": 0.03, "N": 0.7, "sensor_sd": 0.006}
    theta = np.array([[at[name] for name in problem.names]] * 2)
    theta[1, 0] = 650.0
    stub = SimpleNamespace(problem=problem, flat=np.tile(theta, (600, 1)))
    result = held_out(stub, experiment, np.random.default_rng(0))  # type: ignore[arg-type]
    each = build([experiment], spec=ModelSpec(likelihood="hold")).hold_log_likelihood(theta)[0][8:]
    assert result.given.elpd == pytest.approx(np.log(np.exp(each).mean(axis=1)), rel=1e-9)
    assert result.experiment == "roc-line-1.71m" and result.trained == 8 and np.isnan(result.given.elpd_together)
    assert len(result.given.observed_N) == 16 and (result.given.time_s > 0).all()


def test_where_the_model_cannot_be_computed_a_draw_has_no_density() -> None:
    log_p = np.log([[1.0, 2.0, 3.0], [1.0, 1.0, 1.0]])
    log_p[0, 1], log_p[1, 2] = np.nan, np.inf
    assert np.exp(_log_mean(log_p)) == pytest.approx([4.0 / 3.0, 2.0 / 3.0])


def test_with_nothing_to_come_there_is_nothing_to_predict() -> None:
    experiment = experiments()[1]
    stub = SimpleNamespace(problem=build([experiment]), flat=np.zeros((3, 8)))
    with pytest.raises(ValueError, match=r"roc-line-1\.71m: all 12 holds were trained on"):
        held_out(stub, experiment, np.random.default_rng(0))  # type: ignore[arg-type]


def test_two_thirds_are_rounded_to_nearest() -> None:
    assert [two_thirds(n) for n in (3, 4, 5, 7, 8, 10)] == [2, 3, 3, 5, 5, 7]

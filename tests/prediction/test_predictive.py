"""Predicted readings against the dense normal of the whole staircase, and against importance weights."""

from dataclasses import replace

import numpy as np
import pytest

from tests.model.dense import jacobian, normal
from wirebayes.effects import effect_named
from wirebayes.io.experiment import Experiment
from wirebayes.io.paper import experiments
from wirebayes.model import single_holds
from wirebayes.model.build import build
from wirebayes.model.spec import ModelSpec
from wirebayes.prediction import predictive
from wirebayes.prediction.predictive import PredictionRequest, _regressed, draw_predictive, settings_given_readings
from wirebayes.wire.staircase import simulate

TRUTH = {"k1": 700.0, "B": 0.21, "U": 0.6, "k2": 0.03, "N": 0.7, "preload": 0.4, "sensor_sd": 0.006, "setting_sd": 0.02}
DRAWS = 4000


def wire(name: str = "roc-line-1m") -> Experiment:
    return next(e for e in experiments() if e.name == name)


def question_of(experiment: Experiment, train: int, first: dict[int, float] | None = None) -> PredictionRequest:
    """Trained holds as replicates, the others free or given their first reading (by row)."""
    protocol = experiment.protocol()
    given = np.full(len(protocol.number), np.nan)
    for row, value in (first or {}).items():
        given[row] = value
    return PredictionRequest(protocol, len(experiment.train(train).holds), protocol.recorded, given)


def rows(values: dict[str, float], problem_names: tuple[str, ...], n: int = DRAWS) -> np.ndarray:
    return np.tile([values[name] for name in problem_names], (n, 1))


def dense(experiment: Experiment, values: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """Nominal readings (rows,) and their derivative by every setting error, by differences of the exact staircase."""
    protocol = experiment.protocol()
    theta = {name: np.array([value]) for name, value in values.items()}
    holds, step = len(protocol.number), 1e-6
    moved = np.eye(holds) * step
    many = {name: np.full(holds, value) for name, value in values.items()}
    up, down = simulate(protocol, many, setting_error=moved), simulate(protocol, many, setting_error=-moved)
    return simulate(protocol, theta)[..., 0], (up - down) / (2 * step)


@pytest.mark.statistical
def test_holds_to_come_follow_the_dense_conditional_normal() -> None:
    experiment, train = wire(), 8
    trained = experiment.train(train)
    problem = build([trained])
    drawn = draw_predictive(
        problem,
        rows(TRUTH, problem.names),
        problem.samples[0],
        question_of(experiment, train),
        np.random.default_rng(1),
    )
    nominal, jacobian = dense(experiment, TRUTH)
    past = np.zeros(nominal.shape, bool)
    past[: len(trained.holds)] = experiment.protocol().mask[: len(trained.holds)]
    to_come = experiment.protocol().mask & ~past
    variance = TRUTH["sensor_sd"] ** 2 + 0.01**2 / 12
    scale = TRUTH["setting_sd"] ** 2
    j_past, j_next = jacobian[past], jacobian[to_come]
    v = variance * np.eye(past.sum()) + scale * j_past @ j_past.T
    gain = scale * j_next @ j_past.T @ np.linalg.inv(v)
    mean = nominal[to_come] + gain @ (experiment.tension()[past] - nominal[past])
    cov = variance * np.eye(to_come.sum()) + scale * j_next @ j_next.T - scale * gain @ j_past @ j_next.T
    found = drawn[to_come]
    sd = np.sqrt(np.diag(cov))
    # exact setting errors differ from the linearised ones by far less than the Monte-Carlo error
    assert np.abs((found.mean(axis=1) - mean) / sd).max() < 5 / np.sqrt(DRAWS)
    assert np.abs(np.cov(found) - cov).max() < 6 * sd.max() ** 2 * np.sqrt(2 / DRAWS)
    # and the history matters: forgetting the training readings is a difference this test sees
    assert np.abs(gain @ (experiment.tension()[past] - nominal[past]) / sd).max() > 10 / np.sqrt(DRAWS)


@pytest.mark.statistical
def test_replicates_have_new_noise_and_new_setting_error() -> None:
    experiment, train = wire(), 8
    problem = build([experiment.train(train)])
    drawn = draw_predictive(
        problem,
        rows(TRUTH, problem.names),
        problem.samples[0],
        question_of(experiment, train),
        np.random.default_rng(2),
    )
    nominal, jacobian = dense(experiment, TRUTH)
    trained = np.flatnonzero(experiment.protocol().recorded)[:train]
    for row in trained[1:]:
        own = TRUTH["setting_sd"] * jacobian[row, 0, row]
        sd = np.sqrt(own**2 + TRUTH["sensor_sd"] ** 2 + 0.01**2 / 12)
        # the creep carried in is known from the readings to a small part of the hold's own setting error
        assert drawn[row, 0].std() == pytest.approx(sd, rel=0.06)


@pytest.mark.statistical
def test_given_first_reading_agrees_with_importance_weights() -> None:
    experiment, train = wire("roc-line-1.71m"), 6
    values = TRUTH | {"k1": 690.0, "B": 0.3}
    problem = build([experiment.train(train)])
    rng = np.random.default_rng(3)
    n = 60000
    theta = rows(values, problem.names, n)
    spread = {"k1": 4.0, "B": 0.01, "U": 0.01, "preload": 0.01}
    for name, sd in spread.items():
        theta[:, problem.names.index(name)] += sd * rng.normal(size=n)
    free = question_of(experiment, train)
    row = len(experiment.train(train).holds)
    drawn = draw_predictive(problem, theta, problem.samples[0], free, rng)
    observed = float(drawn[row, 0].mean() + 1.0 * drawn[row, 0].std())
    given = draw_predictive(problem, theta, problem.samples[0], question_of(experiment, train, {row: observed}), rng)
    # the same by keeping the free draws whose first reading comes out near the given one
    near = np.abs(drawn[row, 0] - observed) < 0.1 * drawn[row, 0].std()
    kept = drawn[row:, :, near]
    assert near.sum() > 2000
    for j, k in [(0, 1), (0, 4), (1, 0), (3, 4)]:
        sd = kept[j, k].std()
        assert abs(given[row + j, k].mean() - kept[j, k].mean()) < 5 * sd / np.sqrt(near.sum())
        assert given[row + j, k].std() == pytest.approx(sd, rel=0.06)
    assert np.all(given[row, 0] == observed)
    assert given[row, 1].std() < 0.7 * drawn[row, 1].std()


def test_a_later_given_reading_leaves_earlier_holds_alone() -> None:
    experiment, train = wire("roc-line-1.71m"), 6
    problem = build([experiment.train(train)])
    theta = rows(TRUTH | {"k1": 690.0}, problem.names, 200)
    row = len(experiment.train(train).holds)
    free, given = (
        draw_predictive(
            problem, theta, problem.samples[0], question_of(experiment, train, first), np.random.default_rng(4)
        )
        for first in ({}, {row + 2: 3.3})
    )
    assert np.array_equal(free[: row + 2], given[: row + 2])
    assert not np.allclose(free[row + 3], given[row + 3])


@pytest.mark.parametrize("key", ["second_relaxation", "superposition", "permanent_creep", "sensor_drift", "ageing"])
def test_what_effects_carry_goes_on_from_the_training(key: str) -> None:
    experiment, train = wire("nylon-1.5m"), 5
    effect = effect_named(key)
    problem = build([experiment.train(train)], [effect])
    values = (
        TRUTH
        | {"sensor_sd": 1e-7, "setting_sd": 1e-13}
        | {
            c: a.neutral + (0.0 if a.is_shape else 0.3 if a.unit == "-" else 1e-3)
            for c, a in zip(effect.columns(), effect.amplitudes, strict=True)
        }
    )
    sample = replace(problem.samples[0], resolution=1e-9)
    theta = rows(values, problem.names, 3)
    drawn = draw_predictive(problem, theta, sample, question_of(experiment, train), np.random.default_rng(5))
    whole = simulate(experiment.protocol(), {n: np.array([values[n]]) for n in problem.names}, sample.model)
    assert np.allclose(drawn, whole, atol=1e-6)


@pytest.mark.statistical
def test_hold_by_hold_spreads_the_first_readings_own_error() -> None:
    experiment = wire("roc-line-1.71m")
    problem = build([experiment], spec=ModelSpec(likelihood="hold"))
    theta = rows(TRUTH, problem.names, 20000)
    protocol = experiment.protocol()
    question = PredictionRequest(protocol, len(protocol.number), protocol.recorded, experiment.tension()[:, 0])
    drawn = draw_predictive(problem, theta, problem.samples[0], question, np.random.default_rng(6))
    assert np.all(drawn[:, 0] == experiment.tension()[:, :1])
    # with no creep left to matter both readings' errors add: slopes by length are nearly equal
    expected = np.sqrt(2 * (TRUTH["sensor_sd"] ** 2 + 0.01**2 / 12))
    assert drawn[5, 1].std() == pytest.approx(expected, rel=0.1)


def test_draws_that_could_not_be_computed_leave_a_gap_and_given_readings_that_do_not_vary_none() -> None:
    """Readings moved to where two given ones take their values; both are the same one here, and then one is unknown."""
    rng = np.random.default_rng(0)
    first = np.tile(rng.normal(size=(1, 2000)), (2, 1))
    drawn = np.vstack([first[0], 0.5 * first[0] + 0.1 * rng.normal(size=2000)])
    moved = _regressed(drawn, first, np.array([2.0, 2.0]))
    assert moved[0] == pytest.approx(np.full(2000, 2.0))
    assert moved[1].mean() == pytest.approx(1.0, abs=0.01) and moved[1].std() == pytest.approx(0.1, rel=0.05)
    drawn[1, 5] = np.nan
    assert np.isfinite(_regressed(drawn, first, np.array([2.0, 2.0]))[0]).all()
    first[:, 5] = np.inf
    with np.errstate(invalid="ignore"):
        assert np.isnan(_regressed(drawn, first, np.array([2.0, 2.0]))).any()


class Given:
    """A generator whose normal numbers are written down, one lot after the other."""

    def __init__(self, *lots: np.ndarray) -> None:
        self.lots = list(lots)

    def normal(self, size: tuple[int, ...]) -> np.ndarray:
        assert self.lots[0].shape == size
        return self.lots.pop(0)


def test_setting_errors_of_the_past_follow_their_normal_given_the_readings() -> None:
    """Exactly: without chance it is the dense posterior's mean, and unit vectors make up a root of its covariance."""
    experiment = wire().train(6)  # an unrecorded hold among them
    problem = build([experiment])
    sample, holds = problem.samples[0], len(experiment.holds)
    own = {name: np.full(holds + 1, value) for name, value in TRUTH.items()}
    chance = np.vstack([np.zeros(holds), np.eye(holds)])
    drawn = settings_given_readings(own, sample, Given(chance))  # type: ignore[arg-type]
    residual, covariance, _ = normal(sample.protocol, TRUTH, sample.model, sample.readings[..., 0], sample.resolution)
    _, derivative = jacobian(sample.protocol, TRUTH, sample.model)
    by_setting = derivative[sample.protocol.mask]
    gain = TRUTH["setting_sd"] ** 2 * by_setting.T @ np.linalg.inv(covariance)
    root = drawn[:, 1:] - drawn[:, :1]
    assert drawn[:, 0] == pytest.approx(gain @ residual, rel=1e-6, abs=1e-9)
    left = TRUTH["setting_sd"] ** 2 * (np.eye(holds) - gain @ by_setting)
    assert root @ root.T == pytest.approx(left, rel=1e-6, abs=1e-9)


def test_the_last_bit_of_a_slope_does_not_change_what_is_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Holds that are known equally well have eigenvalues that are, and eigenvectors that any rounding turns."""
    own = {"setting_sd": np.array([0.1])}
    rng = np.random.default_rng(0)
    drawn = []
    for _ in range(2):
        rounding = 1e-13 * rng.normal(size=(5, 5))
        square = 40.0 * np.eye(5) + rounding + rounding.T
        monkeypatch.setattr(predictive, "_normal_equations", lambda own, sample, of=square: (of[None], np.ones((1, 5))))
        drawn.append(settings_given_readings(own, None, np.random.default_rng(1)))  # type: ignore[arg-type]
    assert drawn[1] == pytest.approx(drawn[0], rel=1e-10)


@pytest.mark.parametrize("key", [None, "superposition"])
def test_a_replicate_has_an_error_of_its_own_and_the_past_goes_on_as_the_readings_say(
    key: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Holds to come and trained ones that nobody asks for follow the past; a replicate differs in its own hold."""
    experiment, train = wire("nylon-1.5m"), 4
    effects = [effect_named(key)] if key else []
    sample = build([experiment.train(train)], effects).samples[0]
    protocol = experiment.protocol()
    requested = protocol.recorded.copy()
    requested[1] = False
    holds, rng = len(protocol.number), np.random.default_rng(0)
    trained = len(sample.protocol.number)
    past, chance = 0.1 * rng.normal(size=(trained, 2)), rng.normal(size=(holds, 2))
    own = {name: np.full(2, value) for name, value in (TRUTH | {"superposition.omega": 0.6}).items()}
    monkeypatch.setattr(predictive, "settings_given_readings", lambda own, sample, rng: past)
    request = PredictionRequest(protocol, trained, requested, np.full(holds, np.nan))
    found = predictive.chain_course(own, sample, request, Given(chance))  # type: ignore[arg-type]
    drawn = chance * TRUTH["setting_sd"]
    known = np.vstack([past, drawn[trained:]])
    course = simulate(protocol, own, sample.model, known)
    for j in range(holds):
        expected = course
        if j < trained and requested[j]:
            replicate = known.copy()
            replicate[j] = drawn[j]
            expected = simulate(protocol, own, sample.model, replicate)
        assert found[j] == pytest.approx(expected[j], rel=1e-12)
    fresh = PredictionRequest(protocol, 0, requested, np.full(holds, np.nan))
    found = predictive.chain_course(own, sample, fresh, Given(chance))  # type: ignore[arg-type]
    assert found == pytest.approx(simulate(protocol, own, sample.model, drawn), rel=1e-12)


def test_readings_are_rounded_evenly_within_half_a_step_and_only_requested_holds_are_drawn() -> None:
    """However many draws there are; the sensor's error comes on top."""
    experiment = wire()
    problem = build([experiment])
    sample = replace(problem.samples[0], resolution=0.5)
    protocol = experiment.protocol()
    requested = protocol.recorded & (protocol.number != 2)
    request = PredictionRequest(protocol, 0, requested, np.full(len(requested), np.nan))
    still = TRUTH | {"sensor_sd": 1e-9, "setting_sd": 1e-9}
    for values, sd in ((still, 0.0), (still | {"sensor_sd": 0.2}, 0.2)):
        theta = rows(values, problem.names, 1001)
        drawn = draw_predictive(problem, theta, sample, request, np.random.default_rng(0))
        assert drawn.shape == (*protocol.time_s.shape, 1001) and not drawn[~requested].any()
        clean = simulate(protocol, {name: np.array([value]) for name, value in values.items()}, sample.model)
        error = (drawn - clean)[requested]
        if not sd:
            assert np.abs(error).max() == pytest.approx(0.25, rel=0.01)
        # five standard errors of 60,060 draws at most
        assert error.mean() == pytest.approx(0.0, abs=5 * np.sqrt((0.25 / 12 + sd**2) / error.size))
        assert error.var() == pytest.approx(0.25 / 12 + sd**2, rel=0.03)
        assert len(np.unique(error[0, 0])) == 1001  # no lot of draws repeats another


def test_given_first_readings_are_regressed_on_within_their_own_history() -> None:
    """By least squares: a replicate on its own first reading, a hold to come on all first readings given up to it."""
    rng = np.random.default_rng(2)
    holds, width, n = 5, 3, 400
    drawn = np.einsum("ij,jkn->ikn", rng.normal(size=(holds, holds)), rng.normal(size=(holds, width, n)))
    requested = np.array([True, True, True, True, False])
    first = np.array([np.nan, 1.5, -0.5, 2.0, 9.0])
    request = PredictionRequest(wire().protocol(), 2, requested, first)
    found = predictive.given_first(drawn.copy(), request)

    def moved(readings: np.ndarray, known: list[int]) -> np.ndarray:
        given = drawn[known, 0]
        design = np.vstack([np.ones(n), given]).T
        slopes = np.linalg.lstsq(design, readings.T, rcond=None)[0][1:]
        return np.asarray(readings + slopes.T @ (first[known][:, None] - given))

    assert np.array_equal(found[0], drawn[0])  # a replicate without a first reading of its own stays free
    assert np.array_equal(found[4], drawn[4])  # nobody asks for it
    for j, known in ((1, [1]), (2, [2]), (3, [2, 3])):
        assert found[j] == pytest.approx(moved(drawn[j], known), abs=1e-9)
        assert (found[j, 0] == first[j]).all()
    free = replace(request, first=np.array([np.nan, np.nan, 1.0, np.nan, np.nan]))
    later = predictive.given_first(drawn.copy(), free)
    first = free.first
    assert later[3] == pytest.approx(moved(drawn[3], [2]), abs=1e-9) and np.ptp(later[3, 0]) > 0.1


def test_hold_by_hold_each_hold_follows_from_its_own_first_reading() -> None:
    """Without noise it is the course through that reading; where that is not above zero, there is none."""
    experiment = wire()
    problem = build([experiment], spec=ModelSpec(likelihood="hold"))
    protocol = experiment.protocol()
    sample = replace(problem.samples[0], resolution=1e-12)
    requested = protocol.recorded & (protocol.number != 2)
    first = np.where(protocol.number == 3, -1.0, experiment.tension()[:, 0])
    theta = rows(TRUTH | {"sensor_sd": 1e-12}, problem.names, 3)
    request = PredictionRequest(protocol, 0, requested, first)
    drawn = draw_predictive(problem, theta, sample, request, np.random.default_rng(0))
    own = {name: np.array([value]) for name, value in TRUTH.items()}
    courses = single_holds.hold_courses(protocol, own, sample.model, first[:, None])
    for j, course in enumerate(courses):
        if course is None or not requested[j]:
            assert not drawn[j].any()
            continue
        expected = course[0] if protocol.number[j] != 3 else np.zeros_like(course[0])
        assert drawn[j, 1:] == pytest.approx(np.tile(expected[1:], 3), abs=1e-9) and (drawn[j, 0] == first[j]).all()

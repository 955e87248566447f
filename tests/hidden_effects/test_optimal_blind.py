"""The ideal judge who has to estimate the noise: its integrals by quadrature, and cases with a known answer."""

from itertools import islice

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from analyses.hidden_effects import optimal
from analyses.hidden_effects.baselines import gaussian_process
from analyses.hidden_effects.cases import Spec, build
from analyses.hidden_effects.delta import derivatives
from analyses.hidden_effects.optimal import judge
from analyses.hidden_effects.optimal_blind import SETTING, Answers, Metric, answers, log_evidence, metrics
from analyses.hidden_effects.optimal_sets import DELTA_RANGE, REMAINDER_SIZES, Directions, Sets

UNITS = np.array([[1.0, 0, 0, 0, 0], [0.6, 0.8, 0, 0, 0]])
TWO = Directions(UNITS, np.array([0, 1]), ["a", "b"])
DATA = np.array([[4.0, 5.0, 0.5, -0.8, 0.6]])


def in_plain_metric(log_volume: float, data: np.ndarray) -> Metric:
    """Inner products of rows as they stand."""
    return Metric(log_volume, UNITS @ UNITS.T, data @ UNITS.T, (data**2).sum(axis=1))


def by_quadrature(members: list[int]) -> float:
    """Log evidence, amplitudes on a grid and the logarithm of the noise on another, against a constant for any set."""
    amplitudes, sizes = np.linspace(-DELTA_RANGE[1], DELTA_RANGE[1], 201), np.linspace(-4.0, 5.0, 181)
    grids = np.meshgrid(*[amplitudes] * len(members), indexing="ij")
    left = DATA[0] - sum(g[..., None] * UNITS[i] for g, i in zip(grids, members, strict=True))
    each = [multivariate_normal.logpdf(left, np.zeros(5), np.exp(2.0 * s) * np.eye(5)) for s in sizes]
    return float(np.log(np.mean(np.exp(each))))


def test_amplitudes_and_noise_are_integrated_out():
    metric = [in_plain_metric(0.0, DATA)]
    found = [float(log_evidence(metric, Sets.of(TWO, size), 5)[0, 0]) for size in (0, 1, 2)]
    expected = [by_quadrature([]), by_quadrature([0]), by_quadrature([0, 1])]
    assert np.diff(found) == pytest.approx(np.diff(expected), abs=0.03)


def test_metrics_are_equally_likely():
    sets = Sets.of(TWO, 1)
    one, other = in_plain_metric(0.0, DATA), in_plain_metric(-2.0, 1.3 * DATA)
    single = [log_evidence([m], sets, 5) for m in (one, other)]
    assert log_evidence([one, other], sets, 5) == pytest.approx(np.logaddexp(*single) - np.log(2.0))


def _rig_and_rows():
    """One test with two effects, and three directions of its readings."""
    geo = build(Spec("two", "paper", ("toe", "superposition"), 10.0, 6)).geo
    return geo, np.random.default_rng(0).normal(size=(3, len(geo.plain)))


def _dense(geo, rows):
    """In newtons: covariance, its part from setting errors, basis of the plain model and rows."""
    (bench,), by_eta = geo.rig.benches, derivatives(geo.rig)[2]
    errors = (by_eta * bench.setting_sd**2) @ by_eta.T
    return geo.chol @ geo.chol.T, errors, geo.chol @ geo.basis, rows @ geo.chol.T


def _generalised(noise, basis, raw):
    """Inner products of rows beside the basis under a noise, and those of the basis."""
    inner = basis.T @ np.linalg.solve(noise, basis)
    side = basis.T @ np.linalg.solve(noise, raw.T)
    return raw @ np.linalg.solve(noise, raw.T) - side.T @ np.linalg.solve(inner, side), inner


def test_each_metric_is_that_of_the_dense_covariance():
    geo, rows = _rig_and_rows()
    true, errors, basis, raw = _dense(geo, rows)
    for metric, factor in zip(metrics(geo, rows, rows), SETTING, strict=True):
        noise = true + (factor - 1.0) * errors
        left, inner = _generalised(noise, basis, raw)
        volume = np.linalg.slogdet(noise)[1] - np.linalg.slogdet(true)[1] + np.linalg.slogdet(inner)[1]
        assert metric.log_volume == pytest.approx(-0.5 * volume, abs=1e-6)
        assert pytest.approx(left, rel=1e-6) == metric.along.T
        assert metric.gram == pytest.approx(left, rel=1e-6) and metric.square == pytest.approx(np.diag(left), rel=1e-6)


def test_each_metric_with_a_smooth_remainder_is_that_of_the_dense_covariance():
    """Of the first process, the smallest setting error and the smallest and largest remainder."""
    geo, rows = _rig_and_rows()
    true, errors, basis, raw = _dense(geo, rows)
    kernel = next(iter(gaussian_process(geo.rig, np.ones(len(geo.plain), bool))))
    absorbed = np.eye(len(true)) - geo.basis @ geo.basis.T
    white = np.linalg.inv(geo.chol)
    kernel = kernel / np.trace(absorbed @ white @ kernel @ white.T @ absorbed)
    found = list(islice(metrics(geo, rows, rows, remainder=True), REMAINDER_SIZES))
    for metric, delta in zip((found[0], found[-1]), DELTA_RANGE, strict=True):
        noise = true + (SETTING[0] - 1.0) * errors + delta**2 * kernel
        left, _ = _generalised(noise, basis, raw)
        assert pytest.approx(left, rel=1e-4, abs=1e-4) == metric.along.T


def test_what_counts_as_said():
    weights = np.array([[0.05, 0.9, 0.05], [0.05, 0.06, 0.89], [0.89, 0.06, 0.05], [0.08, 0.02, 0.9]])
    remains = np.array([False, False, False, True])
    said = Answers([["c"], ["a", "c"], ["b"]], weights, remains, np.arange(4.0))
    assert said.names == [["a", "c"], ["b"], ["c"], ["b"]]
    found = said.rates([["a", "b"], ["c"]])
    assert found == {
        "all": 0.25,
        "known": 0.75,
        "all_sure": 0.25,
        "known_sure": 0.75,
        "named": 0.5,
        "remains": 0.25,
        "right": 0.75,
        "other": 0.0,
    }
    assert said.rates([["a"], ["c"]])["all_sure"] == 0.25 and said.rates([["b"]])["known_sure"] == 0.25
    assert said.rates([["a"]])["other"] == 0.75
    assert said.above(2.0).rates([["a", "b"]]) == {
        "all": 1.0,
        "known": 1.0,
        "all_sure": 1.0,
        "known_sure": 1.0,
        "named": 0.0,
        "remains": 1.0,
        "right": 1.0,
        "other": 0.0,
    }


def test_more_speaks_for_something_hidden_the_larger_it_is():
    geo = build(Spec("two", "paper", ("toe", "superposition"), 10.0, 6)).geo
    z = geo.project(geo.chol @ np.random.default_rng(0).normal(size=len(geo.plain)))[0]
    units = np.vstack([z / np.linalg.norm(z), np.eye(len(z))[:3]])
    some = Directions(units, np.arange(4), ["a", "b", "c", "d"])
    nothing, small, large = (
        answers(geo, some, size * units[0], np.random.default_rng(1), draws=6).odds for size in (0.0, 5.0, 10.0)
    )
    assert (nothing < small).all()
    assert (small < large).all()


@pytest.mark.slow
def test_a_single_effect_is_judged_where_it_is_seen(monkeypatch):
    case = build(Spec("single", "dense", ("grip_slip",), 3.0, 0))
    seen = judge(case, draws=120)["blind"]
    monkeypatch.setattr(optimal, "ALPHA", 0.999)
    assert seen["named"] > judge(case, draws=120)["blind"]["named"] + 0.1


@pytest.mark.parametrize(("kind", "names", "share"), [("two", ["toe", "ageing"], 0.5), ("without", ["toe"], 1.0)])
def test_the_judge_names_what_the_test_sees(kind, names, share, monkeypatch):
    """Half of the data sets speak for something; files of several effects count whether it is seen or not."""

    def half(geo, directions, z, rng, draws):
        odds = np.full(draws, 2.0) if not z.any() else np.resize([5.0, 1.0], draws)
        return Answers([names], np.ones((draws, 1)), np.ones(draws, bool), odds)

    monkeypatch.setattr(optimal, "answers", half)
    found = judge(build(Spec(kind, "unloading", tuple(names), 10.0, 0)), draws=16)["blind"]
    assert found["remains"] == share
    monkeypatch.setattr(
        optimal, "answers", lambda *given: Answers([names], np.ones((1, 1)), np.ones(1, bool), np.zeros(1))
    )
    unseen = judge(build(Spec(kind, "unloading", tuple(names), 10.0, 0)), draws=16)["blind"]
    assert unseen.get("remains", 0.0) == 0.0


def test_a_slip_may_be_a_setting_error_where_its_size_is_unknown():
    found = judge(build(Spec("two", "dense", ("grip_slip", "sensor_drift"), 10.0, 3)), draws=120)
    assert found["optimal_two"]["group"] > found["blind"]["all"] + 0.1


def test_a_foreign_form_that_no_name_resembles_is_left_over():
    found = judge(build(Spec("foreign", "unloading", ("worn_thread",), 20.0, 0)), draws=16)["blind"]
    assert found["right"] == found["remains"]


def test_the_answers_follow_the_random_stream_alone():
    case = build(Spec("two", "paper", ("toe", "superposition"), 10.0, 6))
    z = np.zeros(len(case.geo.plain))
    some = Directions(np.eye(len(z))[:4], np.arange(4), ["a", "b", "c", "d"])
    one, other = (answers(case.geo, some, z, np.random.default_rng(1), draws=6) for _ in range(2))
    assert one.names == other.names
    assert (one.remains == other.remains).all()

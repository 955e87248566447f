"""The table of `predict` against the normal distribution that a single hold of a known wire has."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from tests.model.dense import normal
from tests.simulated import simulated_tests
from wirebayes.model.build import build
from wirebayes.prediction import mixture as module
from wirebayes.prediction.mixture import drawn_readings
from wirebayes.prediction.predictive import PredictionRequest
from wirebayes.prediction.table import beyond_tested, dataset, header, mixture_table, without_readings
from wirebayes.results.read_back import Stored
from wirebayes.simulation.synthetic import Bench, Truth
from wirebayes.wire.model import Model

WIRE = {"k1": 900.0, "B": 0.25, "U": 0.6, "k2": 0.05, "N": 0.7, "preload": 0.4, "sensor_sd": 0.01, "setting_sd": 0.01}
DRAWS = 40000


def table_of(members: Any, seed: int = 0, draws: int = 4000) -> list[list[Any]]:
    """The rows of a protocol requested of one or several models."""
    _, request = members[0]
    return mixture_table(drawn_readings(members, seed, draws), request)


def test_rows_as_a_dataset_have_names_and_units() -> None:
    rows = [["roc", 3, 1.5, 0.0, *np.arange(5.0)], ["roc", 4, 2.5, 30.0, *np.arange(5.0, 10.0)]]
    found = dataset(rows, {"seed": 7})
    assert found.attrs == {"experiment": "roc", "seed": 7} and set(found.coords) == {
        "hold",
        "displacement_mm",
        "time_s",
    }
    assert {name: found[name].values.tolist() for name in ("hold", "time_s", "q95_N")} == {
        "hold": [3, 4],
        "time_s": [0.0, 30.0],
        "q95_N": [4.0, 9.0],
    }
    assert [found[name].attrs["units"] for name in header("displacement")[1:]] == [
        "1",
        "mm",
        "s",
        "N",
        "N",
        "N",
        "N",
        "N",
    ]
    assert dataset(rows[:1], {}).attrs["experiment"] == "roc"


@pytest.mark.parametrize(("tension", "time", "found"), [(6.0, 360.0, []), (6.01, 5.0, ["N"]), (1.0, 361.0, ["s"])])
def test_what_is_far_beyond_the_tests_is_said(tension: float, time: float, found: list[str]) -> None:
    """Twice the largest tension read, three times the longest hold that was read: no padding, no unrecorded hold."""
    mask = np.array([[True, True, True], [True, False, False], [False, False, False]])
    readings = np.where(mask, 3.0, 99.0)[..., None]
    protocol = SimpleNamespace(
        mask=mask, recorded=mask.any(axis=1), duration_s=np.array([120.0, 30.0, 9e9]), control="displacement"
    )
    stored: Any = SimpleNamespace(sample=SimpleNamespace(protocol=protocol, readings=readings))
    rows = [["wire", 1, 2.0, 5.0, *np.ones(5)], ["wire", 2, 4.0, time, 9.0, 9.0, 9.0, tension, 9.0]]
    sentences = beyond_tested(rows, stored)
    assert [notice.text.split(" ")[5] for notice in sentences] == found
    protocol.control, protocol.setting = "force", np.array([3.0, 2.0, 99.0])  # a weight of which nothing was read
    rows = [["wire", 1, 1.0, 5.0, *np.full(5, 99.0)], ["wire", 2, tension, time, *np.full(5, 99.0)]]
    assert [notice.text.split(" ")[5] for notice in beyond_tested(rows, stored)] == found


def test_quantiles_are_those_of_the_known_normal() -> None:
    bench = Bench(displacements_mm=(2, 4, 7), resolution_N=0.02)
    experiment = simulated_tests([bench], Truth(WIRE), seed=1)[0]
    sample, protocol = build([experiment]).samples[0], experiment.protocol()
    stored = Stored({name: np.full(DRAWS, value) for name, value in WIRE.items()}, sample, "chain")
    every = np.ones(3, bool)
    question = PredictionRequest(protocol, 0, every, np.full(3, np.nan))  # the same holds of a fresh sample
    request = SimpleNamespace(stored=stored, prediction=question, holds=experiment.holds)
    rows = [dict(zip(header("displacement"), row, strict=True)) for row in table_of([(1.0, request)], draws=DRAWS)]
    r, covariance, hold = normal(protocol, WIRE, Model(), experiment.tension(), 0.02)
    mean, sd = experiment.tension()[protocol.mask] - r, np.sqrt(np.diag(covariance))
    assert [row["hold"] for row in rows] == list(hold + 1)
    for row, middle, width in zip(rows, mean, sd, strict=True):
        # standard errors over 40000 draws: 0.005 of the mean, 0.011 of an outer quantile, in standard deviations
        assert (row["mean_N"] - middle) / width == pytest.approx(0.0, abs=0.03)
        assert row["sd_N"] / width == pytest.approx(1.0, abs=0.03)
        for name, level in (("q05_N", 0.05), ("q50_N", 0.5), ("q95_N", 0.95)):
            assert (row[name] - middle) / width == pytest.approx(stats.norm.ppf(level), abs=0.06)


def test_undecided_models_answer_as_often_as_they_are_probable() -> None:
    """Two wires whose bands do not meet: the quantiles are those of a mixture of two normals, worked out by hand."""
    bench = Bench(displacements_mm=(2, 4, 7), resolution_N=0.02)
    experiment = simulated_tests([bench], Truth(WIRE), seed=1)[0]
    sample, protocol = build([experiment]).samples[0], experiment.protocol()
    question = PredictionRequest(protocol, 0, np.ones(3, bool), np.full(3, np.nan))
    members, parts = [], []
    for share, stiffness in ((0.7, 900.0), (0.3, 1200.0)):
        wire = WIRE | {"k1": stiffness}
        stored = Stored({name: np.full(DRAWS, value) for name, value in wire.items()}, sample, "chain")
        members.append((share, SimpleNamespace(stored=stored, prediction=question, holds=experiment.holds)))
        r, covariance, _ = normal(protocol, wire, Model(), experiment.tension(), 0.02)
        parts.append((share, experiment.tension()[protocol.mask] - r, np.sqrt(np.diag(covariance))))
    rows = [dict(zip(header("displacement"), row, strict=True)) for row in table_of(members, draws=DRAWS)]
    for i, row in enumerate(rows):
        assert row["mean_N"] == pytest.approx(sum(share * mean[i] for share, mean, _ in parts), abs=0.01)
        for name, level in (("q05_N", 0.05), ("q95_N", 0.95)):
            below = sum(share * stats.norm.cdf(row[name], mean[i], sd[i]) for share, mean, sd in parts)
            assert below == pytest.approx(level, abs=0.005)


def mixed(
    shares: tuple[float, ...], stiff: tuple[float, ...], first: list[float], stored_draws: int
) -> list[dict[str, Any]]:
    """What wires of different stiffness, undecided between, answer on a fresh sample given some first readings."""
    experiment = simulated_tests([Bench(displacements_mm=(2, 4, 7), resolution_N=0.02)], Truth(WIRE), seed=1)[0]
    sample, protocol = build([experiment]).samples[0], experiment.protocol()
    question = PredictionRequest(protocol, 0, np.ones(3, bool), np.array(first))
    members = []
    for share, k1 in zip(shares, stiff, strict=True):
        stored = Stored(
            {name: np.full(stored_draws, value) for name, value in (WIRE | {"k1": k1}).items()}, sample, "chain"
        )
        members.append((share, SimpleNamespace(stored=stored, prediction=question, holds=experiment.holds)))
    return [dict(zip(header("displacement"), row, strict=True)) for row in table_of(members, draws=8000)]


@pytest.mark.parametrize("number", [1, 2])
def test_a_first_reading_also_says_which_of_the_undecided_models_is_right(number: int) -> None:
    """The odds of two wires change by how well each predicts it, from the hold on that it belongs to, by hand."""
    shares, stiff, draws = (0.7, 0.3), (900.0, 920.0), 8000
    experiment = simulated_tests([Bench(displacements_mm=(2, 4, 7), resolution_N=0.02)], Truth(WIRE), seed=1)[0]
    row = int(np.flatnonzero(experiment.protocol().mask.ravel())[5 * number])
    parts = [normal(experiment.protocol(), WIRE | {"k1": k1}, Model(), experiment.tension(), 0.02) for k1 in stiff]
    means = [experiment.tension().ravel()[row] - residual[5 * number] for residual, _, _ in parts]
    sds = [np.sqrt(covariance[5 * number, 5 * number]) for _, covariance, _ in parts]
    observed = means[1] + sds[1]
    first = [np.nan] * 3
    first[number] = observed
    odds = [share * stats.norm.pdf(observed, m, sd) for share, m, sd in zip(shares, means, sds, strict=True)]
    expected = odds[0] / sum(odds)
    assert abs(expected - 0.7) > 0.2
    found = mixed(shares, stiff, first, draws)
    alone = [mixed((1.0,), (k1,), first, draws) for k1 in stiff]
    for i, row in enumerate(found):
        one, other = (table[i]["mean_N"] for table in alone)
        weight = 0.7 if row["hold"] < number + 1 else expected
        if abs(one - other) > 0.02:
            assert (row["mean_N"] - other) / (one - other) == pytest.approx(weight, abs=0.06)


def test_a_model_without_probability_has_no_part_in_the_answer() -> None:
    """Whatever a first reading says."""
    for first in ([np.nan] * 3, [2.0, np.nan, np.nan]):
        found, alone = mixed((1.0, 0.0), (900.0, 1200.0), first, 300), mixed((1.0,), (900.0,), first, 300)
        assert found == alone


def test_models_with_few_draws_keep_their_shares() -> None:
    """A model of nine tenths has no more than three hundred draws: the other one does not fill up what is missing."""
    found = mixed((0.9, 0.1), (900.0, 1200.0), [np.nan] * 3, 300)
    one, other = (mixed((1.0,), (k1,), [np.nan] * 3, 300)[0]["mean_N"] for k1 in (900.0, 1200.0))
    assert (found[0]["mean_N"] - other) / (one - other) == pytest.approx(0.9, abs=0.01)


@pytest.mark.parametrize(
    ("shares", "used"),
    [((1.0,), [4000]), ((0.75, 0.25), [3000, 1000]), ((0.9999, 1e-4), [4000, 2]), ((1.0, 0.0), [4000, 2])],
)
def test_four_thousand_draws_are_shared_by_probability_and_an_improbable_model_has_two(
    shares: tuple[float, ...], used: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Evenly spread over the stored ones, from the first to the last."""
    experiment = simulated_tests([Bench(displacements_mm=(2,))], Truth(WIRE), seed=1)[0]
    protocol = experiment.protocol()
    question = PredictionRequest(protocol, 0, np.ones(1, bool), np.full(1, np.nan))
    stored = SimpleNamespace(
        theta=np.arange(9000.0)[:, None], problem=None, likelihood="chain", sample=SimpleNamespace(name="wire")
    )
    request = SimpleNamespace(stored=stored, prediction=question, holds=experiment.holds)
    asked: list[np.ndarray] = []

    def predict(problem: None, theta: np.ndarray, *rest: object) -> np.ndarray:
        asked.append(theta[:, 0])
        return np.zeros((*protocol.time_s.shape, len(theta)))

    monkeypatch.setattr(module, "draw_unconditioned", predict)
    table_of([(share, request) for share in shares])
    assert [len(rows) for rows in asked] == used
    table_of([(1.0, request)])
    table_of([(1.0, request)], 0, 70)
    assert [len(rows) for rows in asked[-2:]] == [4000, 70]
    del asked[-2:]
    for rows in asked:
        assert (rows[0], rows[-1]) == (0.0, 8999.0) and np.ptp(np.diff(rows)) <= 1.0


def test_figures_are_those_of_the_draws_to_the_last_bit_where_a_reading_is_given(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Means about the first draw, the spread with a sample's divisor; a hold of fewer readings has fewer rows."""
    times = ((0.0, 30.0, 60.0), (0.0, 50.0), (0.0, 10.0, 20.0))
    bench = Bench("wire", displacements_mm=(1, 2, 3), times_s=times, unrecorded=frozenset({1}))
    experiment = simulated_tests([bench], Truth(WIRE), seed=1)[0]
    protocol, holds = experiment.protocol(), experiment.recorded_holds
    question = PredictionRequest(protocol, 0, protocol.recorded, np.full(3, np.nan))
    stored = SimpleNamespace(
        theta=np.zeros((9, 1)), problem=None, likelihood="chain", sample=SimpleNamespace(name="wire")
    )
    request = SimpleNamespace(stored=stored, prediction=question, holds=holds)
    drawn = np.random.default_rng(0).normal(size=(3, 3, 9))
    drawn[1, 0] = 0.1  # the sum of nine is not nine times as much
    monkeypatch.setattr(module, "draw_unconditioned", lambda *given: drawn)
    rows = table_of([(1.0, request)])
    where = [(1, 0), (1, 1), (2, 0), (2, 1), (2, 2)]
    assert [row[:4] for row in rows] == [
        ["wire", 2, 2.0, 0.0],
        ["wire", 2, 2.0, 50.0],
        *(["wire", 3, 3.0, time] for time in (0.0, 10.0, 20.0)),
    ]
    for (j, k), row in zip(where, rows, strict=True):
        here = drawn[j, k]
        expected = [here.mean(), here.std(ddof=1), *np.quantile(here, [0.05, 0.5, 0.95])]
        assert row[4:] == pytest.approx(expected, rel=1e-12)
    assert rows[0][4:] == [0.1, 0.0, 0.1, 0.1, 0.1]


def test_a_prediction_has_a_seed_of_its_own_and_zero_where_none_is_given() -> None:
    experiment = simulated_tests([Bench(displacements_mm=(2,))], Truth(WIRE), seed=1)[0]
    sample, protocol = build([experiment]).samples[0], experiment.protocol()
    stored = Stored({name: np.full(9, value) for name, value in WIRE.items()}, sample, "chain")
    question = PredictionRequest(protocol, 0, np.ones(1, bool), np.full(1, np.nan))
    request = SimpleNamespace(stored=stored, prediction=question, holds=experiment.holds)
    found = {seed: table_of([(1.0, request)], seed) for seed in (0, 1)}
    without = mixture_table(drawn_readings([(1.0, request)]), request)  # type: ignore[arg-type, list-item]
    assert without == found[0] != found[1]


def test_a_prediction_draws_the_median_and_band_of_each_hold():
    rows = [["w", hold, 2.0, t, 3.0, 0.1, 2.8 + t, 3.0 + t, 3.2 + t] for hold in (7, 8) for t in (0.0, 1.0)]
    axes = dataset(rows, {}).plot()
    assert [line.get_label() for line in axes.get_lines()] == ["hold 7, 2 mm", "hold 8, 2 mm"]
    assert axes.get_lines()[1].get_ydata().tolist() == [3.0, 4.0]
    band = axes.collections[0].get_datalim(axes.transData)
    assert (band.y0, band.y1) == pytest.approx((2.8, 4.2))
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("time in the hold, s", "tension, N")


def test_a_prediction_under_weights_draws_displacements():
    axes = dataset([["w", 7, 4.0, 0.0, 3.0, 0.1, 2.8, 3.0, 3.2]], {}, "force").plot()
    assert axes.get_ylabel() == "displacement, mm"
    assert axes.get_lines()[0].get_label() == "hold 7, 4 N"


def weighed(failing: int, of: int = 1000) -> tuple[dict[int, np.ndarray], Any]:
    """Draws of two holds under weights, in the second of which some have no reading."""
    holds = [SimpleNamespace(number=k, setting=5.0 * k, control="force", time_s=np.array([0.0, 60.0])) for k in (1, 2)]
    drawn = np.random.default_rng(0).normal(size=(2, 2, of))
    drawn[1, 1, :failing] = np.nan
    prediction = SimpleNamespace(requested=np.ones(2, bool))
    stored = SimpleNamespace(sample=SimpleNamespace(name="wire"))
    return {0: drawn[0], 1: drawn[1]}, SimpleNamespace(holds=holds, prediction=prediction, stored=stored)


@pytest.mark.parametrize(("failing", "empty"), [(0, False), (1, False), (500, False), (501, True), (1000, True)])
def test_draws_without_a_reading_do_not_count_and_are_told(failing: int, empty: bool) -> None:
    drawn, request = weighed(failing)
    rows = mixture_table(drawn, request)
    for row, values in zip(rows[:2], drawn[0], strict=True):
        assert row[4] == pytest.approx(values.mean(), abs=1e-12)
    for row, values in zip(rows[2:], drawn[1][:, failing:], strict=True):
        assert np.isnan(row[4:]).all() if empty else row[4] == pytest.approx(values.mean(), abs=1e-12)
        assert empty or row[6] == pytest.approx(np.quantile(values, 0.05), abs=1e-12)
    said = without_readings(drawn, request)
    assert [notice.kind for notice in said] == ["extrapolation"] * (failing > 0)
    if said:
        assert f"hold 2: in up to {failing / 10:.3g} % of the draws (hold 2, at 10 N)" in said[0].text
        assert ("left empty" in said[0].text) == empty


def test_a_wire_that_cannot_carry_what_was_read_is_no_draw_of_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """A model all of whose draws fail has no part in the answer, and of another those that fail have none."""
    experiment = simulated_tests([Bench(displacements_mm=(2, 4))], Truth(WIRE), seed=1)[0]
    question = PredictionRequest(experiment.protocol(), 0, np.ones(2, bool), np.array([1.0, np.nan]))
    sample = SimpleNamespace(name="wire")
    stored = SimpleNamespace(theta=np.zeros((9, 1)), problem=None, likelihood="chain", sample=sample)
    request: Any = SimpleNamespace(stored=stored, prediction=question, holds=experiment.holds)
    good = np.random.default_rng(0).normal(size=(*experiment.protocol().time_s.shape, 400))
    some = good.copy()
    some[1, -1, :100] = np.nan
    none = np.full_like(good, np.nan)
    made = iter([none, some, good[..., 100:].copy()])
    monkeypatch.setattr(module, "draw_unconditioned", lambda *given: next(made))
    both = drawn_readings([(0.5, request), (0.5, request)])
    alone = drawn_readings([(1.0, request)])
    for j in (0, 1):
        np.testing.assert_array_equal(both[j], alone[j])

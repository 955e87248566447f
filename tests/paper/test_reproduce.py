"""The paper reproduced: verdicts, forecasts, and the whole run at a small size."""

import os
from pathlib import Path

import numpy as np
import pytest

from tests import light
from wirebayes.cli import main
from wirebayes.io import paper
from wirebayes.io.run_folder import read_json
from wirebayes.model.prior import PowerScaled
from wirebayes.model.spec import ModelSpec
from wirebayes.paper import verdicts
from wirebayes.paper.held_out import Forecast, published_course
from wirebayes.paper.least_squares import at, tension_residuals
from wirebayes.paper.pictures import stiffest_step
from wirebayes.processes import workers
from wirebayes.results import jobs

WIRES = {experiment.name: experiment for experiment in paper.experiments()}
TABLE_4 = paper.published()["table_4"]
NAMES = (
    "least_squares",
    "posterior",
    "creep",
    "held_out",
    "sampling",
    "measured",
    "robot",
    "robot_mass",
    "robot_claim",
)


@pytest.mark.parametrize(
    ("published", "shrunk", "word"),
    [
        (1.5, 0.9, "inside"),
        (1.0, 0.9, "inside"),
        (2.1, 0.9, "outside"),
        (0.9, 0.9, "outside"),
        (1.5, 0.66, "not determined"),
        (9.0, 0.0, "not determined"),
    ],
)
def test_verdict(published, shrunk, word):
    assert verdicts.verdict(published, 1.0, 2.0, shrunk) == word


def test_the_product_of_stiffness_and_amount_has_a_verdict_of_its_own():
    rng = np.random.default_rng(1)
    prior = {name: np.exp(rng.normal(size=5000)) for name in ("k1", "B", "U", "k2", "N")}
    draws = prior | {"B": 2.0 / prior["k1"] * np.exp(0.01 * rng.normal(size=5000))}
    published = {"k1": 1.0, "B": 2.0, "U": 1.0, "k2": 1.0, "N": 1.0}
    rows = verdicts.verdict_rows("wire", "hold", draws, prior, {}, published)
    words = {row["parameter"]: row["verdict"] for row in rows}
    assert words["k1"] == words["B"] == "not determined"
    assert words["k1*B"] == "inside"


def test_creep_is_judged_at_the_typical_tension_and_rate_over_a_typical_hold():
    """Readings that say how far a wire creeps at 20 N, and nothing of U, say little of the creep at 1 N."""
    rng = np.random.default_rng(2)
    tension_N, hold_s = 20.0, 600.0
    powers = {"B": PowerScaled("U", np.log(tension_N)), "k2": PowerScaled("N", np.log(hold_s))}
    prior = {name: np.exp(rng.normal(size=5000)) for name in ("k1", "B", "U", "k2", "N")}
    known = np.exp(0.05 * rng.normal(size=5000))
    draws = prior | {"B": known * tension_N ** -prior["U"], "k2": known * hold_s ** -prior["N"]}
    published = {"k1": 1.0, "B": 0.05, "U": 1.0, "k2": 1 / 600, "N": 1.0}
    rows = {row["parameter"]: row for row in verdicts.verdict_rows("wire", "hold", draws, prior, powers, published)}
    at_one_newton = {row["parameter"]: row for row in verdicts.verdict_rows("w", "hold", draws, prior, {}, published)}
    for name in ("B", "k2"):
        assert rows[name]["contraction"] > 0.99 and rows[name]["verdict"] == "inside"
        assert at_one_newton[name]["contraction"] < 0.9
        assert rows[name]["q50"] == at_one_newton[name]["q50"]  # in the units of the paper
    assert rows["U"]["contraction"] == 0.0


def test_creep_of_the_published_parameters_is_equation_5_by_hand():
    draws = {name: np.full(3, value) for name, value in TABLE_4["kite-1.5m"].items()}
    rows = verdicts.creep_rows("kite-1.5m", "chain", draws, TABLE_4["kite-1.5m"], 6.0, 1500.0)
    assert [row["time_s"] for row in rows] == [120.0, 3600.0, 86400.0]
    for row in rows:
        expected = 0.4681 * 6.0**0.5123 * (1 - np.exp(-0.05855 * row["time_s"] ** 0.41))
        assert row["published_mm"] == pytest.approx(expected, rel=1e-12)
        assert row["q05_mm"] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("name", WIRES)
def test_the_papers_curve_passes_where_its_residuals_say(name):
    wire = WIRES[name]
    hold = wire.recorded_holds[-1]
    curve = published_course(TABLE_4[name], wire, hold.time_s)
    left = tension_residuals(wire, at(TABLE_4[name]), ModelSpec(likelihood="hold"))[-1, 1:, 0]
    assert curve[0] == pytest.approx(hold.tension_N[0], abs=1e-9)
    np.testing.assert_allclose(hold.tension_N[1:] - curve[1:], left, atol=1e-9)


def test_coverage_and_rms_of_a_forecast():
    drawn = np.linspace(-1.0, 1.0, 2001)[None].repeat(4, axis=0)  # 90 % band: -0.9 to 0.9 around 0
    seen = Forecast(np.array([1, 1, 2, 2]), np.zeros(4), np.array([0.0, 0.89, 0.91, -2.0]), drawn)
    assert seen.coverage == 0.5
    assert seen.rms_N == pytest.approx(np.sqrt((0.89**2 + 0.91**2 + 4.0) / 4))


def test_the_kites_published_stiffness_is_its_stiffest_step():
    wire = WIRES["kite-1.5m"]
    assert stiffest_step(wire) == pytest.approx(1500.0 * (14.04 - 9.34))  # Table 3, 7 mm to 8 mm
    assert stiffest_step(wire) == pytest.approx(TABLE_4["kite-1.5m"]["k1"], rel=1e-4)


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> Path:
    directory = tmp_path_factory.mktemp("reproduce") / "out"
    with pytest.MonkeyPatch.context() as patch:
        light.reproduce(directory, patch)
    return directory


def results(directory: Path) -> dict[str, bytes]:
    """Every CSV and JSON below a folder."""
    files = sorted(path for path in directory.rglob("*") if path.suffix in (".csv", ".json"))
    return {str(path.relative_to(directory)): path.read_bytes() for path in files}


def test_a_run_leaves_fits_tables_pictures_and_a_page(whole):
    for kind in ("chain", "hold", "chain-first-5", "hold-first-5"):
        assert (whole / "kite-1.5m" / kind / "posterior.nc").is_file()
        summary = read_json(whole / "kite-1.5m" / kind / "summary.json")
        assert summary["likelihood"] == kind.split("-")[0]
        assert not (whole / "kite-1.5m" / kind / ".checkpoint").exists()
    for name in NAMES:
        rows = read_json(whole / f"{name}.json")
        lines = (whole / f"{name}.csv").read_text().splitlines()
        assert lines[0].split(",") == list(rows[0])
        assert len(lines) == 1 + len(rows)
    index = read_json(whole / "figures" / "index.json")
    assert {entry["section"] for entry in index} >= {
        "measured",
        "known",
        "figures-1-to-4",
        "ridge",
        "amount-and-rate",
        "prior",
    }
    assert all((whole / "figures" / entry["file"]).is_file() and entry["alt"] for entry in index)
    assert (whole / "report.html").stat().st_size > 100_000


def test_the_tables_say_what_the_fits_say(whole):
    rows = read_json(whole / "posterior.json")
    for likelihood in ("chain", "hold"):
        summary = read_json(whole / "kite-1.5m" / likelihood / "summary.json")
        for row in rows:
            if row["likelihood"] == likelihood and row["parameter"] in summary["parameters"]:
                assert row["q50"] == pytest.approx(summary["parameters"][row["parameter"]]["q50"], rel=1e-12)
    k1 = {row["likelihood"]: row["verdict"] for row in rows if row["parameter"] == "k1"}
    assert k1 == {"chain": "outside", "hold": "not determined"}
    fitted = read_json(whole / "least_squares.json")
    published = next(r for r in fitted if (r["likelihood"], r["elastic_law"]) == ("hold", "hooke"))
    assert published["parameters"] == "published"
    assert published["rms_all_N"] == pytest.approx(0.157, abs=0.002)
    assert published["preload_mm"] is None


@pytest.mark.slow
def test_a_killed_run_on_one_core_ends_with_the_same_bytes(whole, tmp_path, monkeypatch):
    monkeypatch.setattr(jobs, "cores", lambda: 1)
    monkeypatch.setattr(workers, "cores", lambda: 1)
    directory = tmp_path / "out"

    def interrupt(name: str, done: float, total: float) -> None:
        if name.startswith("kite-1.5m/hold") and done > 0.2:
            raise KeyboardInterrupt  # in the middle of a fit, as Ctrl-C or a lost machine does

    with pytest.raises(KeyboardInterrupt):
        light.reproduce(directory, monkeypatch, report=interrupt)
    assert list(directory.rglob(".checkpoint"))
    assert not (directory / "complete.json").exists()
    light.reproduce(directory, monkeypatch)
    assert results(directory) == results(whole)


def test_another_seed_is_refused_the_folder_and_gives_other_draws(whole, tmp_path, capsys):
    before = results(whole)
    assert main(["reproduce", "--output", str(whole), "--seed", "1"]) == 2
    error = capsys.readouterr().err
    assert "seed" in error and "Traceback" not in error
    assert results(whole) == before


def test_a_finished_run_is_left_alone(whole, monkeypatch):
    times = {path: os.stat(path).st_mtime_ns for path in whole.rglob("*") if path.is_file()}
    light.reproduce(whole, monkeypatch)
    assert times == {path: os.stat(path).st_mtime_ns for path in whole.rglob("*") if path.is_file()}


@pytest.mark.slow
def test_all_four_wires_converge_under_both_likelihoods(tmp_path):
    assert main(["reproduce", "--output", str(tmp_path / "out")]) == 0
    rows = read_json(tmp_path / "out" / "sampling.json")
    assert len(rows) == 16
    for row in rows:
        assert row["converged"], row
        assert row["smallest_ess"] >= 4000 and row["largest_nested_r_hat"] <= 1.01

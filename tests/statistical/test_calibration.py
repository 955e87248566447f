"""A small calibration study: the real likelihood inside the joint band, one without the setting error outside."""

import numpy as np
import pytest

from analyses.calibration import simulation_based_calibration
from analyses.calibration.__main__ import run, shares
from analyses.calibration.study import BROKEN, STUDIES, Study
from wirebayes.inference.policy import Policy

pytestmark = pytest.mark.statistical


def test_the_band_holds_uniform_shares_with_the_stated_probability():
    rng = np.random.default_rng(0)
    level = simulation_based_calibration.threshold(60, 4, 0.9, replicates=20_000)
    hits = [
        min(simulation_based_calibration.extremeness(rng.uniform(size=60)) for _ in range(4)) >= level
        for _ in range(1000)
    ]
    assert np.mean(hits) == pytest.approx(0.9, abs=4 * np.sqrt(0.09 / 1000))


@pytest.mark.parametrize(
    "bend", [lambda u: u**1.6, lambda u: 0.5 + 0.6 * (u - 0.5), lambda u: np.where(u < 0.5, 0.5 * u, 1 - 0.5 * (1 - u))]
)
def test_shares_that_lean_crowd_or_flee_are_outside(bend):
    rng = np.random.default_rng(1)
    made = {f"q{i}": rng.uniform(size=300) for i in range(8)}
    assert simulation_based_calibration.verdict(made, replicates=20_000)["inside"]
    found = simulation_based_calibration.verdict(made | {"q3": bend(rng.uniform(size=300))}, replicates=20_000)
    assert found["outside"] == ["q3"]


def test_the_band_s_edges_are_the_verdict():
    shares = np.random.default_rng(2).uniform(size=100) ** 1.3
    level = simulation_based_calibration.threshold(100, 1, 0.9, replicates=5_000)
    points, lower, upper = simulation_based_calibration.band(100, level)
    counted = np.searchsorted(np.sort(shares), points, side="right") / 100
    inside = ((counted >= lower) & (counted <= upper)).all()
    assert inside == (simulation_based_calibration.extremeness(shares) >= level)


def test_a_data_set_is_the_same_whoever_fits_it_and_a_cut_file_is_finished(tmp_path):
    hasty = Policy(ensembles=2, walkers=48, rounds=1, round_draws=768, most_rounds=1, ess=10.0, block=12, most_steps=12)
    study, again = (Study("paper", "hold", policy=hasty) for _ in range(2))
    whole = run(study, 2, tmp_path, 0, 2)
    path = tmp_path / "paper-hold-seed0.jsonl"
    content = path.read_bytes()
    path.write_bytes(content[: len(content) - 40])
    assert run(again, 2, tmp_path, 0, 1) == whole
    assert path.read_bytes() == content


@pytest.mark.slow
@pytest.mark.parametrize("study", STUDIES, ids=lambda study: study.name)
def test_forty_data_sets_of_each_study_lie_in_the_band(study, tmp_path):
    rows = run(study, 40, tmp_path, 1, 2)
    found = simulation_based_calibration.verdict(shares(rows), replicates=20_000)
    assert found["inside"], found
    assert sum(not row["converged"] for row in rows) <= 1


@pytest.mark.slow
def test_a_likelihood_without_the_setting_error_is_found_out(tmp_path):
    found = simulation_based_calibration.verdict(shares(run(BROKEN, 100, tmp_path, 1, 2)), replicates=20_000)
    assert "sensor_sd" in found["outside"]  # it has to take the setting error upon itself

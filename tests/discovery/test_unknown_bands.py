"""The study of the smooth discrepancy's bands: files as users read them, means over files, and groups."""

import pytest

from analyses.discovery.unknown_bands import candidates, one, summary


def test_files_have_one_effect_and_one_seed_has_each_once():
    every = candidates(0)
    assert len(set(every)) == len(every) > 120
    assert {len(spec.names) for spec in every} == {1}


def test_a_file_is_predicted_by_both_models():
    row = one(0, 2)
    assert row["names"] == candidates(0)[2].names
    for model in ("plain", "smooth"):
        assert 0.0 <= row[model]["inside"] <= 1.0 and row[model]["rmse_N"] > 0.0


def row(protocol, plain, smooth, error):
    return {
        "protocol": protocol,
        "plain": {"inside": plain, "rmse_N": 2.0},
        "smooth": {"inside": smooth, "rmse_N": error},
    }


def test_shares_are_means_over_files_of_each_group():
    found = summary([row("paper", 0.4, 0.8, 1.0), row("paper", 0.8, 1.0, 3.0), {"protocol": "dense"}])
    assert found["out_of_reach"] == 1
    groups = found["groups"]
    assert groups["all"] == groups["paper"] and groups["dense"] is None
    assert groups["all"]["inside"]["plain"]["value"] == pytest.approx(0.6)
    assert groups["all"]["inside"]["smooth"]["value"] == pytest.approx(0.9)
    assert groups["all"]["error_ratio"]["median"] == pytest.approx(1.0)
    assert groups["missed"]["files"] == 1 and groups["missed"]["error_ratio"]["median"] == 0.5

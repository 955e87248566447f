"""Outlying specimens: found where they do, hardly ever where they do not."""

import numpy as np
import pytest

from wirebayes.results import outliers as module
from wirebayes.results.outliers import FALSE_ALARMS, outliers, robust_z, threshold


def row(name, k1, sd=0.01, material="line", length=1000.0, b=0.2):
    def quantiles(middle):
        return {"q05": middle * np.exp(-1.645 * sd), "q50": middle, "q95": middle * np.exp(1.645 * sd)}

    return {"name": name, "material": material, "length_mm": length,
            "parameters": {"k1": quantiles(k1), "B": quantiles(b * length / 1000.0)}}  # fmt: skip


def lot(n=12, seed=0, **about):
    rng = np.random.default_rng(seed)
    return [row(f"s{i}", 1000.0 * np.exp(0.02 * rng.normal()), **about) for i in range(n)]


def test_a_specimen_that_lies_apart_is_named_with_its_parameter():
    (found,) = outliers([*lot(), row("odd", 2000.0)])
    assert (found.experiment, found.parameter, found.specimens) == ("odd", "k1", 13)
    assert found.z > threshold(13, 2)
    assert found.sentence.startswith("odd: k1 is 2000, ")
    assert "above the median of 13 specimens of line" in found.sentence


def test_an_uncertain_specimen_is_none():
    assert not outliers([*lot(), row("vague", 2000.0, sd=0.5)])


def test_length_is_no_reason_to_lie_apart():
    assert not outliers([*lot(6), *(row(f"long{i}", 1000.0 + i, length=3000.0) for i in range(6))])


def test_few_specimens_and_failed_ones_are_passed_over():
    failed = {"name": "f", "material": "line", "length_mm": 1.0, "parameters": {}}
    assert not outliers([*lot(4), row("odd", 9000.0), failed])
    assert not outliers([*lot(), *lot(3, material="other"), row("odd", 9000.0, material="other")])


@pytest.mark.parametrize(("specimens", "compared"), [(5, False), (6, True)])
def test_six_specimens_are_compared_five_are_not(specimens, compared):
    assert bool(outliers([*lot(specimens - 1), row("odd", 9e7)])) is compared


def test_creep_is_compared_per_metre_of_length_and_said_so():
    (found,) = outliers([*lot(), row("odd", 1000.0, length=2000.0, b=0.8)])
    assert (found.parameter, found.value, found.median) == ("B", pytest.approx(0.8), pytest.approx(0.2))
    assert "B per m of length is 0.8" in found.sentence


def test_a_low_specimen_lies_below_and_the_farthest_comes_first():
    found = outliers([*lot(), row("low", 500.0), row("lower", 200.0)])
    assert [o.experiment for o in found] == ["lower", "low"]
    assert "below the median" in found[0].sentence and found[0].z < 0


def test_a_robust_z_is_the_distance_in_expected_distances():
    """Nine values whose median absolute deviation is one, each known to 0.5, one of them badly."""
    values = np.array([-4.0, -3.0, -1.0, -0.5, 0.0, 0.5, 1.0, 3.0, 4.0])
    sd = np.full(9, 0.5)
    sd[8] = 3.0
    spread = 1.4826**2 - 0.25  # what the posteriors' width does not explain
    expected = values / np.sqrt(spread + sd**2)
    assert robust_z(values, sd) == pytest.approx(expected)
    # scatter that the posteriors explain leaves no spread
    assert robust_z(values, np.full(9, 2.0)) == pytest.approx(values / 2.0)


def test_equal_specimens_divide_nothing_by_zero():
    same = [row(f"s{i}", 1000.0, sd=0.0) for i in range(8)]
    assert not outliers(same)
    assert [o.experiment for o in outliers([*same, row("odd", 1001.0, sd=0.0)])] == ["odd"]


def share_of_false_alarms(specimens, sets=10_000):
    """Of parameters of alike specimens."""
    rng = np.random.default_rng(1)
    limit, known = threshold(specimens, 8), np.zeros(specimens)
    return np.mean([np.abs(robust_z(rng.normal(size=specimens), known)).max() > limit for _ in range(sets)])


@pytest.mark.parametrize("specimens", [6, 12, 50])
def test_the_share_of_false_alarms_is_what_is_said(specimens):
    # eight parameters of a material; 10,000 sets tell the share of one to .0008
    assert 0.5 * FALSE_ALARMS / 8 < share_of_false_alarms(specimens) < 1.5 * FALSE_ALARMS / 8


def test_the_share_would_be_seen_to_be_wrong(monkeypatch):
    monkeypatch.setattr(module, "MAD_EFFICIENCY", 1.0)
    assert share_of_false_alarms(12) > 1.5 * FALSE_ALARMS / 8

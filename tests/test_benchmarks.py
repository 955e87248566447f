"""What benchmarks measure of a fit: its parts add up to the whole."""

import pytest

from analyses.benchmarks.plain import ours
from wirebayes.io import paper
from wirebayes.model.problem import build


def test_a_fit_is_timed_in_its_parts():
    found, values = ours(build([paper.experiments()[2].train(5)]), 0, 0.0, wanted=500)
    assert found["cpu_s"].keys() == {"burn", "sample"} and min(found["cpu_s"].values()) > 0
    assert found["sampling_per_cpu_s"] == pytest.approx(found["ess"] / found["cpu_s"]["sample"])
    assert found["all_costs_per_cpu_s"] < found["sampling_per_cpu_s"] and values.shape[-1] == 8

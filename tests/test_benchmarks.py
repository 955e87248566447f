"""What benchmarks measure of a fit: its parts add up to the whole; the model that peers sample is the package's."""

import numpy as np
import pytest

from analyses.benchmarks import cost, measure, model
from analyses.benchmarks.plain import ours
from wirebayes.io import paper
from wirebayes.model.build import build
from wirebayes.model.spec import ModelSpec


def test_a_fit_is_timed_in_its_parts():
    found, values = ours(build([paper.experiments()[2].train(5)]), 0, 0.0, wanted=500)
    assert found["cpu_s"].keys() == {"burn", "sample"} and min(found["cpu_s"].values()) > 0
    assert found["sampling_per_cpu_s"] == pytest.approx(found["ess"] / found["cpu_s"]["sample"])
    assert found["all_costs_per_cpu_s"] < found["sampling_per_cpu_s"] and values.shape[-1] == 8


@pytest.mark.parametrize(("wire", "likelihood"), [(1, "chain"), (2, "chain"), *((wire, "hold") for wire in range(4))])
def test_peers_sample_the_same_posterior(wire, likelihood):
    """Of the other two wires a setting error may leave the first hold slack, which the peers do not know."""
    problem = build([paper.experiments()[wire]], spec=ModelSpec(likelihood=likelihood))
    assert model.difference(np, problem, 0) < 1e-8


@pytest.mark.parametrize(("wire", "may_be"), [(0, True), (1, False), (2, False), (3, True)])
def test_wires_that_may_be_slack_are_told_from_others(wire, may_be):
    assert model.may_be_slack(build([paper.experiments()[wire]]), 0) == may_be


def test_peers_in_natural_parameters_have_the_prior_of_the_package():
    """Coordinates of draws from the prior are standard normal, and lead back to the draws."""
    problem = build([paper.experiments()[2]])
    problem = problem.in_units(problem.own_units)
    draws = problem.prior.rvs(4000, np.random.default_rng(0))
    for i, (name, kind, middle, sd) in enumerate(model.prior_terms(problem)):
        coordinate = model.coordinate_of(draws[:, i], kind)
        assert name == problem.names[i]
        assert np.allclose(model.value_of(np, coordinate, kind), draws[:, i], rtol=1e-12)
        score = (coordinate - middle) / sd
        assert abs(score.mean()) < 0.08 and abs(score.std() - 1.0) < 0.06  # five standard errors


def test_numpy_is_compared_with_compiled_code_by_effect_and_batch(monkeypatch, capsys):
    monkeypatch.setattr(cost, "BATCHES", (2, 4))
    monkeypatch.setattr(cost, "REPEATS", 1)
    found = cost.against_numpy(paper.experiments()[0])
    assert found.keys() == {"none", *cost.DEAREST}
    assert all(len(ratios) == 2 and min(ratios) > 0 for ratios in found.values())
    assert capsys.readouterr().out.count("\n") == 5  # a blank line, a header, a line a model


@pytest.mark.parametrize("walkers", [1, 64])
def test_independent_draws_are_effective_draws(walkers):
    steps = 64_000 // walkers
    values = np.random.default_rng(1).normal(size=(4, steps // 4, walkers, 2))
    found = measure.judged(measure.Costs({"sample": 1.0}, {"sample": 1.0}), values)
    assert found["converged"]
    assert found["ess"] == pytest.approx(64_000, rel=0.25) and found["ess_of_means"] == pytest.approx(64_000, rel=0.25)

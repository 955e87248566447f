"""Held-out holds in `discover`: the 90 % band against the dense normal, and truncated importance weights."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from tests.model.dense import normal
from tests.simulated import simulated_tests
from wirebayes.discovery import held_out
from wirebayes.io.experiment import Experiment
from wirebayes.model.problem import build
from wirebayes.simulation.synthetic import Bench, Truth
from wirebayes.wire.staircase import Model

WIRE = {"k1": 900.0, "B": 0.25, "U": 0.6, "k2": 0.05, "N": 0.7, "preload": 0.4, "sensor_sd": 0.01, "setting_sd": 0.02}
TRAIN = 7


def moved(experiment: Experiment, deviations: float) -> Experiment:
    """The readings of the holds after training, so many predictive standard deviations above their prediction."""
    r, covariance, hold = normal(experiment.protocol(), WIRE, Model(), experiment.tension(), experiment.resolution_N)
    past = hold < TRAIN
    gain = covariance[np.ix_(~past, past)] @ np.linalg.inv(covariance[np.ix_(past, past)])
    sd = np.sqrt(np.diag(covariance[np.ix_(~past, ~past)] - gain @ covariance[np.ix_(past, ~past)]))
    nominal = experiment.tension()[TRAIN:].ravel() - r[~past]
    readings = (nominal + gain @ r[past] + deviations * sd).reshape(-1, experiment.tension().shape[1])
    later = [replace(h, tension_N=row) for h, row in zip(experiment.holds[TRAIN:], readings, strict=True)]
    return replace(experiment, holds=(*experiment.holds[:TRAIN], *later))


@pytest.mark.parametrize("side", [-1, 1])
def test_readings_are_inside_up_to_1_645_predictive_standard_deviations(
    side: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    experiment = simulated_tests([Bench()], Truth(WIRE), seed=2)[0]
    problem = build([experiment.train(TRAIN)])
    theta = np.tile([WIRE[name] for name in problem.names], (4000, 1))  # a posterior that is one point
    monkeypatch.setattr(held_out, "fitted", lambda *_: None)
    monkeypatch.setattr(held_out, "_draws", lambda *_: (problem, theta))
    block = SimpleNamespace(effects=None, law="hooke", history="saturating")
    # a quantile of 4000 normal draws has a standard error of 0.033 standard deviations
    for deviations, share in ((1.5, 1.0), (1.8, 0.0)):
        measured = moved(experiment, side * deviations)
        [found] = held_out.predicted([measured], [TRAIN], (), block, np.random.default_rng(0))  # type: ignore[arg-type]
        assert found.holds == [8, 9, 10, 11, 12] and found.readings == 5 * experiment.tension().shape[1]
        assert found.inside == share, deviations


def test_importance_weights_are_truncated(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ionides (2008): no importance weight above the mean weight times the square root of their number."""
    rng = np.random.default_rng(0)
    density = stats.lognorm(0.7).rvs((4, 1500), random_state=rng)
    density[1, 3] = 1e-9  # a draw under which hold 2 could hardly have happened
    density[2, :40] = 1e-5
    impossible = density.copy()
    impossible[0, 7] = 0.0
    recorded = np.array([True, True, True, False])
    problem = SimpleNamespace(
        leave_one_hold_out=lambda theta: [np.log(density)],
        samples=[SimpleNamespace(protocol=SimpleNamespace(recorded=recorded))],
    )
    monkeypatch.setattr(held_out, "_draws", lambda *_: (problem, np.zeros((1500, 1))))
    found = held_out.truncated_leave_one_hold_out(SimpleNamespace(), rng)  # type: ignore[arg-type]
    expected = []
    for p in density[:3]:
        weight = np.minimum(1 / p, np.mean(1 / p) * np.sqrt(1500))
        expected.append(np.log(np.average(p, weights=weight)))
    assert found == pytest.approx(expected, rel=1e-9)
    whole = np.log(stats.hmean(density[:3], axis=1))  # what weights without a ceiling give
    assert found[0] == pytest.approx(whole[0]) and found[1] > whole[1] + 3.0
    with np.errstate(divide="ignore"):  # a hold that cannot happen under one draw is not predicted by the others at all
        problem.leave_one_hold_out = lambda theta: [np.log(impossible)]
        found = held_out.truncated_leave_one_hold_out(SimpleNamespace(), rng)  # type: ignore[arg-type]
    assert found[0] < -1e5 and found[1:] == pytest.approx(expected[1:], rel=1e-9)

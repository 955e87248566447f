"""Amplitudes that are shares: creep that is nearly all permanent fits by another amount and exponent than the plain."""

import numpy as np
import pytest

from tests.simulated import simulated_tests
from wirebayes.discovery import screening
from wirebayes.discovery.linear_scan import expand, scan
from wirebayes.discovery.name_evidence import reaches, weigh_names
from wirebayes.discovery.refit import LARGEST
from wirebayes.effects import CATALOGUE, effect_named
from wirebayes.inference.laplace_fit import LaplaceFit, fitted
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.inference.weighted_posterior import witnessed
from wirebayes.model.problem import Problem
from wirebayes.model.spec import PLAIN_SPEC
from wirebayes.simulation.synthetic import Bench, Truth

TRUTH = {"k1": 14000.0, "B": 0.076, "U": 0.74, "k2": 0.015, "N": 0.74, "preload": 0.0, "sensor_sd": 0.07}
WEIGHTS = Bench(weights_N=tuple(67.0 * np.arange(1, 10)), times_s=(0.0, *np.geomspace(25.0, 760.0, 7).tolist()))


@pytest.fixture(scope="module")
def plain() -> LaplaceFit:
    """A wire under rising weights, nine tenths of whose creep are permanent, fitted without that."""
    effect = effect_named("permanent_creep")
    truth = Truth(TRUTH | {"setting_sd": 0.5, "permanent_creep.psi": 0.93}, [effect])
    return fitted(simulated_tests([WEIGHTS], truth, seed=3), (), PLAIN_SPEC, np.random.default_rng(0))


def log_integral(problem: Problem) -> float:
    """Of the posterior density, by weighted draws."""
    found = witnessed(LogPosterior(problem), np.random.default_rng(0), 300.0)
    assert found.settled[0]
    return float(found.log_integral[0])


def test_the_evidence_of_a_large_share_is_that_of_weighted_draws(plain: LaplaceFit) -> None:
    """A valley lies between it and none: paths from little of it end there, eight nats below."""
    kinds = {"permanent_creep": CATALOGUE["permanent_creep"]}
    trials, candidates = screening.candidate_probes([plain], kinds)
    data = [scan(expand(plain.target, plain.z, trials))]
    found = weigh_names([plain], trials, candidates, data, reach=reaches([plain], trials, candidates))
    (best,) = found.winners["permanent_creep"]
    by_draws = log_integral(plain.problem_with(best.effect)) - log_integral(plain.target.problem)
    assert best.amplitude == pytest.approx(0.93, abs=0.05)
    assert best.log_bayes == pytest.approx(by_draws, abs=0.5)


def test_only_a_share_reaches_to_its_own_end(plain: LaplaceFit) -> None:
    kinds = {name: CATALOGUE[name] for name in ("permanent_creep", "superposition", "sensor_drift")}
    trials, candidates = screening.candidate_probes([plain], kinds)
    found = {key: reach for (key, _), reach in reaches([plain], trials, candidates).items()}
    assert found["permanent_creep"] == found["superposition"] == np.inf
    x = expand(plain.target, plain.z, trials)
    (drift,) = {c.probe for c in candidates if trials[c.probe].effect.key == "sensor_drift"}
    assert scan(x).norm[0, drift] * found["sensor_drift"] == pytest.approx(LARGEST, rel=0.5)

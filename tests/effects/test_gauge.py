"""The prior of a gauge's nonlinearity under weights: a share of what is read, in however many steps it is read."""

import numpy as np
import pytest

from tests.simulated import simulated_tests
from wirebayes.discovery import refit
from wirebayes.discovery.linear_scan import expand, scan
from wirebayes.discovery.probes import probes
from wirebayes.effects import effect_named
from wirebayes.inference.laplace_fit import LaplaceFit, fitted
from wirebayes.io.experiment import Experiment
from wirebayes.model.build import build
from wirebayes.model.scales import scales_of
from wirebayes.model.spec import PLAIN_SPEC
from wirebayes.simulation.synthetic import Bench, Truth

WIRE = {"k1": 500.0, "B": 0.3, "U": 0.8, "k2": 0.03, "N": 0.8, "preload": 0.0, "sensor_sd": 0.01, "setting_sd": 0.01}
TIMES = np.linspace(0.0, 120.0, 7).tolist()
GAUGE = effect_named("sensor_nonlinearity")
COLUMN = "sensor_nonlinearity.a"


def hung(weights_N: list[float], truth: Truth = Truth(WIRE), seed: int = 1) -> Experiment:  # noqa: B008 - it is frozen
    bench = Bench("hung", "line", 1000.0, weights_N=weights_N, resolution_mm=0.0, times_s=TIMES)
    (test,) = simulated_tests([bench], truth, seed)
    return test


def evidence(block: LaplaceFit, name: str) -> float:
    """Log Bayes factor of an effect, refitted."""
    effect = effect_named(name).on([e.protocol() for e in block.experiments], scales_of(block.experiments).range_mm)
    found = scan(expand(block.target, block.z, probes(effect)))
    best = int(np.argmax(found.effects[0]))
    per_delta = 1.0 / float(found.norm[0, best])
    guess = float(found.amplitude[0, best])
    return refit.refit([block], (0,), effect, per_delta, guess, refit.LARGEST * per_delta).log_bayes


@pytest.mark.parametrize("holds", [2, 5, 13])
def test_its_width_is_a_few_per_cent_of_what_is_read_however_many_steps_it_is(holds):
    hardly_creeping = Truth(WIRE | {"B": 0.01, "setting_sd": 0.002})  # so that it stretches in proportion
    test = hung(np.linspace(0.25, 3.25, holds).tolist(), hardly_creeping)
    (at_typical,) = hung([1.75], hardly_creeping).recorded_holds
    problem = build([test], [GAUGE])
    share = problem.prior.distributions[COLUMN].std() * at_typical.readings[0]
    assert share == pytest.approx(0.08, rel=0.03)


def test_of_steps_and_weights_together_each_instrument_has_its_own():
    stepped = Bench("stepped", "line", 1000.0, displacements_mm=(1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0), times_s=TIMES)
    (steps,) = simulated_tests([stepped], Truth(WIRE), 2)
    weights = hung(np.linspace(0.5, 3.5, 7).tolist())
    problem = build([steps, weights], [GAUGE])
    priors = problem.prior.distributions
    assert priors[f"{COLUMN}[displacement]"].std() * problem.scales.tension_N == pytest.approx(0.08)
    # the typical weight is four of its steps
    assert priors[f"{COLUMN}[force]"].std() * 4.0 * problem.scales.step_mm == pytest.approx(0.08)


@pytest.mark.parametrize("seed", [1, 2, 4])
def test_a_gauge_that_is_wrong_by_a_few_per_cent_is_no_less_likely_than_a_wire_that_softens(seed):
    """Were it a few per cent of each of thirteen steps, most of the prior would lie where the gauge is half wrong."""
    truth = Truth(WIRE | {COLUMN: 0.012}, (GAUGE,))
    block = fitted([hung(np.linspace(0.25, 3.25, 13).tolist(), truth, seed)], (), PLAIN_SPEC, np.random.default_rng(0))
    assert evidence(block, "sensor_nonlinearity") > evidence(block, "strain_stiffening") > 4.0

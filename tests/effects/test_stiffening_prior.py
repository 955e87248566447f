"""A stiffening is as likely in a rubber band as in a steel rope: its prior refers to the strain of the test."""

import numpy as np
import pytest

from tests.simulated import WIRE, simulated_tests
from wirebayes.discovery.screening import candidate_probes
from wirebayes.effects import CATALOGUE, effect_named
from wirebayes.inference.laplace_fit import fitted
from wirebayes.model.build import build
from wirebayes.model.spec import PLAIN_SPEC
from wirebayes.simulation.synthetic import Bench, Truth

COLUMN = "strain_stiffening.c"
WIRES = {"rubber": 10.0, "nylon": 900.0, "steel": 2e5}


def stepped(k1: float, seed: int = 1):
    """A test to a few newtons by steps of a size for such a wire, 1 m long."""
    step = 400.0 / k1
    wire = WIRE | {"k1": k1, "B": 0.1 * step, "preload": 0.5 * step, "setting_sd": 0.01 * step}
    bench = Bench(displacements_mm=tuple(step * np.arange(1, 13)))
    (test,) = simulated_tests([bench], Truth(wire), seed)
    return test


def hung(k1: float):
    weights = tuple(np.linspace(0.4, 4.8, 12))
    wire = WIRE | {"k1": k1, "B": 1.0 / k1, "sensor_sd": 1.0 / k1}
    (test,) = simulated_tests([Bench(weights_N=weights, resolution_mm=1e-6)], Truth(wire), 1)
    return test


@pytest.mark.parametrize("k1", WIRES.values(), ids=WIRES)
@pytest.mark.parametrize("made", [stepped, hung])
def test_the_tension_is_a_quarter_larger_where_the_wire_is_stretched_most(made, k1: float) -> None:
    problem = build([made(k1)], [effect_named("strain_stiffening")])
    strain = 4.8 / k1
    assert problem.prior.distributions[COLUMN].std() * strain == pytest.approx(0.25, rel=0.15)


@pytest.mark.parametrize("k1", WIRES.values(), ids=WIRES)
def test_a_search_looks_for_it_by_that_prior(k1: float) -> None:
    block = fitted([stepped(k1)], (), PLAIN_SPEC, np.random.default_rng(0))
    trials, _ = candidate_probes([block], {"strain_stiffening": CATALOGUE["strain_stiffening"]})
    (sd,) = {trial.effect.amplitudes[0].prior.std() for trial in trials}
    assert sd * 4.8 / k1 == pytest.approx(0.25, rel=1e-9)

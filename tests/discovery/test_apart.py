"""Whether samples that are fitted at once differ: said of those that do, and rarely of those that do not."""

import numpy as np
import pytest

from tests.simulated import WIRE, simulated_tests
from wirebayes.discovery.apart import APART, p_alike
from wirebayes.inference.laplace_fit import fitted
from wirebayes.model.spec import PLAIN_SPEC
from wirebayes.simulation.synthetic import Bench, Truth


def _block(seed, factors, lengths=(1000.0, 1000.0)):
    """Two samples of one material; the second with parameters that are so many times those of the first."""
    tests = []
    for name, length_mm, of in zip("ab", lengths, ({}, factors), strict=True):
        own = {key: value * of.get(key, 1.0) for key, value in WIRE.items()}
        own["B"] *= length_mm / 1000.0
        bench = Bench(name=name, length_mm=length_mm, displacements_mm=tuple(range(1, 8)))
        tests += simulated_tests([bench], Truth(own), seed=seed + ord(name))
    return fitted(tests, (), PLAIN_SPEC, np.random.default_rng(seed))


def _p(block, seed=0):
    return p_alike(block, np.random.default_rng(seed), 199)


@pytest.mark.parametrize("factors", [{"k1": 1.05}, {"B": 1.3}, {"U": 1.3}])
def test_samples_that_differ(factors):
    assert _p(_block(1, factors)) <= APART


@pytest.mark.parametrize("lengths", [(1000.0, 1000.0), (1000.0, 1700.0)])
def test_samples_that_are_alike_are_told_apart_as_often_as_chance_does(lengths):
    p = np.array([_p(_block(10 * seed, {}, lengths)) for seed in range(12)])
    assert (p <= APART).sum() <= 1 and 0.2 < p.mean() < 0.8


def test_what_a_sample_has_for_itself_is_no_difference():
    """Preload, sensor and setting error belong to a test."""
    assert _p(_block(2, {"preload": 1.5, "sensor_sd": 3.0, "setting_sd": 2.0})) > 0.05


def test_one_sample_does_not_differ():
    block = _block(3, {})
    alone = fitted(block.experiments[:1], (), PLAIN_SPEC, np.random.default_rng(0))
    assert p_alike(alone, np.random.default_rng(0)) is None

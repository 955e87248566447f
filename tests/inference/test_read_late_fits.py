"""Tests whose first readings are late are sampled in bounded time, with the long tail of k1 that they leave open."""

import numpy as np
import pytest

from wirebayes.inference.fit import fit_problem
from wirebayes.inference.policy import Policy
from wirebayes.simulation.synthetic import Bench, Truth, draw

FEW = Policy(walkers=64, round_draws=2048, ess=1000.0, most_steps=800)
WIRE = {"k1": 900.0, "B": 0.2, "U": 0.8, "k2": 0.3, "N": 0.6, "preload": 0.5}
STEPS_MM = tuple(range(2, 22, 2))


@pytest.mark.parametrize(
    ("bench", "own", "most"),
    [
        # 147,000 with a stiffness by the loss of one hold, and with the preload as it is
        (Bench(displacements_mm=STEPS_MM, times_s=(24.0, 72.0, 120.0)), {"sensor_sd": 0.3, "setting_sd": 0.05}, 60_000),
        # not converged after 219,000
        (
            Bench(weights_N=tuple(range(4, 22, 3)), times_s=np.linspace(24.0, 120.0, 15)),
            {"sensor_sd": 0.05, "setting_sd": 0.05, "preload": -2.0, "k2": 2.0},
            80_000,
        ),
    ],
    ids=["steps", "weights"],
)
def test_tests_that_are_read_late_are_sampled_in_bounded_time(bench, own, most):
    done = fit_problem(draw([bench], Truth(WIRE | own), seed=1).problem, 1, policy=FEW)
    assert done.converged
    assert done.chains.evaluations < most

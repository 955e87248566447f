"""A creep curve, or a relaxation, of one hold by a power law of time: one mode, sampled in bounded time.

What one hold leaves open, stiffness against preload against setting error, is far wider than what it knows.
"""

import numpy as np
import pytest

from wirebayes.inference.fit import fit_problem
from wirebayes.inference.policy import Policy
from wirebayes.io.arrays import from_arrays
from wirebayes.model.build import build

FEW = Policy(walkers=64, round_draws=2048, ess=1000.0, most_steps=800)
TIME_S = np.append(0.0, np.geomspace(3.6, 3600.0, 39))
NOISE = 1e-3 * np.random.default_rng(0).normal(size=40)
CONSTANT = np.full(40, 20.0)
CREPT = 1.0 + 0.1 * (TIME_S / 36.0) ** 0.2
RELAXED = (1.0 + TIME_S / 60.0) ** -0.2


@pytest.mark.parametrize(
    ("control", "stretch_mm", "tension_N"),
    [("force", 20.0 * (CREPT + NOISE), CONSTANT), ("displacement", CONSTANT, 20.0 * (RELAXED + NOISE))],
    ids=["creep", "relaxation"],
)
def test_a_power_law_of_one_hold_is_sampled_in_bounded_time(control, stretch_mm, tension_N):
    ones = np.ones(40, int)
    test = from_arrays(ones, stretch_mm, TIME_S, tension_N, length_mm=1e3, name="w", material="w", control=control)
    done = fit_problem(build([test]), policy=FEW)
    assert done.converged
    assert done.chains.modes == 1
    assert done.chains.evaluations < 200_000  # with the coordinates of several holds the creep had no end

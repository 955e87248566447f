"""Several holds of one weight, or at one displacement: sampled in bounded time, though their stiffness is open."""

import numpy as np
import pytest

from wirebayes.inference.fit import fit_problem
from wirebayes.inference.policy import Policy
from wirebayes.simulation.synthetic import Bench, Truth, draw

FEW = Policy(walkers=64, round_draws=2048, ess=1000.0, most_steps=800)
WIRE = {"k1": 800.0, "B": 1.0, "U": 0.5, "k2": 0.03, "N": 0.5, "preload": 0.0}
TIMES_S = np.geomspace(1.0, 3000.0, 20)


@pytest.mark.parametrize(
    "bench",
    [
        Bench(weights_N=(20.0, 20.0), times_s=TIMES_S, resolution_mm=1e-4),
        Bench(weights_N=(20.0, 20.06), times_s=TIMES_S, resolution_mm=1e-4),
        Bench(weights_N=(20.0, 1.0, 20.0), times_s=TIMES_S, unrecorded=frozenset({2}), resolution_mm=1e-4),
        Bench(displacements_mm=(25.0,) * 5, times_s=TIMES_S, resolution_N=1e-4),
    ],
    ids=["one weight", "nearly one weight", "with a rest", "one displacement"],
)
@pytest.mark.parametrize("setting_sd", [0.0, 0.02], ids=["exact", "set by hand"])
def test_holds_of_one_setting_are_sampled_in_bounded_time(bench, setting_sd):
    made = draw([bench], Truth(WIRE | {"sensor_sd": 0.005, "setting_sd": setting_sd}), seed=4)
    done = fit_problem(made.problem, policy=FEW)
    assert done.converged
    assert done.chains.evaluations < 100_000  # with the coordinates of several settings 110,000 to 1.6 million


def test_specimens_of_one_weight_each_are_sampled_in_bounded_time():
    benches = [Bench(name, weights_N=(20.0,), times_s=TIMES_S, resolution_mm=1e-4) for name in "abc"]
    done = fit_problem(draw(benches, Truth(WIRE | {"sensor_sd": 0.005, "setting_sd": 0.1}), seed=4).problem)
    assert done.converged
    assert done.chains.evaluations < 150_000  # 240,000 without what the errors have in common, 5 million without either


def test_specimens_at_one_displacement_each_are_sampled_in_bounded_time():
    benches = [Bench(name, displacements_mm=(25.0,), times_s=TIMES_S, resolution_N=1e-4) for name in "abc"]
    done = fit_problem(draw(benches, Truth(WIRE | {"sensor_sd": 0.005, "setting_sd": 0.0}), seed=4).problem)
    assert done.converged
    assert done.chains.evaluations < 120_000  # in the coordinates of several settings 390,000 were not enough

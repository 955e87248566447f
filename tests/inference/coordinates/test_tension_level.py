"""One hold: wires that end it at one tension lie at one coordinate, whatever their preload, stiffness and creep."""

import numpy as np
import pytest
from scipy.optimize import brentq

from wirebayes.inference.coordinates.steps import Level
from wirebayes.inference.coordinates.transform import Transformation
from wirebayes.model.build import build
from wirebayes.simulation.synthetic import Bench, Truth, draw

ONE_HOLD = draw([Bench(displacements_mm=(3.0,))], Truth({"k1": 800.0, "preload": 0.0}), seed=8).problem
LENGTH_MM, HOLD_S = 1000.0, float(ONE_HOLD.samples[0].protocol.duration_s[0])


def last_reading(k1: float, B: float, U: float, k2: float, N: float, preload: float) -> float:
    """Tension at the end of the hold, by the model's equations."""
    start = k1 * (3.0 + preload) / LENGTH_MM
    creep = B * start**U * -np.expm1(-k2 * HOLD_S**N)
    return float(k1 * ((LENGTH_MM + 3.0 + preload) / (LENGTH_MM + creep) - 1.0))


def test_wires_that_end_at_the_same_tension_lie_at_the_same_coordinate():
    problem = ONE_HOLD
    protocol, readings = problem.samples[0].protocol, problem.samples[0].readings[..., 0]
    reached = float(readings[protocol.mask][-1])
    rng = np.random.default_rng(0)
    theta = problem.prior.rvs(200, rng)
    column = {name: problem.names.index(name) for name in problem.names}
    theta[:, column["preload"]] = rng.uniform(-1.0, 3.0, 200)
    theta[:, column["B"]], theta[:, column["U"]] = rng.uniform(0.02, 0.15, 200), rng.uniform(0.3, 0.9, 200)
    for row in theta:
        others = {name: row[column[name]] for name in ("B", "U", "k2", "N", "preload")}
        row[column["k1"]] = brentq(lambda k1, others=others: last_reading(k1, **others) - reached, 1.0, 5e3)
    z = Transformation(problem).to_sampled(theta)
    assert np.log(theta[:, column["k1"]]).std() > 0.3
    assert z[:, column["k1"]].std() < 0.01


@pytest.mark.parametrize(
    ("problem", "has_one"),
    [
        (ONE_HOLD, True),
        (draw([Bench(displacements_mm=(1.0, 2.0))], Truth(), seed=1).problem, False),
        (draw([Bench(name, displacements_mm=(1.0,)) for name in "ab"], seed=1).problem, False),
        (build([Bench(displacements_mm=(1.0,)).experiment()]), False),  # every reading zero
    ],
    ids=["one hold", "two holds", "two tests", "slack"],
)  # fmt: skip
def test_only_a_test_of_one_hold_has_this_coordinate(problem, has_one):
    def has_it(for_draws):
        return any(isinstance(step, Level) for step in Transformation(problem, for_draws).steps)

    assert has_it(for_draws=True) == has_one
    assert not has_it(for_draws=False)

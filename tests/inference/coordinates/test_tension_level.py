"""One hold: wires that are read as one lie at one coordinate, whatever their preload, stiffness and setting error."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from wirebayes.inference.coordinates.steps import Level
from wirebayes.inference.coordinates.transform import Transformation
from wirebayes.model.build import build
from wirebayes.model.problem import with_readings
from wirebayes.simulation.synthetic import Bench, Truth, draw

WIRE = Truth({"k1": 800.0, "preload": 0.0})
LENGTH_MM, AT_MM, LATE_S = 1000.0, 3.0, (10.0, 30.0, 60.0, 120.0)
ONE_HOLD = draw([Bench(displacements_mm=(AT_MM,))], WIRE, seed=8).problem
READ_LATE = draw([Bench(displacements_mm=(AT_MM,), times_s=LATE_S)], WIRE, seed=8).problem
PRELOAD_KNOWN = replace(
    Bench(displacements_mm=(AT_MM,), times_s=LATE_S).experiment(), priors={"preload": {"fixed": 0.3}}
)
KNOWN = with_readings(build([PRELOAD_KNOWN]), [READ_LATE.samples[0].readings])
NAMES = ("k1", "B", "U", "k2", "N", "preload")


def reading(time_s: float, error: float, k1: float, B: float, U: float, k2: float, N: float, preload: float) -> float:
    """Tension in the hold by the model's equations, where the wire is longer by a share `error` of its stretch."""
    stretch = (AT_MM + preload) * (1.0 + error)
    creep = B * (k1 * stretch / LENGTH_MM) ** U * -np.expm1(-k2 * time_s**N)
    return float(k1 * ((LENGTH_MM + stretch) / (LENGTH_MM + creep) - 1.0))


def wires(problem, rng):
    """Drawn parameters, (200, d), and the columns of a wire's own."""
    theta = problem.prior.rvs(200, rng)
    column = {name: problem.names.index(name) for name in NAMES}
    theta[:, column["preload"]] = rng.uniform(-1.0, 3.0, 200)
    theta[:, column["B"]], theta[:, column["U"]] = rng.uniform(0.02, 0.15, 200), rng.uniform(0.3, 0.9, 200)
    return theta, column


def test_wires_that_are_first_read_at_the_same_tension_lie_at_the_same_coordinate():
    first = float(READ_LATE.samples[0].readings[0, 0, 0])
    theta, column = wires(READ_LATE, np.random.default_rng(0))
    for row in theta:
        own = {name: row[column[name]] for name in NAMES if name != "k1"}
        row[column["k1"]] = brentq(lambda k1, own=own: reading(LATE_S[0], 0.0, k1, **own) - first, 1.0, 5e3)
    z = Transformation(READ_LATE).to_sampled(theta)
    assert np.log(theta[:, column["k1"]]).std() > 0.3
    assert z[:, column["k1"]].std() < 0.01


def test_a_setting_error_moves_one_coordinate_alone():
    """k1 and B are what they have to be so that the hold is read as it was, though the wire was longer than stated."""
    read = ONE_HOLD.samples[0].readings[0, [0, -1], 0]
    theta, column = wires(ONE_HOLD, np.random.default_rng(1))
    error = np.random.default_rng(2).uniform(-0.2, 0.2, len(theta))
    for row, each in zip(theta, error, strict=True):
        own = {name: row[column[name]] for name in ("U", "k2", "N", "preload")}
        row[column["k1"]] = own_k1 = read[0] * LENGTH_MM / ((AT_MM + own["preload"]) * (1.0 + each))
        row[column["B"]] = brentq(
            lambda B, own=own, k1=own_k1, each=each: reading(120.0, each, k1, B, **own) - read[1], 1e-9, 1e3
        )
    z = Transformation(ONE_HOLD).to_sampled(theta)
    assert z[:, column["k1"]] == pytest.approx(-np.log1p(error), abs=1e-9)
    assert np.ptp(theta[:, column["B"]]) > 0.1
    assert np.ptp(z[:, column["B"]]) < 0.01


def test_several_holds_begin_at_the_tension_of_the_first():
    """Wires of one first reading lie at one coordinate, though what they lose is said of all holds."""
    problem = draw([Bench(displacements_mm=(AT_MM,) * 3, times_s=(60.0, 120.0))], WIRE, seed=8).problem
    first = float(problem.samples[0].readings[0, 0, 0])
    theta, column = wires(problem, np.random.default_rng(0))
    for row in theta:
        own = {name: row[column[name]] for name in NAMES if name != "k1"}
        row[column["k1"]] = brentq(lambda k1, own=own: reading(60.0, 0.0, k1, **own) - first, 1.0, 5e3)
    z = Transformation(problem).to_sampled(theta)
    assert np.log(theta[:, column["k1"]]).std() > 0.3
    assert z[:, column["k1"]].std() < 0.001


@pytest.mark.parametrize(
    ("problem", "has_one"),
    [
        (ONE_HOLD, True),
        (KNOWN, True),
        (draw([Bench(displacements_mm=(3.0, 2.71, 3.0))], WIRE, seed=1).problem, True),
        (draw([Bench(displacements_mm=(3.0, 2.69, 3.0))], WIRE, seed=1).problem, False),
        (draw([Bench(displacements_mm=(3.0, 0.0, 3.0))], WIRE, seed=1).problem, True),
        (draw([Bench(displacements_mm=(3.0, 0.1, 3.0))], WIRE, seed=1).problem, False),
        (draw([Bench(displacements_mm=(0.0, 3.0))], WIRE, seed=1).problem, False),
        (draw([Bench(displacements_mm=(3.0, 3.0), unrecorded=frozenset({1}))], WIRE, seed=1).problem, False),
        (draw([Bench(name, displacements_mm=(1.0,)) for name in "ab"], seed=1).problem, False),
        (build([Bench(displacements_mm=(1.0,)).experiment()]), False),  # every reading zero
    ],
    ids=[
        "one hold",
        "one hold of a known preload",
        "alike",
        "two displacements",
        "slack between",
        "nearly slack between",
        "slack before",
        "first not read",
        "two tests",
        "slack",
    ],
)
def test_only_a_test_of_one_displacement_has_this_coordinate(problem, has_one):
    has_it = any(isinstance(step, Level) for step in Transformation(problem).steps)
    assert has_it == has_one

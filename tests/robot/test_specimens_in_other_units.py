"""How much specimens of a line differ does not depend on what is called a newton or a second."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.robot.lines import CORE as TYPICAL_WIRE
from tests.robot.lines import line_about
from tests.simulated import simulated_tests
from wirebayes.commands import wire_draws
from wirebayes.inference.between_specimens import LineDraws
from wirebayes.model.build import build
from wirebayes.results.read_back import Stored
from wirebayes.robot.mechanics import schema
from wirebayes.robot.mechanics.draws import CORE, WireDraws, for_robot
from wirebayes.robot.self_calibration.session import LengthPrior
from wirebayes.simulation.synthetic import Bench, Truth
from wirebayes.wire.effect import Typical
from wirebayes.wire.fresh import FreshSample
from wirebayes.wire.model import Model

KILO, MINUTE = 1e-3, 1.0 / 60.0  # of one newton, and of one second, in kilonewtons and minutes
TYPICAL = Typical(40.0, 300.0)
NAMES = [*CORE, "preload", "sensor_sd", "setting_sd"]


def in_other_units(draws: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Parameters in kilonewtons and minutes."""
    changed = {"B": draws["B"] * KILO ** -draws["U"], "k2": draws["k2"] * MINUTE ** -draws["N"]}
    return draws | changed | {"k1": draws["k1"] * KILO, "sensor_sd": draws["sensor_sd"] * KILO}


def posterior(seed: int) -> dict[str, np.ndarray]:
    """Draws of a specimen: creep at the typical tension and after a typical hold are known, exponents less so."""
    rng = np.random.default_rng(seed)
    own = rng.normal(0.0, [0.02, 0.05, 0.1, 0.05, 0.1])
    k1, crept, U, hazard, N = np.exp(own + rng.normal(0.0, [0.01, 0.02, 0.05, 0.03, 0.05], (500, 5))).T
    U, N = 0.7 * U, 0.6 * N
    noises = {name: np.full(500, 0.01) for name in NAMES[5:]}
    wire = {"k1": 2e4 * k1, "B": crept * 40.0**-U, "U": U, "k2": 0.8 * hazard * 300.0**-N, "N": N}
    return wire | noises


def specimens(other: bool, monkeypatch: pytest.MonkeyPatch) -> WireDraws:
    """The line of four specimens, in one set of units or in the other."""
    (test,) = simulated_tests([Bench("a")], Truth(), 1)
    sample = build([test]).samples[0]
    units = (KILO, MINUTE) if other else (1.0, 1.0)
    typical = Typical(TYPICAL.tension_N * units[0], TYPICAL.hold_s * units[1])
    sample = replace(sample, model=replace(sample.model, typical=typical))
    written = in_other_units if other else dict

    def load(folder: Path, *_: object) -> Stored:
        return Stored(written(posterior(int(str(folder)))), sample, "chain")

    def prior(*_: object) -> dict[str, np.ndarray]:
        rng = np.random.default_rng(99)
        wide = np.exp(rng.normal(0.0, [1.5, 1.5, 0.7, 1.5, 0.45], (4000, 5))).T
        U, N = 0.5 * wide[2], 0.7 * wide[4]
        known = {"k1": 2e4 * wide[0], "B": wide[1] * 40.0**-U, "U": U, "k2": wide[3] * 300.0**-N, "N": N}
        return written(known | {name: np.ones(4000) for name in NAMES[5:]})

    monkeypatch.setattr("wirebayes.commands.wire_draws.read_back.load_posterior", load)
    monkeypatch.setattr("wirebayes.commands.wire_draws.read_back.prior_draws", prior)
    return wire_draws.draws_of_specimens([Path(str(i)) for i in range(4)], 300, None, None)


def creep(line: WireDraws, tension: float, seconds: float) -> np.ndarray:
    return FreshSample(line.parameters, Model(), line.length_mm).creep_mm(tension, np.array([seconds]))[0]


def test_a_line_of_several_specimens_is_the_same_in_other_units(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is compared differs by the unit of k1 alone, and what comes of it creeps alike."""
    asked = []

    def compared(logarithms: list[np.ndarray], prior: tuple[np.ndarray, np.ndarray], *_: object) -> LineDraws:
        asked.append((*logarithms, *prior))
        return LineDraws(logarithms[0], np.full_like(logarithms[0], 0.05), 500.0)

    monkeypatch.setattr("wirebayes.commands.wire_draws.between_specimens", compared)
    one, other = specimens(False, monkeypatch), specimens(True, monkeypatch)
    unit = np.log([KILO, 1.0, 1.0, 1.0, 1.0])
    (*here, middle, covariance), (*there, other_middle, other_covariance) = asked
    for a, b in zip([*here, middle], [*there, other_middle], strict=True):
        np.testing.assert_allclose(b, a + unit, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(other_covariance, covariance, rtol=1e-9, atol=1e-9)
    for tension, time in ((40.0, 300.0), (5.0, 10.0), (200.0, 4e4)):
        found = creep(other, KILO * tension, MINUTE * time)
        np.testing.assert_allclose(found, creep(one, tension, time), rtol=1e-9)


def spreading(by: str) -> WireDraws:
    line = line_about(TYPICAL_WIRE, 0.0, 50, 1, "hooke")
    spread = {name: np.full(50, 0.2 if name == by else 1e-12) for name in CORE}
    return replace(line, typical=Typical(5.0, 90.0), spread=spread, specimens=3)


@pytest.mark.parametrize(("by", "amount", "scale"), [("U", "B", 5.0), ("N", "k2", 90.0)])
def test_specimens_that_differ_in_an_exponent_creep_alike_where_they_were_tested(
    by: str, amount: str, scale: float
) -> None:
    robot, line = schema.read_robot_file("linear-6"), spreading(by)
    wires = for_robot(robot, line, 0.05, np.random.default_rng(0))
    prior = LengthPrior(line, 1e-3)
    mean, _ = prior.moments(6)
    unknowns = np.tile(mean, (4, 1))
    unknowns[:, 6 + 5 :] = np.random.default_rng(1).normal(0.0, prior.own_sd, (4, len(mean) - 11))
    for theta in (wires.theta, prior.wires(robot, unknowns)[0].theta):
        known = theta[amount] * scale ** theta[by]
        np.testing.assert_allclose(known, np.full_like(known, known[0, 0]), rtol=1e-9)
        assert np.ptp(theta[by]) > 0.05

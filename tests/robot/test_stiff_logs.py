"""A log of a few stops far apart: its cost does not grow with stiffness, and its end is where it was sent."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.robot import drawn
from wirebayes.robot.history import follow
from wirebayes.robot.history.history import History
from wirebayes.robot.mechanics import draws, schema
from wirebayes.robot.mechanics.rotation import matrix
from wirebayes.robot.motion import downhill, inverse, mixed

FIELD = Path(__file__).parent / "field" / "stiff-log-hang"
STIFFNESS = (1.0, 1e4)  # times the drawn one, which stretches by .2 to 2 %


def _log(kind, seed, factor):
    """Stops within reach of a drawn robot, with the joint values that lead there: robot, wires, history, positions."""
    rng = np.random.default_rng(seed)
    one = drawn.draw(kind, rng)
    robot = one.robot
    line = replace(one.line, parameters=one.line.parameters | {"k1": factor * one.line.parameters["k1"]})
    x = rng.uniform(robot.lower_m, robot.upper_m, (40, 3))
    R = np.broadcast_to(np.eye(3), (40, 3, 3))
    good = np.isfinite(inverse.tensions(robot, x, R)).all(1)
    x = np.concatenate([one.position_m[None], x[good][:2]])
    R = R[: len(x)]
    wires = draws.for_robot(robot, line)
    plain = replace(wires, theta=dict(wires.theta) | {"B": np.zeros((1, 1))})
    joint = inverse.commands(robot, plain, x, R, inverse.tensions(robot, x, R)).joint_m
    times = 10.0 * np.arange(len(x))
    still = np.zeros(len(x))
    return robot, plain, History(times, joint, None, None, still, np.tile(robot.centre_of_mass_m, (len(x), 1))), x


def _counted(monkeypatch):
    """A list that grows with each step of the solvers."""
    work = []
    for name, module in (("newton_step_with_tensions", mixed), ("_evaluate", downhill)):
        made = getattr(module, name)
        monkeypatch.setattr(module, name, lambda *given, made=made: work.append(1) or made(*given))
    return work


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("kind", ["planar-4", "point-4", "point-5", "body-6", "body-8"])
def test_the_work_of_a_log_does_not_grow_with_stiffness(kind, seed, monkeypatch):
    work, spent = _counted(monkeypatch), []
    for factor in STIFFNESS:
        robot, wires, history, x = _log(kind, seed, factor)
        fine, kept = follow.refined_joints(robot, history)
        work.clear()
        start = x[0], np.eye(3)
        track = follow.follow_log(robot, wires, fine, fine.joint_m, start, fine.times_s[:1])
        spent.append(len(work))
        assert track.held.all()
        assert track.position_m[0, kept] == pytest.approx(x, abs=1e-6 * robot.span_m)
    assert max(spent) <= 3 * min(spent)


def test_the_work_of_a_builders_log_is_alike_from_a_thousand_to_ten_million_newtons(monkeypatch):
    """Four wires and six degrees of freedom, stops far apart; read again with wires of every stiffness."""
    robot = schema.read_robot_file(FIELD / "ua.toml")
    rows = np.loadtxt(FIELD / "ua-j2.csv", delimiter=",", skiprows=1)
    still, middle = np.zeros(len(rows)), np.tile(robot.centre_of_mass_m, (len(rows), 1))
    history = History(rows[:, 0], rows[:, 1:], None, None, still, middle)
    fine, _ = follow.refined_joints(robot, history)
    start = np.array([0.367, 0.365, 1.165]), matrix(np.array([0.085, -0.09, 0.0]))
    work, spent = _counted(monkeypatch), []
    for k1 in (1e3, 1e7):
        line = draws.WireDraws({"k1": [k1], "B": [200.0 / k1], "U": [1.0], "k2": [0.02], "N": [0.5]}, 1000.0, "hooke")
        wires = draws.for_robot(replace(robot, wire=("default",) * robot.legs), line)
        work.clear()
        track = follow.follow_log(robot, wires, fine, fine.joint_m, start, fine.times_s[:1])
        spent.append(len(work))
        assert track.held.all()
    assert max(spent) <= 3 * min(spent)

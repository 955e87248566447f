"""Following an equilibrium: the platform ends where it came by small steps, however long the step."""

import numpy as np

from tests.robot.test_history import _line
from wirebayes.robot.history.unknowns import Uncertain, unknowns
from wirebayes.robot.mechanics import schema
from wirebayes.robot.motion import forward, inverse, path

PARTS = 6


def test_a_long_step_stays_on_the_equilibrium_that_short_ones_follow():
    robot = schema.read_robot_file("cogiro-desk")
    known = unknowns(robot, _line(400), Uncertain(1e-3), np.random.default_rng(0))
    wires, error = known.columns(known.draws)
    places = robot.home_m + 0.02 * robot.span_m * np.array([[0.0, 0.0, 0.0], [1.0, 0.3, 0.5]])
    level = np.tile(np.eye(3), (2, 1, 1))
    tau = inverse.tensions(robot, places, level)
    zero, offset = inverse.lengths(robot, inverse.commands(robot, known.plain, places, level, tau).joint_m)
    way = [
        (zero[0] + share * (zero[1] - zero[0]) + error, np.broadcast_to(offset[0], error.shape))
        for share in np.linspace(0, 1, PARTS + 1)
    ]
    start = forward.solve_equilibrium(robot, wires, *way[0], robot.home_m, np.eye(3))
    here = start
    for old, new in zip(way[:-1], way[1:], strict=True):
        here = path.follow(robot, wires, (here.position_m, here.rotation), old, new).here
    at_once = path.follow(robot, wires, (start.position_m, start.rotation), way[0], way[-1]).here
    assert here.found.all()
    assert at_once.found.all()
    np.testing.assert_allclose(at_once.position_m, here.position_m, atol=1e-9)
    np.testing.assert_allclose(at_once.tension_N, here.tension_N, atol=1e-6)

from dataclasses import replace

import numpy as np
import pytest

from wirebayes.robot.mechanics import rotation, schema, statics
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion import forward, inverse

from . import cases

ROBOTS = schema.shipped()


def _distance(robot, found, position_m, turn):
    return np.maximum(
        np.abs(found.position_m - position_m).max(1), robot.size_m * np.abs(found.rotation - turn).max((1, 2))
    )


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("law", ["hooke", "modified"])
def test_inverse_then_forward_returns_to_the_pose(name, law):
    robot = schema.read(name)
    rng = np.random.default_rng(11)
    c = cases.commanded(robot, law, 60, rng)
    start = c.position_m + 0.05 * robot.size_m * rng.normal(size=c.position_m.shape)
    found = forward.solve(robot, c.wires, c.zero_m, c.offset_m, start, np.eye(3))
    assert found.found.all()
    assert _distance(robot, found, c.position_m, c.rotation).max() < 1e-9


@pytest.mark.parametrize("name", ROBOTS)
def test_mujoco_settles_where_we_solve(name):
    pytest.importorskip("mujoco")
    from wirebayes.robot.export.mujoco_model import settle

    robot = schema.read(name)
    rng = np.random.default_rng(12)
    for make in (cases.commanded, cases.disturbed):
        c = make(robot, "hooke", 3, rng)
        found = cases.solved(robot, c)
        assert found.found.all()
        soft = _softest(robot, c, found)
        for i in range(len(found.status)):
            x, R, rested = settle(
                robot, np.full(robot.legs, c.wires.theta["k1"][0, i]), c.zero_m[i], c.offset_m[i],
                found.position_m[i] + 1e-3 * robot.size_m, found.rotation[i], soft[i],
            )  # fmt: skip
            assert rested
            assert np.abs(x - found.position_m[i]).max() < 1e-6
            assert robot.size_m * np.abs(R - found.rotation[i]).max() < 1e-6


def _softest(robot, c, found):
    R = np.moveaxis(found.rotation, 0, -1)
    K = statics.stiffness(robot, c.wires, found.position_m.T, R, c.zero_m.T, c.offset_m.T)
    scale = np.array([1.0] * 3 + [1 / robot.size_m] * (robot.degrees - 3))
    return np.linalg.eigvalsh(K * np.outer(scale, scale))[:, 0]


@pytest.mark.parametrize("name", ROBOTS)
def test_least_energy_is_where_we_solve_under_law_3(name):
    robot = schema.read(name)
    rng = np.random.default_rng(13)
    c = cases.disturbed(robot, "modified", 2, rng)
    found = cases.solved(robot, c)
    for i in range(len(found.status)):
        x, R, _ = cases.energy_minimum(
            robot, "modified", c.wires.theta["k1"][0, i], c.zero_m[i], c.offset_m[i],
            found.position_m[i] + 1e-3 * robot.size_m, found.rotation[i],
        )  # fmt: skip
        assert np.abs(x - found.position_m[i]).max() < 1e-6
        assert robot.size_m * np.abs(R - found.rotation[i]).max() < 1e-6


def test_disturbed_lengths_leave_wires_slack_and_are_solved():
    robot = schema.read("cogiro-desk")
    c = cases.disturbed(robot, "hooke", 40, np.random.default_rng(3))
    found = cases.solved(robot, c)
    assert found.found.all()
    assert (found.tension_N == 0).any(1).sum() > 10


def test_a_platform_dropped_with_all_wires_slack_is_caught():
    robot = schema.read("linear-6")
    c = cases.commanded(robot, "hooke", 10, np.random.default_rng(4))
    high = c.position_m + [0, 0, 0.1]
    found = forward.solve(robot, c.wires, c.zero_m, c.offset_m, high, c.rotation)
    assert found.found.all()
    assert _distance(robot, found, c.position_m, c.rotation).max() < 1e-9


def test_too_few_iterations_are_reported():
    robot = schema.read("linear-6")
    c = cases.commanded(robot, "hooke", 5, np.random.default_rng(4))
    found = forward.solve(robot, c.wires, c.zero_m, c.offset_m, c.position_m + 0.05, np.eye(3), max_iterations=1)
    assert (found.status == forward.NOT_CONVERGED).all()


def test_no_equilibrium_is_reported():
    # Law 3 can pull with k1 at most, however far it is stretched: three wires of 1 N cannot hold 2 kg.
    robot = schema.read("hangprinter-4")
    wires = Wires("modified", "saturating", {"k1": np.array([[1.0]])}, np.full((4, 1), 1000.0))
    zero = 2.0 * np.ones((1, 4)) + robot.beyond_m
    found = forward.solve(robot, wires, zero, robot.beyond_m, robot.home_m, np.eye(3), 2000)
    assert (found.status == forward.NO_EQUILIBRIUM).all()


def test_a_platform_on_two_points_in_line_with_its_weight_is_not_held():
    # Wires to two opposite corners only: nothing keeps the plate from turning about the line between them.
    robot = schema.read("ipanema-1")
    wires = Wires("hooke", "saturating", {"k1": np.array([[50000.0]])}, np.full((8, 1), 1000.0))
    tau = inverse.tensions(robot, robot.home_m[None], np.eye(3)[None])
    commands = inverse.commands(robot, wires, robot.home_m[None], np.eye(3)[None], tau)
    held = forward.solve(robot, wires, commands.zero_m, commands.offset_m, robot.home_m, np.eye(3))
    assert held.found.all()
    loose = commands.zero_m + np.array([1.0, 0, 1, 0, 1, 0, 1, 0])
    turned = rotation.matrix(np.array([[0.02, 0.01, 0.03]]))
    found = forward.solve(robot, wires, loose, commands.offset_m, robot.home_m + 0.01, turned)
    assert found.status.tolist() == [forward.NOT_HELD]
    assert found.residual_N[0] < 1e-6


def test_several_equilibria_are_found_distinguished_and_ordered():
    robot = schema.read("cogiro-desk")
    c = cases.commanded(robot, "hooke", 1, np.random.default_rng(8))
    every = forward.equilibria(robot, c.wires, c.zero_m[0], c.offset_m[0], np.random.default_rng(0))
    assert len(every.position_m) >= 2
    height = statics.potential(
        robot, c.wires, every.position_m.T, np.moveaxis(every.rotation, 0, -1), c.zero_m.T, c.offset_m.T
    )
    assert (np.diff(height) >= 0).all()
    assert np.abs(every.position_m - c.position_m).max(1).min() < 1e-9


def test_a_row_does_not_depend_on_its_neighbours():
    robot = schema.read("segesta-8")
    c = cases.disturbed(robot, "hooke", 30, np.random.default_rng(5))
    whole = cases.solved(robot, c)
    wire = c.wires.part(slice(7, 8))
    one = forward.solve(robot, wire, c.zero_m[7:8], c.offset_m[7:8], c.position_m[7], c.rotation[7])
    np.testing.assert_allclose(one.position_m[0], whole.position_m[7], rtol=0, atol=1e-13)
    assert one.iterations[0] == whole.iterations[7]


def test_linear_actuator_keeps_its_wire_and_moves_through_the_ratio():
    robot = schema.read("linear-6")
    c = cases.commanded(robot, "hooke", 3, np.random.default_rng(6))
    tau = inverse.tensions(robot, c.position_m, c.rotation)
    commands = inverse.commands(robot, c.wires, c.position_m, c.rotation, tau)
    np.testing.assert_allclose(commands.zero_m, np.broadcast_to(robot.wire_m, commands.zero_m.shape))
    zero, offset = inverse.lengths(robot, commands.joint_m)
    doubled = replace(robot, ratio=2 * robot.ratio)
    half = inverse.commands(doubled, c.wires, c.position_m, c.rotation, tau)
    np.testing.assert_allclose(half.joint_m, 0.5 * commands.joint_m)
    found = forward.solve(robot, c.wires, zero, offset, c.position_m + 1e-3, rotation.matrix(np.zeros(3)))
    assert _distance(robot, found, c.position_m, c.rotation).max() < 1e-9


def test_a_tackle_of_lines_is_solved_as_one_line_of_their_stiffness():
    """m lines of k1, m times as long, pull as one of m k1: the same poses, and the same force is left to rounding."""
    plain = schema.read("cogiro-desk")
    robot, tackle = (replace(plain, lines=np.full(8, m)) for m in (1.0, 4.0))
    c = cases.disturbed(plain, "hooke", 20, np.random.default_rng(3))
    free, n = c.zero_m - c.offset_m, len(c.zero_m)
    found, begun = [], []
    for one, m in ((robot, 1.0), (tackle, 4.0)):
        wires = replace(c.wires, theta={"k1": c.wires.theta["k1"] / m})
        found.append(forward.solve(one, wires, m * free, np.zeros(8), c.position_m, c.rotation))
        R = np.moveaxis(c.rotation, 0, -1)
        start = m * free.T, np.zeros((8, n)), c.position_m.T, R
        begun.append(forward._begin(one, wires, *start, np.ones((6, 1))))
    np.testing.assert_allclose(found[1].position_m, found[0].position_m, atol=1e-12)
    np.testing.assert_allclose(4.0 * found[1].tension_N, found[0].tension_N, atol=1e-9)
    np.testing.assert_array_equal(found[1].status, found[0].status)
    for name in ("floor", "level"):
        np.testing.assert_allclose(getattr(begun[1], name), getattr(begun[0], name))

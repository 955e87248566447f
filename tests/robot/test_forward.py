from dataclasses import replace

import numpy as np
import pytest

from tests.robot.cases import HANGING
from wirebayes.robot.mechanics import rotation, schema, statics
from wirebayes.robot.mechanics.description import GRAVITY
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion import downhill, equilibria, forward, inverse, outcome
from wirebayes.robot.motion.balance import balance_at, tensions_at
from wirebayes.robot.motion.saddle import off_saddle

from . import cases

ROBOTS = HANGING


def _distance(robot, found, position_m, turn):
    return np.maximum(
        np.abs(found.position_m - position_m).max(1), robot.size_m * np.abs(found.rotation - turn).max((1, 2))
    )


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("law", ["hooke", "modified"])
def test_inverse_then_forward_returns_to_the_pose(name, law):
    robot = schema.read_robot_file(name)
    rng = np.random.default_rng(11)
    c = cases.commanded(robot, law, 60, rng)
    start = c.position_m + 0.05 * robot.size_m * rng.normal(size=c.position_m.shape)
    found = forward.solve_equilibrium(robot, c.wires, c.zero_m, c.offset_m, start, np.eye(3))
    assert found.found.all()
    assert _distance(robot, found, c.position_m, c.rotation).max() < 1e-9


@pytest.mark.parametrize("name", ROBOTS)
def test_mujoco_settles_where_we_solve(name):
    pytest.importorskip("mujoco")

    robot = schema.read_robot_file(name)
    rng = np.random.default_rng(12)
    for make in (cases.commanded, cases.disturbed):
        c = make(robot, "hooke", 3, rng)
        found = cases.solved(robot, c)
        assert found.found.all()
        soft = cases.softest(robot, c, found)
        for i in range(len(found.status)):
            x, R, rested = cases.rest_in_mujoco(
                robot,
                np.full(robot.legs, c.wires.theta["k1"][0, i]),
                c.zero_m[i],
                c.offset_m[i],
                found.position_m[i] + 1e-3 * robot.size_m,
                found.rotation[i],
                soft[i],
            )
            assert rested
            assert np.abs(x - found.position_m[i]).max() < 1e-6
            assert robot.size_m * np.abs(R - found.rotation[i]).max() < 1e-6


@pytest.mark.parametrize("name", ROBOTS)
def test_least_energy_is_where_we_solve_under_law_3(name):
    robot = schema.read_robot_file(name)
    rng = np.random.default_rng(13)
    c = cases.disturbed(robot, "modified", 2, rng)
    found = cases.solved(robot, c)
    for i in range(len(found.status)):
        x, R, _ = cases.energy_minimum(
            robot,
            "modified",
            c.wires.theta["k1"][0, i],
            c.zero_m[i],
            c.offset_m[i],
            found.position_m[i] + 1e-3 * robot.size_m,
            found.rotation[i],
        )
        assert np.abs(x - found.position_m[i]).max() < 1e-6
        assert robot.size_m * np.abs(R - found.rotation[i]).max() < 1e-6


def test_disturbed_lengths_leave_wires_slack_and_are_solved():
    robot = schema.read_robot_file("cogiro-desk")
    c = cases.disturbed(robot, "hooke", 40, np.random.default_rng(3))
    found = cases.solved(robot, c)
    assert found.found.all()
    assert (found.tension_N == 0).any(1).sum() > 10


def test_a_platform_dropped_with_all_wires_slack_is_caught():
    robot = schema.read_robot_file("linear-6")
    c = cases.commanded(robot, "hooke", 10, np.random.default_rng(4))
    high = c.position_m + [0, 0, 0.1]
    found = forward.solve_equilibrium(robot, c.wires, c.zero_m, c.offset_m, high, c.rotation)
    assert found.found.all()
    assert _distance(robot, found, c.position_m, c.rotation).max() < 1e-9


def test_too_few_iterations_are_reported():
    robot = schema.read_robot_file("linear-6")
    c = cases.commanded(robot, "hooke", 5, np.random.default_rng(4))
    found = forward.solve_equilibrium(
        robot, c.wires, c.zero_m, c.offset_m, c.position_m + 0.05, np.eye(3), max_iterations=1
    )
    assert (found.status == outcome.NOT_CONVERGED).all()


def test_no_equilibrium_is_reported():
    # Law 3 can pull with k1 at most, however far it is stretched: three wires of 1 N cannot hold 2 kg.
    robot = schema.read_robot_file("hangprinter-4")
    wires = Wires("modified", "saturating", {"k1": np.array([[1.0]])}, np.full((4, 1), 1000.0))
    zero = 2.0 * np.ones((1, 4)) + robot.beyond_m
    found = forward.solve_equilibrium(robot, wires, zero, robot.beyond_m, robot.home_m, np.eye(3), 2000)
    assert (found.status == outcome.NO_EQUILIBRIUM).all()


def test_a_platform_on_two_points_in_line_with_its_weight_is_not_held():
    # Wires to two opposite corners only: nothing keeps the plate from turning about the line between them.
    robot = schema.read_robot_file("ipanema-1")
    wires = Wires("hooke", "saturating", {"k1": np.array([[50000.0]])}, np.full((8, 1), 1000.0))
    tau = cases.tensions_at_home(robot)
    commands = inverse.commands(robot, wires, robot.home_m[None], np.eye(3)[None], tau)
    held = forward.solve_equilibrium(robot, wires, commands.zero_m, commands.offset_m, robot.home_m, np.eye(3))
    assert held.found.all()
    loose = commands.zero_m + np.array([1.0, 0, 1, 0, 1, 0, 1, 0])
    turned = rotation.matrix(np.array([[0.02, 0.01, 0.03]]))
    found = forward.solve_equilibrium(robot, wires, loose, commands.offset_m, robot.home_m + 0.01, turned)
    assert found.status.tolist() == [outcome.NOT_HELD]
    assert found.residual_N[0] < 1e-6


def test_several_equilibria_are_found_distinguished_and_ordered():
    robot = schema.read_robot_file("cogiro-desk")
    c = cases.commanded(robot, "hooke", 1, np.random.default_rng(8))
    every = equilibria.equilibria(robot, c.wires, c.zero_m[0], c.offset_m[0], np.random.default_rng(0))
    assert len(every.position_m) >= 2
    height = statics.potential(
        robot, c.wires, every.position_m.T, np.moveaxis(every.rotation, 0, -1), c.zero_m.T, c.offset_m.T
    )
    assert (np.diff(height) >= 0).all()
    assert np.abs(every.position_m - c.position_m).max(1).min() < 1e-9


def test_a_row_does_not_depend_on_its_neighbours():
    robot = schema.read_robot_file("segesta-8")
    c = cases.disturbed(robot, "hooke", 30, np.random.default_rng(5))
    whole = cases.solved(robot, c)
    wire = c.wires.part(slice(7, 8))
    one = forward.solve_equilibrium(robot, wire, c.zero_m[7:8], c.offset_m[7:8], c.position_m[7], c.rotation[7])
    np.testing.assert_allclose(one.position_m[0], whole.position_m[7], rtol=0, atol=1e-13)
    assert one.iterations[0] == whole.iterations[7]


def test_linear_actuator_keeps_its_wire_and_moves_through_the_ratio():
    robot = schema.read_robot_file("linear-6")
    c = cases.commanded(robot, "hooke", 3, np.random.default_rng(6))
    tau = inverse.tensions(robot, c.position_m, c.rotation)
    commands = inverse.commands(robot, c.wires, c.position_m, c.rotation, tau)
    np.testing.assert_allclose(commands.zero_m, np.broadcast_to(robot.wire_m, commands.zero_m.shape))
    zero, offset = inverse.lengths(robot, commands.joint_m)
    doubled = replace(robot, ratio=2 * robot.ratio)
    half = inverse.commands(doubled, c.wires, c.position_m, c.rotation, tau)
    np.testing.assert_allclose(half.joint_m, 0.5 * commands.joint_m)
    found = forward.solve_equilibrium(robot, c.wires, zero, offset, c.position_m + 1e-3, rotation.matrix(np.zeros(3)))
    assert _distance(robot, found, c.position_m, c.rotation).max() < 1e-9


def test_a_tackle_of_lines_is_solved_as_one_line_of_their_stiffness():
    """m lines of k1, m times as long, pull as one of m k1: the same poses, and the same force is left to rounding."""
    plain = schema.read_robot_file("cogiro-desk")
    robot, tackle = (replace(plain, lines=np.full(8, m)) for m in (1.0, 4.0))
    c = cases.disturbed(plain, "hooke", 20, np.random.default_rng(3))
    free, n = c.zero_m - c.offset_m, len(c.zero_m)
    found, begun = [], []
    for one, m in ((robot, 1.0), (tackle, 4.0)):
        wires = replace(c.wires, theta={"k1": c.wires.theta["k1"] / m})
        found.append(forward.solve_equilibrium(one, wires, m * free, np.zeros(8), c.position_m, c.rotation))
        R = np.moveaxis(c.rotation, 0, -1)
        start = m * free.T, np.zeros((8, n)), c.position_m.T, R
        begun.append(downhill._begin(one, wires, *start))
    np.testing.assert_allclose(found[1].position_m, found[0].position_m, atol=1e-12)
    np.testing.assert_allclose(4.0 * found[1].tension_N, found[0].tension_N, atol=1e-9)
    np.testing.assert_array_equal(found[1].status, found[0].status)
    for name in ("floor", "level"):
        np.testing.assert_allclose(getattr(begun[1], name), getattr(begun[0], name))


WEIGHED = schema.read_robot_file("hangprinter-4")  # a point on four wires; what holds it does not matter to a step


def stepped(monkeypatch, *, gradient=1.0, stiffness=2.0, damping=0.0, level=4.0, gain=0.1, energy=10.0, size=5.0,
            new_size=4.0, floor=0.0, span=100.0, x=0.0):  # fmt: skip
    """One Newton step along the first axis, by which the energy falls by `gain`: length, damping, and how it ended."""

    def point(value, force):
        g, H = np.zeros((3, 1)), np.eye(3)[..., None] * 7.0
        g[0], H[0, 0] = gradient, stiffness
        return downhill._Point(np.array([value]), g, H, np.zeros((4, 1)), np.array([force]))

    def evaluate(robot, wires, zero, offset, new_x, new_R):
        return point(energy - gain, new_size)

    monkeypatch.setattr(downhill, "_evaluate", evaluate)
    one = np.ones(1)
    at, turn = np.array([[x], [0.0], [0.0]]), np.eye(3)[..., None]
    cases_ = downhill._Cases(
        np.zeros(1, int),
        None,
        np.ones((4, 1)),
        np.zeros((4, 1)),
        at,
        turn,
        point(energy, size),
        damping * one,
        level * one,
        floor * one,
        span * one,
    )
    new, ended = downhill._iterate(WEIGHED, cases_)
    moved = float(new.x[0, 0] - x)
    assert new.at.energy[0] == (energy - gain if moved else energy)
    return moved, float(new.damping[0]), int(ended[0])


def test_a_step_is_newton_s_or_shorter_by_its_damping(monkeypatch):
    assert stepped(monkeypatch, gain=1.0)[0] == pytest.approx(-0.5)
    assert stepped(monkeypatch, gain=1.0, damping=0.5)[0] == pytest.approx(-0.25)  # half of four on top of two
    assert stepped(monkeypatch, gain=1.0, gradient=-3.0)[0] == pytest.approx(1.5)
    # it crosses no more than a quarter of ten times the robot's size
    assert stepped(monkeypatch, gain=1e9, gradient=1e6, span=3.0)[0] == pytest.approx(-7.5)
    assert stepped(monkeypatch, gain=1e9, gradient=1e-2, stiffness=1e-150, span=3.0)[0] == pytest.approx(-7.5)


def test_a_step_is_taken_where_the_energy_falls(monkeypatch):
    """By a ten-thousandth of what the slope promises, half a joule here; otherwise it is damped ten times as much."""
    for part, taken in ((1.1, True), (0.9, False), (-1.0, False)):
        moved, damping, ended = stepped(monkeypatch, gain=part * 0.5e-4)
        assert (moved != 0.0) is taken and damping == (0.0 if taken else 1e-3) and ended == downhill._GOING_ON
    assert stepped(monkeypatch, gain=-1.0, damping=0.5)[:2] == (0.0, 5.0)
    assert stepped(monkeypatch, gain=-1.0, damping=1e-6)[:2] == (0.0, 1e-3)
    # against a stiffness that pushes as far as against one that pulls, along none at all a tenth of the robot's size
    assert stepped(monkeypatch, gain=1.0, stiffness=-2.0)[:2] == (pytest.approx(-0.5), 0.0)
    assert stepped(monkeypatch, gain=1.0, stiffness=0.0)[:2] == (pytest.approx(-10.0), 0.0)
    assert stepped(monkeypatch, gain=-1.0, stiffness=-2.0)[:2] == (0.0, 1e-3)
    assert stepped(monkeypatch, gain=0.0, stiffness=0.0, floor=1.1)[0] == 0.0  # by a force that is rounding nowhere
    assert stepped(monkeypatch, gain=1.0, stiffness=-1.0, damping=0.5)[0] == pytest.approx(-1.0)  # but if damped enough


@pytest.mark.parametrize("energy", [0.0, 5e4, -5e4])
def test_a_rise_within_rounding_is_none(energy, monkeypatch):
    """1e-14 of the energy and of the weight times the robot's size, which a potential energy may be off by."""
    noise = 1e-14 * (abs(energy) + WEIGHED.mass_kg * GRAVITY * 1e6)
    for part, taken in ((0.5, True), (2.0, False)):
        moved = stepped(monkeypatch, gain=-part * noise, energy=energy, gradient=1e-12, span=1e6)[0]
        assert (moved != 0.0) is taken


def test_near_the_end_a_smaller_force_counts_though_the_energy_cannot_tell(monkeypatch):
    """Half of the force before, after an undamped step of less than a thousandth of the platform's size."""
    short = 2.0 * 0.9e-3 * WEIGHED.size_m
    near = {"gain": -1e-6, "gradient": short, "size": 5.0}
    assert stepped(monkeypatch, **near, new_size=2.4)[0] != 0.0
    assert stepped(monkeypatch, **near, new_size=2.6)[0] == 0.0
    assert stepped(monkeypatch, **near, new_size=2.4, damping=1e-9)[0] == 0.0
    assert stepped(monkeypatch, **(near | {"gradient": short * 1.2 / 0.9}), new_size=2.4)[0] == 0.0


def test_damping_is_given_up_as_far_as_the_energy_falls_as_predicted(monkeypatch):
    """By 0.1875 J here (two of damping, two of stiffness): from half of that on a hundredth of the damping is left."""
    assert stepped(monkeypatch, damping=0.5, gain=0.0939)[1] == 0.005
    assert stepped(monkeypatch, damping=0.5, gain=0.0937)[1] == 0.5
    small = {"gain": 1.0, "level": 1.0}
    assert stepped(monkeypatch, damping=2.1e-5, **small)[1] == pytest.approx(2.1e-7)
    assert stepped(monkeypatch, damping=1.9e-5, **small)[1] == 0.0
    assert stepped(monkeypatch, damping=1.9e-5, level=1.0, gain=0.12)[1] == 1.9e-5  # half of a quarter is an eighth
    assert stepped(monkeypatch, damping=1.9e-5, level=1.0, gain=0.13)[1] == 0.0


def test_a_case_ends_in_balance_far_away_or_where_no_step_helps(monkeypatch):
    known = {"gain": 1.0, "size": 5.0, "new_size": 4.0}
    going_on = downhill._GOING_ON
    assert stepped(monkeypatch, **known, floor=4.0)[2] == outcome.FOUND  # as small as what can be computed
    assert stepped(monkeypatch, **known, floor=3.9)[2] == going_on
    assert stepped(monkeypatch, **known, floor=4.0, damping=0.5)[1:] == (0.0, going_on)  # the bare stiffness decides
    assert stepped(monkeypatch, gain=-1.0, size=4.0, floor=4.0)[2] == outcome.FOUND  # it was in balance before
    loose = {"gain": 0.0, "size": 4.0, "floor": 4.0, "stiffness": 0.0}
    assert stepped(monkeypatch, **loose)[1:] == (0.0, outcome.NOT_HELD)
    assert stepped(monkeypatch, **loose, damping=0.5)[1:] == (0.0, going_on)
    tiny = 2.0 * 1e-9 * WEIGHED.size_m
    for part, found in ((0.9, outcome.FOUND), (1.1, going_on)):
        assert stepped(monkeypatch, gain=1e-9, gradient=part * tiny)[2] == found
    assert stepped(monkeypatch, gain=-1e-3, gradient=0.9 * tiny)[2] == going_on  # a step that was not taken is none
    assert stepped(monkeypatch, gain=1e-9, gradient=0.9 * tiny, damping=1e-9)[2] == going_on
    for x, ended in ((29.9, going_on), (30.6, outcome.NO_EQUILIBRIUM), (-30.1, outcome.NO_EQUILIBRIUM)):
        assert stepped(monkeypatch, gain=1.0, span=3.0, x=x)[2] == ended  # beyond ten times the robot's size
    assert stepped(monkeypatch, gain=-1.0, damping=1e11)[1:] == (1e12, going_on)
    assert stepped(monkeypatch, gain=-1.0, damping=1.1e11)[2] == outcome.NOT_CONVERGED


@pytest.mark.parametrize("far", [1.0, 3.0])
def test_a_case_begins_with_the_force_and_the_stiffness_that_rounding_and_damping_are_measured_by(far):
    """32 roundings of the stiffest wire's lines and of the weight, more where points lie farther out than the size."""
    robot = schema.read_robot_file("cogiro-desk")
    platform = robot.platform_m.copy()
    platform[0] = [0.0, 0.0, far * robot.size_m]
    robot = replace(robot, platform_m=platform, lines=np.array([1.0, 2.0, 3.0, 1.0, 1.0, 1.0, 1.0, 1.0]))
    k1 = np.linspace(500.0, 900.0, 16).reshape(8, 2)
    wires = Wires("hooke", "saturating", {"k1": k1}, np.full((8, 1), 1000.0))
    zero = np.linspace(1.0, 2.5, 16).reshape(8, 2)
    x, R = np.tile(robot.home_m[:, None], 2), np.tile(np.eye(3)[..., None], 2)
    size = robot.size_m
    begun = downhill._begin(robot, wires, zero, np.zeros((8, 2)), x, R)
    arm = max(1.0, np.abs(platform).max() / size)
    force = 3.0 * k1.max(0) + robot.mass_kg * 9.80665
    np.testing.assert_allclose(begun.floor, 32 * 2.0**-52 * arm * force)
    np.testing.assert_allclose(begun.level, (k1 * robot.lines[:, None] ** 2 / zero).sum(0))
    np.testing.assert_allclose(begun.span, robot.span_m + zero.max(0))
    assert (begun.damping == 0).all() and begun.number.tolist() == [0, 1]
    point = replace(WEIGHED, mass_kg=2.0)
    wires = Wires("hooke", "saturating", {"k1": np.array([[300.0]])}, np.full((4, 1), 1000.0))
    begun = downhill._begin(point, wires, np.ones((4, 1)), np.zeros((4, 1)), x[:, :1], R[..., :1])
    force = 300.0 * point.lines.max() + 2.0 * 9.80665
    np.testing.assert_allclose(begun.floor, 32 * 2.0**-52 * force)


def test_a_point_has_the_energy_and_the_forces_of_its_pose():
    """Turns count in metres at the platform's edge; the centre of mass is lifted with them."""
    robot = schema.read_robot_file("cogiro-desk")
    robot = replace(robot, centre_of_mass_m=np.array([0.03, -0.02, 0.05]))
    c = cases.disturbed(robot, "hooke", 4, np.random.default_rng(2))
    R, n = np.moveaxis(c.rotation, 0, -1), len(c.position_m)
    scale = np.array([[1.0]] * 3 + [[1.0 / robot.size_m]] * 3)
    at = downhill._evaluate(robot, c.wires, c.zero_m.T, c.offset_m.T, c.position_m.T, R)
    energy = statics.potential(robot, c.wires, c.position_m.T, R, c.zero_m.T, c.offset_m.T)
    np.testing.assert_allclose(at.energy, energy, rtol=1e-12)
    stiff = statics.stiffness(robot, c.wires, c.position_m.T, R, c.zero_m.T, c.offset_m.T)
    np.testing.assert_allclose(np.moveaxis(at.H, -1, 0), stiff * scale[:, 0] * scale, rtol=1e-12)
    np.testing.assert_allclose(at.size, np.abs(at.gradient).max(0))
    tau = tensions_at(robot, c.wires, c.position_m, c.rotation, c.zero_m, c.offset_m)
    assert tau.shape == (n, 8)
    np.testing.assert_array_equal(tau, at.tau.T)
    shape = statics.geometry(robot, c.position_m.T, R)
    balance = -(cases.wrench(robot, shape, tau.T) + statics.weight(robot, R)) * scale
    np.testing.assert_allclose(at.gradient, balance, atol=1e-12)
    gradient, hessian = balance_at(robot, c.wires, c.position_m, c.rotation, c.zero_m, c.offset_m)
    np.testing.assert_array_equal(gradient, at.gradient)
    np.testing.assert_array_equal(hessian, at.H)
    # one offset for all poses
    same = balance_at(robot, c.wires, c.position_m, c.rotation, c.zero_m, robot.beyond_m)[0]
    each = np.tile(robot.beyond_m, (n, 1))
    expected = balance_at(robot, c.wires, c.position_m, c.rotation, c.zero_m, each)[0]
    np.testing.assert_array_equal(same, expected)
    single = tensions_at(robot, c.wires, c.position_m, c.rotation, c.zero_m, robot.beyond_m)
    np.testing.assert_array_equal(single, tensions_at(robot, c.wires, c.position_m, c.rotation, c.zero_m, each))


def test_rows_that_cannot_be_tried_are_not_found_and_do_no_harm():
    """NaN in lengths, offsets or starts; of no rows at all there is no answer."""
    robot = schema.read_robot_file("cogiro-desk")
    c = cases.commanded(robot, "hooke", 5, np.random.default_rng(4))
    zero, offset, start = c.zero_m.copy(), np.array(np.broadcast_to(c.offset_m, c.zero_m.shape)), c.position_m + 0.01
    whole = forward.solve_equilibrium(robot, c.wires, zero, offset, start, c.rotation)
    zero[0, 3], offset[2, 0], start[3, 1] = np.nan, np.inf, np.nan
    found = forward.solve_equilibrium(robot, c.wires, zero, offset, start, c.rotation)
    assert found.status.tolist() == [outcome.NOT_CONVERGED, 0, outcome.NOT_CONVERGED, outcome.NOT_CONVERGED, 0]
    lost = [0, 2, 3]
    assert np.isnan(found.position_m[lost]).all() and np.isnan(found.rotation[lost]).all()
    assert np.isnan(found.tension_N[lost]).all() and np.isinf(found.residual_N[lost]).all()
    assert found.iterations[lost].tolist() == [0] * 3 and found.found.tolist() == [False, True, False, False, True]
    for name in ("position_m", "rotation", "tension_N", "iterations", "residual_N"):
        np.testing.assert_array_equal(getattr(found, name)[[1, 4]], getattr(whole, name)[[1, 4]])
    none = forward.solve_equilibrium(robot, c.wires.part(slice(0)), zero[:0], offset[:0], start[:0], c.rotation[:0])
    assert none.position_m.shape == (0, 3) and none.tension_N.shape == (0, 8) and none.found.shape == (0,)
    nothing = forward.solve_equilibrium(robot, c.wires.part(slice(1)), zero[:1], offset[:1], start[:1], c.rotation[:1])
    assert nothing.tension_N.shape == (1, 8) and not nothing.found.any()


def test_inside_a_pulley_there_is_no_equilibrium(monkeypatch):
    robot = cases.with_pulleys(schema.read_robot_file("cogiro-desk"), np.random.default_rng(0))
    c = cases.commanded(robot, "hooke", 4, np.random.default_rng(1))
    found = forward.solve_equilibrium(robot, c.wires, c.zero_m, c.offset_m, c.position_m, c.rotation)
    assert found.found.all()
    clear = np.array([True, False, True, False])
    monkeypatch.setattr(statics.Geometry, "clear", property(lambda shape: clear))
    found = forward.solve_equilibrium(robot, c.wires, c.zero_m, c.offset_m, c.position_m, c.rotation)
    assert found.status.tolist() == [outcome.FOUND, outcome.NOT_CONVERGED] * 2


@pytest.mark.parametrize(("chunk", "quick"), [(3, 7), (2048, 2), (4, 1)])
def test_how_cases_are_cut_into_lots_changes_nothing(chunk, quick, monkeypatch):
    """Few or many at once, the slow ones finished together or on their own; iterations are counted through."""
    robot = schema.read_robot_file("cogiro-desk")
    c = cases.commanded(robot, "hooke", 10, np.random.default_rng(4))
    start = c.position_m + 1e-3
    whole = forward.solve_equilibrium(robot, c.wires, c.zero_m, c.offset_m, start, c.rotation)
    assert whole.found.all() and whole.iterations.min() > 2
    monkeypatch.setattr(downhill, "_CHUNK", chunk)
    monkeypatch.setattr(downhill, "_QUICK", quick)
    cut = forward.solve_equilibrium(robot, c.wires, c.zero_m, c.offset_m, start, c.rotation)
    assert cut.found.all()
    np.testing.assert_allclose(cut.position_m, whole.position_m, atol=1e-12)
    np.testing.assert_allclose(cut.tension_N, whole.tension_N, atol=1e-8)
    assert cut.iterations.tolist() == whole.iterations.tolist()
    few = forward.solve_equilibrium(robot, c.wires, c.zero_m, c.offset_m, start, c.rotation, max_iterations=2)
    assert few.status.tolist() == [outcome.NOT_CONVERGED] * 10 and few.iterations.tolist() == [2] * 10


@pytest.mark.parametrize("name", ["hangprinter-4", "cogiro-desk"])
def test_starts_lie_among_the_exits_and_below_and_the_known_pose_is_one_of_them(name, monkeypatch):
    robot = schema.read_robot_file(name)
    c = cases.commanded(robot, "hooke", 1, np.random.default_rng(8))
    asked = []
    true = forward.solve_equilibrium

    def solve(robot, wires, zero, offset, start, turn, most):
        asked.append((zero, start, np.broadcast_to(turn, (len(start), 3, 3)), most))
        return true(robot, wires, zero, offset, start, turn, most)

    monkeypatch.setattr(equilibria, "solve_equilibrium", solve)
    known = (c.position_m[0] + 1e-3, c.rotation[0])
    given = robot, c.wires, c.zero_m[0], np.broadcast_to(c.offset_m, c.zero_m.shape)[0]
    found = equilibria.equilibria(*given, np.random.default_rng(0), 40, known)
    equilibria.equilibria(*given, np.random.default_rng(0))
    (zero, start, turn, most), (_, plain, _, _) = asked
    assert len(start) == 41 and len(plain) == 64 and most == 400
    np.testing.assert_array_equal(zero, np.tile(c.zero_m[0], (41, 1)))
    np.testing.assert_array_equal(start[0], known[0])
    np.testing.assert_array_equal(turn[0], known[1])
    low, high = robot.exit_m.min(0), robot.exit_m.max(0)
    low = low - [0.0, 0.0, 0.5 * c.zero_m.max()]
    assert (plain >= low).all() and (plain <= high).all()
    assert (plain.min(0) < low + 0.2 * (high - low)).all() and (plain.max(0) > high - 0.2 * (high - low)).all()
    angles = np.linalg.norm(rotation.vector(turn[1:]), axis=1)
    assert (angles == 0).all() if robot.degrees == 3 else 1.0 < np.median(angles) < 2.5
    # each equilibrium once, though many starts lead to it
    near = 1e-6 * robot.span_m
    for i in range(len(found.position_m)):
        for k in range(i):
            one, other = (
                forward.Equilibria(*(getattr(found, f)[[j]] for f in forward.Equilibria.__annotations__))
                for j in (i, k)
            )
            assert _distance(robot, one, other.position_m, other.rotation)[0] > near


def test_every_status_has_a_number_of_its_own_and_words():
    """None of them the mark of a case that is still being solved."""
    numbers = outcome.FOUND, outcome.NOT_CONVERGED, outcome.NO_EQUILIBRIUM, outcome.NOT_HELD, outcome.FELL
    assert numbers == (0, 1, 2, 3, 4) and downhill._GOING_ON not in numbers
    assert list(outcome.STATUS) == list(numbers) and len(set(outcome.STATUS.values())) == 5


@pytest.mark.parametrize("aside", [1e-2, 1e-5, 1e-8])
def test_a_saddle_is_left_in_as_many_steps_as_its_distance_has_doublings(aside):
    """A platform on six parallel wires whose centre of mass stands too high above them: it turns over."""
    robot = schema.read_robot_file("robocrane")
    turn = np.arange(6) * np.pi / 3
    corners = 0.1 * np.column_stack([np.cos(turn), np.sin(turn), np.zeros(6)])
    robot = replace(robot, exit_m=corners + [0.0, 0.0, 2.0], platform_m=corners, centre_of_mass_m=np.array([0, 0, 1.0]))
    robot = replace(robot, mass_kg=4.0)
    k1 = 300.0
    wires = Wires("hooke", "saturating", {"k1": np.full((1, 1), k1)}, np.full((6, 1), 1000.0))
    upright = np.array([[0.0, 0.0, 1.0 - robot.mass_kg * GRAVITY / (6.0 * k1)]])
    tilted = rotation.matrix(np.array([[aside, 0.3 * aside, 0.0]]))
    found = forward.solve_equilibrium(robot, wires, np.ones((1, 6)), np.zeros(6), upright, tilted)
    assert found.found.all()
    assert found.rotation[0, 2, 2] < 0  # upside down
    assert found.iterations[0] < np.log2(1.0 / aside) + 20


def test_a_stiffness_that_has_overflowed_gives_no_step_and_spoils_no_other():
    rng = np.random.default_rng(0)
    H, gradient = rng.normal(size=(3, 3, 3)), rng.normal(size=(3, 3))
    level, floor = np.ones(3), np.zeros(3)
    alone = off_saddle(H[..., [0, 2]], gradient[:, [0, 2]], level[:2], floor[:2])
    H[1, 2, 1] = np.inf
    step = off_saddle(H, gradient, level, floor)
    assert np.isnan(step[:, 1]).all()
    np.testing.assert_allclose(step[:, [0, 2]], alone)


def test_what_strays_from_its_start_is_not_followed_to_where_it_would_end():
    robot = schema.read_robot_file("cogiro-desk")
    c = cases.commanded(robot, "hooke", 20, np.random.default_rng(3))
    start = c.position_m + np.array([0.0, 0.0, 0.2 * robot.size_m])
    free = forward.solve_equilibrium(robot, c.wires, c.zero_m, c.offset_m, start, c.rotation)
    far = np.linalg.norm(free.position_m - start, axis=1)
    assert free.found.all()
    loose = forward.solve_equilibrium(robot, c.wires, c.zero_m, c.offset_m, start, c.rotation, leash_m=10 * far)
    np.testing.assert_array_equal(loose.position_m, free.position_m)
    np.testing.assert_array_equal(loose.iterations, free.iterations)
    leash = np.where(np.arange(20) < 10, 0.1 * far, np.inf)
    held = forward.solve_equilibrium(robot, c.wires, c.zero_m, c.offset_m, start, c.rotation, leash_m=leash)
    assert (held.status[:10] == outcome.NOT_CONVERGED).all() and held.found[10:].all()
    assert (held.iterations[:10] < free.iterations[:10]).all()
    np.testing.assert_allclose(held.position_m[10:], free.position_m[10:], atol=1e-12)

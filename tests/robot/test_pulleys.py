"""Wires over swivelling pulleys: against a construction of its own, differences, MuJoCo's wrapping tendons, proofs."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.robot import cases
from tests.robot.cases import HANGING
from tests.robot.lines import CORE, line_about
from tests.robot.test_statics import check_derivatives
from wirebayes.robot.mechanics import draws, pulleys, rotation, schema, statics
from wirebayes.robot.mechanics.description import Pulleys
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion import claim, drift, forward, inverse
from wirebayes.robot.pose.answer import pose_report
from wirebayes.robot.pose.request import PoseRequest
from wirebayes.robot.proof import proofs
from wirebayes.robot.proof.ball_arithmetic import Balance
from wirebayes.robot.proof.certificate import certify
from wirebayes.robot.proof.reach import each_on_its_own, reach

ROBOTS = HANGING


def _robot(name, seed=1):
    return cases.with_pulleys(schema.read_robot_file(name), np.random.default_rng(seed))


def _constructed(radius, axis, line):
    """Length and tangent point of one wire: the tangent found as a root, in the plane of axis and platform point."""
    plane = np.linalg.svd(np.stack([axis, line]))[2][2]
    outward = np.cross(plane, axis)
    outward *= np.sign(outward @ line)
    rim = lambda a: radius * ((1 - np.cos(a)) * outward + np.sin(a) * axis)  # noqa: E731
    centre = radius * outward

    def slope(a):  # of the spoke against the straight part: zero at a tangent
        return (rim(a) - centre) @ (line - rim(a))

    angles = np.linspace(0, 1.5 * np.pi, 4000)
    values = np.array([slope(a) for a in angles])
    for i in np.flatnonzero((values[:-1] < 0) != (values[1:] < 0)):
        a = brentq(slope, angles[i], angles[i + 1], xtol=1e-15)
        onward = np.sin(a) * outward + np.cos(a) * axis  # the way the wire runs on the rim
        if onward @ (line - rim(a)) > 0:
            return radius * a + np.linalg.norm(line - rim(a)), rim(a)
    raise AssertionError("no tangent")


def test_the_wire_leaves_where_a_tangent_is_found():
    rng = np.random.default_rng(0)
    radius = rng.uniform(0.01, 0.2, 40)
    axis = rng.normal(size=(40, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    line = rng.normal(size=(40, 3)) + 0.5
    way = pulleys.wire_run(Pulleys(radius, axis), line.T[:, :, None])
    assert way.clear.all()
    for i in range(40):
        length, tangent = _constructed(radius[i], axis[i], line[i])
        assert abs(way.length_m[i, 0] - length) < 1e-12
        u = (line[i] - tangent) / np.linalg.norm(line[i] - tangent)
        np.testing.assert_allclose(way.direction[:, i, 0], u, atol=1e-11)
        np.testing.assert_allclose(way.straight_m[i, 0], np.linalg.norm(line[i] - tangent), rtol=1e-11)
        drawn = pulleys.traced(Pulleys(radius, axis), i, line[i], 2000)
        assert abs(np.linalg.norm(np.diff(drawn, axis=0), axis=1).sum() - length) < 1e-6
        np.testing.assert_allclose(drawn[-2], tangent, atol=1e-11)


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("law", ["hooke", "modified"])
def test_wrench_and_stiffness_over_pulleys_are_derivatives_of_the_energy(name, law):
    check_derivatives(_robot(name), law, seed=2)


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("law", ["hooke", "modified"])
def test_inverse_then_forward_returns_to_the_pose(name, law):
    robot, rng = _robot(name), np.random.default_rng(11)
    c = cases.commanded(robot, law, 40, rng)
    assert len(c.position_m) >= 10
    start = c.position_m + 0.05 * robot.size_m * rng.normal(size=c.position_m.shape)
    found = forward.solve_equilibrium(robot, c.wires, c.zero_m, c.offset_m, start, np.eye(3))
    assert found.found.all()
    off = np.abs(found.position_m - c.position_m).max(1), np.abs(found.rotation - c.rotation).max((1, 2))
    assert np.maximum(off[0], robot.size_m * off[1]).max() < 1e-9


@pytest.mark.parametrize("name", ROBOTS)
def test_mujocos_tendons_wrap_as_ours(name):
    mujoco = pytest.importorskip("mujoco")
    from wirebayes.robot.export.mujoco_model import mjcf

    robot, rng = _robot(name), np.random.default_rng(12)
    c = cases.commanded(robot, "hooke", 3, rng)
    some = np.full(robot.legs, 1.0)
    for x, R in zip(c.position_m, c.rotation, strict=True):
        shape = statics.geometry(robot, x[:, None], R[..., None])
        text = mjcf(robot, some, some, 0 * some, towards_m=x + robot.platform_m @ R.T)
        model = mujoco.MjModel.from_xml_string(text)
        data = mujoco.MjData(model)
        data.qpos[:3] = x
        if robot.degrees == 6:
            turn = rotation.vector(R[None])[0]
            mujoco.mju_axisAngle2Quat(data.qpos[3:7], turn / np.linalg.norm(turn), np.linalg.norm(turn))
        mujoco.mj_forward(model, data)
        before = robot.pulleys.radius_m  # the tendon starts a radius before the exit point
        np.testing.assert_allclose(data.ten_length - before, shape.distance_m[:, 0], rtol=1e-12)
    found = cases.solved(robot, c)
    assert found.found.all()
    lengths = np.full(robot.legs, c.wires.theta["k1"][0, 0]), c.zero_m[0], c.offset_m[0]
    soft = np.linalg.eigvalsh(
        statics.stiffness(robot, c.wires, c.position_m.T, np.moveaxis(c.rotation, 0, -1), c.zero_m.T, c.offset_m.T)[
            0, :3, :3
        ]
    )[0]
    towards = c.position_m[0] + robot.platform_m @ c.rotation[0].T
    start = found.position_m[0] + 1e-3 * robot.size_m, found.rotation[0]
    x, R, rested = cases.rest_in_mujoco(robot, *lengths, *start, soft, towards_m=towards)
    assert rested
    assert np.abs(x - found.position_m[0]).max() < 1e-6
    assert robot.size_m * np.abs(R - found.rotation[0]).max() < 1e-6


def test_without_a_pulley_nothing_changes_and_a_tiny_one_changes_little():
    robot = schema.read_robot_file("linear-7")
    rng = np.random.default_rng(3)
    c = cases.commanded(robot, "hooke", 5, rng)
    pose = c.position_m.T, np.moveaxis(c.rotation, 0, -1)
    bare = statics.geometry(robot, *pose)
    axis = np.tile([0.0, 0.0, 1.0], (7, 1))
    none = statics.geometry(replace(robot, pulleys=Pulleys(np.zeros(7), axis)), *pose)
    np.testing.assert_array_equal(none.distance_m, bare.distance_m)
    np.testing.assert_array_equal(none.direction, bare.direction)
    tiny = statics.geometry(replace(robot, pulleys=Pulleys(np.full(7, 1e-9), axis)), *pose)
    assert np.abs(tiny.distance_m - bare.distance_m).max() < 1e-8


def test_a_platform_inside_a_pulley_is_not_held():
    robot = schema.read_robot_file("hangprinter-4")
    line = robot.home_m - robot.exit_m[3]
    wheel = Pulleys(np.array([0, 0, 0, 0.5 * np.linalg.norm(line)]), np.tile([1.0, 0.0, 0.0], (4, 1)))
    inside = replace(robot, pulleys=wheel, exit_m=robot.exit_m + [0, 0, 0.0])
    at = robot.exit_m[3] + [0.0, 0.0, -wheel.radius_m[3]]
    assert np.isfinite(inverse.tensions(inside, robot.home_m[None] - [0, 0, 0.1], np.eye(3)[None])).all()
    assert np.isnan(inverse.tensions(inside, at[None], np.eye(3)[None])).all()
    along = robot.exit_m[3] - [1.0, 0.0, 0.0]  # on the swivel axis: the pulley may turn anyhow
    assert np.isnan(inverse.tensions(inside, along[None], np.eye(3)[None])).all()
    request = PoseRequest(at, np.eye(3), np.array([0.0, 60.0]))
    line = draws.WireDraws({k: np.ones(3) for k in draws.CORE} | {"k1": np.full(3, 3000.0)}, 1000.0)
    assert "inside a pulley" in pose_report(inside, line, request).content["sentence"]


@pytest.mark.parametrize("name", ROBOTS)
def test_proofs_know_pulleys(name):
    pytest.importorskip("flint")
    robot = _robot(name)
    c = cases.commanded(robot, "hooke", 2, np.random.default_rng(0))
    found = cases.solved(robot, c)
    k1 = np.full(robot.legs, c.wires.theta["k1"][0, 0])
    zero, offset, x, R = c.zero_m[0], c.offset_m[0], found.position_m[0], found.rotation[0]
    K = statics.stiffness(robot, c.wires.part(slice(0, 1)), x[:, None], R[..., None], zero[:, None], offset[:, None])[0]
    scale = np.array([1.0] * 3 + [1 / robot.size_m] * (robot.degrees - 3))
    slope = Balance(robot, "hooke", (k1, k1), (zero, zero), offset, x, R).middle_slope()
    np.testing.assert_allclose(-slope, K * np.outer(scale, scale), atol=1e-9 * np.abs(K).max())
    proof = certify(robot, "hooke", (k1, k1), (zero, zero), offset, x, R, how_alone=False)
    assert proof.proved
    assert proof.radius_m.max() < 1e-10
    point = replace(robot, pulleys=None)  # a proof about another robot must fail here
    wrong = certify(point, "hooke", (k1, k1), (zero, zero), offset, x, R, how_alone=False)
    assert not wrong.proved or np.any(wrong.radius_m > 1e-6)
    half_k1, half_zero = 1e-4 * k1, 1e-5 * zero
    got = reach(robot, "hooke", k1, zero, each_on_its_own(half_k1, half_zero), offset, x, R)
    assert got.proved
    signs = np.random.default_rng(1).choice([-1.0, 1.0], (2, 300, robot.legs))
    wires = Wires("hooke", "saturating", {"k1": (k1 + half_k1 * signs[0]).T}, np.full((robot.legs, 1), 1000.0))
    poses = forward.solve_equilibrium(robot, wires, zero + half_zero * signs[1], offset, x, R)
    moved = np.abs(poses.position_m - x).max(0)
    assert poses.found.all()
    assert (moved <= got.radius_m[:3]).all()
    assert (got.radius_m[:3] < 3 * moved).all()


def test_drift_and_maps_run_over_pulleys():
    robot = _robot("cogiro-desk")
    wires = draws.for_robot(robot, line_about(CORE, 0.05, 20, seed=2))
    course = drift.from_command(robot, wires, robot.home_m, np.eye(3), np.array([0.0, 60.0]))
    assert course.found.all()
    assert np.abs(course.position_m[:, 0] - robot.home_m).max() < 1e-9
    last = statics.geometry(robot, course.position_m[:, 1].T, np.moveaxis(course.rotation[:, 1], 0, -1))
    joint = inverse.commands(
        robot, wires, robot.home_m[None], np.eye(3)[None], inverse.tensions(robot, robot.home_m[None], np.eye(3)[None])
    ).joint_m
    zero = joint * (1 + course.end.strain(wires).T)
    stretched = statics.stretched(robot, last, robot.beyond_m[:, None]).T
    tension = wires.theta["k1"].T * np.maximum(stretched / zero - 1, 0)
    np.testing.assert_allclose(tension, course.tension_N[:, 1], rtol=1e-6)
    assert claim.over_workspace(robot, wires, claim.grid(robot, (2, 2, 1))).found == 1.0
    big = claim.scaled_robot(robot, 2.0, robot.mass_kg)
    np.testing.assert_allclose(big.pulleys.radius_m, 2 * robot.pulleys.radius_m)
    if pytest.importorskip("flint"):
        assert proofs.only_equilibrium(robot, wires, robot.home_m, np.eye(3))["proved"]

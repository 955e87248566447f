"""Stability of platforms on wires that are just not slack, against the energy itself."""

from dataclasses import replace

import numpy as np
import pytest

from tests.robot import drawn
from wirebayes.robot.mechanics import draws, schema, statics
from wirebayes.robot.mechanics.description import TensionRule
from wirebayes.robot.mechanics.rotation import matrix
from wirebayes.robot.motion import drift, forward, inverse, one_sided


def _at_zero(seed):
    """A drawn robot of six to nine wires with some at exactly 0 N: robot, wires, pose and lengths."""
    rng = np.random.default_rng(seed)
    one = drawn.draw(f"body-{rng.integers(7, 10)}", rng)
    robot = replace(one.robot, rule=TensionRule("minimum_norm", 0.0, one.robot.rule.highest_N))
    # the lower wires at 0 N, the upper ones alone carry the platform
    above = replace(robot, exit_m=robot.exit_m[:6], platform_m=robot.platform_m[:6], lines=robot.lines[:6])
    pose = one.position_m[None], one.rotation[None]
    tau = np.zeros((1, robot.legs))
    tau[:, :6] = inverse.tensions(above, *pose)
    wires = draws.for_robot(robot, one.line)
    commands = inverse.commands(robot, wires, *pose, tau)
    return robot, wires, pose, (commands.zero_m, commands.offset_m), bool(np.isfinite(tau).all())


def _probed(robot, wires, pose, lengths, rng, size):
    """Least second-order change of the energy over random displacements of a size, N/m."""
    step = rng.standard_normal((5_000, 6))
    step *= size / np.linalg.norm(step, axis=1, keepdims=True)
    x = pose[0] + step[:, :3]
    R = matrix(step[:, 3:] / robot.size_m) @ pose[1]
    both = np.concatenate([x, pose[0]]), np.concatenate([R, pose[1]])
    zero, offset = (value.T for value in lengths)
    energy = statics.potential(robot, wires, both[0].T, both[1].transpose(1, 2, 0), zero, offset)
    return 2 * (energy[:-1] - energy[-1]) / size**2


@pytest.mark.parametrize("seed", range(6))
def test_no_displacement_has_less_stiffness_than_the_least(seed):
    robot, wires, pose, lengths, held = _at_zero(seed)
    if not held:
        pytest.skip("the upper wires alone do not hold the platform there")
    least = one_sided.lowest_stiffness(robot, wires, pose, lengths)[0]
    stiffness = _probed(robot, wires, pose, lengths, np.random.default_rng(seed), 1e-5 * robot.size_m)
    assert stiffness.min() >= least - 1e-5 * stiffness.max()  # the energy's third order, at so short a step
    assert (stiffness.min() > 0) or least <= 0


def test_the_least_is_found_whatever_the_cones():
    """Against a search of the sphere, in three dimensions where it can be dense."""
    rng = np.random.default_rng(5)
    azimuth, height = np.meshgrid(np.linspace(0, 2 * np.pi, 721), np.linspace(-1, 1, 721))
    round_ = np.sqrt(1 - height**2)
    sphere = np.stack([round_ * np.cos(azimuth), round_ * np.sin(azimuth), height], -1).reshape(-1, 3)
    signs = []
    for _ in range(60):
        root = rng.standard_normal((3, 3))
        both = root + root.T
        one_way = 2 * rng.standard_normal((3, rng.integers(1, 5)))
        value = np.einsum("vi,ij,vj->v", sphere, both, sphere) + (np.maximum(sphere @ one_way, 0) ** 2).sum(1)
        least = one_sided._least_of(both, one_way)
        assert least == pytest.approx(value.min(), abs=2e-3)
        assert least <= value.min() + 1e-7
        signs.append(least > 0)
    assert 0 < sum(signs) < 60  # both verdicts were asked for


def _symmetric():
    """A platform that four upper wires carry and four lower ones, at 0 N, keep from toppling; with its commands."""
    exits = np.array([[x, y, z] for z in (5.0, 1.0) for x, y in ((-4.0, 3.0), (4.0, 3.0), (4.0, -3.0), (-4.0, -3.0))])
    points = np.array(
        [
            [x, y, z]
            for z, a, b in ((0.25, 0.65, 0.125), (0.75, 0.75, 0.1))
            for x, y in ((-a, b), (a, b), (a, -b), (-a, -b))
        ]
    )
    robot = replace(
        schema.read_robot_file("cogiro-desk"),
        exit_m=exits,
        platform_m=points,
        mass_kg=10.0,
        home_m=np.array([0.0, 0.0, 3.0]),
        centre_of_mass_m=np.array([0.0, 0.0, 0.5]),
        rule=TensionRule("minimum_norm", 0.0, 200.0),
        lines=np.ones(8),
        beyond_m=np.zeros(8),
        wire=("default",) * 8,
        drums=None,
        pulleys=None,
        mass_kg_m=None,
    )
    values = {"k1": [1800.0], "B": [0.5], "U": [0.7], "k2": [0.03], "N": [0.55]}
    line = draws.WireDraws({name: np.array(v) for name, v in values.items()}, 1000.0, "hooke")
    wires = draws.for_robot(robot, line)
    pose = robot.home_m[None], np.eye(3)[None]
    tau = inverse.tensions(robot, *pose)
    assert tau[0, 4:] == pytest.approx(0.0, abs=1e-6)
    commands = inverse.commands(robot, wires, *pose, tau)
    return robot, wires, pose, commands


def test_a_symmetric_platform_is_held_by_wires_at_zero_and_tilts_as_they_part():
    robot, wires, pose, commands = _symmetric()
    lengths = commands.zero_m, commands.offset_m
    stiff = one_sided.lowest_stiffness(robot, wires, pose, lengths)[0]
    probed = _probed(robot, wires, pose, lengths, np.random.default_rng(1), 1e-5)
    assert 0 < stiff <= probed.min()
    assert forward.solve_equilibrium(robot, wires, *lengths, *pose).found.all()
    # without the lower wires it would topple
    alone = commands.zero_m * np.where(np.arange(8) < 4, 1.0, 1.5)
    assert one_sided.lowest_stiffness(robot, wires, pose, (alone, lengths[1]))[0] < 0
    course = drift.from_command(robot, wires, robot.home_m, np.eye(3), np.array([0.0, 60.0]))
    assert course.found.all()
    aside = np.abs(course.position_m[0, -1, :2]).max()
    down = robot.home_m[2] - course.position_m[0, -1, 2]
    assert 0 < aside < down  # the upper wires creep, it sinks, tilts and leans on lower ones
    assert (course.tension_N[0, -1, 4:] > 0).sum() in (1, 2)


def test_a_direction_that_is_not_finite_is_no_support(monkeypatch):
    """Of a balance that a search tries where an exit point and a platform point coincide."""
    robot, wires, pose, commands = _symmetric()
    lengths = commands.zero_m, commands.offset_m
    assert one_sided.held(robot, wires, pose, lengths).all()
    jacobian = statics.wire_jacobian
    monkeypatch.setattr(one_sided.statics, "wire_jacobian", lambda *given: jacobian(*given) * np.nan)
    assert not one_sided.held(robot, wires, pose, lengths).any()


@pytest.mark.parametrize(("share", "stable"), [(0.99e-9, False), (1.01e-9, True)])
@pytest.mark.parametrize("touching", [True, False])
def test_a_balance_is_held_where_its_least_stiffness_is_more_than_rounding(share, stable, touching, monkeypatch):
    """A thousand-millionth of the largest: less is that of one without any."""
    bounds = np.array([touching]), np.array([share * 5e4]), np.array([5e4])
    monkeypatch.setattr(one_sided, "_bounds", lambda *given: bounds)
    assert one_sided.held(*[None] * 4).tolist() == [touching and stable]

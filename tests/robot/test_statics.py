from types import SimpleNamespace

import numpy as np
import pytest

from tests.robot.cases import HANGING
from wirebayes.numeric import cholesky
from wirebayes.robot.mechanics import rotation, schema, statics
from wirebayes.robot.mechanics.wires import tension

from . import cases


@pytest.mark.parametrize("name", HANGING)
@pytest.mark.parametrize("law", ["hooke", "modified"])
def test_wrench_and_stiffness_are_derivatives_of_the_energy(name, law):
    check_derivatives(schema.read_robot_file(name), law)


def check_derivatives(robot, law, seed=5):
    """Against central differences; the seed keeps wires away from the edge of slackness, where the slope jumps."""
    rng = np.random.default_rng(seed)
    c = cases.disturbed(robot, law, 6, rng)
    d, n = robot.degrees, len(c.position_m)

    def energy(q):
        x = c.position_m + q[:3]
        R = rotation.matrix(q[3:]) @ c.rotation if d == 6 else c.rotation
        return statics.potential(robot, c.wires, x.T, np.moveaxis(R, 0, -1), c.zero_m.T, c.offset_m.T)

    R = np.moveaxis(c.rotation, 0, -1)
    shape = statics.geometry(robot, c.position_m.T, R)
    tau, slope = tension(c.wires, statics.stretched(robot, shape, c.offset_m.T), c.zero_m.T)
    gradient, hessian = statics.unbalance_and_stiffness(robot, shape, R, tau, slope)
    np.testing.assert_allclose(gradient, -(cases.wrench(robot, shape, tau) + statics.weight(robot, R)))
    h = 1e-4 * robot.size_m if d == 6 else 1e-4
    steps = h * np.diag([1.0] * 3 + [1.0 / robot.size_m] * (d - 3))
    span = np.diag(steps)
    slopes = np.array([(energy(e) - energy(-e)) / (2 * s) for e, s in zip(steps, span, strict=True)])
    stiff = np.max(np.abs([hessian[i][i] for i in range(3)]), axis=0)
    weights = np.array([1.0] * 3 + [1.0 / robot.size_m] * (d - 3))[:, None]
    assert np.max(np.abs(slopes - gradient) * weights / (stiff * h)) < 1e-4
    for i in range(d):
        for j in range(d):
            a, b = steps[i], steps[j]
            second = (energy(a + b) - energy(a - b) - energy(b - a) + energy(-a - b)) / (4 * span[i] * span[j])
            error = np.abs(second - hessian[i][j]) * weights[i] * weights[j] / stiff
            assert np.max(error) < 1e-4, (i, j)
    assert n >= 3


def test_a_taut_wire_that_ends_where_it_begins_has_a_finite_stiffness():
    robot = schema.read_robot_file("cogiro-desk")
    exit_m = robot.exit_m[:1].T
    shape = statics.geometry(robot, exit_m - robot.platform_m[:1].T, np.eye(3)[..., None])
    assert shape.straight_m[0] == 0.0
    taut = np.ones((robot.legs, 1))
    with np.errstate(all="raise"):
        gradient, hessian = statics.unbalance_and_stiffness(robot, shape, np.eye(3)[..., None], taut, taut)
    assert np.isfinite(gradient).all()
    assert np.isfinite(hessian).all()


def test_nothing_is_computed_with_memory_that_holds_no_numbers_yet(monkeypatch):
    """What numpy.empty returns may be anything, as a NaN that signals when it is added to."""
    signalling = np.array(0x7FF0000000000001, dtype=np.uint64).view(np.float64)
    numpy = SimpleNamespace(**vars(np) | {"empty": lambda shape, kind=float: np.broadcast_to(signalling, shape).copy()})
    monkeypatch.setattr(statics, "np", numpy)
    with np.errstate(all="raise"):
        check_derivatives(schema.read_robot_file("cogiro-desk"), "hooke")


def test_rotation_vector_round_trip_keeps_tiny_and_large_angles():
    v = np.array([[1e-9, -2e-10, 3e-10], [0.1, 0.2, -0.3], [0.0, 3.1, 0.0], [0.0, 0.0, 0.0]])
    np.testing.assert_allclose(rotation.vector(rotation.matrix(v)), v, rtol=1e-7, atol=1e-20)


def test_tilt_is_the_angle_of_the_normal():
    R = rotation.matrix(np.array([[0.0, 0.02, 0.0], [0.0, 0.0, 1.0], [1e-6, 0.0, 0.0]]))
    np.testing.assert_allclose(rotation.tilt(R), [0.02, 0.0, 1e-6], atol=1e-16)


@pytest.mark.parametrize("d", [3, 6])
def test_many_small_systems_are_solved_at_once(d):
    rng = np.random.default_rng(d)
    root = rng.standard_normal((7, d, d))
    matrices, right = root @ np.swapaxes(root, 1, 2) + 0.1 * np.eye(d), rng.standard_normal((7, d))
    matrices[2] -= 5.0 * np.eye(d)  # not positive definite
    upper = np.moveaxis(np.triu(matrices), 0, -1)
    before = upper.copy(), right.T.copy()
    x, positive = cholesky.solve_symmetric(upper, right.T)
    np.testing.assert_array_equal(upper, before[0])
    np.testing.assert_array_equal(right.T, before[1])
    assert positive.tolist() == [k != 2 for k in range(7)]
    good = np.flatnonzero(positive)
    np.testing.assert_allclose(x.T[good], np.linalg.solve(matrices[good], right[good][..., None])[..., 0], rtol=1e-9)
    flat = np.moveaxis(np.broadcast_to(np.outer(right[0], right[0]), (1, d, d)), 0, -1)  # rank one: lost to rounding
    assert not cholesky.solve_symmetric(flat, right[:1].T)[1][0]

import numpy as np
import pytest
from scipy.optimize import linprog, minimize

from tests.robot.cases import HANGING
from wirebayes.robot.mechanics import schema, statics, tensions
from wirebayes.robot.motion import inverse

ROBOTS = HANGING


def _problem(name, seed=0):
    robot = schema.read_robot_file(name)
    x = np.random.default_rng(seed).uniform(robot.lower_m, robot.upper_m)
    shape = statics.geometry(robot, x[:, None], np.eye(3)[..., None])
    structure = (-statics.jacobian(robot, shape) * robot.lines[:, None])[..., 0]
    return robot, structure, -statics.weight(robot, np.eye(3)[..., None])[:, 0]


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("choice", sorted(tensions.CHOICES))
def test_tensions_carry_the_weight_within_bounds_and_are_the_nearest(name, choice):
    robot, structure, load = _problem(name)
    low, high = robot.rule.lowest_N, robot.rule.highest_N
    tau = tensions.CHOICES[choice](structure, load, low, high)
    assert tau is not None
    np.testing.assert_allclose(structure @ tau, load, atol=1e-9 * np.abs(load).max())
    assert tau.min() >= low - 1e-6
    assert tau.max() <= high + 1e-6
    reference = np.zeros(robot.legs) if choice == "minimum_norm" else np.full(robot.legs, 0.5 * (low + high))
    other = minimize(
        lambda t: ((t - reference) ** 2).sum() / high**2,
        tau * 1.01,
        jac=lambda t: 2 * (t - reference) / high**2,
        method="SLSQP",
        bounds=[(low, high)] * robot.legs,
        options={"ftol": 1e-14, "maxiter": 300},
        constraints={"type": "eq", "fun": lambda t: structure @ t - load, "jac": lambda t: structure},
    )
    ours = np.sum((tau - reference) ** 2)
    assert ours <= np.sum((other.x - reference) ** 2) * (1 + 1e-5) + 1e-9


def test_impossible_bounds_are_refused():
    _, structure, load = _problem("cogiro-desk")
    assert tensions.minimum_norm(structure, load, 0.5, 1.0) is None


@pytest.mark.parametrize("wires", [7, 9, 12])
@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("beyond", [0.0, 1e-14, 1e-12, 1e-9])
def test_the_only_tensions_that_fit_are_found(wires, seed, beyond):
    """The lowest tension is the highest that the load allows, or beyond it by rounding."""
    rng = np.random.default_rng(seed)
    structure = rng.normal(size=(6, wires))
    load = structure @ rng.uniform(0.5, 3.0, wires)
    above = np.column_stack([-np.eye(wires), np.ones(wires)])  # the least tension is below each of them
    carried = np.column_stack([structure, np.zeros(len(load))])
    best = linprog(-np.eye(wires + 1)[-1], above, np.zeros(wires), carried, load, bounds=(0.0, 1000.0))
    lowest = float(best.x[-1])
    tau = tensions.minimum_norm(structure, load, lowest * (1 + beyond), 1000.0)
    assert tau is not None
    np.testing.assert_allclose(structure @ tau, load, atol=1e-9 * np.abs(load).max())
    assert tau.min() >= lowest - 2e-8 * max(tau.max(), np.abs(load).max())


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize("axis", [0, 1])
def test_tensions_that_leave_their_bounds_come_back_to_the_corner_that_is_nearest(axis, sign):
    """10 N on three wires side by side, 1 to 5 N each: one too tight, one too loose, by an axis of the null space."""
    structure, load = np.ones((1, 3)), np.array([10.0])
    way = sign * np.linalg.svd(structure)[2][1 + axis]
    corner = np.full(3, 4.0)
    corner[way.argmax()], corner[way.argmin()] = 5.0, 1.0
    np.testing.assert_allclose(tensions.nearest(corner + 2.0 * way, structure, load, 1.0, 5.0), corner, atol=1e-9)
    assert tensions.nearest(corner + 2.0 * way, structure, load, 1.0, 3.3) is None


@pytest.mark.parametrize("N_per_N", [0.1, 1.0, 10.0])  # of load, by a tension of 1 N
def test_one_wire_may_miss_its_bounds_by_rounding_and_no_more(N_per_N):
    """A billionth of the tension, or of the load where that is more."""
    structure, load, tau = np.array([[N_per_N]]), np.array([60.0]), 60.0 / N_per_N
    billionth = 1e-9 * max(tau, 60.0)

    def held(low, high):
        return tensions.nearest(np.zeros(1), structure, load, low, high) is not None

    assert held(tau + 0.9 * billionth, 9e9) and held(0.0, tau - 0.9 * billionth)
    assert not held(tau + 1.1 * billionth, 9e9) and not held(0.0, tau - 1.1 * billionth)


def test_a_load_that_the_wires_cannot_make_is_refused_beyond_rounding():
    """A wire downwards, and a load that points a little to the side."""
    structure = np.array([[0.0], [2.0]])
    for aside, carried in ((0.9e-9, True), (1.1e-9, False)):
        tau = tensions.nearest(np.zeros(1), structure, np.array([60.0 * aside, 60.0]), 1.0, 90.0)
        assert (tau is not None) == carried


def test_a_wire_that_gives_no_wrench_but_rounding_takes_its_reference():
    """Beside a wire of 1 N for 1 N, one of as good as nothing: below 1e-10 it is free, above it the load decides."""
    for lever, second_N in ((0.9e-10, 5.0), (1.1e-10, 0.0)):
        tau = tensions.nearest(np.array([0.0, 5.0]), np.diag([1.0, lever]), np.array([60.0, 0.0]), -90.0, 90.0)
        np.testing.assert_allclose(tau, [60.0, second_N], atol=1e-9)


def test_a_pose_outside_the_wires_is_infeasible():
    robot = schema.read_robot_file("cogiro-desk")
    tau = inverse.tensions(robot, np.array([[3.0, 0.0, 0.3]]), np.eye(3)[None])
    assert np.isnan(tau).all()


def test_a_users_own_choice_is_used():
    robot = schema.read_robot_file("cogiro-desk")
    x, R = robot.home_m[None], np.eye(3)[None]
    stiffer = inverse.tensions(robot, x, R, choice=lambda s, w, lo, hi: tensions.minimum_norm(s, w, 5.85, hi))
    assert np.nanmin(stiffer) >= 5.85 - 1e-9 > inverse.tensions(robot, x, R).min()


def test_tensions_exactly_at_a_bound_are_within():
    """Of two wires the load decides the first, and the second is free: both at the lowest, or at the highest."""
    structure = np.array([[1.0, 0.0]])
    for low, high in ((2.0, 9.0), (0.0, 2.0), (2.0, 2.0)):
        tau = tensions.nearest(np.array([7.0, 2.0]), structure, np.array([2.0]), low, high)
        np.testing.assert_array_equal(tau, [2.0, 2.0])
    # a hair outside they come back to the bound
    tau = tensions.nearest(np.array([7.0, 2.0]), structure, np.array([2.0]), 0.0, 2.0)
    np.testing.assert_array_equal(tau, [2.0, 2.0])
    np.testing.assert_allclose(tensions.nearest(np.array([7.0, 5.0]), structure, np.array([2.0]), 1.0, 3.0), [2.0, 3.0])
    np.testing.assert_allclose(tensions.nearest(np.array([7.0, 0.0]), structure, np.array([2.0]), 1.0, 3.0), [2.0, 1.0])


@pytest.mark.parametrize("unit", [2.0**-20, 1.0, 2.0**20])
def test_without_a_load_wires_pull_against_each_other(unit):
    """As near to the reference as their balance allows, whatever the unit of force."""
    structure, none = np.array([[1.0, -1.0]]), np.zeros(1)
    tau = tensions.nearest(unit * np.array([3.0, 1.0]), structure, none, 0.0, unit * 9.0)
    np.testing.assert_allclose(tau, unit * np.array([2.0, 2.0]), rtol=1e-12)
    np.testing.assert_allclose(
        tensions.nearest(np.zeros(2), structure, none, unit, unit * 9.0), [unit, unit], rtol=1e-9
    )
    np.testing.assert_allclose(tensions.minimum_norm(structure, none, unit, unit * 9.0), [unit, unit], rtol=1e-9)
    np.testing.assert_allclose(tensions.middle(structure, none, unit, unit * 9.0), [unit * 5.0] * 2, rtol=1e-9)
    assert tensions.nearest(np.zeros(2), np.array([[1.0, 1.0]]), none, unit, unit * 9.0) is None


def test_bounds_that_no_tensions_reach_are_refused_and_those_they_touch_are_not():
    """Ten newtons on two wires, at least five each: only five and five will do, and 5.1 each will not."""
    structure, load = np.ones((1, 2)), np.array([10.0])
    np.testing.assert_allclose(tensions.nearest(np.array([9.0, 1.0]), structure, load, 5.0, 9.0), [5.0, 5.0], atol=1e-6)
    assert tensions.nearest(np.array([9.0, 1.0]), structure, load, 5.1, 9.0) is None
    assert tensions.nearest(np.array([9.0, 1.0]), structure, load, 0.0, 4.9) is None


@pytest.mark.parametrize(
    ("way", "low", "high", "held"),
    [
        (1.0, 2.0, 20.0, False),
        (1.0, 0.0, 8.5, False),
        (-1.0, 2.0, 9.6, True),
        (-1.0, 2.0, 7.9, False),
        (-1.0, 2.1, 9.6, False),
    ],
)
def test_what_the_solver_returns_is_held_against_both_bounds(way, low, high, held, monkeypatch):
    """From nine and one newton it moves a half along the null space, or one back, whatever the bounds are."""
    structure, load, at = np.ones((1, 2)), np.array([10.0]), np.array([9.0, 1.0])
    null = np.linalg.svd(structure)[2][1]
    moved = np.array([0.5, -0.5]) if way > 0 else np.array([-1.0, 1.0])

    outside = max(low - at.min(), at.max() - high)
    monkeypatch.setattr(tensions, "_least_distance", lambda G, h: np.array([null @ moved / outside]))
    tau = tensions.nearest(at, structure, load, low, high)
    assert (tau is not None) is held
    if held:
        np.testing.assert_allclose(tau, at + moved)


@pytest.mark.parametrize(("miss", "held"), [(0.9e-8, True), (1.1e-8, False)])
@pytest.mark.parametrize(("at", "largest"), [([9.0, 1.0], 10.0), ([109.0, -99.0], 108.0)])
def test_what_the_solver_returns_may_miss_a_bound_by_rounding(at, largest, miss, held, monkeypatch):
    """By a hundred-millionth of the largest tension, or of the load where that is more; at either bound."""
    structure, load, at = np.ones((1, 2)), np.array([10.0]), np.array(at)
    end, null = at + [-1.0, 1.0], np.linalg.svd(structure)[2][1]
    for low, high in ((-1e6, end[0] - miss * largest), (end[1] + miss * largest, 1e6)):
        outside = max(low - at.min(), at.max() - high)
        step = np.array([null @ (end - at) / outside])
        monkeypatch.setattr(tensions, "_least_distance", lambda G, h, step=step: step)
        assert (tensions.nearest(at, structure, load, low, high) is not None) is held

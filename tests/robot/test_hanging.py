"""Fewer wires than degrees of freedom: orientations in balance against an energy minimiser that shares no code."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analyses.robots.hanging import compared, drawn
from wirebayes.robot.mechanics import rotation as turning
from wirebayes.robot.mechanics import schema
from wirebayes.robot.motion import hanging, inverse, nearest_balance
from wirebayes.robot.pose.orientation import balanced_orientation

FREE = np.nan


@pytest.fixture(scope="module")
def four():
    """Four wires, and a level platform away from the middle, which cannot be level there."""
    return replace(
        schema.read_robot_file("cogiro"),
        exit_m=np.array([[-2.0, -2.0, 4.0], [-2.0, 2.0, 4.0], [2.0, 2.0, 4.0], [2.0, -2.0, 4.0]]),
        platform_m=np.array([[-0.2, -0.2, 0.0], [-0.2, 0.2, 0.0], [0.2, 0.2, 0.0], [0.2, -0.2, 0.0]]),
        lines=np.ones(4), beyond_m=np.zeros(4), actuator=("drum",) * 4, ratio=np.zeros(4), wire_m=np.zeros(4),
        wire=("default",) * 4, mass_kg=1.0, centre_of_mass_m=np.zeros(3), home_m=np.array([0.5, 0.3, 2.0]),
        home_rotation_rad=np.zeros(3), pulleys=None, drums=None, mass_kg_m=None,
        rule=replace(schema.read_robot_file("cogiro").rule, lowest_N=0.1, highest_N=100.0),
    )  # fmt: skip


def test_the_orientation_is_an_energy_minimum_of_its_own_lengths():
    found = [compared(*drawn(np.random.default_rng(seed))) for seed in range(12)]
    hung = [one for one in found if one is not None]
    assert len(hung) >= 8
    assert max(max(one) for one in hung) < 1e-6


def test_tensions_hold_the_orientation_that_was_found_and_no_level_one(four):
    x, level = four.home_m[None], np.eye(3)[None]
    assert np.isnan(inverse.tensions(four, x, level)).all()
    found = hanging.hang(four, x, np.eye(3))
    np.testing.assert_allclose(inverse.tensions(four, x, found.rotation), found.tension_N, rtol=1e-9)
    assert found.choice[0] == 1


def test_of_a_family_the_rule_of_the_tensions_chooses(four):
    """Minimum norm: a little more or less of the component that can be chosen gives larger tensions."""
    found = hanging.hang(four, four.home_m[None], np.eye(3))
    yaw = turning.vector(found.rotation)[0, 2]
    for other in (yaw - 1e-3, yaw + 1e-3):
        beside = hanging.hang(four, four.home_m[None], np.eye(3), np.array([FREE, FREE, other]))
        assert np.linalg.norm(beside.tension_N) > np.linalg.norm(found.tension_N)


def test_a_component_that_is_asked_for_is_had_and_the_others_are_said(four):
    found = balanced_orientation(four, four.home_m, np.array([FREE, FREE, -0.00057]))
    vector = turning.vector(found.rotation[None])[0]
    np.testing.assert_allclose(vector, [0.16327, -0.28544, -0.00057], atol=2e-5)
    assert found.found["commanded_components"] == ["rz"] and found.found["free_components"] == ["rx", "ry"]
    assert not found.refused


def test_more_components_than_the_wires_command_are_refused_by_name(four):
    found = balanced_orientation(four, four.home_m, np.array([0.0, FREE, -0.00057]))
    assert len(found.found["commanded_components"]) == 1 and len(found.found["refused_components"]) == 1
    assert found.found["refused_components"][0] in found.refused


def test_tensions_beyond_the_bounds_hold_nothing(four):
    weak = replace(four, rule=replace(four.rule, highest_N=4.0))
    assert not balanced_orientation(weak, weak.home_m, None).found
    strong = replace(four, rule=replace(four.rule, highest_N=5.2))
    assert balanced_orientation(strong, strong.home_m, None).found


def test_two_wires_command_two_directions_and_name_the_nearest_position(four):
    pair = replace(
        four,
        exit_m=np.array([[0.0, 0.0, 2.0], [1.3, 0.0, 2.0]]),
        lines=np.ones(2),
        beyond_m=np.zeros(2),
        platform_m=np.array([[-0.06, 0.0, 0.03], [0.06, 0.0, 0.03]]),
        centre_of_mass_m=np.array([0.0, 0.0, -0.02]),
        actuator=("drum",) * 2,
        ratio=np.zeros(2),
        wire_m=np.zeros(2),
        wire=("default",) * 2,
        mass_kg=0.7,
    )
    found = balanced_orientation(pair, np.array([0.4, 0.0, 1.2]), None)
    np.testing.assert_allclose(turning.vector(found.rotation[None])[0], [0.0, 0.25961, 0.0], atol=1e-5)
    assert found.found["position_directions"] == 2 and found.found["commanded_degrees"] == 2
    beside = balanced_orientation(pair, np.array([0.4, 0.1, 1.2]), None)
    assert beside.found is None and "nearest position" in beside.sentence


def test_a_robot_with_wires_enough_keeps_its_home_orientation():
    robot = schema.read_robot_file("linear-7")
    found = balanced_orientation(robot, robot.home_m, None)
    assert found.found is None
    np.testing.assert_array_equal(found.rotation, turning.matrix(robot.home_rotation_rad))


@pytest.mark.parametrize("position_m", [(0.0, 0.0, 0.3), (0.03, 0.0, 0.3), (0.1, 0.05, 0.3), (0.1, 0.05, 0.8)])
def test_of_two_wires_at_their_bounds_that_leave_no_balance_one_is_let_go(position_m):
    """A Hangprinter whose mover may turn: a least-squares search from anywhere finds balances there."""
    robot = schema.read_robot_file(Path(__file__).parent / "field" / "balanced-home" / "hang-free.toml")
    x = np.array([position_m])
    found = hanging.hang(robot, x, np.eye(3))
    assert np.linalg.norm(turning.vector(found.rotation)[0]) < 0.1
    np.testing.assert_allclose(inverse.tensions(robot, x, found.rotation), found.tension_N, rtol=1e-6)
    assert found.tension_N.min() == pytest.approx(robot.rule.lowest_N)  # the smallest tensions, one at its bound


def test_in_a_plane_only_turns_about_its_normal_are_orientations():
    wall = schema.read_robot_file(Path(__file__).parent / "field" / "balanced-home" / "wall.toml")
    found = hanging.hang(wall, wall.home_m[None], np.eye(3))
    turns = np.vstack([turning.vector(found.rotation), *found.others])
    np.testing.assert_allclose(turns[0], [0.0, -0.1181, 0.0], atol=1e-4)
    np.testing.assert_allclose(turns[:, [0, 2]], 0.0, atol=1e-6)


@pytest.mark.slow
def test_three_hundred_drawn_robots_agree_with_the_energy_minimiser():
    found = [compared(*drawn(np.random.default_rng(seed))) for seed in range(400)]
    hung = [one for one in found if one is not None]
    assert len(hung) >= 300
    assert max(max(one) for one in hung) < 1e-6


@pytest.mark.parametrize(("hindrance", "goes_on"), [(0.99e-6, False), (1.01e-6, True)])
def test_a_bound_is_left_where_it_keeps_a_search_from_its_goal_by_more_than_rounding(four, hindrance, goes_on):
    aim = nearest_balance._Aim(four, np.full(3, np.nan), False)
    search = nearest_balance._Search.beginning(aim, np.tile(four.home_m, (2, 1)), np.tile(np.eye(3), (2, 1, 1)))
    search.bound[:, 2] = 1
    each = np.array([[0.0, 0.0, hindrance, 0.0]] * 2)
    rest = np.array([True, False])  # only what has come to rest lets go
    assert search.let_go(np.arange(2), rest, each).tolist() == [goes_on, False]
    assert search.bound[:, 2].tolist() == [0 if goes_on else 1, 1]
    assert not search.let_go(np.arange(2), rest, each).any() or not goes_on  # never twice: that would be a circle

"""A home orientation that nothing holds: how near to it the platform hangs, and that it is said."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from wirebayes.answers.robot import of_pose
from wirebayes.commands import export
from wirebayes.commands.asked_pose import asked_place
from wirebayes.commands.wires import folder_of, robot_of
from wirebayes.errors import InputError
from wirebayes.robot.history.balanced import balanced, turned_rows
from wirebayes.robot.history.history import History
from wirebayes.robot.mechanics import rotation as turning
from wirebayes.robot.mechanics import sag, schema
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.motion import hanging, home, plausible
from wirebayes.robot.pose import orientation
from wirebayes.robot.pose.orientation import balanced_orientation
from wirebayes.sentences import coordinates

FIELD = Path(__file__).parent / "field"


def six_wires(centre_of_mass_m=(0.02, 0.01, -0.05), turned_rad=(0.0, 0.0, 0.0)) -> Robot:
    """A platform under three pairs of exit points, which hangs level on tensions from 1 to 400 N."""
    third = 2 * np.pi / 3 * (np.arange(6) // 2)
    side = np.tile([-1.0, 1.0], 3)

    def ring(angle, radius, height):
        return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.full(6, height)])

    base = schema.read_robot_file("cogiro")
    return replace(
        base, name="six", exit_m=ring(third + 0.15 * side, 2.5, 3.0), platform_m=ring(third + 0.85 * side, 0.35, 0.05),
        lines=np.ones(6), beyond_m=np.zeros(6), actuator=("drum",) * 6, ratio=np.zeros(6), wire_m=np.zeros(6),
        wire=("default",) * 6, mass_kg=12.0, centre_of_mass_m=np.array(centre_of_mass_m),
        home_m=np.array([0.2, -0.1, 1.2]), home_rotation_rad=np.array(turned_rad), pulleys=None, drums=None,
        mass_kg_m=None, rule=replace(base.rule, choice="minimum_norm", lowest_N=1.0, highest_N=400.0),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("wrong", "degrees"),
    [({"centre_of_mass_m": (1.5, 0.01, -0.05)}, "74.8"), ({"turned_rad": (0.0, 0.0, 20.0)}, "27.6")],
)
def test_a_home_orientation_that_nothing_holds_is_said_with_its_distance(wrong, degrees):
    robot = six_wires(**wrong)
    found = balanced_orientation(robot, robot.home_m, None)
    (said,) = found.turned_away
    assert f"hangs {degrees} degrees away" in said.text and "pose.rotation_vector_rad" in said.text
    assert home.home_notices(robot) == [said]
    assert "nearest to the home orientation" in found.found["sentence"]


def test_what_is_held_or_asked_for_is_no_warning():
    robot = six_wires()
    assert balanced_orientation(robot, robot.home_m, None).turned_away == ()
    tilted = six_wires(centre_of_mass_m=(1.5, 0.01, -0.05))
    assert balanced_orientation(tilted, tilted.home_m, np.array([np.nan, 0.1, np.nan])).turned_away == ()


@pytest.mark.parametrize(("degrees", "said"), [(0.999, False), (1.001, True)])
def test_a_tilt_that_no_eye_sees_is_no_warning(degrees, said):
    rotation = turning.matrix(np.array([0.0, np.radians(degrees), 0.0]))
    assert bool(home.turned_away(six_wires(), rotation)) == said


def four_wires(stated_rad=(0.0, 0.0, 0.0)) -> Robot:
    """Four wires as a command has them: balance turns the platform by 18 degrees where it is to be level."""
    robot = schema.read_robot_file(FIELD / "under-actuated" / "cube4-off.toml")
    return robot_of(replace(robot, home_rotation_rad=np.array(stated_rad)))


def test_a_home_orientation_that_balance_replaces_is_said_with_both():
    robot = four_wires()
    (said,) = home.home_notices(robot)
    assert said.kind == "unheld" and said.text.startswith("balance, to which 4 wires leave the orientation")
    assert "hangs 18.5 degrees away" in said.text and "write [0.1578, -0.2825, -0.0008322] there" in said.text
    assert balanced_orientation(robot, robot.home_m, None).turned_away == (said,)
    assert home.home_notices(four_wires((0.1578, -0.2825, -0.0008322))) == []


def test_a_home_orientation_that_the_file_leaves_to_balance_is_no_warning():
    wall = robot_of(FIELD / "balanced-home" / "wall.toml")
    assert wall.home_rotation_rad[1] == pytest.approx(-0.1181, abs=1e-4)
    assert home.home_notices(wall) == []
    assert balanced_orientation(wall, wall.home_m, None).turned_away == ()
    assert home.home_notices(replace(wall, home_rotation_is_stated=True))


@pytest.mark.parametrize(
    ("normal", "turned_rad", "free"),
    [
        ((0.0, 1.0, 0.0), (0.0, -0.1181, 0.0), ["ry"]),
        ((0.6, 0.8, 0.0), (0.0, 0.0, 0.0), ["rx", "ry"]),
        ((0.0, 1.0, 0.0), (0.0, 0.0, 0.3), ["rx", "ry"]),
    ],
)
def test_in_a_plane_balance_decides_what_turns_about_its_normal(normal, turned_rad, free):
    wall = robot_of(FIELD / "balanced-home" / "wall.toml")
    tilted = replace(wall, plane=replace(wall.plane, normal=np.array(normal)))
    assert orientation.by_lines(tilted, turning.matrix(np.array(turned_rad)))["free_components"] == free


@pytest.mark.parametrize("asked_rad", [None, np.array([0.0, np.nan, 0.0]), np.zeros(3)])
def test_on_a_wall_balance_decides_one_component_and_none_is_commanded(asked_rad):
    wall = robot_of(FIELD / "balanced-home" / "wall.toml")
    found = balanced_orientation(wall, wall.home_m, asked_rad).found
    assert (found["free_components"], found["commanded_components"]) == (["ry"], [])
    assert "balance decides ry, the position" in found["sentence"]


def test_elsewhere_or_asked_for_the_orientation_of_fewer_wires_is_no_warning():
    robot = four_wires()
    assert balanced_orientation(robot, robot.home_m - [0.1, 0.0, 0.0], None).turned_away == ()
    assert balanced_orientation(robot, robot.home_m, np.array([np.nan, np.nan, 0.0])).turned_away == ()


@pytest.mark.parametrize(("degrees", "said"), [(0.99, False), (1.01, True)])
def test_what_balance_changes_by_less_than_an_eye_sees_is_no_warning(degrees, said):
    balance = turning.matrix(four_wires().home_rotation_rad)
    beside = turning.vector((turning.matrix(np.array([np.radians(degrees), 0.0, 0.0])) @ balance)[None])[0]
    assert bool(home.home_notices(four_wires(beside))) == said


def test_a_home_position_without_balance_is_said_with_its_metres():
    robot = replace(two_wires(), home_m=np.array([0.2, 0.05, -0.6]))
    (said,) = home.home_notices(robot)
    assert said.kind == "unheld" and "is 0.05 m away, (0.2, 0, -0.6) m" in said.text
    (nowhere,) = home.home_notices(replace(robot, home_m=np.array([0.2, 0.0, 0.4])))
    assert nowhere.text.endswith("the home pose of the robot's file (pose.position_m)")
    assert home.home_notices(two_wires()) == []


@pytest.mark.parametrize("files", [{}, {"klipper.cfg": "", "robot.xml": ""}])
def test_an_export_gives_the_metres_to_the_nearest_balance_with_and_without_simulators(files):
    robot = replace(two_wires(), home_m=np.array([0.2, 0.05, -0.6]))
    said = export._warnings(robot, files)
    assert [notice for notice in said if "is 0.05 m away" in notice.text] == home.home_notices(robot)


def test_an_export_says_once_that_nothing_holds_the_home_pose():
    robot = replace(two_wires(), home_m=np.array([0.2, 0.05, -0.6]))
    said = export._warnings(robot, {"klipper.cfg": ""})
    assert [notice.kind for notice in said if "home pose" in notice.text] == ["unheld", "left-out"]
    assert sum("no tensions" in notice.text for notice in said) == 1


@pytest.mark.parametrize(("beyond_m", "said"), [(-0.01, False), (0.0, False), (1e-7, False), (1e-4, True)])
def test_a_home_position_outside_the_workspace_is_said(beyond_m, said):
    robot = six_wires()
    low = replace(robot, lower_m=robot.home_m - [1, -beyond_m, 1], upper_m=robot.home_m + 1)
    high = replace(robot, lower_m=robot.home_m - 1, upper_m=robot.home_m + [1, 1, -beyond_m])
    for one, axis in ((low, "y = −0.100 m"), (high, "z = 1.20 m")):
        texts = [notice.text for notice in plausible.robot_notices(one)]
        assert [f"outside the workspace, {axis}" in text for text in texts] == [True] * said


def _on_its_way(robot, turn_rad=None):
    x = np.repeat(robot.home_m[None], 2, 0) + [[0.0, 0.0, 0.0], [0.0, 0.0, -0.1]]
    vector = robot.home_rotation_rad if turn_rad is None else np.array(turn_rad)
    R = np.repeat(turning.matrix(vector)[None], 2, 0)
    times, nothing = np.array([0.0, 7.0]), np.zeros(2)
    asked = History(times, None, x, R, nothing, np.zeros((2, 3)), rotation_is_stated=turn_rad is not None)
    return turned_rows(robot, asked, balanced(robot, asked))


def test_rotations_that_balance_replaces_on_a_trajectory_are_said():
    (of_file,) = _on_its_way(four_wires())
    assert of_file == home.home_notices(four_wires())[0]
    (of_table,) = _on_its_way(four_wires(), (0.0, 0.0, 0.0))
    assert "rotations that are commanded" in of_table.text and of_table.text.count("degrees away") == 1
    assert "up to 19.4 degrees away from them, at 7 s" in of_table.text
    assert _on_its_way(six_wires(), (0.0, 0.0, 0.1)) == []
    assert _on_its_way(robot_of(FIELD / "balanced-home" / "wall.toml")) == []


@pytest.mark.parametrize(("degrees", "said"), [(0.99, False), (1.01, True)])
def test_what_balance_changes_on_a_trajectory_by_less_than_an_eye_sees_is_no_warning(degrees, said):
    robot = four_wires()
    times, x = np.array([0.0, 7.0]), np.repeat(robot.home_m[None], 2, 0)
    hung = np.repeat(turning.matrix(robot.home_rotation_rad)[None], 2, 0)
    tilted = hung.copy()
    tilted[1] = turning.matrix(np.array([0.0, np.radians(degrees), 0.0])) @ hung[1]
    asked = History(times, None, x, tilted, np.zeros(2), np.zeros((2, 3)), rotation_is_stated=True)
    assert bool(turned_rows(robot, asked, replace(asked, rotation=hung))) == said


def test_a_wire_at_its_bound_is_let_go_where_that_leads_nearer():
    """A general minimiser with the tensions as constraints finds a balance 0.4165 rad from home at best."""
    robot = six_wires(centre_of_mass_m=(20.0, 10.0, -50.0))
    found = hanging.hang(robot, robot.home_m[None], np.eye(3))
    assert np.linalg.norm(turning.vector(found.rotation)[0]) < 0.418


def two_wires() -> Robot:
    """A weight on two wires, which keep it in their plane."""
    base = schema.read_robot_file("hangprinter-4")
    return replace(
        base, name="two", exit_m=np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]), platform_m=np.zeros((2, 3)),
        lines=np.ones(2), beyond_m=np.zeros(2), actuator=("drum",) * 2, ratio=np.zeros(2), wire_m=np.zeros(2),
        wire=("default",) * 2, mass_kg=0.8, centre_of_mass_m=np.zeros(3), home_m=np.array([0.2, 0.0, -0.6]),
        home_rotation_rad=np.zeros(3), pulleys=None, drums=None, mass_kg_m=None,
        rule=replace(base.rule, choice="minimum_norm", lowest_N=0.1, highest_N=50.0),
    )  # fmt: skip


def test_beside_the_plane_of_two_wires_the_nearest_position_within_it_is_named():
    robot = two_wires()
    there = balanced_orientation(robot, np.array([0.2, 0.1, -0.6]), None)
    np.testing.assert_allclose(there.nearest_m, [0.2, 0.0, -0.6], atol=1e-6)
    assert "is 0.1 m away, (0.2, 0, -0.6) m" in there.sentence
    assert balanced_orientation(robot, robot.home_m, None).sentence == ""
    nowhere = balanced_orientation(robot, np.array([0.2, 0.0, 0.4]), None)
    assert nowhere.nearest_m is None and "nearest" not in nowhere.sentence


def test_a_rotation_of_a_platform_that_cannot_turn_is_refused():
    with pytest.raises(InputError, match="--rotation: found one for a robot whose lines keep the orientation"):
        asked_place(two_wires(), None, (0.0, 0.0, 20.0))
    assert asked_place(two_wires(), None, (0.0, 0.0, 0.0))[1] is not None


@pytest.mark.parametrize(
    ("left", "free", "said"),
    [
        (3, ["rx", "ry", "rz"], "nearest to the home orientation that was found to be held"),
        (1, ["rx", "ry", "rz"], "balance decides rx, ry and rz, but --rotation may ask for one of them"),
        (1, ["rx", "ry"], "balance decides rx and ry, but --rotation may ask for one of them"),
        (0, ["rx", "ry"], "balance decides rx and ry."),
        (2, ["rx", "ry"], "balance decides rx and ry, but --rotation may ask for any of them"),
        (1, ["ry"], "balance decides ry, but --rotation may ask for it."),
        (-3, [], "the orientation is as asked for"),
    ],
)
def test_what_can_be_asked_for_is_said_where_balance_decides_it_now(left, free, said):
    assert said in orientation._summary(six_wires(), 6, 3, left, free, 0)


def test_noise_in_coordinates_is_zero():
    assert coordinates([-1.021e-13, -0.1028, 0.999e-6, 1.001e-6]) == "0, -0.1028, 0, 1.001e-06"


def test_a_folder_of_results_with_one_posterior_or_one_final_one_is_that_one(tmp_path):
    def posterior(*names):
        place = tmp_path.joinpath(*names)
        place.mkdir(parents=True)
        (place / "posterior.nc").write_bytes(b"")
        return place

    one = posterior("fit", "line")
    assert folder_of(tmp_path / "fit") == folder_of(one) == one
    posterior("found", "line", "plain")
    final = posterior("found", "line", "final")
    assert folder_of(tmp_path / "found") == final
    other = posterior("fit", "other")
    assert folder_of(tmp_path / "fit") == tmp_path / "fit"
    assert [folder_of(tmp_path / "fit", name) for name in ("line", "other")] == [one, other]
    posterior("found", "other", "final")
    assert folder_of(tmp_path / "found", "line") == final


@pytest.mark.parametrize(
    ("heavy", "said"), [(1, ""), (2, "; 1 more wire weighs more"), (3, "; 2 more wires weigh more")]
)
def test_other_wires_that_sag_are_counted(heavy, said):
    mass = np.where(np.arange(6) < heavy, [0.02, 0.018, 0.016, 1, 1, 1], 0.0)
    robot = replace(six_wires(), mass_kg_m=mass)
    (notice,) = sag.sag_warnings(robot, robot.home_m, np.eye(3), np.full(6, 5.0))
    assert notice.text.partition("taken for")[2].startswith(said)


def test_a_long_drift_is_a_plain_number():
    found = {"robot": "six", "feasible": True}
    drift = {"specimen_spread": 0.05, "times_s": [3600.0]}
    drift["distance_mm"] = {"q05": [3761.0], "q50": [3984.0], "q95": [4254.0]}
    assert "3980 mm [3760, 4250]" in of_pose(found | {"drift": [drift]})[0]

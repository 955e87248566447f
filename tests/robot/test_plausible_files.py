"""Robots' files in the wrong unit: a warning that names the key, at the limit and no earlier."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.robot.test_unheld_home import six_wires
from wirebayes.robot.mechanics import schema
from wirebayes.robot.mechanics.description import Drums, GivenWire, Pulleys
from wirebayes.robot.mechanics.draws import WireDraws
from wirebayes.robot.motion import plausible
from wirebayes.robot.pose.answer import pose_report
from wirebayes.robot.pose.request import PoseRequest

FIELD = sorted((Path(__file__).parent / "field").rglob("*.toml"))
AT_NO_PLACE = "hp4-high.toml"  # its home position is above its anchors, and so outside its workspace
LINE = WireDraws({k: np.full(2, v) for k, v in {"k1": 8e3, "B": 0.3, "U": 1.0, "k2": 0.03, "N": 0.7}.items()}, 1000.0)


def _warned(robot):
    return [notice.text for notice in plausible.robot_notices(robot)]


@pytest.mark.parametrize("name", [*schema.shipped(), *map(str, FIELD)])
def test_no_robot_that_was_built_or_drawn_up_is_suspected(name):
    said = _warned(schema.read_robot_file(name))
    assert [text for text in said if "outside the workspace" not in text] == []
    assert bool(said) == name.endswith(AT_NO_PLACE)


def _scaled(factor, robot=None):
    robot = robot or six_wires()
    lengths = ("exit_m", "platform_m", "centre_of_mass_m", "home_m", "lower_m", "upper_m")
    return replace(robot, **{name: factor * getattr(robot, name) for name in lengths})


@pytest.mark.parametrize("share", [0.999, 1.001])
def test_a_robot_larger_than_any_is_suspected(share):
    """Everything in millimetres: its size alone shows it."""
    said = _warned(replace(_scaled(share * 1000.0 / six_wires().span_m), mass_kg=1e6))
    assert bool(said) == (share > 1)
    assert all(text.startswith("leg.exit_point_m") for text in said)


def _desk(span_m, mass_kg):
    """Six wires over a desk of so many "metres", on a platform without extent."""
    robot = _scaled(span_m / six_wires().span_m)
    return replace(robot, mass_kg=mass_kg, platform_m=np.zeros((6, 3)), centre_of_mass_m=np.zeros(3))


@pytest.mark.parametrize("share", [0.999, 1.001])
def test_a_wide_robot_whose_platform_weighs_less_than_a_rope_is_suspected(share):
    for robot in (_desk(400.0, 4.0 / share), _desk(share * 50.0, 0.1)):
        said = _warned(robot)
        assert bool(said) == (share > 1)
        assert all(text.startswith("leg.exit_point_m") and "a thin rope" in text for text in said)


@pytest.mark.parametrize("share", [0.999, 1.001])
def test_a_platform_that_weighs_less_than_a_frame_as_broad_is_suspected(share):
    robot = six_wires()
    points = robot.platform_m - robot.platform_m.mean(0)
    points = points / np.linalg.norm(points, axis=1).max()
    arms_mass = ((20.0, 20.0 / share), (share * 5.0, 4.0))
    for arms, mass in arms_mass:
        broad = replace(
            robot, platform_m=arms * points, mass_kg=mass, exit_m=10 * robot.exit_m, centre_of_mass_m=np.zeros(3)
        )
        said = _warned(broad)
        assert bool(said) == (share > 1)
        assert all(text.startswith("leg.platform_point_m") and f"{mass:.3g}"[:4] in text for text in said)


@pytest.mark.parametrize("share", [0.999, 1.001])
@pytest.mark.parametrize("key", ["drum_radius_m", "pulley_radius_m"])
def test_a_wheel_larger_than_any_is_suspected_in_a_large_robot_too(key, share):
    base, one, radius = replace(_scaled(20.0), mass_kg=1e6), np.ones(6), np.full(6, share * 5.0)
    drums, pulleys = Drums(radius, *[one] * 5), Pulleys(radius, np.tile([0.0, 0.0, 1.0], (6, 1)))
    said = _warned(replace(base, drums=drums) if key == "drum_radius_m" else replace(base, pulleys=pulleys))
    assert bool(said) == (share > 1)
    where = f"leg.{key} of wire 1 and 5 more: "
    assert all(text.startswith(where) and "none has a radius of more than 5 m" in text for text in said)


@pytest.mark.parametrize(("span_m", "arms_m", "mass_kg"), [(600.0, 6.7, 3e4), (150.0, 0.3, 20.0), (15.0, 0.9, 91.0)])
def test_large_robots_that_were_built_are_not_suspected(span_m, arms_m, mass_kg):
    """The receiver's cabin of the FAST telescope, a camera above a stadium, CoGiRo."""
    robot = _scaled(span_m / six_wires().span_m)
    points = arms_m / 0.35 * six_wires().platform_m
    assert _warned(replace(robot, mass_kg=mass_kg, platform_m=points, centre_of_mass_m=np.zeros(3))) == []


@pytest.mark.parametrize("name", ["cogiro-desk", "sled-4", "linear-6", "linear-7", "hangprinter-4"])
def test_a_workshops_robot_in_millimetres_is_suspected_by_key(name):
    said = _warned(_scaled(1000.0, schema.read_robot_file(name)))
    keys = [text.partition(":")[0] for text in said]
    assert keys[0] == "leg.exit_point_m"
    assert ("leg.platform_point_m" in keys) == (name != "hangprinter-4")


def test_a_leg_that_is_a_copy_of_another_is_named():
    robot = six_wires()
    copied = [0, 1, 2, 3, 1, 5]
    beside = replace(robot, exit_m=robot.exit_m[copied])
    (said,) = _warned(replace(beside, platform_m=robot.platform_m[copied]))
    assert said.startswith("leg.exit_point_m and leg.platform_point_m of wires 2 and 5: the same points")
    assert _warned(beside) == []


def test_legs_that_are_all_alike_are_one_warning():
    robot, groups = six_wires(), [0, 1, 0, 1, 0, 0]
    four, two = _warned(replace(robot, exit_m=robot.exit_m[groups], platform_m=robot.platform_m[groups]))
    assert "of wires 1, 3, 5 and 6: the same points" in four and four.endswith("lines = 4")
    assert "of wires 2 and 4: the same points" in two and two.endswith("lines = 2")


def test_platform_points_in_millimetres_are_not_blamed_on_the_home_position():
    robot = six_wires()
    said = _warned(replace(robot, platform_m=1000.0 * robot.platform_m))
    assert [text.partition(":")[0] for text in said] == ["leg.platform_point_m"]
    assert "and a platform that broad weighs more than 12" in said[0]


@pytest.mark.parametrize("share", [0.999, 1.001])
@pytest.mark.parametrize(("key", "times"), [("beyond_exit_m", 10.0), ("drum_radius_m", 0.5), ("pulley_radius_m", 0.5)])
def test_what_is_larger_than_the_robot_is_suspected(key, times, share):
    base, one = six_wires(), np.ones(6)
    length = np.full(6, share * times * base.span_m)
    robot = {
        "beyond_exit_m": replace(base, beyond_m=length),
        "drum_radius_m": replace(base, drums=Drums(length, one, one, one, one, one)),
        "pulley_radius_m": replace(base, pulleys=Pulleys(length, np.tile([0.0, 0.0, 1.0], (6, 1)))),
    }[key]
    said = _warned(robot)
    assert bool(said) == (share > 1)
    assert all(text.startswith(f"leg.{key} of wire 1 and 5 more") for text in said)


@pytest.mark.parametrize("share", [0.999, 1.001])
def test_a_mass_far_outside_its_platform_is_suspected(share):
    robot = six_wires()
    middle = robot.platform_m.mean(0)
    arm = np.linalg.norm(robot.platform_m - middle, axis=1).max()
    said = _warned(replace(robot, centre_of_mass_m=middle - [0.0, 0.0, share * 5.0 * arm]))
    assert bool(said) == (share > 1)
    assert all(text.startswith("platform.centre_of_mass_m") for text in said)


@pytest.mark.parametrize("share", [0.999, 1.001])
def test_a_home_far_from_its_exit_points_is_suspected(share):
    robot = replace(six_wires(), platform_m=np.zeros((6, 3)))
    exits = np.array([[-1.0, 0, 0], [1.0, 0, 0]] * 3) + 1e-9 * np.arange(6)[:, None]  # none is a copy
    home = np.array([0.0, 0.0, -np.sqrt((share * 20.0) ** 2 - 1.0)])
    (said,) = _warned(replace(robot, exit_m=exits, home_m=home))
    assert said.startswith("pose.position_m") and ("from an exit point" in said) == (share > 1)


@pytest.mark.parametrize("share", [0.999, 1.001])
@pytest.mark.parametrize(("wrong", "key"), [({"k1": 10.0}, "k1_N"), ({"B": 100.0}, "B_mm")])
def test_a_wire_that_is_strained_beyond_its_length_is_suspected(wrong, key, share):
    """At 10 N a wire of k1 = 10 N doubles its length, and so it does by creep of 100 mm/N at 1000 mm."""
    values = {"k1": 8e3, "B": 0.3, "U": 1.0, "k2": 0.03, "N": 0.7} | wrong
    robot = replace(six_wires(), wire=("line",) * 6, given={"line": GivenWire(values, 1000.0)})
    said = plausible.strain_notices(robot, LINE, np.full(6, share * 10.0))
    assert [bool(said), len(said)] == [share > 1, int(share > 1)]
    assert all(f"[wires.line], {key}" in notice.text for notice in said)
    assert plausible.strain_notices(six_wires(), LINE, np.full(6, share * 10.0)) == []


def test_the_warnings_stand_in_an_answer_and_where_there_is_none():
    mistaken = replace(six_wires(), beyond_m=np.full(6, 1e4))
    # a tolerance that is left at once: for how long the pose is within it is not asked here
    request = PoseRequest(mistaken.home_m, np.eye(3), np.array([0.0, 60.0]), tolerance_m=1e-9)
    held = pose_report(mistaken, LINE, request).content["warnings"]
    nowhere = pose_report(mistaken, LINE, replace(request, position_m=mistaken.home_m + 9.0)).content["warnings"]
    for said in (held, nowhere):
        assert [one["text"][:17] for one in said if one["kind"] == "geometry"] == ["leg.beyond_exit_m"]
    assert [one["kind"] for one in nowhere][0] in ("unheld", "uncarried")


@pytest.mark.parametrize("share", [0.999, 1.001])
def test_a_linear_actuators_wire_shorter_than_its_way_is_suspected(share):
    """At home, by every command; at another pose by `pose`, unless home says it already."""
    robot = schema.read_robot_file("linear-6")
    way_m = float(np.linalg.norm(robot.exit_m - robot.home_m - robot.platform_m, axis=1)[1])
    lengths = np.where(np.arange(6) == 1, robot.lines[1] * way_m * share, robot.wire_m)
    there = robot.home_m + [0.0, 0.0, 2.0 * robot.exit_m[:, 2].max()], np.eye(3)
    short = replace(robot, wire_m=lengths)
    said = _warned(short)
    assert bool(said) == (share < 1)
    assert all(text.startswith("leg.wire_length_m of wire 2:") and "at home" in text for text in said)
    said_there = [notice.text for notice in plausible.pose_notices(short, *there)]
    assert bool(said_there) == (share > 1)
    assert all("at this pose" in text for text in said_there)
    assert plausible.pose_notices(robot, robot.home_m, np.eye(3)) == []


def test_a_pose_beyond_a_linear_actuators_wire_is_told():
    robot = schema.read_robot_file("linear-6")
    lower = robot.home_m - [0.0, 0.0, 3.0]
    request = PoseRequest(lower, np.eye(3), np.array([0.0, 60.0]))
    texts = [notice["text"] for notice in pose_report(robot, LINE, request).content["warnings"]]
    assert any(text.startswith("leg.wire_length_m of wire 1") and "at this pose" in text for text in texts)

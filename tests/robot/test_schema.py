import numpy as np
import pytest

from wirebayes.errors import InputError
from wirebayes.io.experiment_file import read_experiments
from wirebayes.robot.mechanics import schema

OPTIONAL = {"k1_N", "B_mm", "length_mm", "wire", "pulley_radius_m", "swivel_axis"} | {
    "tension_bias_N",
    "drum_radius_m",
    "drum_pitch_m",
    "drum_layer_turns",
    "drum_layer_height_m",
    "gear_ratio",
}
LAYERS = "drum_radius_m = 0.05\ndrum_layer_turns = 9\ndrum_layer_height_m = 5e-4"
GOOD = """version = 1
name = "tripod"
description = "three wires and a point"
source = "made up for the tests"
freedom = "position"
[platform]
mass_kg = 1.0
[tension]
choice = "minimum_norm"
lowest_N = 0.1
highest_N = 20.0
[pose]
position_m = [0.0, 0.0, 1.0]
[workspace]
lower_m = [-0.1, -0.1, 0.9]
upper_m = [0.1, 0.1, 1.1]
[wires.steel]
k1_N = 1e5
B_mm = 0.01
U = 1.0
k2 = 0.01
N = 1.0
length_mm = 1000
[[leg]]
exit_point_m = [1.0, 0.0, 2.0]
platform_point_m = [0.0, 0.0, 0.0]
wire = "steel"
[[leg]]
exit_point_m = [-0.5, 0.9, 2.0]
platform_point_m = [0.0, 0.0, 0.0]
[[leg]]
exit_point_m = [-0.5, -0.9, 2.0]
platform_point_m = [0.0, 0.0, 0.0]
actuator = "linear"
pulley_ratio = 4.0
wire_length_m = 3.0
"""


def _read(tmp_path, text):
    file = tmp_path / "robot.toml"
    file.write_text(text, encoding="utf-8")
    return schema.read_robot_file(file)


def test_a_good_file_is_read(tmp_path):
    robot = _read(tmp_path, GOOD)
    assert robot.legs == 3
    assert robot.degrees == 3
    assert robot.wire == ("steel", "default", "default")
    assert robot.given["steel"].parameters["k1"] == 1e5
    np.testing.assert_array_equal(robot.is_linear, [False, False, True])


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ("mass_kg = 1.0", "mass_kg = -1.0", "platform.mass_kg"),
        ("mass_kg = 1.0", "mass_kg = nan", "platform.mass_kg"),
        ("mass_kg = 1.0", "mass = 1.0", "platform.mass"),
        ("mass_kg = 1.0", "mass_kg = true", "platform.mass_kg"),
        ("mass_kg = 1.0", "mass_kg = 1.0\nweight = 2", "platform.weight"),
        ("exit_point_m = ", "exit_point_mm = ", "leg 1, key exit_point_mm: found an unknown key"),
        ("[1.0, 0.0, 2.0]", "[1.0, 0.0]", "leg 1, key exit_point_m"),
        ("[1.0, 0.0, 2.0]", "[1.0, inf, 0.0]", "leg 1, key exit_point_m"),
        ("[1.0, 0.0, 2.0]", '"here"', "leg 1, key exit_point_m"),
        ('"minimum_norm"', '"best"', "tension.choice"),
        ("highest_N = 20.0", "highest_N = 0.05", "tension.highest_N"),
        ("upper_m = [0.1, 0.1, 1.1]", "upper_m = [-0.2, 0.1, 1.1]", "workspace.upper_m"),
        ("pulley_ratio = 4.0\n", "", "leg 3, key pulley_ratio"),
        ('wire = "steel"', 'wire = "copper"', "leg 1, key wire"),
        ("k1_N = 1e5", "k1_N = 0", "wires.steel.k1_N"),
        ("version = 1", "version = 2", "version"),
        ("version = 1", "version = 1\ncolour = 3", "colour"),
        ('freedom = "position"', 'freedom = "all"', "freedom"),
        ('actuator = "linear"', 'actuator = "drum"', "leg 3, key pulley_ratio"),
        ("[platform]\nmass_kg = 1.0", "platform = 3", "platform"),
        ("[workspace]", "[sensors]\ntension_bias_N = -0.1\n[workspace]", "sensors.tension_bias_N"),
        ("[workspace]", "[sensors]\nbias = 0.1\n[workspace]", "sensors.bias"),
        ('wire = "steel"', "drum_radius_m = -1", "leg 1, key drum_radius_m"),
        ('wire = "steel"', "gear_ratio = 2.0", "leg 1, key gear_ratio"),
        ('wire = "steel"', "drum_radius_m = 0.05\ndrum_layer_turns = 0.5", "leg 1, key drum_layer_turns"),
        ('wire = "steel"', "drum_radius_m = 0.05\ndrum_layer_turns = 9", "leg 1, key drum_layer_height_m"),
        ('wire = "steel"', f"{LAYERS}", "leg 1, key wire_length_m"),
        ('wire = "steel"', f"{LAYERS}\nwire_length_m = 1e9", "leg 1, key wire_length_m"),
        ("pulley_ratio = 4.0", "pulley_ratio = 4.0\ndrum_radius_m = 0.05", "leg 3, key drum_radius_m"),
        ('wire = "steel"', "pulley_radius_m = 0.0", "leg 1, key pulley_radius_m"),
        ('wire = "steel"', "pulley_radius_m = 0.05", "leg 1, key swivel_axis"),
        ('wire = "steel"', "pulley_radius_m = 0.05\nswivel_axis = [0, 0, 0]", "leg 1, key swivel_axis"),
        ('wire = "steel"', "swivel_axis = [0, 0, 1]", "leg 1, key swivel_axis"),
    ],
)
def test_every_mistake_names_file_and_key_in_one_line(tmp_path, old, new, key):
    assert old in GOOD
    with pytest.raises(InputError) as caught:
        _read(tmp_path, GOOD.replace(old, new, 1))
    message = str(caught.value)
    assert "\n" not in message
    assert "robot.toml" in message
    assert f" {key}" in message


def test_a_pulley_is_read_and_its_axis_has_unit_length(tmp_path):
    assert _read(tmp_path, GOOD).pulleys is None
    pulley = 'wire = "steel"\npulley_radius_m = 0.05\nswivel_axis = [0.0, 3.0, 4.0]'
    robot = _read(tmp_path, GOOD.replace('wire = "steel"', pulley))
    np.testing.assert_array_equal(robot.pulleys.radius_m, [0.05, 0.0, 0.0])
    np.testing.assert_allclose(robot.pulleys.axis[0], [0.0, 0.6, 0.8])


def test_a_drum_is_read(tmp_path):
    assert _read(tmp_path, GOOD).drums is None
    drums = _read(tmp_path, GOOD.replace('wire = "steel"', LAYERS + "\nwire_length_m = 8\ngear_ratio = 3")).drums
    assert (drums.radius_m[0], drums.layer_turns[0], drums.layer_m[0], drums.wire_m[0]) == (0.05, 9.0, 5e-4, 8.0)
    np.testing.assert_array_equal(drums.radius_m[1:], 0.0)
    np.testing.assert_array_equal(drums.gear, [3.0, 1.0, 1.0])


@pytest.mark.parametrize("text", ["version = ", GOOD.split("[[leg]]")[0], "\x00"])
def test_broken_files_are_refused(tmp_path, text):
    with pytest.raises(InputError, match=r"robot\.toml"):
        _read(tmp_path, text)


def test_unknown_names_list_the_shipped_robots():
    with pytest.raises(InputError, match="cogiro"):
        schema.read_robot_file("no-such-robot")


def test_shipped_robots_say_where_their_numbers_come_from():
    assert len(schema.shipped()) >= 5
    for name in schema.shipped():
        robot = schema.read_robot_file(name)
        assert robot.name == name
        assert "github.com" in robot.source or "Representative, not a published" in robot.source


def test_every_key_of_a_robots_file_is_documented():
    import re
    from pathlib import Path

    root = Path(__file__).parents[2]
    used = set()
    for name in schema.shipped():
        used |= set(re.findall(r"^(\w+) =", (root / "data" / "robots" / f"{name}.toml").read_text(), re.MULTILINE))
    assert len(used) > 15
    pages = [root / "docs" / f"robot-{name}.rst" for name in ("file", "parts")]
    for text in ((root / "data" / "robots" / "README.md").read_text(), "".join(page.read_text() for page in pages)):
        assert [key for key in sorted(used | OPTIONAL) if f"{key}" not in text] == []


def test_a_file_of_tests_and_a_robots_file_are_told_from_each_other(tmp_path):
    """Each reader names what the other one's file is, not the first key that it does not know."""
    with pytest.raises(InputError, match=r"key experiment: found a file of tests, .* read by wirebayes fit"):
        schema.parse('[[experiment]]\nname = "a"\nlength_mm = 1000.0\n', "tests.toml")
    file = tmp_path / "robot.toml"
    file.write_text(schema.robot_text("sled-4"), encoding="utf-8")
    with pytest.raises(InputError, match=r"key leg: found a robot's file, expected tests, .* read by wirebayes pose"):
        read_experiments(file)

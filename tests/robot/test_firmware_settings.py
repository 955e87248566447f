"""Settings of Hangprinters, read as they are written: anchors, lines, forces, and mistakes with their line."""

import numpy as np
import pytest

from tests.robot.test_commands import fitted  # noqa: F401 - a fixture
from wirebayes.cli import main
from wirebayes.commands.import_robot import import_robot
from wirebayes.errors import InputError
from wirebayes.robot.mechanics import schema

RRF = """; a printer
M669 K6 A0:-1620:-150 B1800:900:-150 C-1620:900:-150 D0:0:2350 ; anchors, mm
M666 U2:2:2:4 W2.5
M666 Y310:320:330:0
M666 I10:10:10:1
M666 X120:120:120:120
M666 A1.5   ; another command's letter is no anchor
"""


@pytest.mark.parametrize("file", ["reprapfirmware.g", "klipper.cfg"])
def test_what_export_writes_comes_back(fitted, tmp_path, file):  # noqa: F811
    out, back = tmp_path / "export", tmp_path / "back.toml"
    assert main(["export", "hangprinter-4", "--wires", str(fitted), "--output", str(out)]) == 0
    assert main(["import-robot", str(out / file), "--output", str(back), "--quiet"]) == 0
    there, here = schema.read_robot_file("hangprinter-4"), schema.read_robot_file(back)
    np.testing.assert_allclose(here.exit_m, there.exit_m, atol=5e-6)
    np.testing.assert_array_equal(here.lines, there.lines)
    np.testing.assert_allclose(here.beyond_m, there.beyond_m, atol=5e-4)
    assert here.mass_kg == there.mass_kg
    assert (here.rule.lowest_N, here.rule.highest_N) == (there.rule.lowest_N, there.rule.highest_N)


def test_a_config_by_hand(tmp_path):
    (tmp_path / "config.g").write_text(RRF)
    robot = schema.read_robot_file(import_robot(tmp_path / "config.g", tmp_path / "robot.toml"))
    np.testing.assert_allclose(robot.exit_m[1], [1.8, 0.9, -0.15])
    np.testing.assert_allclose(robot.beyond_m, [0.31, 0.32, 0.33, 0.0])
    assert (robot.rule.lowest_N, robot.rule.highest_N) == (10.0, 120.0)


def test_a_negative_length_beyond_the_anchors_puts_the_spools_at_the_last_anchor(tmp_path):
    """As in the firmware, which computes these lengths then: M666 Y-1:-1:-1:-1 is what printers are shipped with."""
    (tmp_path / "config.g").write_text(RRF.replace("Y310:320:330:0", "Y-1:-1:-1:-1"))
    robot = schema.read_robot_file(import_robot(tmp_path / "config.g", tmp_path / "robot.toml"))
    of_a = np.sqrt(1.62**2 + 2.5**2)
    np.testing.assert_allclose(robot.beyond_m[[0, 3]], [of_a, 0.0])


@pytest.mark.parametrize(("given", "said"), [("M666 Y0:0:0:0", False), ("", True)])
def test_settings_that_do_not_say_how_much_wire_lies_beyond_the_anchors_are_said_to(given, said, tmp_path):
    (tmp_path / "config.g").write_text(RRF.replace("M666 Y310:320:330:0", given))
    text = import_robot(tmp_path / "config.g", tmp_path / "robot.toml").read_text()
    assert ("do not say how much wire" in text) == said


def test_anchors_in_metres_are_refused_in_both_formats(tmp_path):
    anchors = "A0:-1.62:-.15 B1.8:.9:-.15 C-1.62:.9:-.15 D0:0:2.35"
    metres = RRF.replace("A0:-1620:-150 B1800:900:-150 C-1620:900:-150 D0:0:2350", anchors)
    (tmp_path / "config.g").write_text(metres)
    corners = {"a": (0, -1.62), "b": (1.8, 0.9), "c": (-1.62, 0.9)}
    steppers = [f"[stepper_{name}]\nanchor_x: {x}\nanchor_y: {y}\nanchor_z: 0\n" for name, (x, y) in corners.items()]
    (tmp_path / "printer.cfg").write_text("".join(steppers) + "[printer]\nwinch_mover_weight: 2\n")
    for name in ("config.g", "printer.cfg"):
        with pytest.raises(InputError, match=r"found anchors within 3\.42 of one another, expected millimetres"):
            import_robot(tmp_path / name, tmp_path / "robot.toml")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("D0:0:2350", ""), "found no M669 D"),
        (("D0:0:2350", "D0:2350"), "line 2, M669 D: found 2 numbers, expected x:y:z"),
        (("W2.5", ""), "found no weight of the mover"),
        (("W2.5", "W0"), "line 3, M666 W: found 0, expected the weight of the mover"),
        (("U2:2:2:4", "U2:2:4"), "line 3, M666 U: found 3 numbers"),
    ],
)
def test_what_is_missing_is_said_with_its_line(tmp_path, change, message):
    (tmp_path / "config.g").write_text(RRF.replace(*change))
    with pytest.raises(InputError, match=message):
        import_robot(tmp_path / "config.g", tmp_path / "robot.toml")
    assert not (tmp_path / "robot.toml").exists()

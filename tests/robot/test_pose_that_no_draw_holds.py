"""A pose in balance that is not stable: no draw of the wires holds it, and the page and the terminal say so."""

from itertools import product

from tests.robot.test_commands import fitted  # noqa: F401  # a fixture
from wirebayes.cli import main
from wirebayes.io.run_folder import read_json

HEAD = """version = 1
name = "crossed"
description = "eight wires that cross the platform from side to side"
source = "ours"
freedom = "pose"
[platform]
mass_kg = 3.0
[tension]
choice = "minimum_norm"
lowest_N = 2.0
highest_N = 300.0
[pose]
position_m = [0.1, 0.05, 1.1]
rotation_vector_rad = [0.05, -0.02, 0.1]
[workspace]
lower_m = [0.0, 0.0, 1.0]
upper_m = [0.1, 0.1, 1.1]
"""
LEG = "[[leg]]\nexit_point_m = [{}, {}, {}]\nplatform_point_m = [{}, {}, {}]\n"


def test_a_pose_that_no_draw_holds_has_a_page(fitted, tmp_path, capsys) -> None:  # noqa: F811
    corners = product((-1, 1), (-1, 1), (-1, 1))
    legs = [LEG.format(1.5 * x, 1.2 * y, 1.0 + z, -0.15 * x, 0.1 * y, -0.1 * z) for x, y, z in corners]
    robot, out = tmp_path / "crossed.toml", tmp_path / "out"
    robot.write_text(HEAD + "".join(legs))
    assert main(["pose", str(robot), "--wires", str(fitted), "--output", str(out), "--draws", "2"]) == 0
    printed = capsys.readouterr()
    assert "no draw of the wires could be solved" in printed.out and "balanced but not stable: 100 %" in printed.err
    page = (out / "report.html").read_text()
    assert "balanced but not stable: 100 %" in page and '<section id="drift">' not in page
    assert read_json(out / "pose.json")["drift"][0]["distance_mm"]["q50"] is None

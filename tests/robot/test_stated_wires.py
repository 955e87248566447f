"""Robots whose file gives the parameters of all wires: no test of a line is needed."""

import json

import numpy as np
import pytest

from wirebayes.cli import main
from wirebayes.robot.mechanics import schema

STEEL_N = 2e5
EXITS_M = [(-2.0, 0.0, 3.0), (2.0, 0.0, 3.0), (0.0, 2.5, 3.0), (0.0, 0.0, 0.0)]
HEAD = """version = 1
name = "crane"
description = "three steel cables, and one to the floor"
source = "a test"
freedom = "position"
[platform]
mass_kg = 20.0
centre_of_mass_m = [0.0, 0.0, 0.0]
[tension]
choice = "minimum_norm"
lowest_N = 20
highest_N = 2000
[pose]
position_m = [0.0, 0.5, 1.5]
rotation_vector_rad = [0.0, 0.0, 0.0]
[workspace]
lower_m = [-0.3, 0.4, 1.2]
upper_m = [0.3, 0.8, 1.6]
"""


@pytest.fixture
def crane(tmp_path):
    text = HEAD + f"[wires.steel]\nk1_N = {STEEL_N}\n"
    for exit_m in EXITS_M:
        text += f'[[leg]]\nexit_point_m = {list(exit_m)}\nplatform_point_m = [0.0, 0.0, 0.0]\nwire = "steel"\n'
    path = tmp_path / "crane.toml"
    path.write_text(text, encoding="utf-8")
    return path


def _session(path, rng):
    """Rows of a crane whose cables are longer than its joint values say, solved by hand at poses that are stated."""
    exits = np.array(EXITS_M)
    longer = 1e-3 * np.array([2.0, -1.0, 1.5, -0.5])
    rows = ["hold,x_m,y_m,z_m,rx_rad,ry_rad,rz_rad,duration_s," + ",".join(f"joint_{i}_m" for i in range(1, 5))]
    rows[0] += "," + ",".join(f"tension_{i}_N" for i in range(1, 5))
    for hold in range(1, 9):
        place = rng.uniform([-0.3, 0.4, 1.2], [0.3, 0.8, 1.6])
        way = exits - place
        length = np.linalg.norm(way, axis=1)
        along = (way / length[:, None]).T
        pull = 60.0
        upper = np.linalg.solve(along[:, :3], np.array([0.0, 0.0, 20.0 * 9.80665]) - along[:, 3] * pull)
        tension = np.append(upper, pull)
        joint = length / (1.0 + tension / STEEL_N) - longer
        read = tension + 0.5 * rng.standard_normal(4)
        cells = [hold, *place, 0, 0, 0, 60, *joint, *read]
        rows.append(",".join(f"{cell:.9g}" for cell in cells))
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return longer


def test_a_stiffness_alone_is_a_wire_that_does_not_creep(crane):
    (steel,) = schema.read_robot_file(crane).given.values()
    assert steel.parameters["k1"] == STEEL_N and steel.parameters["B"] == 0.0


def test_some_of_the_parameters_of_creep_are_not_enough(crane, tmp_path, capsys):
    crane.write_text(crane.read_text(encoding="utf-8").replace("k1_N", "U = 0.9\nk1_N"), encoding="utf-8")
    assert main(["export", str(crane), "--output", str(tmp_path / "out")]) == 2
    assert "key wires.steel.B_mm" in capsys.readouterr().err


def test_lengths_of_steel_cables_are_calibrated_without_a_test_of_a_line(crane, tmp_path, capsys):
    readings = tmp_path / "session.csv"
    longer = _session(readings, np.random.default_rng(2))
    out = tmp_path / "out"
    assert main(["calibrate", str(crane), str(readings), "--tension-sd", "0.5", "--output", str(out)]) == 0
    found = json.loads((out / "calibration.json").read_text(encoding="utf-8"))
    reference = found["references_m"]
    np.testing.assert_allclose(reference["mean"], longer, atol=4 * max(reference["sd"]))
    assert max(reference["sd"]) < 1e-3 and found["usable"]
    assert "--wires" not in capsys.readouterr().out


def test_a_pose_on_steel_cables_needs_no_posterior_and_names_none(crane, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["pose", str(crane), "--draws", "20", "--times", "0,60", "--output", str(out)]) == 0
    found = json.loads((out / "pose.json").read_text(encoding="utf-8"))
    assert found["wires"]["lines"] == [] and found["wires"]["tested_length_mm"] is None
    assert all(entry["distance_mm"]["q95"][-1] < 1e-6 for entry in found["drift"])
    assert "Next: wirebayes calibrate" in capsys.readouterr().out


def test_a_wire_without_parameters_and_without_a_posterior_is_refused(tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["pose", "linear-6", "--output", str(out)]) == 2
    assert "linear-6, leg 1: found no --wires" in capsys.readouterr().err
    assert not out.exists()

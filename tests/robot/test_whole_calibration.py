"""Calibration of whole robots from the command line: anchors unknown, poses unknown, lengths alone."""

import json

import numpy as np
from scipy.stats import norm, t

from tests.robot.test_commands import fitted, session_csv  # noqa: F401
from wirebayes.cli import main
from wirebayes.robot.mechanics import schema
from wirebayes.robot.self_calibration import summary


def test_rows_without_a_pose_and_unknown_anchors_are_estimated(fitted, session_csv, tmp_path):  # noqa: F811
    file, truth = session_csv
    lines = [line.split(",") for line in file.read_text().splitlines()]
    for cells in lines[1:]:
        cells[1:7] = [""] * 6
    file.write_text("\n".join(",".join(cells) for cells in lines) + "\n")
    out = tmp_path / "out"
    arguments = ["calibrate", "linear-7", str(file), "--wires", str(fitted), "--draws", "40", "--anchor-sd", "0.5"]
    assert main([*arguments, "--next-poses", "2", "--output", str(out)]) == 0
    found = json.loads((out / "calibration.json").read_text())
    assert found["usable"]
    length = found["zero_tension_lengths_m"]
    assert (np.abs(np.array(length["mean"]) - truth) < 4 * np.array(length["sd"])).all()
    exits = found["exit_points_m"]
    robot = schema.read("linear-7")
    assert (np.abs(np.array(exits["mean"]) - robot.exit_m) < 4 * np.array(exits["sd"])).all()
    assert len(found["next_positions_m"]) == 2
    np.testing.assert_allclose(schema.read(out / "robot.toml").exit_m, exits["mean"], atol=1e-6)


def test_intervals_rest_on_as_many_degrees_of_freedom_as_follow_the_joint_error():
    sd = np.array([1.0, 1.0, 1.0, 0.0])
    wider = sd * summary._FACTOR ** np.array([1.0, 0.5, 0.0, 0.0])
    half = summary._half(sd, wider, 3.0)
    np.testing.assert_allclose(half, [t.ppf(0.95, 3), t.ppf(0.95, 12), norm.ppf(0.95), norm.ppf(0.95)], rtol=1e-5)

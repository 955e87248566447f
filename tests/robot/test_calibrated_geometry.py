"""A history on a robot whose anchors were calibrated: as certain as the calibration, which knows sums best."""

import csv

import numpy as np

from tests.robot.test_commands import fitted  # noqa: F401 - a fixture
from tests.robot.test_measured_poses import OPPOSED, PLACE_MM, _calibrated, _log
from wirebayes.cli import main

PLANE = [0, 2]  # x and z


def test_poses_of_a_history_are_known_as_well_as_those_of_the_calibration(fitted, tmp_path):  # noqa: F811
    """Anchors and reference lengths are each known to millimetres, but the way between them far better."""
    text, _, places = _log(OPPOSED, np.random.default_rng(3), 40.0, 0.1, PLACE_MM, marks=24)
    found = _calibrated(fitted, tmp_path, OPPOSED, 40.0, text, "--pose-sd", f"{PLACE_MM}")
    assert found["usable"]
    assert max(found["references_m"]["sd"]) > 2e-3
    rows = list(csv.DictReader(text.splitlines()))
    joints = [name for name in rows[0] if name.startswith("joint_")]
    at = np.arange(0, 24, 5)
    log = [["time_s", "hold", *joints]]
    for k in at:
        values = [rows[k][name] for name in joints]
        log += [[100 * k, k, *values], [100 * k + 50, k, *values]]
    (tmp_path / "later.csv").write_text("\n".join(",".join(map(str, row)) for row in log) + "\n")
    out = tmp_path / "pose"
    robot, calibration = (str(tmp_path / "out" / name) for name in ("robot.toml", ""))
    given = ["pose", robot, "--wires", str(fitted), "--calibration", calibration, "--draws", "200"]
    assert main([*given, "--joints", str(tmp_path / "later.csv"), "--output", str(out)]) == 0
    poses = list(csv.DictReader((out / "poses.csv").read_text().splitlines()))[::2]
    here, sd = (
        np.array([[float(row[f"{axis}_{name}_m"]) for axis in "xz"] for row in poses]) for name in ("mean", "sd")
    )
    assert (np.abs(here - places[at][:, PLANE]) < 4 * sd).all()
    known = np.array(found["poses"]["sd"])[at][:, PLANE]
    assert (sd < 2 * known).all()
    assert (sd > known / 3).all()

"""A history on a robot whose anchors were calibrated: as certain as the calibration, which knows sums best."""

import csv

import numpy as np
import pytest

from tests.robot.test_commands import fitted  # noqa: F401 - a fixture
from tests.robot.test_measured_poses import OPPOSED, PLACE_MM, PLACES, _calibrated, _log, _rests
from wirebayes.cli import main

PLANE = [0, 2]  # x and z
STOPS = np.arange(0, 24, 5)


@pytest.fixture
def case(fitted, tmp_path):  # noqa: F811
    """A folder with a calibrated robot, what was found of it, joint values and true places of some stops."""
    text, true, places = _log(OPPOSED, np.random.default_rng(3), 40.0, 0.0, PLACE_MM, marks=24)
    found = _calibrated(fitted, tmp_path, OPPOSED, 40.0, text, "--pose-sd", f"{PLACE_MM}")
    assert found["usable"]
    rng = np.random.default_rng(3)
    rng.normal(size=OPPOSED.shape)
    reference = 5e-3 * rng.normal(size=3)
    rows = list(csv.DictReader(text.splitlines()))
    joint = np.array([[float(rows[k][f"joint_{i}_m"]) for i in (1, 2, 3)] for k in STOPS])
    tensions = [_rests(true, one + reference, PLACES[k])[1] for one, k in zip(joint, STOPS, strict=True)]
    return tmp_path, found, joint, np.array(tensions), places[STOPS][:, PLANE]


def _followed(folder, wires, header, rows, *options):
    """Means and standard deviations of x and z at the stops."""
    log, out = folder / "later.csv", folder / f"pose-{len(header)}"
    log.write_text("\n".join(",".join(map(str, row)) for row in [header, *rows]) + "\n")
    given = ["pose", folder / "out/robot.toml", "--wires", wires, "--calibration", folder / "out", "--draws", "200"]
    assert main([str(value) for value in [*given, "--joints", log, "--output", out, *options]]) == 0
    poses = list(csv.DictReader((out / "poses.csv").read_text().splitlines()))[::2]
    return (np.array([[float(row[f"{axis}_{name}_m"]) for axis in "xz"] for row in poses]) for name in ("mean", "sd"))


def _twice(*columns):
    """Rows of a log: every stop begins and ends."""
    rows = []
    for k, values in zip(STOPS, np.concatenate(columns, 1).tolist(), strict=True):
        rows += [[100 * k, k, *values], [100 * k + 50, k, *values]]
    return rows


def test_poses_of_a_history_are_known_as_well_as_those_of_the_calibration(fitted, case):  # noqa: F811
    """Anchors and reference lengths are each known to millimetres, but the way between them far better."""
    folder, found, joint, _, places = case
    assert max(found["references_m"]["sd"]) > 2e-3
    header = ["time_s", "hold", *(f"joint_{i}_m" for i in (1, 2, 3))]
    here, sd = _followed(folder, fitted, header, _twice(joint))
    assert (np.abs(here - places) < 4 * sd).all()
    known = np.array(found["poses"]["sd"])[STOPS][:, PLANE]
    assert (sd < 2 * known).all()
    assert (sd > known / 3).all()


def test_tensions_do_not_make_a_calibrated_robot_more_certain_than_its_points_are(fitted, case):  # noqa: F811
    """What is left of the errors of the points pulls at the wires, at every pose in another way."""
    folder, _, joint, tension, places = case
    header = ["time_s", "hold", *(f"joint_{i}_m" for i in (1, 2, 3))]
    header += [f"tension_{i}_N" for i in (1, 2, 3)]
    here, sd = _followed(folder, fitted, header, _twice(joint, tension), "--tension-sd", "0.01")
    off = (here - places) / sd
    assert np.sqrt(np.mean(off**2)) < 2

"""Drums that are wider than the robot's file says: found, said, and allowed for in joint values to the home pose."""

import numpy as np

from tests.robot.test_commands import fitted  # noqa: F401 - a fixture
from tests.robot.test_measured_poses import OPPOSED, PLACE_MM, _calibrated, _log, _rests
from wirebayes.cli import main

WIDER = np.array([0.004, -0.003, 0.002])
HOME = np.array([0.0, 0.0, 0.5])


def _by_other_drums(log):
    """A log whose joint values were computed with the radii of the file."""
    head, *rows = (line.split(",") for line in log.splitlines())
    first = head.index("joint_1_m")
    for row in rows:
        joint = np.array(row[first : first + 3], float) / (1.0 + WIDER)
        row[first : first + 3] = [f"{value:.7f}" for value in joint]
    return "\n".join(",".join(row) for row in [head, *rows]) + "\n"


def test_drums_of_another_radius_are_found_and_allowed_for(fitted, tmp_path, capsys):  # noqa: F811
    text, true, _ = _log(OPPOSED, np.random.default_rng(3), 40.0, 0.0, PLACE_MM, marks=24)
    rng = np.random.default_rng(3)
    rng.normal(size=OPPOSED.shape)
    reference = 5e-3 * rng.normal(size=3)
    stated = ["--pose-sd", f"{PLACE_MM}", "--drum-sd", "0.5"]
    found = _calibrated(fitted, tmp_path, OPPOSED, 40.0, _by_other_drums(text), *stated)
    assert found["usable"]
    wider, sd = (np.array(found["drum_wider_percent"][name]) for name in ("mean", "sd"))
    assert (np.abs(wider - 100 * WIDER) < 4 * sd).all()
    assert sd.max() < 0.25  # of 0.5
    assert f"{wider[0]:+.2f} ± " in capsys.readouterr().out
    assert "adii of the drums, % beyond" in (tmp_path / "out/report.html").read_text()
    joint = np.array(found["joint_values_for_home_m"])
    there, _ = _rests(true, joint * (1.0 + WIDER) + reference, HOME + [0.01, 0.0, 0.01])
    assert np.linalg.norm(there - HOME) < 1e-3


def test_a_history_does_not_go_on_with_drums_that_nobody_may_have_set(fitted, tmp_path, capsys):  # noqa: F811
    text, _, _ = _log(OPPOSED, np.random.default_rng(3), 40.0, 0.0, PLACE_MM, marks=24)
    _calibrated(fitted, tmp_path, OPPOSED, 40.0, text, "--pose-sd", f"{PLACE_MM}", "--drum-sd", "0.5")
    log, out = tmp_path / "later.csv", tmp_path / "pose"
    log.write_text("time_s,joint_1_m,joint_2_m,joint_3_m\n0,1.4,1.4,0.98\n60,1.4,1.4,0.98\n")
    robot = str(tmp_path / "out/robot.toml")
    given = ["pose", robot, "--wires", str(fitted), "--joints", str(log), "--calibration", str(tmp_path / "out")]
    capsys.readouterr()
    assert main([*given, "--output", str(out)]) == 2
    assert "--calibration: found one with --drum-sd in" in capsys.readouterr().err
    assert not out.exists()

"""A history that goes on where a calibration ended, against a simulation of its own of session and history in one."""

import csv
import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib import resources
from types import SimpleNamespace

import numpy as np
import pytest

import wirebayes as wb
from tests.robot.found_lengths import found_lengths
from tests.robot.test_commands import fitted, session_csv  # noqa: F401 - fixtures
from tests.robot.test_history import _joint_values_for, _line, _simulated, _theta
from wirebayes.cli import main
from wirebayes.errors import InputError
from wirebayes.io.run_folder import read_json
from wirebayes.json_files.plain import plain
from wirebayes.numeric.typing import Floats
from wirebayes.robot.history import commanded, corrections
from wirebayes.robot.history.estimate import estimate_poses
from wirebayes.robot.history.history import History
from wirebayes.robot.history.live import LiveEstimator
from wirebayes.robot.history.unknowns import Uncertain, unknowns
from wirebayes.robot.mechanics import schema
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.draws import WireDraws
from wirebayes.robot.motion.creep import fresh
from wirebayes.robot.self_calibration.calibrated import Calibrated, calibrated, from_dict, to_dict
from wirebayes.robot.self_calibration.equations import State
from wirebayes.robot.self_calibration.session import LengthPrior, Session
from wirebayes.robot.self_calibration.unknowns import StatedErrors, Unknowns

HOLD_S, SOON_S = 40.0, 1e-3
ERRORS = Uncertain(4e-3, 0.05, 0.01)


@pytest.fixture(scope="module")
def case():
    """A robot with lengths and wires of its own, its session read with noise, and what it did afterwards."""
    robot, line = schema.read_robot_file("hangprinter-4"), _line(60)
    rng = np.random.default_rng(5)
    places = robot.home_m + 0.12 * robot.span_m * rng.uniform(-1, 1, (9, 3))
    begins = np.arange(len(places)) * (HOLD_S + SOON_S)
    times = np.concatenate([np.stack([begins, begins + HOLD_S], 1).ravel(), begins[-1] + HOLD_S + [SOON_S, 300.0]])
    holds = np.repeat(np.arange(len(places) + 1), 2)
    last = robot.home_m + 0.1 * robot.span_m * np.array([1.0, -0.5, 0.3])
    whole = _joint_values_for(robot, times, np.concatenate([np.repeat(places, 2, 0), [last, last]]), holds)
    true = unknowns(robot, line, ERRORS, rng)
    wires, error = true.columns(true.draws[:1])
    x, _, tau = _simulated(robot, _theta(wires, 0), whole, error[0])
    reads = tau[1:-2:2] + 0.01 * rng.standard_normal((len(places), robot.legs))
    level = np.tile(np.eye(3), (len(places), 1, 1))
    session = Session(
        places, level, whole.joint_m[:-2:2], np.full(len(places), HOLD_S), np.ones(len(places), bool), 0.01
    )
    prior = LengthPrior(line, ERRORS.reference_m, ERRORS.spread)
    known = found_lengths(robot, prior, session, reads.ravel() / 0.01)
    assert known.converged
    start = calibrated(known, session)
    after = History(times[-2:], whole.joint_m[-2:], None, None, np.zeros(2), np.zeros((2, 3)))
    return Case(
        robot,
        line,
        start,
        after,
        x[-2:],
        lambda joint: _simulated(
            robot, _theta(wires, 0), replace(whole, joint_m=np.concatenate([whole.joint_m[:-2], joint])), error[0]
        )[0][-2:],
    )


@dataclass(frozen=True)
class Case:
    """What is known, the history's joint values and true positions, and where other joint values would have led."""

    robot: Robot
    line: WireDraws
    start: Calibrated
    after: History
    position_m: Floats
    led_by: Callable[[Floats], Floats]

    def estimated(self, errors):
        """Positions ``(n, 2, 3)``."""
        begin = (self.robot.home_m, np.eye(3))
        return estimate_poses(
            self.robot, self.line, self.after, begin, errors, np.random.default_rng(0)
        ).track.position_m


def test_a_history_goes_on_with_the_lengths_and_the_creep_of_the_session(case, monkeypatch):
    found, wide = case.estimated(replace(ERRORS, calibrated=case.start)), case.estimated(ERRORS)
    without = case.estimated(Uncertain())
    off = np.linalg.norm(case.position_m - without.mean(0), axis=1)
    left = np.linalg.norm(case.position_m - found.mean(0), axis=1)
    assert off.min() > 1.5e-3
    assert left.max() < 0.3 * off.min()
    assert (found.std(0) < 0.3 * wide.std(0)).all()
    assert (np.abs(case.position_m - found.mean(0)) < 2 * found.std(0)).all()
    monkeypatch.setattr(Calibrated, "carried", lambda self, unknowns: fresh(self.robot.legs, len(unknowns)))
    new = case.estimated(replace(ERRORS, calibrated=case.start))
    assert (np.linalg.norm(case.position_m - new.mean(0), axis=1) > 1.5 * left).all()


def test_joint_values_of_a_trajectory_allow_for_the_calibration(case):
    robot, after = case.robot, case.after
    goal = robot.home_m + 0.1 * robot.span_m * np.array([1.0, -0.5, 0.3])
    asked = replace(after, joint_m=None, position_m=np.stack([goal, goal]), rotation=np.tile(np.eye(3), (2, 1, 1)))
    errors = replace(ERRORS, calibrated=case.start)
    found, joint = commanded.drift_along(robot, case.line, asked, errors, np.random.default_rng(0))
    np.testing.assert_allclose(found.track.position_m[:, 0], np.tile(goal, (case.line.count, 1)), atol=1e-7)
    assert np.linalg.norm(case.led_by(joint.mean(0))[0] - goal) < 0.3 * np.linalg.norm(case.position_m[0] - goal)
    to = corrections.target(robot, asked, found)
    left = corrections.error_left(robot, asked, found, to, joint.mean(0), np.arange(1))
    assert 1e-4 < np.median(left) < 1e-3  # what the calibration left unknown


def test_live_goes_on_there_too(case):
    robot, errors, begin = case.robot, replace(ERRORS, calibrated=case.start), (case.robot.home_m, np.eye(3))
    batch = case.estimated(errors)[:, 0]
    for reads in (False, True):
        now = LiveEstimator(robot, case.line, errors, begin, reads).step(0.0, case.after.joint_m[0])
        np.testing.assert_allclose(now.position_m, batch.mean(0), atol=1e-9)
        np.testing.assert_allclose(now.position_sd_m, batch.std(0), rtol=1e-6)


def test_what_is_stored_is_what_is_known(case):
    back = from_dict(json.loads(json.dumps(plain(to_dict(case.start)))), case.robot, case.line)
    np.testing.assert_array_equal(back.mean, case.start.mean)
    np.testing.assert_array_equal(back.covariance, case.start.covariance)
    points = case.start.mean + np.array([0.0, 1.0])[:, None] * np.sqrt(np.diag(case.start.covariance))
    for one, other in zip(case.start.carried(points).creep_mm, back.carried(points).creep_mm, strict=True):
        np.testing.assert_allclose(other, one, rtol=1e-12)
    with pytest.raises(ValueError, match="other unknowns"):
        from_dict(plain(to_dict(case.start)), schema.read_robot_file("linear-7"), case.line)


def test_biases_are_averaged_over(case):
    prior = replace(case.start.prior, bias_sd_N=0.1)
    given = Unknowns(case.robot, prior, StatedErrors(joint_m=0.0))
    mean, root = given.moments
    d, session = len(mean), case.start.session
    white = np.linalg.solve(root, np.arange(d) - mean)
    state = State(white, session.position_m, session.rotation, session.joint_m)
    known = calibrated(SimpleNamespace(unknowns=given, state=state, covariance=np.eye(d)), session)
    np.testing.assert_allclose(known.mean, np.arange(d - 4), atol=1e-9)
    assert known.covariance.shape == (d - 4, d - 4)
    assert unknowns(case.robot, case.line, replace(ERRORS, calibrated=known), np.random.default_rng(0)).count == d - 4


def _run_live(wires, usable, unusable, joint):
    """A stream goes on from a calibration that is usable, and from no other does it begin."""
    running = wb.live("linear-7", wires, calibration=usable, draws=4)
    poses = [running.step(float(t), joint).position_m for t in range(3)]
    assert np.isfinite(poses).all()
    with pytest.raises(InputError, match=r"not usable in .* \(warnings: misfit\), expected a calibration"):
        wb.live("linear-7", wires, calibration=unusable, draws=4)


def test_the_command_goes_on_from_a_calibration_or_refuses_it(fitted, session_csv, tmp_path, capsys):  # noqa: F811
    session, _ = session_csv
    wires, done = ["--wires", str(fitted)], tmp_path / "calibrate"
    assert main(["calibrate", "linear-7", str(session), *wires, "--draws", "40", "--output", str(done)]) == 0
    row = next(csv.DictReader(session.read_text().splitlines()))
    joints = [f"joint_{i}_m" for i in range(1, 8)]
    lines = [["time_s", *joints], *([t, *(row[name] for name in joints)] for t in (0, 60))]
    log, out = tmp_path / "log.csv", tmp_path / "out"
    log.write_text("\n".join(",".join(map(str, line)) for line in lines) + "\n")
    begin, joint = ["pose", "linear-7", *wires], ["--joints", str(log), "--draws", "4"]
    assert main([*begin, *joint, "--calibration", str(done), "--output", str(out)]) == 0
    content = read_json(out / "pose.json")
    assert content["clock"]["largest_mm"] == 0  # one hold: nothing restarts
    known = content["history"]["calibration"]
    assert known["holds"] == 5
    assert known["duration_s"] == 150
    calibrated = read_json(done / "calibration.json")["with_creep_model"]["reference_error_mm"]
    np.testing.assert_allclose(known["reference_error_mm"]["mean"], calibrated["mean"])
    np.testing.assert_allclose(known["reference_error_mm"]["sd"], calibrated["sd"])
    assert "goes on where a calibration of 5 holds and 2.5 min ended" in (out / "report.html").read_text()
    capsys.readouterr()
    astray = tmp_path / "astray"
    shutil.copytree(done, astray)
    found = read_json(done / "calibration.json")
    found["with_creep_model"]["converged"] = False
    (astray / "calibration.json").write_text(json.dumps(found))
    unusable = tmp_path / "unusable"
    shutil.copytree(done, unusable)
    found["with_creep_model"]["converged"] = True
    doubted = found | {"usable": False, "warnings": [{"kind": "misfit", "text": "…"}]}
    (unusable / "calibration.json").write_text(json.dumps(doubted))
    _run_live(fitted, done, unusable, [float(row[name]) for name in joints])
    other = tmp_path / "other"
    other.mkdir()
    (other / "posterior.nc").write_bytes(b"another")
    damaged = tmp_path / "damaged"
    shutil.copytree(done, damaged)
    (damaged / "unknowns.json").write_text("{}")
    heavier = tmp_path / "heavier.toml"
    text = (resources.files("wirebayes") / "data" / "robots" / "linear-7.toml").read_text()
    heavier.write_text(text.replace("mass_kg = 0.9", "mass_kg = 0.8"))
    for arguments, message in (
        ([*begin, "--calibration", str(done)], "--calibration: found beside a single pose"),
        ([*begin, *joint, "--calibration", str(done), "--reference-sd", "2"], "--reference-sd: found beside"),
        ([*begin, *joint, "--calibration", str(tmp_path / "no")], "found no calibration.json in"),
        ([*begin, *joint, "--calibration", str(astray)], "found one that has not converged in"),
        ([*begin, *joint, "--calibration", str(unusable)], f"not usable in {unusable} (warnings: misfit), expected"),
        ([*begin, *joint, "--calibration", str(damaged)], "unknowns.json: cannot be used"),
        (["pose", "linear-6", *wires, *joint, "--calibration", str(done)], "found one of linear-7 in"),
        (["pose", str(heavier), *wires, *joint, "--calibration", str(done)], "found one of another linear-7 in"),
        (["pose", "linear-7", "--wires", str(other), *joint, "--calibration", str(done)], "found one with other wires"),
    ):
        assert main([*arguments, "--output", str(tmp_path / "refused")]) == 2
        line = capsys.readouterr().err.strip()
        assert message in line
        assert "\n" not in line
        assert not (tmp_path / "refused").exists()

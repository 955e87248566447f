"""A history on a robot whose anchors were calibrated: as certain as the calibration, which knows sums best."""

import csv
from dataclasses import replace

import numpy as np
import pytest

from tests.robot.test_commands import fitted  # noqa: F401 - a fixture
from tests.robot.test_history import _line
from tests.robot.test_measured_poses import OPPOSED, PLACE_MM, PLACES, _calibrated, _log, _rests
from wirebayes.cli import main
from wirebayes.robot.history.estimate import estimate_poses
from wirebayes.robot.history.history import History
from wirebayes.robot.history.live import LiveEstimator
from wirebayes.robot.history.unknowns import Uncertain, unknowns
from wirebayes.robot.mechanics import schema
from wirebayes.robot.mechanics.draws import for_robot
from wirebayes.robot.motion import forward, inverse
from wirebayes.robot.self_calibration.calibrated import Calibrated
from wirebayes.robot.self_calibration.session import LengthPrior, Session

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


@pytest.fixture(scope="module")
def far():
    """A calibration whose references make up for its points where its session was, and a history far from there."""
    robot, line, rng = schema.read_robot_file("hangprinter-4"), _line(24), np.random.default_rng(3)
    here = robot.home_m[None], np.eye(3)[None]
    there = robot.home_m + 0.1 * robot.span_m * np.array([1.0, -0.5, 0.3])
    both = np.stack([robot.home_m, there]), np.tile(np.eye(3), (2, 1, 1))
    tau = inverse.tensions(robot, *both)
    wires = for_robot(robot, line.centre())
    joint = inverse.commands(robot, wires, *both, tau).joint_m
    session = Session(*here, joint[:1], np.array([1e-6]), np.zeros(1, bool), np.nan)
    prior = LengthPrior(line, 1e-3, 1e-4)
    mean, covariance = prior.moments(robot.legs)
    legs, d = robot.legs, len(mean)
    points = 5e-3 * rng.standard_normal((40, 3 * legs))
    none = np.append(mean, np.zeros(3 * legs))
    nothing = Calibrated(robot, prior, session, none, np.eye(len(none)), tau[:1], ("exit",))
    lengths = -nothing.error_m(np.concatenate([np.zeros((40, d)), points], 1), here, tau[:1])[0]
    together = np.cov(np.concatenate([lengths, points], 1).T) + 1e-12 * np.eye(4 * legs)
    whole = np.zeros((d + 3 * legs, d + 3 * legs))
    whole[:d, :d] = covariance
    own = np.r_[0:legs, d : d + 3 * legs]
    whole[np.ix_(own, own)] = together
    known = replace(nothing, covariance=whole)
    times = np.array([0.0, 1e-3])
    history = History(times, np.stack([joint[1], joint[1]]), None, None, np.zeros(2), np.zeros((2, 3)))
    return robot, line, history, Uncertain(calibrated=known), (there, np.eye(3))


def test_each_draw_of_a_history_has_its_own_points(far):
    """Away from the session, points that are off no longer make up for the references."""
    robot, line, history, errors, near = far
    found = estimate_poses(robot, line, history, near, errors, np.random.default_rng(0)).track
    known = unknowns(robot, line, errors, np.random.default_rng(0))
    white = known.draws
    values = known.mean + white @ known.root.T
    wires, reference = known.columns(white)
    strain = known.carried(white).strain(wires).T
    bare, offset = inverse.lengths(robot, history.joint_m[:1])
    real, pull = [], []
    for n, row in enumerate(values):
        own = replace(robot, exit_m=robot.exit_m + row[-3 * robot.legs :].reshape(-1, 3))
        zero = (bare + reference[n]) * (1 + strain[n])
        here = forward.solve_equilibrium(own, wires.part([n]), zero, offset, *near)
        real.append(here.position_m[0])
        pull.append(here.tension_N[0])
    real, pull = np.array(real), np.array(pull)
    assert real.std(0).max() > 5e-4
    assert np.abs(found.position_m[:, 0] - real).max() < 0.1 * real.std(0).max()
    assert (np.abs(found.tension_N[:, 0] - pull).max(0) < 0.1 * pull.std(0)).all()


def test_a_running_estimate_has_them_too(far):
    robot, line, history, errors, near = far
    track = estimate_poses(robot, line, history, near, errors, np.random.default_rng(0)).track
    batch, pull = track.position_m[:, 0], track.tension_N[:, 0]
    for reads in (False, True):
        now = LiveEstimator(robot, line, errors, near, reads).step(0.0, history.joint_m[0])
        np.testing.assert_allclose(now.position_m, batch.mean(0), atol=0.05 * batch.std(0).max())
        np.testing.assert_allclose(now.position_sd_m, batch.std(0), rtol=0.05)
        np.testing.assert_allclose(now.tension_N, pull.mean(0), atol=0.05 * pull.std(0).max())

"""The running estimate against the batch estimate of the same history."""

import importlib.util
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import wirebayes as wb
from tests.robot import drawn
from tests.robot.test_history import _joint_values_for, _line, _places
from wirebayes.errors import InputError
from wirebayes.robot.history.estimate import estimate_poses
from wirebayes.robot.history.follow import clock_starts, follow_log
from wirebayes.robot.history.history import History
from wirebayes.robot.history.live import LiveEstimator
from wirebayes.robot.history.unknowns import Uncertain, unknowns
from wirebayes.robot.mechanics import schema
from wirebayes.robot.motion import path

TIMES = np.array([0, 60, 70, 400, 420, 900, 930, 2000, 2030, 3600.0])
EXACT = Uncertain()


def _history(robot):
    a, _, b, _, c, _ = _places(robot)
    return _joint_values_for(robot, TIMES, [a, a, b, b, c, c, b, b, a, a])


def _standing(name="hangprinter-4", draws=4, errors=EXACT, reads=False, **more):
    """An estimator of a robot at its home pose, and the joint values there."""
    robot = schema.read_robot_file(name)
    live = LiveEstimator(robot, _line(draws), errors, (robot.home_m, np.eye(3)), reads=reads, **more)
    return live, _joint_values_for(robot, [0, 9], [robot.home_m] * 2).joint_m[0]


def _run(live, history, **more):
    """Fed twice a second while the robot moves, every ten seconds while it stands; the answers at the rows."""
    out = []
    spans = zip(TIMES[:-1], TIMES[1:], strict=True)
    times = np.unique(np.concatenate([TIMES, *(np.arange(a, b, 0.5 if b - a < 50 else 10.0) for a, b in spans)]))
    joints = np.stack([np.interp(times, TIMES, column) for column in history.joint_m.T], 1)
    for time, joint in zip(times, joints, strict=True):
        row = np.flatnonzero(time == TIMES)
        readings = {name: values[row[0]] for name, values in more.items()} if row.size else {}
        now = live.step(time, joint, **readings)
        if row.size:
            out.append(now)
    return out


@pytest.mark.parametrize("name", ["cogiro-desk", pytest.param("linear-7", marks=pytest.mark.slow)])
def test_an_hour_agrees_with_the_batch(name):
    robot = schema.read_robot_file(name)
    history, start, line = _history(robot), (robot.home_m, np.eye(3)), _line(32)
    batch = estimate_poses(robot, line, history, start, Uncertain(1e-3), np.random.default_rng(0)).track.position_m
    now = _run(LiveEstimator(robot, line, Uncertain(1e-3), start, reads=False), history)
    low, high = np.quantile(batch, [0.05, 0.95], axis=0)
    band = high - low
    assert (np.abs([p.position_m for p in now] - batch.mean(0)) < 0.1 * band).all()
    assert (np.abs([p.low_m for p in now] - low) < 0.1 * band).all()
    assert (np.abs([p.high_m for p in now] - high) < 0.1 * band).all()
    assert all(p.held == 1 for p in now)


@pytest.mark.slow
def test_with_readings_it_agrees_with_the_batch_in_the_end():
    robot = schema.read_robot_file("hangprinter-4")
    history, start, line, errors = _history(robot), (robot.home_m, np.eye(3)), _line(64), Uncertain(1e-3, 0.05, 0.05)
    true = unknowns(robot, _line(1, seed=3), errors, np.random.default_rng(7))
    plain = follow_log(robot, true.plain, history, history.joint_m, start, TIMES[:1]).tension_N[0]
    wires, error = true.columns(true.draws)
    truth = follow_log(robot, wires, history, history.joint_m, start, clock_starts(history, plain), error)
    rng = np.random.default_rng(8)
    tension = truth.tension_N[0] + 0.05 * rng.standard_normal(plain.shape)
    read = replace(history, tension_N=tension)
    batch = estimate_poses(robot, line, read, start, errors, np.random.default_rng(0)).track.position_m[:, -1]
    batch = batch[np.isfinite(batch).all(1)]
    last = _run(LiveEstimator(robot, line, errors, start), history, tension_N=tension)[-1]
    blind = _run(LiveEstimator(robot, line, errors, start, reads=False), history)[-1]
    assert np.linalg.norm(last.position_sd_m) < 0.85 * np.linalg.norm(blind.position_sd_m)
    np.testing.assert_allclose(last.position_sd_m, batch.std(0), rtol=0.4)
    assert (np.abs(last.position_m - batch.mean(0)) < 0.1 * 3.3 * batch.std(0)).all()
    assert (np.abs(last.position_m - truth.position_m[0, -1]) < 3 * last.position_sd_m).all()


def test_joint_values_that_are_sent_back_bring_the_platform_back():
    live, nominal = _standing("linear-7", 24)
    joint = nominal
    for time in np.arange(0, 600.0, 5.0):
        now = live.step(time, joint, nominal_m=nominal)
        joint = nominal + now.correction_m
    still, _ = _standing("linear-7", 24)
    for time in (0.0, 595.0):
        drifted = still.step(time, nominal)
    meant = still._x[-1]
    assert np.linalg.norm(drifted.position_m - meant) > 2e-3
    assert np.linalg.norm(now.position_m - meant) < 1e-4
    np.testing.assert_allclose(now.correction_m, drifted.correction_m, atol=0.15 * np.abs(drifted.correction_m).max())


def test_a_long_step_is_as_good_as_short_ones():
    ends = []
    for times in ([0.0, 600.0], np.arange(0, 601.0, 2.0)):
        live, joint = _standing("cogiro-desk")
        for time in times:
            now = live.step(time, joint)
        ends.append(now.position_m)
    drift = np.linalg.norm(ends[1] - live.robot.home_m)
    assert np.linalg.norm(ends[0] - ends[1]) < 0.005 * drift


def test_before_anything_has_crept_corrections_do_not_depend_on_the_seed():
    for errors in (Uncertain(), Uncertain(2e-3)):
        ends = []
        for seed in range(10):
            live, joint = _standing(draws=64, errors=errors, seed=seed)
            ends.append([(now.correction_m, now.joint_sd_m) for now in (live.step(0.0, joint), live.step(60.0, joint))])
        correction, sd = np.moveaxis(ends, 2, 0)
        standard_error = sd.mean(0) / np.sqrt(64)  # of independent draws
        assert (correction.std(0) < 0.25 * standard_error).all()


def test_a_payload_that_is_set_starts_the_clocks_and_lowers_the_platform():
    live, joint = _standing("cogiro-desk")
    robot = live.robot
    before = live.step(0.0, joint)
    live.load(0.5 * robot.mass_kg)
    after = live.step(1.0, joint)
    assert after.position_m[2] < before.position_m[2] - 1e-4
    assert live._since == 1.0
    loaded = History(
        np.array([0.0, 1.0]),
        np.stack([joint, joint]),
        None,
        None,
        np.full(2, 0.5 * robot.mass_kg),
        np.tile(robot.centre_of_mass_m, (2, 1)),
    )
    batch = estimate_poses(robot, _line(4), loaded, (robot.home_m, np.eye(3)), Uncertain(), np.random.default_rng(0))
    np.testing.assert_allclose(after.position_m, batch.track.position_m[:, 0].mean(0), atol=2e-4)


def test_time_goes_on_and_readings_are_asked_for():
    live, joint = _standing("cogiro-desk", 2)
    live.step(1.0, joint)
    with pytest.raises(ValueError, match="found 1 after 1, expected a later time"):
        live.step(1.0, joint)
    with pytest.raises(ValueError, match="expected none"):
        live.step(2.0, joint, tension_N=np.ones(8))


NAN4, INF4 = np.array([0, np.nan, 0, 0]), np.array([0, 0, np.inf, 0])


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (lambda j: {"joint_m": j + NAN4}, "joint_m[1]: found nan, expected a finite length above 0"),
        (lambda j: {"joint_m": j + INF4}, "joint_m[2]: found inf, expected a finite length above 0"),
        (lambda j: {"joint_m": j * [1, 1, 1, 0]}, "joint_m[3]: found 0, expected a finite length above 0"),
        (lambda j: {"joint_m": -1.5 * np.ones(4)}, "joint_m[0]: found -1.5, expected a finite length above 0"),
        (lambda j: {"joint_m": 6.2}, "joint_m: found a single number, expected 4 numbers"),
        (lambda j: {"joint_m": [6.2]}, "joint_m: found 1 in a list, expected 4 numbers"),
        (lambda j: {"joint_m": j[:3]}, "joint_m: found 3 in a list, expected 4 numbers"),
        (lambda j: {"joint_m": np.tile(j, (5, 1))}, "joint_m: found an array (5, 4), expected 4 numbers"),
        (lambda j: {"joint_m": ["a"] * 4}, "joint_m: found what is not numbers, expected 4 numbers"),
        (lambda j: {"nominal_m": 6.2}, "nominal_m: found a single number, expected 4 numbers"),
        (lambda j: {"nominal_m": j + NAN4}, "nominal_m[1]: found nan, expected a finite length above 0"),
        (lambda j: {"tension_N": 5.0}, "tension_N: found a single number, expected 4 numbers"),
        (lambda j: {"tension_N": INF4}, "tension_N[2]: found inf, expected a finite number, or NaN where nothing was"),
        (lambda j: {"tilt_rad": [0.1]}, "tilt_rad: found 1 in a list, expected 2 numbers"),
        (lambda j: {"time_s": np.inf}, "time_s: found inf, expected a finite time"),
        (lambda j: {"time_s": np.nan}, "time_s: found nan after 0, expected a later time"),
        (lambda j: {"time_s": -1.0}, "time_s: found -1 after 0, expected a later time"),
        (lambda j: {"time_s": "now"}, "time_s: found 'now', expected a number"),
    ],
)
def test_a_wrong_step_is_named_and_leaves_no_trace(given, message):
    (live, joint), (other, _) = _standing(reads=True), _standing(reads=True)
    tension = live.step(0.0, joint).tension_N
    other.step(0.0, joint)
    wrong = {"time_s": 1.0, "joint_m": joint} | given(joint)
    with pytest.raises(InputError) as caught:
        live.step(**wrong)
    assert str(caught.value).startswith(message)
    after, same = (one.step(2.0, joint, tension_N=tension) for one in (live, other))
    assert after.held == 1
    np.testing.assert_array_equal(after.joint_m, same.joint_m)
    np.testing.assert_array_equal(after.low_m, same.low_m)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ((-5,), "mass_kg: found -5, expected kilograms, 0 or more"),
        ((np.nan,), "mass_kg: found nan, expected kilograms, 0 or more"),
        ((np.inf,), "mass_kg: found inf, expected kilograms, 0 or more"),
        ((1.0, [1, 2]), "centre_m: found 2 in a list, expected 3 numbers"),
        ((1.0, [1, 2, np.nan]), "centre_m[2]: found nan, expected a finite number"),
    ],
)
def test_a_load_that_cannot_be_is_refused_and_changes_nothing(given, message):
    live, joint = _standing()
    before = live.robot
    with pytest.raises(InputError) as caught:
        live.load(*given)
    assert str(caught.value) == message
    assert live.robot is before


def test_no_draws_are_refused():
    with pytest.raises(InputError, match="^draws: found 0, expected a whole number, 1 or more$"):
        wb.live("hangprinter-4", "out/fit", draws=0)


def test_a_linear_actuator_may_stand_at_zero_or_below():
    live, joint = _standing(name="linear-7")
    assert live.step(0.0, joint).held == 1
    shift = np.where(np.arange(7) == 0, joint, 0.0)
    assert np.isfinite(live._joints("joint_m", joint - 2 * shift)).all()
    with pytest.raises(InputError, match=r"joint_m\[0\]: found nan, expected a finite number$"):
        live.step(1.0, joint + np.where(shift > 0, np.nan, 0.0))


def test_a_platform_that_falls_is_an_answer_without_noise():
    live, joint = _standing(name="cogiro-desk")
    live.step(0.0, joint)
    live.load(1e300)  # NumPy's warnings are errors here
    fallen = live.step(1.0, joint)
    assert fallen.held == 0
    assert np.isnan(fallen.position_m).all()


def test_the_sample_for_firmware_takes_the_creep_off(monkeypatch):
    path = Path(__file__).parents[2] / "docs" / "live_firmware.py"
    spec = importlib.util.spec_from_file_location("live_firmware", path)
    sample = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(sample)
    live, nominal = _standing(draws=8)
    robot = live.robot
    now, sent = [0.0], []
    believed = (nominal - robot.beyond_m) / robot.lines
    made = sample.correct(
        live, lambda: believed, sent.append, 0.1, lambda: now[0], lambda s: now.__setitem__(0, now[0] + s)
    )
    assert len(sent) > 2
    np.testing.assert_allclose(np.sum(sent, 0), made)
    assert (
        np.linalg.norm(
            live.step(400.0, nominal + 1e-3 * robot.lines * made, nominal_m=nominal).position_m - live._x[-1]
        )
        < 2e-4
    )
    assert sample.klipper([1, 2, 3, -4]).splitlines()[3] == "FORCE_MOVE STEPPER=stepper_d DISTANCE=-4.0000 VELOCITY=2"
    assert sample.reprapfirmware([1, 2, 3, -4]) == "M120 G91 G1 H2 X1.0000 Y2.0000 Z3.0000 U-4.0000 F120 M121"


def test_straight_lengths_of_drawn_robots_are_wires_and_taken_for_wires_are_refused():
    rng = np.random.default_rng(11)
    for kind in ("point-4", "point-5", "body-8"):
        one = drawn.draw(kind, rng)
        lines = rng.choice([3.0, 4.0], one.robot.legs)
        robot = replace(one.robot, lines=lines, home_m=one.position_m)
        live = LiveEstimator(robot, one.line, Uncertain(), (robot.home_m, np.eye(3)), reads=False)
        arm = robot.home_m + robot.platform_m - robot.exit_m
        straight = np.linalg.norm(arm, axis=1)
        wire = live.wire_m(straight)
        np.testing.assert_allclose(wire, lines * straight + robot.beyond_m)
        if not robot.beyond_m.any():
            with pytest.raises(InputError, match=r"whole wire.*wire_m\(\)"):
                live.step(0.0, straight)
        pose = live.step(0.0, wire)
        np.testing.assert_allclose(pose.straight_correction_m * lines, pose.correction_m)
        assert pose.held > 0


def test_a_step_at_a_controllers_rate_takes_one_newton_step(monkeypatch):
    robot = schema.read_robot_file("cogiro-desk")
    times = np.arange(20) / 500.0
    way = robot.home_m + 0.05 * robot.span_m * np.stack([np.sin(times), np.cos(times) - 1.0, 0.3 * times], 1)
    live = LiveEstimator(robot, _line(8), Uncertain(), (robot.home_m, np.eye(3)), reads=False)
    joints = _joint_values_for(robot, times, way).joint_m
    live.step(-1.0, joints[0])
    made, step = [], path.newton_step
    monkeypatch.setattr(path, "newton_step", lambda *given: made.append(1) or step(*given))
    for time, joint in zip(times, joints, strict=True):
        live.step(time, joint)
    assert len(made) == len(times)

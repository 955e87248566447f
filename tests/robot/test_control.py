from dataclasses import replace

import numpy as np
import pytest

from tests.robot import cases
from tests.robot.lines import CORE, STRONGER, line_about
from wirebayes.robot.mechanics import draws, schema
from wirebayes.robot.motion import claim, control, inverse
from wirebayes.robot.motion.creep import HoldCreep, fresh
from wirebayes.robot.motion.creeping_hold import CreepingHold
from wirebayes.robot.pose.variance_shares import shares


def _line(n=50, sd=0.05, seed=0):
    return line_about(STRONGER, sd, n, seed)


@pytest.mark.parametrize("name", ["cogiro-desk", "linear-7", "hangprinter-4"])
def test_a_controller_that_knows_everything_holds_the_pose(name):
    robot = schema.read_robot_file(name)
    wires = draws.for_robot(robot, _line(1, 0.0))
    x, R = robot.home_m, np.eye(3)
    times = np.array([0.0, 60.0, 3600.0])
    aware = control.error(robot, wires, control.creep_aware(robot, wires, x, R), x, R, times)
    blind = control.error(robot, wires, control.hooke_only(robot, wires, x, R), x, R, times)
    assert aware.found.all()
    assert aware.distance_m.max() < 1e-9
    assert blind.distance_m[0, 0] < 1e-9
    assert blind.distance_m[0, 2] > 1e-3


def _after_calibration(robot, wires, carried, x, R, times):
    """Pose error of joints held still, and of commands that foresee the mean creep, from a calibration on."""
    schedules = control.calibrated_schedules(robot, wires, carried, x, R)
    return [control.error(robot, wires, schedule, x, R, times, carried) for schedule in schedules]


def test_foreseeing_creep_helps_uncertain_wires():
    robot = schema.read_robot_file("cogiro-desk")
    wires = draws.for_robot(robot, _line(100), 0.05, np.random.default_rng(0))
    x, R = robot.home_m, np.eye(3)
    state = fresh(robot.legs, 100)
    still, ahead = _after_calibration(robot, wires, state, x, R, np.array([0.0, 60.0, 600.0]))
    assert still.distance_m[:, 0].max() < 1e-9
    assert np.median(ahead.distance_m[:, 2]) < 0.4 * np.median(still.distance_m[:, 2])
    assert control.longest_interval(ahead, 1e-3) >= control.longest_interval(still, 1e-3)


def test_loaded_wires_drift_less_after_a_calibration():
    robot = schema.read_robot_file("linear-7")
    wires = draws.for_robot(robot, _line(20))
    x, R = robot.home_m, np.eye(3)
    tau = np.repeat(inverse.tensions(robot, x[None], R[None]).T, 20, 1)
    loaded = HoldCreep(wires, fresh(robot.legs, 20), tau).advance(3600.0, tau)
    times = np.array([0.0, 60.0])
    new, _ = _after_calibration(robot, wires, fresh(robot.legs, 20), x, R, times)
    old, _ = _after_calibration(robot, wires, loaded, x, R, times)
    assert old.distance_m[:, 0].max() < 1e-9
    assert np.median(old.distance_m[:, 1]) < 0.5 * np.median(new.distance_m[:, 1])


def test_longest_interval_reads_the_probability():
    distance = np.tile(np.array([0.0, 1.0, 2.0, 3.0]), (100, 1))
    distance[:10, 2] = 9.0  # a tenth is out at the third time
    times = np.array([0.0, 10.0, 20.0, 30.0])
    errors = control.PoseError(times, distance, 0 * distance, np.ones((100, 4), bool))
    assert control.longest_interval(errors, 5.0) == 10.0
    assert control.longest_interval(errors, 5.0, probability=0.85) == np.inf
    assert control.longest_interval(errors, 0.5) == 0.0
    lost = replace(errors, held=np.tile(np.arange(100) > 9, (4, 1)).T)
    assert control.longest_interval(lost, 50.0) == 0.0
    late = replace(errors, held=lost.held | (times < 15.0))  # what falls later was within before
    assert control.longest_interval(late, 50.0) == 10.0
    assert late.found.tolist() == lost.found.tolist()


def test_the_workspace_agrees_with_single_poses():
    robot = schema.read_robot_file("linear-6")
    wires = draws.for_robot(robot, _line(5))
    where = claim.grid(robot, (2, 1, 2))
    assert len(where) == 4
    all_at_once = claim.over_workspace(robot, wires, where)
    for p in range(4):
        one = claim.over_workspace(robot, wires, where[p : p + 1])
        np.testing.assert_allclose(all_at_once.distance_m[p], one.distance_m[0], rtol=1e-4)  # common steps
    assert all_at_once.feasible == 1.0
    loaded = claim.over_workspace(robot, wires, where, loaded_s=3600.0)
    assert (loaded.distance_m < all_at_once.distance_m).all()


def test_poses_out_of_reach_are_left_out_of_the_workspace():
    robot = schema.read_robot_file("linear-6")
    wires = draws.for_robot(robot, _line(2))
    out = claim.over_workspace(robot, wires, np.array([[0.0, 0.0, 0.6], [5.0, 0.0, 0.6]]))
    assert out.feasible == 0.5
    assert len(out.position_m) == 1
    assert len(claim.over_workspace(robot, wires, np.array([[5.0, 0.0, 0.6]])).position_m) == 0


def test_a_smaller_and_lighter_robot_is_the_same_robot():
    robot = schema.read_robot_file("linear-6")
    half = claim.scaled_robot(robot, 0.5, 0.6)
    tau = cases.tensions_at_home(robot)
    small = inverse.tensions(half, half.home_m[None], np.eye(3)[None])
    np.testing.assert_allclose(small, 0.5 * tau, rtol=1e-9)


def test_the_largest_mass_is_where_the_claim_stops_to_hold():
    robot, line = schema.read_robot_file("linear-6"), _line(8)
    mass = claim.largest_mass(robot, line, 1.0, steps=8)
    assert 1e-3 < mass < 1.0

    def holds(kilograms):
        other = claim.scaled_robot(robot, 1.0, kilograms)
        wires = draws.for_robot(other, line, 0.05, np.random.default_rng(1))
        out = claim.over_workspace(other, wires, claim.grid(other, (3, 3, 2)))
        return np.mean(out.holds() >= 0.95) >= 0.95

    assert holds(mass)
    assert not holds(1.1 * mass)
    assert claim.largest_mass(robot, line, 2.0, steps=8) < mass  # longer wires drift further


def test_shares_find_who_makes_the_variance():
    rng = np.random.default_rng(0)
    a, b, c = rng.normal(size=(3, 4000))
    found = shares({"a": a, "b": b, "c": c}, 3 * a + 1 * b)
    assert found["a"] == pytest.approx(0.9, abs=0.03)
    assert found["b"] == pytest.approx(0.1, abs=0.03)
    assert found["c"] == pytest.approx(0.0, abs=0.01)
    assert sum(found.values()) == pytest.approx(1.0)


def test_shares_split_what_two_parameters_share():
    rng = np.random.default_rng(1)
    a = rng.normal(size=5000)
    twin = a + 1e-3 * rng.normal(size=5000)
    found = shares({"a": a, "twin": twin}, a)
    assert found["a"] == pytest.approx(0.5, abs=0.02)
    assert found["twin"] == pytest.approx(0.5, abs=0.02)


def test_shares_of_a_certain_output_are_none():
    assert shares({"a": np.arange(5.0)}, np.ones(5)) == {"a": 0.0, "unexplained": 0.0}


@pytest.mark.parametrize(("limit_m", "looks"), [(1e-3, [3, 4]), (1.0, [4, 4])])
def test_a_pose_followed_until_it_leaves_its_limits_lasts_as_long_as_one_followed_to_the_end(limit_m, looks):
    robot = schema.read_robot_file("cogiro-desk")
    wires = draws.for_robot(robot, _line(20), 0.05, np.random.default_rng(0))
    at, state = (robot.home_m, np.eye(3)), fresh(robot.legs, 20)
    times = np.array([0.0, 10.0, 60.0, 600.0])
    schedules = control.calibrated_schedules(robot, wires, state, *at)
    whole = _after_calibration(robot, wires, state, *at, times)
    limits = control.Limits(*at, limit_m)
    for schedule, error, most in zip(schedules, whole, looks, strict=True):
        shares = []
        found = control.lasting_within(robot, wires, schedule, limits, times, state, shares.append)
        assert found.longest_s == control.longest_interval(error, limit_m)
        assert found.held == 1.0 and shares == sorted(shares) and shares[-1] == 1.0
        assert len(shares) == most


def test_a_hold_is_not_followed_when_too_many_platforms_have_fallen():
    robot = schema.read_robot_file("cogiro-desk")
    wires = draws.for_robot(robot, _line(20))
    joint = inverse.commands_at(robot, wires, robot.home_m, np.eye(3)).joint_m.copy()
    joint[:2] = np.nan  # a tenth has no pose at all
    limits = control.Limits(robot.home_m, np.eye(3), 1.0)
    times = np.array([0.0, 600.0])
    found = control.lasting_within(robot, wires, lambda time_s: joint, limits, times, fresh(robot.legs, 20))
    assert (found.longest_s, found.held) == (0.0, 0.9)
    walk = CreepingHold(robot, wires, joint, (robot.home_m, np.eye(3)), needed=0.95)
    walk.to(600.0)
    assert walk.creep.time_s == 0.0
    enough = CreepingHold(robot, wires, joint, (robot.home_m, np.eye(3)), needed=0.9)
    enough.to(600.0)
    assert enough.creep.time_s == 600.0


def test_wires_that_begin_to_pull_by_creep_that_decides_nothing_take_no_tiny_steps(monkeypatch):
    """Three of four wires hang loose, as by a bound of 0 N; what is left of the creep after an hour tightens them."""
    whole = schema.read_robot_file("hangprinter-4")
    robot = replace(whole, rule=replace(whole.rule, lowest_N=0.0))
    line = line_about(CORE | {"N": 0.75}, 0.05, 6)
    wires = draws.for_robot(robot, line, 0.05, np.random.default_rng(0))
    x, R = robot.home_m, np.eye(3)
    tau = np.repeat(inverse.tensions(robot, x[None], R[None]).T, 6, 1)
    loaded = HoldCreep(wires, fresh(robot.legs, 6), tau).advance(3600.0, tau)
    _, foreseen = control.calibrated_schedules(robot, wires, loaded, x, R)
    times = np.array([1.0, 10.0, 100.0, 2000.0])
    limits = control.Limits(x, R, 1e-3)
    found = []
    steps = []
    for unseen in (0.0, control._UNSEEN):
        monkeypatch.setattr(control, "_UNSEEN", unseen)
        tried = []
        monkeypatch.setattr(CreepingHold, "_try", counted(CreepingHold._try, tried))
        found.append(control.lasting_within(robot, wires, foreseen, limits, times, loaded))
        monkeypatch.undo()
        steps.append(len(tried))
    assert found[0] == found[1]
    assert steps[1] < steps[0] / 5


def counted(function, calls):
    def call(*arguments):
        calls.append(arguments)
        return function(*arguments)

    return call

"""A platform that topples from one stop to another: by a hair it slips and goes on, farther it falls.

Four upper wires carry a platform whose centre of mass lies above where it is held; it leans until two lower wires on
one side are taut. These are pulled in until it stands upright, and it topples to the other side. How far is what all
four lower wires are too long by.
"""

from pathlib import Path

import numpy as np
import pytest

from wirebayes.robot.mechanics import schema
from wirebayes.robot.mechanics.draws import WireDraws, for_robot
from wirebayes.robot.motion import control, inverse, outcome, path
from wirebayes.robot.motion.creeping_hold import CreepingHold

ROBOT = schema.read_robot_file(Path(__file__).parent / "field" / "zero-tension-stable" / "IPAnema_2.toml")
WIRE = {"k1": 9000.0, "B": 0.02, "U": 0.9, "k2": 0.02, "N": 0.6}
LOWER = ROBOT.exit_m[:, 2] < 2.0
UPRIGHT = ROBOT.home_m[None], np.eye(3)[None]


def _wires(**parameters):
    draws = {name: np.atleast_1d(value) for name, value in (WIRE | parameters).items()}
    return for_robot(ROBOT, WireDraws(draws, 1500.0))


def _leaning(loose_m):
    """The lower wires too long by so much: their lengths, and where the platform leans against two of them."""
    wires = _wires()
    commands = inverse.commands_at(ROBOT, wires, ROBOT.home_m, np.eye(3))
    loose = commands.zero_m + np.where(LOWER, loose_m, 0.0)
    return loose, commands.offset_m, path.at_rest(ROBOT, wires, (loose, commands.offset_m), UPRIGHT)


def _toppled(loose_m, slip=None):
    """Where a platform is followed to that topples from one pair of wires to the other, both too long by so much."""
    wires = _wires()
    loose, offset, leaning = _leaning(loose_m)
    taut = LOWER & (leaning.tension_N[0] > 0)
    assert leaning.found.all() and taut.sum() == 2
    before = loose - np.where(taut, 0.98 * loose_m, 0.0), offset
    after = loose - np.where(taut, 1.02 * loose_m, 0.0), offset
    start = path.follow(ROBOT, wires, leaning.poses, (loose, offset), before).here
    there = path.follow(ROBOT, wires, start.poses, before, after, slip=slip)
    other = LOWER & ~taut
    return there, other


def _turns_rad(loose_m):
    """How far it turns as it topples, from where it stands upright."""
    _, _, leaning = _leaning(loose_m)
    return float(np.linalg.norm(leaning.rotation[0] - np.eye(3)) / np.sqrt(2.0))


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_a_jump_is_a_fall_from_a_stated_size_on(share):
    _, limit_rad = path.slip_of(ROBOT, None)
    loose_m = share * limit_rad / _turns_rad(1e-5) * 1e-5  # how far it turns is in proportion
    there, other = _toppled(loose_m)
    if share > 1:
        assert there.here.status[0] == outcome.FELL
        assert there.drop_m[0] == pytest.approx(_shift_m(loose_m), rel=0.02)
    else:
        assert there.here.found.all() and there.share[0] == 1 and there.drop_m[0] == 0
        assert (there.here.tension_N[0, other] > 0).all()


def _shift_m(loose_m):
    """How far the platform moves aside as it topples, from where it stands upright."""
    _, _, leaning = _leaning(loose_m)
    return float(np.linalg.norm(leaning.position_m[0] - ROBOT.home_m))


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_a_tighter_tolerance_makes_a_fall_of_a_smaller_jump(share):
    loose_m = 1e-5
    tolerance_rad = _turns_rad(loose_m) / (0.1 * share)
    slip = control.largest_slip(1.0, tolerance_rad)
    there, _ = _toppled(loose_m, slip)
    assert (there.here.status[0] == outcome.FELL) == (share > 1)


def test_no_tolerance_makes_a_slip_of_a_long_jump():
    there, _ = _toppled(1e-3, control.largest_slip(1.0, 1.0))
    assert there.here.status[0] == outcome.FELL


def test_a_controller_that_takes_wires_for_stiffer_finds_the_platform_leaning():
    k1 = 9000.0 * (1.0 + np.linspace(-0.002, 0.002, 8))
    wires = _wires(k1=k1)
    schedule = control.hooke_only(ROBOT, wires, ROBOT.home_m, np.eye(3))
    error = control.error(ROBOT, wires, schedule, ROBOT.home_m, np.eye(3), np.array([0.0, 60.0]))
    assert error.held.all()
    leans = error.angle_rad[:, 0] > 1e-6
    np.testing.assert_array_equal(leans, k1 < 9000.0)


def test_platforms_that_topple_one_after_another_do_not_cut_all_into_short_steps(monkeypatch):
    tried = []
    step = CreepingHold._try

    def counted(walk, time, least):
        tried.append(time)
        return step(walk, time, least)

    monkeypatch.setattr(CreepingHold, "_try", counted)
    schedule = control.hooke_only(ROBOT, _wires(), ROBOT.home_m, np.eye(3))

    def steps(k1):
        tried.clear()
        error = control.error(ROBOT, _wires(k1=k1), schedule, ROBOT.home_m, np.eye(3), np.array([0.0, 3600.0]))
        assert error.held.all()
        return len(tried)

    stiffer = 9000.0 * (1.0 + np.linspace(0.0, 2e-3, 40))
    assert steps(stiffer) <= 2 * steps(stiffer[-1:])

"""Logs whose tensions nothing explains: another unit is refused, and a search for wires does not go astray."""

from dataclasses import replace

import numpy as np
import pytest

from tests.robot.test_unheld_home import six_wires
from wirebayes.errors import InputError
from wirebayes.robot.history.another_unit import refuse_another_unit
from wirebayes.robot.history.doubts import _contradicted
from wirebayes.robot.history.estimate import estimate_poses
from wirebayes.robot.history.history import History, with_payload
from wirebayes.robot.history.unknowns import LogUnknowns, Uncertain, unknowns
from wirebayes.robot.mechanics.draws import CORE, WireDraws, for_robot
from wirebayes.robot.motion import inverse

ROWS = 5
TYPICAL = {"k1": 15e3, "B": 0.05, "U": 0.9, "k2": 0.03, "N": 0.7}
ERRORS = Uncertain(reference_m=1e-4)


def _line(draws, sd=0.1):
    rng = np.random.default_rng(2)
    return WireDraws({k: v * np.exp(sd * rng.standard_normal(draws)) for k, v in TYPICAL.items()}, 1000.0)


@pytest.fixture(scope="module")
def log():
    """A platform on six wires that hardly creep, with twice its mass on it from the third row on."""
    robot, rng = six_wires(), np.random.default_rng(5)
    x = robot.home_m + rng.uniform(-0.1, 0.1, (ROWS, 3))
    turn = np.tile(np.eye(3), (ROWS, 1, 1))
    payload = robot.mass_kg * np.array([0.0, 0.0, 2.0, 2.0, 2.0])
    tau, joint = np.empty((ROWS, 6)), np.empty((ROWS, 6))
    for k in range(ROWS):
        loaded = with_payload(robot, float(payload[k]), robot.centre_of_mass_m)
        tau[k] = inverse.tensions(loaded, x[k : k + 1], turn[k : k + 1])[0]
        wires = for_robot(robot, _line(2, 0.0).centre())
        joint[k] = inverse.commands(loaded, wires, x[k : k + 1], turn[k : k + 1], tau[k : k + 1]).joint_m[0]
    times = 30.0 * np.arange(ROWS)
    centre = np.tile(robot.centre_of_mass_m, (ROWS, 1))
    return robot, History(times, joint, None, None, payload, centre, tension_N=tau), (x[0], np.eye(3))


def _refuse(log, change):
    robot, history, start = log
    read = replace(history, tension_N=change(history.tension_N.copy()))
    with np.errstate(all="ignore"):
        refuse_another_unit(robot, _line(4), read, start, ERRORS)


@pytest.mark.parametrize(("times", "refused"), [(1.0, False), (2.9, False), (3.1, True), (1 / 3.1, True), (-1.0, True)])
def test_tensions_of_a_log_in_another_unit_are_refused_by_the_weight_and_what_is_carried(log, times, refused):
    if not refused:
        _refuse(log, lambda tau: times * tau)
        return
    said = r"--joints, columns tension_1_N to tension_6_N: found tensions that are, all together, .* expected newtons"
    with pytest.raises(InputError, match=said):
        _refuse(log, lambda tau: times * tau)


def test_one_wire_alone_or_rows_that_were_not_read_say_nothing_of_the_unit(log):
    def one(tau):
        tau[:, 2] *= 102.0
        return tau

    def two_rows(tau):
        tau[2:, 0] = np.nan
        return 102.0 * tau

    _refuse(log, one)
    _refuse(log, two_rows)


@pytest.mark.parametrize("times", [102.0, 0.4])
def test_a_search_for_wires_that_explain_nonsense_ends_and_its_readings_are_not_used(log, times, monkeypatch):
    """A time was too short to be divided by, or wires crept by the tenth power of tension, for minutes."""
    robot, history, start = log
    differences = LogUnknowns.differences

    def within_reach(known, white):
        assert (np.abs(known.root @ white) <= known.reach * (1 + 1e-9)).all()
        return differences(known, white)

    monkeypatch.setattr(LogUnknowns, "differences", within_reach)
    read = replace(history, tension_N=history.tension_N * np.where(np.arange(6) == 2, times, 1.0))
    with np.errstate(all="ignore"):
        found = estimate_poses(robot, _line(20), read, start, ERRORS, np.random.default_rng(0))
    assert not found.converged and not found.used and found.effective == 0
    (notice,) = _contradicted(read, found, 20)
    assert notice.kind == "not-converged" and "check units and signs" in notice.text
    assert np.isfinite(found.track.position_m).all()


def test_wires_may_differ_by_a_factor_of_two_or_five_standard_deviations_and_lengths_by_anything():
    robot = six_wires()
    narrow, wide = (unknowns(robot, _line(40, sd), ERRORS, np.random.default_rng(0)) for sd in (0.01, 1.0))
    assert np.isinf(narrow.reach[:6]).all()
    np.testing.assert_allclose(narrow.reach[6:], np.log(2.0))
    sd = np.log(np.array([_line(40, 1.0).parameters[name] for name in CORE])).std(axis=1, ddof=1)
    np.testing.assert_allclose(wide.reach[6:11], 5.0 * sd)

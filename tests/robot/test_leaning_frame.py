"""Sessions of robots whose frame leans: the lean is found and named, and nothing else in its place."""

import re
from dataclasses import replace

import numpy as np
import pytest

from tests.robot.test_usable import _misfits, _read, _reported, _session
from wirebayes.robot.mechanics import rotation, schema
from wirebayes.robot.self_calibration import answer, faults
from wirebayes.robot.self_calibration.another_weight import OtherMass
from wirebayes.robot.self_calibration.equations import Noise, State
from wirebayes.robot.self_calibration.estimate import estimate
from wirebayes.robot.self_calibration.holds_creep import creep_of
from wirebayes.robot.self_calibration.leaning_frame import Lean, LeaningFrame
from wirebayes.robot.self_calibration.linearisation import linearised
from wirebayes.robot.self_calibration.one_cause import explained_by
from wirebayes.robot.self_calibration.posterior import RobotPosterior
from wirebayes.robot.self_calibration.unknowns import StatedErrors, Unknowns

NAMED = (
    r"a frame that leans by (\S+) \+- (\S+) degrees would explain what contradicts, and gravity points along \((.*)\)"
)


def _read_leaning(seed, lean_rad):
    """A session that a robot read whose exit points, and the poses that it was sent to, are turned."""
    robot, prior, session, rng = _session(seed, sd=0.005)
    turn = rotation.matrix(np.append(lean_rad, 0.0))
    real = replace(robot, exit_m=robot.exit_m @ turn.T)
    sent = replace(session, position_m=session.position_m @ turn.T, rotation=turn @ session.rotation)
    return robot, prior, session, _read(real, prior, sent, rng)


@pytest.mark.parametrize(("seed", "lean_rad"), [(0, [0.03, 0.02]), (2, [-0.05, 0.06])])
def test_a_frame_that_leans_is_named_in_place_of_all_sensors(seed, lean_rad):
    texts = _misfits(_reported(*_read_leaning(seed, lean_rad)))
    found = [re.match(NAMED, text) for text in texts]
    lean, sd, gravity = next(one.groups() for one in found if one)
    assert abs(float(lean) - np.degrees(np.hypot(*lean_rad))) < 4 * float(sd) < 1.0
    down = -rotation.matrix(np.append(lean_rad, 0.0))[2]  # a frame sees the world's vertical turned back
    np.testing.assert_allclose([float(part) for part in gravity.split(",")], down, atol=4 * np.radians(float(sd)))
    assert not any("tension sensor" in text or "a platform of" in text for text in texts)


@pytest.mark.parametrize("times", [1.1, 0.8])
def test_another_mass_is_not_taken_for_a_lean(times):
    robot, prior, session, rng = _session(2, sd=0.005)
    readings = _read(robot, prior, session, rng)
    weighed = replace(robot, mass_kg=times * robot.mass_kg)
    assert not any(re.match(NAMED, text) for text in _misfits(_reported(weighed, prior, session, readings)))


@pytest.mark.parametrize("name", ["cogiro-desk", "hangprinter-4", "sled-4"])
def test_residuals_follow_a_lean_as_its_slopes_say(name):
    rng = np.random.default_rng(1)
    _, prior, _, _ = _session(0)
    robot = schema.read_robot_file(name)
    unknowns = Unknowns(robot, replace(prior, creeps=False), StatedErrors(exit_m=0.01, pose_m=0.01))
    position = robot.home_m + 0.01 * rng.standard_normal((3, 3))
    turns = rotation.matrix(robot.home_rotation_rad + 0.01 * rng.standard_normal((3, 3)) * (robot.degrees == 6))
    pull = rng.uniform(1.0, 5.0, (3, robot.legs))
    session = replace(
        _session(0)[2],
        position_m=position + 0.001,
        rotation=turns,
        joint_m=np.ones((3, robot.legs)),
        duration_s=np.full(3, 10.0),
        read=np.ones(3, bool),
    )
    holds = answer.holds_of(robot, session, pull.ravel() / session.tension_sd_N)
    state = State(0.1 * rng.standard_normal(unknowns.count), position, turns, pull)
    noise = Noise(1e-3, 1e-3, 1.0, 1.0, 1e-3)
    found = _about(unknowns, holds, noise, state)
    by = np.array([2e-6, -3e-6])
    ahead = _about(*_put(Lean().changed(found, holds, by), noise))
    back = rotation.matrix(np.append(-by, 0.0))
    balance = found.equations.rows["balance"]
    seen = ahead.equations.residual
    seen[:, balance] = (seen[:, balance].reshape(3, -1, 3) @ back.T).reshape(3, -1)
    foreseen = found.equations.residual + Lean().slopes(found) @ by
    np.testing.assert_allclose(seen[:, balance], foreseen[:, balance], atol=1e-6 * abs(foreseen[:, balance]).max())
    loop = found.equations.rows["loop"]
    np.testing.assert_allclose(seen[:, loop], foreseen[:, loop], rtol=1e-9)
    pose = found.equations.rows["pose"]
    np.testing.assert_allclose((seen[:, pose] ** 2).sum(1), (foreseen[:, pose] ** 2).sum(1), rtol=1e-9)


def _put(changed, noise):
    unknowns, holds, state = changed
    return unknowns, holds, noise, state


def _about(unknowns, holds, noise, state):
    """What a posterior says of its state, without the search."""
    equations = linearised(unknowns, holds, noise, state, creep_of(unknowns, holds, state), state)
    none = np.empty(0)
    return RobotPosterior(unknowns, state, none, none, none, equations, noise, np.inf, None, True, 0.0, none)


def test_what_is_far_less_likely_is_not_named_beside_the_likeliest():
    lean = LeaningFrame(np.array([0.0, 0.0, -1.0]), 0.03, 0.001, evidence=100.0)
    for evidence, named in ((90.0, [False, True]), (97.0, [True, True]), (110.0, [True, False])):
        mass = OtherMass(2.1, 0.01, 2.0, evidence)
        texts = [one.text for one in faults.fault_notices([mass, lean], None)]
        assert [any(text.startswith(start) for text in texts) for start in ("a platform of", "a frame")] == named
    assert faults.fault_notices([], None) == []


def test_the_error_of_the_loops_stays_as_it_was_found_so_that_likelihoods_compare_with_those_of_sensors():
    robot, prior, session, readings = _read_leaning(0, [0.03, 0.02])
    holds = answer.holds_of(robot, session, readings)
    unknowns = Unknowns(robot, prior, StatedErrors(exit_m=1e-4 * robot.span_m, pose_m=1e-2 * robot.span_m))
    start = State(np.zeros(unknowns.count), session.position_m, session.rotation, holds.tension_N)
    found = estimate(unknowns, holds, start)
    fitted = []

    class Recorded(Lean):
        def changed(self, found, holds, by):
            fitted.append(found.unknowns.errors.joint_m)
            return super().changed(found, holds, by)

    explained_by(Recorded(), found, holds)
    assert unknowns.errors.joint_m is None
    assert fitted
    assert set(fitted) == {found.noise.joint_m}

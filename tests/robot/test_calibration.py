from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from analyses.robots.calibration import stand_in
from tests.robot import cases
from tests.robot.found_lengths import found_lengths
from wirebayes.robot.mechanics import draws, rotation, schema
from wirebayes.robot.motion import forward, inverse
from wirebayes.robot.self_calibration import identified, observability
from wirebayes.robot.self_calibration.answer import joint_values_to
from wirebayes.robot.self_calibration.estimate import _before_reading, with_levels
from wirebayes.robot.self_calibration.predicted import predict_session
from wirebayes.robot.self_calibration.residuals import misfit
from wirebayes.robot.self_calibration.session import LengthPrior, Session
from wirebayes.robot.self_calibration.summary import summarised
from wirebayes.robot.self_calibration.unknowns import StatedErrors, Unknowns


def _line(count=300):
    return stand_in(np.random.default_rng(1), count)


def _session(robot, line, poses, rng, tilt_sd=None):
    mean = draws.for_robot(robot, line.centre())
    x = np.vstack([robot.home_m, rng.uniform(robot.lower_m, robot.upper_m, (4 * poses, 3))])
    R = rotation.matrix(0.1 * rng.normal(size=x.shape) * (robot.degrees == 6))
    tau = inverse.tensions(robot, x, R)
    good = np.flatnonzero(np.isfinite(tau).all(1))[: poses + 1]
    commands = inverse.commands(robot, mean, x[good], R[good], tau[good])
    duration, read = np.full(poses + 1, 30.0), np.ones(poses + 1, bool)
    duration[0], read[0] = 600.0, False
    return Session(x[good], R[good], commands.joint_m, duration, read, 0.02, tilt_sd)


def test_sensitivity_is_the_derivative_of_the_equilibrium():
    robot = schema.read_robot_file("linear-7")
    rng = np.random.default_rng(0)
    session = _session(robot, _line(), 4, rng)
    wires = draws.for_robot(robot, _line().centre())
    zero, offset = inverse.lengths(robot, session.joint_m)
    at = forward.solve_equilibrium(robot, wires, zero, offset, session.position_m, session.rotation)
    motion, change = observability.length_sensitivity(robot, wires, at.position_m, at.rotation, zero, offset)
    h = 1e-6
    for i in range(robot.legs):
        step = h * np.eye(robot.legs)[i]
        up = forward.solve_equilibrium(robot, wires, zero + step, offset, at.position_m, at.rotation)
        down = forward.solve_equilibrium(robot, wires, zero - step, offset, at.position_m, at.rotation)
        pull = (up.tension_N - down.tension_N) / (2 * h)
        np.testing.assert_allclose(change[:, :, i], pull, atol=1e-4 * np.abs(change).max())
        shift = (up.position_m - down.position_m) / (2 * h)
        np.testing.assert_allclose(motion[:, :3, i], shift, atol=1e-5 * np.abs(motion[:, :3]).max())


@pytest.mark.parametrize("rolling", [False, True])
def test_exact_readings_bring_back_the_lengths(rolling):
    robot = schema.read_robot_file("segesta-8")
    if rolling:
        robot = cases.with_pulleys(robot, np.random.default_rng(0))
    rng = np.random.default_rng(2)
    line = _line()
    session = replace(_session(robot, line, 5, rng), tension_sd_N=1e-4)
    prior = LengthPrior(line, 5e-3, spread=1e-6)
    truth = prior.moments(robot.legs)[0][None].copy()
    truth[:, : robot.legs] = 5e-3 * rng.normal(size=(1, robot.legs))
    real = predict_session(robot, prior, session, truth)
    found = found_lengths(robot, prior, session, real.readings[0])
    assert found.converged
    np.testing.assert_allclose(summarised(found).length_m.mean, real.length_m[0], atol=5e-6)
    np.testing.assert_allclose(found.state.position_m[-1], real.position_m[0, -1], atol=5e-6)


def test_slack_wires_do_not_mislead_the_calibration():
    robot = schema.read_robot_file("cogiro-desk")
    rng = np.random.default_rng(3)
    line = _line()
    session = _session(robot, line, 6, rng)
    prior = LengthPrior(line, 14e-3, spread=1e-6)
    truth = np.tile(prior.moments(robot.legs)[0], (4, 1))
    truth[:, : robot.legs] = 14e-3 * rng.normal(size=(4, robot.legs))
    real = predict_session(robot, prior, session, truth)
    first = int(np.flatnonzero((real.readings == 0).any(1))[0])
    found = found_lengths(robot, prior, session, real.readings[first])
    assert found.converged
    # without noise only the prior's pull remains, a fraction of the standard error
    length = summarised(found).length_m
    assert (np.abs(length.mean - real.length_m[first]) < length.sd).all()


@pytest.mark.parametrize("moving", [False, True])
def test_biases_of_the_sensors_are_estimated_where_a_prior_allows_them(moving):
    robot, rng, line = schema.read_robot_file("hangprinter-4"), np.random.default_rng(8), _line()
    session = _session(robot, line, 10, rng)
    if moving:
        session = replace(session, motion=rng.choice([-1.0, 1.0], session.joint_m.shape))
    prior = LengthPrior(line, 3e-3, spread=0.01, bias_sd_N=0.3)
    mean, cov = prior.moments(robot.legs)
    truth = rng.multivariate_normal(mean, cov, 6)
    bias = truth[:, -robot.legs :]
    real = predict_session(robot, prior, session, truth)
    still = predict_session(robot, replace(prior, bias_sd_N=0.0), session, truth[:, : -robot.legs])
    off = (real.readings - still.readings).reshape(6, -1, robot.legs) * session.tension_sd_N
    np.testing.assert_allclose(off, bias[:, None] * session.signs[session.read], atol=1e-9)
    readings = real.readings + rng.normal(size=real.readings.shape)
    deviations, sds, held, sure, blind_sure = [], [], [], [], []
    for k, read in enumerate(readings):
        found = found_lengths(robot, prior, session, read)
        known = summarised(found)
        assert found.converged
        deviations.append((known.bias_N.mean - bias[k]) / known.bias_N.sd)
        sds.append(known.bias_N.sd)
        off_m = np.abs(known.length_m.mean - real.length_m[k])
        held.append(off_m <= known.length_m.half * known.length_m.sd)
        sure.append((misfit(found), off_m.mean()))
        if k > 1:
            continue
        blind = found_lengths(robot, replace(prior, bias_sd_N=0.0), session, read)
        blind_sure.append((misfit(blind), np.abs(summarised(blind).length_m.mean - real.length_m[k]).mean()))
    assert 0.6 < np.mean(np.square(deviations)) < 1.6
    assert np.mean(sds) < 0.15  # half of what was known before
    assert np.mean(held) > 0.75
    known_misfit, off_m = np.array(sure).T
    blind_misfit, blind_off_m = np.array(blind_sure).T
    assert np.median(blind_misfit) > 10 * np.median(known_misfit)
    assert blind_off_m.mean() > 1.5 * off_m[:2].mean()


@pytest.mark.slow
@pytest.mark.statistical
def test_intervals_cover_and_hooke_alone_does_not():
    robot = schema.read_robot_file("segesta-8")
    robot = replace(robot, rule=replace(robot.rule, lowest_N=2.5))  # well taut, as one would calibrate
    rng = np.random.default_rng(4)
    line = _line()
    session = _session(robot, line, 6, rng)
    prior = LengthPrior(line, 5e-3, spread=0.05)
    mean, cov = prior.moments(robot.legs)
    truth = rng.multivariate_normal(mean, cov, 40)
    real = predict_session(robot, prior, session, truth)
    readings = np.maximum(real.readings + rng.normal(size=real.readings.shape), 0)
    covered, error, apart_m = {True: [], False: []}, {True: [], False: []}, []
    for k, read in enumerate(readings):
        for creeps in (True, False):
            found = found_lengths(robot, replace(prior, creeps=creeps), session, read)
            length = summarised(found).length_m
            off_m = np.abs(length.mean - real.length_m[k])
            covered[creeps].append(off_m <= length.half * length.sd)
            error[creeps].append(off_m.mean())
            if creeps:
                assert found.converged
                apart_m.append(_led_home(robot, prior, truth[k], real.creep[k], found))
    # 320 intervals, the 8 of a robot correlated: twenty repeats of this test scatter by 0.02
    assert 0.83 < np.mean(covered[True]) < 0.97
    assert np.mean(covered[False]) < 0.5
    assert np.mean(error[False]) > 2 * np.mean(error[True])
    assert np.median(apart_m) < 5e-4


def _led_home(robot, prior, truth, creep, found):
    """How far from home a true robot ends up when told the joint values that a calibration gives, m."""
    home = robot.home_m, rotation.matrix(robot.home_rotation_rad)
    joint = joint_values_to(found, *home)
    wires, reference = prior.wires(robot, truth[None])
    bare, offset = inverse.lengths(robot, joint[None])
    there = forward.solve_equilibrium(robot, wires, (bare + reference) * (1 + creep), offset, *home)
    return float(np.linalg.norm(there.position_m[0] - robot.home_m))


def test_an_inclinometer_helps():
    robot = schema.read_robot_file("linear-7")
    line = _line()
    prior = LengthPrior(line, 5e-3)
    sd = []
    for tilt in (None, 1e-4):
        session = _session(robot, line, 5, np.random.default_rng(6), tilt)
        real = predict_session(robot, prior, session, prior.moments(robot.legs)[0][None])
        found = found_lengths(robot, prior, session, real.readings[0])
        sd.append(summarised(found).length_m.sd.mean())
    assert sd[1] < 0.95 * sd[0]


def test_the_combination_that_is_known_least_is_named():
    """Wires 1 and 3 of four against each other: of what was known before, all but a tenth of the rest is gone."""
    hidden = np.array([1.0, 0.0, -1.0, 0.0]) / np.sqrt(2)
    at = slice(2, 6)
    covariance = np.eye(6)
    covariance[at, at] = 0.1**2 * np.eye(4) + (0.8**2 - 0.1**2) * np.outer(hidden, hidden)
    prior = SimpleNamespace(reference_sd_m=5e-3)
    found = SimpleNamespace(covariance=covariance, unknowns=SimpleNamespace(references=at, prior=prior))
    weakest, sd_m = identified._weakest(found)
    np.testing.assert_allclose(np.abs(weakest @ hidden), 1.0)
    assert weakest.max() > 0 and sd_m == pytest.approx(0.8 * 5e-3)
    said = identified.weakest_in_words(weakest, sd_m)
    assert "of wire 1" in said and "of wire 3" in said and "known to 4 mm" in said
    assert "wire 2" not in said and "wire 4" not in said


@pytest.mark.parametrize("read", [True, False])
def test_tensions_that_nobody_read_follow_from_exact_lengths_where_others_were_read(read):
    """Else each of them is thought to lie in the range of the robot's file."""
    robot, line = schema.read_robot_file("hangprinter-4"), _line()
    unknowns = Unknowns(robot, LengthPrior(line, 5e-3), StatedErrors(joint_m=0.0))
    tension = np.full((3, robot.legs), np.nan)
    if read:
        tension[1:] = 5.0
    session = SimpleNamespace(tension_sd_N=0.02)
    holds = SimpleNamespace(tension_N=tension, session=session)
    assert (with_levels(unknowns, holds) is unknowns) is read
    range_N = robot.rule.highest_N - robot.rule.lowest_N
    assert (_before_reading(unknowns, holds).pull_N > 1e3 * range_N) is read
    rough = replace(unknowns, errors=StatedErrors())
    assert with_levels(rough, holds).errors.level_N > 0
    assert _before_reading(rough, holds).pull_N < range_N

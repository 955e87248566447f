from dataclasses import replace

import numpy as np
import pytest

from analyses.robots.calibration import stand_in
from tests.robot import cases
from wirebayes.robot.mechanics import draws, rotation, schema
from wirebayes.robot.motion import forward, inverse
from wirebayes.robot.self_calibration import observability
from wirebayes.robot.self_calibration.estimate import corrected_joints, length_posterior
from wirebayes.robot.self_calibration.predicted import predict_session
from wirebayes.robot.self_calibration.session import LengthPrior, Session
from wirebayes.robot.self_calibration.start import starting_references


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
    mean, _ = prior.moments(robot.legs)
    truth = mean[None].copy()
    truth[:, : robot.legs] = 5e-3 * rng.normal(size=(1, robot.legs))
    real = predict_session(robot, prior, session, truth)
    known = length_posterior(robot, prior, session, real.readings)
    assert known.converged.all()
    np.testing.assert_allclose(known.length_m, real.length_m, atol=5e-6)
    np.testing.assert_allclose(known.position_m, real.position_m[:, -1], atol=5e-6)


def test_slack_wires_do_not_mislead_the_calibration():
    robot = schema.read_robot_file("cogiro-desk")
    rng = np.random.default_rng(3)
    line = _line()
    session = _session(robot, line, 6, rng)
    prior = LengthPrior(line, 14e-3, spread=1e-6)
    mean, _ = prior.moments(robot.legs)
    truth = np.tile(mean, (4, 1))
    truth[:, : robot.legs] = 14e-3 * rng.normal(size=(4, robot.legs))
    real = predict_session(robot, prior, session, truth)
    slack = (real.readings == 0).any(1)
    assert slack.any()
    guess = starting_references(robot, prior, session, real.readings)
    assert np.abs(guess - truth[:, : robot.legs]).mean() < 0.25 * np.abs(truth[:, : robot.legs]).mean()
    known = length_posterior(robot, prior, session, real.readings[slack][:1])
    assert known.converged.all()
    # without noise only the prior's pull remains, a fraction of the standard error
    assert (np.abs(known.length_m - real.length_m[slack][:1]) < known.length_sd_m).all()


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
    np.testing.assert_allclose(off, bias[:, None] * session.bias_sign, atol=1e-9)
    readings = real.readings + rng.normal(size=real.readings.shape)
    known = length_posterior(robot, prior, session, readings)
    estimated = known.unknowns[:, -robot.legs :]
    sd = np.sqrt(np.einsum("mdd->md", known.covariance))[:, -robot.legs :]
    assert known.converged.all()
    assert 0.6 < np.mean(((estimated - bias) / sd) ** 2) < 1.6
    assert sd.mean() < 0.15  # half of what was known before
    low, high = known.interval(0.9)
    assert ((low <= real.length_m) & (real.length_m <= high)).mean() > 0.75
    blind = length_posterior(robot, replace(prior, bias_sd_N=0.0), session, readings)
    assert np.median(blind.misfit) > 10 * np.median(known.misfit)
    wrong = np.abs(blind.length_m - real.length_m).mean()
    assert wrong > 1.5 * np.abs(known.length_m - real.length_m).mean()


def test_a_bias_hides_what_readings_show():
    rng = np.random.default_rng(1)
    change, sign = 1e3 * rng.normal(size=(5, 4, 4)), rng.choice([-1.0, 1.0], (5, 4))
    seen = observability.observe(change, 0.01, 5e-3, 0.2, sign)
    # beside the formula: lengths and biases as one linear problem
    rows = np.concatenate([change, sign[:, :, None] * np.eye(4)], 2).reshape(-1, 8) / 0.01
    both = rows.T @ rows + np.diag([1 / 5e-3**2] * 4 + [1 / 0.2**2] * 4)
    np.testing.assert_allclose(seen.sd_m, np.sqrt(np.diag(np.linalg.inv(both)))[:4], rtol=1e-6)
    assert (seen.sd_m > observability.observe(change, 0.01, 5e-3).sd_m).all()


@pytest.mark.slow
@pytest.mark.statistical
def test_intervals_cover_and_hooke_alone_does_not():
    robot = schema.read_robot_file("segesta-8")
    # well taut, as one would calibrate: on the edge of slackness a mode need not have zero slope
    robot = replace(robot, rule=replace(robot.rule, lowest_N=2.5))
    rng = np.random.default_rng(4)
    line = _line()
    session = _session(robot, line, 6, rng)
    prior = LengthPrior(line, 5e-3, spread=0.05)
    mean, cov = prior.moments(robot.legs)
    truth = rng.multivariate_normal(mean, cov, 40)
    real = predict_session(robot, prior, session, truth)
    readings = np.maximum(real.readings + rng.normal(size=real.readings.shape), 0)
    covered, error = {}, {}
    for creeps in (True, False):
        known = length_posterior(robot, replace(prior, creeps=creeps), session, readings)
        low, high = known.interval(0.9)
        covered[creeps] = ((low <= real.length_m) & (real.length_m <= high)).mean()
        error[creeps] = np.abs(known.length_m - real.length_m).mean()
        if creeps:
            assert known.converged.all()
            x = robot.home_m + 0.05
            joint = corrected_joints(robot, prior, known, x, np.eye(3))
            wires, reference = prior.wires(robot, truth)
            bare, offset = inverse.lengths(robot, joint)
            there = forward.solve_equilibrium(robot, wires, (bare + reference) * (1 + real.creep), offset, x, np.eye(3))
            assert np.median(np.linalg.norm(there.position_m - x, axis=1)) < 5e-4
    # 320 intervals, the 8 of a robot correlated: twenty repeats of this test scatter by 0.02
    assert 0.83 < covered[True] < 0.97
    assert covered[False] < 0.5
    assert error[False] > 2 * error[True]


def test_an_inclinometer_helps():
    robot = schema.read_robot_file("linear-7")
    line = _line()
    prior = LengthPrior(line, 5e-3)
    sd = []
    for tilt in (None, 1e-4):
        session = _session(robot, line, 5, np.random.default_rng(6), tilt)
        mean, _ = prior.moments(robot.legs)
        real = predict_session(robot, prior, session, mean[None])
        known = length_posterior(robot, prior, session, real.readings)
        sd.append(known.length_sd_m.mean())
    assert sd[1] < 0.95 * sd[0]


def test_observability_names_what_cannot_be_seen():
    rng = np.random.default_rng(0)
    hidden = np.array([1.0, -1.0, 0.0, 0.0]) / np.sqrt(2)
    change = rng.normal(size=(3, 4, 4)) @ (np.eye(4) - np.outer(hidden, hidden)) * 1e3
    seen = observability.observe(change, 0.01, 5e-3)
    assert seen.rank == 3
    assert abs(seen.weakest @ hidden) == pytest.approx(1.0)
    assert "3 of 4" in seen.sentence
    assert "wire 1" in seen.sentence
    assert "wire 2" in seen.sentence
    assert "wire 3" not in seen.sentence


def test_chosen_poses_say_more_than_the_first_ones():
    robot = schema.read_robot_file("cogiro-desk")
    rng = np.random.default_rng(9)
    wires = draws.for_robot(robot, _line().centre())
    x = rng.uniform(robot.lower_m, robot.upper_m, (60, 3))
    R = rotation.matrix(0.1 * rng.normal(size=x.shape))
    tau = inverse.tensions(robot, x, R)
    commands = inverse.commands(robot, wires, x, R, tau)
    change = observability.length_sensitivity(robot, wires, x, R, commands.zero_m, commands.offset_m)[1]
    pick = observability.choose_poses(change, 6, 0.02, 5e-3)
    chosen, first = (observability.observe(change[i], 0.02, 5e-3).sd_m.mean() for i in (pick, list(range(6))))
    assert chosen < 0.8 * first


def test_absurd_information_stops_nobody() -> None:
    """Of 1e40 in one combination, beside a prior's 1e4: their sum has no inverse in floating point."""
    change = 1e20 * np.ones((1, 3, 3))
    with pytest.raises(np.linalg.LinAlgError):
        np.linalg.inv(change[0].T @ change[0] + np.eye(3) / 0.01**2)
    sd = observability.observe(change, 1.0, 0.01).sd_m
    assert np.isfinite(sd).all() and (sd <= 0.01).all()


def test_the_uncertainty_of_lengths_is_that_of_information_and_prior_together() -> None:
    change = np.random.default_rng(0).normal(size=(5, 4, 4)) * 1e3
    information = np.einsum("pij,pik->jk", change, change) / 0.5**2
    expected = np.sqrt(np.diag(np.linalg.inv(information + np.eye(4) / 0.002**2)))
    assert observability.observe(change, 0.5, 0.002).sd_m == pytest.approx(expected, rel=1e-9)

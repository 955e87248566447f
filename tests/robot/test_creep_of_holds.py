"""Creep within a hold, computed from tensions at its end, against the session solved step by step."""

import numpy as np
import pytest

from tests.robot.test_usable import _session
from wirebayes.robot.self_calibration.equations import Holds, Noise, State, linearised
from wirebayes.robot.self_calibration.holds_creep import creep_of
from wirebayes.robot.self_calibration.session import predict
from wirebayes.robot.self_calibration.unknowns import StatedErrors, Unknowns


@pytest.mark.parametrize("seed", range(2))
def test_the_true_state_closes_its_loops(seed):
    robot, prior, session, rng = _session(seed)
    mean, covariance = prior.moments(robot.legs)
    values = rng.multivariate_normal(mean, covariance, 1)
    real = predict(robot, prior, session, values)
    assert real.solved.all()
    pull_N = real.readings.reshape(session.joint_m.shape) * session.tension_sd_N
    holds = Holds(session, pull_N)

    unknowns = Unknowns(robot, prior, StatedErrors())
    mean, root = unknowns.moments
    state = State(np.linalg.solve(root, values[0] - mean), real.position_m[0], real.rotation[0], pull_N)
    noise = Noise(1.0, 1.0, 1.0, 0.0, 1e-9 * pull_N.max())
    e = linearised(unknowns, holds, noise, state, creep_of(unknowns, holds, state), state)
    left = e.residual[:, e.rows["loop"]][pull_N > 0]  # a slack wire has a gap
    assert np.sqrt(np.mean(left**2)) < 1.5e-7 * robot.span_m

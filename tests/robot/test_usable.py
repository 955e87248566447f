"""When lengths of a calibration may be set: the joint test at its threshold, and drawn robots with wrong anchors."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.robot import drawn
from tests.robot.cases import session_header
from wirebayes.errors import InputError
from wirebayes.robot.mechanics import draws
from wirebayes.robot.mechanics.rotation import vector
from wirebayes.robot.motion import inverse
from wirebayes.robot.self_calibration import answer, session_file
from wirebayes.robot.self_calibration.estimate import length_posterior
from wirebayes.robot.self_calibration.predicted import predict_session
from wirebayes.robot.self_calibration.session import LengthPrior, Session
from wirebayes.robot.self_calibration.trust import joint_test
from wirebayes.strict.table import csv_table

SPREAD = 1e-3  # from wire to wire: small, so that a session of eight stops is solved in a moment


def _session(seed, sd=0.02):
    """A session of a drawn robot and its prior; tensions are read to a share of their largest."""
    rng = np.random.default_rng(seed)
    one = drawn.draw(str(rng.choice(["point-4", "point-5", "body-7", "body-8"])), rng, count=40, sd=0.01)
    robot = one.robot
    x = rng.uniform(robot.lower_m, robot.upper_m, (60, 3))
    R = np.broadcast_to(np.eye(3), (60, 3, 3))
    tau = inverse.tensions(robot, x, R)
    good = np.flatnonzero(np.isfinite(tau).all(1))[:8]
    joint = inverse.commands(robot, draws.for_robot(robot, one.line.centre()), x[good], R[good], tau[good]).joint_m
    held = np.full(len(good), 30.0)
    error = sd * float(tau[good].max())
    session = Session(x[good], R[good], joint, held, np.ones(len(good), bool), error)
    return robot, LengthPrior(one.line, 1e-3 * robot.span_m, SPREAD), session, rng


def _read(robot, prior, session, rng):
    mean, cov = prior.moments(robot.legs)
    real = predict_session(robot, prior, session, rng.multivariate_normal(mean, cov, 1))
    assert real.solved.all()
    return np.maximum(real.readings + rng.standard_normal(real.readings.shape), 0.0)


@pytest.mark.parametrize("seed", range(3))
def test_a_session_with_nothing_wrong_is_usable(seed):
    robot, prior, session, rng = _session(seed)
    known = length_posterior(robot, prior, session, _read(robot, prior, session, rng))
    assert answer.usable(known)


@pytest.mark.parametrize("seed", range(3))
def test_wrong_anchors_held_exact_are_not(seed):
    robot, prior, session, rng = _session(seed, sd=0.002)
    other = replace(robot, exit_m=robot.exit_m + 0.01 * robot.span_m * rng.standard_normal(robot.exit_m.shape))
    known = length_posterior(robot, prior, session, _read(other, prior, session, rng))
    assert not answer.usable(known)


def test_the_verdict_turns_at_its_threshold():
    robot, prior, session, rng = _session(0)
    known = length_posterior(robot, prior, session, _read(robot, prior, session, rng))
    for p, good in ((0.0101, True), (0.0099, False), (np.nan, False)):
        one = replace(known, p_joint=np.array([p]))
        assert answer.usable(one) is good
        assert bool(answer._unsure(one, known)) is not good
    astray = replace(known, converged=np.array([False]))
    assert not answer.usable(astray)
    assert "do not use" in answer._unsure(astray, known)[0].text
    # lengths that ignore creep are for comparison only
    (notice,) = answer._unsure(known, astray)
    assert notice.kind == "not-converged" and "do not use" not in notice.text


def test_the_joint_test_keeps_its_level_and_sees_each_part():
    """Of a linear problem, whose sum of squares is known in full."""
    rng = np.random.default_rng(4)
    legs, count, many = 4, 40, 4000
    J = rng.standard_normal((count, 9))
    spread = np.linalg.inv(J.T @ J + np.eye(9))

    def p_of(truth, noise):
        readings = truth @ J.T + noise
        mode = readings @ J @ spread
        cost = ((readings - mode @ J.T) ** 2).sum(1) + (mode**2).sum(1)
        return joint_test(cost, count, mode, np.broadcast_to(spread, (many, 9, 9)), legs)

    truth, noise = rng.standard_normal((many, 9)), rng.standard_normal((many, count))
    level = (p_of(truth, noise) < 0.01).mean()
    assert 0.004 < level < 0.014  # two tests that are not independent: at most a hundredth
    moved = truth + np.array([5.0, 5.0, 0, 0, 0, 0, 0, 0, 0])
    assert (p_of(moved, noise) < 0.01).mean() > 0.95  # references beyond their prior, residuals as expected
    assert (p_of(truth, 2.0 * noise) < 0.01).mean() > 0.95


def test_millimetres_and_straight_lengths_are_refused_with_their_place(tmp_path):
    for seed in range(2):
        robot, _, session, _ = _session(seed)
        robot = replace(robot, lines=np.full(robot.legs, 3.0))
        rows = [
            [i + 1, *x, *vector(R[None])[0], 60.0, *joint, *np.ones(robot.legs)]
            for i, (x, R, joint) in enumerate(zip(session.position_m, session.rotation, session.joint_m, strict=True))
        ]
        straight = session.joint_m[0] - robot.beyond_m
        for scale, reason in ((1e3, "metres, at most"), (1.0, "whole wire")):
            if scale == 1.0 and robot.beyond_m.any():
                continue
            changed = [[*row[:8], *(scale * straight), *row[8 + robot.legs :]] for row in rows]
            text = "\n".join([",".join(session_header(robot)), *(",".join(map(str, r)) for r in changed)])
            with pytest.raises(InputError, match=rf"line 2, column \d+ \(joint_\d_m\): found .*, expected .*{reason}"):
                session_file.parse_session(csv_table(Path("session.csv"), text), robot, 0.02, 1e-3)

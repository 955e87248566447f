"""Tensions that nobody read: what is usual is said of internal tension, and little of what carries the platform."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import chi2

from tests.robot import drawn
from wirebayes.robot.mechanics import rotation as turns
from wirebayes.robot.self_calibration.equations import Holds, Noise, State
from wirebayes.robot.self_calibration.holds_creep import creep_of
from wirebayes.robot.self_calibration.internal_tensions import _CARRIED
from wirebayes.robot.self_calibration.linearisation import linearised
from wirebayes.robot.self_calibration.residuals import _outside_range
from wirebayes.robot.self_calibration.session import LengthPrior, Session
from wirebayes.robot.self_calibration.unknowns import StatedErrors, Unknowns

STOPS = 2


class _Robot:
    """A drawn robot at two poses, of whose tensions the first wire's alone was read, in the first hold."""

    def __init__(self, kind):
        rng = np.random.default_rng(3)
        made = drawn.draw(kind, rng)
        self.robot = robot = made.robot
        span, legs = robot.span_m, robot.legs
        prior = LengthPrior(made.line, 1e-3 * span)
        errors = StatedErrors(exit_m=0.01 * span, platform_m=0.01 * span, level_N=2.0)
        self.unknowns = Unknowns(robot, prior, errors)
        x = made.position_m + 0.02 * span * rng.normal(size=(STOPS, 3))
        turn = made.rotation @ turns.matrix(0.1 * rng.normal(size=(STOPS, 3)) * (robot.degrees == 6))
        nothing = np.full((STOPS, 3), np.nan), np.full((STOPS, 3, 3), np.nan)
        session = Session(*nothing, np.ones((STOPS, legs)), np.ones(STOPS), np.ones(STOPS, bool), 1.0)
        self.tension = np.full((STOPS, legs), np.nan)
        self.tension[0, 0] = 5.0
        self.holds = Holds(session, self.tension)
        self.noise = Noise(1e-4 * span, 1e-5, 3.0, 1.0, 0.01)
        pull = rng.uniform(-2.0, 9.0, (STOPS, legs))  # some are slack
        self.state = State(0.3 * rng.normal(size=self.unknowns.count), x, turn, pull)
        self.creep = creep_of(self.unknowns, self.holds, self.state)

    def equations(self, state):
        return linearised(self.unknowns, self.holds, self.noise, state, self.creep, self.state)

    def residual(self, state, of=("tension", "carried")):
        e = self.equations(state)
        return np.concatenate([e.residual[:, e.rows[name]] for name in of], 1)

    def slopes(self):
        e = self.equations(self.state)
        rows = np.r_[e.rows["tension"], e.rows["carried"]]
        return e.by_robot[:, rows], e.by_hold[:, rows]


@pytest.mark.parametrize("kind", ["point-3", "point-5", "body-8"])
def test_tensions_that_carry_have_a_prior_as_wide_as_the_range(kind):
    """The sum of squares is that of the covariance I + J J'/e, of the wires that nobody read."""
    one = _Robot(kind)
    e = one.equations(one.state)
    level_N = one.unknowns.parts(one.state.white).level_N
    off = (one.state.pull_N - level_N - one.noise.usual_N) / one.noise.pull_N
    J = e.by_hold[:, e.rows["loop"], : one.robot.degrees] * one.noise.joint_m  # growth of the wires by a small motion
    for hold in range(STOPS):
        unread = np.isnan(one.tension[hold])
        pulls = J[hold, unread]
        covariance = np.eye(unread.sum()) + pulls @ pulls.T / _CARRIED
        expected = off[hold, unread] @ np.linalg.solve(covariance, off[hold, unread])
        residual = one.residual(one.state)[hold]
        residual = residual[np.r_[unread, np.ones(one.robot.degrees, bool)]]
        assert residual @ residual == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("kind", ["point-5", "body-8"])
def test_slopes_of_the_sum_of_squares_agree_with_differences(kind):
    one = _Robot(kind)
    by_robot, by_hold = one.slopes()
    residual = one.residual(one.state)
    slope = 2 * np.einsum("pk,pkm->m", residual, by_robot)
    of_hold = 2 * np.einsum("pk,pkm->pm", residual, by_hold)
    state, d, h = one.state, one.robot.degrees, 1e-6

    def squares(there):
        return float((one.residual(there) ** 2).sum())

    def difference(ahead, behind):
        return (squares(ahead) - squares(behind)) / (2 * h)

    for m in range(one.unknowns.slices["wires"].start):
        step = h * np.eye(one.unknowns.count)[m]
        found = difference(replace(state, white=state.white + step), replace(state, white=state.white - step))
        assert found == pytest.approx(slope[m], rel=1e-5, abs=1e-6)
    for k in range(d):
        move = h * np.eye(6)[k]
        found = difference(_moved(one, move), _moved(one, -move))
        assert found == pytest.approx(of_hold[1, k], rel=1e-5, abs=1e-6)
    for k in range(one.robot.legs):
        pull = np.zeros_like(state.pull_N)
        pull[1, k] = h
        found = difference(replace(state, pull_N=state.pull_N + pull), replace(state, pull_N=state.pull_N - pull))
        assert found == pytest.approx(of_hold[1, d + k], rel=1e-5, abs=1e-6)


def _moved(one, move):
    """The state with the second hold's platform moved, and turned as far at its edge."""
    position, turn = one.state.position_m.copy(), one.state.rotation.copy()
    position[1] += move[:3]
    turn[1] = turns.matrix(move[None, 3:] / one.robot.size_m)[0] @ turn[1]
    return replace(one.state, position_m=position, rotation=turn)


def test_tensions_far_outside_the_range_are_improbable_whatever_they_carry():
    """Each wire's have a level in common, so that its covariance is I + l^2 1 1'; what was read is not asked."""
    rng = np.random.default_rng(5)
    unit_N, level_N, usual_N = 2.0, 3.0, 1.0
    known = np.zeros((6, 3), bool)
    known[1, 2] = True
    pull = usual_N + rng.normal(size=(6, 3)) * np.array([1.0, 4.0, 7.0])
    pull[known] = 1e6
    squares = 0.0
    for wire in range(3):
        off = (pull[:, wire] - usual_N)[~known[:, wire]] / unit_N
        covariance = np.eye(len(off)) + (level_N / unit_N) ** 2
        squares += off @ np.linalg.solve(covariance, off)
    found = SimpleNamespace(
        equations=SimpleNamespace(rows={"tension": slice(0, 3)}, known=known),
        state=SimpleNamespace(pull_N=pull),
        noise=SimpleNamespace(pull_N=unit_N, usual_N=usual_N),
        unknowns=SimpleNamespace(errors=SimpleNamespace(level_N=level_N)),
    )
    assert _outside_range(found) == pytest.approx(chi2.sf(squares, 17))

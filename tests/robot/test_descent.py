"""The descent of a calibration: down a narrow, curved valley it goes in long steps."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.robot.test_usable import _read, _session
from wirebayes.robot.mechanics import schema
from wirebayes.robot.mechanics.draws import stated_line
from wirebayes.robot.self_calibration.answer import holds_of
from wirebayes.robot.self_calibration.descent import descend
from wirebayes.robot.self_calibration.equations import FRICTIONLESS, Noise, State
from wirebayes.robot.self_calibration.estimate import estimate
from wirebayes.robot.self_calibration.holds_creep import ROUGHLY, creep_of
from wirebayes.robot.self_calibration.residuals import trust
from wirebayes.robot.self_calibration.seeds import seed
from wirebayes.robot.self_calibration.session import LengthPrior
from wirebayes.robot.self_calibration.session_file import read_session
from wirebayes.robot.self_calibration.unknowns import StatedErrors, Unknowns

PRINTER = Path(__file__).parent / "field" / "calibrate-wrong-anchors"


@pytest.mark.parametrize("joint_m", [1e-2, 3e-2])
def test_a_descent_comes_down_where_balance_bends_the_way(joint_m):
    """Lengths that err by more than they tell of tensions leave these to slide, and balance is exact beside them."""
    robot = schema.read_robot_file(str(PRINTER / "hp4-rough.toml"))
    session, readings = read_session(PRINTER / "hp-session.csv", robot, 5.0, 1e-3)
    prior = LengthPrior(stated_line(robot, 50), 0.05)
    unknowns = Unknowns(robot, prior, StatedErrors(exit_m=0.05))
    holds = holds_of(robot, session.without_poses(), readings)
    state = seed(unknowns, holds, np.zeros(unknowns.count), np.random.default_rng(0))
    noise = Noise(joint_m, FRICTIONLESS, 35.0, 1.0, 0.03)
    creep = creep_of(unknowns, holds, state, roughly=ROUGHLY)
    start = descend(unknowns, holds, replace(noise, balance=0.3), state, creep, state, 6).state
    few, many = (descend(unknowns, holds, noise, start, creep, state, steps).cost for steps in (12, 96))
    assert few < 1.01 * many


@pytest.mark.parametrize("reference", [1e-3, 1e-4])
def test_a_search_from_elsewhere_ends_where_what_readings_hardly_tell_is_as_the_prior_has_it(reference):
    """Two wires: what they hardly tell of references is tested against its prior, and no search may leave it behind."""
    robot, prior, session, rng = _session(2, kinds=("planar-2",))
    prior = replace(prior, reference_sd_m=reference * robot.span_m)
    readings = _read(robot, prior, session, rng)
    holds = holds_of(robot, session.without_poses(), readings)
    unknowns = Unknowns(robot, prior, StatedErrors(joint_m=0.0))
    start = State(np.zeros(unknowns.count), session.position_m, session.rotation, holds.tension_N)
    found = estimate(unknowns, holds, start)
    white = found.state.white.copy()
    white[unknowns.references] += 1.0
    again = estimate(unknowns, holds, replace(found.state, white=white))
    assert found.converged
    assert again.converged
    assert trust(again) == pytest.approx(trust(found), rel=0.01)

"""Sessions of robots of which two things are wrong: both are named where neither alone explains what contradicts."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.robot.test_leaning_frame import _about
from tests.robot.test_usable import _misfits, _read, _reported, _session
from wirebayes.robot.mechanics import rotation, schema
from wirebayes.robot.mechanics.description import GivenWire
from wirebayes.robot.self_calibration import answer, search, two_causes
from wirebayes.robot.self_calibration.equations import Noise, State
from wirebayes.robot.self_calibration.search import StatedPoses
from wirebayes.robot.self_calibration.stiffness import Stiffness
from wirebayes.robot.self_calibration.two_causes import TwoCauses, _SensorError
from wirebayes.robot.self_calibration.unknowns import StatedErrors, Unknowns

BOTH = "no single cause that was tried explains what contradicts, but two together would: "


def _named(found):
    """The pairs that are named in the only warning of that kind."""
    (text,) = [text for text in _misfits(found) if text.startswith(BOTH)]
    return text.removeprefix(BOTH).split("; check ")[0].split("; or ")


@pytest.mark.parametrize("seed", [0, pytest.param(2, marks=pytest.mark.slow)])
def test_mass_and_lean_are_named_in_place_of_all_sensors(seed):
    robot, prior, session, rng = _session(seed, sd=0.005)
    turn = rotation.matrix([0.03, 0.02, 0.0])
    real = replace(robot, exit_m=robot.exit_m @ turn.T)
    sent = replace(session, position_m=session.position_m @ turn.T, rotation=turn @ session.rotation)
    readings = _read(real, prior, sent, rng)
    weighed = replace(robot, mass_kg=1.1 * robot.mass_kg)
    found = _reported(weighed, prior, session, readings)
    values = r"a platform of (\S+) \+- (\S+) kg and a frame that leans by (\S+) \+- (\S+) degrees"
    mass, mass_sd, lean, lean_sd = (float(value) for value in re.fullmatch(values, _named(found)[0]).groups())
    assert abs(mass - robot.mass_kg) < 4 * mass_sd < 0.05 * robot.mass_kg
    assert abs(lean - np.degrees(np.hypot(0.03, 0.02))) < 4 * lean_sd < 1.5
    assert not any("several tension sensors" in text for text in _misfits(found))


@pytest.mark.parametrize("seed", [0, pytest.param(2, marks=pytest.mark.slow)])
def test_mass_and_a_sensor_are_named_in_place_of_the_sensor_alone(seed):
    robot, prior, session, rng = _session(seed, sd=0.005)
    readings = _read(robot, prior, session, rng).reshape(-1, robot.legs)
    off = 0.1 * readings.max()
    readings[:, 1] += off
    weighed = replace(robot, mass_kg=1.1 * robot.mass_kg)
    (pair,) = _named(_reported(weighed, prior, session, readings.ravel()))
    values = r"a platform of (\S+) \+- (\S+) kg and a tension sensor of wire 2 that reads (\S+) \+- (\S+) N too much"
    mass, mass_sd, error, error_sd = (float(value) for value in re.fullmatch(values, pair).groups())
    assert abs(mass - robot.mass_kg) < 4 * mass_sd < 0.05 * robot.mass_kg
    assert abs(error - off * session.tension_sd_N) < 4 * error_sd < 0.3 * error


def _looked_for(monkeypatch, explain, unlike, sensors):
    """How often pairs are looked for where something else was found."""
    asked = []
    found = SimpleNamespace(converged=True)
    holds = SimpleNamespace(placed=np.zeros(2, bool))
    for name, value in (
        ("best", found),
        ("trust", 0.0),
        ("_rather_requests", search._Chosen(found, holds)),
        ("_sensor_at_fault", sensors),
        ("_contradicts", True),
        ("_carries", True),
        ("explanations", explain),
        ("unlike_wires", unlike),
    ):
        monkeypatch.setattr(search, name, lambda *given, value=value, **more: value)
    monkeypatch.setattr(search, "two_causes", lambda *given: asked.append(given))
    unknowns = SimpleNamespace(errors=StatedErrors(joint_m=1.0))
    search.searched(unknowns, holds, None, StatedPoses.MEASURED, lambda *done: None)
    return len(asked)


def test_two_causes_are_looked_for_only_where_none_alone_explains_all(monkeypatch):
    whole = SimpleNamespace(wires=[1], whole=np.array([False, True]))
    part = SimpleNamespace(wires=[1], whole=np.array([False, False]))
    assert _looked_for(monkeypatch, (), (), None) == 1
    assert _looked_for(monkeypatch, (), (), part) == 1
    assert _looked_for(monkeypatch, (), (), whole) == 0
    assert _looked_for(monkeypatch, ("another mass",), (), part) == 0
    assert _looked_for(monkeypatch, (), ("another stiffness",), part) == 0


def test_pairs_that_are_a_hundred_times_less_likely_than_the_likeliest_are_not_named(monkeypatch):
    evidence = {"a": 10.0, "b": 5.5, "c": 5.3}
    suspects = [SimpleNamespace(count=1, says=lambda *values, name=name: name) for name in evidence]
    pairs = [(one, one) for one in suspects]
    explained = {
        id(pair): SimpleNamespace(found=SimpleNamespace(evidence=value), change=np.zeros(2), covariance=np.eye(2))
        for pair, value in zip(pairs, evidence.values(), strict=True)
    }
    monkeypatch.setattr(two_causes, "_suspects", lambda *given: suspects)
    monkeypatch.setattr(two_causes, "_likeliest", lambda *given: pairs)
    monkeypatch.setattr(two_causes, "explained_by", lambda cause, *given: explained[id(cause.pair)])
    found = two_causes.two_causes(None, None)
    assert found == TwoCauses((("a", "a"), ("b", "b")), 10.0)
    assert "a and a; or b and b; check which of them it is" in found.in_words()
    as_many = TwoCauses((("a", "b"),) * two_causes._FITTED, 10.0)  # others were not fitted
    assert "a and b; or another pair; check which" in as_many.in_words()
    monkeypatch.setattr(two_causes, "explained_by", lambda *given: None)
    assert two_causes.two_causes(None, None) is None


@pytest.mark.parametrize("given", [False, True])
def test_residuals_follow_stiffness_and_a_sensor_as_their_slopes_say(given):
    rng = np.random.default_rng(3)
    _, prior, session, _ = _session(0)
    robot = schema.read_robot_file("cogiro-desk")
    if given:
        one = {name: float(value[0]) for name, value in prior.line.parameters.items()}
        robot = replace(robot, given={name: GivenWire(one, prior.line.length_mm) for name in set(robot.wire)})
    unknowns = Unknowns(robot, replace(prior, creeps=False), StatedErrors(exit_m=0.01, pose_m=0.01))
    position = robot.home_m + 0.01 * rng.standard_normal((3, 3))
    turns = rotation.matrix(robot.home_rotation_rad + 0.01 * rng.standard_normal((3, 3)) * (robot.degrees == 6))
    pull = rng.uniform(1.0, 5.0, (3, robot.legs))
    session = replace(
        session,
        position_m=position,
        rotation=turns,
        joint_m=np.ones((3, robot.legs)),
        duration_s=np.full(3, 10.0),
        read=np.ones(3, bool),
    )
    holds = answer.holds_of(robot, session, pull.ravel() / session.tension_sd_N)
    noise = Noise(1e-3, 1e-3, 1.0, 1.0, 1e-3)
    found = _about(unknowns, holds, noise, State(np.zeros(unknowns.count), position, turns, 1.1 * pull))
    signs = np.ones(3)
    for cause in (Stiffness(), _SensorError(1, signs / session.tension_sd_N, 1.0, signs)):
        by = np.array([1e-5])
        changed, there, state = cause.changed(found, holds, by)
        ahead = _about(changed, there, noise, state)
        seen = ahead.equations.residual - found.equations.residual
        foreseen = cause.slopes(found) @ by
        assert abs(foreseen).max() > 0
        np.testing.assert_allclose(seen, foreseen, atol=1e-4 * abs(foreseen).max())

"""When lengths of a calibration may be set: the joint test at its threshold, and drawn robots with wrong anchors."""

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from tests.robot import drawn
from tests.robot.cases import session_header
from wirebayes.errors import InputError
from wirebayes.progress import silent
from wirebayes.robot.mechanics import draws, schema
from wirebayes.robot.mechanics.rotation import vector
from wirebayes.robot.motion import inverse
from wirebayes.robot.self_calibration import answer, search, session_file
from wirebayes.robot.self_calibration.answer import _Verdict, calibration_report
from wirebayes.robot.self_calibration.equations import Holds
from wirebayes.robot.self_calibration.predicted import predict_session
from wirebayes.robot.self_calibration.search import Searched, StatedPoses
from wirebayes.robot.self_calibration.session import LengthPrior, Session
from wirebayes.robot.self_calibration.trust import joint_test
from wirebayes.robot.self_calibration.unknowns import StatedErrors, Unknowns
from wirebayes.strict.table import csv_table

SPREAD = 1e-3  # from wire to wire: small, so that a session of eight stops is solved in a moment


def _session(seed, sd=0.02, kinds=("point-4", "point-5", "body-7", "body-8")):
    """A session of a drawn robot and its prior; tensions are read to a share of their largest."""
    rng = np.random.default_rng(seed)
    one = drawn.draw(str(rng.choice(kinds)), rng, count=40, sd=0.01)
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
    return np.maximum(real.readings[0] + rng.standard_normal(real.readings.shape[1]), 0.0)


def _reported(robot, prior, session, readings):
    """What is said of lengths where all else is exact."""
    exact = StatedErrors(joint_m=0.0)
    with np.errstate(all="ignore"):
        report = calibration_report(robot, prior, exact, session, readings, poses=StatedPoses.REQUESTED, visits=0)
    return report.content


@pytest.mark.parametrize("seed", range(3))
def test_a_session_with_nothing_wrong_is_usable(seed):
    robot, prior, session, rng = _session(seed)
    assert _reported(robot, prior, session, _read(robot, prior, session, rng))["usable"]


@pytest.mark.parametrize("seed", [*(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2)), 2])
def test_wrong_anchors_held_exact_are_not(seed):
    robot, prior, session, rng = _session(seed, sd=0.002)
    other = replace(robot, exit_m=robot.exit_m + 0.01 * robot.span_m * rng.standard_normal(robot.exit_m.shape))
    found = _reported(robot, prior, session, _read(other, prior, session, rng))
    assert not found["usable"]
    assert "misfit" in {one["kind"] for one in found["warnings"]}


def _misfits(found):
    assert not found["usable"]
    return [one["text"] for one in found["warnings"] if one["kind"] == "misfit"]


@pytest.mark.parametrize(("seed", "times"), [(0, 1.1), (2, 0.8)])
def test_a_mass_that_is_wrong_is_named_in_place_of_all_sensors(seed, times):
    robot, prior, session, rng = _session(seed, sd=0.005)
    readings = _read(robot, prior, session, rng)
    weighed = replace(robot, mass_kg=times * robot.mass_kg)
    texts = _misfits(_reported(weighed, prior, session, readings))
    found = [re.match(r"a platform of (\S+) \+- (\S+) kg would explain what contradicts", text) for text in texts]
    mass, sd = next([float(value) for value in one.groups()] for one in found if one)
    assert abs(mass - robot.mass_kg) < 4 * sd < 0.1 * robot.mass_kg
    assert not any("several tension sensors" in text for text in texts)


def test_a_centre_of_mass_that_is_wrong_is_named_in_place_of_all_sensors():
    robot, prior, session, rng = _session(0, sd=0.005)
    readings = _read(robot, prior, session, rng)
    off = 0.1 * robot.size_m * np.array([1.0, -0.5, 0.0])
    stated = replace(robot, centre_of_mass_m=robot.centre_of_mass_m + off)
    texts = _misfits(_reported(stated, prior, session, readings))
    named = r"a centre of mass at \((.*?)\) mm would explain .* file says \((.*?)\) mm"
    found = [re.match(named, text) for text in texts]
    centre, told = next(one.groups() for one in found if one)
    at, sd = 1e-3 * np.array([[float(value) for value in part.split(" +- ")] for part in centre.split(", ")]).T
    assert (np.abs(at - robot.centre_of_mass_m) < 4 * sd + 0.005 * np.abs(at)).all()
    assert (4 * sd[:2] < np.abs(off[:2])).all()
    np.testing.assert_allclose([float(part) for part in told.split(", ")], 1e3 * stated.centre_of_mass_m, rtol=0.01)
    assert not any("tension sensor" in text or "a frame that leans" in text for text in texts)


def test_errors_of_sensors_are_not_taken_for_another_mass():
    robot, prior, session, rng = _session(0, sd=0.005)
    readings = _read(robot, prior, session, rng).reshape(-1, robot.legs) + 20.0 * np.arange(robot.legs)
    texts = _misfits(_reported(robot, prior, session, readings.ravel()))
    assert not any("a platform of" in text for text in texts)


@pytest.mark.parametrize("times", [1.3, 0.8])
def test_a_stiffness_that_is_wrong_is_named(times):
    robot, prior, session, rng = _session(2, sd=0.002)
    prior = replace(prior, spread=0.02)
    readings = _read(robot, prior, session, rng)
    k1 = times * prior.line.parameters["k1"]
    stated = replace(prior.line, parameters={**prior.line.parameters, "k1": k1})
    texts = _misfits(_reported(robot, replace(prior, line=stated), session, readings))
    found = [re.match(r"wires whose stiffness k1 is on average (\S+) times what is stated", text) for text in texts]
    assert next(float(one[1]) for one in found if one) == pytest.approx(1 / times, rel=0.1)


def test_the_verdict_turns_at_its_threshold():
    found = SimpleNamespace(converged=True, noise=SimpleNamespace(balance=0.0))
    seen = SimpleNamespace(determined=4, of=4)
    for p, good in ((0.0101, True), (0.0099, False), (np.nan, False)):
        search = Searched(found, None, p, None, inexact=False, requested=False)
        assert _Verdict(search, seen, []).usable is good
        assert not _Verdict(search, seen, ["a hold leads elsewhere"]).usable
        assert not _Verdict(replace(search, inexact=True), seen, []).usable
    astray = replace(search, found=replace_in(found, converged=False), p=1.0)
    assert not _Verdict(astray, seen, []).usable
    assert not _Verdict(replace(search, p=1.0), SimpleNamespace(determined=0, of=4), []).usable


@pytest.mark.parametrize(("times", "said"), [(2.99, False), (3.01, True)])
def test_poses_without_which_joint_values_agree_better_are_asked_for(monkeypatch, times, said):
    for check in ("odd_hold", "sag_warnings_of_poses"):
        monkeypatch.setattr(answer, check, lambda *arguments: [])
    robot, _, session, _ = _session(0)
    state = SimpleNamespace(position_m=session.position_m, rotation=session.rotation, pull_N=None)
    noise = SimpleNamespace(joint_m=0.7e-3, balance=0.0)
    found = SimpleNamespace(converged=True, noise=noise, unknowns=SimpleNamespace(robot=robot), state=state)
    holds = SimpleNamespace(session=session)
    seen = SimpleNamespace(determined=4, of=4)
    looked = Searched(found, holds, 0.5, None, inexact=False, requested=False, closer=times)
    notices = answer._warnings(_Verdict(looked, seen, []))
    asked = [one for one in notices if "--pose-sd" in one.text]
    assert [one.kind for one in asked] == ["data"] * said
    if said:
        assert "to 0.7 mm, and to 0.23 mm if the poses are unknown" in asked[0].text


def test_a_flat_robot_is_not_doubted_because_it_is_flat():
    robot = schema.read_robot_file("hangprinter-4")
    in_plane = np.array([1.0, 0.0, 1.0])
    lower, upper = robot.lower_m * in_plane, robot.upper_m * in_plane
    flat = replace(robot, exit_m=robot.exit_m * in_plane, lower_m=lower, upper_m=upper)
    for one, axis, doubted in ((flat, 1, False), (flat, 0, True), (robot, 1, True)):
        of = Unknowns(one, _session(0)[1], StatedErrors(exit_m=0.01))
        spread = np.eye(of.count)
        known = 3 * np.arange(one.legs) + axis  # and found exactly where the file has them
        spread[known, known] = 1e-6
        found = SimpleNamespace(unknowns=of, covariance=spread, state=SimpleNamespace(white=np.zeros(of.count)))
        assert search._too_good(found) is doubted


def replace_in(namespace, **changed):
    return SimpleNamespace(**{**vars(namespace), **changed})


@pytest.mark.parametrize(("times", "rough"), [(0.99, True), (1.01, False)])
def test_exact_joint_values_are_doubted_unless_readings_are_a_hundred_standard_errors_off(monkeypatch, times, rough):
    begun = []

    def best(unknowns, holds, rng, progress, called="start", about=None):
        begun.append(unknowns.errors.joint_m)
        return SimpleNamespace(unknowns=unknowns, converged=True, noise=SimpleNamespace(balance=0.0))

    for name, value in (("trust", 0.001), ("lost", True), ("misfit", times * 100.0**2), ("unlike_wires", ())):
        monkeypatch.setattr(search, name, lambda found, value=value: value)
    monkeypatch.setattr(search, "best", best)
    robot, prior, session, rng = _session(0)
    holds = Holds(session.without_poses(), np.full(session.joint_m.shape, 5.0))
    unknowns = Unknowns(robot, prior, StatedErrors(joint_m=0.0))
    found = search.searched(unknowns, holds, rng, StatedPoses.MEASURED, silent)
    assert found.inexact
    assert begun == ([0.0, None] if rough else [0.0])


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
        return joint_test(cost, count, mode, np.broadcast_to(spread, (many, 9, 9)), [slice(0, legs), slice(legs, 9)])

    truth, noise = rng.standard_normal((many, 9)), rng.standard_normal((many, count))
    level = (p_of(truth, noise) < 0.01).mean()
    assert 0.004 < level < 0.014  # three tests that are not independent: at most a hundredth
    moved = truth + np.array([5.0, 5.0, 0, 0, 0, 0, 0, 0, 0])
    assert (p_of(moved, noise) < 0.01).mean() > 0.95  # references beyond their prior, residuals as expected
    of_wires = truth + np.array([0, 0, 0, 0, 5.0, 5.0, 0, 0, 0])
    assert (p_of(of_wires, noise) < 0.01).mean() > 0.95
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

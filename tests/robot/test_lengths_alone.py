"""Calibration without tensions: marks at known places and stops at unknown ones, on the Hangprinter of the tutorial."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import f

import wirebayes as wb
from wirebayes.robot.mechanics.draws import WireDraws, for_robot
from wirebayes.robot.motion import inverse
from wirebayes.robot.self_calibration import residuals
from wirebayes.robot.self_calibration.equations import Holds
from wirebayes.robot.self_calibration.predicted import predict_session
from wirebayes.robot.self_calibration.seeds import best
from wirebayes.robot.self_calibration.session import LengthPrior, Session
from wirebayes.robot.self_calibration.summary import summarised
from wirebayes.robot.self_calibration.unknowns import StatedErrors, Unknowns

CONFIG = Path(__file__).parents[2] / "docs" / "example" / "config.g"
LINE = {"k1": 2500.0, "B": 0.03, "U": 0.9, "k2": 0.03, "N": 0.6}
KNOWN = {"k1": 0.003, "B": 0.3, "U": 0.2, "k2": 0.3, "N": 0.1}  # relative, as a tension test leaves them
MARKS = [(0, 0, 0), (-0.3, -0.2, 0), (0.3, -0.2, 0), (0.3, 0.25, 0), (-0.3, 0.25, 0), (0, 0.3, 0)]
STOPS = 24
TAPE_M, MARK_M, WIRE_M = 8e-3, 3e-4, 1e-4  # errors of anchors, of marks, of a line's length


def _session(printer, seed):
    """A session that nobody read tensions in, and the true anchors."""
    rng = np.random.default_rng(seed)
    true = replace(printer, exit_m=printer.exit_m + TAPE_M * rng.normal(size=printer.exit_m.shape))
    exact = WireDraws({name: np.array([value]) for name, value in LINE.items()}, 2000.0, "hooke")
    spread = np.random.default_rng(0).standard_normal((len(LINE), 200))
    drawn = {name: LINE[name] * np.exp(KNOWN[name] * z) for name, z in zip(LINE, spread, strict=True)}
    line = replace(exact, parameters=drawn)
    prior = LengthPrior(exact, 3e-3)
    values = rng.multivariate_normal(*prior.moments(printer.legs), 1)
    own, reference = prior.wires(printer, values)
    places = rng.uniform([-0.45, -0.45, 0.05], [0.45, 0.45, 0.9], (10 * STOPS, 3))
    level = np.repeat(np.eye(3)[None], len(places), 0)
    places = places[np.isfinite(inverse.tensions(printer, places, level)).all(1)][:STOPS]

    def commanded(robot, wires, where, error_m):
        turn = level[: len(where)]
        return inverse.commands(robot, wires, where, turn, inverse.tensions(robot, where, turn), 0.0, error_m).joint_m

    jogged = commanded(true, own, np.array(MARKS, float), reference.T)  # the nozzle is led onto a mark
    sent = commanded(printer, for_robot(printer, exact), places, 0.0)
    joint, count = np.vstack([jogged, sent]), len(MARKS) + STOPS
    near = np.vstack([MARKS, places])
    done = Session(near, level[:count], joint, np.full(count, 60.0), np.ones(count, bool), 1.0)
    real = predict_session(true, prior, done, values)
    assert real.solved.all()
    marks = np.arange(count)[:, None] < len(MARKS)
    place = np.where(marks, real.position_m[0] + MARK_M * rng.normal(size=near.shape), np.nan)
    turn = np.where(marks[..., None], level[:count], np.nan)
    joint = joint + WIRE_M * printer.lines * rng.normal(size=joint.shape)
    told = replace(done, position_m=place, rotation=turn, joint_m=joint, read=np.zeros(count, bool))
    return Unknowns(printer, LengthPrior(line, 5e-3), StatedErrors(exit_m=1e-2, pose_m=5e-4)), told, true.exit_m


def test_wires_that_nobody_read_are_not_thought_slack(tmp_path):
    """Seed 5: with the balance eased on the way, wires slacken and 4 mm of error of the lengths explain the rest."""
    printer = wb.read_robot(wb.import_robot(CONFIG, tmp_path / "robot.toml"))
    held = []
    for seed in (5, 9, 13):
        unknowns, told, exit_m = _session(printer, seed)
        found = best(unknowns, Holds(told, np.full(told.joint_m.shape, np.nan)), np.random.default_rng(0))
        assert found.converged and found.noise.joint_m < 1e-3
        assert found.state.pull_N.min() > 0
        anchors = summarised(found).exit_m
        held.append(np.abs(anchors.mean - exit_m) <= anchors.half * anchors.sd)
    assert np.mean(held) > 0.8


_WORTH, _SPAN_M = residuals._BLIND_DEGREES, 3.0
_USUAL_M = residuals.USUAL * _SPAN_M


def _with_loops_off_by(noise_m, free, read=False):
    """What a calibration found, as far as the test of its loops asks."""
    return SimpleNamespace(
        degrees=free + _WORTH,
        noise=SimpleNamespace(joint_m=noise_m),
        unknowns=SimpleNamespace(robot=SimpleNamespace(span_m=_SPAN_M)),
        equations=SimpleNamespace(rows={"tension": slice(0, 4)}, known=np.full((5, 4), read)),
    )


@pytest.mark.parametrize("read", [False, True])
def test_an_unusual_error_of_the_lengths_is_as_improbable_as_an_f_test_says(read):
    free = 20.0
    ratio = f.isf(0.01, free, _WORTH)
    noise_m = np.sqrt((free * ratio + _WORTH) / (free + _WORTH)) * _USUAL_M
    assert residuals._usual_noise(_with_loops_off_by(noise_m, free, read)) == pytest.approx(1.0 if read else 0.01)


@pytest.mark.parametrize("free", [1e-9, 1e-3, 0.1])
def test_loops_that_do_not_check_each_other_contradict_nothing(free):
    assert residuals._usual_noise(_with_loops_off_by(_USUAL_M * (1.0 + 1e-6), free)) > 0.5
    assert residuals._usual_noise(_with_loops_off_by(9.0 * _USUAL_M, free)) < 0.01  # but for these

"""Calibration from lengths alone where some stops left wires slack: equilibria are where the search then begins."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from wirebayes.robot.mechanics import schema
from wirebayes.robot.mechanics.draws import WireDraws
from wirebayes.robot.motion import inverse
from wirebayes.robot.self_calibration import answer, seeds
from wirebayes.robot.self_calibration.equations import Holds
from wirebayes.robot.self_calibration.predicted import predict_session
from wirebayes.robot.self_calibration.session import LengthPrior, Session
from wirebayes.robot.self_calibration.unknowns import StatedErrors, Unknowns

LINE = {"k1": 5000.0, "B": 0.03, "U": 0.9, "k2": 0.03, "N": 0.6}
SHARE, LOOSE_M = 0.4, 0.03  # of the stops in which one lower wire is let out, and how far
ANCHOR_M, REFERENCE_M, ENCODER_M = 5e-3, 3e-3, 1e-4


def stops(seed, count=14):
    """A robot as its file says and as it is, its prior, a session of unknown poses, and what came of it."""
    rng = np.random.default_rng(seed)
    told = schema.read_robot_file("hangprinter-4")
    true = replace(told, exit_m=told.exit_m + ANCHOR_M * rng.normal(size=told.exit_m.shape))
    line = WireDraws({name: np.full(2, value) for name, value in LINE.items()}, 2000.0)
    prior = LengthPrior(line, REFERENCE_M)
    values = rng.multivariate_normal(*prior.moments(told.legs), 1)
    wires, reference_m = prior.wires(told, values)
    places = rng.uniform([-0.4, -0.4, 0.1], [0.4, 0.4, 0.9], (count, 3))
    level = np.repeat(np.eye(3)[None], count, 0)
    tension = inverse.tensions(true, places, level)
    joint_m = inverse.commands(true, wires, places, level, tension, 0.0, reference_m.T).joint_m
    loose = np.flatnonzero(rng.random(count) < SHARE)
    wire = rng.integers(0, 3, count)
    joint_m[loose, wire[loose]] += LOOSE_M * told.lines[wire[loose]]
    made = Session(places, level, joint_m, np.full(count, 60.0), np.ones(count, bool), 1.0)
    real = predict_session(true, prior, made, values)
    read_m = joint_m + ENCODER_M * rng.normal(size=joint_m.shape)
    seen = replace(made.without_poses(), joint_m=read_m, read=np.zeros(count, bool))
    return told, true, prior, seen, real


@pytest.mark.parametrize("seed", [3, 8])
def test_lengths_are_found_though_nobody_knows_which_wires_were_slack(seed):
    told, true, prior, session, real = stops(seed)
    tension = real.readings.reshape(-1, told.legs)
    assert (tension == 0.0).any(1).sum() >= 3  # stops with a slack wire
    errors = StatedErrors(1e-2)
    found = answer.calibration_report(told, prior, errors, session, np.empty(0), visits=0).content
    assert found["with_creep_model"]["converged"]
    kinds = {warning["kind"] for warning in found["warnings"]}
    assert not kinds & {"misfit", "not-converged"}
    length, exits = found["with_creep_model"]["length_m"], found["exit_points_m"]
    for estimate, truth in ((length, real.length_m[0]), (exits, true.exit_m)):
        off = np.abs(np.array(estimate["mean"]) - truth) / np.array(estimate["sd"])
        assert off.max() < 4.0


def test_the_start_is_an_equilibrium_with_negative_tensions_in_slack_wires():
    told, _, prior, session, _ = stops(8)
    unknowns = Unknowns(told, prior, StatedErrors(1e-2))
    holds = Holds(session, np.full(session.joint_m.shape, np.nan))
    begun = seeds.seed(unknowns, holds, np.zeros(unknowns.count), np.random.default_rng(0))
    state = seeds.hanging_state(unknowns, holds, begun)
    assert (begun.pull_N > 0.0).all() and (state.pull_N < 0.0).any()
    zero_m, offset_m = inverse.lengths(told, session.joint_m)
    way_m = np.linalg.norm(state.position_m[:, None] + told.platform_m - told.exit_m, axis=-1) * told.lines + offset_m
    slack = state.pull_N < 0.0
    assert (way_m[slack] < zero_m[slack]).all() and (way_m[~slack] > zero_m[~slack]).all()
    np.testing.assert_allclose(state.pull_N, LINE["k1"] * (way_m / zero_m - 1.0), rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize(
    ("gap_N", "converged", "unusual", "begun", "goes_on"),
    [(-0.1, False, True, 1, 1), (-0.1, False, False, 1, 0), (-0.1, True, True, 2, 0), (0.1, True, True, 0, 0)],
)
def test_poses_in_balance_are_begun_from_where_wires_are_slack_and_no_place_twice(
    monkeypatch, gap_N, converged, unusual, begun, goes_on
):
    """Without a search that ended, the second would begin where the first did; a search that was given up goes on."""
    told, _, prior, session, _ = stops(8, 3)
    holds = Holds(session, np.full(session.joint_m.shape, np.nan))
    started = []

    def found_nothing(unknowns, holds, state, progress=None, others_follow=False):
        started.append((state, others_follow))
        return SimpleNamespace(converged=converged, evidence=0.0, state=state, unknowns=unknowns)

    def hanging(unknowns, holds, state):
        pull_N = np.ones_like(state.pull_N)
        pull_N[1, 2] = gap_N
        return replace(state, pull_N=pull_N)

    monkeypatch.setattr(seeds, "estimate", found_nothing)
    monkeypatch.setattr(seeds, "hanging_state", hanging)
    monkeypatch.setattr(seeds, "trust", lambda found: 0.001)
    monkeypatch.setattr(seeds, "lost", lambda found: False)
    monkeypatch.setattr(seeds, "unusually_open", lambda found: unusual)
    seeds.best(Unknowns(told, prior, StatedErrors(1e-2)), holds, np.random.default_rng(0))
    assert [state.pull_N.min() < 0.0 for state, _ in started[3 : 3 + begun]] == [True] * begun
    assert [others for _, others in started] == [True] * (3 + begun) + [False] * goes_on

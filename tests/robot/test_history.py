"""Poses from measured joint values, against a simulation of its own: Euler angles, a stiff integrator."""

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.robot.independent import Rig
from tests.robot.lines import CORE, line_about
from tests.robot.test_commands import fitted  # noqa: F401 - a fixture
from wirebayes.cli import main
from wirebayes.errors import InputError
from wirebayes.io.run_folder import read_json
from wirebayes.robot.history import commanded, conditioning, corrections, table
from wirebayes.robot.history.answer import history_report
from wirebayes.robot.history.conditioning import LogReadings, predicted_readings
from wirebayes.robot.history.estimate import estimate_poses
from wirebayes.robot.history.follow import Track, clock_starts, follow_log, uncreeping
from wirebayes.robot.history.history import History, roll_and_pitch, with_payload
from wirebayes.robot.history.readings import Information, Sensors
from wirebayes.robot.history.unknowns import LogUnknowns, Uncertain, even_normals, unknowns
from wirebayes.robot.mechanics import draws, rotation, schema
from wirebayes.robot.mechanics.description import Drums
from wirebayes.robot.motion import inverse
from wirebayes.strict.table import csv_table


def _line(n, sd=0.05, seed=0):
    return line_about(CORE, sd, n, seed)


def _joint_values_for(robot, times, position, holds=None, payload=None):
    """Joint values of a controller that knows the mean wire and no creep, moving evenly between the times."""
    mean = {k: np.array([[v]]) for k, v in CORE.items()}
    wires = uncreeping(draws.for_robot(robot, draws.WireDraws({k: v[0] for k, v in mean.items()}, 1000.0)))
    payload = np.zeros(len(times)) if payload is None else np.asarray(payload, float)
    history = History(
        np.asarray(times, float),
        None,
        np.asarray(position, float),
        np.tile(np.eye(3), (len(times), 1, 1)),
        payload,
        np.zeros((len(times), 3)),
        None if holds is None else np.asarray(holds),
    )
    tau = commanded.wanted_tensions(robot, history)
    joint = [
        inverse.commands(history.robot_at(robot, k), wires, x[None], np.eye(3)[None], t[None]).joint_m[0]
        for k, (x, t) in enumerate(zip(history.position_m, tau, strict=True))
    ]
    return replace(history, joint_m=np.array(joint), position_m=None, rotation=None)


def _simulated(robot, theta, history, extra_m=0.0):
    """Poses and tensions at the rows: every wire's creep by a stiff integrator, ``dg/du = k2 (B tau^U - g)``."""
    times, q = history.times_s, None
    g, since = np.zeros(robot.legs), times[0]
    rigs = {}
    for m in set(history.payload_kg):  # a payload at the reference point
        centre = robot.centre_of_mass_m * robot.mass_kg / (robot.mass_kg + m)
        loaded = replace(robot, mass_kg=robot.mass_kg + m, centre_of_mass_m=centre)
        rigs[m] = Rig(loaded, "hooke", theta["k1"])
    near = {}

    def pose(time, g, row):
        rig = rigs[history.payload_kg[row]]
        joint = [np.interp(time, times, column) for column in history.joint_m.T]
        zero = (np.array(joint) + extra_m)[None] * (1 + g / 1000.0)
        start = near.get("q", rig.start(robot.home_m))
        there, ok = rig.newton(start, zero)
        assert ok.all()
        near["q"] = there
        return rig, there, rig.tension(there, zero)[0]

    places, turns, tensions = [], [], []
    for k in range(len(times)):
        if k:
            low, high = ((t - since) ** theta["N"] for t in times[k - 1 : k + 1])

            def rate(u, g, row=k - 1, since=since):
                time = since + max(u, 0.0) ** (1 / theta["N"])
                tau = pose(time, g, row)[2]
                return theta["k2"] * (theta["B"] * np.maximum(tau, 0) ** theta["U"] - g)

            g = solve_ivp(rate, (low, high), g, "LSODA", rtol=1e-7, atol=1e-9).y[:, -1]
            if history.hold[k] != history.hold[k - 1]:
                since = times[k]
        rig, q, tau = pose(times[k], g, k)
        x, R = rig.place(q)
        places.append(x[0] + rig.middle), turns.append(R[0]), tensions.append(tau)
    return np.array(places), np.array(turns), np.array(tensions)


def _theta(wires, j):
    """One column's parameters, a value a wire."""
    return {
        k: v[:, min(j, v.shape[1] - 1)] if k != "N" else float(v.flat[min(j, v.size - 1)])
        for k, v in wires.theta.items()
    }


TIMES = [0.0, 60.0, 70.0, 400.0, 420.0, 900.0]
HOLDS = [1, 1, 2, 2, 3, 3]


def _places(robot):
    a, b = robot.home_m, robot.home_m + 0.05 * robot.span_m * np.array([1.0, 0.3, 0.5])
    return [a, a, b, b, a, a]


@pytest.mark.parametrize("name", ["hangprinter-4", "cogiro-desk"])
def test_a_history_is_followed_as_a_simulation_of_its_own_has_it(name):
    robot = schema.read_robot_file(name)
    payload = 0.1 * robot.mass_kg * np.array([0, 0, 0, 1, 1, 0.0])
    history = _joint_values_for(robot, TIMES, _places(robot), HOLDS, payload)
    known = unknowns(robot, _line(2), Uncertain(2e-3, 0.05), np.random.default_rng(0))
    rng, legs = np.random.default_rng(1), robot.legs
    own, reference = rng.standard_normal((2, 3 * legs)), rng.standard_normal((2, legs))
    wires, error = known.columns(np.concatenate([reference, known.draws[:, legs : -3 * legs], own], 1))
    starts = clock_starts(history, np.ones((6, robot.legs)))
    track = follow_log(robot, wires, history, history.joint_m, (robot.home_m, np.eye(3)), starts, error)
    assert track.hold.tolist() == [0, 0, 1, 1, 2, 2]
    for j in range(2):
        x, R, tau = _simulated(robot, _theta(wires, j), history, error[j])
        drifted = np.linalg.norm(x[-1] - robot.home_m)
        np.testing.assert_allclose(track.position_m[j], x, atol=3e-4 * drifted)
        np.testing.assert_allclose(track.rotation[j], R, atol=1e-6)
        np.testing.assert_allclose(track.tension_N[j], tau, atol=5e-4 * tau.max())


def test_bands_cover_the_truth_and_readings_narrow_them():
    robot = schema.read_robot_file("cogiro-desk")
    history = _joint_values_for(robot, TIMES, _places(robot), HOLDS)
    errors, start = Uncertain(1e-3, 0.05, 0.02, 5e-4), (robot.home_m, np.eye(3))
    line = _line(80)
    blind = estimate_poses(robot, line, history, start, errors, np.random.default_rng(2))
    truths = unknowns(robot, _line(2, seed=9), errors, np.random.default_rng(3))
    wires, error = truths.columns(truths.draws)
    rng = np.random.default_rng(4)
    deviations, blinds, narrower = [], [], []
    for j in range(2):
        x, R, tau = _simulated(robot, _theta(wires, j), history, error[j])
        read = replace(
            history,
            tension_N=tau + 0.02 * rng.standard_normal(tau.shape),
            tilt_rad=roll_and_pitch(R) + 5e-4 * rng.standard_normal((len(x), 2)),
        )
        found = estimate_poses(robot, line, read, start, errors, np.random.default_rng(5))
        assert found.converged
        assert found.misfit < 2
        for kept, track in ((deviations, found.track), (blinds, blind.track)):
            kept.append((x - track.position_m.mean(0)) / track.position_m.std(0))
        narrower.append(found.track.position_m.std(0) / blind.track.position_m.std(0))
    for z in (deviations, blinds):
        assert 0.4 < np.sqrt(np.mean(np.square(z))) < 1.5
        assert (np.abs(z) < 1.7).mean() > 0.75
    assert np.mean(narrower) < 0.75


def test_corrected_joint_values_bring_the_platform_back():
    robot = schema.read_robot_file("linear-7")
    history = _joint_values_for(robot, TIMES, _places(robot))
    found = estimate_poses(
        robot, _line(40), history, (robot.home_m, np.eye(3)), Uncertain(1e-3), np.random.default_rng(0)
    )
    to = corrections.target(robot, history, found)
    np.testing.assert_allclose(to.position_m, _places(robot), atol=2e-4)  # nothing creeps there: about what was told
    joint = corrections.wanted(robot, history, found, to)
    rows = np.arange(len(TIMES))
    away = np.linalg.norm(found.track.position_m - to.position_m, axis=-1)
    assert away[:, -1].min() > 5e-4
    assert corrections.error_left(robot, history, found, to, joint, rows).max() < 1e-7
    mean = corrections.error_left(robot, history, found, to, joint.mean(0), rows)
    assert np.median(mean[:, -1]) < 0.4 * np.median(away[:, -1])


def test_clocks_start_with_a_change_of_load_and_not_with_small_corrections():
    robot = schema.read_robot_file("hangprinter-4")
    up = robot.home_m + np.array([0, 0, 1e-4])
    lift = robot.home_m + np.array([0.3, 0.2, 0.0])
    places = [robot.home_m, up, robot.home_m, lift, lift, lift]
    history = _joint_values_for(robot, TIMES, places, payload=[0, 0, 0, 0, 0, 1.0])
    plain = uncreeping(draws.for_robot(robot, _line(1)))
    track = follow_log(robot, plain, history, history.joint_m, (robot.home_m, np.eye(3)), np.zeros(1))
    starts = clock_starts(history, track.tension_N[0])
    assert starts[0] == 0
    assert starts[-1] == TIMES[-1]  # with the payload
    assert len(starts) > 2
    assert ((starts[1:-1] > 70) & (starts[1:-1] < 400)).all()
    assert clock_starts(history, track.tension_N[0], np.inf).tolist() == [0.0]
    assert clock_starts(replace(history, hold=np.array(HOLDS)), track.tension_N[0]).tolist() == [0.0, 70.0, 420.0]


def test_when_clocks_start_does_not_depend_on_the_sampling():
    few = replace(_joint_values_for(schema.read_robot_file("hangprinter-4"), [0, 100], np.tile([0, 0, 1.0], (2, 1))))
    tension = np.array([[2.0, 3.0, 1.0], [4.0, 2.5, 1.5]])
    starts = clock_starts(few, tension)
    times = np.linspace(0, 100, 7)
    many = replace(few, times_s=times, payload_kg=np.zeros(7), payload_m=np.zeros((7, 3)))
    np.testing.assert_allclose(
        clock_starts(many, np.stack([np.interp(times, [0, 100], c) for c in tension.T], 1)), starts
    )
    assert starts[1] == pytest.approx(10.0)  # 0.2 N of a mean of 2 N, at 0.02 N/s
    assert 6 < len(starts) < 12


@pytest.mark.parametrize("name", ["cogiro-desk", "linear-7"])
def test_an_even_motion_of_the_joints_needs_no_rows_between(name):
    robot = schema.read_robot_file(name)
    a, b = robot.home_m, robot.home_m + 0.2 * robot.span_m * np.array([1.0, 0.3, 0.2])
    few = _joint_values_for(robot, [0, 100, 110, 400], [a, a, b, b])
    times = np.unique(np.concatenate([few.times_s, np.arange(100, 110, 0.1)]))
    many = replace(
        few,
        times_s=times,
        joint_m=np.stack([np.interp(times, few.times_s, c) for c in few.joint_m.T], 1),
        payload_kg=np.zeros(len(times)),
        payload_m=np.zeros((len(times), 3)),
    )
    start, ends = (robot.home_m, np.eye(3)), {}
    for kind, history in (("few", few), ("many", many)):
        found = estimate_poses(robot, _line(2), history, start, Uncertain(), np.random.default_rng(0))
        assert found.plain.position_m.shape[1] == len(history.times_s)
        rows = np.searchsorted(history.times_s, [110, 400])
        ends[kind] = found, (found.track.position_m - found.plain.position_m)[:, rows]
    (sparse, drift), (dense, right) = ends["few"], ends["many"]
    assert len(sparse.starts_s) > 3
    assert abs(len(sparse.starts_s) - len(dense.starts_s)) <= 1  # one more just before the stop
    np.testing.assert_allclose(drift, right, atol=0.005 * np.linalg.norm(right, axis=-1).max())


def test_commanded_poses_need_no_rows_between():
    robot = schema.read_robot_file("cogiro-desk")
    ends = np.array([[0.0, *robot.home_m], [300.0, *(robot.home_m + [0.1, 0.05, 0.1])], [600.0, *robot.home_m]])
    times = np.arange(0, 601, 10.0)
    tables = {n: [np.interp(t, ends[:, 0], c) for c in ends.T] for n, t in (("few", ends[:, 0]), ("many", times))}
    drifts = {}
    for name, columns in tables.items():
        history = _joint_values_for(robot, columns[0], np.stack(columns[1:], 1))
        history = replace(
            history,
            joint_m=None,
            position_m=np.stack(columns[1:], 1),
            rotation=np.tile(np.eye(3), (len(columns[0]), 1, 1)),
        )
        found, joint = commanded.drift_along(robot, _line(3), history, Uncertain(), np.random.default_rng(0))
        assert joint.shape == (3, len(columns[0]), 8)
        drifts[name] = found.track.position_m[:, -1] - robot.home_m
        assert np.abs(found.track.position_m[:, 0] - robot.home_m).max() < 1e-9
    assert np.linalg.norm(drifts["few"], axis=1).min() > 2e-4
    np.testing.assert_allclose(drifts["few"], drifts["many"], atol=0.02 * np.abs(drifts["few"]).max())


@pytest.mark.parametrize("n", [1, 2, 17, 64, 201])
def test_deviations_are_standard_normal_and_even(n):
    seeds = range(4000 // n)
    drawn = np.array([even_normals(n, 3, np.random.default_rng(seed)) for seed in seeds])
    every = drawn.reshape(-1, 3)
    np.testing.assert_allclose(every.mean(0), 0.0, atol=0.05)
    np.testing.assert_allclose(every.std(0), 1.0, atol=0.04)
    np.testing.assert_allclose(np.quantile(every, [0.05, 0.95], axis=0).T, [[-1.645, 1.645]] * 3, atol=0.09)
    np.testing.assert_allclose(np.corrcoef(every.T), np.eye(3), atol=0.06)
    one = drawn[:, n // 2]  # whichever draw it is, it knows nothing of its place
    assert np.abs(one.mean(0)).max() < 4.5 / np.sqrt(len(one))
    assert np.abs(drawn.mean(1)).max() < 6 / n  # independent ones are off by up to 4 / sqrt(n)
    np.testing.assert_array_equal(drawn[0], even_normals(n, 3, np.random.default_rng(0)))


@pytest.mark.parametrize("n", [63, 64])
def test_specimens_have_the_stated_spread_and_nothing_to_do_with_the_line(n):
    robot, line = schema.read_robot_file("hangprinter-4"), _line(n)
    together, spread = [], []
    for seed in range(20):
        known = unknowns(robot, line, Uncertain(2e-3, 0.05), np.random.default_rng(seed))
        wires, error = known.columns(known.draws)
        ratio = np.log(wires.theta["k1"] / line.parameters["k1"])
        together.append([np.corrcoef(np.log(line.parameters["k1"]), own)[0, 1] for own in ratio])
        np.testing.assert_allclose(ratio.mean(1), 0.0, atol=1e-3)
        spread.append([ratio.std(1) / 0.05, error.std(0) / 2e-3])
        np.testing.assert_allclose(error.mean(0), 0.0, atol=4e-5)
    np.testing.assert_allclose(np.mean(spread, 0), 1.0, rtol=0.03)
    assert np.std(spread) < 0.05  # of independent draws 0.09
    assert abs(np.mean(together)) < 4 / np.sqrt(n * np.size(together))
    assert np.std(together) == pytest.approx(1 / np.sqrt(n), rel=0.3)


def test_readings_move_draws_to_the_posterior_of_a_linear_problem():
    rng = np.random.default_rng(0)
    d, m, t, n = 3, 2, 5, 20000
    of = Sensors(np.array([0.3, 0.2]), np.array([0.0, 0.1]))
    slope, true = rng.standard_normal((t, d, m)), rng.standard_normal(d)
    y = np.einsum("tdm,d->tm", slope, true) + 0.2 * rng.standard_normal((t, m))
    z = rng.standard_normal((n, d + m))
    found = Information.none(d, m, n)
    for k in range(t):
        found.add(of, slope[k], y[k] - z[:, :d] @ slope[k] - of.offset * z[:, d:], 1.0)
    after = z + found.moves(np.zeros((n, d + m)), rng.standard_normal((n, d + m)))
    H = np.concatenate([np.concatenate([slope[k].T, np.diag(of.offset)], 1) for k in range(t)])
    inside = np.linalg.inv(np.eye(d + m) + H.T @ np.diag(np.tile(of.error**-2, t)) @ H)
    mean = inside @ H.T @ (np.tile(of.error**-2, t) * y.ravel())
    np.testing.assert_allclose(after.mean(0), mean, atol=0.03)
    np.testing.assert_allclose(np.cov(after.T), inside, atol=0.03)
    np.testing.assert_allclose(found.sd, np.sqrt(np.diag(inside)))
    assert found.sd[d + 1] > 0.1  # what stays of a sensor's error is never averaged away


@pytest.mark.parametrize("kept", [0.0, 0.25, 0.5])
def test_bands_are_not_too_narrow_whatever_share_of_an_error_up_to_a_half_stays(kept):
    rng = np.random.default_rng(1)
    d, t = 4, 6
    of = Sensors(np.array([0.3]), np.zeros(1))
    slope = rng.standard_normal((t, d, 1))
    found = Information.none(d, 1, 1)
    for row in slope:
        found.add(of, row, np.zeros((1, 1)), 1.0)
    claimed = np.linalg.inv(found.matrix + np.eye(d + 1))[:d]
    H = np.concatenate([slope[..., 0], np.full((t, 1), of.offset[0])], 1)
    gain = claimed @ H.T / of.error[0] ** 2
    of_readings = of.error[0] ** 2 * ((1.0 - kept) * np.eye(t) + kept)
    left = np.eye(d) - gain @ slope[..., 0]
    errors = left @ left.T + gain @ of_readings @ gain.T
    assert np.linalg.eigvalsh(claimed[:, :d] - errors).min() > -1e-12


def _curved(z0, z1):
    """Tensions of one wire at two rows, curved in the unknowns by more than the sensor's error."""
    return np.stack([5 + 0.3 * z0 + 0.08 * z0**2, 5 + 0.2 * z0 - 0.3 * z1 + 0.1 * z0 * z1], -1)


def _hinged(z0, z1):
    """The wire is slack where z0 is positive; z1 is read beside it, at the second row."""
    return np.stack([np.maximum(-z0, 0.0) * 0.8, np.maximum(-z0, 0.0) * 0.8], -1)


@pytest.mark.parametrize(("tension", "read", "least"), [(_curved, [5.5, 5.3], 0.5), (_hinged, [0.02, -0.03], 0.3)])
def test_draws_given_readings_are_those_of_a_curved_posterior(tension, read, least):
    of = Sensors(np.array([0.1, 1.0, 1.0]), np.zeros(3))
    values = np.full((2, 3), np.nan)
    values[:, 0] = read
    rng, n = np.random.default_rng(0), 4000

    def known():
        return LogUnknowns(None, None, np.zeros(2), np.eye(2), rng.standard_normal((n, 2)))

    def way(white, name, without):
        tau = tension(*white.T) * (0.0 if without.any() else 1.0)
        columns = (len(white), 2)
        return Track(
            np.zeros((*columns, 3)),
            np.tile(np.eye(3), (*columns, 1, 1)),
            tau[..., None],
            np.zeros((*columns, 1)),
            np.zeros(2, np.int64),
        )

    given = LogReadings(values, np.ones(2), of)
    loose = conditioning.slack_wires(given, 1)
    assert loose.tolist() == [tension is _hinged]
    mode = conditioning.find_mode(known(), given, way, loose)
    assert mode.converged
    found = conditioning.draw_posterior(known, given, mode, way, rng)
    grid = np.linspace(-4, 4, 81)
    z = np.stack(np.meshgrid(grid, grid, grid, indexing="ij"))
    left = np.array(read) - tension(z[0], z[1]) - of.offset[0] * z[2][..., None]
    weight = np.exp(-0.5 * ((left / of.error[0]) ** 2).sum(-1) - 0.5 * (z**2).sum(0))
    weight /= weight.sum()
    for i in range(2):
        mean = (weight * z[i]).sum()
        sd = np.sqrt((weight * (z[i] - mean) ** 2).sum())
        assert found.white[:, i].mean() == pytest.approx(mean, abs=0.08 * sd)
        assert found.white[:, i].std() == pytest.approx(sd, rel=0.08)
        low = grid[np.searchsorted(np.cumsum(np.moveaxis(weight, i, 0).sum((1, 2))), 0.05)]
        assert np.quantile(found.white[:, i], 0.05) == pytest.approx(low, abs=0.1 * sd + 0.05)
    assert least * n < found.effective <= n


def test_few_draws_that_agree_with_the_readings_are_said(fitted, tmp_path, capsys):  # noqa: F811
    robot = schema.read_robot_file("hangprinter-4")
    history = _joint_values_for(robot, TIMES[:2], _places(robot)[:2])
    rows = [[t, *j, *tau] for t, j, tau in zip(TIMES, history.joint_m, [[1.14, 1.07, 1.1, 5.28]] * 2, strict=False)]
    head = [f"{kind}_{i}_{unit}" for kind, unit in (("joint", "m"), ("tension", "N")) for i in range(1, 5)]
    table_of = [["time_s", *head], *rows]
    (tmp_path / "log.csv").write_text("\n".join(",".join(map(str, row)) for row in table_of) + "\n")
    arguments = ["pose", "hangprinter-4", "--wires", str(fitted), "--joints", str(tmp_path / "log.csv")]
    assert main([*arguments, "--draws", "20", "--output", str(tmp_path / "out")]) == 0
    content = read_json(tmp_path / "out" / "pose.json")
    assert 0 < content["readings"]["effective_draws"] <= 20
    assert any("of 20 draws agree with the readings" in notice["text"] for notice in content["warnings"])
    assert "independent ones" in (tmp_path / "out" / "report.html").read_text()


def test_readings_that_too_few_draws_agree_with_are_not_used(monkeypatch):
    robot = schema.read_robot_file("hangprinter-4")
    history = _joint_values_for(robot, TIMES[:2], _places(robot)[:2])
    read = replace(history, tension_N=np.array([[1.14, 1.07, 1.1, 5.28]] * 2))
    arguments = ((robot.home_m, np.eye(3)), Uncertain(1e-3))
    blind = estimate_poses(robot, _line(12), history, *arguments, np.random.default_rng(0))
    used = estimate_poses(robot, _line(12), read, *arguments, np.random.default_rng(0))
    monkeypatch.setattr(
        "wirebayes.robot.history.estimate.draw_posterior",
        lambda *given: replace(conditioning.draw_posterior(*given), effective=5.0),
    )
    unused = estimate_poses(robot, _line(12), read, *arguments, np.random.default_rng(0))
    assert used.used
    assert not unused.used
    np.testing.assert_array_equal(unused.track.position_m, blind.track.position_m)
    assert (used.track.position_m != blind.track.position_m).any()


def _standing_still(places=None):
    """Three rows of a robot that stands at home; its commanded poses."""
    robot = schema.read_robot_file("hangprinter-4")
    history = _joint_values_for(robot, [0, 60, 120], [robot.home_m] * 3)
    if places is not None:
        history = replace(history, position_m=np.array(places), rotation=np.tile(np.eye(3), (3, 1, 1)))
    return robot, history


def _answered(robot, history):
    with np.errstate(all="ignore"):
        return history_report(robot, _line(12), history, Uncertain(), (robot.home_m, np.eye(3)), 0)


def test_a_row_that_some_or_all_draws_lose_takes_no_other_row_with_it(monkeypatch):
    robot, history = _standing_still()
    whole = _answered(robot, history).content

    def falling(*given):
        found = estimate_poses(*given)
        for values in (found.track.position_m, found.track.rotation, found.track.tension_N):
            values[:5, 1], values[:, 2] = np.nan, np.nan
        return found

    monkeypatch.setattr("wirebayes.robot.history.answer.estimate_poses", falling)
    found = _answered(robot, history)
    content = found.content
    assert content["drift"][0]["held"].tolist() == [1.0, pytest.approx(7 / 12), 0.0]
    (head, rows), (changes, wanted) = found.tables["poses.csv"], found.tables["corrections.csv"]
    for label in ("mean", "sd", "q05", "q50", "q95"):
        columns = [head.index(f"{axis}_{label}_m") for axis in "xyz"]
        np.testing.assert_allclose(content["position_m"][label], [[row[i] for i in columns] for row in rows])
        assert np.isfinite(content["position_m"][label][:2]).all()
        assert np.isnan(content["position_m"][label][2]).all()
        np.testing.assert_array_equal(content["position_m"][label][0], whole["position_m"][label][0])
    columns = [changes.index(f"change_{i}_mm") for i in range(1, 5)]
    change = content["corrections"]["change_mm"]["mean"]
    np.testing.assert_allclose(change, [[row[i] for i in columns] for row in wanted])
    assert np.isfinite(content["corrections"]["left_mm"]["q50"]).tolist() == [True, True, False]


def test_commanded_poses_out_of_reach_are_named_and_take_no_other_row_with_them():
    robot, history = _standing_still([schema.read_robot_file("hangprinter-4").home_m, [9.0, 0.0, 9.0], [0.0, 0.0, 0.4]])
    found = _answered(robot, history)
    named = "no tensions within the bounds hold the platform at the pose commanded at 60 s: no corrections lead there"
    assert found.content["warnings"][0] == {"kind": "unheld", "text": named}
    assert np.isfinite(found.content["corrections"]["change_mm"]["mean"]).all(1).tolist() == [True, False, True]
    far = np.tile([9.0, 0.0, 9.0], (3, 1))
    beyond = _answered(*_standing_still(far))
    assert "commanded at 0, 60, 120 s: no corrections" in beyond.content["warnings"][0]["text"]
    within = _answered(*_standing_still())
    assert not any("corrections" in notice["text"] for notice in within.content["warnings"])


def test_an_inclinometer_reads_what_turned_the_platform():
    roll, pitch, yaw = 0.1, -0.2, 1.3
    turn = rotation.matrix(np.array([0, 0, yaw])) @ rotation.matrix(np.array([0, pitch, 0]))
    turn = turn @ rotation.matrix(np.array([roll, 0, 0]))
    np.testing.assert_allclose(roll_and_pitch(turn), [roll, pitch], atol=1e-12)


def test_a_payload_moves_mass_and_centre():
    robot = schema.read_robot_file("linear-7")
    loaded = with_payload(robot, 0.9, np.array([0.1, 0.0, -0.2]))
    assert loaded.mass_kg == pytest.approx(1.8)
    np.testing.assert_allclose(loaded.centre_of_mass_m, [0.05, 0.0, -0.1])
    assert with_payload(robot, 0.0, np.ones(3)) is robot


HEAD = "time_s,joint_1_m,joint_2_m,joint_3_m,joint_4_m"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (",,\n", "line 1: found nothing, expected a header"),
        (HEAD.replace("joint_4", "joint_5") + "\n", "line 1, column 5: found 'joint_5_m'"),
        ("time_s,joint_1_m,joint_2_m,joint_3_m\n", "line 1: found no column joint_4_m, expected a header of time_s"),
        (HEAD + ",x_m\n", "line 1: found no column y_m"),
        (HEAD + ",time_s\n", "line 1, column 6: found time_s a second time"),
        (HEAD + "\n0,1,1,1,1\n", "found 1 row of values, expected two or more"),
        (HEAD + "\n0,1,1,1,1\n\n0,1,1,1,1\n", "line 4, column 1 (time_s): found 0, expected a time after 0 s"),
        (HEAD + "\n0,1,1,1,1\n9,1,1,1\n", "line 3, column 4: found 4 fields, expected 5 fields"),
        (
            HEAD + "\n0,1,1,,1\n9,1,1,1,1\n",
            "line 2, column 4 (joint_3_m): found an empty cell, expected a number of at most 1e+09 in size",
        ),
        (HEAD + "\n0,1,inf,1,1\n9,1,1,1,1\n", "line 2, column 3 (joint_2_m): found 'inf'"),
        (
            HEAD + ",payload_kg\n0,1,1,1,1,-1\n9,1,1,1,1,1\n",
            "line 2, column 6 (payload_kg): found '-1', expected a number from 0 to 1e+09",
        ),
        (HEAD + "\n0,1,1,1,1\n60,-1,1,1,1\n", "line 3, column 2 (joint_1_m): found '-1', expected a length above 0"),
        (HEAD + "\n0,1,1,0.0,1\n60,1,1,1,1\n", "line 2, column 4 (joint_3_m): found '0.0', expected a length above 0"),
        (
            HEAD + "\n0,1,1,1,1\n60,1,1776,1,1\n",
            "line 3, column 3 (joint_2_m): found '1776', expected metres, at most 115, 10 times the robot's size",
        ),
        (HEAD + ",hold\n0,1,1,1,1,1.5\n9,1,1,1,1,1\n", "line 2, column 6 (hold): found '1.5', expected a whole number"),
    ],
)
def test_a_mistake_in_a_history_is_named_by_line_and_column(text, message):
    robot = schema.read_robot_file("hangprinter-4")
    with pytest.raises(InputError) as caught:
        table.parse_log(csv_table(Path("log.csv"), text), robot, table.measured_columns)
    assert str(caught.value).startswith((f"log.csv, {message}", f"log.csv: {message}"))
    assert "\n" not in str(caught.value)


def test_motor_angles_may_be_negative_but_not_the_lengths_they_pay_out():
    robot = schema.read_robot_file("hangprinter-4")
    zeros = np.zeros(4)
    robot = replace(robot, drums=Drums(zeros + 0.05, zeros, zeros + np.inf, zeros, zeros, zeros - 1.0))
    head = ",".join(["time_s", *(f"motor_{i}_rad" for i in range(1, 5))])
    good = f"{head}\n0,-125,-136,-124,-160\n9,-125,-136,-124,-160\n"
    assert table.parse_log(csv_table(Path("log.csv"), good), robot, table.measured_columns).joint_m[
        0, 3
    ] == pytest.approx(8.0)
    with pytest.raises(InputError) as caught:
        table.parse_log(csv_table(Path("log.csv"), good.replace("9,-125", "9,125")), robot, table.measured_columns)
    wrong = "line 3, column 2 (motor_1_rad): found '125', which pays out -6.25 m, expected a length above 0"
    wrong += "; the motor's angle is in radians, zero where no wire is paid out"
    assert str(caught.value) == f"log.csv, {wrong}"


def test_a_linear_actuator_may_stand_at_zero_or_below():
    robot = schema.read_robot_file("linear-7")
    text = ",".join(["time_s", *(f"joint_{i}_m" for i in range(1, 8))])
    text += "\n0,-0.1,0,0.1,0.1,0.1,0.1,0.1\n9,-0.1,0,0.1,0.1,0.1,0.1,0.1\n"
    assert table.parse_log(csv_table(Path("log.csv"), text), robot, table.measured_columns).joint_m[0, :2].tolist() == [
        -0.1,
        0.0,
    ]


def test_the_commands_answer_and_repeat_to_the_byte(fitted, tmp_path, capsys):  # noqa: F811
    robot, times = schema.read_robot_file("hangprinter-4"), TIMES[:4]
    history = _joint_values_for(robot, times, _places(robot)[:4])
    with open(tmp_path / "log.csv", "w") as file:
        writer = csv.writer(file)
        legs = range(1, 5)
        writer.writerow(["time_s", *(f"joint_{i}_m" for i in legs), *(f"tension_{i}_N" for i in legs)])
        for k, time in enumerate(times):
            writer.writerow([time, *history.joint_m[k], *(["", "", "", ""] if k else [1.14, 1.07, "", 5.28])])
    (tmp_path / "way.csv").write_text("time_s,x_m,y_m,z_m,payload_kg\n0,0,0,.5,0\n60,0.1,0,.5,.1\n600,0.1,0,.5,.1\n")
    both = ["pose", "hangprinter-4", "--wires", str(fitted), "--draws", "12"]
    for option, file in (("--joints", "log.csv"), ("--trajectory", "way.csv")):
        outs = [tmp_path / f"{file}-{i}" for i in range(2 if option == "--joints" else 1)]
        for out in outs:
            assert main([*both, option, str(tmp_path / file), "--output", str(out)]) == 0
        shown = capsys.readouterr()
        assert "after" in shown.out
        for name in ("pose.json", "poses.csv", "corrections.csv", "motion.svg"):
            assert (outs[0] / name).read_bytes() == (outs[-1] / name).read_bytes()
        content = read_json(outs[0] / "pose.json")
        rows = list(csv.DictReader((outs[0] / "poses.csv").read_text().splitlines()))
        assert len(rows) == content["history"]["rows"]
        assert float(rows[-1]["distance_q05_mm"]) < float(rows[-1]["distance_q95_mm"])
        assert content["drift"][0]["distance_mm"]["q50"][-1] == pytest.approx(float(rows[-1]["distance_q50_mm"]))
        page = (outs[0] / "report.html").read_text()
        assert "data:image/svg+xml" in page
        assert "<td>" in page
    centre = tmp_path / "centre.csv"
    centre.write_text("time_s,x_m,y_m,z_m,payload_x_m,payload_y_m,payload_z_m\n0,0,0,.6,0,0,.1\n60,0,0,.6,0,0,.1\n")
    refused = [
        (["--joints", str(tmp_path / "log.csv"), "--trajectory", str(tmp_path / "way.csv")], "found both"),
        (["--trajectory", str(tmp_path / "log.csv")], "line 1, column 2: found 'joint_1_m'"),
        (["--joints", str(tmp_path / "none.csv")], "found no such file"),
        (["--joints", str(tmp_path / "log.csv"), "--times", "0,9"], "--times"),
        (["--joints", str(tmp_path / "log.csv"), "--tolerance", "1"], "--tolerance and --tolerance-tilt: found beside"),
        (["--trajectory", str(centre)], "centre.csv, line 1, column 5: found payload_x_m without payload_kg"),
        (["--payload", "-1"], "--payload: found -1, expected kilograms, 0 or more"),
        (["--payload-at", "0,0,.1"], "--payload-at: found 0,0,.1 without --payload, expected both"),
        (["--reference-sd", "2"], "--reference-sd: found beside a single pose"),
        (["--tension-sd", "2"], "--tension-sd: found beside a single pose"),
        (["--tilt-sd", "2"], "--tilt-sd: found beside a single pose"),
    ]
    for options, message in refused:
        assert main([*both, *options, "--output", str(tmp_path / "no")]) == 2
        line = capsys.readouterr().err.strip()
        assert message in line
        assert "\n" not in line
        assert not (tmp_path / "no").exists()


def test_a_trajectory_that_cannot_be_held_is_an_answer(fitted, tmp_path, capsys):  # noqa: F811
    (tmp_path / "way.csv").write_text("time_s,x_m,y_m,z_m\n0,0,0,.6\n60,9,0,.6\n")
    arguments = ["pose", "linear-7", "--wires", str(fitted), "--trajectory", str(tmp_path / "way.csv")]
    assert main([*arguments, "--output", str(tmp_path / "out"), "--draws", "5"]) == 0
    assert "no tensions within the bounds hold the platform" in capsys.readouterr().err
    assert (tmp_path / "out" / "report.html").is_file()


def test_readings_are_predicted_in_the_order_of_the_sensors():
    robot = schema.read_robot_file("linear-7")
    history = _joint_values_for(robot, TIMES[:2], _places(robot)[:2])
    wires = draws.for_robot(robot, _line(2))
    track = follow_log(robot, wires, history, history.joint_m, (robot.home_m, np.eye(3)), np.zeros(1))
    h = predicted_readings(track)
    assert h.shape == (2, 2, 9)
    np.testing.assert_array_equal(h[..., :7], track.tension_N)

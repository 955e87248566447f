"""Winches that drive several lines: commands against an energy minimiser, tables, firmware, calibration."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from analyses.robots.hanging import lowest_energy
from tests.robot.test_commands import fitted  # noqa: F401 - a fixture
from tests.robot.test_history import CORE, _joint_values_for, _simulated
from wirebayes.cli import main
from wirebayes.commands.import_robot import import_robot
from wirebayes.errors import InputError
from wirebayes.io.run_folder import read_json
from wirebayes.robot.export import files
from wirebayes.robot.history.history import History
from wirebayes.robot.history.live import LiveEstimator
from wirebayes.robot.history.unknowns import Uncertain
from wirebayes.robot.mechanics import joint_columns, schema
from wirebayes.robot.mechanics import rotation as turning
from wirebayes.robot.mechanics.draws import WireDraws
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion import forward, inverse
from wirebayes.robot.self_calibration import answer, predicted
from wirebayes.robot.self_calibration import session as sessions
from wirebayes.robot.self_calibration.unknowns import StatedErrors

G = 9.80665


def pairs(rng, winches, off=0.0):
    """A platform on pairs of parallel lines, each pair on one winch; the exit points are `off` spans from that."""
    base, legs = schema.read_robot_file("cogiro"), 2 * winches
    span = np.exp(rng.uniform(np.log(0.5), np.log(8.0)))
    turn = np.repeat(2 * np.pi * (np.arange(winches) + rng.uniform(-0.1, 0.1, winches)) / winches, 2)
    outward = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(legs)])
    aside = np.column_stack([-np.sin(turn), np.cos(turn), np.zeros(legs)]) * np.tile([-1.0, 1.0], winches)[:, None]
    half = rng.uniform(0.05, 0.12) * span
    exits = 0.5 * span * outward + half * aside + [0.0, 0.0, span] + off * span * rng.normal(size=(legs, 3))
    mass = np.exp(rng.uniform(np.log(0.05), np.log(50.0)))
    robot = replace(
        base, exit_m=exits, platform_m=0.1 * span * outward + half * aside, lines=np.ones(legs),
        beyond_m=np.zeros(legs), mass_kg=mass, actuator=("drum",) * legs, ratio=np.zeros(legs),
        wire_m=np.zeros(legs), wire=("default",) * legs, pulleys=None, drums=None, mass_kg_m=None,
        centre_of_mass_m=0.01 * span * np.array([*rng.normal(size=2), -2.0]), home_rotation_rad=np.zeros(3),
        home_m=span * np.array([*rng.uniform(-0.06, 0.06, 2), rng.uniform(0.2, 0.5)]),
        rule=replace(base.rule, lowest_N=0.001 * mass * G, highest_N=20.0 * mass * G),
        winch=np.repeat(np.arange(winches), 2),
    )  # fmt: skip
    return robot, float(np.exp(rng.uniform(np.log(30.0), np.log(3000.0)))) * mass * G


def alike(robot, k1):
    return Wires("hooke", "saturating", {"k1": np.full((1, 1), k1)}, np.full((robot.legs, 1), 1000.0))


def commanded(robot, k1):
    """Commands for the home position; None where no tensions hold it."""
    x, level = robot.home_m[None], np.eye(3)[None]
    tau = inverse.tensions(robot, x, level)
    found = inverse.commands(robot, alike(robot, k1), x, level, tau)
    return found if found.feasible[0] and (found.tension_N[0] > 0).all() else None


@pytest.mark.parametrize("winches", [3, 4])
def test_commands_lead_to_the_position_by_an_energy_minimiser_given_the_lengths_alone(winches):
    tried = 0
    for seed in range(30):
        rng = np.random.default_rng(seed)
        robot, k1 = pairs(rng, winches, 1e-3)
        found = commanded(robot, k1)
        if found is None:
            continue
        tried += 1
        np.testing.assert_array_equal(found.joint_m[0, ::2], found.joint_m[0, 1::2])
        np.testing.assert_array_equal(found.zero_m, found.joint_m)  # nothing has crept, and nothing is beyond
        R = found.rotation[0]
        start = robot.home_m + 0.01 * robot.size_m * rng.standard_normal(3)
        turn = Rotation.from_rotvec(0.01 * rng.standard_normal(3)).as_matrix() @ R
        x, turned, tension = lowest_energy(
            robot.exit_m,
            robot.platform_m,
            robot.centre_of_mass_m,
            robot.mass_kg,
            np.full(robot.legs, k1),
            found.zero_m[0],
            start,
            turn,
            minimize,
        )
        assert np.linalg.norm(x - robot.home_m) < 1e-6 * robot.span_m
        assert robot.size_m * Rotation.from_matrix(turned @ R.T).magnitude() < 1e-6 * robot.span_m
        assert np.abs(tension - found.tension_N[0]).max() < 1e-5 * tension.max()
    assert tried >= 10


def test_parallel_lines_of_one_winch_carry_alike_and_keep_the_orientation():
    """The weight hangs at the middle of three equal pairs, and the platform stands under the middle: by symmetry."""
    rng = np.random.default_rng(1)
    robot, _ = pairs(rng, 3)
    turn = np.repeat(2 * np.pi * np.arange(3) / 3, 2)
    outward = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(6)])
    aside = np.column_stack([-np.sin(turn), np.cos(turn), np.zeros(6)]) * np.tile([-0.1, 0.1], 3)[:, None]
    robot = replace(
        robot,
        exit_m=outward + aside + [0.0, 0.0, 2.0],
        platform_m=0.2 * outward + aside,
        centre_of_mass_m=np.array([0.0, 0.0, -0.1]),
        home_m=np.array([0.0, 0.0, 0.6]),
    )
    found = commanded(robot, 500.0 * robot.mass_kg * G)
    np.testing.assert_allclose(found.tension_N[0], found.tension_N[0, 0], rtol=1e-9)
    np.testing.assert_allclose(found.rotation[0], np.eye(3), atol=1e-9)
    # anywhere else stiff lines of equal length keep it, though they no longer carry alike
    aside_m = replace(robot, home_m=np.array([0.05, 0.1, 0.6]))
    turned = [turning.vector(commanded(aside_m, k * robot.mass_kg * G).rotation)[0] for k in (1e3, 1e5)]
    assert 1e-5 < np.linalg.norm(turned[0]) < 1e-2
    assert np.linalg.norm(turned[1]) == pytest.approx(0.01 * np.linalg.norm(turned[0]), rel=0.02)


def test_a_line_with_its_own_reference_makes_up_for_what_its_points_are_off():
    robot, k1 = pairs(np.random.default_rng(3), 3, 5e-3)
    x, level = robot.home_m[None], np.eye(3)[None]
    tau = inverse.tensions(robot, x, level)
    own = inverse.commands(replace(robot, winch=None), alike(robot, k1), x, level, tau).joint_m[0]
    trimmed = replace(robot, joint_offset_m=own - own[::2].repeat(2))
    found = inverse.commands(trimmed, alike(robot, k1), x, level, tau)
    np.testing.assert_allclose(found.tension_N, tau, rtol=1e-6)
    np.testing.assert_allclose(found.rotation[0], np.eye(3), atol=1e-8)
    np.testing.assert_allclose(found.zero_m[0], own, rtol=1e-9)


def test_creep_and_references_of_each_line_are_compensated_by_one_joint_value():
    robot, k1 = pairs(np.random.default_rng(1), 4)
    rng = np.random.default_rng(0)
    creep, error = 1e-3 * rng.random((8, 5)), 1e-4 * robot.span_m * rng.normal(size=(8, 5))
    x, level = robot.home_m[None], np.eye(3)[None]
    wires = replace(alike(robot, k1), theta={"k1": np.full((1, 5), k1)})
    found = inverse.commands(robot, wires, x, level, inverse.tensions(robot, x, level), creep, error)
    assert found.feasible.all()
    np.testing.assert_array_equal(found.joint_m[:, ::2], found.joint_m[:, 1::2])
    zero = (inverse.lengths(robot, found.joint_m)[0].T + error) * (1 + creep)
    there = forward.solve_equilibrium(robot, wires, zero.T, robot.beyond_m, x[0] + 0.01 * robot.size_m, level[0])
    assert there.found.all()
    np.testing.assert_allclose(there.position_m, np.broadcast_to(x, (5, 3)), atol=1e-8 * robot.span_m)


def test_lines_beyond_their_bounds_are_brought_to_them_where_a_winch_is_left():
    robot, k1 = pairs(np.random.default_rng(1), 4)
    loose = commanded(robot, k1)
    tight = replace(robot, rule=replace(robot.rule, lowest_N=1.05 * loose.tension_N.min()))
    held = commanded(tight, k1)
    assert held.tension_N.min() == pytest.approx(tight.rule.lowest_N, rel=1e-6)


FILE = """version = 1
name = "pairs"
description = "Three pairs of lines, a winch each, and one from above"
source = "made up"
freedom = "{freedom}"
[platform]
mass_kg = 2.0
[tension]
choice = "minimum_norm"
lowest_N = 1.0
highest_N = 120.0
[pose]
position_m = [0.0, 0.0, 0.3]
[workspace]
lower_m = [-0.3, -0.3, 0.1]
upper_m = [0.3, 0.3, 0.6]
"""


def printer(tmp_path, freedom="pose", drum="drum_radius_m = 0.05\ngear_ratio = 12.0\n", keys=""):
    """A Hangprinter with pairs of lines to A, B and C."""
    text = FILE.format(freedom=freedom)
    for k, name in enumerate("ABC"):
        angle = 2 * np.pi * k / 3
        out, aside = np.array([np.cos(angle), np.sin(angle), 0]), np.array([-np.sin(angle), np.cos(angle), 0])
        for side in (-0.2, 0.2):
            text += (
                f'[[leg]]\nwinch = "{name}"\nexit_point_m = {[*(1.5 * out + side * aside - [0, 0, 0.1]).round(4)]}\n'
            )
            text += f"platform_point_m = {[*(0.2 * out + side * aside).round(4)]}\n{drum}"
    text += f'[[leg]]\nwinch = "D"\nexit_point_m = [0, 0, 2.3]\nplatform_point_m = [0, 0, 0]\nlines = 2\n{drum}{keys}'
    file = tmp_path / "pairs.toml"
    file.write_text(text.replace("np.float64(", "").replace(")", ""))
    return file


def test_tables_have_a_column_of_each_winch(tmp_path):
    robot = schema.read_robot_file(printer(tmp_path))
    assert (robot.legs, robot.joints) == (7, 4)
    names = joint_columns.joint_columns(robot)
    assert names == ("joint_1_m", "joint_2_m", "joint_3_m", "joint_4_m")
    joint = joint_columns.joint_values(robot, names, np.array([[1.0, 2.0, 3.0, 4.0]]))
    assert joint.tolist() == [[1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 4.0]]
    straight = joint_columns.joint_columns(robot, ["straight_1_mm"])
    wire = joint_columns.joint_values(robot, straight, np.array([[1000.0, 2000.0, 3000.0, 2000.0]]))
    np.testing.assert_allclose(wire, [[1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 4.0]])
    turned = joint_columns.joint_columns(robot, ["motor_1_rad"])
    by_motor = joint_columns.joint_values(robot, turned, np.array([[12.0, 24.0, 36.0, 48.0]]))
    np.testing.assert_allclose(by_motor, 0.05 * np.array([[1, 1, 2, 2, 3, 3, 4]]))


def test_legs_of_one_winch_with_drums_of_two_sizes_are_refused(tmp_path):
    file = printer(tmp_path)
    file.write_text(file.read_text().replace("drum_radius_m = 0.05", "drum_radius_m = 0.06", 1))
    with pytest.raises(
        InputError, match=r"line \d+, leg 2, key drum_radius_m: found 0\.05, expected that of the first"
    ):
        schema.read_robot_file(file)


def test_firmware_gets_the_middle_of_each_pair_and_the_lines_on_each_spool(fitted, tmp_path):  # noqa: F811
    out = tmp_path / "out"
    assert main(["export", str(printer(tmp_path)), "--wires", str(fitted), "--output", str(out)]) == 0
    text = (out / "reprapfirmware.g").read_text()
    assert "M669 K6 A1300.00:0.00:-100.00 B-650.00:1125.80:-100.00 C-650.00:-1125.80:-100.00 D0.00:0.00:2300.00" in text
    assert "M666 O2:2:2:1" in text and "M666 U1:1:1:2" in text
    back = schema.read_robot_file(import_robot(out / "reprapfirmware.g", tmp_path / "back.toml"))
    assert back.winch.tolist() == [0, 0, 1, 1, 2, 2, 3]
    np.testing.assert_allclose(back.exit_m[:2], [[1.3, 0.0, -0.1]] * 2)
    (tmp_path / "odd.g").write_text(text.replace("M666 O2:2:2:1", "M666 O2:2:0:1"))
    with pytest.raises(InputError, match=r"line \d+, M666 O: found 2:2:0:1, expected whole numbers from 1 to 9"):
        import_robot(tmp_path / "odd.g", tmp_path / "odd.toml")


@pytest.mark.slow
def test_pose_and_its_log_know_winches(fitted, tmp_path):  # noqa: F811
    file, out = printer(tmp_path), tmp_path / "out"
    given = ["pose", str(file), "--wires", str(fitted), "--draws", "8"]
    assert main([*given, "--times", "0,60", "--output", str(out)]) == 0
    found = read_json(out / "pose.json")
    assert len(found["inverse"]["joint_value_m"]["mean"]) == 4 == len(found["inverse"]["motor_angle_rad"]["mean"])
    assert len(found["inverse"]["zero_tension_length_m"]["mean"]) == 7
    assert "4 winches with 7 lines command 4 of 6" in found["orientation"]["sentence"]
    joint = ",".join(str(v) for v in found["inverse"]["joint_value_m"]["mean"])
    log = tmp_path / "log.csv"
    log.write_text(f"time_s,{','.join(f'joint_{i}_m' for i in range(1, 5))}\n0,{joint}\n60,{joint}\n")
    assert main([*given, "--joints", str(log), "--reference-sd", "0", "--output", str(tmp_path / "log")]) == 0
    seen = read_json(tmp_path / "log" / "pose.json")
    np.testing.assert_allclose(seen["position_m"]["mean"][0], [0.0, 0.0, 0.3], atol=1e-4)
    drift = [one["displacement_mm"]["mean"][-1] for one in found["drift"] if one["specimen_spread"] == 0]
    moved = 1e3 * (np.array(seen["position_m"]["mean"][-1]) - [0.0, 0.0, 0.3])
    np.testing.assert_allclose(moved, drift[0], atol=0.2 * np.abs(drift[0]).max())
    header = (tmp_path / "log" / "corrections.csv").read_text().splitlines()[0]
    assert "joint_4_m" in header and "joint_5_m" not in header


def _calibrated(name, tmp_path):
    """The printer, or a drawn robot of pairs, and the stiffness of its lines."""
    if name == "printer":
        return schema.read_robot_file(printer(tmp_path, drum="")), 4000.0
    robot, k1 = pairs(np.random.default_rng(2), int(name[-1]), 1e-3)
    half = 0.1 * robot.span_m
    lowest, highest = 0.02 * robot.mass_kg * G, 5.0 * robot.mass_kg * G
    return replace(
        robot,
        lower_m=robot.home_m - half,
        upper_m=robot.home_m + half,
        rule=replace(robot.rule, lowest_N=lowest, highest_N=highest),
    ), min(k1, 300.0 * robot.mass_kg * G)


@pytest.mark.parametrize("name", ["printer", "pairs-3", "pairs-4"])
def test_calibration_finds_each_lines_own_length(name, tmp_path):
    """Pairs whose lines are off one by one, by encoders and by how each lies on its drum."""
    robot, k1 = _calibrated(name, tmp_path)
    small, weight = 1e-3 * robot.span_m / 3.0, robot.mass_kg * G / 20.0
    rng = np.random.default_rng(4)
    parameters = {"k1": k1, "B": 400.0 / k1, "U": 1.0, "k2": 0.03, "N": 0.5}
    line = WireDraws({k: v * np.exp(0.02 * rng.normal(size=50)) for k, v in parameters.items()}, 1000.0)
    prior = sessions.LengthPrior(line, 3 * small, 0.0)
    mean, covariance = prior.moments(robot.legs)
    value = rng.multivariate_normal(mean, covariance, 1)
    value[0, : robot.legs] = 2 * small * rng.normal(size=robot.legs)
    wires, error = prior.wires(robot, value)
    stops = 14
    x = rng.uniform(robot.lower_m, robot.upper_m, (8 * stops, 3))
    level = np.broadcast_to(np.eye(3), (len(x), 3, 3))
    lowest = robot.rule.lowest_N

    def varied(structure, load, low, high):
        return inverse.CHOICES["minimum_norm"](structure, load, rng.uniform(1.0, 4.0) * lowest, high)

    tau = inverse.tensions(robot, x, level, varied)
    joint = inverse.commands(robot, wires.part(np.zeros(len(x), int)), x, level, tau).joint_m
    kept = np.flatnonzero(np.isfinite(joint).all(1))[:stops]
    assert len(kept) == stops
    x, level, joint = x[kept], level[kept], joint[kept]
    log = sessions.Session(x, level, joint, np.full(stops, 30.0), np.ones(stops, bool), 0.05 * weight)
    real = predicted.predict_session(robot, prior, log, value)
    readings = real.readings[0] + rng.normal(size=real.readings.shape[1])
    encoder = 0.1 * small * rng.normal(size=(stops, robot.joints))[:, robot.winch]
    read = joint + encoder + 0.1 * small * rng.normal(size=joint.shape)
    nowhere = replace(log, position_m=np.full_like(x, np.nan), rotation=np.full(level.shape, np.nan), joint_m=read)
    found = answer.calibration_report(robot, prior, StatedErrors(), nowhere, readings, 0, visits=0).content
    assert found["usable"], found["warnings"]
    off = np.array(found["references_m"]["mean"]) - error[0]
    assert np.abs(off / found["references_m"]["sd"]).max() < 4
    told = 0.7 if name == "pairs-3" else 0.5  # six lines from above carry the weight in one way only
    assert np.median(found["references_m"]["sd"]) < told * 3 * small


def test_a_running_robot_is_brought_back_by_winches_whose_lines_creep_unlike(tmp_path):
    """Against a simulation of its own, which knows the lengths of lines and no winches."""
    robot = schema.read_robot_file(printer(tmp_path, drum=""))
    robot = replace(robot, centre_of_mass_m=np.array([0.03, 0.06, -0.05]), home_m=np.array([0.1, -0.15, 0.3]))
    home, line = (robot.home_m, np.eye(3)), WireDraws({k: np.full(2, v) for k, v in CORE.items()}, 1000.0)
    of_lines = _joint_values_for(robot, [0, 9], [robot.home_m] * 2).joint_m[0]
    nominal = of_lines[[0, 2, 4, 6]]
    np.testing.assert_array_equal(nominal[robot.winch], of_lines)
    live, still = (LiveEstimator(robot, line, Uncertain(), home, reads=False) for _ in range(2))
    times, joint, sent, seen = np.array([0.0, 5, 10, 20, 40, 80, 160, 320, 600, 601]), nominal, [], []
    for time in times:
        now, drifted = live.step(time, joint, nominal_m=nominal), still.step(time, nominal)
        seen.append(now.position_m)
        sent.append(joint)
        joint = now.joint_m
    assert now.joint_m.shape == now.joint_sd_m.shape == (4,)
    assert now.correction_m.shape == now.straight_correction_m.shape == (4,)
    each = np.array(sent)[:, robot.winch]
    history = History(times, each, None, None, np.zeros(10), np.zeros((10, 3)), np.ones(10))
    place, _, tension = _simulated(robot, CORE, history)
    unlike = np.abs(np.diff(tension[-1, :6].reshape(3, 2)))
    assert unlike.min() > 0.1 * tension[-1].mean()
    drift = np.linalg.norm(drifted.position_m - robot.home_m)
    np.testing.assert_allclose(seen, place, atol=0.02 * drift)
    np.testing.assert_allclose(place[-1], robot.home_m, atol=0.02 * drift)
    np.testing.assert_allclose(now.tension_N, tension[-1], atol=2e-3 * tension.max())
    with pytest.raises(InputError, match="joint_m: found 7 in a list, expected 4 numbers"):
        live.step(700.0, of_lines)


@pytest.mark.parametrize("seed", [2, 3, 4, 5])
def test_the_exported_model_of_drawn_pairs_rests_in_mujoco(seed):
    """Every line is a tendon as long as its winch makes it; the platform starts in the orientation that hangs there."""
    mujoco = pytest.importorskip("mujoco")
    robot, k1 = pairs(np.random.default_rng(seed), 3 + seed % 2, 1e-3)
    if commanded(robot, k1) is None:
        pytest.skip("nothing holds it")
    line = WireDraws(
        {"k1": np.full(2, k1), "B": np.zeros(2), "U": np.ones(2), "k2": np.full(2, 0.03), "N": np.full(2, 0.5)}, 1000.0
    )
    model = mujoco.MjModel.from_xml_string(files.mujoco(robot, line))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert model.ntendon == robot.legs
    assert np.abs(data.qacc).max() < 1e-6 * G

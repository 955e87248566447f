"""Drums: motor angle to length against wire laid down turn by turn, and everywhere that motor angles come in."""

import csv
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.robot.cases import session_header
from tests.robot.test_calibration import _line
from wirebayes.errors import InputError
from wirebayes.robot.export import files
from wirebayes.robot.history import table
from wirebayes.robot.mechanics import draws, drums, schema
from wirebayes.robot.mechanics.description import Drums
from wirebayes.robot.motion import claim, forward, inverse
from wirebayes.robot.pose.answer import pose_report
from wirebayes.robot.pose.request import PoseRequest
from wirebayes.robot.self_calibration import answer, session_file
from wirebayes.strict.table import csv_table

# one layer; five turns a layer; a spiral of one turn a layer; no drum known
DRUMS = Drums(
    np.array([0.04, 0.03, 0.02, 0.0]),
    np.array([2e-3, 1e-3, 0.0, 0.0]),
    np.array([np.inf, 5.0, 1.0, np.inf]),
    np.array([0.0, 8e-4, 5e-4, 0.0]),
    np.array([0.0, 6.0, 6.0, 0.0]),
    np.array([1.0, 12.75, 0.5, 1.0]),
)


def _laid_down(leg, drum_rad):
    """Wire on a drum that turned so far from empty: the helix's length, summed in small steps."""
    steps = 200_000
    angle = (np.arange(steps) + 0.5) * drum_rad / steps
    layer = np.floor(angle / (2 * np.pi * DRUMS.layer_turns[leg]))
    radius = DRUMS.radius_m[leg] + layer * DRUMS.layer_m[leg]
    return np.hypot(radius, DRUMS.pitch_m[leg] / (2 * np.pi)).sum() * drum_rad / steps


def test_the_wire_on_the_drum_is_that_laid_down_turn_by_turn():
    full = drums.motor_angle(DRUMS, DRUMS.wire_m)  # everything paid out: the empty drum
    for leg in (1, 2):
        for turns in (0.3, 4.0, 12.5, 20.0):
            motor = np.zeros(4)
            motor[leg] = full[leg] - DRUMS.gear[leg] * 2 * np.pi * turns
            paid, _ = drums.paid_out(DRUMS, motor)
            assert DRUMS.wire_m[leg] - paid[leg] == pytest.approx(_laid_down(leg, 2 * np.pi * turns), rel=1e-5)
    turn = drums.paid_out(DRUMS, np.full(4, 2 * np.pi))[0]
    assert turn[0] == pytest.approx(np.hypot(2 * np.pi * 0.04, 2e-3), rel=1e-14)
    assert np.isnan(turn[3])


def test_angle_and_length_are_inverse_and_the_slope_is_the_derivative():
    length = np.linspace(0.1, 5.9, 400)[:, None] * np.ones(4)
    angle = drums.motor_angle(DRUMS, length)
    back, slope = drums.paid_out(DRUMS, angle)
    np.testing.assert_allclose(back[:, :3], length[:, :3], atol=1e-13)
    assert (np.diff(angle[:, :3], axis=0) > 0).all()
    h = 1e-3
    difference = (drums.paid_out(DRUMS, angle + h)[0] - drums.paid_out(DRUMS, angle - h)[0]) / (2 * h)
    away = np.abs(difference / slope - 1)[:, :3] < 1e-9
    assert away.mean() > 0.97  # but for the two angles where a layer ends
    assert np.ptp(slope[:, 1]) > 1e-6  # layers differ
    assert drums.emptied(DRUMS, np.array([9.0, 6.1, 5.0, 9.0])) == [1]


def _with_drums(name):
    robot = schema.read_robot_file(name)
    w = robot.legs
    zeros = np.zeros(w)
    return replace(
        robot, drums=Drums(np.linspace(0.02, 0.05, w), zeros + 1e-3, zeros + 7.0, zeros + 6e-4, zeros + 12.0, zeros + 3)
    )


def test_motor_angles_lead_to_the_pose_and_back():
    robot, line = _with_drums("hangprinter-4"), _line(20)
    wires = draws.for_robot(robot, line)
    x, R = robot.home_m[None] + 0.03, np.eye(3)[None]
    commands = inverse.commands(robot, wires, x, R, inverse.tensions(robot, x, R))
    angle = drums.motor_angle(robot.drums, commands.joint_m)
    zero, offset = inverse.lengths(robot, drums.paid_out(robot.drums, angle)[0])
    found = forward.solve_equilibrium(robot, wires, zero, offset, x[0] + 0.01, R[0])
    assert found.found.all()
    assert np.abs(found.position_m - x).max() < 1e-9
    paid = drums.paid_out(robot.drums, angle)[1]
    assert (np.abs(3 * paid - robot.drums.radius_m) < 4e-3).all()
    short = replace(robot, drums=replace(robot.drums, wire_m=np.array([1.0, 12.0, 12.0, 12.0])))
    content = pose_report(short, line, PoseRequest(x[0], R[0], np.array([0.0, 60.0]))).content
    np.testing.assert_allclose(content["inverse"]["motor_angle_rad"]["mean"][1:], angle.mean(0)[1:])
    np.testing.assert_allclose(content["inverse"]["wire_per_motor_angle_m_rad"]["mean"][1:], paid.mean(0)[1:])
    text = "wire 1 is longer here than its drum's wire_length_m, 1 m"
    assert {"kind": "geometry", "text": text} in content["warnings"]
    big = claim.scaled_robot(robot, 2.0, robot.mass_kg)
    np.testing.assert_allclose(drums.motor_angle(big.drums, 2 * commands.joint_m), angle)


def test_a_session_may_give_motor_angles(tmp_path):
    robot = _with_drums("cogiro-desk")
    robot = replace(robot, drums=replace(robot.drums, radius_m=np.where(np.arange(8) == 2, 0.0, robot.drums.radius_m)))
    joint = np.linspace(1.4, 1.6, 8)
    angle = np.where(np.arange(8) == 2, joint, drums.motor_angle(robot.drums, joint))
    sessions = []
    for name, motors, values in (("a", False, joint), ("b", True, angle)):
        with (tmp_path / name).open("w", newline="") as file:
            rows = csv.writer(file)
            rows.writerow(session_header(robot, ["motor_1_rad"] if motors else []))
            rows.writerow([1, *robot.home_m, 0, 0, 0, 60, *map(float, values), *[2.0] * 8])
        sessions.append(session_file.read_session(tmp_path / name, robot, 0.02, 1e-3)[0])
    assert "joint_3_m" in session_file.columns(robot, ["motor_4_rad"]).required
    assert "motor_4_rad" in session_file.columns(robot, ["motor_4_rad"]).required
    np.testing.assert_allclose(sessions[1].joint_m, sessions[0].joint_m, atol=1e-13)
    with pytest.raises(InputError, match="expected a header of hold,.*joint_1_m"):
        session_file.read_session(tmp_path / "b", schema.read_robot_file("cogiro-desk"), 0.02, 1e-3)


def test_motor_angles_in_degrees_are_refused_with_their_unit(tmp_path):
    robot = _with_drums("cogiro-desk")
    angle = np.degrees(drums.motor_angle(robot.drums, np.full(8, 1.5)))
    path = tmp_path / "session.csv"
    names = [f"motor_{leg}_rad" for leg in range(1, 9)]
    header = ",".join(["hold", "duration_s", *names])
    path.write_text(f"{header}\n1,60,{','.join(map(str, angle))}\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"motor_1_rad.* pays out .*; the motor's angle is in radians"):
        session_file.read_session(path, robot, 0.02, 1e-3)


def test_a_hold_that_one_sensor_did_not_read_keeps_the_other_readings(tmp_path):
    robot = schema.read_robot_file("cogiro-desk")
    path = tmp_path / "session.csv"
    header = ",".join(session_header(robot, []))
    cells = [1, *robot.home_m, 0, 0, 0, 60, *[1.5] * 8, "", *[2.0] * 7]
    path.write_text(f"{header}\n{','.join(map(str, cells))}\n", encoding="utf-8")
    session, readings = session_file.read_session(path, robot, 0.02, 1e-3)
    assert session.read.tolist() == [True]
    np.testing.assert_array_equal(readings, [np.nan, *[100.0] * 7])
    holds = answer.holds_of(robot, session, readings)
    np.testing.assert_array_equal(holds.tension_N, [[np.nan, *[2.0] * 7]])


@pytest.mark.parametrize(
    ("tensions", "normal", "found"),
    [
        ([2.0] * 8, ["", ""], "line 2: found tensions or the normal empty, expected both or none"),
        ([""] * 8, [0.0, 0.0], "line 2: found tensions or the normal empty, expected both or none"),
        ([2.0] * 8, [0.0, ""], "line 2: found some cells of the normal empty, expected all or none"),
    ],
)
def test_tensions_and_the_normal_are_read_together(tmp_path, tensions, normal, found):
    robot = schema.read_robot_file("cogiro-desk")
    path = tmp_path / "session.csv"
    header = ",".join([*session_header(robot, []), "normal_x", "normal_y"])
    cells = [1, *robot.home_m, 0, 0, 0, 60, *[1.5] * 8, *tensions, *normal]
    path.write_text(f"{header}\n{','.join(map(str, cells))}\n", encoding="utf-8")
    with pytest.raises(InputError, match=found):
        session_file.read_session(path, robot, 0.02, 1e-3)


def test_tables_may_give_the_straight_lengths_that_firmware_counts():
    """Millimetres from anchor to platform, of wires of several lines with more beyond the anchor."""
    robot = schema.read_robot_file("hangprinter-4")
    straight = np.array([[1650.0, 1840.0, 1630.0, 1990.0], [1660.0, 1830.0, 1640.0, 1980.0]])
    wire = robot.lines * straight / 1000 + robot.beyond_m
    given = ["straight_1_mm"]
    pose, tension = [*robot.home_m, 0, 0, 0, 60], [2.0] * 4

    def session(names, rows):
        cells = [[i + 1, *pose, *map(float, row), *tension] for i, row in enumerate(rows)]
        text = "\n".join([",".join(names), *(",".join(map(str, c)) for c in cells)])
        return session_file.parse_session(csv_table(Path("session.csv"), text), robot, 0.02, 1e-3)[0].joint_m

    def log(names, rows):
        cells = [[60.0 * i, *map(float, row)] for i, row in enumerate(rows)]
        text = "\n".join([",".join(names), *(",".join(map(str, c)) for c in cells)])
        return table.parse_log(csv_table(Path("log.csv"), text), robot, table.measured_columns).joint_m

    for read, names in (
        (session, session_header(robot, given)),
        (log, table.measured_columns(robot, given).required),
    ):
        assert "straight_4_mm" in names
        np.testing.assert_allclose(read(names, straight), wire, rtol=1e-12)
        with pytest.raises(InputError, match=r"straight_2_mm.*1840000.*which is 3683 m of wire, expected"):
            read(names, straight * [[1, 1000, 1, 1], [1, 1, 1, 1]])
        with pytest.raises(InputError, match="straight_1_mm.*whole wire"):
            read(names, straight / 1000)  # metres under a name that says millimetres


def test_the_firmware_files_describe_the_drums():
    robot, line = _with_drums("hangprinter-4"), _line(20)
    text = files.reprapfirmware(robot, line)
    shown = next(row for row in text.splitlines() if row.startswith("M666 R"))
    radius = np.array([float(v) for v in shown.split(" ;")[0][6:].split(":")])
    # the firmware's rule: the square of the radius falls by the buildup factor for every length paid out
    growth = 6e-4 / (np.pi * 7.0)
    assert f"M666 Q{1e3 * growth:.5f}" in text
    out = robot.lines * np.linalg.norm(robot.exit_m, axis=1) + robot.beyond_m
    smooth = np.sqrt(robot.drums.radius_m**2 + growth * (robot.drums.wire_m - out))
    assert np.abs(1e-3 * radius - smooth).max() < 6e-4  # steps of one layer against a smooth growth
    assert "; M666 L and H, teeth of motor and spool: their ratio is 3, 3, 3, 3" in text
    klipper = files.klipper(robot, line)
    turns = [float(turn) for turn in re.findall(r"rotation_distance: (\S+)", klipper)]
    # Klipper counts straight millimetres: of all the wire of a turn what one line gets
    assert turns == pytest.approx(2 * np.pi * radius / robot.lines, rel=1e-4)
    assert f"winch_buildup_factor: {1e3 * growth:.5f}  # mm" in klipper
    assert "M666 R" not in files.reprapfirmware(schema.read_robot_file("hangprinter-4"), line)

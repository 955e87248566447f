"""Sessions in another unit, with columns mixed up or absurd readings; slack wires that read below zero."""

import contextlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.robot.test_unheld_home import six_wires
from wirebayes.errors import InputError
from wirebayes.robot.history import table
from wirebayes.robot.mechanics import schema, statics
from wirebayes.robot.mechanics.draws import WireDraws, for_robot
from wirebayes.robot.mechanics.joint_columns import POSITION, TURN
from wirebayes.robot.mechanics.rotation import matrix
from wirebayes.robot.motion import inverse
from wirebayes.robot.self_calibration.mistaken import column_notices, tension_notices
from wirebayes.robot.self_calibration.session_file import may_be_empty, parse_session
from wirebayes.strict.columns import columns_table
from wirebayes.strict.table import csv_table

LINE = WireDraws({k: np.full(2, v) for k, v in {"k1": 15e3, "B": 0.05, "U": 0.9, "k2": 0.03, "N": 0.7}.items()}, 1000.0)
HOLDS = 4
SD_N = 0.02


@pytest.fixture(scope="module")
def session():
    """Holds of a platform on six wires: poses, joint values of wires that do not creep, and their tensions."""
    return _session(1.0)


def _session(spread, line=LINE):
    """The same, at poses so many times as far from home."""
    robot, rng = six_wires(), np.random.default_rng(5)
    x = robot.home_m + spread * rng.uniform(-0.3, 0.3, (HOLDS, 3))
    turn = spread * rng.uniform(-0.03, 0.03, (HOLDS, 3))
    tau = inverse.tensions(robot, x, matrix(turn))
    assert np.isfinite(tau).all()
    joint = inverse.commands(robot, for_robot(robot, line.centre()), x, matrix(turn), tau).joint_m
    cells = {"hold": np.arange(1, HOLDS + 1)}
    cells |= dict(zip(("x_m", "y_m", "z_m", "rx_rad", "ry_rad", "rz_rad"), np.hstack([x, turn]).T, strict=True))
    cells |= {"duration_s": np.full(HOLDS, 60.0)}
    cells |= {f"joint_{i + 1}_m": joint[:, i] for i in range(6)}
    return robot, cells | {f"tension_{i + 1}_N": tau[:, i] for i in range(6)}


@pytest.mark.parametrize(
    ("tension_N", "said"), [(0.49, True), (0.51, False), (799.0, False), (801.0, True), (float("nan"), False)]
)
def test_tensions_far_outside_the_range_of_the_file_are_said_where_no_pose_is_known(session, tension_N, said):
    """From 1 to 400 N: half the one, twice the other. Most of the readings decide, not one."""
    robot, cells = session
    bare = {name: values for name, values in cells.items() if name not in (*POSITION, *TURN)}
    value = "" if np.isnan(tension_N) else tension_N
    given = {name: [value] * HOLDS if name.startswith("tension") else values for name, values in bare.items()}
    if value:
        given["tension_1_N"] = [20.0] * HOLDS
    notices = tension_notices(robot, *_read(robot, given))
    assert [notice.kind for notice in notices] == ["data"] * said
    assert all("allows 1.00 to 400 N" in notice.text for notice in notices)


@pytest.mark.parametrize(("separator", "name"), [(";", "semicolons"), ("\t", "tabs")])
def test_a_spreadsheets_other_separators_are_named(separator, name):
    text = f"hold{separator}joint_1_m\n1{separator}1,5\n"
    with pytest.raises(InputError, match=f"line 1: found {name} between the columns, expected commas"):
        csv_table(Path("log.csv"), text)
    csv_table(Path("log.csv"), "hold\n1\n")


def test_where_a_reading_may_be_missing_the_complaint_says_so(session):
    robot, cells = session
    with pytest.raises(InputError, match="found 'x', expected an empty cell or a number"):
        _read(robot, cells | {"tension_2_N": ["x"] * HOLDS})
    with pytest.raises(InputError, match="found 'x', expected a number"):
        _read(robot, cells | {"joint_2_m": ["x"] * HOLDS})


def test_columns_of_which_nothing_is_known_may_be_left_out(session):
    """A printer's owner knows neither poses nor tensions, and a plotter has no rotations."""
    robot, cells = session
    empty = {name: [""] * HOLDS if may_be_empty(name) else values for name, values in cells.items()}
    bare = {name: values for name, values in cells.items() if not may_be_empty(name)}
    for all_empty, left_out in zip(_read(robot, empty), _read(robot, bare), strict=True):
        np.testing.assert_equal(_plain(left_out), _plain(all_empty))
    placed = {name: values for name, values in cells.items() if name not in TURN}
    known, _ = _read(robot, placed)
    np.testing.assert_array_equal(known.position_m, _read(robot, cells)[0].position_m)
    assert np.isnan(known.rotation).all()
    with pytest.raises(InputError, match="found no column y_m"):
        _read(robot, {name: values for name, values in cells.items() if name != "y_m"})


def _plain(value):
    return vars(value) if hasattr(value, "joint_m") else value


def _read(robot, cells, biased=False):
    given = {name: np.asarray(value).tolist() for name, value in cells.items()}
    return parse_session(columns_table(given, Path("log"), may_be_empty), robot, SD_N, 1e-3, biased)


def _tensions(cells, change):
    return cells | {name: change(v) for name, v in cells.items() if name.startswith("tension_")}


def test_a_sound_session_is_read(session):
    robot, cells = session
    assert len(_read(robot, cells)[1]) == 6 * HOLDS


@pytest.mark.parametrize(("times", "refused"), [(2.99, False), (3.01, True), (1 / 2.99, False), (1 / 3.01, True)])
def test_all_tensions_in_another_unit_are_refused_by_the_weight(session, times, refused):
    robot, cells = session
    scaled = _tensions(cells, lambda tension: tension * times)
    if not refused:
        _read(robot, scaled)
        return
    with pytest.raises(
        InputError, match=r"tension_1_N to tension_6_N: found tensions that are, all together, (3\.01|0\.332)"
    ):
        _read(robot, scaled)


@pytest.mark.parametrize("kind", ["joint_{}_m", "tension_{}_N"])
def test_columns_in_the_place_of_each_other_are_named(session, kind):
    robot, cells = session
    two, five = kind.format(2), kind.format(5)
    with pytest.raises(InputError, match=f"columns {two} and {five}: .* in the place of each other"):
        _read(robot, cells | {two: cells[five], five: cells[two]})


@pytest.mark.parametrize(("mixed", "refused"), [(1 / 6 - 0.001, True), (1 / 6 + 0.001, False)])
@pytest.mark.parametrize("kind", ["joint_{}_m", "tension_{}_N"])
def test_columns_are_mixed_up_where_in_each_other_s_place_they_are_five_times_better(kind, mixed, refused):
    """Of their difference a share is left in each other's place, and the rest where they stand."""
    stiff = replace(LINE, parameters={**LINE.parameters, "k1": np.full(2, 1e12)})  # lengths to poses are exact
    robot, cells = _session(1.0, stiff)
    two, four = (np.array(cells[kind.format(i)]) for i in (2, 4))
    cells |= {kind.format(2): four + mixed * (two - four), kind.format(4): two + mixed * (four - two)}
    if kind.startswith("joint"):
        cells = _tensions(cells, lambda tension: np.full(HOLDS, np.nan))
    with pytest.raises(InputError, match="in the place of each other") if refused else contextlib.nullcontext():
        _read(robot, cells)


@pytest.mark.parametrize(("share", "refused"), [(0.0099, False), (0.0101, True)])
def test_joint_values_are_another_wire_s_where_they_are_a_hundredth_of_the_robot_off(share, refused):
    def apart(spread):
        robot, cells = _session(spread)
        return np.std(cells["joint_2_m"] - cells["joint_5_m"]) / robot.span_m

    robot, cells = _session(brentq(lambda spread: apart(spread) - share, 0.001, 1.0))
    swapped = cells | {"joint_2_m": cells["joint_5_m"], "joint_5_m": cells["joint_2_m"]}
    unread = _tensions(swapped, lambda tension: np.full(HOLDS, np.nan))
    with pytest.raises(InputError, match="in the place of each other") if refused else contextlib.nullcontext():
        _read(robot, unread)


def test_reference_lengths_that_err_are_no_mix_up(session):
    robot, cells = session
    _read(robot, cells | {"joint_2_m": np.asarray(cells["joint_2_m"]) + 0.4})


@pytest.mark.parametrize(("times", "refused"), [(0.999, False), (1.001, True)])
def test_poses_far_outside_the_robot_are_refused(session, times, refused):
    robot, cells = session
    far = np.array(cells["y_m"])
    far[3] = robot.home_m[1] - times * 10.0 * robot.span_m
    unread = _tensions(cells, lambda tension: np.full(HOLDS, np.nan))  # nothing to be balanced there
    path = {"time_s": [0.0, 9.0], "x_m": [0.2, 0.2], "y_m": [-0.1, far[3]], "z_m": [1.2, 1.2]}
    commanded = columns_table(path, Path("path"), table.may_be_unread)
    if not refused:
        _read(robot, unread | {"y_m": far})
        table.parse_log(commanded, robot, table.commanded_columns)
        return
    with pytest.raises(InputError, match="row 3 .*y_m.* 10 times the robot's size"):
        _read(robot, unread | {"y_m": far})
    with pytest.raises(InputError, match="y_m.* 10 times the robot's size"):
        table.parse_log(commanded, robot, table.commanded_columns)


@pytest.mark.parametrize(("below", "refused"), [(4.99, False), (5.01, True)])
def test_a_slack_wire_may_read_below_zero_by_noise(session, below, refused):
    robot, cells = session
    pull = np.array(cells["tension_1_N"])
    pull[2] = -below * SD_N
    slack = cells | {"tension_1_N": pull}
    if refused:
        with pytest.raises(InputError, match="tension_1_N.*--tension-bias"):
            _read(robot, slack)
        _read(robot, slack, biased=True)
    else:
        assert _read(robot, slack)[1].min() == pytest.approx(-below)


@pytest.mark.parametrize(("holds", "refused"), [(2, False), (3, True)])
@pytest.mark.parametrize("kind", ["unit", "tension_{}_N", "joint_{}_m"])
def test_fewer_than_three_stated_holds_say_nothing_of_columns(session, holds, refused, kind):
    robot, cells = session
    few = {name: np.asarray(values)[:holds] for name, values in cells.items()}
    if kind == "unit":
        few = _tensions(few, lambda tension: tension / 9.81)
    else:
        few |= {kind.format(2): few[kind.format(5)], kind.format(5): few[kind.format(2)]}
    with pytest.raises(InputError) if refused else contextlib.nullcontext():
        _read(robot, few)


@pytest.mark.parametrize(("uneven", "refused"), [(0.099, True), (0.101, False)])
def test_tensions_that_no_factor_balances_are_not_in_another_unit(session, uneven, refused):
    """Kilogram-force, and a force aside at every hold that is a known share of the weight."""
    robot, cells = session
    turn = np.moveaxis(matrix(np.column_stack([cells[name] for name in TURN])), 0, -1)
    shape = statics.geometry(robot, np.array([cells[name] for name in POSITION]), turn)
    force, load = statics.wire_jacobian(robot, shape), statics.weight(robot, turn)
    force[3:] /= robot.size_m
    load[3:] /= robot.size_m
    load[1] += uneven * np.linalg.norm(load) / np.sqrt(HOLDS)
    tau = np.linalg.solve(np.moveaxis(force, -1, 0), load.T[..., None])[..., 0] / 9.81
    scaled = cells | {f"tension_{i + 1}_N": tau[:, i] for i in range(6)}
    with pytest.raises(InputError) if refused else contextlib.nullcontext():
        _read(robot, scaled, biased=True)


def test_columns_of_a_robot_on_a_table_are_compared_by_what_wires_pull():
    """Its table carries the weight: no unit can be told, but two columns in the place of each other can."""
    robot = schema.read_robot_file("sled-4")
    x = robot.home_m + np.array([[-0.2, 0.1, 0.0], [0.1, -0.1, 0.0], [0.05, 0.08, 0.0], [-0.1, -0.15, 0.0]])
    turn = np.tile(np.eye(3), (4, 1, 1))
    tau = inverse.tensions(robot, x, turn) * np.array([1.0, 3.0, 2.0, 5.0])[:, None]
    with np.errstate(all="raise"):
        assert column_notices(robot, x, turn, tau) == []
        assert column_notices(robot, x, turn, 4.4 * tau) == []
        (said,) = column_notices(robot, x, turn, tau[:, [0, 2, 1, 3]])
    assert said.text.startswith("columns tension_2_N and tension_3_N: found tensions that leave")
    assert "of what they pull unbalanced" in said.text

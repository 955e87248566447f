"""Maps in slices: heights and orientations that are asked for, their numbers, and a row for every point."""

import numpy as np
import pytest

from tests.robot.test_calibration import _line
from wirebayes.commands.pose import _slices
from wirebayes.errors import InputError
from wirebayes.robot.mechanics import draws, rotation, schema
from wirebayes.robot.motion import claim, drift, inverse
from wirebayes.robot.pose import maps


def test_a_turned_platform_drifts_in_the_map_as_it_does_alone():
    robot, line = schema.read_robot_file("linear-6"), _line(8)
    wires, turn = draws.for_robot(robot, line), np.array([0.05, -0.03, 0.1])
    slices = maps.Slices(np.array([0.5, 0.65]), np.stack([np.zeros(3), turn]))
    level, turned = maps.map_slices(robot, line, slices)
    assert np.unique(turned.requested_m[:, 2]).tolist() == [0.5, 0.65]
    assert len(turned.requested_m) == 2 * 49
    for i in (3, len(turned.drift.position_m) - 2):
        x, R = turned.drift.position_m[i], rotation.matrix(turn)
        alone = drift.from_command(robot, wires, x, R, np.array([60.0]))
        shift = np.linalg.norm(alone.position_m[:, 0] - x, axis=1)
        np.testing.assert_allclose(turned.drift.distance_m[i], shift, rtol=1e-3)
        angle = np.arccos((alone.rotation[:, 0] @ R.T @ np.array([0, 0, 1.0]) @ [0, 0, 1.0]).clip(-1, 1))
        np.testing.assert_allclose(turned.drift.tilt_rad[i], angle, rtol=0.3, atol=3e-5)
        np.testing.assert_allclose(turned.drift.tension_N[i], inverse.tensions(robot, x[None], R[None])[0])
    plain = claim.over_workspace(robot, wires, level.requested_m)
    np.testing.assert_array_equal(level.drift.distance_m, plain.distance_m)


def test_slices_and_rows_say_the_same():
    robot, line = schema.read_robot_file("linear-6"), _line(8)
    turn = np.array([0.0, 0.9, 0.0])  # too far for some positions
    found = maps.map_slices(robot, line, maps.Slices(np.array([0.4, 0.8]), np.stack([np.zeros(3), turn])))
    table = np.array(maps.rows(found))
    numbers = maps.summaries(found)
    assert len(table) == 2 * 2 * 49 and len(numbers) == 4
    assert [(s["at_m"], s["rotation_vector_rad"][1]) for s in numbers] == [(0.4, 0), (0.8, 0), (0.4, 0.9), (0.8, 0.9)]
    column = {name: table[:, i] for i, name in enumerate(maps.TABLE)}
    for entry in numbers:
        here = (column["z_m"] == entry["at_m"]) & (column["ry_rad"] == entry["rotation_vector_rad"][1])
        held = here & np.isfinite(column["lowest_tension_N"])
        assert held.sum() / here.sum() == pytest.approx(entry["feasible"])
        if held.any():
            assert column["lowest_tension_N"][held].min() == entry["lowest_tension_N"]
            assert column["probability"][held].mean() == pytest.approx(entry["probability"])
    assert numbers[2]["feasible"] < 1 or numbers[3]["feasible"] < 1
    assert (column["q05_drift_mm"] <= column["q50_drift_mm"])[column["held"] > 0].all()


def test_a_workspace_in_a_plane_has_one_slice():
    from tests.robot import drawn

    case = drawn.draw("planar-4", np.random.default_rng(4), count=3, sd=0.01)
    (one,) = maps.map_slices(case.robot, case.line, maps.LEVEL)
    (numbers,) = maps.summaries((one,))
    assert numbers["axis"] == "xyz"[one.slice_axis] in "xy"
    assert numbers["feasible"] > 0


def test_heights_and_rotations_that_mean_nothing_are_refused():
    linear, printer = schema.read_robot_file("linear-6"), schema.read_robot_file("hangprinter-4")
    assert _slices(linear, None, None) is maps.LEVEL
    assert _slices(linear, "0.8,0.5,0.5", ["0,0.1,0"]).heights_m.tolist() == [0.5, 0.8]
    for robot, heights, turns, message in (
        (linear, "a", None, "--map-heights: found 'a'"),
        (linear, None, ["0,1"], "--map-rotation: found '0,1', expected 3 finite numbers"),
        (printer, None, ["0,0,1"], "--map-rotation: found one for a robot whose lines keep"),
    ):
        with pytest.raises(InputError, match=message):
            _slices(robot, heights, turns)

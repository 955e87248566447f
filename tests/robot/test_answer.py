import numpy as np
import pytest

from tests.robot.lines import STRONGER, line_about
from wirebayes.json_files.plain import plain
from wirebayes.report.pictures import robot as pictures
from wirebayes.robot.mechanics import draws, schema
from wirebayes.robot.mechanics.wire_doubts import wire_warnings
from wirebayes.robot.pose.answer import pose_report
from wirebayes.robot.pose.request import PoseRequest, band_over_draws


def _request(robot, rotation=None):
    """Home for a minute. The tolerance is left at once: for how long the pose is within it is not asked here."""
    turned = np.eye(3) if rotation is None else rotation
    return PoseRequest(robot.home_m, turned, np.array([0.0, 60.0]), tolerance_m=1e-9)


def _line(n, k1, law="hooke"):
    return line_about(STRONGER | {"k1": k1}, 0.02, n, law=law)


def test_wires_too_weak_for_the_robot_are_an_answer_not_a_crash(tmp_path):
    # law (3) pulls with k1 at most: 3 N a wire cannot hold a platform that asks for five
    robot = schema.read_robot_file("cogiro-desk")
    request = _request(robot)
    found = pose_report(robot, _line(40, 3.0, "modified"), request)
    content = found.content
    assert not content["feasible"]
    assert "cannot pull" in content["sentence"]
    pictures.save_pose(tmp_path, robot, request, found)
    assert not list(tmp_path.iterdir())
    plain(content)


@pytest.mark.slow
def test_some_draws_too_weak_are_counted_and_left_out(tmp_path):
    robot = schema.read_robot_file("cogiro-desk")
    weak, strong = _line(20, 3.0, "modified"), _line(20, 800.0, "modified")
    both = {k: np.concatenate([weak.parameters[k], strong.parameters[k]]) for k in strong.parameters}
    request = _request(robot)
    found = pose_report(robot, draws.WireDraws(both, 1000.0, "modified"), request)
    content = found.content
    assert content["feasible_draws"] == 0.5
    assert content["forward"]["solved"] == 0.5
    assert [entry["solved"] for entry in content["drift"]] == [0.5, 0.5]
    alone = pose_report(robot, strong, request).content
    wanted = alone["drift"][0]["distance_mm"]["mean"]
    np.testing.assert_allclose(content["drift"][0]["distance_mm"]["mean"], wanted, rtol=1e-9)
    pictures.save_pose(tmp_path, robot, request, found)
    assert (tmp_path / "drift.svg").exists()


def test_one_draw_is_enough():
    robot = schema.read_robot_file("hangprinter-4")
    content = pose_report(robot, _line(1, 5000.0), _request(robot)).content
    assert content["forward"]["solved"] == 1.0
    assert "sentence" in content["variance_shares"]


def test_given_wires_have_no_uncertainty_and_keep_their_leg():
    robot = schema.read_robot_file("linear-6")
    given = schema.GivenWire({"k1": 5e4, "B": 1e-3, "U": 1.0, "k2": 0.01, "N": 1.0}, 1000.0)
    from dataclasses import replace

    mixed = replace(robot, given={"steel": given}, wire=("steel", *robot.wire[1:]))
    wires = draws.for_robot(mixed, _line(20, 800.0))
    assert wires.theta["k1"].shape == (6, 20)
    np.testing.assert_array_equal(wires.theta["k1"][0], 5e4)
    np.testing.assert_array_equal(wires.theta["k1"][1], wires.theta["k1"][5])
    content = pose_report(mixed, _line(20, 800.0), _request(mixed)).content
    assert content["forward"]["largest_round_trip_error_m"] < 1e-9


def test_bands_leave_lost_draws_out():
    values = np.array([[1.0, 2.0], [np.nan, 2.0], [3.0, 4.0]])
    np.testing.assert_allclose(band_over_draws(values)["mean"], [2.0, 3.0])
    assert band_over_draws(np.empty((0, 2)))["mean"] is None


@pytest.mark.parametrize(("name", "leg"), [("linear-6", 3.0), ("hangprinter-4", 4.0 * (2.29983 - 0.3))])
def test_creep_grows_with_the_length_as_the_joint_fit_says(name, leg):
    """A leg's wire of known length: B per length^exponent, by hand on the last leg."""
    robot = schema.read_robot_file(name)
    line = _line(30, 800.0)
    exponent = np.linspace(0.5, 1.5, 30)
    scaled = draws.WireDraws({**line.parameters, draws.LENGTH_EXPONENT: exponent}, 1000.0)
    wires = draws.for_robot(robot, scaled)
    elongation = line.parameters["B"] * (leg / 1.0) ** exponent  # of the leg's own wire at 1 N, mm
    tested = wires.theta["B"][-1] / wires.length_mm[-1] * 1e3 * leg
    np.testing.assert_allclose(tested, elongation, rtol=1e-5)
    content = pose_report(robot, scaled, _request(robot)).content
    assert content["variance_shares"]["shared_draw"][draws.LENGTH_EXPONENT] > 0.1
    assert any("exponent" in notice["text"] for notice in content["warnings"]) or name == "linear-6"


def test_what_a_fit_could_not_name_is_said_to_be_missing():
    from wirebayes.effects.unknown import Discrepancy

    line = draws.WireDraws(_line(3, 800.0).parameters, 1000.0, effects=(Discrepancy(5, 0.1, 120.0, 1.0, 4.0),))
    message = wire_warnings(schema.read_robot_file("linear-6"), line, np.ones((1, 6)), 1.0, np.ones((1, 6)))
    assert len(message) == 1
    assert "could not name" in message[0].text and message[0].kind == "left-out"


def test_tilt_is_measured_against_the_commanded_normal_and_against_the_vertical():
    from wirebayes.robot.mechanics.rotation import matrix

    robot = schema.read_robot_file("cogiro-desk")
    leaning = matrix(np.array([0.05, 0.0, 0.3]))
    drift = pose_report(robot, _line(40, 800.0), _request(robot, leaning)).content["drift"][0]
    away = np.degrees(np.arccos(leaning[2, 2]))
    assert drift["tilt_deg"]["q95"][0] < 1e-6
    assert 0 < drift["tilt_deg"]["q50"][1] < 0.5
    np.testing.assert_allclose(drift["from_vertical_deg"]["q50"], away, atol=0.5)
    assert drift["from_vertical_deg"]["q50"][0] == pytest.approx(away, abs=1e-6)

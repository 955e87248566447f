"""How far poses move if the wires' clocks start anew at every stop, also where commands change tensions by little."""

from dataclasses import replace

import numpy as np
import pytest

from tests.robot.test_history import _answered, _joint_values_for
from wirebayes.robot.history.history import at_every_stop
from wirebayes.robot.mechanics import schema

TIMES = [0, 600, 601, 1200, 1201, 1800]


def to_and_fro(way_m, *, commanded=False):
    """Three stops of ten minutes, and small moves of a second between them."""
    robot = schema.read_robot_file("hangprinter-4")
    there = robot.home_m + np.array([0.0, 0.0, way_m])
    places = np.repeat([robot.home_m, there, robot.home_m], 2, axis=0)
    history = _joint_values_for(robot, TIMES, list(places))
    if commanded:
        rotations = np.tile(np.eye(3), (len(TIMES), 1, 1))
        history = replace(history, joint_m=None, position_m=places, rotation=rotations)
    return robot, history


def test_a_stop_begins_where_values_stay_and_a_load_wherever_it_changes():
    _, history = to_and_fro(1e-3)
    stops = at_every_stop(history)
    assert stops is not None and stops.hold is not None
    assert stops.hold.tolist() == [0, 0, 1, 1, 2, 2]
    loaded = at_every_stop(replace(history, payload_kg=np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.5])))
    assert loaded is not None and loaded.hold is not None
    assert loaded.hold.tolist() == [0, 0, 1, 1, 2, 3]
    assert at_every_stop(stops) is None  # it says when
    moving = np.linspace(1.0, 1.1, 6)[:, None] * np.ones((6, 4))
    assert at_every_stop(replace(history, joint_m=moving)) is None


@pytest.mark.parametrize("commanded", [False, True])
def test_clocks_that_restart_at_stops_are_followed_as_holds_that_are_stated(commanded):
    robot, history = to_and_fro(1e-3, commanded=commanded)
    clock = _answered(robot, history).content["clock"]
    assert clock["largest_mm"] == 0  # so small a command restarts no clock by itself
    stated = _answered(robot, at_every_stop(history)).content["clock"]
    assert clock["at_stops_largest_mm"] == pytest.approx(stated["largest_mm"], rel=1e-6) and stated["largest_mm"] > 0
    assert clock["at_stops_at_the_end_mm"] == pytest.approx(stated["at_the_end_mm"], rel=1e-6)
    assert "at_stops_largest_mm" not in stated

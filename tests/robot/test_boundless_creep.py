"""Wires that would creep by more than their own length are refused before anything follows them there."""

from dataclasses import replace

import numpy as np
import pytest

import wirebayes as wb
from tests.robot.test_plausible_files import LINE
from tests.robot.test_unheld_home import six_wires
from wirebayes.errors import InputError
from wirebayes.robot.mechanics import schema
from wirebayes.robot.mechanics.description import GivenWire
from wirebayes.robot.motion import boundless_creep, inverse
from wirebayes.wire import laws

HOUR_S = 3600.0


def _six(B, named="line"):
    given = {"line": GivenWire({"k1": 8e3, "B": B, "U": 1.0, "k2": 0.03, "N": 0.7}, 1000.0)}
    return replace(six_wires(), wire=(named,) * 6, given=given)


def _largest_that_creeps_within_its_length(robot, time_s):
    """B at which the wire under the largest tension creeps by its whole length of 1000 mm, for U = 1."""
    tension = inverse.tensions(robot, robot.home_m[None], np.eye(3)[None])[0]
    return 1000.0 / (tension.max() * laws.creep_fraction(time_s, 0.03, 0.7))


@pytest.mark.parametrize("time_s", [1.0, HOUR_S])
def test_the_limit_is_the_length_of_the_wire_within_the_time_that_is_asked(time_s):
    most = _largest_that_creeps_within_its_length(_six(1.0), time_s)
    at = six_wires().home_m, np.eye(3)
    boundless_creep.refuse_boundless_creep(_six(0.999 * most), LINE, *at, time_s)
    with pytest.raises(InputError, match=r"\[wires\.line\], B = .* mm at a length of 1000 mm: wire \d creeps by 100"):
        boundless_creep.refuse_boundless_creep(_six(1.001 * most), LINE, *at, time_s)


def test_a_fitted_wire_is_refused_alike_and_a_pose_that_nothing_holds_is_left_to_others():
    robot = six_wires()
    slip = replace(LINE, parameters=dict(LINE.parameters) | {"B": np.full(2, 5e5)})
    with pytest.raises(InputError, match="the fitted wire, .*were such tensions tested"):
        boundless_creep.refuse_boundless_creep(robot, slip, robot.home_m, np.eye(3), HOUR_S)
    boundless_creep.refuse_boundless_creep(robot, slip, robot.home_m + 9.0, np.eye(3), HOUR_S)


@pytest.mark.parametrize("over_time", [False, True])
def test_pose_refuses_before_it_begins(tmp_path, over_time):
    robot = schema.read_robot_file("linear-6")
    given = {"line": GivenWire({"k1": 800.0, "B": 5e5, "U": 0.5, "k2": 0.1, "N": 0.3}, 1000.0)}
    slip = replace(robot, wire=("line",) * 6, given=given)
    x, y, z = robot.home_m
    way = {"time_s": [0.0, 60.0], "x_m": [x, x], "y_m": [y, y], "z_m": [z, z]}
    with pytest.raises(InputError, match="expected less than 100 %"):
        wb.pose(slip, draws=2, trajectory=way if over_time else None, output=tmp_path / "out")
    assert not (tmp_path / "out").exists()

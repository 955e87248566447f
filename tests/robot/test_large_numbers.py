"""Ropes of stadiums: thousands of newtons, and times of days, are said as people write them."""

import re
from dataclasses import replace

import numpy as np
import pytest

from tests.robot.test_history import _standing_still
from wirebayes.cli import main
from wirebayes.robot.history.doubts import _dynamics, _unsure_clock
from wirebayes.robot.mechanics import draws, schema
from wirebayes.robot.mechanics.wire_doubts import wire_warnings
from wirebayes.sentences import short

_EXPONENT = re.compile(r"\de\+0\d")


@pytest.mark.parametrize(
    ("value", "text"), [(12345.0, "12300"), (99.96, "100"), (2.0769e6, "2080000"), (-0.5, "-0.5"), (1.2e-5, "1.2e-05")]
)
def test_a_short_number_has_no_exponent_unless_it_is_huge_or_tiny(value, text):
    assert short(value, 3) == text


def test_tensions_and_times_beyond_the_test_are_whole_numbers():
    robot = schema.read_robot_file("hangprinter-4")
    parameters = {"k1": [6e5], "B": [0.01], "U": [0.9], "k2": [0.03], "N": [0.5]}
    rope = draws.WireDraws({k: np.array(v) for k, v in parameters.items()}, 8000.0)
    rope = replace(rope, tension_range_N=(615.0, 4213.0), time_range_s=(0.0, 43200.0))
    notices = wire_warnings(robot, rope, np.full((1, 4), 12345.0), 86400.0, np.full((1, 4), 8.0))
    said = "\n".join(notice.text for notice in notices)
    assert "tensions 12300 N leave the tested range 615 to 4210 N" in said
    assert "24 h is longer than the longest tested hold, 12 h" in said


def test_a_platform_thrown_about_takes_so_many_percent_of_its_weight():
    (notice,) = _dynamics(np.array([0.0, 1.0, 2.0]), np.array([[0.0, 0.0, 0.0], [20.0, 0.0, 0.0], [0.0, 0.0, 0.0]]))
    assert "takes 410 % of its weight" in notice.text


def test_a_table_of_holds_of_a_rope(tmp_path, capsys):
    rows = [f"{hold},{50 * hold},{time},{10640 * hold - time}\n" for hold in (1, 2, 3, 4) for time in (0, 30, 60, 120)]
    (tmp_path / "rope.csv").write_text("hold,displacement_mm,time_s,tension_N\n" + "".join(rows))
    (tmp_path / "rope.toml").write_text(
        '[[experiment]]\nname = "rope"\nmaterial = "rope"\nlength_mm = 1e4\nreadings = "rope.csv"\n'
    )
    assert main(["check", str(tmp_path / "rope.toml")]) == 0
    said = capsys.readouterr().out
    assert "10640 to 10520 N" in said and not _EXPONENT.search(said)


@pytest.mark.parametrize("holds", [None, [1, 1, 2]])
def test_a_column_hold_is_not_asked_for_where_there_is_one(holds):
    _, history = _standing_still()
    history = replace(history, hold=None if holds is None else np.array(holds))
    content = {"clock": {"largest_mm": 2.0}, "drift": [{"distance_mm": {"q05": [0.1], "q95": [0.2]}}]}
    (notice,) = _unsure_clock(history, content)
    assert "by up to 2 mm" in notice.text and ("give a column hold" in notice.text) == (holds is None)
    content["clock"] = {"largest_mm": 0.0, "at_stops_largest_mm": 3.0}
    (notice,) = _unsure_clock(history, content)
    assert "by up to 3 mm" in notice.text

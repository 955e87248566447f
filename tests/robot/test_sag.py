"""What is said of wires whose own weight the statics leaves out: stated or not, at a pose and over a log."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.robot.test_commands import fitted, session_csv  # noqa: F401 - fixtures
from wirebayes.cli import main
from wirebayes.io.run_folder import read_json
from wirebayes.robot.mechanics import sag, schema

SHIPPED = Path(__file__).parents[2] / "data" / "robots"
HALF_M, HEIGHT_M, PULL_N = 60.0, 35.0, 100.0


def _stadium(mass_kg_m=None, highest_N=5000.0):
    """Four wires from masts to a camera in the middle, 8 m above the ground."""
    robot = schema.read_robot_file("hangprinter-4")
    corners = np.array([(x, y, HEIGHT_M) for x, y in ((1, 1), (-1, 1), (-1, -1), (1, -1))]) * [HALF_M, HALF_M, 1.0]
    rule = replace(robot.rule, lowest_N=50.0, highest_N=highest_N)
    return replace(robot, exit_m=corners, platform_m=np.zeros((4, 3)), rule=rule, mass_kg_m=mass_kg_m)


def _said(robot, pull_N=PULL_N):
    place = np.array([0.0, 0.0, 8.0])
    return [one.text for one in sag.sag_warnings(robot, place, np.eye(3), np.full(4, pull_N))]


def test_wires_of_no_stated_mass_are_as_light_as_ropes_can_be():
    length = np.sqrt(2 * HALF_M**2 + (HEIGHT_M - 8.0) ** 2)
    (text,) = _said(_stadium())
    share = 100 * 2.8e-6 * 5000 * 9.80665 * length / PULL_N
    assert (
        text.startswith("no mass_kg_m above 0 is stated of wire 1")
        and f"14 g/m, weighs {share:.2g} % of its tension" in text
    )
    (text,) = _said(_stadium(np.full(4, 0.02)))
    assert text.startswith(f"wire 1 weighs {100 * 0.02 * 9.80665 * length / PULL_N:.2g} % of its tension")
    assert _said(_stadium(np.full(4, 0.001))) == []  # what is stated counts


@pytest.mark.parametrize(("times", "said"), [(0.9, False), (1.1, True)])
def test_a_rope_is_heavy_from_a_twentieth_of_its_tension_on(times, said):
    length = np.sqrt(2 * HALF_M**2 + (HEIGHT_M - 8.0) ** 2)
    highest_N = times * 0.05 * PULL_N / (2.8e-6 * 9.80665 * length)
    assert bool(_said(_stadium(highest_N=highest_N))) is said


def test_shipped_robots_are_light():
    for file in sorted(SHIPPED.glob("*.toml")):
        robot = schema.read_robot_file(file)
        middle = np.full(robot.legs, max(robot.rule.lowest_N, 0.05 * robot.rule.highest_N))
        assert sag.sag_warnings(robot, robot.home_m, np.eye(3), middle) == [], file.name


def test_a_wire_that_weighs_more_than_it_is_pulled_with_hangs_in_an_arc():
    (text,) = _said(_stadium(np.full(4, 0.2)), pull_N=100.0)
    assert text.startswith("wire 1 weighs more than it is pulled with: it hangs in an arc") and " mm" not in text
    place, tension = np.array([0.0, 0.0, 8.0]), np.array([1000.0, 1000.0, 1000.0, 1e-13])
    assert sag.sag_warnings(_stadium(np.full(4, 0.02)), place, np.eye(3), tension) == []  # slack but for rounding


@pytest.mark.parametrize(("usual_N", "said"), [(40.0, True), (1000.0, False)])
def test_over_a_log_the_middle_tension_of_each_wire_counts(usual_N, said):
    robot = _stadium()
    place = np.column_stack([np.linspace(-10, 10, 5), np.zeros(5), np.full(5, 8.0)])
    tension = np.full((5, 4), usual_N)
    tension[:2, 0] = [-0.3, 0.2]  # slack for once
    assert bool(sag.sag_warnings_of_poses(robot, place, np.tile(np.eye(3), (5, 1, 1)), tension)) is said
    unknown = np.full((5, 4), np.nan)
    assert sag.sag_warnings_of_poses(robot, place, np.tile(np.eye(3), (5, 1, 1)), unknown) == []


@pytest.mark.parametrize("options", [[], ["--anchor-sd", "2"]])
def test_a_calibration_of_heavy_wires_says_so(fitted, session_csv, tmp_path, options):  # noqa: F811
    file, _ = session_csv
    robot, out = tmp_path / "heavy.toml", tmp_path / "out"
    text = (SHIPPED / "linear-7.toml").read_text()
    robot.write_text(text + "\n[wires.default]\nmass_kg_m = 0.3\n")
    given = ["calibrate", robot, file, "--wires", fitted, "--output", out, "--next-poses", "1", "--draws", "10"]
    assert main(list(map(str, [*given, *options]))) == 0
    kinds = [one["kind"] for one in read_json(out / "calibration.json")["warnings"]]
    assert kinds.count("sag") == 1

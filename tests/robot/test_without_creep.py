"""A robot on wires that do not creep: its platform stays exactly where it is, and pages say so."""

from importlib import resources

import numpy as np
import pytest

import wirebayes as wb
from wirebayes.io.run_folder import read_json
from wirebayes.report.pictures.robot import in_time
from wirebayes.robot.motion import drift

WAY = "time_s,x_m,y_m,z_m\n0,0,0,0.6\n60,0.05,0,0.6\n120,0.05,0.05,0.6\n"


@pytest.fixture(scope="module")
def steel(tmp_path_factory):
    """The file of a robot on cables of a stated stiffness, with seven of them."""
    shipped = (resources.files("wirebayes") / "data" / "robots" / "linear-7.toml").read_text()
    path = tmp_path_factory.mktemp("robot") / "steel.toml"
    given = shipped.replace("[[leg]]", "[wires.steel]\nk1_N = 1e5\n\n[[leg]]", 1)
    path.write_text(given.replace("[[leg]]\n", '[[leg]]\nwire = "steel"\n'))
    return path


@pytest.fixture(scope="module")
def posed(steel, tmp_path_factory):
    return wb.pose(steel, times=[0, 60, 3600], draws=40, output=tmp_path_factory.mktemp("out") / "pose")


@pytest.fixture(scope="module")
def on_its_way(steel, tmp_path_factory):
    way = steel.with_name("way.csv")
    way.write_text(WAY)
    return wb.pose(steel, trajectory=way, draws=40, output=tmp_path_factory.mktemp("out") / "way")


def test_its_drift_is_zero_and_no_rounding(posed, on_its_way):
    for found in (posed, on_its_way):
        for entry in found.summary()["drift"]:
            for band in (entry["distance_mm"], entry["rotation_deg"], entry["tilt_deg"]):
                assert np.array(band["q95"], float).tolist() == [0.0] * 3
    assert posed.summary()["workspace"]["q95_drift_mm"] == 0.0


def test_terminal_and_page_say_that_it_does_not_drift(posed, on_its_way):
    assert posed.lines() == ["linear-7: within 1 h the platform does not drift, for its wires do not creep"]
    assert "too far" not in posed.next_step()
    assert on_its_way.lines() == ["linear-7: within 2 min the platform does not drift, for its wires do not creep"]
    for found in (posed, on_its_way):
        page = wb.write_report(found.folder).read_text()
        assert "the platform does not drift, for its wires do not creep." in page
        assert "10⁻" not in page and "e-1" not in page.partition("<script")[0].partition("<svg")[0]
        assert "1e+11" not in page


def test_nothing_is_drawn_enlarged(posed):
    scene = read_json(posed.folder / "scene.json")
    assert scene["drifted"] == [] and scene["exaggeration"] == 1.0
    assert len(scene["tensions_N"]) == 1 and min(scene["tensions_N"][0]) > 0.0


def test_the_picture_has_a_line_at_zero_on_an_axis_to_one(posed):
    entries = posed.summary()["drift"]
    figure = in_time(entries, "distance_mm", "distance from the pose, mm", "Drift")
    (axes,) = figure.axes
    assert axes.get_ylim()[1] == 1.0
    assert [text.get_text() for text in axes.texts] == ["zero at all times"]
    moved = [{**entry, "distance_mm": {**entry["distance_mm"], "q95": [0.0, 1e-5, 2e-5]}} for entry in entries]
    (axes,) = in_time(moved, "distance_mm", "distance from the pose, mm", "Drift").axes
    assert not axes.texts and axes.get_ylim()[1] < 1e-4


@pytest.mark.parametrize(
    ("shift", "angle", "is_nothing"), [(5e-12, 5e-12, True), (2e-11, 0.0, False), (0, 2e-11, False)]
)
def test_what_is_rounding_goes_by_the_size_of_the_robot(shift, angle, is_nothing):
    for span in (0.5, 1.0, 64.0):
        found = drift.are_rounding(span * np.array([0.0, 0.0, shift]), np.array(angle), span)
        assert bool(found) == is_nothing

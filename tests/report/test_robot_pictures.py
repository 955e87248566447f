import re
from types import SimpleNamespace

import numpy as np
import pytest

from wirebayes.report.drawn import svg
from wirebayes.report.pictures.robot import in_time, platform_edges
from wirebayes.report.pictures.robot_history import banded
from wirebayes.report.pictures.robot_space import workspace_maps
from wirebayes.robot.motion.claim import WorkspaceDrift


def test_the_platform_is_drawn_by_the_edges_of_its_hull():
    cube = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    edges = {tuple(sorted(pair)) for pair in platform_edges(cube)}
    assert edges == {(i, j) for i in range(8) for j in range(i + 1, 8) if np.abs(cube[i] - cube[j]).sum() == 1}


def test_a_flat_platform_is_a_polygon_and_a_point_is_none():
    triangle = np.array([[0, -1, 0], [-1, 1, 0], [1, 1, 0], [0, 0, 0]], float)
    assert {tuple(sorted(pair)) for pair in platform_edges(triangle)} == {(0, 1), (0, 2), (1, 2)}
    assert list(platform_edges(np.zeros((4, 3)))) == []
    assert list(platform_edges(np.array([[0, 0, 0], [1.0, 0, 0], [2, 0, 0]]))) == []


def test_a_flat_workspace_is_mapped_in_its_own_plane():
    x, z = (v.ravel() for v in np.meshgrid([0.0, 0.1, 0.2], [0.5, 0.6], indexing="ij"))
    for flat, across in ((1, "x"), (0, "y")):
        where = np.insert(np.column_stack([x, z]), flat, 7.0, axis=1)
        drift = np.arange(6.0)[:, None] * np.array([[1e-3, np.nan, 1e-3]])
        maps = workspace_maps(WorkspaceDrift(where, drift, 0 * drift, np.ones((6, 2)), 1.0, 1.0))
        assert list(maps) == ["drift"]  # nothing tilts
        (panel,) = [axes for axes in maps["drift"].axes if axes.get_label() != "<colorbar>"]
        assert (panel.get_xlabel(), panel.get_ylabel()) == (f"{across}, m", "z, m")
        np.testing.assert_allclose(panel.collections[0].get_array().ravel(), [0, 2, 4, 1, 3, 5])


def test_the_labels_of_a_map_lie_inside_its_picture():
    place = np.linspace(-0.24, 0.24, 7)
    where = np.array([[x, y, z] for z in (0.4, 0.6, 0.8) for y in place for x in place])
    drift = 1e-3 * (where[:, 2:] + where[:, :1] ** 2)
    still = np.zeros_like(drift)
    figure = workspace_maps(WorkspaceDrift(where, drift, still, np.ones((len(where), 2)), 1.0, 1.0))["drift"]
    found = re.findall(r'font-size: (\d+)px[^>]* x="([\d.-]+)"[^>]*rotate\(-90[^>]*>y, m<', svg(figure).decode())
    assert len(found) == 3
    for size, right in found:  # letters turned by a quarter rise to the left of their line, by less than their size
        assert float(right) >= 0.8 * float(size)


def _band(times_s):
    grown = np.linspace(0.0, 1.0, len(times_s))
    return {"mean": grown, "sd": grown, "q05": grown, "q50": grown, "q95": grown}


@pytest.mark.parametrize(
    ("last_s", "label", "told"),
    [(30.0, "time, s", None), (3600.0, "time", ["0", "10 s", "1 min", "10 min", "1 h"])],
)
def test_times_since_a_command_are_told_in_the_units_of_the_text(last_s, label, told):
    times = np.array([0.0, 0.01, 0.1, 1.0]) * last_s
    entry = {"specimen_spread": 0.0, "times_s": times, "distance_mm": _band(times)}
    (axes,) = in_time([entry, entry], "distance_mm", "mm", "Drift").axes
    assert axes.get_xlabel() == label
    if told is not None:
        assert [tick.get_text() for tick in axes.get_xticklabels()] == told


@pytest.mark.parametrize(
    ("last_s", "label", "end"), [(45.0, "time, s", 45.0), (1800.0, "time, min", 30.0), (7200.0, "time, h", 2.0)]
)
def test_a_history_is_drawn_in_the_unit_of_its_length(last_s, label, end):
    times = np.linspace(0.0, last_s, 5)
    history = SimpleNamespace(times_s=times, payload_kg=np.array([0.0, 1.0, 1.0, 1.0, 0.0]))
    drift = {"times_s": times, "distance_mm": _band(times)}
    axes, load = banded(drift, "distance_mm", "mm", "Drift", history).axes
    assert axes.get_xlabel() == label and axes.get_xlim() == (0.0, end)
    assert axes.lines[0].get_xdata()[-1] == end and load.lines[0].get_xdata()[-1] == end

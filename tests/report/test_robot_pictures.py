import re

import numpy as np

from wirebayes.report.drawn import svg
from wirebayes.report.pictures.robot import platform_edges
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

import numpy as np

from wirebayes.report.robot import _edges


def test_the_platform_is_drawn_by_the_edges_of_its_hull():
    cube = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    edges = {tuple(sorted(pair)) for pair in _edges(cube)}
    assert edges == {(i, j) for i in range(8) for j in range(i + 1, 8) if np.abs(cube[i] - cube[j]).sum() == 1}


def test_a_flat_platform_is_a_polygon_and_a_point_is_none():
    triangle = np.array([[0, -1, 0], [-1, 1, 0], [1, 1, 0], [0, 0, 0]], float)
    assert {tuple(sorted(pair)) for pair in _edges(triangle)} == {(0, 1), (0, 2), (1, 2)}
    assert list(_edges(np.zeros((4, 3)))) == []
    assert list(_edges(np.array([[0, 0, 0], [1.0, 0, 0], [2, 0, 0]]))) == []

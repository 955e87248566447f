"""Rotation vectors of matrices."""

import numpy as np
import pytest

from wirebayes.robot.mechanics import rotation


def test_a_matrix_that_is_not_finite_has_no_vector_and_leaves_the_others_theirs():
    vectors = np.array([[0.1, -0.2, 0.3], [0.0, 0.0, 0.0], [0.0, 3.1, 0.0]])
    turned = rotation.matrix(vectors)
    turned[1, 0, 0] = np.inf
    found = rotation.vector(turned)
    assert np.isnan(found[1]).all()
    assert found[[0, 2]] == pytest.approx(vectors[[0, 2]], abs=1e-12)
    assert np.isnan(rotation.vector(np.full((3, 3), np.nan))).all()

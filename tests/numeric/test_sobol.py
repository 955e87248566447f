"""Sobol' points are those of scipy."""

import numpy as np
import pytest
from scipy.stats import qmc

from wirebayes.numeric import sobol


@pytest.mark.parametrize("dimensions", [1, 2, 14, 40, 41])
@pytest.mark.parametrize("size", [2, 64, 4096])
def test_the_points_are_scipy_s(dimensions, size):
    expected = qmc.Sobol(dimensions, scramble=False).random(size) * size
    assert np.array_equal(sobol.strata(dimensions, size), expected)

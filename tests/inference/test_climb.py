"""The curvature of a density where a climb ended."""

import numpy as np
import pytest

from wirebayes.inference.climb import climb, curved
from wirebayes.numeric.typing import Array, Ints

SD = np.array([0.3, 2.0])


def normal(z: Array, rows: Ints) -> Array:
    """(m,) log density of independent normals with a mode at zero."""
    return np.asarray(-0.5 * ((z / SD) ** 2).sum(axis=1))


def standardised(z: Array, rows: Ints) -> tuple[Array, Array]:
    """The same with its residuals."""
    return normal(z, rows), (z / SD).T


@pytest.mark.parametrize(("jump", "is_kept"), [(0.0, False), (5.0, False), (20.0, True), (1000.0, True)])
def test_differences_across_a_jump_do_not_count_as_curvature(jump: float, is_kept: bool):
    """As beside the place where a wire goes slack: what lies behind has a lower density, however near."""

    def density(z: Array, rows: Ints) -> Array:
        return normal(z, rows) - np.where(z[:, 0] > 1e-9, jump, 0.0)

    start = np.array([[-0.5, 8.0]])
    expected = climb(normal, start, standardised, curvature_at_end=False)
    at_jump = curved(density, expected)
    assert np.array_equal(at_jump.curvature, expected.curvature) == is_kept
    log_volume = -0.5 * np.linalg.slogdet(at_jump.curvature)[1]
    assert log_volume == pytest.approx(np.log(SD).sum(), abs=4.0)


@pytest.mark.parametrize(("rows", "ends"), [(1000, True), (1001, False)])
def test_few_rows_that_creep_are_ended_by_the_density_s_own_curvature(rows: int, ends: bool):
    """Where the expected information is fifty times the curvature, each of its steps goes a fiftieth of the way."""

    def density(z: Array, rows: Ints) -> Array:
        return 0.02 * normal(z, rows)

    def residuals(z: Array, rows: Ints) -> tuple[Array, Array]:
        return density(z, rows), (z / SD).T

    start = np.tile([-0.5, 8.0], (rows, 1))
    found = climb(density, start, residuals, iterations=30, curvature_at_end=False)
    assert (found.converged == ends).all()
    assert (np.abs(found.z / SD).max() < 0.05) == ends
    np.testing.assert_allclose(found.curvature, np.tile(np.diag(SD**-2.0), (rows, 1, 1)), rtol=1e-4, atol=1e-4)

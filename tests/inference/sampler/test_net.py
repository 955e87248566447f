"""Nets around given points: every stratum once, every point uniform, and no matter which of them was given."""

import numpy as np
import pytest
from scipy import stats

from wirebayes.inference.sampler import net


@pytest.mark.parametrize("size", [2, 8, 64])
def test_every_coordinate_has_one_point_in_each_stratum_and_the_given_one_comes_first(size: int) -> None:
    random = np.random.RandomState(1)
    given = random.uniform(size=(50, 6))
    points = net.around(given, size, random)
    assert points.shape == (50, size, 6) and np.array_equal(points[:, 0], given)
    strata = np.sort((points * size).astype(int), axis=1)
    assert (strata == np.arange(size)[None, :, None]).all()


def test_pairs_of_coordinates_are_filled_evenly() -> None:
    """The first two of Sobol's coordinates: one of 64 points in each of 8 x 8 squares, and of 16 x 4 and 4 x 16 too."""
    random = np.random.RandomState(2)
    points = net.around(random.uniform(size=(20, 2)), 64, random)
    for across in (4, 8, 16):
        cell = (points[..., 0] * across).astype(int) * (64 // across) + (points[..., 1] * (64 // across)).astype(int)
        assert (np.sort(cell, axis=1) == np.arange(64)).all()


@pytest.mark.parametrize("generator", [np.random.RandomState, np.random.default_rng])
def test_every_point_is_uniform_also_within_its_stratum(generator) -> None:  # type: ignore[no-untyped-def]
    random = generator(3)
    points = net.around(random.uniform(size=(4000, 3)), 8, random)
    for i in range(8):
        for j in range(3):
            assert stats.kstest(points[:, i, j], "uniform").pvalue > 1e-4
            assert stats.kstest(8 * points[:, i, j] % 1.0, "uniform").pvalue > 1e-4


def test_what_is_seen_of_a_net_does_not_depend_on_which_point_was_given() -> None:
    """Walkers that go to another point of the net around them, and on to one of a net around that: pairs of places far
    apart in time are independent, which they are not where nets of one walker were the same again and again."""
    random, n = np.random.RandomState(4), 20_000
    at = random.uniform(size=(n, 2))
    begun = at.copy()
    for _ in range(3):
        points = net.around(at, 8, random)
        at = points[np.arange(n), random.randint(1, 8, size=n)]
    for j in range(2):
        assert stats.kstest(at[:, j], "uniform").pvalue > 1e-4
        # the distance around a circle from where a walker began, within strata of the net
        assert stats.kstest(8.0 * (at[:, j] - begun[:, j]) % 1.0, "uniform").pvalue > 1e-4
    both = np.histogram2d(at[:, 0], at[:, 1], bins=8, range=[[0, 1], [0, 1]])[0]
    assert stats.chisquare(both.ravel()).pvalue > 1e-4


def test_pairs_look_the_same_from_either_end() -> None:
    """Distances between digits of the given point and another one, against those of two others."""
    random, n = np.random.RandomState(5), 4000
    points = (net.around(random.uniform(size=(n, 3)), 16, random) * 16).astype(int)
    row = np.arange(n)
    one, other = 1 + np.array([random.permutation(15)[:2] for _ in range(n)]).T

    def table(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """How often the three coordinates part at which of their binary digits."""
        level = np.frexp((a ^ b).astype(float))[1]
        return np.bincount(level @ [25, 5, 1], minlength=125)

    given, others = table(points[:, 0], points[row, one]), table(points[row, one], points[row, other])
    some = given + others > 20
    assert stats.chi2_contingency([given[some], others[some]]).pvalue > 1e-4


def test_means_over_a_net_are_far_closer_than_those_of_independent_points() -> None:
    """Of a sum of smooth functions, some hundred times: the point within its stratum is all that is left to chance."""
    random = np.random.RandomState(6)
    points = net.around(random.uniform(size=(500, 8)), 64, random)
    means = (points**2).sum(axis=2).mean(axis=1)
    independent = 8 * (1 / 5 - 1 / 9) / 64
    assert means.var() < independent / 1000


def test_any_number_of_even_points_in_random_order() -> None:
    rng = np.random.default_rng(7)
    points = net.even(64, 3, rng)
    assert (np.sort((64 * points).astype(int), axis=0) == np.arange(64)[:, None]).all()
    for n in (1, 5, 100):
        assert net.even(n, 3, rng).shape == (n, 3)
    # in the sequence's own order the first and second point, the third and fourth, ... are of different halves
    halves = np.array([net.even(32, 2, rng)[:, 0] > 0.5 for _ in range(300)])
    assert (halves[:, 1::2] != halves[:, ::2]).mean() == pytest.approx(16 / 31, abs=0.03)


def test_nets_around_one_point_differ() -> None:
    """Each other point lies in any stratum of the half where the given one is not, or of the quarter, or the eighth."""
    random = np.random.RandomState(8)
    points = (net.around(np.full((4000, 2), 0.1), 8, random) * 8).astype(int)
    for i in range(1, 8):
        for j in range(2):
            found = np.bincount(points[:, i, j], minlength=8)
            assert np.count_nonzero(found) in (1, 2, 4)  # of stratum 0's sibling, their cousins, the other half
            if np.count_nonzero(found) > 1:
                assert stats.chisquare(found[found > 0]).pvalue > 1e-4
    assert {np.count_nonzero(np.bincount(points[:, i, 0])) for i in range(1, 8)} == {1, 2, 4}

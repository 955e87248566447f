"""Stacks of matrices of which some have no answer."""

import numpy as np
import pytest
from scipy import stats

from wirebayes.model import likelihoods
from wirebayes.model.hold_filter import Measured
from wirebayes.numeric.linear_algebra import cholesky, eigh, inv, solve
from wirebayes.prediction.predictive import _regressed
from wirebayes.wire.staircase import Linearised

RNG = np.random.default_rng(0)
ROOT = RNG.normal(size=(5, 3, 3))
GOOD = ROOT @ np.swapaxes(ROOT, 1, 2) + np.eye(3)
SINGULAR, OVERFLOWN, UNKNOWN = np.ones((3, 3)), np.full((3, 3), np.inf), np.full((3, 3), np.nan)
MIXED = np.concatenate([GOOD[:2], [SINGULAR, OVERFLOWN, UNKNOWN], GOOD[2:]])
HAVE_NONE = slice(2, 5)


def others(array: np.ndarray) -> np.ndarray:
    return np.delete(array, HAVE_NONE, axis=0)


def test_one_matrix_without_an_answer_leaves_the_others_theirs() -> None:
    right = RNG.normal(size=(8, 3, 2))
    for found, alone in [
        (solve(MIXED, right), np.linalg.solve(GOOD, others(right))),
        (inv(MIXED), np.linalg.inv(GOOD)),
    ]:
        assert np.isnan(found[HAVE_NONE]).all() and np.array_equal(others(found), alone)
    factors = cholesky(MIXED)
    assert np.isnan(factors[HAVE_NONE]).all() and np.array_equal(others(factors), np.linalg.cholesky(GOOD))
    values, vectors = eigh(MIXED)
    assert np.isnan(values[3:5]).all() and np.isnan(vectors[3:5]).all()
    assert values[2] == pytest.approx([0.0, 0.0, 3.0], abs=1e-12)  # a singular one has eigenvalues
    assert np.array_equal(others(values), np.linalg.eigh(GOOD)[0])


def test_a_single_matrix_is_answered_too() -> None:
    assert np.isnan(solve(SINGULAR, np.ones((3, 1)))).all() and np.isnan(inv(UNKNOWN)).all()
    assert np.array_equal(inv(GOOD[0]), np.linalg.inv(GOOD[0]))


def test_a_hold_left_out_at_absurd_parameters_is_impossible_and_harms_no_other_draw() -> None:
    """Two setting errors that move the readings alike, and so far that the variance beside them is lost: singular."""
    holds, width = 2, 2
    size = np.broadcast_to([1.0, 1e12], (holds, width, 2))
    readings, mask = np.zeros((holds, width, 1)), np.ones((holds, width), bool)

    def left_out(rows: slice) -> np.ndarray:
        moves, one = size[..., rows], np.ones(2)[rows]
        by_setting = moves * np.array([0.0, 1.0])[:, None, None]
        carry = np.ones((holds, len(one)))
        line = Linearised(0.0 * moves, by_setting, moves, carry, carry, np.zeros((holds + 1, len(one))))
        seen = Measured(readings, mask, one, one)
        return likelihoods.without_each_hold(line, likelihoods.chain(line, seen), seen)

    both = left_out(slice(0, 2))
    assert np.array_equal(both[:, :1], left_out(slice(0, 1))) and not np.isnan(both).any()


@pytest.mark.parametrize(("squared", "possible"), [(0.99e13, True), (1.01e13, False), (1e60, False)])
def test_a_hold_is_not_left_out_where_rounding_would_decide(squared: float, possible: bool) -> None:
    """The density of a later hold so far from its reading is a difference of numbers that have no decimals left."""
    one, shape = np.ones(1), (2, 1, 1)
    tension = np.array([0.0, np.sqrt(squared)]).reshape(shape)
    line = Linearised(tension, 0.0 * tension, np.ones(shape), np.ones((2, 1)), np.ones((2, 1)), np.zeros((3, 1)))
    seen = Measured(np.zeros(shape), np.ones((2, 1), bool), one, one)
    without = likelihoods.without_each_hold(line, likelihoods.chain(line, seen), seen)[:, 0]
    assert np.isfinite(without).tolist() == [possible, True]
    assert without[1] == pytest.approx(stats.norm.logpdf(0.0))  # its own readings, however far, take no part


def test_given_readings_that_vary_as_one_condition_as_one_of_them() -> None:
    drawn = RNG.normal(size=(3, 50))
    once = _regressed(drawn, drawn[:1], np.array([0.3]))
    twice = _regressed(drawn, drawn[[0, 0]], np.array([0.3, 0.3]))
    np.testing.assert_allclose(twice, once, atol=1e-12)
    still = np.full((1, 50), 0.3)
    assert np.array_equal(_regressed(drawn, still, np.array([0.3])), drawn)

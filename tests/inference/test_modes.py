"""Rows far from one another, where there are enough of them."""

import numpy as np

from wirebayes.inference.sampler.mixture import spread_rows


def test_rows_are_spread_and_never_repeated():
    x = np.repeat(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 5.0]]), 4, axis=0)
    for wanted, found in ((2, 2), (3, 3), (5, 3)):
        rows = spread_rows(x, wanted, np.random.default_rng(wanted))
        assert len(rows) == found == len(np.unique(x[rows], axis=0))

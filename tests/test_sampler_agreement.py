"""The check of effective draws: independent runs that keep their promise, and runs that promise too many."""

import numpy as np
import pytest

from analyses.posterior.sampler_agreement import agreement


@pytest.mark.parametrize("times", [1.0, 9.0])
def test_runs_that_promise_too_many_draws_scatter_by_more_than_promised(times: float) -> None:
    """Of 400 independent runs with 1,000 draws each; nine times as many are promised, so errors are a third."""
    rng = np.random.default_rng(0)
    runs = [(i < 7, rng.normal(size=(1000, 2)) * [1.0, 5.0], np.full(2, 1000.0 * times)) for i in range(400)]
    converged, means, tails, apart = agreement(runs)
    assert converged == 7
    assert means == pytest.approx(np.full(2, np.sqrt(times)), rel=0.15)  # four standard errors of a spread
    assert tails == pytest.approx(np.full((2, 2), np.sqrt(times)), rel=0.15)
    assert 5.0 / np.sqrt(1000) < apart < 8.0 / np.sqrt(1000)

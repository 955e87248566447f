"""Maps of amplitudes and parameters whose prior ends somewhere: against the distributions of scipy."""

import numpy as np
import pytest
from scipy import stats

from wirebayes.inference.coordinates.edges import edge

ENDED = [
    stats.halfnorm(0.0, 2.0),
    stats.halfcauchy(0.0, 2.5),
    stats.uniform(-1.0, 4.0),
    stats.truncnorm(-1.0, np.inf, loc=0.01, scale=0.01),
    stats.truncnorm(0.0, np.inf, loc=0.0, scale=3.0),
    stats.truncnorm(-7.9, np.inf, loc=7.9, scale=1.0),
    stats.loguniform(2.0, 5.5),
]


@pytest.mark.parametrize("of", ENDED, ids=lambda d: f"{d.dist.name}{d.args}")
def test_scores_are_standard_normal_under_the_prior(of):
    found, share = edge(of), np.array([1e-6, 0.01, 0.2, 0.5, 0.77, 0.99, 1.0 - 1e-6])
    value = of.ppf(share)
    assert found.score(value) == pytest.approx(stats.norm.ppf(share), abs=1e-6)
    assert found.value(stats.norm.ppf(share)) == pytest.approx(value, rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("of", ENDED, ids=lambda d: f"{d.dist.name}{d.args}")
def test_no_score_leaves_the_support(of):
    low, high = of.support()
    value = edge(of).value(np.linspace(-12.0, 12.0, 200))
    assert (value >= low).all() and (value <= high).all() and (np.diff(value) >= 0).all()


def test_a_normal_prior_cut_off_on_both_sides_has_no_map():
    assert edge(stats.truncnorm(-1.0, 1.0)) is None and edge(stats.norm()) is None

"""The likelihood of tests under weights against dense normal distributions."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from tests.model.dense import log_density, normal
from tests.model.test_likelihoods import ERRORS, TIMES, WEIGHTS, filtered, measured, models, noises
from tests.wire.protocols import PLAIN, columns, parameters, protocol, protocols
from wirebayes.model import single_holds
from wirebayes.wire.model import Model


@given(protocols(control="force"), parameters(), noises, models, st.sampled_from([0.0, 0.01]), st.integers(0, 99))
@settings(max_examples=100, deadline=None)
def test_the_chain_is_the_dense_normal(p, theta, errors, model, resolution, seed):
    theta = theta | {**errors, "setting_sd": min(errors["setting_sd"], 0.02)}
    y = measured(p, theta, model, seed)
    r, covariance, _ = normal(p, theta, model, y, resolution)
    found = filtered(p, theta, y, model, resolution).log_likelihood.sum()
    scale = np.linalg.cond(covariance) * 1e-16 * (len(r) + r @ np.linalg.solve(covariance, r))
    assert found == pytest.approx(log_density(r, covariance), rel=1e-9, abs=1e-9 + 10 * scale)


def test_an_error_of_a_weight_moves_later_holds_through_the_creep():
    """A hundredth of a newton too much in the first hold is seen in the second one, whose weight is right."""
    p = protocol([4.0, 1.0], [[0.0, 600.0], TIMES], control="force")
    covariance = normal(p, PLAIN | ERRORS, Model(), np.zeros(p.mask.shape))[1]
    first, second = covariance[0, 1], covariance[0, 2]
    assert first > 0 and second / first > 0.05


def test_hold_by_hold_the_first_reading_fixes_the_offset_and_its_error_counts():
    """Elongations since the first reading: a dense normal of differences, of which k1 and the preload are no part."""
    y = measured(WEIGHTS, PLAIN | ERRORS)
    p, variance = WEIGHTS, ERRORS["sensor_sd"] ** 2
    theta = {name: value for name, value in columns(**PLAIN).items() if name not in ("k1", "preload")}
    found = single_holds.hold_by_hold(p, theta, Model(), y[..., None], np.array([variance]))[:, 0]
    for j, weight in enumerate(p.setting):
        if not p.recorded[j]:
            assert found[j] == 0.0
            continue
        grown = PLAIN["B"] * weight ** PLAIN["U"] * -np.expm1(-PLAIN["k2"] * np.array(TIMES) ** PLAIN["N"])
        later = (y[j] - y[j, 0])[1:] - (grown - grown[0])[1:]
        covariance = variance * (np.eye(3) + np.ones((3, 3)))
        assert found[j] == pytest.approx(stats.multivariate_normal(np.zeros(3), covariance).logpdf(later), rel=1e-9)
    total, residuals = single_holds.standardised_hold_by_hold(p, theta, Model(), y[..., None], np.array([variance]))
    assert total[0] == pytest.approx(found.sum(), rel=1e-12) and np.isfinite(residuals).all()


def test_hold_by_hold_an_offset_of_the_gauge_changes_nothing():
    y = measured(WEIGHTS, PLAIN | ERRORS)
    theta = columns(**PLAIN)
    one, other = (
        single_holds.hold_by_hold(WEIGHTS, theta, Model(), (y + offset)[..., None], np.array([1e-4]))
        for offset in (0.0, -37.0)
    )
    np.testing.assert_allclose(one, other, rtol=1e-9)

"""The spread of specimens, against a grid, simulated lines of known spread, and what no test determines."""

import numpy as np
import pytest
from scipy import stats

from wirebayes.inference.between_specimens import SPREAD, between_specimens

PRIOR = np.log([2000.0, 0.37, 0.5, 0.03, 0.65]), np.diag([1.5, 1.2, 0.7, 1.2, 0.45]) ** 2


def _posteriors(centres, error, prior, rng):
    """Draws of each specimen's posterior, of the same moments as the normal one: a measured centre and the prior."""
    before, tested = np.linalg.inv(prior[1]), np.linalg.inv(error)
    covariance = np.linalg.inv(before + tested)
    for centre in centres:
        mean = covariance @ (before @ prior[0] + tested @ centre)
        unit = rng.standard_normal((400, len(mean)))
        unit = np.linalg.solve(np.linalg.cholesky(np.cov(unit.T).reshape(2 * (len(mean),))), (unit - unit.mean(0)).T).T
        yield mean + unit @ np.linalg.cholesky(covariance).T


def test_one_parameter_agrees_with_a_grid():
    prior, error = (np.array([1.0]), np.array([[0.36]])), np.array([[0.04**2]])
    centres = np.array([[1.3], [1.45], [1.38], [1.6]])
    rng = np.random.default_rng(1)
    found = between_specimens(list(_posteriors(centres, error, prior, rng)), prior, 4000, rng)
    mean, log_s = np.meshgrid(np.linspace(0.5, 2.5, 401), np.linspace(-6.0, 0.5, 261), indexing="ij")
    weight = stats.norm.logpdf(mean, 1.0, 0.6) + SPREAD.logpdf(np.exp(log_s)) + log_s
    for centre in centres[:, 0]:
        weight += stats.norm.logpdf(centre, mean, np.hypot(np.exp(log_s), 0.04))
    weight = np.exp(weight - weight.max())
    weight /= weight.sum()
    for drawn, grid in ((found.mean[:, 0], mean), (np.log(found.spread[:, 0]), log_s)):
        centre = (weight * grid).sum()
        sd = np.sqrt((weight * (grid - centre) ** 2).sum())
        assert drawn.mean() == pytest.approx(centre, abs=0.08 * sd)
        assert drawn.std() == pytest.approx(sd, rel=0.08)
    assert found.effective > 1000


@pytest.mark.slow
def test_bands_hold_a_new_specimen():
    rng, inside = np.random.default_rng(2), []
    error = np.diag([0.01, 0.03, 0.05, 0.05, 0.02]) ** 2
    for tests in (2, 3, 6) * 20:
        sd = SPREAD.rvs(5, random_state=rng)
        line = rng.multivariate_normal(*PRIOR)
        centres = line + sd * rng.standard_normal((tests, 5))
        centres = centres + rng.standard_normal((tests, 5)) @ np.sqrt(error)
        found = between_specimens(list(_posteriors(centres, error, PRIOR, rng)), PRIOR, 500, rng)
        new = found.mean + found.spread * rng.standard_normal((500, 5))
        low, high = np.quantile(new, [0.05, 0.95], axis=0)
        inside.append(np.diff(stats.norm.cdf([low, high], line, sd), axis=0).mean())
    error_of = np.std(inside) / np.sqrt(len(inside))
    assert abs(np.mean(inside) - 0.9) < 3 * error_of
    assert error_of < 0.02


def test_what_no_test_determines_stays_unknown():
    prior, rng = (np.zeros(2), np.diag([1.0, 0.49])), np.random.default_rng(3)
    posteriors = [
        np.column_stack([0.3 + 0.02 * rng.standard_normal(1000), 0.7 * rng.standard_normal(1000)]) for _ in range(8)
    ]
    found = between_specimens(posteriors, prior, 2000, rng)
    assert found.mean[:, 0].std() < 0.05
    assert found.mean[:, 1].std() > 0.4  # eight posteriors that only repeat the prior are not eight tests

"""How much specimens of one line differ, from the posteriors of several that were fitted by themselves.

The logarithms ``x`` of a specimen's parameters are normal about the line's ``μ`` with independent standard deviations
``s``. A specimen's readings enter as the normal approximation of its posterior with the prior of its fit taken out:
precision ``Λ = S⁻¹ - S₀⁻¹``, so that a parameter that no test determines stays unknown however many tests there are.
Specimens and ``μ`` are integrated out in closed form; from the density of ``log s`` that is left, importance sampling
about its mode draws. Few specimens leave the spreads near their prior (`SPREAD`) and their bands wide.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.random import Generator
from scipy import optimize

from wirebayes.numeric.distributions import LogNormal
from wirebayes.numeric.resampling import systematic_rows
from wirebayes.numeric.typing import Floats

SPREAD = LogNormal(1.0, 0.05)  # specimens of one line mostly agree within one to twenty-five per cent
_PROPOSALS = 4000  # importance draws: a thousand effective ones and more with five parameters
_REACH = 4.0  # prior sd of log s in which the mode is sought
_FREEDOM = 5.0  # of the proposal's t distribution: tails beyond those of a normal prior of log s
_ONE_SD = 0.841344746  # the share of a normal distribution below one standard deviation
_STEP = 0.05  # in log s, for the curvature at the mode


@dataclass(frozen=True)
class LineDraws:
    """Draws of what a line's specimens have in common, and of how they differ.

    Attributes
    ----------
    mean : (n, p) array
        Of the logarithms.
    spread : (n, p) array
        Standard deviations of the logarithms from specimen to specimen.
    effective : float
        How many independent draws the importance sampling gave.
    """

    mean: Floats
    spread: Floats
    effective: float


_Moments = tuple[Floats, Floats]  # mean (p,) and covariance (p, p)
_Information = tuple[Floats, Floats]  # precision (p, p), and precision times mean (p,)


def between_specimens(logarithms: list[Floats], prior: _Moments, count: int, rng: Generator) -> LineDraws:
    """Line and spread given posteriors of specimens.

    Parameters
    ----------
    logarithms : list of (n_j, p) array
        Posterior draws of each specimen's parameters.
    prior : (p,), (p, p) arrays
        Mean and covariance of the logarithms under the prior of the fits, which is the line's prior too.
    count : int
        Draws wanted.
    rng : numpy Generator
    """
    information = [_information(values, prior) for values in logarithms]
    middle = float(np.log(SPREAD.median()))
    sd = float(np.log(SPREAD.ppf(_ONE_SD)) - middle)  # of log s, which is normal

    def log_density(log_s: Floats) -> Floats:
        log_prior = -0.5 * (((log_s - middle) / sd) ** 2).sum(1)
        log_likelihood, _, _ = _collapsed(log_s, information, prior)
        return log_likelihood + log_prior

    start = np.full(len(prior[0]), middle)
    mode = _mode(log_density, start, _REACH * sd)
    root = np.asarray(np.linalg.cholesky(_covariance(log_density, mode, sd)), np.float64)
    log_s, weight = _weighted(log_density, mode, root, rng)
    rows = systematic_rows(weight, count, rng)
    chosen = log_s[rng.permutation(rows)]
    _, precision, vector = _collapsed(chosen, information, prior)
    line = _normal_draws(precision, vector, rng)
    effective = float(1.0 / (weight**2).sum())
    return LineDraws(line, np.exp(chosen), effective)


def _mode(log_density: Callable[[Floats], Floats], start: Floats, reach: float) -> Floats:
    """Where the density of log s is largest, no farther than so much from the start in any coordinate."""

    def unlikely(log_s: Any) -> float:
        return -float(log_density(np.asarray(log_s)[None])[0])

    bounds = [(middle - reach, middle + reach) for middle in start]
    found = optimize.minimize(unlikely, start, method="L-BFGS-B", bounds=bounds)
    return found.x


def _normal_draws(precision: Floats, vector: Floats, rng: Generator) -> Floats:
    """A draw (p,) of each of n normal distributions, of precisions (n, p, p) and their products with the means."""
    covariance = np.linalg.inv(precision)
    centre = np.einsum("nij,nj->ni", covariance, vector)
    root = np.linalg.cholesky(covariance)
    return centre + np.einsum("nij,nj->ni", root, rng.standard_normal(vector.shape))


def _weighted(
    log_density: Callable[[Floats], Floats], mode: Floats, root: Floats, rng: Generator
) -> tuple[Floats, Floats]:
    """Points ``(n, p)`` of a Student t about the mode, and their weights for the density, which sum to one."""
    p = len(mode)
    normal = rng.standard_normal((_PROPOSALS, p))
    scale = np.sqrt(_FREEDOM / rng.chisquare(_FREEDOM, _PROPOSALS))
    unit = normal * scale[:, None]
    points = mode + unit @ root.T
    proposal = -0.5 * (_FREEDOM + p) * np.log1p((unit**2).sum(1) / _FREEDOM)
    log_weight = log_density(points) - proposal
    weight = np.exp(log_weight - log_weight.max())
    return points, weight / weight.sum()


def _information(values: Floats, prior: _Moments) -> _Information:
    """Precision and vector of a specimen's readings alone: its posterior without the prior, never below none."""
    mean, covariance = prior
    before = np.linalg.inv(covariance)
    spread = np.atleast_2d(np.cov(values.T))
    precision = np.linalg.inv(spread)
    vector = precision @ values.mean(0) - before @ mean
    scale = np.sqrt(np.diag(precision))
    products = np.outer(scale, scale)
    sizes, axes = np.linalg.eigh((precision - before) / products)
    kept = sizes > 1e-6  # what the readings say nothing of may come out negative
    axes = axes[:, kept]
    known = (axes * sizes[kept]) @ axes.T
    along = axes.T @ (vector / scale)
    part = scale[:, None] * (axes @ along[:, None])
    return products * known, part[:, 0]


def _collapsed(log_s: Floats, information: list[_Information], prior: _Moments) -> tuple[Floats, Floats, Floats]:
    """Log likelihood ``(n,)`` of spreads, and the precision and vector of the line's mean given them."""
    mean, covariance = prior
    before = np.linalg.inv(covariance)
    n, p = log_s.shape
    inverse_variance = np.exp(-2.0 * log_s)
    inverse = inverse_variance[:, :, None] * np.eye(p)
    precision = np.tile(before, (n, 1, 1))
    vector = np.tile(before @ mean, (n, 1))
    log_likelihood = np.zeros(n)
    for of_specimen in information:
        own_precision, own_vector, own_log_likelihood = _without_specimen(of_specimen, inverse)
        precision += own_precision
        vector += own_vector
        log_likelihood += own_log_likelihood
        log_likelihood -= log_s.sum(1)
    centre = np.linalg.solve(precision, vector[..., None])[..., 0]
    explained = (vector * centre).sum(1)
    log_likelihood += 0.5 * explained - 0.5 * _log_determinant(precision)
    return log_likelihood, precision, vector


def _without_specimen(of_specimen: _Information, inverse: Floats) -> tuple[Floats, Floats, Floats]:
    """What a specimen adds to precision, vector and log likelihood of the line's mean, itself integrated out.

    `inverse` ``(n, p, p)`` is the precision of a specimen about the line.
    """
    own, vector = of_specimen
    both = own + inverse
    within = np.linalg.inv(both)
    square = np.einsum("i,nij,j->n", vector, within, vector)
    log_likelihood = 0.5 * square - 0.5 * _log_determinant(both)
    along = np.einsum("nij,njk,k->ni", inverse, within, vector)
    return inverse - inverse @ within @ inverse, along, log_likelihood


def _log_determinant(matrices: Floats) -> Floats:
    """(n,) of (n, p, p)."""
    return np.linalg.slogdet(matrices)[1]


def _covariance(log_density: Callable[[Floats], Floats], mode: Floats, sd: float) -> Floats:
    """Inverse curvature at the mode, no wider than the prior in any direction."""
    curvature = _curvature(log_density, mode)
    sizes, axes = np.linalg.eigh(curvature)
    least = sd**-2
    return (axes / np.maximum(sizes, least)) @ axes.T


def _curvature(log_density: Callable[[Floats], Floats], mode: Floats) -> Floats:
    """(p, p) negative second derivatives at the mode, by differences."""
    p = len(mode)
    steps = _STEP * np.eye(p)
    corners = []
    for one in steps:
        for other in steps:
            corners += [mode + a * one + b * other for a in (1, -1) for b in (1, -1)]
    at_corners = log_density(np.array(corners))
    both, one_back, other_back, both_back = at_corners.reshape(p * p, 4).T
    second = both - one_back - other_back + both_back
    hessian = -second.reshape(p, p) / (4 * _STEP**2)
    return 0.5 * (hessian + hessian.T)

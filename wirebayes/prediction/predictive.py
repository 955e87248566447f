"""Predicted readings: parameter, setting, sensor and rounding error, given the training readings and the earlier holds.

For each posterior draw the setting errors of the training holds are drawn given the training readings (a normal
distribution, to the linearisation of the likelihood); then the whole staircase, past and future, is computed with exact
setting errors. So the carried creep, and whatever effects carry beside it, is what the readings imply.

A first reading that is given later conditions the predicted readings jointly, parameters and setting errors at once:
each draw is shifted by the regression of all readings on the given ones, which is exact where they are jointly normal.
"""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from wirebayes.model.hold_filter import LOG_2PI
from wirebayes.model.problem import Problem
from wirebayes.model.sample import Sample
from wirebayes.model.single_holds import from_first_readings
from wirebayes.numeric.linear_algebra import cholesky, eigh, solve
from wirebayes.numeric.log_sum import or_impossible
from wirebayes.numeric.typing import Bools, Floats, Ints
from wirebayes.wire.protocol import Protocol
from wirebayes.wire.staircase import linearise
from wirebayes.wire.walk import Theta, Walk

_CHUNK = 500  # draws at a time: bounds the memory of the normal equations


@dataclass(frozen=True)
class PredictionRequest:
    """The readings that are to be predicted, and the history that they follow.

    Attributes
    ----------
    protocol : Protocol
        The training holds first, then the holds to come; or, for a fresh sample, the requested holds alone.
    trained : int
        How many leading holds belong to the training; 0 for a fresh sample.
    requested : (H,) bool array
        A trained hold that is requested is predicted as a replicate: new noise, new setting error.
    first : (H,) array
        A hold's first reading, N or mm, where the prediction shall be given it, else NaN.
    """

    protocol: Protocol
    trained: int
    requested: Bools
    first: Floats


def draw_predictive(
    problem: Problem, theta: Floats, sample: Sample, request: PredictionRequest, rng: Generator
) -> Floats:
    """Draws of the requested readings.

    Parameters
    ----------
    problem : Problem
        Says how the columns of `theta` are named, and the likelihood.
    theta : (n, d) array
        Posterior draws.
    sample : Sample
        The one of the problem's samples that goes on; its readings are the history.
    rng : numpy Generator

    Returns
    -------
    (H, R, n) array
        Zero for holds that were not requested. Rounding is continuous: uniform within half a step.
    """
    drawn = draw_unconditioned(problem, theta, sample, request, rng)
    return drawn if problem.likelihood == "hold" else given_first(drawn, request)


def draw_unconditioned(
    problem: Problem, theta: Floats, sample: Sample, request: PredictionRequest, rng: Generator
) -> Floats:
    """`draw_predictive` before first readings condition it; hold by hold each hold begins with its own all the same.

    Parameters
    ----------
    problem, theta, sample, request, rng
        As for `draw_predictive`.
    """
    parts = [
        _readings(problem, theta[start : start + _CHUNK], sample, request, rng)
        for start in range(0, len(theta), _CHUNK)
    ]
    return np.concatenate(parts, axis=-1)


def _readings(problem: Problem, theta: Floats, sample: Sample, request: PredictionRequest, rng: Generator) -> Floats:
    own = problem.parameters(theta, sample)
    shape = (*request.protocol.time_s.shape, len(theta))
    noise = rng.normal(size=shape) * own["sensor_sd"]
    rounding = rng.uniform(-0.5, 0.5, shape) * sample.resolution
    error = noise + rounding
    if problem.likelihood == "hold":
        drawn = from_first_readings(request.protocol, own, sample.model, request.first, error)
    else:
        drawn = chain_course(own, sample, request, rng) + error
    return np.where(request.requested[:, None, None], drawn, 0.0)


def chain_course(own: Theta, sample: Sample, request: PredictionRequest, rng: Generator) -> Floats:
    """Readings without sensor error along the chain of holds; trained holds appear as replicates.

    A replicate has a setting error of its own, while the creep carried on from a trained hold is the one that its
    readings imply. An unknown discrepancy is an effect among the others here: its draws were made given the training
    readings.

    Parameters
    ----------
    own : mapping of name to (n,) array
        Posterior draws of the sample's parameters.
    sample : Sample
        What was trained on.
    request : PredictionRequest
        The protocol, trained holds first, and which of its holds are to be predicted.
    rng : numpy.random.Generator
        Draws the setting errors.

    Returns
    -------
    (H, R, n) array
        Readings of all holds of the protocol.
    """
    protocol = request.protocol
    trained = request.trained
    requested = request.requested
    n = len(own["B"])
    error = rng.normal(size=(len(requested), n)) * own["setting_sd"]
    error_again = error.copy()
    if trained:
        error[:trained] = settings_given_readings(own, sample, rng)
    setting = protocol.setting[:, None] + error
    setting_again = protocol.setting[:, None] + error_again
    walk = Walk(protocol, own, sample.model)
    creep, beside = walk.begin(n)
    out = []
    for j, is_requested in enumerate(requested):
        replicate = None
        if j < trained and is_requested:
            past = list(walk.past)
            replicate, _, _ = walk.hold(j, setting_again[j], creep, beside)
            walk.past = past
        readings, creep, beside = walk.hold(j, setting[j], creep, beside)
        out.append(readings if replicate is None else replicate)
    return np.array(out)


def settings_given_readings(own: Theta, sample: Sample, rng: Generator) -> Floats:
    """A draw of the setting errors of a sample's holds, unrecorded ones included, given all its readings.

    Parameters
    ----------
    own : mapping of name to (n,) array
        Posterior draws of the sample's parameters.

    Returns
    -------
    (H, n) array
        One draw of all holds for each draw of the parameters.
    """
    square, right = _normal_equations(own, sample)
    eigen, vectors = eigh(square)
    precision = 1.0 + np.maximum(eigen, 0.0)
    mean = np.einsum("nij,ni->nj", vectors, right) / precision
    # along the axes of holds: where two eigenvalues are nearly equal, the last bit decides where their vectors point
    normal = np.einsum("nij,ni->nj", vectors, rng.normal(size=right.shape))
    spread = normal / np.sqrt(precision)
    drawn: Floats = np.einsum("nij,nj->in", vectors, mean + spread) * own["setting_sd"]
    return drawn


def _normal_equations(own: Theta, sample: Sample) -> tuple[Floats, Floats]:
    """Matrices (n, H, H) and right sides (n, H) for the setting errors of all holds, in units of their own sd.

    Hold by hold, so that the whole Jacobian is never in memory.
    """
    line = linearise(sample.protocol, own, sample.model)
    sensor_sd = np.sqrt(sample.variance(own))
    unit = own["setting_sd"] / sensor_sd
    holds, _, n = line.reading.shape
    carried = np.zeros((holds, n))
    matrix = np.zeros((n, holds, holds))
    right = np.zeros((n, holds))
    for j, keep in enumerate(sample.protocol.mask):
        slope = line.by_creep[j][:, None, :] * carried[None]
        slope[:, j] = line.by_setting[j]
        slope = np.moveaxis(slope[keep] * unit, -1, 0)
        residual = sample.readings[j] - line.reading[j]
        residual = (residual[keep] / sensor_sd).T
        matrix += np.swapaxes(slope, 1, 2) @ slope
        right += np.einsum("nrh,nr->nh", slope, residual)
        carried = line.carry_by_creep[j] * carried
        carried[j] = line.carry_by_setting[j]
    return matrix, right


def given_first(drawn: Floats, request: PredictionRequest) -> Floats:
    """Condition the requested holds on the first readings given up to them; a replicate on its own alone.

    Parameters
    ----------
    drawn : (H, R, n) array
        Joint draws of all readings of a likelihood along the chain; changed in place.

    Returns
    -------
    (H, R, n) array
        The same array.
    """
    for j in reversed(np.flatnonzero(request.requested).tolist()):
        known = _known_at(request, j)
        if len(known):
            drawn[j] = _regressed(drawn[j], drawn[known, 0], request.first[known])
        if j in known:
            drawn[j, 0] = request.first[j]  # not only to the last digit
    return drawn


def log_density_of_given(drawn: Floats, request: PredictionRequest) -> Floats:
    """How well a model predicts the first readings that condition each hold, by a normal of its draws.

    Parameters
    ----------
    drawn : (H, R, n) array
        As `draw_unconditioned` returned them.

    Returns
    -------
    (H,) array
        Log densities; zero where nothing conditions a hold.
    """
    out = np.zeros(len(drawn))
    for j in np.flatnonzero(request.requested).tolist():
        known = _known_at(request, j)
        if len(known):
            out[j] = _log_normal(drawn[known, 0], request.first[known])
    return out


def _known_at(request: PredictionRequest, j: int) -> Ints:
    """Holds whose first readings condition hold j: those up to it that follow the training; of a replicate its own."""
    first = request.trained if j >= request.trained else j
    given = request.requested & np.isfinite(request.first)
    return np.flatnonzero(given[first : j + 1]) + first


def _log_normal(drawn: Floats, observed: Floats) -> float:
    """Log density at observed values (m,) of the normal with the moments of draws (m, n); -inf where it has none."""
    covariance = np.atleast_2d(np.cov(drawn))
    factor = cholesky(covariance)
    away = solve(factor, (observed - drawn.mean(axis=1))[:, None])
    with np.errstate(all="ignore"):
        log_density = -0.5 * (away**2).sum() - np.log(np.diag(factor)).sum() - 0.5 * len(observed) * LOG_2PI
    return float(or_impossible(log_density))


def _regressed(drawn: Floats, first: Floats, observed: Floats) -> Floats:
    """Joint draws (R, n) moved to where `first` (m, n) takes its observed values (m,)."""
    centred = first - first.mean(axis=1, keepdims=True)
    away = drawn - drawn.mean(axis=1, keepdims=True)
    square = centred @ centred.T
    across = centred @ away.T
    gain = solve(square, across).T
    if not np.isfinite(gain).all() and np.isfinite(square).all():  # given readings that do not vary, or vary as one
        gain = (np.linalg.pinv(square, hermitian=True) @ across).T
    return drawn + gain @ (observed[:, None] - first)

"""Draws of predicted readings by one or several models, of each as many as it is probable."""

from collections.abc import Sequence
from math import ceil

import numpy as np

from wirebayes.inference.fit import seed_of
from wirebayes.numeric.evenly import evenly
from wirebayes.numeric.log_sum import log_sum
from wirebayes.numeric.typing import Bools, Floats
from wirebayes.prediction.predictive import PredictionRequest, draw_unconditioned, given_first, log_density_of_given
from wirebayes.prediction.request import ProtocolRequest

Members = Sequence[tuple[float, ProtocolRequest]]  # of a mixture: probability and request, one or several
DRAWS = 4000  # a 5 % quantile is then one between 4.3 % and 5.7 %
_LEAST = 2  # draws of a model that hardly counts: one has no spread


def drawn_readings(members: Members, seed: int = 0, draws: int = DRAWS) -> dict[int, Floats]:
    """Readings of each requested hold by all models, each with as many draws as it is probable there.

    Parameters
    ----------
    members : sequence of (probability, ProtocolRequest)
        One protocol requested of each model, as often among a hold's draws as it is probable given the first readings
        that condition the hold; the probabilities, which are those without them, sum to one.
    seed : int
    draws : int
        In all, evenly spread over the stored ones.

    Returns
    -------
    dict of position to (R, n) array
        N or mm, by the hold's place in the requested protocol; NaN where a draw has no reading.
    """
    _, first = members[0]
    asked = first.prediction
    rng = np.random.default_rng(seed_of(seed, "predict", first.stored.sample.name))
    is_given = bool(np.isfinite(asked.first[asked.requested]).any())
    each = draws if is_given else 0  # given readings may make any of them the only one that is left
    readings = []
    log_weights = []
    for probability, request in members:
        stored = request.stored
        own_draws = max(each, ceil(probability * draws), _LEAST)
        theta = stored.theta[evenly(len(stored.theta), own_draws)]
        own = draw_unconditioned(stored.problem, theta, stored.sample, request.prediction, rng)
        with np.errstate(divide="ignore"):
            log_weight = np.full(len(own), np.log(probability))
        if is_given and stored.likelihood == "chain":
            own, log_density = _conditioned(own, request.prediction)
            log_weight += log_density
        readings.append(own)
        log_weights.append(log_weight)
    shares = _shares(np.array(log_weights))
    positions = np.flatnonzero(asked.requested).tolist()
    return {j: _mixed([own[j] for own in readings], shares[:, j], draws) for j in positions}


def _conditioned(drawn: Floats, request: PredictionRequest) -> tuple[Floats, Floats]:
    """Draws (H, R, n) given first readings, and how well the model predicts these before each hold (H,).

    What was read was not of a wire that cannot carry it: draws without a reading do not count, unless all are.
    """
    answered = _has_all(drawn, request)
    if answered.sum() < _LEAST:
        return drawn, np.full(len(drawn), -np.inf)
    own = drawn[..., answered]
    log_density = log_density_of_given(own, request) + np.log(answered.mean())
    return given_first(own, request), log_density


def _has_all(drawn: Floats, request: PredictionRequest) -> Bools:
    """(n,) which draws (H, R, n) have every requested reading."""
    is_asked = request.protocol.mask & request.requested[:, None]
    return np.all(np.isfinite(drawn[is_asked]), axis=0)


def _shares(log_weight: Floats) -> Floats:
    """(m, H) probabilities of m models from log weights (m, H); all alike where no model predicts what was read."""
    possible = np.where(np.isfinite(log_weight).any(axis=0), log_weight, 0.0)
    return np.exp(possible - log_sum(possible))


def _mixed(readings: Sequence[Floats], share: Floats, draws: int) -> Floats:
    """Draws (R, n) of several models, each as often as its share says, as many as each of them has enough for."""
    with np.errstate(divide="ignore"):
        enough_for = [own.shape[1] / part for own, part in zip(readings, share, strict=True)]
    enough = min(draws, *enough_for)
    parts = []
    for own, part in zip(readings, share, strict=True):
        count = round(part * enough)
        parts.append(own[:, evenly(own.shape[1], count)])
    return np.concatenate(parts, axis=1)

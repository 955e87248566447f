"""Holds that were not trained on: predicted freely and given their first reading, and scored.

Freely means from the displacements and the training readings alone; given its first reading is how the paper's figures
were made. The same code serves a single hold left out in the middle and the last third of a test.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from wirebayes.inference.weighted_posterior import Posterior
from wirebayes.io.experiment import Experiment
from wirebayes.model import likelihoods, single_holds
from wirebayes.numeric.log_sum import or_impossible
from wirebayes.numeric.means import root_mean_square
from wirebayes.numeric.typing import Array, Bools, Ints
from wirebayes.prediction.leave_one_hold_out import evenly_thinned
from wirebayes.prediction.predictive import PredictionRequest, draw_predictive, given_first
from wirebayes.wire.staircase import linearise

LEVELS = (0.5, 0.9, 0.99)  # half, the usual nine in ten, and nearly all: intervals whose coverage is counted
QUANTILES = (0.005, 0.05, 0.25, 0.5, 0.75, 0.95, 0.995)  # the ends of those intervals, and the median


@dataclass(frozen=True)
class Scores:
    """How predicted readings met the measured ones, a row a reading.

    Attributes
    ----------
    hold, time_s, observed_N, mean_N, sd_N : (rows,) arrays
    quantiles_N : (7, rows) array
        At `QUANTILES`.
    pit : (rows,) array
        Share of the predictive distribution below the reading.
    elpd : (holds,) array
        log p(readings of each held-out hold | training readings), or of its later readings given the first.
    elpd_together : float
        log p(all held-out readings | training readings); NaN where it is not defined.
    pit_band : (3, 101) array
        Levels from 0 to 1, and the band that the share of `pit` below each level leaves with probability 5 %
        anywhere; from joint draws, so that readings may depend on each other.
    pit_p : float
        Share of joint draws whose `pit` strays at least as far from that band's middle.
    """

    hold: Ints
    time_s: Array
    observed_N: Array
    mean_N: Array
    sd_N: Array
    quantiles_N: Array
    pit: Array
    elpd: Array
    elpd_together: float
    pit_band: Array
    pit_p: float

    @property
    def rmse_N(self) -> float:
        """Of the predictive mean."""
        return root_mean_square(self.observed_N - self.mean_N)

    def coverage(self) -> dict[float, float]:
        """Share of readings inside each central interval."""
        ends = dict(zip(QUANTILES, self.quantiles_N, strict=True))
        shares = {}
        for level in LEVELS:
            low, high = (ends[round(0.5 + sign * level / 2, 4)] for sign in (-1, 1))
            inside = (low <= self.observed_N) & (self.observed_N <= high)
            shares[level] = float(inside.mean())
        return shares


@dataclass(frozen=True)
class HeldOutPrediction:
    """The holds after the training ones, predicted.

    Attributes
    ----------
    experiment : str
    trained : int
        Recorded holds trained on.
    free : Scores or None
        None for a likelihood hold by hold, which knows no level.
    given : Scores
        The later readings of each hold, given its first.
    """

    experiment: str
    trained: int
    free: Scores | None
    given: Scores


def held_out(fitted: Posterior, experiment: Experiment, rng: np.random.Generator, sample: int = 0) -> HeldOutPrediction:
    """Predict the holds of an experiment that a fit of its first holds has not seen.

    Parameters
    ----------
    fitted : Fit or WeightedPosterior
        One of its samples is the experiment's first holds.
    experiment : Experiment
        The whole of it.
    rng : numpy Generator
    sample : int
        Which sample.
    """
    problem, here = fitted.problem, fitted.problem.samples[sample]
    whole, trained = experiment.protocol(), len(here.protocol.number)
    theta = evenly_thinned(fitted.flat)
    requested = whole.recorded.copy()
    requested[:trained] = False
    if not requested.any():
        raise ValueError(f"{experiment.name}: all {trained} holds were trained on")
    tension = experiment.readings()
    past = int(here.protocol.recorded.sum())
    unseen = whole.mask & requested[:, None]
    later = unseen.copy()
    later[:, 0] = False

    def predicted(given_N: Array) -> Array:
        return draw_predictive(problem, theta, here, PredictionRequest(whole, trained, requested, given_N), rng)

    def scored(drawn: Array, rows: Bools, elpd: Array, together: float = np.nan) -> Scores:
        return _scores(drawn, rows, whole.number, whole.time_s, tension, elpd, together)

    if problem.likelihood == "hold":
        elpd = _hold_scores(fitted, experiment, sample, requested)
        return HeldOutPrediction(experiment.name, past, None, scored(predicted(tension[:, 0]), later, elpd))
    drawn = predicted(np.full(len(requested), np.nan))
    elpd, elpd_given, together = _chain_scores(fitted, experiment, sample, requested)
    free = scored(drawn, unseen, elpd, together)
    # Each hold given its own first reading alone, as the paper's figures were made.
    for j in np.flatnonzero(requested):
        only = np.arange(len(requested)) == j
        request = PredictionRequest(whole, trained, only, np.where(only, tension[:, 0], np.nan))
        drawn = given_first(drawn, request)
    return HeldOutPrediction(experiment.name, past, free, scored(drawn, later, elpd_given))


def _scores(
    drawn: Array, rows: Bools, number: Array, time_s: Array, tension: Array, elpd: Array, together: float
) -> Scores:
    draws, observed = drawn[rows], tension[rows]
    band, p = pit_band(draws, observed)
    return Scores(
        hold=np.broadcast_to(number[:, None], rows.shape)[rows],
        time_s=time_s[rows],
        observed_N=observed,
        mean_N=draws.mean(axis=1),
        sd_N=draws.std(axis=1, ddof=1),
        quantiles_N=np.quantile(draws, QUANTILES, axis=1),
        pit=(draws < observed[:, None]).mean(axis=1),
        elpd=elpd,
        elpd_together=together,
        pit_band=band,
        pit_p=p,
    )


def pit_band(draws: Array, observed: Array, probability: float = 0.95) -> tuple[Array, float]:
    """Simultaneous band of the probability integral transform's distribution, and how unusual the observed one is.

    Parameters
    ----------
    draws : (rows, n) array
        Joint draws of all readings: each is compared with the others as the observed ones are.
    observed : (rows,) array

    Returns
    -------
    band : (3, 101) array
        Levels, lower and upper end.
    p : float
    """
    rows, n = draws.shape
    levels = np.linspace(0.0, 1.0, 101)
    pit = (np.argsort(np.argsort(draws, axis=1), axis=1) + 0.5) / n
    own = ((draws < observed[:, None]).mean(axis=1)[:, None] <= levels).sum(axis=0)
    # how many readings lie below each level; how many draws have so many, or fewer
    counts = np.stack([(pit <= level).sum(axis=0) for level in levels])
    draws_with = np.stack([np.bincount(c, minlength=rows + 1) for c in counts])
    with_at_most = np.cumsum(draws_with, axis=1)
    # the level at which a course is extreme, in the pointwise two-sided sense; its minimum over all levels
    everything = np.column_stack([counts, own])
    below = np.take_along_axis(with_at_most, everything, axis=1)
    above = n - below + np.take_along_axis(draws_with, everything, axis=1)
    extreme = 2.0 * np.minimum(below, above).min(axis=0) / n
    pointwise = np.quantile(extreme[:-1], 1.0 - probability)
    ends = np.quantile(counts / rows, [min(pointwise / 2.0, 0.5), max(1.0 - pointwise / 2.0, 0.5)], axis=1)
    return np.vstack([levels, ends]), float(np.mean(extreme[:-1] <= extreme[-1]))


def _chain_scores(
    fitted: Posterior, experiment: Experiment, sample: int, requested: Bools
) -> tuple[Array, Array, float]:
    """log p(readings | training) and log p(later readings | first, training) of each held-out hold; all together."""
    here = fitted.problem.samples[sample]
    protocol, read = experiment.protocol(), experiment.readings()[..., None]
    later = protocol.mask & requested[:, None]
    firsts = later & (np.arange(protocol.mask.shape[1]) == 0)
    whole: list[Array] = []
    first: list[Array] = []
    together: list[Array] = []
    theta = evenly_thinned(fitted.flat)
    for start in range(0, len(theta), _CHUNK):
        own = fitted.problem.parameters(theta[start : start + _CHUNK], here)
        line = linearise(protocol, own, here.model)
        noise = here.variance(own), own["setting_sd"]
        with np.errstate(all="ignore"):
            before = likelihoods.chain(line, read, protocol.mask & ~requested[:, None], *noise)
            whole.append(likelihoods.held_out_density(line, before, read, later, *noise))
            first.append(likelihoods.held_out_density(line, before, read, firsts, *noise))
            every = likelihoods.chain(line, read, protocol.mask, *noise)
        together.append(every.log_likelihood[requested].sum(axis=0))
    whole_hold, first_reading = _log_mean(np.concatenate(whole, axis=-1)), _log_mean(np.concatenate(first, axis=-1))
    return whole_hold, whole_hold - first_reading, float(_log_mean(np.concatenate(together, axis=-1)))


def _hold_scores(fitted: Posterior, experiment: Experiment, sample: int, requested: Bools) -> Array:
    problem, here = fitted.problem, fitted.problem.samples[sample]
    own = problem.parameters(evenly_thinned(fitted.flat), here)
    own = own | {"preload": 0.0 * own["B"]}
    variance = here.variance(own)
    log_p = single_holds.hold_by_hold(
        experiment.protocol(), own, here.model, experiment.readings()[..., None], variance
    )
    return _log_mean(log_p[requested])


def _log_mean(log_p: Array) -> Array:
    """(...) logarithm of the mean density over draws (..., n)."""
    finite = or_impossible(log_p)
    return np.asarray(logsumexp(finite, axis=-1) - np.log(finite.shape[-1]))


def two_thirds(recorded: int) -> int:
    """Two thirds of the holds, rounded to nearest."""
    return int(round(2.0 * recorded / 3.0))


_CHUNK = 1000  # draws at a time: bounds the memory of the staircases

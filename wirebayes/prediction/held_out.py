"""Holds that were not trained on: predicted freely and given their first reading, and scored.

Freely means from the displacements and the training readings alone; given its first reading is how the paper's figures
were made. The same code serves a single hold left out in the middle and the last third of a test.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logsumexp

from wirebayes.inference.weighted_posterior import Posterior
from wirebayes.io.experiment import Experiment
from wirebayes.model import likelihoods, single_holds
from wirebayes.model.hold_filter import Measured
from wirebayes.model.sample import Sample
from wirebayes.numeric.log_sum import or_impossible
from wirebayes.numeric.means import root_mean_square
from wirebayes.numeric.typing import Array, Bools, Ints
from wirebayes.prediction.leave_one_hold_out import evenly_thinned
from wirebayes.prediction.predictive import PredictionRequest, draw_predictive, given_first
from wirebayes.wire.protocol import Protocol
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
        """Root mean square error of the predictive mean."""
        return root_mean_square(self.observed_N - self.mean_N)

    def coverage(self) -> dict[float, float]:
        """Share of readings inside each central interval."""
        end_at = dict(zip(QUANTILES, self.quantiles_N, strict=True))
        shares = {}
        for level in LEVELS:
            low = end_at[round(0.5 - level / 2, 4)]
            high = end_at[round(0.5 + level / 2, 4)]
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
    problem = fitted.problem
    here = problem.samples[sample]
    trained = len(here.protocol.number)
    protocol = experiment.protocol()
    requested = protocol.recorded.copy()
    requested[:trained] = False
    if not requested.any():
        raise ValueError(f"{experiment.name}: all {trained} holds were trained on")
    test = _HeldOutTest(fitted, sample, protocol, experiment.readings(), requested, trained)
    if problem.likelihood == "hold":
        free = None
        given = _from_first_readings(test, rng)
    else:
        free, given = _along_the_chain(test, rng)
    past = int(here.protocol.recorded.sum())
    return HeldOutPrediction(experiment.name, past, free, given)


@dataclass(frozen=True)
class _HeldOutTest:
    """A fit of the first holds of a test, and the whole of that test with the holds that are to be predicted."""

    fitted: Posterior
    sample: int
    protocol: Protocol
    tension: Array
    requested: Bools
    trained: int

    @property
    def here(self) -> Sample:
        """What was trained on."""
        return self.fitted.problem.samples[self.sample]

    @property
    def theta(self) -> Array:
        """Draws of the fit, not too many."""
        return evenly_thinned(self.fitted.flat)

    @property
    def unseen(self) -> Bools:
        """All readings that are to be predicted."""
        return self.protocol.mask & self.requested[:, None]

    @property
    def later(self) -> Bools:
        """The readings among them that are not the first of their hold."""
        later = self.unseen
        later[:, 0] = False
        return later

    def request(self, holds: Bools, first: Array) -> PredictionRequest:
        """Some holds after what was trained on, with their first readings or NaN."""
        return PredictionRequest(self.protocol, self.trained, holds, first)

    def predicted(self, first: Array, rng: np.random.Generator) -> Array:
        """Draws (H, R, n) of what is requested, given first readings or NaN."""
        return draw_predictive(self.fitted.problem, self.theta, self.here, self.request(self.requested, first), rng)

    def scores(self, drawn: Array, rows: Bools, elpd: Array, together: float = np.nan) -> Scores:
        """How draws (H, R, n) meet what was read."""
        return _scores(drawn, rows, self.protocol.number, self.protocol.time_s, self.tension, elpd, together)


def _from_first_readings(test: _HeldOutTest, rng: np.random.Generator) -> Scores:
    """Each hold by itself, given its first reading."""
    drawn = test.predicted(test.tension[:, 0], rng)
    return test.scores(drawn, test.later, _hold_scores(test))


def _along_the_chain(test: _HeldOutTest, rng: np.random.Generator) -> tuple[Scores, Scores]:
    """The holds predicted from the training alone, and each given its first reading."""
    holds = len(test.requested)
    nothing = np.full(holds, np.nan)
    drawn = test.predicted(nothing, rng)
    elpd, elpd_given, together = _chain_scores(test)
    free = test.scores(drawn, test.unseen, elpd, together)
    # Each hold given its own first reading alone, as the paper's figures were made.
    positions = np.arange(holds)
    for hold in np.flatnonzero(test.requested):
        only = positions == hold
        first = np.where(only, test.tension[:, 0], np.nan)
        request = test.request(only, first)
        drawn = given_first(drawn, request)
    given = test.scores(drawn, test.later, elpd_given)
    return free, given


def _scores(
    drawn: Array, rows: Bools, number: Array, time_s: Array, tension: Array, elpd: Array, together: float
) -> Scores:
    draws = drawn[rows]
    observed = tension[rows]
    number_of_each = np.broadcast_to(number[:, None], rows.shape)
    band, p = pit_band(draws, observed)
    return Scores(
        hold=number_of_each[rows],
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
    ranks = np.argsort(np.argsort(draws, axis=1), axis=1)
    pit = (ranks + 0.5) / n
    below = draws < observed[:, None]
    observed_pit = below.mean(axis=1)
    # how many readings lie below each level, in each draw and in what was observed
    counts = np.stack([(pit <= level).sum(axis=0) for level in levels])
    own = (observed_pit[:, None] <= levels).sum(axis=0)
    extreme = _most_extreme(counts, own, rows)
    of_draws = extreme[:-1]
    of_observed = extreme[-1]
    half = np.quantile(of_draws, 1.0 - probability) / 2.0
    shares = [min(half, 0.5), max(1.0 - half, 0.5)]
    ends = np.quantile(counts / rows, shares, axis=1)
    band = np.vstack([levels, ends])
    p = np.mean(of_draws <= of_observed)
    return band, float(p)


def _most_extreme(counts: Array, own: Array, rows: int) -> Array:
    """(n + 1,) the level at which each course is extreme, pointwise on two sides; its minimum over all levels.

    Parameters
    ----------
    counts : (levels, n) array
        Of the draws: how many of the `rows` readings lie below each level.
    own : (levels,) array
        Of the observed readings, which come last.
    """
    n = counts.shape[1]
    draws_with = np.stack([np.bincount(count, minlength=rows + 1) for count in counts])
    with_at_most = np.cumsum(draws_with, axis=1)
    everything = np.column_stack([counts, own])
    below = np.take_along_axis(with_at_most, everything, axis=1)
    as_many = np.take_along_axis(draws_with, everything, axis=1)
    above = n - below + as_many
    return 2.0 * np.minimum(below, above).min(axis=0) / n


def _chain_scores(test: _HeldOutTest) -> tuple[Array, Array, float]:
    """log p(readings | training) and log p(later readings | first, training) of each held-out hold; all together."""
    theta = test.theta
    parts = [_chain_densities(test, theta[start : start + _CHUNK]) for start in range(0, len(theta), _CHUNK)]
    whole, first, together = (np.concatenate(part, axis=-1) for part in zip(*parts, strict=True))
    whole_hold = _log_mean(whole)
    later_readings = whole_hold - _log_mean(first)
    return whole_hold, later_readings, float(_log_mean(together))


def _chain_densities(test: _HeldOutTest, theta: Array) -> tuple[Array, Array, Array]:
    """Log densities (holds, n) of whole holds and of their first readings, and (n,) of all together, at draws."""
    protocol = test.protocol
    here = test.here
    firsts = test.unseen.copy()
    firsts[:, 1:] = False
    trained_on = protocol.mask & ~test.requested[:, None]
    own = test.fitted.problem.parameters(theta, here)
    line = linearise(protocol, own, here.model)
    measured = Measured(test.tension[..., None], protocol.mask, here.variance(own), own["setting_sd"])
    with np.errstate(all="ignore"):
        before = likelihoods.chain(line, replace(measured, mask=trained_on))
        whole = likelihoods.held_out_density(line, before, replace(measured, mask=test.unseen))
        first = likelihoods.held_out_density(line, before, replace(measured, mask=firsts))
        every = likelihoods.chain(line, measured)
    of_requested = every.log_likelihood[test.requested]
    return whole, first, of_requested.sum(axis=0)


def _hold_scores(test: _HeldOutTest) -> Array:
    """log p(later readings | first) of each held-out hold."""
    own = test.fitted.problem.parameters(test.theta, test.here)
    own = own | {"preload": 0.0 * own["B"]}
    variance = test.here.variance(own)
    read = test.tension[..., None]
    log_p = single_holds.hold_by_hold(test.protocol, own, test.here.model, read, variance)
    return _log_mean(log_p[test.requested])


def _log_mean(log_p: Array) -> Array:
    """(...) logarithm of the mean density over draws (..., n)."""
    finite = or_impossible(log_p)
    return logsumexp(finite, axis=-1) - np.log(finite.shape[-1])


def two_thirds(recorded: int) -> int:
    """Two thirds of the holds, rounded to nearest."""
    return int(round(2.0 * recorded / 3.0))


_CHUNK = 1000  # draws at a time: bounds the memory of the staircases

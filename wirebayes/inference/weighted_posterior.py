"""A posterior by importance sampling that a second search has to agree with, for judgements made dozens of times.

The modes that a search finds give the first proposal, and a proposal is learned from its draws
(`wirebayes.inference.importance`). Its weights say nothing of a hill that it never drew. So a search from other prior
draws bears witness: draws about its modes, of which the proposal knows nothing, tell how much of the posterior's mass
lies where it draws far too seldom. If that is more than next to nothing, the proposal is learned anew from the modes of
both searches. Where that does not help, or the weights cannot be trusted, the posterior is said not to be settled, and
the caller has to sample it (`wirebayes.inference.fit`).
"""

from dataclasses import dataclass, replace

import numpy as np

from wirebayes.inference import importance
from wirebayes.inference.fit import Fit
from wirebayes.inference.importance import Weighted, effective, tail
from wirebayes.inference.modes import distinct, searches
from wirebayes.inference.sampler.mixture import Mixture
from wirebayes.inference.sampler.proposal import Proposal
from wirebayes.inference.transform import LogPosterior
from wirebayes.model.linear_amplitudes import completed, integrated
from wirebayes.model.problem import Problem
from wirebayes.typing import Array


@dataclass(frozen=True)
class WeightedPosterior:
    """A posterior by importance sampling.

    Attributes
    ----------
    problem : Problem
    flat : (n, d) array
        Natural parameters: draws that follow the posterior, as far as the weights allow.
    log_evidence : float
        Log of the integral of likelihood times prior.
    converged : bool
        There are as many effective draws as were wanted, the weights can be trusted, and the witness agrees.
    why : str
        How many there are, in words.
    """

    problem: Problem
    flat: Array
    log_evidence: float
    converged: bool
    why: str


Posterior = Fit | WeightedPosterior


def weighted_posterior(problem: Problem, seed: int, ess: float) -> WeightedPosterior:
    """Sample a posterior by importance.

    Parameters
    ----------
    problem : Problem
        What its readings depend on linearly is integrated out, and drawn at the end.
    seed : int
    ess : float
        Effective draws wanted.

    Returns
    -------
    WeightedPosterior
    """
    rng = np.random.default_rng(seed)
    target = LogPosterior(integrated(problem))
    pool = witnessed(target, rng, ess)
    z = pool.drawn(0, min(_DRAWS, len(pool.z)), rng)
    _, theta, _ = completed(target.problem, target.coordinates.to_natural(z), rng)
    found, k = effective(pool.log_weight)[0], tail(pool.log_weight[:, 0])
    why = f"importance sampling: {found:.0f} effective draws of {len(pool.z)}, Pareto k {k:.2f}"
    return WeightedPosterior(problem, theta, float(pool.log_integral[0]), bool(pool.settled[0]), why)


def witnessed(target: LogPosterior, rng: np.random.Generator, ess: float) -> Weighted:
    """Draws of a proposal that was learned from the modes, and against which a further search has nothing to say.

    Parameters
    ----------
    target : LogPosterior
    rng : numpy Generator
    ess : float

    Returns
    -------
    Weighted
        Not settled where the last search still contradicts.
    """

    def density(z: Array) -> Array:
        return target(z)[:, None]

    known, others = (found.modes for found in searches(target, rng, 2, starts=_STARTS))
    nothing = known.z[:0]
    for attempt in range(_SEARCHES):
        if attempt:
            known, others = distinct([known, others]), searches(target, rng, 1, starts=_STARTS)[0].modes
        start = importance.widened(known)
        pool = importance.sample(density, start, nothing, target.coordinates.order, rng, ess)
        if not pool.settled[0]:
            break
        share = overlooked(target, pool.proposal, pool.log_integral[0], importance.widened(others), rng)
        if share <= _NEXT_TO_NOTHING:
            return pool
    return replace(pool, settled=np.zeros(1, bool))


def overlooked(
    target: LogPosterior, drawn_from: Mixture | Proposal, log_integral: float, others: Mixture, rng: np.random.Generator
) -> float:
    """Share of the posterior, by draws of another proposal, that lies where a proposal hardly draws.

    Parameters
    ----------
    target : LogPosterior
    drawn_from : Mixture or Proposal
    log_integral : float
        Of the posterior density, by draws of the proposal; what it misses comes on top, and the share may exceed one.
    others : Mixture
        Where else to draw.
    rng : numpy Generator
    """
    z = others.rvs(_WITNESSES, rng)
    height = target(z) - log_integral
    share = np.exp(height - others.log_density(z)) / len(z)
    return float(share[height - drawn_from.log_density(z) > _HARDLY].sum())


_DRAWS = 4000  # as many as predictions take
_STARTS = 18  # of climbs, twice as many as before a walk: walkers still find what a search misses, weights do not
_SEARCHES = 3  # that may contradict, before it is left to walkers
_WITNESSES = 2000  # a hill with a hundredth of the mass has some twenty of them, where a search found it
_HARDLY = 3.0  # nats of posterior over proposal: a place drawn twenty times too seldom
_NEXT_TO_NOTHING = 0.05  # share of the mass: without it, log densities change by that at most

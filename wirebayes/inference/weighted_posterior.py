"""A posterior by importance sampling that a second search has to agree with, for judgements made dozens of times.

The modes that a search finds give the first proposal, and a proposal is learned from its draws
(`wirebayes.inference.importance`). Its weights say nothing of a hill that it never drew. So a search from other prior
draws bears witness: draws about its modes, of which the proposal knows nothing, tell how much of the posterior's mass
lies where it draws far too seldom. If that is more than next to nothing, or the weights cannot be trusted, the proposal
is learned again, from the modes of both searches and from all these draws. Where that does not help either, the
posterior is said not to be settled, and the caller has to sample it (`wirebayes.inference.fit`).
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator

from wirebayes.inference import importance
from wirebayes.inference.fit import Fit
from wirebayes.inference.importance import Weighted, effective, tail
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.inference.modes import searches
from wirebayes.inference.optimum import Optimum, distinct
from wirebayes.inference.sampler.mixture import Mixture
from wirebayes.model.linear_amplitudes import completed, integrated
from wirebayes.model.problem import Problem
from wirebayes.numeric.resampling import truncated_rows
from wirebayes.numeric.typing import Array


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
    ess : float
        Effective draws wanted.
    """
    rng = np.random.default_rng(seed)
    own = problem.in_units(problem.own_units)
    target = LogPosterior(integrated(own))
    pool = witnessed(target, rng, ess)
    size = len(pool.z)
    z = pool.drawn(0, min(_DRAWS, size), rng)
    theta = target.coordinates.to_natural(z)
    _, theta, _ = completed(target.problem, theta, rng)
    theta = own.theta_in(problem.units, theta)
    found = effective(pool.log_weight)[0]
    k = tail(pool.log_weight[:, 0])
    why = f"importance sampling: {found:.0f} effective draws of {size}, Pareto k {k:.2f}"
    log_units = sum(of_holds.sum() for of_holds in own.log_units(problem))
    log_evidence = float(pool.log_integral[0] - log_units)
    settled = bool(pool.settled[0])
    return WeightedPosterior(problem, theta, log_evidence, settled, why)


def witnessed(target: LogPosterior, rng: Generator, ess: float) -> Weighted:
    """Draws of a proposal that was learned from the modes, and against which a further search has nothing to say.

    Parameters
    ----------
    rng : numpy Generator

    Returns
    -------
    Weighted
        Not settled where the weights cannot be trusted in the end, or the last search still contradicts.
    """

    def density(z: Array) -> Array:
        return target(z)[:, None]

    def learned(modes: Optimum, draws: Array) -> Weighted:
        start = importance.widened(modes)
        return importance.importance_sample(density, start, draws, target.coordinates.order, rng, ess)

    def agreed(pool: Weighted, modes: Optimum) -> bool:
        if not pool.settled[0]:
            return False
        log_integral = float(pool.log_integral[0])
        missing = overlooked_share(target, pool, 0, log_integral, importance.widened(modes), rng)
        return abs(missing) <= _NEXT_TO_NOTHING

    known, others = searches(target, rng, 2, starts=_STARTS)
    pool = learned(known, known.z[:0])
    for _ in range(_AGAIN):
        if agreed(pool, others):
            return pool
        draws = _of_both(target, pool, importance.widened(others), rng)
        known = distinct([known, others])
        [others] = searches(target, rng, 1, starts=_STARTS)
        pool = learned(known, draws)
    if agreed(pool, others):
        return pool
    return replace(pool, settled=np.zeros(1, bool))


def _of_both(target: LogPosterior, pool: Weighted, others: Mixture, rng: Generator) -> Array:
    """(n, d) rough draws of a posterior, from those of a proposal and of where another search would draw."""
    z = others.rvs(_WITNESSES, rng)
    height, _, of_both = _balanced(target, pool, 0, others, z)
    rows = truncated_rows(height - of_both, _DRAWS, rng)
    return np.vstack([pool.z, z])[rows]


def _balanced(
    target: LogPosterior, pool: Weighted, column: int, others: Mixture, z: Array
) -> tuple[Array, Array, Array]:
    """What draws of a proposal, and then draws z of another one, are weighed against (the balance heuristic).

    Their log densities (n,), and how densely draws of the pool's proposal, and of both, lie there (n,).
    """
    height = np.append(pool.log_density[:, column], target(z))
    of_pool = np.append(pool.log_proposal, pool.proposal.log_density(z)) + np.log(len(pool.z))
    of_others = others.log_density(np.vstack([pool.z, z])) + np.log(len(z))
    return height, of_pool, np.logaddexp(of_pool, of_others)


def overlooked_share(
    target: LogPosterior, pool: Weighted, column: int, log_integral: float, others: Mixture, rng: Generator
) -> float:
    """Share of a posterior that its integral by draws of a proposal lacks, as draws of another proposal tell.

    Negative where a few draws of great weight made too much of a place.

    It is looked for where the proposal hardly draws. There, all draws are weighed against both proposals together: one
    draw of the other proposal in its own far tail, where either draws little, says next to nothing then. What draws of
    the proposal alone made of these places is taken off: that much the integral has.

    Parameters
    ----------
    column : int
        Which of the pool's densities the target is.
    log_integral : float
        Of the posterior density, by draws of the proposal; what it misses comes on top, and the share may exceed one.
    others : Mixture
        Where else to draw.
    rng : numpy Generator

    References
    ----------
    E. Veach and L. J. Guibas, Optimally combining sampling techniques, SIGGRAPH 1995: the balance heuristic.
    """
    n = len(pool.z)
    z = others.rvs(_WITNESSES, rng)
    height, of_pool, of_both = _balanced(target, pool, column, others, z)
    height -= log_integral
    hardly = height - of_pool + np.log(n) > _HARDLY
    found = np.exp(height - of_both)[hardly].sum()
    by_pool = np.exp(height - of_pool)[:n]
    had = by_pool[hardly[:n]].sum()
    return float(found - had)


_DRAWS = 4000  # as many as predictions take
_STARTS = 72  # of a search, twice as many as before a walk: walkers still find what it misses, weights do not
_AGAIN = 2  # times that the proposal is learned again, before it is left to walkers
_WITNESSES = 2000  # a hill with a hundredth of the mass has some twenty of them, where a search found it
_HARDLY = 3.0  # nats of posterior over proposal: a place drawn twenty times too seldom
_NEXT_TO_NOTHING = 0.05  # share of the mass: without it, log densities change by that at most

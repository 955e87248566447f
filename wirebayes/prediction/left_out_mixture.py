"""One density whose draws stand for every posterior without a hold: their sum, sampled once.

A posterior without a hold is the full one divided by ``p(readings of the hold | all other readings, parameters)``. The
sum of the full posterior and of those without one hold each, each times a constant that gives it about the same share,
is as wide as the widest of them. Weights from it to any of them are bounded, so importance sampling cannot fail as it
does from the full posterior alone, where a hold that was surprising has left no draws.

References
----------
L. A. Silva and G. Zanella, Robust leave-one-out cross-validation for high-dimensional Bayesian models, J. Am. Stat.
Assoc. (2024); here the shares are balanced, and the full posterior is a member.
"""

from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import expit, logsumexp

from wirebayes.inference.modes import climb, distinct
from wirebayes.inference.policy import Policy
from wirebayes.inference.sampler import ensemble
from wirebayes.inference.sampler.mixture import spread_rows
from wirebayes.inference.transform import LogPosterior
from wirebayes.model.problem import Problem
from wirebayes.resampling import systematic_rows
from wirebayes.typing import Array, Floats

_STARTS = 4  # of climbs, spread over the draws that are known
_LEAST_SHARE = 0.25  # of an even share: with less, the draws that tell a hold's density are too few
_MOST_SAMPLINGS = 4  # one to find what is apart, one or two for the shares
_APART = 3.0  # nats of a log density that was overrated: twenty times an even share
_MOST = 1e5  # nats: so far above the full posterior a draw says nothing of it


@dataclass(frozen=True)
class LeftOutMixture(Problem):
    """A problem and the same without each of some holds, their posteriors added.

    Attributes
    ----------
    log_weight : tuple of (H,) arrays
        Per sample: the logarithm of what a hold's posterior is multiplied by, -inf for holds that stay.
    """

    log_weight: tuple[Array, ...] = ()

    def log_likelihood(self, theta: Array, readings: object = None) -> Array:
        """(n,) log of the sum of all members' likelihoods; -inf where the model cannot be computed."""
        total = self.total(*self.without_each_hold(theta))
        return np.where(np.isfinite(total), total, -np.inf)

    def total(self, whole: Array, without: list[Array]) -> Array:
        """(n,) log of the sum, from what `without_each_hold` returned."""
        each = [
            w + values
            for weight, rest in zip(self.log_weight, without, strict=True)
            for w, values in zip(weight, rest, strict=True)
            if np.isfinite(w)
        ]
        with np.errstate(all="ignore"):
            return reduce(np.logaddexp, each, whole)


def log_densities(
    problem: Problem, holds: list[tuple[int, int]], draws: Array, elpd: Array, seed: int, policy: Policy
) -> tuple[Array, bool]:
    """Log density of the readings of some holds, each given those of all other holds.

    A member that turns out to have far more than its share is as good as apart from the full posterior: it is taken out
    of the sum, because no sampler moves between the two often enough.

    Parameters
    ----------
    problem : Problem
    holds : list of (sample, row of its protocol)
    draws : (n, d) array
        Natural parameters, of the full posterior.
    elpd : (m,) array
        What is thought of the log densities: members of the sum get their shares by it. Where the shares come out far
        from even, the sum is sampled again with better ones.
    seed : int
    policy : Policy
        Of the sampling.

    Returns
    -------
    (m,) array, and whether the sampling converged and every member has a share of the draws.
        NaN for a hold that was taken out, or of which nothing was known.
    """
    elpd = np.where(np.isfinite(elpd), elpd, np.nan)
    near = np.flatnonzero(np.isfinite(elpd))
    pool, (whole, without) = draws, problem.without_each_hold(draws)
    drawn_from = whole  # log density of the pool, but for the prior
    converged = True
    for attempt in range(_MOST_SAMPLINGS if len(near) else 0):
        members = [holds[i] for i in near]
        weights = _weights(problem, members, elpd[near])
        mixture = LeftOutMixture(problem.samples, problem.prior, problem.likelihood, weights)
        rough = pool[_rows(mixture.total(whole, without) - drawn_from, len(draws), seed)]
        theta, converged = _sampled(mixture, rough, seed + attempt, policy)
        pool = np.concatenate([draws, theta])
        whole, without = problem.without_each_hold(pool)
        total = mixture.total(whole, without)
        over = np.minimum(total - whole, _MOST)
        ratio = log_mean(over[: len(draws)], over[len(draws) :])  # of the mixture's integral to the posterior's
        drawn_from = np.logaddexp(np.log(len(draws)) + whole, np.log(len(theta)) + total - ratio)
        found = -np.array([logsumexp(without[s][j] - drawn_from) for s, j in members])
        share = np.exp(np.concatenate([[0.0], elpd[near] - found]) - ratio)
        apart = elpd[near] - found > _APART
        elpd[near] = np.where(apart, np.nan, found)
        near = near[~apart]
        if not len(near) or (share.min() > _LEAST_SHARE / len(share) and not apart.any()):
            return elpd, converged
    return elpd, not len(near)


def _rows(log_weight: Array, n: int, seed: int) -> NDArray[np.intp]:
    """(n,) rows drawn by weight."""
    weight = np.exp(log_weight - log_weight.max())
    return systematic_rows(weight, n, np.random.default_rng(seed))


def _weights(problem: Problem, holds: list[tuple[int, int]], elpd: Array) -> tuple[Array, ...]:
    """`LeftOutMixture.log_weight` of some holds."""
    out = tuple(np.full(len(s.protocol.recorded), -np.inf) for s in problem.samples)
    for (s, j), value in zip(holds, elpd, strict=True):
        out[s][j] = value
    return out


def log_mean(log_p: Floats, log_p_weighted: Floats) -> float:
    """Logarithm of the mean of p under a density q, from draws of q and of the density proportional to q p.

    The bridge between the two with the least variance: it is where draws of the one, weighed by how likely they belong
    to the other, balance the reverse.

    Parameters
    ----------
    log_p : (n,) array
        At draws of q.
    log_p_weighted : (m,) array
        At draws of the density proportional to q p.

    References
    ----------
    C. H. Bennett, Efficient estimation of free energy differences from Monte Carlo data, J. Comput. Phys. 22 (1976);
    X.-L. Meng and W. H. Wong, Statistica Sinica 6 (1996).
    """
    one, other = log_p[np.isfinite(log_p)], log_p_weighted

    def unbalanced(middle: float) -> float:
        return float(expit(one - middle).sum() - expit(middle - other).sum())

    low, high = min(one.min(), other.min()), max(one.max(), other.max())
    span = high - low + np.log(len(log_p) + len(other)) + 1.0
    return float(brentq(unbalanced, low - span, high + span, maxiter=1000) + np.log(len(other) / len(log_p)))


def _sampled(mixture: LeftOutMixture, rough: Array, seed: int, policy: Policy) -> tuple[Array, bool]:
    """(n, d) draws, and whether they converged, from (m, d) rough ones."""
    rng = np.random.default_rng(seed)
    target = LogPosterior(mixture)
    z = target.coordinates.to_sampled(rough)
    width = z.std(axis=0)
    start = z[spread_rows(z / np.where(width > 0, width, 1.0), _STARTS, rng)]
    found = distinct([climb(lambda points, rows: target(points), start, iterations=40, tolerance=1e-2)])
    chains = ensemble.sample(target, seed, policy, found=found, rough=z)
    return target.coordinates.to_natural(chains.z.reshape(-1, z.shape[1])), chains.converged

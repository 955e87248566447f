"""Posterior draws in a fraction of a second, for decisions that are made many times.

They come from importance sampling about the modes, and where its weights cannot be trusted, from a short run of the
sampler. For numbers that are reported, sample with `wirebayes.inference.fit`, which requires convergence.
"""

import numpy as np
from numpy.random import Generator

from wirebayes.inference.importance import LARGEST_K, effective, tail
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.inference.optimum import Optimum
from wirebayes.inference.policy import Policy
from wirebayes.inference.sampler import mixture
from wirebayes.inference.sampler.ensemble import sample_posterior
from wirebayes.inference.sampler.points import WeightedPoints
from wirebayes.numeric.log_sum import log_sum
from wirebayes.numeric.resampling import truncated_rows
from wirebayes.numeric.typing import Array

# 4096 draws, no test of tails: enough for means and widths, a fraction of a second
_SHORT = Policy(ensembles=2, walkers=64, rounds=3, most_rounds=5, tail=np.inf, block=32, most_steps=32)


def draws(target: LogPosterior, found: Optimum, rng: Generator, n: int = 1000, wanted: float | None = None) -> Array:
    """Posterior draws from known modes.

    Parameters
    ----------
    found : Optimum
        The modes of `target`; no search is made.
    n : int
        Number of draws.
    wanted : float, optional
        Effective draws at which importance sampling stops; as many as a decision needs when left out. If all its
        rounds leave fewer, as many as a decision needs are enough.

    Returns
    -------
    (n, d) array
        Natural parameters.
    """
    least = min(n, _ENOUGH)
    z = _weighted(target, found, rng, n, least, wanted or least)
    if z is None:
        chains = sample_posterior(target, int(rng.integers(2**63)), _SHORT, found=found)
        z = chains.z.reshape(-1, chains.z.shape[-1])
        z = z[rng.choice(len(z), n, replace=False)]
    return target.coordinates.to_natural(z)


def _weighted(
    target: LogPosterior, found: Optimum, rng: Generator, n: int, least: float, wanted: float
) -> Array | None:
    """(n, d) sampled coordinates by importance sampling, or nothing where the weights of all rounds are too uneven.

    A mixture is learned from all draws so far, and all of them are weighted against all mixtures together.
    """
    modes, dimensions = found.z.shape
    latest = mixture.from_modes(found.z, _WIDER * found.covariance, found.log_evidence)
    proposals = [latest]
    components = int(np.clip(modes + _BESIDE_MODES, *_COMPONENTS))
    z = np.empty((0, dimensions))
    height = np.empty(0)
    by_proposal = np.empty((0, 0))  # log density of each proposal at each draw
    for _ in range(_ROUNDS):
        new = latest.rvs(_EACH, rng)
        by_proposal = np.vstack([by_proposal, latest.log_density(z)])
        at_new = [proposal.log_density(new) for proposal in proposals]
        by_proposal = np.hstack([by_proposal, at_new])
        z = np.concatenate([z, new])
        height = np.append(height, target(new))
        drawn_from = log_sum(by_proposal)
        log_weight = height - drawn_from
        if _are_enough(log_weight, wanted):
            return z[truncated_rows(log_weight, n, rng)]
        points = WeightedPoints.weighted(z, _HOT * height - drawn_from)
        points = points.thinned(_LEARNED, rng)
        try:
            latest = mixture.fit_mixture(points, rng, most=components)
        except np.linalg.LinAlgError:
            break
        proposals.append(latest)
    return z[truncated_rows(log_weight, n, rng)] if _are_enough(log_weight, least) else None


def _are_enough(log_weight: Array, wanted: float) -> bool:
    """Whether weights of draws leave so many effective ones, and can be trusted."""
    there = effective(log_weight[:, None])[0]
    return bool(there >= wanted and tail(log_weight) <= LARGEST_K)


_WIDER = 3.0  # times the covariance at a mode; with 2, posteriors of many modes needed twice as many rounds
_EACH, _ROUNDS = 2500, 12  # draws a round: twelve of them take less than a short run
# Effective draws of a decision, however many are drawn: sums of log densities of left-out holds then scatter by .3 nats
# or less, where a decision asks for 4. Posteriors of many modes that need 1500 need a run of the sampler instead.
_ENOUGH = 600.0
# Power of the density that proposals are learned from, so that their tails are not too thin: with .75, 5000 effective
# draws had the error of a mean prediction too small by a sixth where a posterior is curved, with this by a twentieth.
_HOT = 0.6
_LEARNED = 1500  # points
_BESIDE_MODES, _COMPONENTS = 2, (3, 8)  # components of a proposal beside one a mode, and limits of their number

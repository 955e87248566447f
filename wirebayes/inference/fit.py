"""One fit: a problem sampled until the policy is satisfied, thinned to the draws worth storing."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.inference.policy import DEFAULT, Policy
from wirebayes.inference.sampler import ensemble
from wirebayes.inference.sampler.ensemble import Chains
from wirebayes.model.linear_amplitudes import completed, integrated
from wirebayes.model.problem import Problem
from wirebayes.numeric.typing import Array
from wirebayes.progress import ShareDone

STORED_DRAWS = 5000  # per ensemble: beyond that, quantiles no longer move


@dataclass(frozen=True)
class Fit:
    """A sampled posterior.

    Attributes
    ----------
    problem : Problem
    theta : (chains, draws, d) array
        Natural parameters, one chain an ensemble, its walkers one after the other (each walker's draws in order).
    log_density : (chains, draws) array
    chains : Chains
        What the sampler said of itself (its own draws, unthinned).
    thin : int
    """

    problem: Problem
    theta: Array
    log_density: Array
    chains: Chains
    thin: int

    @property
    def flat(self) -> Array:
        """(n, d) all stored draws."""
        return self.theta.reshape(-1, self.theta.shape[-1])

    @property
    def converged(self) -> bool:
        return self.chains.converged

    @property
    def why(self) -> str:
        return self.chains.why


def fit_problem(
    problem: Problem,
    seed: int = 0,
    *,
    policy: Policy = DEFAULT,
    checkpoint: Path | None = None,
    progress: ShareDone = lambda share: None,
    near: Mapping[str, float] | None = None,
    rough: Array | None = None,
) -> Fit:
    """Sample the posterior of a problem, in units of the test's own scales.

    Parameters
    ----------
    checkpoint : Path, optional
        See `wirebayes.inference.sampler.ensemble.sample_posterior`.
    progress : function of a share between 0 and 1
    near : mapping of name to value, optional
        Parameters known to be good, where the search for modes looks too.
    rough : (n, d) array, optional
        Parameters drawn from nearly this posterior, which save burn-in a part of its work.
    """
    own = problem.in_units(problem.own_units)
    target = LogPosterior(integrated(own))
    walked = target.problem.names

    def sampled(theta: Array) -> Array:
        """Sampled coordinates of (n, d) parameters in the problem's units."""
        columns = [problem.names.index(name) for name in walked]
        return target.coordinates.to_sampled(problem.theta_in(own.units, theta)[:, columns])

    start = None
    if near is not None and near.keys() >= set(walked):
        start = sampled(np.array([[near.get(name, 1.0) for name in problem.names]]))
        start = np.round(start, _START_DIGITS)
    cloud = None if rough is None else sampled(rough)
    chains = ensemble.sample_posterior(
        target, seed, policy, checkpoint=checkpoint, progress=progress, near=start, rough=cloud
    )
    m, steps, walkers, d = chains.z.shape
    thin = max(1, steps * walkers // STORED_DRAWS)
    z = np.moveaxis(chains.z[:, thin - 1 :: thin], 2, 1)
    log_density = np.moveaxis(chains.log_density[:, thin - 1 :: thin], 2, 1).reshape(m, -1)
    theta = target.coordinates.to_natural(z.reshape(-1, d))
    _, theta, added = completed(target.problem, theta, np.random.default_rng(seed_of(seed, "completed")))
    theta = own.theta_in(problem.units, theta)
    return Fit(problem, theta.reshape(m, -1, theta.shape[1]), log_density + added.reshape(m, -1), chains, thin)


_START_DIGITS = 6  # the digits of a start that are the same in every unit: conversions change the sixteenth


def seed_of(seed: int, *words: str) -> int:
    """A seed of its own for each named piece of work, the same whatever else is done beside it."""
    digest = hashlib.sha256("\x1f".join([str(seed), *words]).encode()).digest()
    return int.from_bytes(digest[:8], "little")

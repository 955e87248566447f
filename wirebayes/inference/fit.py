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
    start = None
    if near is not None and near.keys() >= set(walked):
        known = np.array([[near.get(name, 1.0) for name in problem.names]])
        start = np.round(_sampled(problem, target, known), _START_DIGITS)
    cloud = None
    if rough is not None:
        cloud = _sampled(problem, target, rough)
    chains = ensemble.sample_posterior(
        target, seed, policy, checkpoint=checkpoint, progress=progress, near=start, rough=cloud
    )
    z, log_density, thin = _stored(chains)
    flat = z.reshape(-1, z.shape[-1])
    theta = target.coordinates.to_natural(flat)
    rng = np.random.default_rng(seed_of(seed, "completed"))
    _, theta, added = completed(target.problem, theta, rng)
    theta = own.theta_in(problem.units, theta)
    by_chain = theta.reshape(len(z), -1, theta.shape[1])
    log_density = log_density + added.reshape(log_density.shape)
    return Fit(problem, by_chain, log_density, chains, thin)


def _sampled(problem: Problem, target: LogPosterior, theta: Array) -> Array:
    """Sampled coordinates of (n, d) parameters in the problem's units."""
    columns = [problem.names.index(name) for name in target.problem.names]
    own = problem.theta_in(target.problem.units, theta)
    return target.coordinates.to_sampled(own[:, columns])


def _stored(chains: Chains) -> tuple[Array, Array, int]:
    """Draws (chains, walkers, steps, d) worth storing, their log densities (chains, n), and which step is stored."""
    m, steps, walkers, _ = chains.z.shape
    thin = max(1, steps * walkers // STORED_DRAWS)
    kept = slice(thin - 1, None, thin)
    z = np.moveaxis(chains.z[:, kept], 2, 1)
    log_density = np.moveaxis(chains.log_density[:, kept], 2, 1)
    return z, log_density.reshape(m, -1), thin


_START_DIGITS = 6  # the digits of a start that are the same in every unit: conversions change the sixteenth


def seed_of(seed: int, *words: str) -> int:
    """A seed of its own for each named piece of work, the same whatever else is done beside it."""
    digest = hashlib.sha256("\x1f".join([str(seed), *words]).encode()).digest()
    return int.from_bytes(digest[:8], "little")

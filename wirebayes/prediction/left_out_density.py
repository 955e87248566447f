"""Log densities of holds given all others, as ratios of integrals: of the full posterior and of those without a hold.

All are sampled by importance from one proposal (`wirebayes.inference.importance`). A search of its own bears witness
against those that draws of the full posterior do not settle, for one proposal may miss a mode that only the readings of
a hold exclude. Posteriors without a hold that are far from the others, or that this search contradicts, are sampled by
themselves.
"""

from copy import copy
from dataclasses import replace

import numpy as np

from wirebayes.inference import importance
from wirebayes.inference.fit import seed_of
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.inference.modes import searches
from wirebayes.inference.weighted_posterior import overlooked_share, weighted_posterior
from wirebayes.model.problem import Problem
from wirebayes.numeric.log_sum import or_impossible
from wirebayes.numeric.typing import Array, Bools, Function

Holds = list[tuple[int, int]]


def log_densities(problem: Problem, holds: Holds, draws: Array, seed: int, doubtful: Bools) -> tuple[Array, Bools]:
    """Log density of the readings of some holds, each given those of all other holds.

    Parameters
    ----------
    holds : list of (sample, row of its protocol)
    draws : (n, d) array
        Parameters in the problem's units, of the full posterior.
    doubtful : (m,) bool array
        Those that draws of the full posterior do not settle: a search bears witness against each of them. Where the
        common proposal does not even settle the full posterior, they alone are looked at.

    Returns
    -------
    (m,) array
    (m,) bool array
        Which of them are settled.
    """
    rng = np.random.default_rng(seed)
    own = problem.in_units(problem.own_units)
    target = LogPosterior(own)
    own_draws = problem.theta_in(problem.own_units, draws)
    z = target.coordinates.to_sampled(own_draws)
    densities = joined_densities(target, holds)
    pool = importance.from_draws(densities, z, target.coordinates.order, rng, _ESS)
    whole_settled = bool(pool.settled[0])
    elpd = -pool.log_ratio[1:]
    settled = pool.settled[0] & pool.settled[1:]
    _bear_witness(target, holds, pool, settled, doubtful, rng)
    missing = ~settled & (whole_settled | doubtful)
    if missing.any():
        log_whole = float(pool.log_integral[0])
        known = whole_settled
        if not whole_settled:
            log_whole, known = _evidence(own, seed_of(seed, "whole"))
        for m in np.flatnonzero(missing).tolist():
            log_without, converged = _evidence_without(own, holds[m], seed)
            elpd[m] = log_whole - log_without
            settled[m] = known and converged
    larger = own.log_units(problem)
    return elpd - [larger[sample][row] for sample, row in holds], settled


def _evidence_without(problem: Problem, hold: tuple[int, int], seed: int) -> tuple[float, bool]:
    """Log evidence of the readings of all holds but one, sample and row, and whether it is known."""
    sample, row = hold
    own_seed = seed_of(seed, str(sample), str(row))
    return _evidence(without_hold(problem, sample, row), own_seed)


def _evidence(problem: Problem, seed: int) -> tuple[float, bool]:
    """Log integral of a posterior that is sampled by itself, and whether the sampling converged."""
    alone = weighted_posterior(problem, seed, _ALONE)
    return alone.log_evidence, alone.converged


def _bear_witness(
    target: LogPosterior,
    holds: Holds,
    pool: importance.Weighted,
    settled: Bools,
    doubtful: Bools,
    rng: np.random.Generator,
) -> None:
    """Keep as settled only those of the doubtful holds of which a search of its own finds nothing overlooked."""
    told = np.flatnonzero(settled & doubtful).tolist()
    if not told:
        return
    problem = target.problem
    without = without_holds(problem, [holds[m] for m in told])
    found_of_each = searches(target, rng, len(told), without)
    for m, found in zip(told, found_of_each, strict=True):
        column = 1 + m
        left = copy(target)  # in the same coordinates, under the same prior
        left.problem = without_hold(problem, *holds[m])
        log_integral = float(pool.log_integral[0] + pool.log_ratio[column])
        others = importance.widened(found)
        overlooked = overlooked_share(left, pool, column, log_integral, others, rng)
        settled[m] = abs(overlooked) <= _MISSED


def without_hold(problem: Problem, sample: int, hold: int) -> Problem:
    """The problem that does not see the readings of one hold.

    Parameters
    ----------
    sample : int
        Position among the problem's samples.
    hold : int
        Row of the sample's protocol; unrecorded holds count.

    Returns
    -------
    Problem
        Displacement and duration of the hold stay, so the wire creeps there all the same.
    """
    here = problem.samples[sample]
    mask = here.protocol.mask.copy()
    mask[hold] = False
    samples = list(problem.samples)
    samples[sample] = replace(here, protocol=replace(here.protocol, mask=mask))
    return replace(problem, samples=tuple(samples))


def without_holds(problem: Problem, holds: Holds) -> list[Array]:
    """Readings (H, R, m) of each sample, those of one of m holds NaN in each column, N.

    Parameters
    ----------
    holds : list of (sample, row of its protocol)
    """
    out = [np.repeat(sample.readings, len(holds), axis=2) for sample in problem.samples]
    for m, (s, j) in enumerate(holds):
        out[s][j, :, m] = np.nan
    return out


def joined_densities(target: LogPosterior, holds: Holds) -> Function:
    """Log posterior densities (n, 1 + m), with all readings and without those of each hold, of sampled points (n, d).

    Parameters
    ----------
    holds : list of (sample, row of its protocol)
    """

    def densities(z: Array) -> Array:
        theta = target.coordinates.to_natural(z)
        whole, without = target.problem.without_each_hold(theta)
        of_holds = [without[sample][row] for sample, row in holds]
        with np.errstate(all="ignore"):
            prior = target.sampled_prior(theta, z)
            value = prior[:, None] + np.column_stack([whole, *of_holds])
        return or_impossible(value)

    def in_chunks(z: Array) -> Array:
        chunks = []
        for start in range(0, len(z), _ROWS):
            chunks.append(densities(z[start : start + _ROWS]))
        return np.concatenate(chunks)

    return in_chunks


_ESS = 400.0  # a ratio of two integrals is then known to .07 at worst
_ALONE = 1000.0  # more, as nothing cancels in a ratio of integrals from two proposals
_MISSED = 0.1  # share of the mass: a search sees only the part of a wide hill that is near its mode
_ROWS = 1024  # points at once: what stays in the cache

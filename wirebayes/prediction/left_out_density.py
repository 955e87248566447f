"""Log densities of holds given all others, as ratios of integrals: of the full posterior and of those without a hold.

All are sampled by importance from one proposal (`wirebayes.inference.importance`). Posteriors without a hold that are
far from the others are sampled with the full one alone.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from wirebayes.inference import importance
from wirebayes.inference.transform import LogPosterior
from wirebayes.model.problem import Problem
from wirebayes.typing import Array

Holds = list[tuple[int, int]]


def log_densities(problem: Problem, holds: Holds, draws: Array, seed: int) -> tuple[Array, NDArray[np.bool_]]:
    """Log density of the readings of some holds, each given those of all other holds.

    Parameters
    ----------
    problem : Problem
    holds : list of (sample, row of its protocol)
    draws : (n, d) array
        Natural parameters, of the full posterior.
    seed : int

    Returns
    -------
    (m,) array
    (m,) bool array
        Which of them are settled.
    """
    rng = np.random.default_rng(seed)
    target = LogPosterior(problem)
    z = target.coordinates.to_sampled(draws)
    pool = importance.from_draws(joined(target, holds), z, target.coordinates.order, rng, _ESS)
    elpd, settled = -pool.log_ratio[1:], pool.settled[0] & pool.settled[1:]
    for m in np.flatnonzero(~settled).tolist():
        near = pool.drawn(1 + m, len(z), rng)
        both = joined(target, [holds[m]])
        own = importance.from_draws(both, z, target.coordinates.order, rng, _ESS, near)
        elpd[m], settled[m] = -own.log_ratio[1], own.settled.all()
    return elpd, settled


def joined(target: LogPosterior, holds: Holds) -> Callable[[Array], Array]:
    """Log posterior densities (n, 1 + m), with all readings and without those of each hold, of sampled points (n, d).

    Parameters
    ----------
    target : LogPosterior
    holds : list of (sample, row of its protocol)
    """

    def densities(z: Array) -> Array:
        theta = target.coordinates.to_natural(z)
        whole, without = target.problem.without_each_hold(theta)
        with np.errstate(all="ignore"):
            prior = target.log_prior(theta) + target.coordinates.log_jacobian(theta)
            value = prior[:, None] + np.column_stack([whole, *(without[s][j] for s, j in holds)])
        return np.where(np.isfinite(value), value, -np.inf)

    return lambda z: np.concatenate([densities(z[i : i + _ROWS]) for i in range(0, len(z), _ROWS)])


_ESS = 400.0  # a ratio of two integrals is then known to .07 at worst
_ROWS = 1024  # points at once: what stays in the cache

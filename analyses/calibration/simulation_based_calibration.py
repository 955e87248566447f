"""Simulation-based calibration: draw a truth from the prior, simulate, fit, and compute the rank of the truth.

If prior, simulator, likelihood and sampler are consistent, the share of posterior draws below the truth is uniform for
every quantity of parameters and readings. The band here contains the empirical distributions of all quantities jointly.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from scipy import stats

from wirebayes.inference.coordinates.transform import Transformation
from wirebayes.inference.fit import Fit, fit_problem, seed_of
from wirebayes.inference.policy import Policy
from wirebayes.model.problem import Problem, with_readings
from wirebayes.model.replicate import readings
from wirebayes.numeric.typing import Array

JOINT = "log_likelihood"
# every percentile: the ranks of some hundred data sets say no more between them
_GRID = np.linspace(0.0, 1.0, 101)[1:-1]
_CHUNK = 10_000  # replicates at a time: bounds the memory


@dataclass(frozen=True)
class Ranked:
    """One simulated data set, fitted.

    Attributes
    ----------
    truth : dict of name to float
    share_below : dict of name to float
        Of every parameter and of the joint log-likelihood; uniform between 0 and 1 when all is well.
    fit : Fit
    redrawn : int
        Data sets that were refused before this one.
    """

    truth: dict[str, float]
    share_below: dict[str, float]
    fit: Fit
    redrawn: int


def one(
    problem: Problem,
    seed: int,
    policy: Policy | None = None,
    *,
    fitted: Callable[[Problem], Problem] = lambda problem: problem,
    accepted: Callable[[Problem], bool] = lambda problem: True,
) -> Ranked:
    """Draw a truth from the prior, simulate readings, fit, rank.

    Parameters
    ----------
    problem : Problem
        Its readings are replaced; hold by hold, the first of every hold stay and condition the others.
    seed : int
    policy : Policy
    fitted : function of the simulated problem
        What is fitted instead of it, to see that a wrong likelihood is found out.
    accepted : function of the simulated problem
        Whether its readings are a test anybody would keep; a choice by the readings alone leaves shares uniform.

    Returns
    -------
    Ranked
    """
    rng = np.random.default_rng(seed)
    redrawn = 0
    while True:
        truth = problem.prior.rvs(1, rng)
        simulated = with_readings(problem, [readings(problem, truth, sample, rng) for sample in problem.samples])
        if accepted(simulated):
            break
        redrawn += 1
    target = fitted(simulated)
    done = fit_problem(target, seed_of(seed, "fit"), policy=policy or Policy())
    draws = _last_of_every_walker(done)
    columns = np.column_stack([draws, target.log_likelihood(draws)])
    value = np.append(truth[0], target.log_likelihood(truth))
    below, ties = (columns < value).sum(axis=0), (columns == value).sum(axis=0)
    share = (below + rng.uniform(size=len(value)) * (ties + 1)) / (len(draws) + 1)
    below_by_name = dict(zip((*problem.names, JOINT), share.tolist(), strict=True))
    return Ranked(dict(zip(problem.names, truth[0].tolist(), strict=True)), below_by_name, done, redrawn)


def _last_of_every_walker(done: Fit) -> Array:
    """(n, d) draws that are as good as independent: walkers only meet through the differential-evolution move."""
    z = done.chains.z[:, -1]
    return parameters_at(done.problem, z.reshape(-1, z.shape[-1]))


def parameters_at(problem: Problem, z: Array) -> Array:
    """(n, d) parameters of a problem without integrated amplitudes, of (n, d) coordinates that were sampled."""
    own = problem.in_units(problem.own_units)
    return own.theta_in(problem.units, Transformation(own).to_natural(z))


def extremeness(share_below: Array) -> float:
    """How unlikely the empirical distribution of (n,) shares is where it is unlikeliest: the smallest two-sided
    binomial tail over a grid of points."""
    n = len(share_below)
    counts = np.searchsorted(np.sort(share_below), _GRID, side="right")
    return float(_tails(n)[np.arange(len(_GRID)), counts].min())


@cache
def _tails(n: int) -> Array:
    """(points, n + 1) two-sided binomial tail of every count at every point of the grid."""
    counts = np.arange(n + 1)
    below = stats.binom.cdf(counts, n, _GRID[:, None])
    above = stats.binom.sf(counts - 1, n, _GRID[:, None])
    return np.asarray(2.0 * np.minimum(below, above))


def threshold(n: int, quantities: int, joint: float = 0.99, *, replicates: int = 100_000, seed: int = 0) -> float:
    """The value of `extremeness` that all of some quantities exceed with probability `joint`.

    Quantities are taken as independent, which makes the band wider than needed where they go together.

    Parameters
    ----------
    n : int
        Number of simulated tests, each with one rank a quantity.
    quantities : int
        How many the band shall hold at once.
    joint : float
        Probability that it holds them all if everything is calibrated.
    replicates : int
        Simulated sets of `n` uniform ranks that the quantile is taken from.
    seed : int

    Returns
    -------
    float
    """
    rng = np.random.default_rng(seed)
    tails, points = _tails(n), np.arange(len(_GRID))
    cells = np.full(len(_GRID) + 1, 1.0 / (len(_GRID) + 1))
    smallest = []
    for start in range(0, replicates, _CHUNK):
        # counts of n uniforms in the cells of the grid, without sorting them
        counts = np.cumsum(rng.multinomial(n, cells, size=min(_CHUNK, replicates - start)), axis=1)[:, :-1]
        smallest.append(tails[points, counts].min(axis=1))
    return float(np.quantile(np.concatenate(smallest), 1.0 - joint ** (1.0 / quantities)))


def band(n: int, level: float) -> tuple[Array, Array, Array]:
    """Points, lower and upper edge of the share of n values that may lie below each point at a `threshold`."""
    allowed = _tails(n) >= level
    lower = np.argmax(allowed, axis=1) / n
    upper = (n - np.argmax(allowed[:, ::-1], axis=1)) / n
    return _GRID, lower, upper


def verdict(shares: Mapping[str, Array], joint: float = 0.99, *, replicates: int = 100_000) -> dict[str, Any]:
    """Whether all quantities lie inside the joint band, and how far each is from its edge.

    Parameters
    ----------
    shares : mapping of a quantity's name to (n,) shares below
    joint : float
    replicates : int

    Returns
    -------
    dict
        ``inside``, ``threshold`` and for each quantity its ``extremeness`` (outside when below the threshold).
    """
    levels = {}
    for n in {len(v) for v in shares.values()}:
        levels[n] = threshold(n, len(shares), joint, replicates=replicates)
    found = {name: extremeness(np.asarray(v)) for name, v in shares.items()}
    outside = [name for name, v in found.items() if v < levels[len(shares[name])]]
    return {
        "joint": joint,
        "quantities": len(shares),
        "threshold": {str(n): v for n, v in sorted(levels.items())},
        "inside": not outside,
        "outside": outside,
        "extremeness": found,
    }

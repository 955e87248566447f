"""Leave one hold out: how well each hold's readings are predicted from all the others.

Leaving a hold out drops its readings, never its displacement and duration: the wire creeps there all the same. The
posterior without a hold is obtained from the full one by Pareto-smoothed importance sampling with the ratios ``1 /
p(readings of the hold | all other readings, parameters)``. Where the tail of the ratios is too heavy for some holds,
densities are ratios of integrals, found by importance sampling from a proposal that is learned for all of them
(`wirebayes.prediction.left_out_density`): also those of the other holds, for the tail looks light where no draw
reaches what is likely only without a hold. What is not settled then is left to walkers.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.special import expit, logsumexp

from wirebayes.inference.chain_statistics import pareto_smoothed
from wirebayes.inference.fit import fit_problem, seed_of
from wirebayes.inference.policy import Policy
from wirebayes.inference.weighted_posterior import Posterior
from wirebayes.model.problem import Problem
from wirebayes.numeric.evenly import evenly
from wirebayes.numeric.typing import Bools, Floats, Ints
from wirebayes.prediction.left_out_density import log_densities, without_hold
from wirebayes.progress import ShareDone

# Above 0.7 importance sampling cannot be trusted (Vehtari et al., Pareto smoothed importance sampling). Stricter here:
# a posterior without a hold may have a second mode that the one with it never visits, and k says little of that.
LARGEST_K = 0.5
# a quarter of a fit's draws: elpd differences count from 4, and a hold's density is known to a tenth here
REFIT = Policy(walkers=64, round_draws=2048, ess=1000.0, most_steps=1200)
_SHARED = 10.0  # draws: with fewer a bridge's standard error exceeds 0.3
_DRAWS = 4000  # the error of a hold's elpd by their number is then some hundredths, of differences that count from 4


@dataclass(frozen=True)
class LeftOutHolds:
    """Each recorded hold predicted from all the others.

    Attributes
    ----------
    sample : tuple of str
        Which experiment each hold belongs to.
    hold : (m,) int array
        Hold numbers.
    elpd : (m,) array
        log p(readings of the hold | readings of all other holds).
    pareto_k : (m,) array
        Of the importance ratios; where any is above `LARGEST_K`, none were used.
    refitted : (m,) bool array
        Where the posterior without the hold was sampled, with those of other holds or by itself.
    converged : bool
        All those samplings converged.
    """

    sample: tuple[str, ...]
    hold: Ints
    elpd: Floats
    pareto_k: Floats
    refitted: Bools
    converged: bool = True

    @property
    def total(self) -> float:
        """Sum over the holds."""
        return float(self.elpd.sum())

    @property
    def se(self) -> float:
        """Standard error of the sum, from the spread between holds."""
        return standard_error(self.elpd)


def smoothed_leave_one_hold_out(
    fitted: Posterior,
    seed: int = 0,
    *,
    policy: Policy = REFIT,
    exact: bool = False,
    progress: ShareDone = lambda share: None,
) -> LeftOutHolds:
    """Leave out each recorded hold in turn, by Pareto-smoothed importance sampling, and by sampling where it fails.

    For converged draws of a posterior, whose weights' tail says whether they can be trusted and where sampling without
    the hold is worth its time. The rough draws of a search are scored by
    `wirebayes.discovery.held_out.truncated_leave_one_hold_out`.

    Parameters
    ----------
    fitted : Fit or WeightedPosterior
        With a likelihood hold by hold, a hold's first reading stays given.
    seed : int
        Of what is sampled without holds.
    policy : Policy
        Of fits without a hold, if `exact` or where importance sampling does not settle its density.
    exact : bool
        Fit without every hold, one by one, whatever the diagnostic says.
    progress : function of a share between 0 and 1
    """
    problem = fitted.problem
    theta = evenly_thinned(fitted.flat)
    holds = _recorded(problem)
    conditional = _of_holds(problem, theta, holds)
    elpd, k = _smoothed(conditional)
    # smoothing can fail where draws repeat, with a k that looks well
    untrusted = ~(k <= LARGEST_K) | ~np.isfinite(elpd)
    refitted = np.full(len(holds), exact) | untrusted
    alone = refitted.copy()
    if refitted.any() and not exact:
        own_seed = seed_of(seed, "left out")
        found, settled = log_densities(problem, holds, theta, own_seed, refitted)
        elpd = np.where(settled | refitted, found, elpd)
        alone = refitted & ~settled
        refitted = refitted | settled
    converged = True
    for done, i in enumerate(np.flatnonzero(alone).tolist()):
        progress(done / alone.sum())
        refit = _refitted(problem, holds[i], theta, seed, policy)
        bridge, shared = log_mean(refit.conditional, conditional[i])
        if exact or shared >= _SHARED:  # else what importance sampling says, settled or not, is nearer
            elpd[i] = bridge
        converged &= refit.converged and shared >= _SHARED
    progress(1.0)
    samples, numbers = _holds_named(problem, holds)
    return LeftOutHolds(samples, numbers, elpd, k, refitted, converged)


@dataclass(frozen=True)
class _Refit:
    """A fit without a hold: log densities of the hold's readings at its draws, and whether it converged."""

    conditional: Floats
    converged: bool


def _refitted(problem: Problem, hold: tuple[int, int], rough: Floats, seed: int, policy: Policy) -> _Refit:
    """A fit of the problem without a hold, given as sample and position."""
    sample, position = hold
    own_seed = seed_of(seed, "without", str(sample), str(position))
    fit = fit_problem(without_hold(problem, sample, position), own_seed, policy=policy, rough=rough)
    (conditional,) = _of_holds(problem, evenly_thinned(fit.flat), [hold])
    return _Refit(conditional, fit.converged)


def _of_holds(problem: Problem, theta: Floats, holds: Sequence[tuple[int, int]]) -> list[Floats]:
    """Log densities (n,) of the readings of holds, given as sample and position, given all others."""
    conditional = problem.leave_one_hold_out(theta)
    return [conditional[sample][position] for sample, position in holds]


def _recorded(problem: Problem) -> list[tuple[int, int]]:
    """Sample and position of every recorded hold."""
    holds = []
    for s, sample in enumerate(problem.samples):
        holds += [(s, int(position)) for position in np.flatnonzero(sample.protocol.recorded)]
    return holds


def _smoothed(conditional: Sequence[Floats]) -> tuple[Floats, Floats]:
    """Log density of each hold given the others, from densities at draws that saw it, and the tail index of weights."""
    elpd = np.zeros(len(conditional))
    k = np.zeros(len(conditional))
    for i, log_p in enumerate(conditional):
        if np.ptp(log_p) == 0.0:
            # A lone first reading is given hold by hold: nothing is left to predict, and no parameter matters.
            log_weight = 0.0 * log_p
        else:
            log_weight, k[i] = pareto_smoothed(-log_p)
        elpd[i] = logsumexp(log_weight + log_p) - logsumexp(log_weight)
    return elpd, k


def _holds_named(problem: Problem, where: Sequence[tuple[int, int]]) -> tuple[tuple[str, ...], Ints]:
    """Sample and number of each hold."""
    names = []
    numbers = []
    for s, position in where:
        sample = problem.samples[s]
        names.append(sample.name)
        numbers.append(sample.protocol.number[position])
    return tuple(names), np.array(numbers)


def evenly_thinned(theta: Floats, draws: int = _DRAWS) -> Floats:
    """At most so many rows, evenly spread."""
    kept: Floats = theta[evenly(len(theta), draws)]
    return kept


def log_mean(log_p: Floats, log_p_weighted: Floats) -> tuple[float, float]:
    """Logarithm of the mean of p under a density q, from draws of q and of the density proportional to q p.

    The bridge between the two with the least variance: it is where draws of the one, weighed by how likely they belong
    to the other, balance the reverse. Where hardly any do, the two have next to nothing in common, and the bridge no
    ground.

    Parameters
    ----------
    log_p : (n,) array
        At draws of q.
    log_p_weighted : (m,) array
        At draws of the density proportional to q p.

    Returns
    -------
    float
    float
        How many draws of q might as well be of the other density; the variance is nearly its inverse.

    References
    ----------
    C. H. Bennett, Efficient estimation of free energy differences from Monte Carlo data, J. Comput. Phys. 22 (1976);
    X.-L. Meng and W. H. Wong, Statistica Sinica 6 (1996).
    """
    one = log_p[np.isfinite(log_p)]
    other = log_p_weighted

    def unbalanced(middle: float) -> float:
        above = expit(one - middle).sum()
        below = expit(middle - other).sum()
        return float(above - below)

    low = min(one.min(), other.min())
    high = max(one.max(), other.max())
    span = high - low + np.log(len(log_p) + len(other)) + 1.0
    middle = brentq(unbalanced, low - span, high + span, maxiter=1000)
    shared = expit(one - middle).sum()
    bridge = middle + np.log(len(other) / len(log_p))
    return float(bridge), float(shared)


def standard_error(values: Floats) -> float:
    """Standard error of the sum of (holds,) values, from their spread; NaN of a single one."""
    if len(values) < 2:
        return float("nan")
    return float(np.sqrt(len(values) * values.var(ddof=1)))

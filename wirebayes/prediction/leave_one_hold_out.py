"""Leave one hold out: how well each hold's readings are predicted from all the others.

Leaving a hold out drops its readings, never its displacement and duration: the wire creeps there all the same. The
posterior without a hold is obtained from the full one by Pareto-smoothed importance sampling with the ratios ``1 /
p(readings of the hold | all other readings, parameters)``. Where the tail of the ratios is too heavy for some holds,
the sum of their posteriors is sampled once (`wirebayes.prediction.left_out_mixture`). A posterior so far from the full
one that even this fails is sampled itself, and the density of the hold found by steps from it to the full posterior
(`wirebayes.prediction.annealing`): the mean of the density over its draws would depend on the few that happen to fit.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from arviz_stats.base import array_stats
from numpy.typing import NDArray
from scipy.special import logsumexp

from wirebayes.inference.fit import Fit, fit, seed_of
from wirebayes.inference.policy import Policy
from wirebayes.inference.transform import LogPosterior
from wirebayes.model.problem import Problem
from wirebayes.prediction.annealing import log_ratio_of_integrals
from wirebayes.prediction.left_out_mixture import log_densities, log_mean
from wirebayes.typing import Floats

# Above 0.7 importance sampling cannot be trusted (Vehtari et al., Pareto smoothed importance sampling). Stricter here:
# a posterior without a hold may have a second mode that the one with it never visits, and k says little of that.
LARGEST_K = 0.5
# a quarter of a fit's draws: elpd differences count from 4, and a hold's density is known to a tenth here
REFIT = Policy(walkers=64, round_draws=2048, ess=1000.0, most_steps=1200)
_NO_OVERLAP = 1.0  # k from which on draws of two posteriors need not have places in common
_DRAWS = 4000  # the error of a hold's elpd by their number is then some hundredths, of differences that count from 4
_DRAWS_OF_STEPS = 3000  # a hold's density is then known to some .15
_statistics: Any = array_stats


@dataclass(frozen=True)
class LeftOut:
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
        Of the importance ratios; above `LARGEST_K` they were not used.
    refitted : (m,) bool array
        Where the posterior without the hold was sampled, with those of other holds or by itself.
    converged : bool
        All those samplings converged.
    """

    sample: tuple[str, ...]
    hold: NDArray[np.int64]
    elpd: Floats
    pareto_k: Floats
    refitted: NDArray[np.bool_]
    converged: bool = True

    @property
    def total(self) -> float:
        """Sum over the holds."""
        return float(self.elpd.sum())

    @property
    def se(self) -> float:
        """Standard error of the sum, from the spread between holds."""
        return standard_error(self.elpd)


def difference(one: LeftOut, other: LeftOut) -> tuple[float, float]:
    """How much better `one` predicts than `other`: the elpd difference and its standard error over holds.

    Raises
    ------
    ValueError
        When they are not about the same holds.
    """
    if one.sample != other.sample or not np.array_equal(one.hold, other.hold):
        raise ValueError("the two do not leave out the same holds")
    gained = one.elpd - other.elpd
    return float(gained.sum()), standard_error(gained)


def smoothed_leave_one_hold_out(
    fitted: Fit,
    seed: int = 0,
    *,
    policy: Policy = REFIT,
    exact: bool = False,
    progress: Callable[[float], None] = lambda share: None,
) -> LeftOut:
    """Leave out each recorded hold in turn, by Pareto-smoothed importance sampling, and by sampling where it fails.

    For converged draws of a posterior, whose weights' tail says whether they can be trusted and where sampling without
    the hold is worth its time. The rough draws of a search are scored by
    `wirebayes.discovery.held_out.truncated_leave_one_hold_out`.

    Parameters
    ----------
    fitted : Fit
        With a likelihood hold by hold, a hold's first reading stays given.
    seed : int
        Of what is sampled without holds.
    policy : Policy
        Of what is sampled without holds.
    exact : bool
        Fit without every hold, one by one, whatever the diagnostic says.
    progress : function of a share between 0 and 1

    Returns
    -------
    LeftOut
    """
    problem = fitted.problem
    theta = thinned(fitted.flat)
    conditional = problem.leave_one_hold_out(theta)
    where = [(s, int(j)) for s, sample in enumerate(problem.samples) for j in np.flatnonzero(sample.protocol.recorded)]
    elpd, k = np.zeros(len(where)), np.zeros(len(where))
    for i, (s, j) in enumerate(where):
        log_p = conditional[s][j]
        # A lone first reading is given hold by hold: nothing is left to predict, and no parameter matters.
        log_weight, k[i] = (0.0 * log_p, 0.0) if np.ptp(log_p) == 0.0 else _statistics.psislw(log_p)
        elpd[i] = logsumexp(log_weight + log_p) - logsumexp(log_weight)
    refitted, converged = np.full(len(where), exact) | ~(k <= LARGEST_K), True
    poor = np.flatnonzero(refitted)
    apart = k > _NO_OVERLAP
    if exact:
        elpd[poor] = np.nan
    elif len(poor):
        own = seed_of(seed, "left out in turn")
        found, settled = log_densities(problem, [where[i] for i in poor], theta, elpd[poor], own, policy)
        apart[poor] |= np.isnan(found)
        elpd[poor] = found if settled else np.nan  # what the sum does not settle is fitted hold by hold
    alone = np.flatnonzero(np.isnan(elpd)).tolist()
    for done, i in enumerate(alone):
        progress((len(where) - len(alone) + done) / len(where))
        s, j = where[i]
        own = seed_of(seed, "without", str(s), str(j))
        without = fit(without_hold(problem, s, j), own, policy=policy, rough=theta)
        if apart[i]:
            elpd[i] = _by_steps(problem, s, j, without.flat, own)
        else:
            elpd[i] = log_mean(problem.leave_one_hold_out(thinned(without.flat))[s][j], conditional[s][j])
        converged &= without.chains.converged
    progress(1.0)
    names = tuple(problem.samples[s].name for s, _ in where)
    numbers = np.array([problem.samples[s].protocol.number[j] for s, j in where])
    return LeftOut(names, numbers, elpd, k, refitted, bool(converged))


def _by_steps(problem: Problem, sample: int, hold: int, theta: Floats, seed: int) -> float:
    """Log density of a hold's readings, from draws (n, d) of the posterior without it."""
    target = LogPosterior(problem)

    def both(z: Floats) -> tuple[Floats, Floats]:
        natural = target.coordinates.to_natural(z)
        whole, without = problem.without_each_hold(natural)
        with np.errstate(all="ignore"):
            prior = target.log_prior(natural) + target.coordinates.log_jacobian(natural)
            first, second = prior + without[sample][hold], prior + whole
        return np.where(np.isfinite(first), first, -np.inf), np.where(np.isfinite(second), second, -np.inf)

    start = target.coordinates.to_sampled(thinned(theta, _DRAWS_OF_STEPS))
    return log_ratio_of_integrals(both, start, np.random.default_rng(seed))[0]


def without_hold(problem: Problem, sample: int, hold: int) -> Problem:
    """The problem that does not see the readings of one hold.

    Parameters
    ----------
    problem : Problem
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
    kept = replace(here, protocol=replace(here.protocol, mask=mask))
    return replace(problem, samples=(*problem.samples[:sample], kept, *problem.samples[sample + 1 :]))


def thinned(theta: Floats, draws: int = _DRAWS) -> Floats:
    """At most so many rows, evenly spread."""
    rows = np.linspace(0, len(theta) - 1, min(draws, len(theta))).round().astype(int)
    kept: Floats = theta[rows]
    return kept


def standard_error(values: Floats) -> float:
    """Of the sum of (holds,) values, from their spread; NaN of a single one."""
    return float(np.sqrt(len(values) * values.var(ddof=1))) if len(values) > 1 else float("nan")

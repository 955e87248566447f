"""Several densities of the same parameters at once, by adaptive importance sampling.

One proposal serves them all. Round by round its draws join a pool, where they are weighted for every density against
the mixture of all proposals so far. The proposal is then learned anew from the whole pool: from the sum of the
densities, each normalised, in which those that are known worst have the greatest shares. Where it is good enough, fresh
draws of it give the integrals of several densities from the same evaluations, so that errors of their ratios largely
cancel.

References
----------
J.-M. Cornuet, J.-M. Marin, A. Mira and C. P. Robert, Adaptive multiple importance sampling, Scand. J. Stat. 39 (2012);
A. Vehtari, D. Simpson, A. Gelman, Y. Yao and J. Gabry, Pareto smoothed importance sampling, JMLR 25 (2024).
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator
from scipy.special import logsumexp

from wirebayes.inference.chain_statistics import pareto_smoothed
from wirebayes.inference.climb import climb
from wirebayes.inference.optimum import Optimum, distinct
from wirebayes.inference.sampler import mixture, proposal
from wirebayes.inference.sampler.mixture import Mixture
from wirebayes.inference.sampler.points import WeightedPoints
from wirebayes.inference.sampler.proposal import Proposal
from wirebayes.inference.sampler.settings import EXPLORING_SHARES, ROUGH_SHARES
from wirebayes.numeric.log_sum import log_sum
from wirebayes.numeric.resampling import truncated_rows
from wirebayes.numeric.spread_rows import spread_in_widths
from wirebayes.numeric.typing import Array, Bools, Function, Ints


@dataclass(frozen=True)
class Weighted:
    """Draws of one proposal, weighted for each of m densities.

    Attributes
    ----------
    z : (n, d) array
    log_density : (n, m) array
    log_proposal : (n,) array
    settled : (m,) bool array
        Densities of which there are, or were in an earlier round, as many effective draws as were wanted, with weights
        that can be trusted.
    log_integral : (m,) array
        Logarithms of the integrals, in the round that settled each, or else in the last.
    log_ratio : (m,) array
        Logarithms of each integral over the first one, in the round that settled both, or else in the last.
    proposal : Mixture or Proposal
        What was drawn from.
    """

    z: Array
    log_density: Array
    log_proposal: Array
    settled: Bools
    log_integral: Array
    log_ratio: Array
    proposal: Mixture | Proposal

    @property
    def log_weight(self) -> Array:
        """(n, m) logarithms of density over proposal."""
        return self.log_density - self.log_proposal[:, None]

    def drawn(self, density: int, n: int, rng: Generator) -> Array:
        """(n, d) draws that follow one density, as far as the weights allow.

        Parameters
        ----------
        rng : numpy Generator
        """
        return self.z[truncated_rows(self.log_weight[:, density], n, rng)]


@dataclass(frozen=True)
class _Past:
    """All draws so far.

    Attributes
    ----------
    z : (n, d) array
    log_density : (n, m) array
        Of each density.
    log_proposals : (r, n) array
        Log density of each proposal.
    proposals : tuple of Mixture or Proposal
    counts : tuple of int
        How many of the draws are of each.
    """

    z: Array
    log_density: Array
    log_proposals: Array
    proposals: tuple[Mixture | Proposal, ...]
    counts: tuple[int, ...]

    @staticmethod
    def first(new: Weighted) -> "_Past":
        """The draws of the first proposal."""
        return _Past(new.z, new.log_density, new.log_proposal[None], (new.proposal,), (len(new.z),))

    def joined(self, new: Weighted) -> "_Past":
        """With the draws of one more proposal."""
        of_old = np.vstack([self.log_proposals, new.proposal.log_density(self.z)])
        by_earlier = [proposal.log_density(new.z) for proposal in self.proposals]
        of_new = np.vstack([*by_earlier, new.log_proposal])
        z = np.vstack([self.z, new.z])
        log_density = np.vstack([self.log_density, new.log_density])
        log_proposals = np.hstack([of_old, of_new])
        proposals = (*self.proposals, new.proposal)
        counts = (*self.counts, len(new.z))
        return _Past(z, log_density, log_proposals, proposals, counts)

    def points(self, wanted: Bools, ess: float) -> tuple[WeightedPoints, WeightedPoints]:
        """Points of the sum of the wanted densities to a power, and of the sum itself.

        Parameters
        ----------
        wanted : (m,) bool array
        ess : float
            Effective draws wanted of each density; those with fewer have greater shares.
        """
        drawn_from = log_sum(self.log_proposals + np.log(self.counts)[:, None])
        log_weight = self.log_density - drawn_from[:, None]
        found = effective(log_weight)
        known = wanted & (found > 0)
        share = np.clip(ess / found[known], 1.0, _MOST_SHARE)
        normalised = self.log_density[:, known] - logsumexp(log_weight[:, known], axis=0)
        together = np.logaddexp.reduce(normalised + np.log(share), axis=1)
        hot = WeightedPoints.weighted(self.z, _HOT * together - drawn_from)
        cold = WeightedPoints.weighted(self.z, together - drawn_from)
        return hot, cold


def importance_sample(
    densities: Function,
    start: Mixture,
    draws: Array,
    order: Ints,
    rng: Generator,
    ess: float,
) -> Weighted:
    """Learn a proposal, then draw from it until there are enough effective draws of each density.

    A proposal takes longer to learn than thousands of draws to be made, so from the third round on there are as many as
    seem to be needed. A density is settled by the draws of one round, so its integral has no bias from the learning;
    those of the rounds before only teach. From then on the proposal is learned for the others. Once the first rounds
    are over, those that would need too many draws are given up, except the first: each is better sampled by itself.

    Parameters
    ----------
    densities : function of (n, d) points to (n, m) arrays
        Log densities, none of them normalised; -inf where a density is zero.
    start : Mixture
        Reaches every mode.
    draws : (n, d) array
        Points that roughly follow the first density; none where the start is all that is known of it.
    order : (d,) array of int
        In which coordinates are straightened (see `wirebayes.inference.sampler.transport_map`).
    rng : numpy Generator
    ess : float
        Effective draws wanted of each density.
    """
    witness = draws[rng.permutation(len(draws))[:_WITNESSES]]
    height = densities(witness)[:, 0] if len(witness) else np.empty(0)
    current: Mixture | Proposal = start
    if len(draws):
        rough = WeightedPoints.equal(draws)
        current = _learned(rough, rough, start, order, rng, start)
    n = _LEAST
    past = None
    log_integral = log_ratio = np.zeros(1)  # broadcast to all densities by the first round
    settled = np.zeros(1, bool)
    for done in range(1, _ROUNDS + 1):
        fresh = _weighted(densities, current, n, ess, rng, settled)
        fresh.settled[0] &= expected(fresh, witness, height) >= _LEAST_EXPECTED * ess
        log_integral = np.where(settled, log_integral, fresh.log_integral)
        log_ratio = np.where(settled, log_ratio, fresh.log_ratio)
        settled = settled | fresh.settled & fresh.settled[0]
        needed = _RESERVE * n * ess / np.maximum(effective(fresh.log_weight), 1.0)
        wanted = ~settled
        if done >= _PATIENCE:
            wanted[1:] &= needed[1:] <= _WITHIN_REACH
        if done == _ROUNDS or not wanted.any():
            break
        wanted[0] = True  # without it, the others are ratios of nothing
        n = _LEAST if done == 1 else int(np.clip(needed[wanted].max(), _LEAST, _AFFORDABLE))
        past = _Past.first(fresh) if past is None else past.joined(fresh)
        hot, cold = past.points(wanted, ess)
        if len(witness):
            hot = _remembering(hot, witness)
            cold = _remembering(cold, witness)
        current = _learned(hot, cold, start, order, rng, current)
    return replace(fresh, settled=settled, log_integral=log_integral, log_ratio=log_ratio)


def _remembering(points: WeightedPoints, witness: Array) -> WeightedPoints:
    """Points with the draws (k, d) that were known before, which keep a share of the weight."""
    known = WeightedPoints.equal(witness)
    return points.joined(known.worth(_REMEMBERED * points.weight.sum()))


def from_draws(
    densities: Function,
    draws: Array,
    order: Ints,
    rng: Generator,
    ess: float,
) -> Weighted:
    """`importance_sample`, begun from draws: climbs start at the highest, and for the first density at others too.

    Parameters
    ----------
    densities : function of (n, d) points to (n, m) arrays
    draws : (n, d) array
        Of the first density, roughly.
    order : (d,) array of int
    rng : numpy Generator
    """
    height = densities(draws)
    spread = spread_in_widths(draws, _STARTS, rng)
    highest = np.argmax(height, axis=0)
    begin = draws[np.append(highest, spread)]
    of_highest = np.arange(height.shape[1])
    of_spread = np.zeros(len(spread), int)
    climbed = np.append(of_highest, of_spread)

    def density(z: Array, rows: Ints) -> Array:
        every = densities(z)
        return every[np.arange(len(rows)), climbed[rows]]

    found = climb(density, begin, iterations=_STEPS, tolerance=1e-2)
    found = distinct([found])
    covariance = _WIDER * found.covariance
    equal_weights = np.zeros(len(found.z))
    start = mixture.from_modes(found.z, covariance, equal_weights)
    return importance_sample(densities, start, draws, order, rng, ess)


def widened(modes: Optimum) -> Mixture:
    """The modes' normal approximations, wide enough that little of the posterior lies outside, with heavier tails."""
    return mixture.from_modes(modes.z, _WIDER * modes.covariance, modes.log_evidence)


def _weighted(
    densities: Function,
    current: Mixture | Proposal,
    n: int,
    ess: float,
    rng: Generator,
    settled: Bools,
) -> Weighted:
    """Weighted draws of a proposal.

    A tail takes as long as hundreds of draws: it is fitted for the first density, without which no other is known, and
    for those that are not `settled` (m,) before.
    """
    z = current.rvs(n, rng)
    log_density = densities(z)
    log_proposal = current.log_density(z)
    log_weight = log_density - log_proposal[:, None]
    asked = ~settled | (np.arange(log_weight.shape[1]) == 0)
    enough = asked & (effective(log_weight) >= ess)
    trusted = [bool(e) and tail(w) <= LARGEST_K for e, w in zip(enough, log_weight.T, strict=True)]
    log_integral = logsumexp(log_weight, axis=0) - np.log(n)
    log_ratio = log_integral - log_integral[0]
    return Weighted(z, log_density, log_proposal, np.array(trusted), log_integral, log_ratio, current)


def effective(log_weight: Array) -> Array:
    """(m,) effective numbers of draws, (sum w)² / sum w², of weights (n, m); 0 where none has any weight."""
    top = log_weight.max(axis=0)
    weight = np.exp(log_weight - np.where(np.isfinite(top), top, 0.0))
    return weight.sum(axis=0) ** 2 / np.maximum((weight**2).sum(axis=0), 1e-300)


def expected(fresh: Weighted, witness: Array, height: Array) -> float:
    """Effective draws of the first density, as its weights at other draws of it promise; all, where there are none.

    Draws of a proposal know nothing of a hill that it misses, and their weights look fine.

    Parameters
    ----------
    fresh : Weighted
        Draws of the proposal.
    witness : (n, d) array
        Draws that roughly follow the first density.
    height : (n,) array
        Its logarithm there.
    """
    if not len(witness):
        return float(len(fresh.z))
    over = height - fresh.proposal.log_density(witness) - fresh.log_integral[0]
    log_share = min(np.log(len(over)) - logsumexp(over), 0.0)
    return float(len(fresh.z) * np.exp(log_share))


def tail(log_weight: Array) -> float:
    """Shape k of the tail of (n,) weights, by a generalised Pareto distribution; NaN where there is none.

    The smaller of two estimates, from the largest 3 √n weights and from the largest √n. Where a hill of the density is
    drawn too seldom, its weights lie above a plateau of others, and a tail that holds both looks heavy.
    """
    values = log_weight[np.isfinite(log_weight)]
    if not len(values):
        return np.nan
    with np.errstate(all="ignore"):
        _, all_of_it = pareto_smoothed(values, 1.0)
        _, largest = pareto_smoothed(values, 9.0)
    return float(np.fmin(all_of_it, largest))


def _learned(
    hot: WeightedPoints,
    cold: WeightedPoints,
    start: Mixture,
    order: Ints,
    rng: Generator,
    before: Mixture | Proposal,
) -> Mixture | Proposal:
    """The proposal fitted to points, or the one before where they are too few."""
    known = before if isinstance(before, Proposal) else None
    shares = EXPLORING_SHARES if known else ROUGH_SHARES
    try:
        # no walker is caught in a tail here, and a map for the middle leaves more effective draws
        return proposal.fit_proposal(
            hot, cold, start, order, rng, shares, most=_COMPONENTS, points=_LEARNED, before=known, along_tails=False
        )
    except np.linalg.LinAlgError:
        return before


_STARTS = 6  # of climbs on the first density, besides the highest draw
_STEPS = 40  # to a mode; the proposal learns the rest
_WIDER = 1.7  # times the covariance at a mode
LARGEST_K = 0.7  # above it no number of draws is enough (Vehtari et al.)
_LEAST = 4096  # draws of a round: a proposal takes longer to learn than these to be drawn
_ROUNDS = 8  # at most, some 100,000 draws: what has not settled by then, walkers sample sooner
_PATIENCE = 3  # rounds in which all densities are learned, whatever they need
_AFFORDABLE = 16_000  # draws for a density among others; alone, one takes some 3,000
_WITNESSES = 1250  # of the rough points, that are learned from in every round: what they know is not forgotten
_LEAST_EXPECTED = 0.5  # of the effective draws wanted: what a thousand rough draws promise is known to a factor
_REMEMBERED = 0.25  # of what all draws are worth
_LEARNED = 2500  # points that a proposal is learned from: it needs not be the best one
_HOT = 0.4  # power of the densities that the wide parts of the proposal are fitted to
_COMPONENTS = 8  # of the close part
# draws that a density may seem to need, among others, for one more round to be worth while: rounds improve the proposal
_WITHIN_REACH = 48_000
_RESERVE = 1.3  # draws beyond those that seem to be enough
_MOST_SHARE = 10.0  # of a density that is known worst, in shares of one that is known well enough

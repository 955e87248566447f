"""Burn-in: from a search for modes to a proposal that can be frozen, and walkers distributed over the modes.

The annealed population of the search gives the first proposal. Then, round by round, the proposal is fitted to its own
draws, which fill it evenly (`wirebayes.inference.sampler.net`), weighted by posterior over proposal. These weights also
measure its quality: the acceptance rate it would have, and the distance from the median of the log weight under the
posterior to its 99.9 % quantile. Where the draws of all rounds show that it makes too little of some places, these get
a part of their own. Until it is frozen, the proposal draws more from its wide components than afterwards, because the
tails would otherwise be learned from few draws. While hardly a draw would be accepted, walkers explore the density to a
power below one: it has the same modes, with lower barriers between them.

At the end walkers are placed by weight, so that none is left in a distant mode of negligible weight.
"""

from dataclasses import replace

import numpy as np

from wirebayes.inference.climb import climb
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.inference.modes import search
from wirebayes.inference.optimum import Optimum, distinct
from wirebayes.inference.policy import Policy
from wirebayes.inference.sampler import net, proposal
from wirebayes.inference.sampler.overlooked import left_by_search
from wirebayes.inference.sampler.points import WeightedPoints
from wirebayes.inference.sampler.proposal import Proposal
from wirebayes.inference.sampler.settings import (
    CLIMBS,
    EFFECTIVE,
    EXPLORING_SHARES,
    FEW_ROUNDS,
    GOOD_ACCEPTANCE,
    HOT,
    IN_FULL,
    LEAST_DRAWS,
    LEAST_OF,
    LONGEST_SETTLING,
    MORE_COMPONENTS,
    MOST_COMPONENTS,
    PASSING_POINTS,
    POINTS,
    REMEMBERED,
    ROUGH_SHARES,
    SHARES,
    TO_FIND_MORE,
    USEFUL,
    WARM,
)
from wirebayes.inference.sampler.start import finite_draws, modes_below, overdispersed
from wirebayes.inference.sampler.state import BurnIn, Kept, Learned, Sampling, Walkers, advance, move_of
from wirebayes.numeric.resampling import effective_number, next_power, truncated_rows
from wirebayes.numeric.spread_rows import spread_rows
from wirebayes.numeric.typing import Array, Ints


def init(
    target: LogPosterior, seed: int, policy: Policy, found: Optimum | None, near: Array | None, rough: Array | None
) -> BurnIn:
    """Search where nothing is known, and learn a first proposal from rough draws.

    Parameters
    ----------
    seed : int
        Of everything that is random in this run.
    policy : Policy
        See `wirebayes.inference.sampler.ensemble.sample_posterior`.
    found : Optimum or None
        Modes that are known already; None searches for them.
    near : (m, d) array or None
        Further starts of the search, in the coordinates that are sampled.
    rough : (m, d) array or None
        Points that roughly follow the posterior, in the same coordinates; the first proposal is fitted to them.

    Returns
    -------
    BurnIn
        Walkers drawn from the modes' normal approximations, widened; nothing is kept yet.
    """
    of_search, of_walkers = np.random.SeedSequence(seed).spawn(2)
    rng = np.random.default_rng(of_search)
    before = target.evaluations
    hot = cold = rough
    witness = None
    if found is None:
        searched = search(target, rng, extra=near)
        found = searched.modes
        witness = searched.cold, searched.height
        if rough is None:
            hot = searched.warm
            cold = searched.cold
    known = overdispersed(found)
    random = np.random.RandomState(np.random.MT19937(of_walkers))
    count = _walking(target, policy)
    places = finite_draws(target, known, count, random)
    walkers = Walkers(*places, random.get_state())
    learned = Learned(known, known, len(found.z), witness)
    state = BurnIn(walkers, learned, rng, target.evaluations - before)
    if hot is not None and cold is not None:
        state = _fitted(target, state, policy, WeightedPoints.equal(hot), WeightedPoints.equal(cold), ROUGH_SHARES)
        if state.learned.proposal is not known:
            state = replace(state.knowing(acceptance=1.0), seen=None)  # assumed good until draws show otherwise
    return state


def burn_in_round(target: LogPosterior, state: BurnIn, policy: Policy) -> BurnIn | Sampling:
    """Learn from a walk, as long as the proposal is not to be trusted, then from weighted draws of the proposal.

    Parameters
    ----------
    policy : Policy
        How many rounds, how many draws in each, and what acceptance is enough.

    Returns
    -------
    BurnIn or Sampling
        After the last round the proposal is frozen and walkers are placed.
    """
    state = replace(state, round=state.round + 1)
    if state.learned.acceptance < USEFUL:
        state, walk = _walked(target, state, policy)
        state = _fitted(target, state, policy, *_weighted_twice(*walk))
    state, drawn = _drawn(target, state, policy)
    _, value, base = drawn
    weight = value - base
    acceptance, middle, high = _quality(weight, state.generator)
    state = state.knowing(acceptance=acceptance)
    last = _is_last(state, policy, high - middle)
    if acceptance >= USEFUL:
        points = POINTS if last else PASSING_POINTS
        state = _fitted(target, state, policy, *_weighted_twice(*drawn), points=points)
        left = left_by_search(state.learned, middle) if last else None
        state = _with_excess(state, drawn[0], value, weight, left)
    if not last:
        return state
    # Places of great weight are few among the draws: walkers need about so many steps to find their share of them.
    steps = int(np.clip(np.exp(high - middle), 1, LONGEST_SETTLING))
    return _frozen(target, state, policy, drawn, steps)


def _is_last(state: BurnIn, policy: Policy, tail: float) -> bool:
    """Whether no round follows: the proposal is good, with such a tail of its log weights, or there were enough."""
    settled = state.learned.acceptance >= GOOD_ACCEPTANCE and tail < policy.tail
    enough = settled and state.round >= policy.rounds
    return enough or state.round >= policy.most_rounds


def _quality(weight: Array, rng: np.random.Generator) -> tuple[float, float, float]:
    """The quality of a proposal by log weights of its draws: acceptance rate, their median and 99.9 % quantile."""
    rows = truncated_rows(weight, len(weight), rng)
    typical = weight[rows]
    against = rng.permutation(typical)
    accepted = np.exp(np.minimum(weight - against, 0.0))
    middle, high = np.quantile(typical, [0.5, 0.999])
    return float(accepted.mean()), middle, high


def _frozen(
    target: LogPosterior, state: BurnIn, policy: Policy, drawn: tuple[Array, Array, Array], steps: int
) -> Sampling:
    """The run with its proposal as it will stay, every ensemble placed by weight and settled for some steps."""
    trusted = state.learned.acceptance > policy.acceptance
    learned = _as_frozen(replace(state.learned, trusted=trusted))
    z, value, base = drawn if trusted or state.walk is None else state.walk
    rows = _placed(policy, value - base, state.generator)
    walkers = Walkers(z[rows], value[rows], state.walkers.random)
    move = move_of(learned, policy.ensembles, steps, frozen=True)
    settled = advance(target, walkers, move, steps)
    evaluations = state.evaluations + settled.evaluations
    return Sampling(settled.walkers, learned, state.generator, evaluations)


def _with_excess(state: BurnIn, z: Array, value: Array, log_weight: Array, left: WeightedPoints | None) -> BurnIn:
    """The proposal with a part for what it makes too little of.

    Parameters
    ----------
    state : BurnIn
        Its places of earlier rounds are looked at, too.
    z, value, log_weight : arrays
        Places (n, d), their log densities and weights.
    left : WeightedPoints or None
        Places that the search left, with their log densities as one more column.
    """
    drawn = WeightedPoints.weighted(np.column_stack([z, value]), log_weight)
    drawn = drawn.worth(effective_number(drawn.weight))
    if state.drawn is not None:
        drawn = state.drawn.joined(drawn)
        drawn = WeightedPoints(drawn.z[-REMEMBERED:], drawn.weight[-REMEMBERED:])
    state = replace(state, drawn=drawn)
    known = state.learned.proposal
    if not isinstance(known, Proposal):
        return state
    every = drawn if left is None else drawn.joined(left)
    places = replace(every, z=every.z[:, :-1])
    heights = every.z[:, -1]
    with_excess = proposal.with_excess(known, places, heights, state.generator)
    return state.knowing(proposal=with_excess)


def again(target: LogPosterior, state: Sampling, policy: Policy) -> BurnIn:
    """Count the kept draws as burn-in, learn the proposal from them, and go on with rounds as before.

    Parameters
    ----------
    target : LogPosterior
    state : Sampling
    policy : Policy
    """
    learned = replace(state.learned, again=state.learned.again + 1, previous=None)
    done = policy.rounds - 1
    if _hard_to_find(learned):  # few rounds of many draws: what is overlooked is rare
        done = max(done, policy.most_rounds - FEW_ROUNDS)
    return _of_kept(target, replace(state, learned=learned), policy, done)


def refined(target: LogPosterior, state: Sampling, policy: Policy, *, draws_stay: bool) -> Sampling | BurnIn:
    """The run with its proposal learned again from the kept draws; walkers go on from where they are.

    Where the places of which the proposal makes least lead to a mode that was unknown, no draws stay, for most of them
    do not know of it, and rounds of burn-in follow as in `again`.

    Parameters
    ----------
    draws_stay : bool
        False where walkers are still about where they were placed, by the weights of few draws.
    """
    before = target.evaluations
    learned = state.learned
    known = modes_below(target, learned.start)
    climbed = _climbed(target, state, known)
    found = distinct([known, climbed])
    evaluations = state.evaluations + target.evaluations - before
    state = replace(state, evaluations=evaluations)
    modes = len(found.z)
    if modes > len(known.z):
        learned = replace(learned, start=overdispersed(found), modes=modes)
        return again(target, replace(state, learned=learned), policy)
    earlier = state.all_kept if draws_stay else Kept()
    previous = learned.proposal if earlier.steps else None
    learned = replace(learned, again=learned.again + 1, previous=previous)
    state = replace(state, learned=learned)
    fitted = _of_kept(target, state, policy, policy.rounds)
    frozen = _as_frozen(fitted.learned)
    return replace(state, learned=frozen, kept=Kept(), earlier=earlier, diagnostics=None)


def _climbed(target: LogPosterior, state: Sampling, known: Optimum) -> Optimum:
    """Where climbs end that begin at kept draws of which the proposal makes least, but for those near known modes."""
    z, value = state.all_kept.flat
    over = value - state.learned.proposal.log_density(z)
    least = np.unique(z[over >= np.quantile(over, 1.0 - LEAST_OF)], axis=0)
    begin = least[spread_rows(least / z.std(axis=0), CLIMBS, state.generator)]
    density, residuals = target.rowwise()
    found = climb(density, begin, residuals, of=np.zeros(len(begin), np.int64), known=[known])
    return found.rows(found.converged & np.isfinite(found.log_density))


def _of_kept(target: LogPosterior, state: Sampling, policy: Policy, done: int) -> BurnIn:
    """Burn-in after so many rounds, with a proposal that was learned from all kept draws.

    What the search left and the proposal overlooked goes into its excess part, too: a mode that walkers have lost is
    found again, and the wide end of a funnel, which holds next to nothing, is no longer underrated.
    """
    z, value = state.all_kept.flat
    seen = _weighted_twice(z, value, value)
    burning = BurnIn(state.walkers, state.learned, state.generator, state.evaluations, done)
    fitted = _fitted(target, burning, policy, *seen)
    middle = np.median(value - fitted.learned.proposal.log_density(z))
    left = left_by_search(fitted.learned, float(middle))
    return _with_excess(fitted, z, value, np.zeros(len(z)), left)


def _as_frozen(learned: Learned) -> Learned:
    """With the shares of the proposal's parts as they are once it no longer learns."""
    if not isinstance(learned.proposal, Proposal):
        return learned
    return replace(learned, proposal=replace(learned.proposal, shares=SHARES))


def _hard_to_find(learned: Learned) -> bool:
    """Whether places are overlooked by a proposal that was learned from kept draws already."""
    return learned.overlooked > 0.0 and learned.again > 1


def _walked(target: LogPosterior, state: BurnIn, policy: Policy) -> tuple[BurnIn, tuple[Array, Array, Array]]:
    """Where walkers of the warm density come by: places (n, d), their log densities and the log density walked."""
    number = min(state.learned.walks, len(WARM) - 1)
    power = WARM[number]
    steps = policy.round_draws // _walking(target, policy) * 2**number
    move = move_of(state.learned, 1, steps, frozen=False)
    done = advance(target, state.walkers, move, steps, power)
    walked = done.sampler.get_log_prob(discard=steps // 2, flat=True)
    walk = done.sampler.get_chain(discard=steps // 2, flat=True), walked / power, walked
    state = state.knowing(walks=state.learned.walks + 1)
    return replace(state, walkers=done.walkers, evaluations=state.evaluations + done.evaluations, walk=walk), walk


def _drawn(target: LogPosterior, state: BurnIn, policy: Policy) -> tuple[BurnIn, tuple[Array, Array, Array]]:
    """Draws of the proposal, fewer in the first rounds: places (n, d), their log densities and the proposal's."""
    learned = state.learned
    points = net.even(_how_many(state, policy), len(target.problem.names) + 1, state.generator)
    z = proposal.components(learned.proposal).from_cube(points, state.generator)
    before = target.evaluations
    value = target(z)
    made = target.evaluations - before
    good = np.isfinite(value)
    drawn = z[good], value[good], learned.proposal.log_density(z[good])
    return replace(state, evaluations=state.evaluations + made), drawn


def _how_many(state: BurnIn, policy: Policy) -> int:
    """Draws of the proposal in this round."""
    most = policy.round_draws
    if _hard_to_find(state.learned):
        most = most * TO_FIND_MORE
    halvings = max(IN_FULL - state.round, 0)
    least = min(most, LEAST_DRAWS * state.learned.modes)
    return max(most >> halvings, least)


def _fitted(
    target: LogPosterior,
    state: BurnIn,
    policy: Policy,
    hot: WeightedPoints,
    cold: WeightedPoints,
    shares: proposal.Shares = EXPLORING_SHARES,
    points: int = POINTS,
) -> BurnIn:
    """Fit the proposal to points of the warm density and of the density, and to those of the round before."""
    learned = state.learned
    before = state.seen
    state = replace(state, seen=(hot, cold))
    if before is not None:
        hot = before[0].joined(hot)
        cold = before[1].joined(cold)
    components = policy.components * (MORE_COMPONENTS if learned.again else 1)
    try:
        new = proposal.fit_proposal(
            hot,
            cold,
            learned.start,
            target.coordinates.order,
            state.generator,
            shares,
            most=max(components, min(learned.modes, MOST_COMPONENTS)),
            points=points,
            before=learned.proposal if isinstance(learned.proposal, Proposal) else None,
            scores=target.coordinates.shares,
        )
    except np.linalg.LinAlgError:
        return state  # too few distinct points yet: keep the proposal that made them
    return state.knowing(proposal=new)


def _weighted_twice(z: Array, value: Array, base: Array) -> tuple[WeightedPoints, WeightedPoints]:
    """Points of the warm density and of the density, from places whose log density of being there is `base`.

    Where a few of them would have all the weight, they stand for a density between the two instead, the one they came
    from and the one wanted: weights are taken to the largest power that leaves a tenth of the places effective. The
    next round goes on from there, while a mixture learned from a dozen points would be no better than the last.

    References
    ----------
    A. Korba and F. Portier, Adaptive importance sampling meets mirror descent: a bias-variance tradeoff, AISTATS 2022.
    """
    wanted = [power * value - base for power in (HOT, 1.0)]
    hot, cold = (WeightedPoints.weighted(z, next_power(weight, 1.0, EFFECTIVE) * weight) for weight in wanted)
    return hot, cold


def _placed(policy: Policy, log_weight: Array, rng: np.random.Generator) -> Ints:
    """Rows by weight where walkers begin: every ensemble has a share of the places of its own."""
    chosen = []
    for i in range(policy.ensembles):
        own = np.arange(i, len(log_weight), policy.ensembles)
        chosen.append(own[truncated_rows(log_weight[own], policy.walkers, rng)])
    return np.concatenate(chosen)


def _walking(target: LogPosterior, policy: Policy) -> int:
    """Walkers in burn-in: few, for the same number of evaluations takes them further."""
    each = min(policy.walkers, max(policy.walkers // 4, 2 * len(target.problem.names) + 2))
    return each * policy.ensembles

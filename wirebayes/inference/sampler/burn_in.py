"""Burn-in: from a search for modes to a proposal that can be frozen, and walkers distributed over the modes.

The annealed population of the search gives the first proposal. Then, round by round, the proposal is fitted to its own
draws, weighted by posterior over proposal. These weights also measure its quality: the acceptance rate it would have,
and the distance from the median of the log weight under the posterior to its 99.9 % quantile. Until it is frozen, the
proposal draws more from its wide components than afterwards, because the tails would otherwise be learned from few
draws. While hardly a draw would be accepted, walkers explore the density to a power below one: it has the same modes,
with lower barriers between them.

At the end walkers are placed by weight, so that none is left in a distant mode of negligible weight.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wirebayes.inference.modes import Optimum, search
from wirebayes.inference.policy import Policy
from wirebayes.inference.sampler import mixture, proposal
from wirebayes.inference.sampler.mixture import Mixture
from wirebayes.inference.sampler.proposal import Proposal
from wirebayes.inference.sampler.state import State, advance
from wirebayes.inference.transform import LogPosterior

Array = NDArray[Any]


def begin(
    target: LogPosterior, seed: int, policy: Policy, found: Optimum | None, near: Array | None, rough: Array | None
) -> State:
    """Search where nothing is known, and learn a first proposal from rough draws.

    Parameters
    ----------
    target : LogPosterior
    seed : int
        Of everything that is random in this run.
    policy : Policy
        See `wirebayes.inference.sampler.ensemble.sample`.
    found : Optimum or None
        Modes that are known already; None searches for them.
    near : (m, d) array or None
        Further starts of the search, in the coordinates that are sampled.
    rough : (m, d) array or None
        Points that roughly follow the posterior, in the same coordinates; the first proposal is fitted to them.

    Returns
    -------
    State
        Walkers drawn from the modes' normal approximations, widened; nothing is kept yet.
    """
    spawned = np.random.SeedSequence(seed).spawn(2)
    rng = np.random.default_rng(spawned[0])
    before = target.evaluations
    seen, witness = None if rough is None else (rough, rough), None
    if found is None:
        searched = search(target, rng, extra=near)
        found, seen = searched.modes, seen or (searched.warm, searched.cold)
        witness = searched.cold, searched.height
    known = mixture.from_modes(found.z, found.covariance * _OVERDISPERSED, found.log_evidence)
    random = np.random.RandomState(np.random.MT19937(spawned[1]))
    positions, values = _finite_draws(target, known, _walking(target, policy), random)
    before = target.evaluations - before
    state = State(positions, values, random.get_state(), known, known, rng, len(found.z), before, witness=witness)
    if seen is not None and _fit(target, state, policy, *seen, proposal.ROUGH_SHARES):
        state.acceptance, state.seen = 1.0, None  # to be believed until draws tell better
    return state


def one_round(target: LogPosterior, state: State, policy: Policy) -> None:
    """Learn from a walk, as long as the proposal is not to be trusted, then from weighted draws of the proposal.

    Parameters
    ----------
    target : LogPosterior
    state : State
        Changed in place: proposal, acceptance and round; after the last round it is frozen and its walkers are placed.
    policy : Policy
        How many rounds, how many draws in each, and what acceptance is enough.
    """
    state.round += 1
    if state.acceptance < _USEFUL:
        _fit(target, state, policy, *_resampled_twice(*_walked(target, state, policy), state.generator))
    z, value, base = _drawn(target, state, policy)
    weight = value - base
    typical = weight[_resampled(weight, len(weight), state.generator)]
    state.acceptance = float(np.exp(np.minimum(weight - state.generator.permutation(typical), 0.0)).mean())
    middle, high = np.quantile(typical, [0.5, 0.999])
    settled = state.acceptance >= _GOOD_ACCEPTANCE and high - middle < policy.tail
    last = state.round >= policy.rounds and settled or state.round >= policy.most_rounds
    if state.acceptance >= _USEFUL:
        seen = _resampled_twice(z, value, base, state.generator)
        _fit(target, state, policy, *seen, points=proposal.ENOUGH if last else _PASSING)
    if last:
        state.frozen, state.learned = True, state.acceptance > policy.acceptance
        if isinstance(state.proposal, Proposal):
            state.proposal = replace(state.proposal, shares=proposal.SHARES)
        _place(state, policy, *((z, value, base) if state.learned or state.walk is None else state.walk))
        state.walk = state.seen = None
        # Places of great weight are few among the draws: walkers need about so many steps to find their share of them.
        steps = int(np.clip(np.exp(high - middle), 1, _LONGEST_SETTLING))
        advance(target, state, steps, policy.ensembles)


def learn_again(target: LogPosterior, state: State, policy: Policy) -> None:
    """Count the kept draws as burn-in, learn the proposal from them, and go on with rounds as before.

    Parameters
    ----------
    target : LogPosterior
    state : State
        Changed in place: unfrozen, without kept draws.
    policy : Policy
    """
    z = np.concatenate(state.kept_z).reshape(-1, state.positions.shape[1])
    value = np.concatenate(state.kept_log_density).ravel()
    state.frozen, state.again, state.round = False, state.again + 1, policy.rounds - 1
    if state.overlooked:  # few rounds of many draws: what is overlooked is rare
        state.round = max(state.round, policy.most_rounds - _FEW_ROUNDS)
    state.kept_z, state.kept_log_density = [], []
    state.kept_evaluations = state.accepted = state.proposed = 0
    hot = z[_resampled((_HOT - 1.0) * value, len(z), state.generator)]
    _fit(target, state, policy, hot, z)


def overlooked(state: State, z: Array, value: Array) -> float:
    """How far places that matter lie above what the frozen proposal makes of them, in nats.

    The log of posterior over proposal, less its median over the posterior, is taken at its 99.9 % quantile over kept
    draws, and at its 99 % quantile over the rough draws that the search left; the larger counts. A neck into which few
    walkers found their way, and stayed, shows in the first, a mode that they lost in the second.

    Parameters
    ----------
    state : State
        Holds the proposal and, in `witness`, what the search left.
    z : (n, d) array
        Kept draws, in the coordinates that are sampled.
    value : (n,) array
        Their log posterior densities.

    Returns
    -------
    float
    """
    over = value - state.proposal.log_density(z)
    middle, high = np.quantile(over, [0.5, 0.999])
    if state.witness is None:
        return float(high - middle)
    z, value = state.witness
    return float(max(high, np.quantile(value - state.proposal.log_density(z), 0.99)) - middle)


def _walked(target: LogPosterior, state: State, policy: Policy) -> tuple[Array, Array, Array]:
    """Where walkers of the warm density come by: places (n, d), their log densities and the log density walked."""
    again = min(state.walks, len(_WARM) - 1)
    state.walks += 1
    steps = policy.round_draws // _walking(target, policy) * 2**again
    sampler, _ = advance(target, state, steps, power=_WARM[again])
    walked = sampler.get_log_prob(discard=steps // 2, flat=True)
    state.walk = sampler.get_chain(discard=steps // 2, flat=True), walked / _WARM[again], walked
    return state.walk


def _drawn(target: LogPosterior, state: State, policy: Policy) -> tuple[Array, Array, Array]:
    """Draws of the proposal, fewer in the first rounds: places (n, d), their log densities and the proposal's."""
    most = policy.round_draws * (_TO_FIND_MORE if state.overlooked else 1)
    n = max(most >> max(_IN_FULL - state.round, 0), min(most, _LEAST_DRAWS))
    z = state.proposal.rvs(n, state.generator)
    before = target.evaluations
    value = target(z)
    state.evaluations += target.evaluations - before
    good = np.isfinite(value)
    return z[good], value[good], state.proposal.log_density(z[good])


def _fit(
    target: LogPosterior,
    state: State,
    policy: Policy,
    hot: Array,
    cold: Array,
    shares: tuple[float, float, float, float] = proposal.EXPLORING,
    points: int = proposal.ENOUGH,
) -> bool:
    """Fit the proposal to draws of the warm density and of the density, and to those of the round before."""
    before, state.seen = state.seen, (hot, cold)
    if before is not None:
        hot, cold = np.vstack([before[0], hot]), np.vstack([before[1], cold])
    try:
        state.proposal = proposal.fit(
            hot, cold, state.start, target.coordinates.order, state.generator, shares,
            most=max(policy.components, min(state.modes, _MOST_COMPONENTS)), points=points,
            before=state.proposal if isinstance(state.proposal, Proposal) else None,
        )  # fmt: skip
    except np.linalg.LinAlgError:
        return False  # too few distinct points yet: keep the proposal that made them
    return True


def _resampled_twice(z: Array, value: Array, base: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """Draws of the warm density and of the density, from places whose log density of being there is `base`."""
    hot, cold = (z[_resampled(power * value - base, len(z), rng)] for power in (_HOT, 1.0))
    return hot, cold


def _place(state: State, policy: Policy, z: Array, value: Array, base: Array) -> None:
    """Start every ensemble from a share of the places of its own."""
    chosen = []
    for i in range(policy.ensembles):
        own = np.arange(i, len(z), policy.ensembles)
        chosen.append(own[_resampled((value - base)[own], policy.walkers, state.generator)])
    state.positions, state.values = z[np.concatenate(chosen)], value[np.concatenate(chosen)]


def _walking(target: LogPosterior, policy: Policy) -> int:
    """Walkers in burn-in: few, for the same number of evaluations takes them further."""
    each = min(policy.walkers, max(policy.walkers // 4, 2 * len(target.problem.names) + 2))
    return each * policy.ensembles


def _resampled(log_weight: Array, n: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """(n,) rows drawn by weight, systematically, in random order; no row counts for more than the root of all rows."""
    weight = np.exp(log_weight - log_weight.max())
    weight = np.minimum(weight, np.sqrt(len(weight)) * weight.mean())
    return rng.permutation(mixture.rows_by_weight(weight, n, rng))


def _finite_draws(target: LogPosterior, known: Mixture, n: int, random: Any) -> tuple[Array, Array]:
    """Draws of a mixture where the density is above zero, and its logarithm there."""
    drawn, values = np.empty((0, len(target.problem.names))), np.empty(0)
    while len(drawn) < n:
        z = known.rvs(n, random)
        value = target(z)
        good = np.isfinite(value)
        drawn, values = np.vstack([drawn, z[good]]), np.concatenate([values, value[good]])
    return drawn[:n], values[:n]


# of the covariance at a mode: too narrow a start misses what is bent, too wide a one costs some draws
_OVERDISPERSED = 1.7
_WARM = (0.5, 0.6, 0.7, 0.8)  # powers of the density that burn-in walks, the longer the more often it has to
_HOT = 0.4  # power of the density that the wide part of the proposal is fitted to
_USEFUL = 0.05  # acceptance from which on draws of the proposal teach more than a walk
_GOOD_ACCEPTANCE = 0.25  # burn-in goes on below it; with a quarter accepted, independent draws are some 7 steps apart
_PASSING = 5000  # points for a proposal that only the next round draws from
_IN_FULL, _LEAST_DRAWS = 3, 1024  # the round from which on there are as many draws as asked for; the fewest before
_TO_FIND_MORE, _FEW_ROUNDS = 4, 4  # times as many draws, and rounds, where the last proposal overlooked places
# steps; a proposal within `Policy.tail` (1.5 nats) needs 4.5, one that was given up on gets no more than 8
_LONGEST_SETTLING = 8
_MOST_COMPONENTS = 24  # however many modes there are

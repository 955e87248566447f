"""The posterior by emcee: independent ensembles, a learned move, a written stop rule, exact resumption.

Policy. Burn-in (`wirebayes.inference.sampler.burn_in`) ends with a frozen proposal. Then draws are kept, block by
block, until for every parameter

- the effective sample size, from the spread of the walkers' means, is at least `Policy.ess`,
- the kept steps span five autocorrelation times, and
- the nested R-hat with the ensembles as super-chains is at most `Policy.r_hat`, and
- no region of the posterior is underrated by the frozen proposal so much that one place there outweighs a pool of draws
  (`burn_in.overlooked`),

or until `Policy.most_steps`: then the result says *not converged*, and why. If the first kept draws show that a better
proposal would need fewer evaluations in total, they count as burn-in, and the proposal is learned again from them.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wirebayes.inference.convergence import ENOUGH, autocorrelation_steps, nested_r_hat
from wirebayes.inference.modes import Optimum
from wirebayes.inference.policy import DEFAULT, Policy, describe
from wirebayes.inference.sampler import burn_in
from wirebayes.inference.sampler.state import POOL, State, advance
from wirebayes.inference.transform import LogPosterior

Array = NDArray[Any]


@dataclass(frozen=True)
class Chains:
    """Kept draws and how they came about.

    Attributes
    ----------
    z : (ensembles, steps, walkers, d) array
        Sampled coordinates.
    log_density : (ensembles, steps, walkers) array
    autocorrelation_steps, ess, r_hat : (d,) arrays
        Of the natural parameters.
    converged : bool
    why : str
        The stop rule's words.
    evaluations, kept_evaluations : int
        Likelihood evaluations of everything, and of the kept steps alone.
    acceptance : float
        Share of kept steps that went to another place.
    learned : bool
        False when the learned move was given up.
    modes : int
        Distinct modes found before sampling.
    """

    z: Array
    log_density: Array
    autocorrelation_steps: Array
    ess: Array
    r_hat: Array
    converged: bool
    why: str
    evaluations: int
    kept_evaluations: int
    acceptance: float
    learned: bool
    modes: int


def sample(
    target: LogPosterior,
    seed: int,
    policy: Policy = DEFAULT,
    *,
    checkpoint: Path | None = None,
    progress: Callable[[float], None] = lambda share: None,
    found: Optimum | None = None,
    near: Array | None = None,
    rough: Array | None = None,
) -> Chains:
    """Sample a posterior (see the module's policy).

    Parameters
    ----------
    target : LogPosterior
    seed : int
    policy : Policy
    checkpoint : Path, optional
        A file that is rewritten whole after each block; a later call with the same arguments goes on from it and
        ends with the same bytes. Readings and model are the caller's business, the file knows only the seed, the
        policy and the names of the parameters.
    progress : function of a share between 0 and 1
    found : Optimum, optional
        Modes already known, instead of a search.
    near : (m, d) array, optional
        Sampled coordinates that the search should climb from, too.
    rough : (n, d) array, optional
        Sampled coordinates of draws from nearly this posterior: what the first proposal is learned from.

    Returns
    -------
    Chains

    Raises
    ------
    InputError
        The checkpoint is damaged, of another format, or of another fit.
    """
    of_fit = {"seed": seed, "policy": describe(policy), "parameters": target.problem.names}
    state = State.load(checkpoint, of_fit) or burn_in.begin(target, seed, policy, found, near, rough)
    state.save(checkpoint, of_fit)
    while not state.finished:
        if not state.frozen:
            burn_in.one_round(target, state, policy)
            progress(0.2 * state.round / policy.rounds if state.round < policy.rounds else 0.2)
        else:
            _kept_block(target, state, policy)
            _look(target, state, policy)
            if not state.finished and (_doubtful(state) or not state.again and _promises_more(state, policy)):
                burn_in.learn_again(target, state, policy)
            progress(min(1.0, 0.2 + 0.8 * float(state.ess.min()) / policy.ess))
        state.save(checkpoint, of_fit)
    z, log_density = (_by_ensemble(blocks, policy) for blocks in (state.kept_z, state.kept_log_density))
    return Chains(
        z, log_density, state.autocorrelation, state.ess, state.r_hat, state.converged, state.why, state.evaluations,
        state.kept_evaluations, state.accepted / max(state.proposed, 1), state.learned, state.modes,
    )  # fmt: skip


def _kept_block(target: LogPosterior, state: State, policy: Policy) -> None:
    sampler, used = advance(target, state, _block_steps(state, policy), policy.ensembles)
    state.kept_z.append(sampler.get_chain())
    state.kept_log_density.append(sampler.get_log_prob())
    state.kept_evaluations += used
    state.accepted += int(sampler.backend.accepted.sum())
    state.proposed += state.kept_log_density[-1].size


def _by_ensemble(blocks: list[Array], policy: Policy) -> Array:
    """(ensembles, steps, walkers, ...) of blocks (steps, n, ...)."""
    every = np.concatenate(blocks)
    each = every.reshape(len(every), policy.ensembles, policy.walkers, *every.shape[2:])
    return np.ascontiguousarray(np.moveaxis(each, 1, 0))


def _block_steps(state: State, policy: Policy) -> int:
    """As many steps as the last look promises to be enough, but no more than were kept so far."""
    kept = sum(len(block) for block in state.kept_z)
    if not kept:
        return policy.block
    missing = kept * max(policy.ess / state.ess.min() - 1.0, ENOUGH * state.autocorrelation.max() / kept - 1.0)
    wanted = int(np.clip(np.ceil(missing), min(_LEAST_BLOCK, policy.block), kept))
    return min(wanted, policy.most_steps - kept)


def _look(target: LogPosterior, state: State, policy: Policy) -> None:
    """Apply the stop rule to the draws kept so far."""
    z = _by_ensemble(state.kept_z, policy)
    steps, d = z.shape[1], z.shape[-1]
    theta = target.coordinates.to_natural(z.reshape(-1, d)).reshape(z.shape)
    # Logarithms of positive parameters: a heavy tail must not hide the walk.
    values = np.where(target.coordinates.log_columns, np.log(np.abs(theta) + 1e-300), theta)
    state.autocorrelation = np.maximum(autocorrelation_steps(values), 1.0)
    state.ess = values.shape[0] * steps * values.shape[2] / state.autocorrelation
    state.r_hat = nested_r_hat(values)
    long_enough = steps >= ENOUGH * state.autocorrelation.max()
    state.overlooked = 0.0
    if long_enough and (state.ess >= policy.ess).all() and (state.r_hat <= policy.r_hat).all():
        if state.learned:
            some = slice(None, None, 1 + z[..., 0].size // _WEIGHED)
            places, heights = (np.concatenate(kept) for kept in (state.kept_z, state.kept_log_density))
            state.overlooked = burn_in.overlooked(state, places.reshape(-1, d)[some], heights.ravel()[some])
        if state.overlooked <= OUTWEIGHS:
            state.finished, state.converged = True, True
            least, most = float(state.ess.min()), float(state.r_hat.max())
            state.why = f"after {steps} steps: smallest ESS {least:.0f}, largest nested R-hat {most:.4f}"
        elif state.again >= _MOST_AGAIN:
            state.finished = True
            state.why = (
                f"not converged after {steps} steps: the proposal makes too little of some places, by a factor of "
                f"e^{state.overlooked:.1f} (allowed e^{OUTWEIGHS:.1f}); a narrow neck or a far mode may be missing"
            )
    elif steps >= policy.most_steps:
        names = target.problem.names
        worst = names[int(np.argmin(state.ess))]
        state.finished = True
        state.why = (
            f"not converged after {steps} steps: {worst} has ESS {state.ess.min():.0f} (wanted {policy.ess:.0f}), "
            f"largest nested R-hat {state.r_hat.max():.4f} (allowed {policy.r_hat})"
        )


def _doubtful(state: State) -> bool:
    """Whether draws would be enough, were it not for places that the proposal overlooks."""
    return state.overlooked > OUTWEIGHS


def _promises_more(state: State, policy: Policy) -> bool:
    """Whether with a proposal as good as usual, learned once more, draws would be enough after fewer evaluations.

    Or the proposal is so poor that it may be about to find a mode, whose share walkers took from it when they began.
    """
    going_on = state.kept_evaluations * (policy.ess / state.ess.min() - 1.0)
    poor = state.ess.min() < _POOR * state.kept_evaluations
    return bool(poor or going_on > policy.ess / _USUAL + policy.round_draws)


_LEAST_BLOCK = 8  # steps between two looks at the stop rule, which is not to be evaluated after every one
OUTWEIGHS = float(np.log(POOL / 2))  # nats: a place worth half a pool of typical ones keeps its walker for long
_WEIGHED = 16384  # kept draws whose weights are looked at
_MOST_AGAIN = 5  # times that the proposal may be learned once more for what it overlooks
_USUAL, _POOR = 0.4, 0.2  # effective draws per kept evaluation

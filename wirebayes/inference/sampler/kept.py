"""Draws that are kept, block by block, until the stop rule ends the run."""

from dataclasses import replace

import numpy as np

from wirebayes.inference.convergence import ENOUGH
from wirebayes.inference.policy import Policy
from wirebayes.inference.sampler import burn_in, stop_rule
from wirebayes.inference.sampler.state import BurnIn, Kept, Sampling, advance, move_of
from wirebayes.inference.transform import LogPosterior


def step(target: LogPosterior, state: Sampling, policy: Policy) -> Sampling | BurnIn:
    """Keep another block of draws and look at all of them.

    Parameters
    ----------
    target : LogPosterior
    state : Sampling
    policy : Policy

    Returns
    -------
    Sampling or BurnIn
        Burn-in where the proposal is to be learned once more.
    """
    state = stop_rule.apply(target, more(target, state, policy), policy)
    if state.finished:
        return state
    return burn_in.again(target, state, policy) if stop_rule.worth_learning_again(state, policy) else state


def more(target: LogPosterior, state: Sampling, policy: Policy) -> Sampling:
    """The state with another block of draws.

    Parameters
    ----------
    target : LogPosterior
    state : Sampling
    policy : Policy
    """
    steps, kept = block_steps(state, policy), state.kept
    done = advance(target, state.walkers, move_of(state.learned, policy.ensembles, steps, frozen=True), steps)
    log_density = done.sampler.get_log_prob()
    kept = Kept(
        (*kept.z, done.sampler.get_chain()),
        (*kept.log_density, log_density),
        kept.evaluations + done.evaluations,
        kept.accepted + int(done.sampler.backend.accepted.sum()),
        kept.proposed + log_density.size,
    )
    return replace(state, walkers=done.walkers, evaluations=state.evaluations + done.evaluations, kept=kept)


def block_steps(state: Sampling, policy: Policy) -> int:
    """As many steps as the last look promises to be enough, in whole blocks, but no more than were kept so far.

    Before the first look one block: it shows whether the proposal is to be learned once more.
    """
    kept, last = state.kept.steps, state.diagnostics
    if last is None:
        return min(policy.block, policy.most_steps)
    short = max(policy.ess / last.ess.min() - 1.0, ENOUGH * last.autocorrelation.max() / kept - 1.0)
    blocks = np.ceil(np.clip(kept * short, 1, kept) / policy.block)
    return min(policy.block * int(blocks), policy.most_steps - kept)

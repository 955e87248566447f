"""Draws that are kept, block by block, until the stop rule ends the run."""

from dataclasses import replace

import numpy as np

from wirebayes.inference.convergence import ENOUGH
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.inference.policy import Policy
from wirebayes.inference.sampler import burn_in, stop_rule
from wirebayes.inference.sampler.settings import LEAST_AHEAD
from wirebayes.inference.sampler.state import BurnIn, Kept, Sampling, advance, move_of


def keep_block(target: LogPosterior, state: Sampling, policy: Policy) -> Sampling | BurnIn:
    """Keep another block of draws and look at all of them.

    Parameters
    ----------
    target : LogPosterior
    state : Sampling
    policy : Policy

    Returns
    -------
    Sampling or BurnIn
        Burn-in where the draws so far are given up.
    """
    state = stop_rule.apply(target, more(target, state, policy), policy)
    if state.finished:
        return state
    if stop_rule.worth_a_new_start(state):
        return burn_in.again(target, state, policy)
    if stop_rule.worth_refining(state, policy):
        stays = not stop_rule.slow_at_first(state, policy)
        return burn_in.refined(target, state, policy, draws_stay=stays)
    return state


def more(target: LogPosterior, state: Sampling, policy: Policy) -> Sampling:
    """The state with another block of draws.

    Parameters
    ----------
    target : LogPosterior
    state : Sampling
    policy : Policy
    """
    steps = block_steps(state, policy)
    done = advance(target, state.walkers, move_of(state.learned, policy.ensembles, steps, frozen=True), steps)
    log_density = done.sampler.get_log_prob()
    accepted = int(done.sampler.backend.accepted.sum())
    kept = state.kept.joined(
        Kept((done.sampler.get_chain(),), (log_density,), done.evaluations, accepted, log_density.size)
    )
    return replace(state, walkers=done.walkers, evaluations=state.evaluations + done.evaluations, kept=kept)


def block_steps(state: Sampling, policy: Policy) -> int:
    """As many steps as the last look promises to be enough, in whole blocks: of those kept so far an eighth to all.

    One block of a new proposal before the first look: it shows whether it is to be learned once more.
    """
    kept = state.all_kept.steps
    last = state.diagnostics
    if last is None:
        return min(policy.block, policy.most_steps - kept)
    short = max(policy.ess / last.ess.min() - 1.0, ENOUGH * last.autocorrelation.max() / kept - 1.0)
    blocks = np.ceil(np.clip(kept * short, LEAST_AHEAD * kept, kept) / policy.block)
    return min(policy.block * int(blocks), policy.most_steps - kept)

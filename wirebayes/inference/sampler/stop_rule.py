"""The stop rule: whether the kept draws are enough, too few, or not to be trusted, and in which words.

Its policy is in `wirebayes.inference.sampler.ensemble`, its statistics in `wirebayes.inference.convergence`.
"""

from dataclasses import replace

import numpy as np

from wirebayes.inference.convergence import ENOUGH, farthest_apart, nested_r_hat, slowest_autocorrelation_steps
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.inference.policy import Policy
from wirebayes.inference.sampler.overlooked import overlooked_nats
from wirebayes.inference.sampler.settings import (
    DISAGREE,
    FOR_MORE,
    LITTLE,
    MISSED,
    MOST_AGAIN,
    OUTWEIGHS,
    POOR,
    SLOW,
    USUAL,
)
from wirebayes.inference.sampler.state import Diagnostics, Kept, Sampling, by_ensemble
from wirebayes.numeric.typing import Array


def apply(target: LogPosterior, state: Sampling, policy: Policy) -> Sampling:
    """Decide whether the draws kept so far are enough.

    Parameters
    ----------
    target : LogPosterior
    state : Sampling
    policy : Policy
    """
    kept = state.all_kept
    z = by_ensemble(kept.z, policy)
    values = _judged_by(target, z)
    before = state.earlier.steps
    if before and _contradicted(state, policy, z, values):
        state = replace(state, earlier=Kept())
        values = values[:, before:]
    steps = values.shape[1]
    found = _diagnosed(values)
    beyond = of_search = 0.0
    if state.learned.trusted:
        of_kept, of_search = overlooked_nats(state.learned, *state.all_kept.flat)
        beyond = max(of_kept, of_search)
    counts = beyond if beyond > OUTWEIGHS else 0.0
    learned = replace(state.learned, overlooked=counts, lost=of_search > OUTWEIGHS)
    state = replace(state, diagnostics=found, learned=learned)
    long_enough = steps >= ENOUGH * found.autocorrelation.max()
    if long_enough and (found.ess >= policy.ess).all() and (found.r_hat <= policy.r_hat).all():
        if not learned.overlooked:
            least = float(found.ess.min())
            most = float(found.r_hat.max())
            why = f"after {steps} steps: smallest ESS {least:.0f}, largest nested R-hat {most:.4f}"
            return replace(state, finished=True, converged=True, why=why)
        if learned.again >= MOST_AGAIN or steps >= policy.most_steps:
            why = (
                f"not converged after {steps} steps: the proposal makes too little of some places, by a factor of "
                f"e^{beyond:.1f} (allowed e^{OUTWEIGHS:.1f}); a narrow neck or a far mode may be missing"
            )
            return replace(state, finished=True, why=why)
    elif steps >= policy.most_steps:
        why = f"not converged after {steps} steps: {_lacking(target, found, steps, policy)}"
        return replace(state, finished=True, why=why)
    return state


def _lacking(target: LogPosterior, found: Diagnostics, steps: int, policy: Policy) -> str:
    """What draws lack that do not converge: effective draws, agreement between ensembles, or steps."""
    names = target.problem.names
    fewest = int(np.argmin(found.ess))
    slowest = int(np.argmax(found.autocorrelation))
    r_hat = float(found.r_hat.max())
    wanted_steps = ENOUGH * found.autocorrelation[slowest]
    lacks = []
    if found.ess[fewest] < policy.ess:
        lacks.append(f"{names[fewest]} has ESS {found.ess[fewest]:.0f} (wanted {policy.ess:.0f})")
    if r_hat > policy.r_hat:
        lacks.append(f"largest nested R-hat {r_hat:.4f} (allowed {policy.r_hat})")
    if steps < wanted_steps:
        lacks.append(f"{names[slowest]} has an autocorrelation time that asks for {wanted_steps:.0f} steps")
    return ", ".join(lacks)


def _judged_by(target: LogPosterior, z: Array) -> Array:
    """Natural parameters of (ensembles, steps, walkers, d) draws, by the logarithm where they are positive."""
    theta = target.coordinates.to_natural(z.reshape(-1, z.shape[-1])).reshape(z.shape)
    # a heavy tail must not hide the walk
    return np.where(target.coordinates.log_columns, np.log(np.abs(theta) + 1e-300), theta)


def _contradicted(state: Sampling, policy: Policy, z: Array, values: Array) -> bool:
    """Whether draws of earlier proposals and those kept now, (ensembles, steps, walkers, d), are of two densities.

    A mode that had too few draws hardly shows in a mean: the share of places of which the proposal of that time made
    too little is looked at itself.
    """
    before = state.earlier.steps
    previous = state.learned.previous
    if farthest_apart(values[:, :before], values[:, before:]) > DISAGREE:
        return True
    if previous is None:
        return False
    log_proposal = previous.log_density(z.reshape(-1, z.shape[-1])).reshape(z.shape[:-1])
    over = by_ensemble(state.all_kept.log_density, policy) - log_proposal
    little = over > np.median(over) + LITTLE
    return bool(little[:, before:].mean() - little[:, :before].mean() > MISSED)


def _diagnosed(values: Array) -> Diagnostics:
    """Diagnostics of (ensembles, steps, walkers, d) draws."""
    autocorrelation = np.maximum(slowest_autocorrelation_steps(values), 1.0)
    draws = values.shape[0] * values.shape[1] * values.shape[2]
    return Diagnostics(autocorrelation, draws / autocorrelation, nested_r_hat(values))


def worth_a_new_start(state: Sampling) -> bool:
    """Whether the draws so far are to be given up: a mode may be about to be found.

    So it may be where walkers have lost what the search had found, and where the proposal is very poor, for they took a
    mode's share from it when they began.
    """
    assert state.diagnostics is not None
    known = state.learned
    least = state.diagnostics.ess.min()
    lost = known.lost and known.again < MOST_AGAIN
    poor = known.again < FOR_MORE and least < POOR * state.all_kept.evaluations
    return bool(lost or poor)


def worth_refining(state: Sampling, policy: Policy) -> bool:
    """Whether the proposal is to be learned once more from kept draws.

    For what it overlooks, or because with one as good as usual draws would be enough after fewer evaluations.
    """
    assert state.diagnostics is not None
    known = state.learned
    least = state.diagnostics.ess.min()
    going_on = state.all_kept.evaluations * (policy.ess / least - 1.0)
    wanted = policy.ess - (0.0 if slow_at_first(state, policy) else least)
    needed = known.again < MOST_AGAIN and known.overlooked > 0.0
    promising = known.again < FOR_MORE and going_on > wanted / USUAL + policy.round_draws
    return bool(known.trusted and (needed or promising))


def slow_at_first(state: Sampling, policy: Policy) -> bool:
    """Whether so few of the first block's draws are effective that walkers hardly left where they were placed."""
    assert state.diagnostics is not None
    first = state.learned.again == 0 and state.all_kept.steps <= policy.block
    return bool(first and state.diagnostics.ess.min() < SLOW * state.all_kept.evaluations)

"""The stop rule: whether the kept draws are enough, too few, or not to be trusted, and in which words.

Its policy is in `wirebayes.inference.sampler.ensemble`, its statistics in `wirebayes.inference.convergence`.
"""

from dataclasses import replace

import numpy as np

from wirebayes.inference.convergence import ENOUGH, nested_r_hat, slowest_autocorrelation_steps
from wirebayes.inference.policy import Policy
from wirebayes.inference.sampler import burn_in
from wirebayes.inference.sampler.state import POOL, Diagnostics, Sampling, by_ensemble
from wirebayes.inference.transform import LogPosterior
from wirebayes.typing import Array


def apply(target: LogPosterior, state: Sampling, policy: Policy) -> Sampling:
    """Decide whether the draws kept so far are enough.

    Parameters
    ----------
    target : LogPosterior
    state : Sampling
    policy : Policy
    """
    z = by_ensemble(state.kept.z, policy)
    steps, d = z.shape[1], z.shape[-1]
    found = _diagnosed(target, z)
    beyond = 0.0
    if state.learned.trusted:
        some = slice(None, None, 1 + z[..., 0].size // _WEIGHED)
        places, heights = (np.concatenate(kept) for kept in (state.kept.z, state.kept.log_density))
        beyond = burn_in.overlooked(state.learned, places.reshape(-1, d)[some], heights.ravel()[some])
    learned = replace(state.learned, overlooked=beyond if beyond > OUTWEIGHS else 0.0)
    state = replace(state, diagnostics=found, learned=learned)
    long_enough = steps >= ENOUGH * found.autocorrelation.max()
    if long_enough and (found.ess >= policy.ess).all() and (found.r_hat <= policy.r_hat).all():
        if not learned.overlooked:
            least, most = float(found.ess.min()), float(found.r_hat.max())
            why = f"after {steps} steps: smallest ESS {least:.0f}, largest nested R-hat {most:.4f}"
            return replace(state, finished=True, converged=True, why=why)
        if learned.again >= _MOST_AGAIN:
            why = (
                f"not converged after {steps} steps: the proposal makes too little of some places, by a factor of "
                f"e^{beyond:.1f} (allowed e^{OUTWEIGHS:.1f}); a narrow neck or a far mode may be missing"
            )
            return replace(state, finished=True, why=why)
    elif steps >= policy.most_steps:
        worst = target.problem.names[int(np.argmin(found.ess))]
        why = (
            f"not converged after {steps} steps: {worst} has ESS {found.ess.min():.0f} (wanted {policy.ess:.0f}), "
            f"largest nested R-hat {found.r_hat.max():.4f} (allowed {policy.r_hat})"
        )
        return replace(state, finished=True, why=why)
    return state


def _diagnosed(target: LogPosterior, z: Array) -> Diagnostics:
    """Diagnostics of (ensembles, steps, walkers, d) draws."""
    theta = target.coordinates.to_natural(z.reshape(-1, z.shape[-1])).reshape(z.shape)
    # Logarithms of positive parameters: a heavy tail must not hide the walk.
    values = np.where(target.coordinates.log_columns, np.log(np.abs(theta) + 1e-300), theta)
    autocorrelation = np.maximum(slowest_autocorrelation_steps(values), 1.0)
    draws = values.shape[0] * values.shape[1] * values.shape[2]
    return Diagnostics(autocorrelation, draws / autocorrelation, nested_r_hat(values))


def worth_learning_again(state: Sampling, policy: Policy) -> bool:
    """Whether the proposal is to be learned once more: for what it overlooks, or because that promises more draws."""
    again = state.learned.again
    return state.learned.overlooked > 0.0 and again < _MOST_AGAIN or again < _FOR_MORE and promises_more(state, policy)


def promises_more(state: Sampling, policy: Policy) -> bool:
    """Whether with a proposal as good as usual, learned once more, draws would be enough after fewer evaluations.

    Or the proposal is so poor that it may be about to find a mode, whose share walkers took from it when they began.
    """
    assert state.diagnostics is not None
    least = state.diagnostics.ess.min()
    going_on = state.kept.evaluations * (policy.ess / least - 1.0)
    poor = least < _POOR * state.kept.evaluations
    return bool(poor or going_on > policy.ess / USUAL + policy.round_draws)


OUTWEIGHS = float(np.log(POOL / 2))  # nats: a place worth half a pool of typical ones keeps its walker for long
_WEIGHED = 16384  # kept draws whose weights are looked at
_MOST_AGAIN = 5  # times that the proposal may be learned once more for what it overlooks
_FOR_MORE = 3  # times that it may be learned once more for more effective draws
USUAL, _POOR = 0.6, 0.2  # effective draws per kept evaluation

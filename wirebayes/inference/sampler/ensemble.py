"""The posterior by emcee: independent ensembles, a learned move, a written stop rule, exact resumption.

Policy. Burn-in (`wirebayes.inference.sampler.burn_in`) ends with a frozen proposal. Then draws are kept, block by
block, until for every parameter

- the effective sample size, from the spread of the walkers' means, is at least `Policy.ess`, for the parameter's mean
  and for the share of draws in either 5 % tail,
- the kept steps span five autocorrelation times, and
- the nested R-hat with the ensembles as super-chains is at most `Policy.r_hat`, and
- no region of the posterior is underrated by the frozen proposal so much that one place there outweighs a pool of draws
  (`overlooked.overlooked_nats`),

or until `Policy.most_steps`: then the result says *not converged*, and why.

If kept draws show that a better proposal would need fewer evaluations in total, or that it overlooks something, the
proposal is learned again from them, and walkers go on with it. Draws stay: they are of a chain whose proposal was
frozen, too. They are given up, and count as burn-in, where they are a first block of which few are effective, where
later ones disagree with them, where places that the proposal overlooks lead to a mode that the search had missed, where
walkers have lost one that it had found, and where the proposal is so poor that a mode may be about to be found.
"""

from dataclasses import dataclass
from pathlib import Path

from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.inference.optimum import Optimum
from wirebayes.inference.policy import DEFAULT, Policy, describe
from wirebayes.inference.sampler import burn_in, kept, resume
from wirebayes.inference.sampler.state import BurnIn, State, by_ensemble
from wirebayes.numeric.typing import Array
from wirebayes.progress import ShareDone


@dataclass(frozen=True)
class Chains:
    """Kept draws and how they came about.

    Attributes
    ----------
    z : (ensembles, steps, walkers, d) array
        Sampled coordinates.
    log_density : (ensembles, steps, walkers) array
    autocorrelation_steps, ess, r_hat : (d,) arrays
        Of the natural parameters: of the mean or of a 5 % tail, whichever is known worst.
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


def sample_posterior(
    target: LogPosterior,
    seed: int,
    policy: Policy = DEFAULT,
    *,
    checkpoint: Path | None = None,
    progress: ShareDone = lambda share: None,
    found: Optimum | None = None,
    near: Array | None = None,
    rough: Array | None = None,
) -> Chains:
    """Sample a posterior (see the module's policy).

    Parameters
    ----------
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

    Raises
    ------
    InputError
        The checkpoint is damaged, of another format, or of another fit.
    """
    of_fit = {"seed": seed, "policy": describe(policy), "parameters": target.problem.names}
    state: State | None = resume.load_state(checkpoint, of_fit)
    if state is None:
        state = burn_in.init(target, seed, policy, found, near, rough)
    resume.save_state(state, checkpoint, of_fit)
    while isinstance(state, BurnIn) or not state.finished:
        if isinstance(state, BurnIn):
            state = burn_in.burn_in_round(target, state, policy)
        else:
            state = kept.keep_block(target, state, policy)
        progress(_share(state, policy))
        resume.save_state(state, checkpoint, of_fit)
    diagnostics = state.diagnostics
    kept_draws = state.all_kept
    assert diagnostics is not None
    return Chains(
        z=by_ensemble(kept_draws.z, policy),
        log_density=by_ensemble(kept_draws.log_density, policy),
        autocorrelation_steps=diagnostics.autocorrelation,
        ess=diagnostics.ess,
        r_hat=diagnostics.r_hat,
        converged=state.converged,
        why=state.why,
        evaluations=state.evaluations,
        kept_evaluations=kept_draws.evaluations,
        acceptance=kept_draws.accepted / max(kept_draws.proposed, 1),
        learned=state.learned.trusted,
        modes=state.learned.modes,
    )


def _share(state: State, policy: Policy) -> float:
    """How much of the work is done, from 0 to 1; burn-in counts as a fifth."""
    if isinstance(state, BurnIn):
        return 0.2 * min(state.round / policy.rounds, 1.0)
    done = 0.0 if state.diagnostics is None else float(state.diagnostics.ess.min()) / policy.ess
    return min(1.0, 0.2 + 0.8 * done)

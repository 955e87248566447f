"""The states of a run: walkers in burn-in, walkers whose draws are kept, and how walkers move on.

A run begins with `burn_in.init`; `burn_in.burn_in_round` and `kept.keep_block` lead from a state to the next. States do
not change: only the random generator that a state carries goes on with every draw.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.random import Generator

from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.inference.policy import Policy
from wirebayes.inference.sampler.emcee_core import EmceeState, EnsembleSampler, Move
from wirebayes.inference.sampler.mixture import Mixture
from wirebayes.inference.sampler.moves import EvolutionMove, PoolMove
from wirebayes.inference.sampler.points import WeightedPoints
from wirebayes.inference.sampler.proposal import Proposal
from wirebayes.inference.sampler.settings import POOL, POOL_IN_BURN_IN
from wirebayes.numeric.typing import Array


@dataclass(frozen=True)
class Walkers:
    """All walkers, one ensemble after the other.

    Attributes
    ----------
    positions, values : arrays
        Sampled coordinates (n, d) and log densities (n,).
    random
        State of their random generator.
    """

    positions: Array
    values: Array
    random: Any


@dataclass(frozen=True)
class Learned:
    """What a run has learned of the posterior, besides where its walkers are.

    Attributes
    ----------
    proposal, start : Proposal or Mixture
        What the learned move draws from, and what was known before any walk.
    modes : int
        Distinct modes found by the search.
    witness : tuple of (n, d) and (n,) arrays, optional
        Places that the search left, and their log densities.
    trusted : bool
        False once the learned move was given up.
    acceptance : float
        Of the proposal, as its last draws promise.
    walks : int
        So often walkers had to look further.
    again : int
        So often the proposal was learned again, from kept draws.
    overlooked : float
        The larger of what `overlooked.overlooked_nats` said at the last look, where that was too much.
    lost : bool
        Whether it was too much of what the search left: a mode that walkers have lost.
    previous : Proposal or Mixture, optional
        What the learned move drew from before, where draws of that time still count.
    """

    proposal: Mixture | Proposal
    start: Mixture
    modes: int
    witness: tuple[Array, Array] | None = None
    trusted: bool = True
    acceptance: float = 0.0
    walks: int = 0
    again: int = 0
    overlooked: float = 0.0
    lost: bool = False
    previous: Mixture | Proposal | None = None


@dataclass(frozen=True)
class BurnIn:
    """A run that still learns.

    Attributes
    ----------
    walkers : Walkers
    learned : Learned
    generator : numpy Generator
    evaluations : int
        Of the likelihood, so far.
    round : int
    walk : tuple of arrays, optional
        Places that the last walk came by, their log densities, and the log density walked.
    seen : tuple of Points, optional
        Hot and cold points that the proposal was last fitted to.
    drawn : Points, optional
        Places of all rounds, by posterior mass, with their log densities as one more column.
    """

    walkers: Walkers
    learned: Learned
    generator: Generator
    evaluations: int
    round: int = 0
    walk: tuple[Array, Array, Array] | None = None
    seen: tuple[WeightedPoints, WeightedPoints] | None = None
    drawn: WeightedPoints | None = None

    def knowing(self, **changes: Any) -> "BurnIn":
        """The state with something else learned."""
        return replace(self, learned=replace(self.learned, **changes))


@dataclass(frozen=True)
class Kept:
    """Draws that count.

    Attributes
    ----------
    z, log_density : tuple of arrays
        Blocks (steps, n, d) and (steps, n).
    evaluations, accepted, proposed : int
        Of the kept steps alone.
    """

    z: tuple[Array, ...] = ()
    log_density: tuple[Array, ...] = ()
    evaluations: int = 0
    accepted: int = 0
    proposed: int = 0

    @property
    def steps(self) -> int:
        return sum(len(block) for block in self.z)

    @property
    def flat(self) -> tuple[Array, Array]:
        """(n, d) all draws, and (n,) their log densities."""
        z = np.concatenate(self.z)
        return z.reshape(-1, z.shape[-1]), np.concatenate(self.log_density).ravel()

    def joined(self, later: "Kept") -> "Kept":
        """These draws and later ones of the same walkers."""
        return Kept(
            self.z + later.z,
            self.log_density + later.log_density,
            self.evaluations + later.evaluations,
            self.accepted + later.accepted,
            self.proposed + later.proposed,
        )


@dataclass(frozen=True)
class Diagnostics:
    """(d,) autocorrelation in steps, effective sample size and nested R-hat of the kept draws.

    The first two are those of the mean or of a 5 % tail, whichever is known worst.
    """

    autocorrelation: Array
    ess: Array
    r_hat: Array


@dataclass(frozen=True)
class Sampling:
    """A run whose proposal is frozen and whose draws are kept.

    Attributes
    ----------
    walkers, learned, generator, evaluations
        See `BurnIn`.
    kept : Kept
        Draws of the proposal as it is.
    diagnostics : Diagnostics or None
        Of the last look; None before the first.
    finished, converged : bool
    why : str
        The stop rule's words.
    earlier : Kept
        Draws of the proposals before, which count no less.
    """

    walkers: Walkers
    learned: Learned
    generator: Generator
    evaluations: int
    kept: Kept = field(default_factory=Kept)
    diagnostics: Diagnostics | None = None
    finished: bool = False
    converged: bool = False
    why: str = ""
    earlier: Kept = field(default_factory=Kept)

    @property
    def all_kept(self) -> Kept:
        """The draws of all proposals."""
        return self.earlier.joined(self.kept)


State = BurnIn | Sampling


@dataclass(frozen=True)
class AdvancedWalkers:
    """What walkers did: where they are now, emcee's record of the way, and the evaluations it took."""

    walkers: Walkers
    sampler: EnsembleSampler
    evaluations: int


def advance(target: LogPosterior, walkers: Walkers, move: Move, steps: int, power: float = 1.0) -> AdvancedWalkers:
    """Run walkers on.

    All ensembles walk side by side: a batch costs little more than one of its parts.

    Parameters
    ----------
    move : emcee Move
    power : float
        The density is taken to this power; below one, walls between modes are lower.
    """

    def density(z: Array) -> Array:
        return power * target(z)

    sampler = EnsembleSampler(*walkers.positions.shape, density, moves=move, vectorize=True)
    sampler.log_prob_fn = density  # without emcee's wrapper, which prints all points when an exception passes through
    before = target.evaluations
    start = EmceeState(walkers.positions, log_prob=power * walkers.values, random_state=walkers.random)
    end = sampler.run_mcmc(start, steps, skip_initial_state_check=True)
    now = Walkers(end.coords, end.log_prob / power, sampler.random_state)
    return AdvancedWalkers(now, sampler, target.evaluations - before)


def move_of(learned: Learned, ensembles: int, steps: int, *, frozen: bool) -> Move:
    """The move by what was learned: pools of the proposal's draws, or differential evolution once it was given up.

    Parameters
    ----------
    ensembles : int
        Number of independent ensembles among the walkers.
    steps : int
        That the walkers will go.
    frozen : bool
        The proposal no longer changes, so that pools may be large.
    """
    if not learned.trusted:
        return EvolutionMove(ensembles)
    straight = learned.proposal.straight if isinstance(learned.proposal, Proposal) else None
    return PoolMove(
        learned.proposal,
        EvolutionMove(ensembles, straight),
        steps,
        POOL if frozen else POOL_IN_BURN_IN,
    )


def by_ensemble(blocks: Sequence[Array], policy: Policy) -> Array:
    """(ensembles, steps, walkers, ...) of blocks (steps, n, ...)."""
    every = np.concatenate(blocks)
    apart = every.reshape(len(every), policy.ensembles, policy.walkers, *every.shape[2:])
    return np.ascontiguousarray(np.moveaxis(apart, 1, 0))

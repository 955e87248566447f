"""Walkers: their state between two stretches of work, which a file can hold, and the stretches themselves."""

import pickle
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import emcee
import numpy as np
from numpy.typing import NDArray

from wirebayes.bayes.coordinates import Target
from wirebayes.bayes.mixture import Mixture
from wirebayes.bayes.moves import IndependenceMove, StraightEvolutionMove
from wirebayes.bayes.proposal import Proposal

Array = NDArray[Any]


@dataclass
class State:
    """Everything a resumed run needs, in one pickled file of our own making.

    Attributes
    ----------
    positions, values, randoms : list
        Of each ensemble's walkers: sampled coordinates (w, d), log densities (w,), state of the random generator. In
        burn-in there is one ensemble of all.
    proposal, start : Proposal or Mixture
        What the learned move draws from, and what was known before any walk.
    acceptance : float
        Of the proposal, as its last draws promise.
    walks : int
        So often walkers had to look further.
    walk, seen
        Places that the last walk came by, and what the proposal was last fitted to.
    """

    positions: list[Array]
    values: list[Array]
    randoms: list[Any]
    proposal: Mixture | Proposal
    start: Mixture
    generator: np.random.Generator
    modes: int
    evaluations: int
    round: int = 0
    frozen: bool = False
    learned: bool = True
    acceptance: float = 0.0
    walks: int = 0
    walk: Any = None
    seen: Any = None
    kept_z: Any = None
    kept_log_density: Any = None
    kept_evaluations: int = 0
    accepted: int = 0
    proposed: int = 0
    autocorrelation: Any = None
    ess: Any = None
    r_hat: Any = None
    finished: bool = False
    converged: bool = False
    why: str = ""

    @staticmethod
    def load(path: Path | None) -> "State | None":
        if path is None or not path.exists():
            return None
        with path.open("rb") as stream:
            state: State = pickle.load(stream)
        return state

    def save(self, path: Path | None) -> None:
        if path is not None:
            part = path.with_name(path.name + ".part")
            part.write_bytes(pickle.dumps(self))
            part.replace(path)


def advance(target: Target, state: State, i: int, steps: int, power: float = 1.0) -> tuple[Any, int]:
    """Run one ensemble on, on the density to a power; its position and random state are left in `state`.

    Returns
    -------
    sampler : emcee.EnsembleSampler
    evaluations : int
    """

    def density(z: Array) -> Array:
        return power * target(z)

    sampler = emcee.EnsembleSampler(*state.positions[i].shape, density, moves=_moves(state), vectorize=True)
    before = target.evaluations
    start = emcee.State(state.positions[i], log_prob=power * state.values[i], random_state=state.randoms[i])
    end = sampler.run_mcmc(start, steps, skip_initial_state_check=True)
    state.positions[i], state.values[i], state.randoms[i] = end.coords, end.log_prob / power, sampler.random_state
    used = target.evaluations - before
    state.evaluations += used
    return sampler, used


def _moves(state: State) -> list[tuple[Any, float]]:
    evolution = [(emcee.moves.DEMove(), 0.8), (emcee.moves.DEMove(gamma0=1.0), 0.2)]
    if not state.learned:
        return evolution
    share = _EVOLUTION if state.frozen else _EXPLORATION
    walk = StraightEvolutionMove(state.proposal.straight) if isinstance(state.proposal, Proposal) else evolution[0][0]
    return [(IndependenceMove(state.proposal), 1.0 - share), (walk, share)]


_EVOLUTION = 0.05  # share of steps that do not trust the proposal
_EXPLORATION = 0.4  # the same in burn-in, which looks for what the proposal leaves out

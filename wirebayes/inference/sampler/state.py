"""The state of the walkers, which can be written to a file, and the stretches of the run between two states."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import emcee
import numpy as np
from emcee.moves.move import Move
from numpy.typing import NDArray

from wirebayes.inference.sampler import checkpoint
from wirebayes.inference.sampler.mixture import Mixture
from wirebayes.inference.sampler.moves import EvolutionMove, PoolMove
from wirebayes.inference.sampler.proposal import Proposal
from wirebayes.inference.transform import LogPosterior
from wirebayes.io.run_folder import stored_results

Array = NDArray[Any]


@dataclass
class State:
    """Everything a resumed run needs (the file: `wirebayes.inference.sampler.checkpoint`).

    Attributes
    ----------
    positions, values : arrays
        Sampled coordinates (n, d) and log densities (n,) of all walkers, one ensemble after the other.
    random
        State of their random generator.
    proposal, start : Proposal or Mixture
        What the learned move draws from, and what was known before any walk.
    acceptance : float
        Of the proposal, as its last draws promise.
    walks : int
        So often walkers had to look further.
    walk, seen
        Places that the last walk came by, and what the proposal was last fitted to.
    again : bool
        The proposal was learned a second time, from draws that were to be kept.
    kept_z, kept_log_density : list of arrays
        Blocks (steps, n, d) and (steps, n).
    overlooked : float
        What `wirebayes.inference.sampler.burn_in.overlooked` said at the last look, where all else was enough.
    """

    positions: Array
    values: Array
    random: Any
    proposal: Mixture | Proposal
    start: Mixture
    generator: np.random.Generator
    modes: int
    evaluations: int
    round: int = 0
    frozen: bool = False
    learned: bool = True
    again: int = 0
    witness: Any = None
    acceptance: float = 0.0
    walks: int = 0
    walk: Any = None
    seen: Any = None
    kept_z: list[Array] = field(default_factory=list)
    kept_log_density: list[Array] = field(default_factory=list)
    kept_evaluations: int = 0
    accepted: int = 0
    proposed: int = 0
    autocorrelation: Any = None
    ess: Any = None
    r_hat: Any = None
    overlooked: float = 0.0
    finished: bool = False
    converged: bool = False
    why: str = ""

    @staticmethod
    def load(path: Path | None, of_fit: Mapping[str, Any]) -> "State | None":
        """The state in a resume file; None where there is none (errors: `checkpoint.read`)."""
        stored = None if path is None else checkpoint.read(path, of_fit)
        if path is None or stored is None:
            return None
        with stored_results(path, checkpoint.INSTEAD):
            return State.from_stored(*stored)

    def save(self, path: Path | None, of_fit: Mapping[str, Any]) -> None:
        """Write the resume file whole."""
        if path is not None:
            checkpoint.write(path, of_fit, self.to_values(), self.to_arrays())

    def to_values(self) -> dict[str, Any]:
        """Everything but the arrays, in JSON's own types."""
        values = {each.name: getattr(self, each.name) for each in fields(self) if each.type in (bool, int, float, str)}
        return values | {"generator": self.generator.bit_generator.state, "random": self.random[2:]}

    def to_arrays(self) -> dict[str, Any]:
        """Arrays by name, those of parts under the part's name; absent ones are None."""
        arrays = {name: getattr(self, name) for name in _ARRAYS}
        arrays |= {name: _numbered(getattr(self, name)) for name in _TUPLES}
        arrays |= {name: np.concatenate(kept) if (kept := getattr(self, name)) else None for name in _KEPT}
        learned = "proposal" if isinstance(self.proposal, Proposal) else "mixture"
        arrays |= {learned: self.proposal.to_arrays(), "start": self.start.to_arrays(), "random": self.random[1]}
        return arrays

    @staticmethod
    def from_stored(values: Mapping[str, Any], arrays: Mapping[str, Any]) -> "State":
        """The state that gave these values and arrays."""
        start = Mixture.from_arrays(arrays["start"])
        if "proposal" in arrays:
            learned: Mixture | Proposal = Proposal.from_arrays(arrays["proposal"])
        else:
            learned = Mixture.from_arrays(arrays["mixture"])
        generator = np.random.default_rng()
        generator.bit_generator.state = values["generator"]
        parts: dict[str, Any] = {name: arrays.get(name) for name in _ARRAYS}
        parts |= {name: tuple(arrays[name].values()) if name in arrays else None for name in _TUPLES}
        parts |= {name: [arrays[name]] if name in arrays else [] for name in _KEPT}
        parts |= {"random": ("MT19937", arrays["random"], *values["random"]), "generator": generator}
        return State(**{**values, **parts, "proposal": learned, "start": start})


_ARRAYS = ("positions", "values", "autocorrelation", "ess", "r_hat")
_TUPLES = ("witness", "walk", "seen")
_KEPT = ("kept_z", "kept_log_density")


def _numbered(arrays: tuple[Array, ...] | None) -> dict[str, Array] | None:
    return None if arrays is None else {str(i): array for i, array in enumerate(arrays)}


def advance(target: LogPosterior, state: State, steps: int, ensembles: int = 1, power: float = 1.0) -> tuple[Any, int]:
    """Run the walkers on.

    All ensembles walk side by side: a batch costs little more than one of its parts.

    Parameters
    ----------
    target : LogPosterior
    state : State
        Its walkers, their log densities, random state and count of evaluations are changed in place.
    steps : int
    ensembles : int
        Number of independent ensembles among the walkers.
    power : float
        The density is taken to this power; below one, walls between modes are lower.

    Returns
    -------
    sampler : emcee.EnsembleSampler
        Holds the chain.
    evaluations : int
    """

    def density(z: Array) -> Array:
        return power * target(z)

    move = _move(state, ensembles, steps)
    sampler = emcee.EnsembleSampler(*state.positions.shape, density, moves=move, vectorize=True)
    sampler.log_prob_fn = density  # without emcee's wrapper, which prints all points when an exception passes through
    before = target.evaluations
    start = emcee.State(state.positions, log_prob=power * state.values, random_state=state.random)
    end = sampler.run_mcmc(start, steps, skip_initial_state_check=True)
    state.positions, state.values, state.random = end.coords, end.log_prob / power, sampler.random_state
    used = target.evaluations - before
    state.evaluations += used
    return sampler, used


def _move(state: State, ensembles: int, steps: int) -> Move:
    if not state.learned:
        return EvolutionMove(ensembles)
    straight = state.proposal.straight if isinstance(state.proposal, Proposal) else None
    return PoolMove(state.proposal, EvolutionMove(ensembles, straight), steps, POOL if state.frozen else _EXPLORING)


POOL = 64  # steps of which one does not trust the proposal; more gain little
_EXPLORING = 3  # the same in burn-in, which looks for what the proposal leaves out

"""States of a run as plain values and named arrays, which a resume file holds (`checkpoint` knows the file)."""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from wirebayes.inference.sampler import checkpoint
from wirebayes.inference.sampler.mixture import Mixture
from wirebayes.inference.sampler.points import WeightedPoints
from wirebayes.inference.sampler.proposal import Proposal
from wirebayes.inference.sampler.state import BurnIn, Diagnostics, Kept, Learned, Sampling, State, Walkers
from wirebayes.io.run_folder import stored_results
from wirebayes.numeric.typing import Array

_PLAIN_LEARNED = ("modes", "trusted", "acceptance", "walks", "again", "overlooked", "lost")
_PLAIN_KEPT = ("evaluations", "accepted", "proposed")
_KEPT, _BLOCKS = ("kept", "earlier"), ("z", "log_density")
_PLAIN_SAMPLING = ("finished", "converged", "why")


def load_state(path: Path | None, of_fit: Mapping[str, Any]) -> State | None:
    """The state in a resume file; None where there is none (errors: `checkpoint.read_checkpoint`)."""
    stored = None if path is None else checkpoint.read_checkpoint(path, of_fit)
    if path is None or stored is None:
        return None
    with stored_results(path, checkpoint.INSTEAD):
        return from_stored(*stored)


def save_state(state: State, path: Path | None, of_fit: Mapping[str, Any]) -> None:
    """Write the resume file whole.

    Parameters
    ----------
    state : BurnIn or Sampling
    path : Path or None
        Nothing is written without one.
    of_fit : mapping
        What distinguishes this fit from others.
    """
    if path is not None:
        checkpoint.write_checkpoint(path, of_fit, to_values(state), to_arrays(state))


def to_values(state: State) -> dict[str, Any]:
    """Everything but the arrays, in JSON's own types."""
    out: dict[str, Any] = {
        "stage": "burn-in" if isinstance(state, BurnIn) else "sampling",
        "evaluations": state.evaluations,
        "generator": state.generator.bit_generator.state,
        "random": list(state.walkers.random[2:]),
        "learned": {name: getattr(state.learned, name) for name in _PLAIN_LEARNED},
    }
    if isinstance(state, BurnIn):
        out["round"] = state.round
        return out
    for which in _KEPT:
        kept = getattr(state, which)
        out[which] = {name: getattr(kept, name) for name in _PLAIN_KEPT}
    out |= {name: getattr(state, name) for name in _PLAIN_SAMPLING}
    return out


def to_arrays(state: State) -> dict[str, Any]:
    """Arrays by name, those of parts under the part's name; absent ones are None."""
    walkers = state.walkers
    learned = state.learned
    out: dict[str, Any] = {
        "positions": walkers.positions,
        "values": walkers.values,
        "random": walkers.random[1],
        "proposal": learned.proposal.to_arrays(),
        "previous": None if learned.previous is None else learned.previous.to_arrays(),
        "start": learned.start.to_arrays(),
        "witness": _numbered(learned.witness),
    }
    if isinstance(state, BurnIn):
        out["walk"] = _numbered(state.walk)
        out["seen"] = {}
        if state.seen is not None:
            hot, cold = state.seen
            out["seen"] = {"hot": asdict(hot), "cold": asdict(cold)}
        if state.drawn is not None:
            out["drawn"] = asdict(state.drawn)
        return out
    for which in _KEPT:
        out[which] = _blocks(getattr(state, which))
    if state.diagnostics:
        out |= asdict(state.diagnostics)
    return out


def _points(arrays: Mapping[str, Any]) -> WeightedPoints:
    return WeightedPoints(**arrays)


def from_stored(values: Mapping[str, Any], arrays: Mapping[str, Any]) -> State:
    """The state that gave these values and arrays."""
    learned = Learned(
        proposal=_drawn_from(arrays["proposal"]),
        previous=_drawn_from(arrays["previous"]) if "previous" in arrays else None,
        start=Mixture.from_arrays(arrays["start"]),
        witness=_tuple(arrays, "witness"),
        **values["learned"],
    )
    generator = np.random.default_rng()
    generator.bit_generator.state = values["generator"]
    random = ("MT19937", arrays["random"], *values["random"])
    walkers = Walkers(arrays["positions"], arrays["values"], random)
    run = walkers, learned, generator, values["evaluations"]
    if values["stage"] == "burn-in":
        seen = None
        if "seen" in arrays:
            seen = _points(arrays["seen"]["hot"]), _points(arrays["seen"]["cold"])
        drawn = _points(arrays["drawn"]) if "drawn" in arrays else None
        return BurnIn(*run, values["round"], _tuple(arrays, "walk"), seen, drawn)
    kept, earlier = (_kept(values[which], arrays.get(which, {})) for which in _KEPT)
    looked = None
    if "ess" in arrays:
        looked = Diagnostics(arrays["autocorrelation"], arrays["ess"], arrays["r_hat"])
    said = {name: values[name] for name in _PLAIN_SAMPLING}
    return Sampling(*run, kept, looked, earlier=earlier, **said)


def _drawn_from(arrays: Mapping[str, Any]) -> Proposal | Mixture:
    return Proposal.from_arrays(arrays) if "straight" in arrays else Mixture.from_arrays(arrays)


def _blocks(kept: Kept) -> dict[str, Array]:
    return {name: np.concatenate(blocks) for name in _BLOCKS if (blocks := getattr(kept, name))}


def _kept(counted: Mapping[str, int], blocks: Mapping[str, Array]) -> Kept:
    z, log_density = ((blocks[name],) if name in blocks else () for name in _BLOCKS)
    return Kept(z, log_density, **counted)


def _numbered(arrays: tuple[Any, ...] | None) -> dict[str, Any] | None:
    return None if arrays is None else {str(i): array for i, array in enumerate(arrays)}


def _tuple(arrays: Mapping[str, Any], name: str) -> Any:
    return tuple(arrays[name].values()) if name in arrays else None

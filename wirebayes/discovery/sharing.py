"""One instrument, several materials: what the samples of one material say about an amplitude counts for the others too.

Materials share no other parameter, so the likelihood of a shared amplitude is the product of theirs, and for one of
them the others act as a prior: normal, or log-normal for an amplitude that cannot change sign.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from wirebayes.inference.laplace_fit import LaplaceFit, fitted
from wirebayes.wire.effect import Effect

_CLEAR = 2.0  # standard deviations from its edge from which on a one-sided amplitude is nearly log-normal


def informed(blocks: Sequence[LaplaceFit], effects: Mapping[int, Effect], rng: np.random.Generator) -> list[LaplaceFit]:
    """Blocks refitted, each with the others' knowledge of an amplitude that they share as its prior.

    Parameters
    ----------
    blocks : sequence of LaplaceFit
    effects : mapping of int to Effect
        The form of the shared effect in each block that has it; blocks without it stay as they are.
    rng : numpy Generator
    """
    known = {b: _known(blocks[b], effect) for b, effect in effects.items()}
    out = list(blocks)
    for b, effect in effects.items():
        weight = np.array([1.0 / sd**2 for other, (_, sd) in known.items() if other != b])
        means = np.array([mean for other, (mean, _) in known.items() if other != b])
        table = _table(effect, float(weight @ means / weight.sum()), float(weight.sum() ** -0.5))
        if table is not None:
            with_prior = [replace(e, priors=e.priors | {effect.columns()[0]: table}) for e in blocks[b].experiments]
            near = blocks[b].target.coordinates.to_natural(blocks[b].modes.z[:1])[0]
            block = blocks[b]
            out[b] = fitted(with_prior, block.effects, block.law, block.history, rng, near, scales=block.scales)
    return out


def _known(block: LaplaceFit, effect: Effect) -> tuple[float, float]:
    """Mean and standard deviation of an amplitude, by the normal approximation in sampled coordinates."""
    low, mean, high = block.along(effect, (-1.0, 0.0, 1.0))
    return float(mean), float(0.5 * (high - low))


def _table(effect: Effect, mean: float, sd: float) -> dict[str, Any] | None:
    """The prior as an experiment file would write it; None where a one-sided amplitude is hardly known."""
    main = effect.amplitudes[0]
    if main.prior.support()[0] < main.neutral:
        return {"distribution": "normal", "mean": mean, "sd": sd}
    if mean < _CLEAR * sd:
        return None
    return {"distribution": "log-normal", "median": mean, "sd_log": sd / mean}

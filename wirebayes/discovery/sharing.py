"""One instrument, several materials: what the samples of one material say about an amplitude counts for the others too.

Materials share nothing else but the amplitude's shape constants, so the likelihood of what they share is the product of
theirs, and for one of them the others act as a prior: normal, or log-normal for what cannot change sign.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from wirebayes.inference.laplace_fit import LaplaceFit, fitted
from wirebayes.numeric.typing import Array, Function
from wirebayes.wire.effect import Amplitude, Effect

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
    out = list(blocks)
    for b, effect in effects.items():
        others = [(blocks[other], form) for other, form in effects.items() if other != b]
        priors = _priors(effect, others)
        if priors:
            out[b] = _with_priors(blocks[b], priors, rng)
    return out


def _priors(effect: Effect, others: Sequence[tuple[LaplaceFit, Effect]]) -> dict[str, dict[str, Any]]:
    """What other blocks know of the parameters of an effect that they share."""
    priors = {}
    for column in (effect.amplitude_column, *effect.common_shapes()):
        table = _told(others, column)
        if table is not None:
            priors[column] = table
    return priors


def _with_priors(block: LaplaceFit, priors: dict[str, dict[str, Any]], rng: np.random.Generator) -> LaplaceFit:
    """The block refitted with priors in its experiments."""
    told = frozenset(priors)
    experiments = [replace(e, priors=e.priors | priors, told=e.told | told) for e in block.experiments]
    near = block.theta[0]
    return fitted(experiments, block.effects, block.spec, rng, near, scales=block.scales)


def _told(blocks: Sequence[tuple[LaplaceFit, Effect]], column: str) -> dict[str, Any] | None:
    """What some blocks together know of a parameter of an effect, as a prior; None where that is hardly anything."""
    effect = blocks[0][1]
    number = effect.columns().index(column)
    known = np.array([_known(block, form, number) for block, form in blocks])
    weight = known[:, 1] ** -2.0
    mean = float(weight @ known[:, 0] / weight.sum())
    return _table(effect.amplitudes[number], mean, float(weight.sum() ** -0.5))


def _known(block: LaplaceFit, effect: Effect, number: int = 0) -> tuple[float, float]:
    """Mean and standard deviation of one of an effect's parameters, by the normal approximation as sampled."""
    low, mean, high = block.along(effect, (-1.0, 0.0, 1.0), number)
    return float(mean), float(0.5 * (high - low))


def _table(amplitude: Amplitude, mean: float, sd: float) -> dict[str, Any] | None:
    """The prior as an experiment file would write it; None where what cannot change sign is hardly known."""
    if not amplitude.is_shape and amplitude.prior.support()[0] < amplitude.neutral:
        return {"distribution": "normal", "mean": mean, "sd": sd}
    if mean < _CLEAR * sd:
        return None
    return {"distribution": "log-normal", "median": mean, "sd_log": sd / mean}


def alike(means: Array, sds: Array, log_prior: Function) -> Array:
    """(n,) log of how much likelier readings are where blocks have one value of a constant than where each has its own.

    That is the integral of the product of the blocks' posteriors, which are normal, over the prior to the power of
    their number less one; the prior is taken where that product has its top. Blocks that disagree speak against one
    value, and those that agree save the price of a value each.

    Parameters
    ----------
    means, sds : (b, n) arrays
        What each block says of the constant by itself.
    log_prior : function of an array
        The log density of the constant.
    """
    weight = sds**-2.0
    together = weight.sum(axis=0)
    middle = (weight * means).sum(axis=0) / together
    apart = (weight * (means - middle) ** 2).sum(axis=0)
    others = len(means) - 1
    overlap = 0.5 * (np.log(weight).sum(axis=0) - np.log(together) - others * np.log(2.0 * np.pi) - apart)
    return overlap - others * log_prior(middle)

"""What an effect, or a family of effects, gains by leaving out one hold at a time."""

from collections.abc import Sequence

import numpy as np
from scipy.special import logsumexp

from wirebayes.discovery.families import Family
from wirebayes.discovery.fitted_sets import Fits, FittedSet, Key
from wirebayes.discovery.held_out import LeftOut
from wirebayes.discovery.model_space import ModelPosterior
from wirebayes.discovery.settings import LEAST_ALTERNATIVE
from wirebayes.inference.laplace_fit import LaplaceFit
from wirebayes.numeric.typing import Array


def last_gain(candidate: FittedSet, found: ModelPosterior, fits: Fits, left_out: LeftOut) -> float:
    """What the last effect of a set gains: its family, or the effect alone where the family has another in the set.

    Parameters
    ----------
    candidate : FittedSet
        The set.
    found : ModelPosterior
        Weights of the sets, and the families of their names.
    fits : Fits
        Blocks with other sets.
    left_out : LeftOut
        Scores them.
    """
    *earlier, last = candidate.effects.names
    family = found.family(last)
    if any(name in family for name in earlier):
        return name_gain(candidate, last, fits, left_out)
    return family_gain(candidate, family, found, fits, left_out)


def name_gain(candidate: FittedSet, name: str, fits: Fits, left_out: LeftOut) -> float:
    """What an effect of a set gains against the set without it.

    Parameters
    ----------
    candidate : FittedSet
        The set.
    name : str
        Of the effect.
    fits : Fits
        Blocks with other sets.
    left_out : LeftOut
        Scores them.
    """
    without = fits.of(candidate.effects.key - {name})
    on = _acting(candidate, (name,))
    scored = [candidate.blocks[b] for b in on]
    scored += [without[b] for b in on]
    elpd = [holds.sum() for holds in left_out.of(scored)]
    gained = np.sum(elpd[: len(on)]) - np.sum(elpd[len(on) :])
    return float(gained)


def family_gain(candidate: FittedSet, family: Family, found: ModelPosterior, fits: Fits, left_out: LeftOut) -> float:
    """What the mixture over a family's members gains beside the other effects of a set, against these alone.

    Parameters
    ----------
    candidate : FittedSet
        The set.
    family : tuple of str
    found : ModelPosterior
        Weights of the sets, and the families of their names.
    fits : Fits
        Blocks with other sets.
    left_out : LeftOut
        Scores them.
    """
    others = frozenset(name for name in candidate.effects.names if name not in family)
    weights = _weights_of_members(family, others, found)
    mixture = _worth_scoring(weights, candidate, fits)
    models = [candidate.blocks if key == candidate.effects.key else fits.of(key) for key in mixture]
    models.append(fits.of(others))
    elpd = _elpd_of_each(models, _acting(candidate, family), left_out)
    log_weight = np.log(np.maximum([weights[key] for key in mixture], 1e-300))
    with_family = mixed(log_weight, elpd[:-1])
    without = elpd[-1]
    return float((with_family - without).sum())


def _weights_of_members(family: Family, others: Key, found: ModelPosterior) -> dict[Key, float]:
    """Weights of the sets that hold members of a family beside the same other effects."""
    weights = {}
    for key, weight in found.weights.items():
        if key > others and all(name in family for name in key - others):
            weights[key] = weight
    return weights


def _worth_scoring(weights: dict[Key, float], candidate: FittedSet, fits: Fits) -> list[Key]:
    """The candidate, and the other sets that are fitted and whose weight could change the mixture."""
    least = LEAST_ALTERNATIVE * sum(weights.values())
    own = candidate.effects.key
    return [key for key, weight in weights.items() if key == own or (weight >= least and fits.knows(key))]


def _elpd_of_each(models: Sequence[Sequence[LaplaceFit]], on: Sequence[int], left_out: LeftOut) -> Array:
    """(models, H) log density of each left-out hold of some blocks by each model."""
    scored = [model[b] for model in models for b in on]
    elpd = left_out.of(scored)
    first_of_each = range(0, len(scored), len(on))
    return np.array([np.concatenate(elpd[first : first + len(on)]) for first in first_of_each])


def mixed(log_weight: Array, elpd: Array) -> Array:
    """(H,) log density of left-out holds by a mixture of models, whose weights forget each hold in turn.

    Of models with weight w_m given all holds, those given all but one are proportional to w_m / p_m, so that the
    mixture predicts Σ w_m / Σ (w_m / p_m).

    Parameters
    ----------
    log_weight : (m,) array
        Of each model, given all holds.
    elpd : (m, H) array
        Log density of each left-out hold by each model.
    """
    return logsumexp(log_weight) - logsumexp(log_weight[:, None] - elpd, axis=0)


def _acting(candidate: FittedSet, names: Sequence[str]) -> list[int]:
    """Blocks on which any of some effects of a set acts."""
    return sorted({b for a in candidate.accepted if a.name in names for b in a.blocks})

"""What an effect, or a family of effects, gains by leaving out one hold at a time."""

from collections.abc import Sequence

import numpy as np
from scipy.special import logsumexp

from wirebayes.discovery.families import Family
from wirebayes.discovery.fitted_sets import Fits, FittedSet
from wirebayes.discovery.held_out import LeftOut
from wirebayes.discovery.model_space import ModelPosterior
from wirebayes.discovery.settings import LEAST_ALTERNATIVE
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
    on = _acting(candidate, (name,))
    without = fits.of(candidate.effects.key - {name})
    elpd = left_out.of([version[b] for version in (candidate.blocks, without) for b in on])
    return float(np.sum([v.sum() for v in elpd[: len(on)]]) - np.sum([v.sum() for v in elpd[len(on) :]]))


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
    rest = frozenset(name for name in candidate.effects.names if name not in family)
    on = _acting(candidate, family)
    members = {k: w for k, w in found.weights.items() if k > rest and all(name in family for name in k - rest)}
    least = LEAST_ALTERNATIVE * sum(members.values())
    kept = [k for k, w in members.items() if k == candidate.effects.key or (w >= least and fits.knows(k))]
    versions = [candidate.blocks if k == candidate.effects.key else fits.of(k) for k in kept]
    elpd = left_out.of([version[b] for version in (*versions, fits.of(rest)) for b in on])
    each = np.array([np.concatenate(elpd[i * len(on) : (i + 1) * len(on)]) for i in range(len(versions) + 1)])
    log_weight = np.log(np.maximum([members[k] for k in kept], 1e-300))
    return float((mixed(log_weight, each[:-1]) - each[-1]).sum())


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

"""The models between which the readings do not decide."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from wirebayes.discovery.fitted_sets import Fits, Key
from wirebayes.discovery.model_space import ModelPosterior
from wirebayes.discovery.settings import MIXED
from wirebayes.discovery.verdict import Decision
from wirebayes.inference.laplace_fit import LaplaceFit


@dataclass(frozen=True)
class Alternative:
    """One of several models between which the readings do not decide.

    Attributes
    ----------
    block : LaplaceFit
    remains : bool
        Whether something unknown remains beside its effects.
    probability : float
    """

    block: LaplaceFit
    remains: bool
    probability: float


def alternatives(
    decision: Decision, fits: Fits, i: int, final: LaplaceFit, undecided: Sequence[str], remains: bool
) -> list[Alternative]:
    """The final model of block `i` and the others that share the probability with it.

    Of these as many as hold `MIXED` of it together, the most probable first.

    Parameters
    ----------
    decision : Decision
    fits : Fits
    i : int
        Number of the block among the materials.
    final : LaplaceFit
        The block's final model.
    undecided : sequence of str
        Names between which the verdict is undecided: the others differ from the final model in these alone.
    remains : bool
        Whether a discrepancy stands beside the effects.

    Returns
    -------
    list of Alternative
        The final model first, probabilities summing to one; empty where it stands alone.
    """
    names = frozenset(effect.name for effect in final.effects)
    weights = _weights_of_acting(decision.posterior, fits, i, names, undecided)
    others = _others(weights, names)
    keys = [names, *others]
    total = sum(weights[key] for key in keys)
    if total <= 0.0 or not others:
        return []
    out = []
    for key in keys:
        block = final if key == names else fits.of(key)[i]
        share = weights[key] / total
        out.append(Alternative(block, remains, share))
    return out


def _weights_of_acting(
    found: ModelPosterior, fits: Fits, i: int, names: Key, undecided: Sequence[str]
) -> dict[Key, float]:
    """Weights of what may act in block `i`: the final model, and fitted sets that differ only in undecided names."""
    weights: dict[Key, float] = {}
    for effects, weight in zip(found.sets, found.weights.values(), strict=True):
        acting = frozenset(name for name in effects.names if effects.presence[name][i] > 0.5)
        is_fitted = acting and effects.key == acting and fits.knows(acting)
        differ_in_undecided = (acting ^ names) <= set(undecided)
        if acting == names or (is_fitted and differ_in_undecided):
            before = weights.get(acting, 0.0)
            weights[acting] = before + weight
    weights.setdefault(names, 0.0)
    return weights


def _others(weights: Mapping[Key, float], names: Key) -> list[Key]:
    """The most probable models that hold `MIXED` of the probability with the final one, that of `names`."""
    total = sum(weights.values())
    may_miss = (1.0 - MIXED) * total
    left_out = total - weights[names]
    found = []
    for key in sorted((k for k in weights if k != names), key=lambda k: -weights[k]):
        if left_out <= may_miss:
            break
        found.append(key)
        left_out -= weights[key]
    return found

"""Families: effects that these tests cannot tell apart are judged together first, then each within its family.

Two effects are alike where the signatures that they leave beside the model's own parameters, at their refitted
amplitudes and shapes, have |cos| > `ALIKE`. Every member is alike to the best of its family: a chain of neighbours
would join effects that look nothing like each other.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from wirebayes.discovery.linear_scan import expand
from wirebayes.discovery.noise_integral import projected
from wirebayes.discovery.power import ALIKE, cosines
from wirebayes.discovery.probes import Probe
from wirebayes.discovery.refit import Refit
from wirebayes.discovery.tangent import moving_columns, tangent
from wirebayes.effects import CATALOGUE
from wirebayes.inference.laplace_fit import LaplaceFit
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.model.column_units import parameter_of
from wirebayes.numeric.typing import Array

Family = tuple[str, ...]
# What a person who tests lines would call what several effects have in common: the pattern, and the sentence of it.
PATTERNS = {
    "elastic curve": "the elastic curve is bent",
    "course of a hold": "the course within a hold differs",
    "creep from hold to hold": "the creep changes from hold to hold",
    "step at a hold": "the level steps at a hold",
    "slow drift": "the readings drift",
    "way back": "loading and unloading differ",
    "position of the screw": "the position is off periodically",
    "length of the sample": "samples of different lengths differ",
}


def families_of(
    plain: Sequence[LaplaceFit], found: Mapping[str, Mapping[int, Probe]], ratios: Sequence[float]
) -> list[Family]:
    """Names in families, best first.

    Parameters
    ----------
    plain : sequence of LaplaceFit
        One a material, without effects: their parameters are what signatures are projected on.
    found : mapping of name to mapping of int to Probe
        Each name as it was refitted, by block; the best name first.
    ratios : sequence of float
        Size of the setting errors against the sensor's, ρ, of each block.

    Returns
    -------
    list of tuple of str
        Each name in one family, the family's best first.
    """
    names = list(found)
    signatures = []
    for b, (block, ratio) in enumerate(zip(plain, ratios, strict=True)):
        probes = {i: found[name][b] for i, name in enumerate(names) if b in found[name]}
        signatures.append(_signatures(block, probes, ratio, len(names)))
    effects = [next(iter(found[name].values())).effect for name in names]
    is_material = np.array([effect.scope == "material" for effect in effects], bool)
    has_own = is_material & (len(plain) > 1)
    return grouped(names, cosines(signatures, has_own))


def _signatures(block: LaplaceFit, probes: Mapping[int, Probe], ratio: float, count: int) -> Array:
    """(N, count) projected signatures of a block's probes, by number; zero for numbers without a probe."""
    expansion = expand(block.target, block.z, list(probes.values()))
    seen = projected(expansion, ratio)
    every = np.zeros((seen.shape[0], count))
    every[:, list(probes)] = seen
    return every


def grouped(names: Sequence[str], cosine: Array) -> list[Family]:
    """Names, best first, in families by the (m, m) likeness of their signatures."""
    left = list(range(len(names)))
    out = []
    while left:
        members = [i for i in left if i == left[0] or cosine[left[0], i] > ALIKE]
        out.append(tuple(names[i] for i in members))
        left = [i for i in left if i not in members]
    return out


def refitted_probe(block: LaplaceFit, found: Refit, b: int) -> Probe:
    """An effect at the amplitude and the shapes at which it was refitted in block number `b`.

    Parameters
    ----------
    block : LaplaceFit
        The block that it was refitted in.
    found : Refit
    b : int
    """
    effect = found.effect
    names = [parameter_of(name) for name in block.problem_with(effect).names]
    values = found.theta[found.blocks.index(b)].tolist()
    theta = dict(zip(names, values, strict=True))
    own = {column: theta[column] for column in effect.columns()}
    neutral = effect.amplitudes[0].neutral
    step = abs(found.amplitude - neutral) or found.sd
    away = found.amplitude if found.amplitude != neutral else neutral + step
    own[effect.amplitude_column] = away
    return Probe(effect, own, step, False)


def block_ratio(block: LaplaceFit) -> float:
    """Size of the setting errors against the sensor's, ρ, in a fitted block."""
    target = block.target
    return float(tangent(target, block.z, None, moving_columns(target.problem)).ratio[0])


def noise_ratio(block: LaplaceFit, found: Refit, b: int) -> float:
    """The same where an effect was refitted in the block.

    Parameters
    ----------
    block : LaplaceFit
    found : Refit
    b : int
        The block's number, as the refit counts them.
    """
    problem = block.problem_with(found.effect)
    target = LogPosterior(problem)
    z = target.coordinates.to_sampled(found.theta[found.blocks.index(b)][None])
    return float(tangent(target, z, None, moving_columns(problem)).ratio[0])


def called(family: Family) -> str:
    """The family's name: what its members have in common, or the effect itself where it is alone."""
    best = family[0]
    pattern = CATALOGUE[best].pattern if best in CATALOGUE else ""  # a user's own effect has none
    return pattern if pattern and len(family) > 1 else best


def family_names(families: Sequence[Family]) -> list[str]:
    """A name for each of the families found in one test: as `called`, with the best member where two have that name."""
    names = [called(family) for family in families]
    out = []
    for name, family in zip(names, families, strict=True):
        is_shared = names.count(name) > 1
        out.append(f"{name}: {family[0].replace('_', ' ')}" if is_shared else name)
    return out


def family_sentence(members: Mapping[str, float], *, again: bool = False) -> str:
    """What a family says of the wire, and the probability of each of its members to be what is missing.

    Those below one in a hundred are left out; one that is all but certain is named without its probability.

    Parameters
    ----------
    members : mapping of name to float
        The most probable first.
    again : bool
        Whether a family before it has the same in common: signatures of one pattern may still differ.
    """
    label = called(tuple(members))
    pattern = PATTERNS.get(label, f"there is {label.replace('_', ' ')}")
    if again:
        pattern += ", in another way"
    shares = {name.replace("_", " "): p for name, p in members.items() if p >= _WORTH_SAYING}
    if label in members:  # one effect alone, whose name has been said
        share = members[label]
        is_open = _WORTH_SAYING <= share <= _CERTAIN
        return f"{pattern}, {100 * share:.0f} %" if is_open else pattern
    said = [name if p > _CERTAIN else f"{name} {100 * p:.0f} %" for name, p in shares.items()]
    return f"{pattern}: {', '.join(said)}" if said else pattern


_WORTH_SAYING = 0.01  # probability of a member: less is no candidate
_CERTAIN = 0.995  # from here on its probability would be shown as one

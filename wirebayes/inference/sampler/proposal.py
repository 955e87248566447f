"""What the learned move draws from: mixtures in straightened coordinates, one in plain coordinates, and the first one.

The close component resembles the posterior. Two wide ones, fitted to the posterior to a power, keep the ratio of
posterior to proposal bounded in the tails: the one in straightened coordinates along curved ridges, the one in plain
coordinates where the straightening map extrapolates badly. The mixture of the start keeps small modes within reach. All
these are fitted to most of the mass. What little lies where they make too little of it, a neck or a tail, has a part of
its own, fitted to the excess of the posterior over the others.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.random import Generator

from wirebayes.inference.sampler import mixture, transport_map
from wirebayes.inference.sampler.components import Components
from wirebayes.inference.sampler.mixture import Mixture
from wirebayes.inference.sampler.points import WeightedPoints
from wirebayes.inference.sampler.settings import (
    ELSEWHERE,
    EXCESS_COMPONENTS,
    LIGHT_DEGREES,
    POINTS,
    TAKEN_AS_IT_IS,
    TOO_FEW,
    WIDER,
)
from wirebayes.inference.sampler.transport_map import Straight
from wirebayes.numeric.log_sum import log_sum
from wirebayes.numeric.resampling import effective_number
from wirebayes.numeric.typing import Array, Ints

Shares = tuple[float, float, float, float, float]


@dataclass(frozen=True)
class Proposal:
    """A weighted sum of densities that can be drawn from.

    Attributes
    ----------
    shares : tuple of float
        Of the close part, the wide one, the plain one, the start's and that of the excess.
    straight : Straight
    close, wide, plain, start : Mixture
        The first two of straightened points.
    excess : Mixture, optional
        Of straightened points.
    """

    shares: Shares
    straight: Straight
    close: Mixture
    wide: Mixture
    plain: Mixture
    start: Mixture
    excess: Mixture | None = None

    def to_arrays(self) -> dict[str, Any]:
        """What `from_arrays` makes the same proposal of."""
        parts = {name: part.to_arrays() for name in _PARTS if (part := getattr(self, name)) is not None}
        return {"shares": np.array(self.shares), "straight": self.straight.to_arrays(), **parts}

    @staticmethod
    def from_arrays(arrays: Mapping[str, Any]) -> "Proposal":
        """The proposal that gave these arrays."""
        parts = {name: Mixture.from_arrays(arrays[name]) for name in _PARTS if name in arrays}
        near, far, as_it_is, before, excess = map(float, arrays["shares"])
        return Proposal((near, far, as_it_is, before, excess), Straight.from_arrays(arrays["straight"]), **parts)

    @cached_property
    def _parts(self) -> tuple[list[tuple[float, Mixture]], list[tuple[float, Mixture]]]:
        """Shares and mixtures of straightened points, then of others; shares that sum to one."""
        close, wide, plain, start, excess = self.shares
        straightened = [(close, self.close), (wide, self.wide)]
        others = [(plain, self.plain), (start, self.start)]
        if self.excess is not None:
            straightened.append((excess, self.excess))
        total = sum(share for share, _ in straightened + others)
        return _divided(straightened, total), _divided(others, total)

    def log_density(self, x: Array) -> Array:
        """(n,) log density of points (n, d)."""
        u, jacobian = self.straight.forward(x)
        straightened, others = self._parts
        logs = [np.log(share) + part.log_density(u) + jacobian for share, part in straightened]
        logs += [np.log(share) + part.log_density(x) for share, part in others]
        return log_sum(np.array(logs))

    @cached_property
    def components(self) -> Components:
        """All components of all parts."""
        straightened, others = self._parts
        every = [*straightened, *others]
        mixtures = [part for _, part in every]
        weights = [share * part.weights for share, part in every]
        degrees = [np.full(len(part.weights), part.degrees) for part in mixtures]
        together = Mixture(
            np.concatenate(weights),
            np.concatenate([part.centres for part in mixtures]),
            np.concatenate([part.factors for part in mixtures]),
            np.concatenate(degrees),
        )
        in_straightened = sum(len(part.weights) for _, part in straightened)
        return Components(together, self.straight, in_straightened)

    def rvs(self, n: int, rng: Any) -> Array:
        """(n, d) independent draws; `rng` is a numpy RandomState or Generator."""
        return self.components.from_cube(rng.uniform(size=(n, len(self.straight.order) + 1)), rng)


def _divided(parts: list[tuple[float, Mixture]], total: float) -> list[tuple[float, Mixture]]:
    """Parts whose shares are of a total."""
    return [(share / total, part) for share, part in parts]


def components(of: Mixture | Proposal) -> Components:
    """The components of what the learned move draws from."""
    if isinstance(of, Proposal):
        return of.components
    degrees = np.full(len(of.weights), of.degrees)
    return Components(replace(of, degrees=degrees))


def fit_proposal(
    hot: WeightedPoints,
    cold: WeightedPoints,
    start: Mixture,
    order: Ints,
    rng: Generator,
    shares: Shares,
    *,
    most: int,
    points: int = POINTS,
    before: Proposal | None = None,
    along_tails: bool = True,
    scores: Sequence[int] = (),
) -> Proposal:
    """The proposal learned from the burn-in.

    Along a bent tail, of which draws of the posterior show the beginning alone, a map fitted to those goes on straight;
    one fitted to the hot points follows it. In a funnel, to a power, hardly any mass is where the posterior has it: hot
    points that are spread so much wider say nothing of its tails, and the map is fitted to the cold ones; so it is at
    first, when all points are rough.

    Parameters
    ----------
    hot, cold : WeightedPoints
        Of the posterior to a power below one, which reach its tails, and of the posterior itself.
    start : Mixture
        What was known before any walk.
    order : (d,) array of int
        In which coordinates are straightened (see `wirebayes.inference.sampler.transport_map`).
    rng : numpy Generator
    shares : tuple of float
        Of the parts.
    most : int
        The most components of the close mixture; the wide ones, which need not resemble anything, have half as many.
    points : int
        At most so many are looked at.
    before : Proposal, optional
        Of nearly these points: where the mixtures are sought from.
    along_tails : bool
        Whether the map may be fitted to the hot points.
    scores : sequence of int
        Coordinates that are scores of shares (see `wirebayes.inference.sampler.transport_map`).

    Raises
    ------
    numpy.linalg.LinAlgError
        If the points do not span their space.
    """
    hot = hot.thinned(points, rng)
    cold = cold.thinned(points, rng)
    elsewhere = before is None or (hot.spread > ELSEWHERE * cold.spread).any()
    to_fit = hot if along_tails and not elsewhere else cold
    straight = transport_map.fit_map(to_fit, order, scores)
    near = _straightened(cold, straight)
    far = _straightened(hot, straight).thinned(points // 2, rng)
    plain = hot.thinned(points // 2, rng)
    old_close = None if before is None else before.close
    old_wide = None if before is None else before.wide
    old_plain = None if before is None else before.plain
    close = mixture.fit_mixture(near, rng, most=most, degrees=LIGHT_DEGREES, before=old_close)
    wide = mixture.fit_mixture(far, rng, most=most // 2, before=old_wide)
    as_it_is = mixture.fit_mixture(plain, rng, most=most // 2, before=old_plain)
    return Proposal(shares, straight, close, wide, as_it_is, start)


def _straightened(points: WeightedPoints, straight: Straight) -> WeightedPoints:
    """The same points in the coordinates of a map."""
    u, _ = straight.forward(points.z)
    return replace(points, z=u)


def with_excess(of: Proposal, drawn: WeightedPoints, value: Array, rng: Generator) -> Proposal:
    """The proposal with a part for where the posterior lies far above its other parts.

    A mixture fitted to all points has no component to spare for a thousandth of the mass, however far the posterior
    lies above it there. The excess is what the posterior has over e times what the other parts make of it.

    Parameters
    ----------
    drawn : WeightedPoints
        Places (n, d) by posterior mass.
    value : (n,) array
        Their log posterior densities.

    References
    ----------
    F. Guo, X. Wang, K. Fan, T. Broderick and D. B. Dunson, Boosting variational inference, arXiv:1611.05559, 2016:
    mixtures that grow by components where the posterior over the mixture is large.
    """
    of = replace(of, excess=None)
    over = value - of.log_density(drawn.z)
    over -= np.quantile(over, 0.5, weights=drawn.weight, method="inverted_cdf")
    missing = -np.expm1(np.minimum(TAKEN_AS_IT_IS - over, 0.0))
    weight = drawn.weight * missing
    some = weight > 0.0
    weight = weight[some]
    u, _ = of.straight.forward(drawn.z[some])
    if len(weight) < TOO_FEW or not np.isfinite(u).all():
        return of
    points = WeightedPoints(u, weight)
    points = points.worth(effective_number(weight))
    try:
        excess = mixture.fit_around(points, of.close, rng, most=EXCESS_COMPONENTS, wider=WIDER)
    except np.linalg.LinAlgError:
        return of
    return replace(of, excess=excess)


_PARTS = ("close", "wide", "plain", "start", "excess")

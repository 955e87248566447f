"""What the learned move draws from: mixtures in straightened coordinates, one in plain coordinates, and the first one.

The close component resembles the posterior. Two wide ones, fitted to the posterior to a power, keep the ratio of
posterior to proposal bounded in the tails: the one in straightened coordinates along curved ridges, the one in plain
coordinates where the straightening map extrapolates badly. The mixture of the start keeps small modes within reach.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wirebayes.inference.sampler import mixture, transport_map
from wirebayes.inference.sampler.components import Components
from wirebayes.inference.sampler.mixture import Mixture
from wirebayes.inference.sampler.points import Points
from wirebayes.inference.sampler.transport_map import Straight
from wirebayes.log_sum import log_sum
from wirebayes.typing import Array

SHARES = (0.72, 0.12, 0.12, 0.04)  # of the close part, the wide one, the plain one and the start's
EXPLORING = (0.55, 0.2, 0.2, 0.05)  # while it learns: draws of the wide parts teach what lies far out
ENOUGH = 12000  # points that settle a mixture in a handful of dimensions; more only take time
ROUGH_SHARES = (0.3, 0.1, 0.1, 0.5)  # while nothing but the start is sure


@dataclass(frozen=True)
class Proposal:
    """A weighted sum of densities that can be drawn from.

    Attributes
    ----------
    shares : tuple of float
        Of the close part, the wide one, the plain one and the start's.
    straight : Straight
    close, wide, plain, start : Mixture
        The first two of straightened points.
    """

    shares: tuple[float, float, float, float]
    straight: Straight
    close: Mixture
    wide: Mixture
    plain: Mixture
    start: Mixture

    def to_arrays(self) -> dict[str, Any]:
        """What `from_arrays` makes the same proposal of."""
        parts = {name: getattr(self, name).to_arrays() for name in ("straight", *_MIXTURES)}
        return {"shares": np.array(self.shares), **parts}

    @staticmethod
    def from_arrays(arrays: Mapping[str, Any]) -> "Proposal":
        """The proposal that gave these arrays."""
        close, wide, plain, start = (Mixture.from_arrays(arrays[name]) for name in _MIXTURES)
        near, far, as_it_is, before = map(float, arrays["shares"])
        straight = Straight.from_arrays(arrays["straight"])
        return Proposal((near, far, as_it_is, before), straight, close, wide, plain, start)

    def log_density(self, x: Array) -> Array:
        """(n,) log density of points (n, d)."""
        u, jacobian = self.straight.forward(x)
        straightened = [part.log_density(u) + jacobian for part in (self.close, self.wide)]
        parts = [*straightened, self.plain.log_density(x), self.start.log_density(x)]
        return log_sum(np.array(parts) + np.log(self.shares)[:, None])

    @cached_property
    def components(self) -> Components:
        """All components of the four parts."""
        parts = [getattr(self, name) for name in _MIXTURES]
        together = Mixture(
            np.concatenate([share * part.weights for share, part in zip(self.shares, parts, strict=True)]),
            np.concatenate([part.centres for part in parts]),
            np.concatenate([part.factors for part in parts]),
            np.concatenate([np.full(len(part.weights), part.degrees) for part in parts]),
        )
        return Components(together, self.straight, len(self.close.weights) + len(self.wide.weights))

    def rvs(self, n: int, rng: Any) -> Array:
        """(n, d) independent draws; `rng` is a numpy RandomState or Generator."""
        return self.components.from_cube(rng.uniform(size=(n, len(self.straight.order) + 1)), rng)


def components(of: Mixture | Proposal) -> Components:
    """The components of what the learned move draws from."""
    if isinstance(of, Proposal):
        return of.components
    return Components(replace(of, degrees=np.full(len(of.weights), of.degrees)))


def fit(
    hot: Points,
    cold: Points,
    start: Mixture,
    order: NDArray[np.int64],
    rng: np.random.Generator,
    shares: tuple[float, float, float, float],
    *,
    most: int,
    points: int = ENOUGH,
    before: Proposal | None = None,
    along_tails: bool = True,
) -> Proposal:
    """The proposal learned from the burn-in.

    Along a bent tail, of which draws of the posterior show the beginning alone, a map fitted to those goes on straight;
    one fitted to the hot points follows it. In a funnel, to a power, hardly any mass is where the posterior has it: hot
    points that are spread so much wider say nothing of its tails, and the map is fitted to the cold ones; so it is at
    first, when all points are rough.

    Parameters
    ----------
    hot, cold : Points
        Of the posterior to a power below one, which reach its tails, and of the posterior itself.
    start : Mixture
        What was known before any walk.
    order : (d,) array of int
        In which coordinates are straightened (see `wirebayes.inference.sampler.transport_map`).
    rng : numpy Generator
    shares : tuple of float
        Of the four parts.
    most : int
        The most components of the close mixture; the wide ones, which need not resemble anything, have half as many.
    points : int
        At most so many are looked at.
    before : Proposal, optional
        Of nearly these points: where the mixtures are sought from.
    along_tails : bool
        Whether the map may be fitted to the hot points.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the points do not span their space.
    """
    hot, cold = hot.thinned(points, rng), cold.thinned(points, rng)
    elsewhere = before is None or (hot.spread > _ELSEWHERE * cold.spread).any()
    straight = transport_map.fit(hot if along_tails and not elsewhere else cold, order)
    near, far = (replace(each, z=straight.forward(each.z)[0]) for each in (cold, hot))
    far, plain = far.thinned(points // 2, rng), hot.thinned(points // 2, rng)
    return Proposal(
        shares, straight,
        mixture.fit(near, rng, most=most, degrees=_LIGHT, before=before.close if before else None),
        mixture.fit(far, rng, most=most // 2, before=before.wide if before else None),
        mixture.fit(plain, rng, most=most // 2, before=before.plain if before else None),
        start,
    )  # fmt: skip


_MIXTURES = ("close", "wide", "plain", "start")
# times as wide: a normal density to the power 0.4 is 1.6 times as wide, those of the paper's wires, with effects of
# bent tails, up to 4 times, a funnel 6 to 400 times
_ELSEWHERE = 5.0
_LIGHT = 40.0  # degrees of freedom where the wide mixtures look after the tails

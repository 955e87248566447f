"""A proposal as one list of components, by which points of a cube become its draws, and draws such points.

A point of the cube says to which component a draw belongs, and how far along each coordinate of it. So points that
fill the cube evenly become draws that represent the proposal better than as many independent ones.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.special import ndtr, ndtri

from wirebayes.inference.sampler.mixture import Mixture
from wirebayes.inference.sampler.transport_map import Straight
from wirebayes.numeric.typing import Array


@dataclass(frozen=True)
class Components:
    """Student-t components of one density.

    Attributes
    ----------
    mixture : Mixture
        All of them, each with degrees of freedom of its own.
    straight : Straight, optional
    straightened : int
        So many components, the first ones, are of straightened coordinates.
    """

    mixture: Mixture
    straight: Straight | None = None
    straightened: int = 0

    @cached_property
    def _until(self) -> Array:
        return np.cumsum(self.mixture.weights)

    def from_cube(self, points: Array, random: Any) -> Array:
        """Draws that belong to points of the cube.

        How far out a draw lies in a Student-t component is left to chance: the cube says only in which direction.

        Parameters
        ----------
        points : (n, d + 1) array
        random : numpy RandomState or Generator

        Returns
        -------
        (n, d) array
        """
        which = np.searchsorted(self._until, points[:, 0])
        which = np.minimum(which, len(self._until) - 1)
        within = np.clip(points[:, 1:], _SMALLEST, 1.0 - _SMALLEST)
        degrees = self.mixture.degrees[which]
        stretch = np.sqrt(degrees / random.chisquare(degrees))
        deviates = ndtri(within) * stretch[:, None]
        from_centre = np.einsum("nij,nj->ni", self.mixture.factors[which], deviates)
        x = self.mixture.centres[which] + from_centre
        if self.straight is not None:
            straightened = which < self.straightened
            x[straightened] = self.straight.inverse(x[straightened])
        return x

    def to_cube(self, x: Array, random: Any) -> Array:
        """Points of the cube to which draws belong: one for each, by chance from all that could have led to it.

        Parameters
        ----------
        x : (n, d) array
            Where the proposal's density is positive.
        random : numpy RandomState or Generator

        Returns
        -------
        (n, d + 1) array
        """
        n, d = x.shape
        deviates, jacobian = self._deviates(x)
        distances = np.einsum("knd,knd->kn", deviates, deviates)
        logs = self.mixture.log_parts(distances)
        logs[: self.straightened] += jacobian
        # with Gumbel numbers added the largest is a draw by weight
        which = np.argmax(logs + random.gumbel(size=logs.shape), axis=0)
        chosen = which, np.arange(n)
        degrees = self.mixture.degrees[which]
        square = random.chisquare(degrees + d)
        stretch = np.sqrt(square / (degrees + distances[chosen]))
        within = ndtr(deviates[chosen] * stretch[:, None])
        back = self.mixture.weights[which] * random.uniform(size=n)
        return np.column_stack([self._until[which] - back, within])

    def _deviates(self, x: Array) -> tuple[Array, Any]:
        """(components, n, d) of places (n, d), each in a component's own units, and what straightening adds to logs."""
        centres = self.mixture.centres[:, None]
        k = self.straightened
        straight, jacobian = (x, 0.0) if self.straight is None else self.straight.forward(x)
        apart = np.concatenate([straight - centres[:k], x - centres[k:]])
        inverse = np.linalg.inv(self.mixture.factors)
        return apart @ inverse.transpose(0, 2, 1), jacobian


_SMALLEST = 1e-15  # from the borders of the cube, where deviates are not finite

"""Maxima of densities with the normal approximation there, and which of them are one mode."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from wirebayes.numeric.rows import joined_rows, rows_of
from wirebayes.numeric.typing import Array, Bools, Ints

LEAST_CURVATURE = 0.3  # a standard deviation of 1.8; the widest prior, k1's, has 1.5 in its logarithm
_ONE_MODE = 4.0  # squared standard deviations
REACH = 30.0  # nats below the best mode that no mode counts


@dataclass(frozen=True)
class Optimum:
    """Where the climbs ended.

    Attributes
    ----------
    z : (n, d) array, sampled coordinates
    log_density : (n,) array
    curvature : (n, d, d) array
        Minus the Hessian, made positive definite.
    converged : (n,) bool array
        The Newton decrement fell below the tolerance.
    """

    z: Array
    log_density: Array
    curvature: Array
    converged: Bools

    def rows(self, which: Any) -> "Optimum":
        """Some of them, by number or mask."""
        return rows_of(self, which)

    @property
    def covariance(self) -> Array:
        """(n, d, d) covariance of the normal approximation."""
        eigen, vectors = np.linalg.eigh(self.curvature)
        # A ridge thinner than this against its length has no Cholesky factor in double precision.
        eigen = np.maximum(eigen, 1e-10 * eigen.max(axis=1, keepdims=True))
        half = vectors / np.sqrt(eigen)[:, None, :]
        return half @ np.swapaxes(half, 1, 2)

    @property
    def log_evidence(self) -> Array:
        """(n,) Laplace approximation of the log evidence of each mode.

        No direction counts as wider than the prior makes it (sampled coordinates are of order one under the prior).
        """
        d = self.z.shape[1]
        eigen = np.maximum(np.linalg.eigvalsh(self.curvature), LEAST_CURVATURE)
        return self.log_density + 0.5 * d * np.log(2.0 * np.pi) - 0.5 * np.log(eigen).sum(axis=1)


@dataclass(frozen=True)
class Ends:
    """Where climbs of several densities have ended, and which density (k,) each place is of."""

    which: Ints
    places: Optimum

    @classmethod
    def of(cls, known: Sequence[Optimum]) -> "Ends":
        """Modes of each density that are known."""
        return cls(np.repeat(np.arange(len(known)), [len(found.z) for found in known]), together(known))

    def joined(self, which: Ints, ended: Optimum) -> "Ends":
        """With further places, highest first, but for those that are near one.

        Parameters
        ----------
        which : (n,) int array
            Their densities.
        """
        out = self
        for i in np.argsort(-ended.log_density):
            here = ended.rows([i])
            if not out.near(which[[i]], here.z, here.log_density)[0]:
                out = Ends(np.append(out.which, which[i]), together([out.places, here]))
        return out

    def near(self, which: Ints, z: Array, value: Array) -> Bools:
        """(n,) whether places would count as one of these modes of their density; never where they are higher.

        Parameters
        ----------
        which : (n,) int array
            Their densities.
        z : (n, d) array
        value : (n,) array
        """
        near = _apart(z, self.places.z, self.places.curvature) <= _ONE_MODE
        lower = value[:, None] <= self.places.log_density
        return (near & lower & (self.which == which[:, None])).any(axis=1)


def nowhere(d: int) -> Optimum:
    """No place in d dimensions."""
    return Optimum(np.empty((0, d)), np.empty(0), np.empty((0, d, d)), np.empty(0, bool))


def distinct(found: Sequence[Optimum]) -> Optimum:
    """The rows that no better one is near, none hopelessly below the best; best first.

    Parameters
    ----------
    found : sequence of Optimum
        What climbs returned, put together.
    """
    every = together(found)
    order = np.argsort(-every.log_density)
    keep: list[int] = []
    for i in order:
        if not np.isfinite(every.log_density[i]) or every.log_density[i] < every.log_density[order[0]] - REACH:
            continue
        if not (_apart(every.z[[i]], every.z[keep], every.curvature[keep]) <= _ONE_MODE).any():
            keep.append(int(i))
    return every.rows(keep)


def together(found: Sequence[Optimum]) -> Optimum:
    """The rows of several, one after the other."""
    return joined_rows(found)


def _apart(z: Array, modes: Array, curvature: Array) -> Array:
    """(n, k) squared distances of places (n, d) from modes (k, d), in standard deviations."""
    apart = z[:, None] - modes
    return np.einsum("nki,kij,nkj->nk", apart, curvature, apart)

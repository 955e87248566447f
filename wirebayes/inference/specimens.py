"""Coordinates of partially pooled specimens: what is left of their values, given their lines and what readings say.

Values that spread about a line's make a funnel: the smaller the spread, the narrower their range. Where readings say
little, deviations in units of the spread are independent of it (non-centred); where they say much, the values
themselves are (centred). Were the specimens unrelated, the readings would make the logarithms x of all their pooled
values nearly normal, with precision P about m. Given the lines' log values l and spreads s, x then has the
precision ``Λ = P + diag(1/s²)`` and the mean ``Λ⁻¹ (P m + l/s²)``, and with ``Λ = L Lᵀ`` the coordinates

    ε = Lᵀ (x - Λ⁻¹ (P m + l/s²)),    log |dx/dε| = -Σ log L_jj

are standard normal whatever l and s: non-centred at P = 0, centred where P is large, in each direction as far as the
readings go. Any P and m make an exact map, so a normal approximation of them will do.

References
----------
O. Papaspiliopoulos, G. O. Roberts and M. Sköld, A general framework for the parametrization of hierarchical models,
Statistical Science 22 (2007).
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from wirebayes.model.linear_amplitudes import MarginalisedProblem, integrated
from wirebayes.model.prior import PooledPrior, Prior
from wirebayes.model.problem import Problem
from wirebayes.typing import Array


@dataclass(frozen=True)
class Specimens:
    """Columns of the m specimens' values, of the line and the spread of each, and what the readings say of them.

    Attributes
    ----------
    own, lines, spreads : (m,) arrays of int
    precision : (m, m) array
        P of the module's text.
    pull : (m,) array
        P m.
    """

    own: NDArray[np.int64]
    lines: NDArray[np.int64]
    spreads: NDArray[np.int64]
    precision: Array
    pull: Array

    def to_sampled(self, theta: Array) -> Array:
        """(n, m) coordinates of natural parameters (n, d)."""
        centre, lower = self._given(theta)
        return np.einsum("nkj,nk->nj", lower, np.log(theta[:, self.own]) - centre)

    def to_natural(self, theta: Array, sampled: Array) -> Array:
        """(n, m) values of coordinates (n, m), given parameters (n, d) in which lines and spreads are set."""
        centre, lower = self._given(theta)
        return np.asarray(np.exp(centre + np.linalg.solve(np.swapaxes(lower, 1, 2), sampled[..., None])[..., 0]))

    def log_jacobian(self, theta: Array) -> Array:
        """(n,) log |d log values / d coordinates|."""
        return np.asarray(-np.log(np.einsum("njj->nj", self._given(theta)[1])).sum(axis=1))

    def _given(self, theta: Array) -> tuple[Array, Array]:
        """Means (n, m) and Cholesky factors (n, m, m) of the precisions of the log values, given lines and spreads."""
        within = np.clip(theta[:, self.spreads], *_SPREADS) ** -2.0
        total = self.precision + within[:, :, None] * np.eye(len(self.own))
        pull = self.pull + within * np.log(np.clip(theta[:, self.lines], *_LINES))
        return np.linalg.solve(total, pull[..., None])[..., 0], np.linalg.cholesky(total)


def specimens(problem: Problem) -> Specimens | None:
    """The pooled parameters of a problem; none where it has none."""
    prior = problem.prior
    if not isinstance(prior, PooledPrior) or not prior.pools:
        return None
    rows = [(own, line, spread) for line, spread, members in prior.pools for own in members]
    own, lines, spreads = (np.array([problem.names.index(row[i]) for row in rows]) for i in range(3))
    precision, mean = _said(problem, [row[0] for row in rows], {c for row in rows for c in row[1:]})
    return Specimens(own, lines, spreads, precision, precision @ mean)


def _said(problem: Problem, own: list[str], gone: set[str]) -> tuple[Array, Array]:
    """Precision and mean that readings give the logarithms of specimens' values, were these unrelated."""
    from wirebayes.inference.modes import modes
    from wirebayes.inference.transform import LogPosterior  # a target of its own, of a problem without pools

    whole = problem.whole if isinstance(problem, MarginalisedProblem) else problem
    prior = whole.prior
    left = {name: d for name, d in prior.distributions.items() if name not in gone}
    unrelated = integrated(replace(whole, prior=Prior(left, prior.fixed, prior.logarithmic - gone)))
    target, rng = LogPosterior(unrelated), np.random.default_rng(0)
    columns = [unrelated.names.index(name) for name in own]
    before = np.log(unrelated.prior.rvs(_DRAWS, rng)[:, columns])
    best = modes(target, rng)
    z = rng.multivariate_normal(best.z[0], best.covariance[0], _DRAWS, method="cholesky")
    after = np.log(target.coordinates.to_natural(z)[:, columns])
    prior_width = np.linalg.cholesky(_covariance(before))
    narrowed = np.linalg.solve(prior_width, np.linalg.solve(prior_width, _covariance(after)).T)
    width, vectors = np.linalg.eigh(narrowed)  # in units of the prior's
    value, vectors = 1.0 / width - 1.0, np.linalg.solve(prior_width.T, vectors)
    return vectors * np.where(value > _SAYS_SOMETHING, value, 0.0) @ vectors.T, after.mean(axis=0)


def _covariance(x: Array) -> Array:
    return np.asarray(np.cov(x.T).reshape(x.shape[1], x.shape[1]))


_DRAWS = 4000  # a variance is then known to 2 %, and `_SAYS_SOMETHING` is 20 %
_SAYS_SOMETHING = 0.2  # of the prior's precision: less may be chance of the draws
_SPREADS, _LINES = (1e-8, 1e8), (1e-100, 1e100)  # beyond, there are no digits left; priors are far inside

"""What the best possible judge could do where several effects hide, or one whose form is in no catalogue.

The judge knows the noise, the true parameters and the direction of every catalogue effect's signature, but no amplitude
and no foreign form. What one sign of an effect does, the other need not do: amplitudes are not negative, and each sign
is a candidate of its own.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations, permutations
from typing import Any

import numpy as np
from scipy.linalg import solve_triangular
from scipy.special import logsumexp
from scipy.stats import chi2, ncx2

from .baselines import gaussian_process
from .delta import Geometry
from .rig import Array, Index

SEPARABLE = 3.3  # delta from which a difference shows
DELTA_RANGE = (2.5, 25.0)  # the prior of log delta is flat here, up to what the effect can reach
LEVEL = 0.03  # of the test of what a set of effects leaves over
REMAINDER_SIZES = 5  # of a smooth remainder, evenly spaced in log delta: neighbours explain nearly the same
LEAST_DETERMINANT = 1e-6  # of a set's directions: below it they are one direction


@dataclass(frozen=True)
class Directions:
    """Unit signatures of candidates, (c, R), and the effect that each belongs to, (c,), by its place among `names`."""

    units: Array
    owner: Index
    names: list[str]

    def without(self, names: tuple[str, ...]) -> Directions:
        """Those of all other effects."""
        kept = np.array([self.names[i] not in names for i in self.owner])
        return Directions(self.units[kept], self.owner[kept], self.names)

    def with_exact(self, name: str, signature: Array) -> Directions:
        """One more: an effect's own signature (R,), shape constants and size as they are."""
        unit = signature / max(float(np.linalg.norm(signature)), 1e-12)
        return Directions(np.vstack([self.units, unit]), np.append(self.owner, self.names.index(name)), self.names)


@dataclass(frozen=True)
class Sets:
    """Sets of candidates of different effects, those of the same effects next to each other.

    Attributes
    ----------
    members : candidates, (s, k).
    inverse : inverse Gram matrices of their directions, (s, k, k).
    half_log_det : half the log determinants of the Gram matrices, (s,).
    first : where each choice of effects begins, (n,).
    effects : the effects of each choice, (n, k).
    """

    members: Index
    inverse: Array
    half_log_det: Array
    first: Index
    effects: Index

    @staticmethod
    def of(directions: Directions, size: int) -> Sets:
        """All sets of `size` candidates whose directions differ."""
        if size == 0:
            return Sets(
                np.zeros((1, 0), int), np.zeros((1, 0, 0)), np.zeros(1), np.zeros(1, int), np.zeros((1, 0), int)
            )
        members = np.array(list(combinations(range(len(directions.units)), size)), dtype=np.int64).reshape(-1, size)
        effects = np.sort(directions.owner[members], axis=1)
        different = np.all(np.diff(effects, axis=1) > 0, axis=1)
        members, effects = members[different], effects[different]
        gram = (directions.units @ directions.units.T)[members[:, :, None], members[:, None, :]]
        determinant = np.linalg.det(gram)
        apart = determinant > LEAST_DETERMINANT
        members, effects, gram = members[apart], effects[apart], gram[apart]
        order = np.lexsort(effects.T[::-1])
        members, effects = members[order], effects[order]
        new = np.any(np.diff(effects, axis=0, prepend=-1) != 0, axis=1)
        return Sets(
            members,
            np.linalg.inv(gram[order]),
            0.5 * np.log(determinant[apart][order]),
            np.flatnonzero(new),
            effects[new],
        )

    def explained(self, along: Array) -> Array:
        """(…, s) square length of data in the sets' span, -inf where an amplitude would be negative.

        Parameters
        ----------
        along : the data's components along each candidate's direction, (…, c).
        """
        a = along[..., self.members]
        amplitudes = (self.inverse @ a[..., None])[..., 0]
        return np.where(np.all(amplitudes >= 0, axis=-1), np.einsum("...i,...i->...", amplitudes, a), -np.inf)

    def log_evidence(self, along: Array) -> Array:
        """(n,) of each choice of effects against none: amplitudes integrated over their prior, candidates averaged."""
        height = 0.5 * self.explained(along) - self.half_log_det + self.members.shape[1] * _log_amplitude()
        top = np.maximum.reduceat(height, self.first)
        count = np.diff(np.append(self.first, len(height)))
        top = np.where(np.isfinite(top), top, 0.0)
        total = np.add.reduceat(np.exp(height - np.repeat(top, count)), self.first)
        with np.errstate(divide="ignore"):
            return np.asarray(top + np.log(total) - np.log(count))


def _log_amplitude() -> float:
    """What the integral over one amplitude adds: its prior is flat on both sides up to the largest delta."""
    return float(0.5 * np.log(2 * np.pi) - np.log(2 * DELTA_RANGE[1]))


def noise_draws(geo: Geometry, rng: np.random.Generator, draws: int) -> Array:
    noise = rng.normal(size=(draws, len(geo.plain)))
    return noise - (noise @ geo.basis) @ geo.basis.T


def optimal_names(
    geo: Geometry, directions: Directions, z: Array, groups: list[list[str]], rng: np.random.Generator, draws: int = 200
) -> dict[str, float]:
    """How often a judge who knows how many effects hide, and the noise, names all of them.

    All sets of as many effects are equally likely, then their candidates; amplitudes are integrated in closed form.

    Parameters
    ----------
    z : signature of all hidden effects together, (R,).
    groups : for each hidden effect the names that count as right; the sets of one name are the right names themselves.

    Returns
    -------
    Rate of one name from each group.
    """
    sets = Sets.of(directions, len(groups))
    along = (z + noise_draws(geo, rng, draws)) @ directions.units.T
    best = [sets.effects[np.argmax(sets.log_evidence(a))] for a in along]
    return {"group": float(np.mean([_one_of_each([directions.names[i] for i in line], groups) for line in best]))}


def _one_of_each(names: list[str], groups: list[list[str]]) -> bool:
    return any(all(n in g for n, g in zip(order, groups, strict=True)) for order in permutations(names))


def optimal_mixed(
    geo: Geometry, directions: Directions, z: Array, group: list[str], rng: np.random.Generator, draws: int = 200
) -> dict[str, float]:
    """How often a judge who knows that more than one thing hides names the known effect, and reports a remainder.

    Two effects, three effects, and one effect beside a smooth remainder are equally likely, then the effects, then
    their candidates; amplitudes and the size of the remainder are integrated over.

    Parameters
    ----------
    z : signature of everything hidden, (R,).
    group : names that count as the known effect.

    Returns
    -------
    Rate at which the most probable set holds one of the group, and rate at which a remainder is more likely than not.
    """
    data = z + noise_draws(geo, rng, draws)
    along = data @ directions.units.T
    beside = _beside_remainder(geo, directions, data)
    choices = [Sets.of(directions, size) for size in (2, 3)]
    right = np.array([name in group for name in directions.names])
    known = left = 0
    for i in range(draws):
        values = [sets.log_evidence(along[i]) - np.log(len(sets.effects)) for sets in choices]
        values.append(beside[i] - np.log(len(beside[i])))
        best = int(np.argmax([v.max() for v in values]))
        where = int(np.argmax(values[best]))
        known += bool(right[where] if best == len(choices) else right[choices[best].effects[where]].any())
        weights = np.array([logsumexp(v) for v in values])
        left += bool(weights[-1] > logsumexp(weights[:-1]))
    return {"known": known / draws, "remains": left / draws}


def _beside_remainder(geo: Geometry, directions: Directions, data: Array) -> Array:
    """(m, names) log evidence of one effect and a smooth remainder, against neither, for data (m, R)."""
    found, count = np.full((len(data), len(directions.units)), -np.inf), 0
    for vectors, spread in _remainders(geo):
        turned, units = data @ vectors, directions.units @ vectors
        weight = 1.0 / (1.0 + spread)
        gram, pull = (units**2) @ weight, (turned * weight) @ units.T
        base = 0.5 * (turned**2 @ (1.0 - weight)) - 0.5 * np.log1p(spread).sum()
        with np.errstate(divide="ignore"):
            each = base[:, None] - 0.5 * np.log(gram) + 0.5 * pull**2 / gram + np.log(pull > 0) + _log_amplitude()
        found, count = np.logaddexp(found, each), count + 1
    out = np.full((len(data), len(directions.names)), -np.inf)
    for i in np.unique(directions.owner):
        own = directions.owner == i
        out[:, i] = logsumexp(found[:, own], axis=1) - np.log(own.sum() * count)
    return out


def _remainders(geo: Geometry) -> Iterator[tuple[Array, Array]]:
    """Smooth remainders of several shapes and sizes: principal directions (R, R) and their variances (R,)."""
    for kernel in gaussian_process(geo.rig, np.ones(len(geo.plain), dtype=bool)):
        inner = solve_triangular(geo.chol, solve_triangular(geo.chol, kernel, lower=True).T, lower=True)
        inner = inner - geo.basis @ (geo.basis.T @ inner)
        inner = inner - (inner @ geo.basis) @ geo.basis.T
        values, vectors = np.linalg.eigh(0.5 * (inner + inner.T))
        values = np.maximum(values, 0.0)
        for delta in np.geomspace(*DELTA_RANGE, REMAINDER_SIZES):
            yield vectors, delta**2 / values.sum() * values


def left_over(geo: Geometry, directions: Directions, z: Array, most: int) -> dict[str, Any]:
    """What the best catalogue effects, one, two and so on up to `most`, leave of a signature `z` (R,).

    Returns
    -------
    For each number of effects the delta that is left, the power of a test of the residuals' length that knows the
    noise, and the effects.
    """
    along, whole = directions.units @ z, float(z @ z)
    out: dict[str, Any] = {}
    best, names = 0.0, []
    for size in range(1, most + 1):
        sets = Sets.of(directions, size)
        explained = sets.explained(along)
        top = int(np.argmax(explained))
        if explained[top] > best:
            best = float(explained[top])
            names = [directions.names[i] for i in directions.owner[sets.members[top]]]
        left = max(whole - best, 0.0)
        degrees = len(z) - geo.basis.shape[1] - size
        power = float(ncx2.sf(chi2.isf(LEVEL, degrees), degrees, max(left, 1e-9)))
        out[str(size)] = {"delta": left**0.5, "power": power, "names": sorted(names)}
    return out

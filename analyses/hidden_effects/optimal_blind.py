"""The ideal judge of `optimal_sets` once more, who knows neither the noise nor how many effects hide.

It still knows the true parameters, how the readings of each bench err relative to each other, and the direction of
every signature. How large errors are, and how large the setting errors among them, it does not: both are integrated
out, as `discover` does. A hold that is out of place may then be a slip or a setting error, and a file of a dozen holds
hardly says which. The prior over numbers of effects is that of `discover`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular
from scipy.special import gammaln, logsumexp

from wirebayes.discovery.settings import INCLUSION, MORE, UNKNOWN_WEIGHT

from .baselines import gaussian_process
from .delta import Geometry, derivatives
from .optimal_sets import DELTA_RANGE, REMAINDER_SIZES, Directions, Sets, noise_draws
from .rig import Array, Mask

# variance of setting errors in true ones, half a decade apart: from none to all
SETTING = np.logspace(-3.0, 3.0, 13)
LARGEST_SET = 3
EVALUATED_AT_ONCE = 30_000  # sets times data sets: what stays in the processor's cache
NEGLIGIBLE = 1e-9  # share of the largest variance of a smooth remainder: of no size that a reading shows


@dataclass(frozen=True)
class Metric:
    """Inner products in the metric of one guess of the noise, what the plain parameters absorb taken out.

    Attributes
    ----------
    log_volume : of the noise and of the plain parameters.
    gram : of the directions, (c, c).
    along : of the data sets with the directions, (m, c).
    square : of each data set with itself, (m,).
    """

    log_volume: float
    gram: Array
    along: Array
    square: Array


def metrics(geo: Geometry, units: Array, data: Array, remainder: bool = False) -> Iterator[Metric]:
    """One metric for each size of setting errors, or for each and each smooth remainder beside them.

    The noise differs from the true one in a few directions alone: those of the setting errors and of the remainder.

    Parameters
    ----------
    units, data : rows (c, R) and (m, R), whitened by the true noise.
    remainder : whether there is a smooth remainder, of several shapes and sizes.
    """
    by_eta = derivatives(geo.rig)[2]
    sd = np.concatenate([np.full(len(b.holds), b.setting_sd) for b in geo.rig.benches])
    setting = solve_triangular(geo.chol, by_eta * sd, lower=True)
    rows = np.vstack([units, data])
    for smooth in _remainders(geo) if remainder else [np.zeros((len(setting), 0))]:
        core, _ = np.linalg.qr(np.hstack([setting, smooth, geo.basis]))
        within = rows @ core
        outside = rows - within @ core.T  # where the noise is the true one
        by_setting, by_remainder, basis = (part.T @ core for part in (setting, smooth, geo.basis))
        common = outside @ outside[: len(units)].T
        own = np.einsum("ij,ij->i", outside, outside)
        sizes = np.geomspace(*DELTA_RANGE, REMAINDER_SIZES) if remainder else [0.0]
        for factor in SETTING:
            noise = np.eye(core.shape[1]) + (factor - 1.0) * by_setting.T @ by_setting
            for delta in sizes:
                chol = np.linalg.cholesky(noise + delta**2 * by_remainder.T @ by_remainder)
                absorbed, x = (solve_triangular(chol, part.T, lower=True) for part in (basis, within))
                q, triangle = np.linalg.qr(absorbed)
                x = (x - q @ (q.T @ x)).T
                volume = np.log(np.diag(chol)).sum() + np.log(np.abs(np.diag(triangle))).sum()
                products = common + x @ x[: len(units)].T
                square = own + np.einsum("ij,ij->i", x, x)
                yield Metric(-float(volume), products[: len(units)], products[len(units) :], square[len(units) :])


def _remainders(geo: Geometry) -> Iterator[Array]:
    """Whitened factors (R, r) of covariances of smooth remainders; what no parameter absorbs of them has length 1."""
    for kernel in gaussian_process(geo.rig, np.ones(len(geo.plain), dtype=bool)):
        inner = solve_triangular(geo.chol, solve_triangular(geo.chol, kernel, lower=True).T, lower=True)
        values, vectors = np.linalg.eigh(0.5 * (inner + inner.T))
        kept = values > NEGLIGIBLE * values[-1]
        factor = vectors[:, kept] * np.sqrt(values[kept])
        left = factor - geo.basis @ (geo.basis.T @ factor)
        yield factor / np.linalg.norm(left)


def log_evidence(found: list[Metric], sets: Sets, degrees: int) -> Array:
    """(m, n) of each choice of effects: amplitudes and noise integrated out, candidates averaged.

    Parameters
    ----------
    found : metrics, equally likely.
    sets : sets of candidates.
    degrees : readings less plain parameters.
    """
    k = sets.members.shape[1]
    left = degrees - k
    # of amplitudes flat up to the largest delta, and of a noise whose logarithm is flat
    constant = k * (0.5 * np.log(2 * np.pi) - np.log(2 * DELTA_RANGE[1])) + gammaln(0.5 * left) - gammaln(0.5 * degrees)
    at_once = max(1, EVALUATED_AT_ONCE // len(sets.members))
    total = np.full((len(found[0].square), len(sets.members)), -np.inf)
    for metric in found:
        gram = metric.gram[sets.members[:, :, None], sets.members[:, None, :]]
        inverse = np.asarray(np.linalg.inv(gram), dtype=np.float64)
        half_log_det = 0.5 * np.log(np.asarray(np.linalg.det(gram), dtype=np.float64))
        own = Sets(sets.members, inverse, half_log_det, sets.first, sets.effects)
        for some in range(0, len(total), at_once):
            part = slice(some, some + at_once)
            explained = own.explained(metric.along[part])
            rest = np.maximum(metric.square[part, None] - np.maximum(explained, 0.0), 1e-9)
            height = constant + metric.log_volume - half_log_det - 0.5 * left * np.log(0.5 * rest)
            total[part] = np.logaddexp(total[part], np.where(np.isfinite(explained), height, -np.inf))
    counts = np.diff(np.append(sets.first, total.shape[1]))
    ends = [*sets.first[1:], total.shape[1]]
    with np.errstate(divide="ignore"):
        sums = [logsumexp(total[:, i:j], axis=1) for i, j in zip(sets.first, ends, strict=True)]
    return np.stack(sums, axis=1) - np.log(counts * len(found))


@dataclass(frozen=True)
class Answers:
    """What the judge says of some data sets.

    Attributes
    ----------
    sets : names of each set, the empty one first.
    weights : (m, sets) probability of each, with or without a remainder.
    remains : (m,) whether a remainder is likely.
    odds : (m,) log odds of anything hidden against nothing, before any prior of nothing.
    """

    sets: list[list[str]]
    weights: Array
    remains: Mask
    odds: Array

    @property
    def names(self) -> list[list[str]]:
        """Of the most probable set, a data set each."""
        return [self.sets[i] for i in np.argmax(self.weights, axis=1)]

    def inclusion(self, groups: list[list[str]]) -> Array:
        """(m, groups) probability that a name of each group is missing."""
        has = np.array([[any(name in group for name in names) for group in groups] for names in self.sets])
        return np.asarray(self.weights @ has)

    def above(self, odds: float) -> Answers:
        """Those on data sets in which more than that speaks for something hidden."""
        rows = np.flatnonzero(self.odds > odds)
        return Answers(self.sets, self.weights[rows], self.remains[rows], self.odds[rows])

    def rates(self, groups: list[list[str]]) -> dict[str, float]:
        """How often what counts is said, as shares of the data sets.

        Parameters
        ----------
        groups : for each hidden effect the names that count as right.

        Returns
        -------
        ``all``: a name from every group, ``known``: one from the first; ``all_sure``, ``known_sure``: the same with a
        probability that `discover` asks for; ``named``: one from the first, and no remainder; ``remains``: a remainder;
        ``right``: a remainder or a name from the first group; ``other``: no remainder and a name from no group.
        """
        sure = self.inclusion(groups) >= INCLUSION
        named = np.array([[any(n in group for n in names) for group in groups] for names in self.names])
        other = np.array([any(not any(n in g for g in groups) for n in names) for names in self.names])
        said = {
            "all": named.all(axis=1),
            "known": named[:, 0],
            "all_sure": sure.all(axis=1),
            "known_sure": sure[:, 0],
            "named": named[:, 0] & ~self.remains,
            "remains": self.remains,
            "right": self.remains | named[:, 0],
            "other": other & ~self.remains,
        }
        return {key: float(value.mean()) for key, value in said.items()}


def answers(geo: Geometry, directions: Directions, z: Array, rng: np.random.Generator, draws: int = 50) -> Answers:
    """The most probable set of up to three effects, and a remainder alone or beside one, with the prior of `discover`.

    Parameters
    ----------
    z : signature of everything hidden, (R,).
    """
    data = z + noise_draws(geo, rng, draws)
    degrees = len(z) - geo.basis.shape[1]
    bare, more = (list(metrics(geo, directions.units, data, remainder)) for remainder in (False, True))
    every = [Sets.of(directions, size) for size in range(LARGEST_SET + 1)]
    names = [[directions.names[i] for i in line] for sets in every for line in sets.effects]
    nothing = log_evidence(bare, every[0], degrees)[:, 0]
    without = [np.full((draws, 1), -np.inf)]  # nothing at all is no answer
    for sets in every[1:]:
        size = sets.members.shape[1]
        prior = (size - 1) * np.log(MORE) + np.log(len(every[1].effects) / len(sets.effects))
        without.append(log_evidence(bare, sets, degrees) + prior)
    of_remainder = UNKNOWN_WEIGHT, MORE  # alone, and beside one effect
    beside = [log_evidence(more, sets, degrees) + np.log(w) for sets, w in zip(every, of_remainder, strict=False)]
    alone, remainder = np.concatenate(without, axis=1), np.concatenate(beside, axis=1)
    either = alone.copy()
    either[:, : remainder.shape[1]] = np.logaddexp(alone[:, : remainder.shape[1]], remainder)
    remains = logsumexp(remainder, axis=1) > logsumexp(alone, axis=1)
    odds = np.asarray(logsumexp(either, axis=1) - nothing)
    weights = np.exp(either - logsumexp(either, axis=1, keepdims=True))
    return Answers(names, weights, np.asarray(remains), odds)

"""Amplitudes on which the readings depend linearly, integrated out of a posterior and drawn afterwards.

Given all other parameters, such amplitudes are normal if their priors are. So the sampler works on the posterior of the
other parameters, with the amplitudes integrated out, and each of its draws is completed by a draw of the amplitudes:
together, a draw of the whole posterior.
"""

from collections.abc import Container, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.random import Generator

from wirebayes.model import likelihoods
from wirebayes.model.hold_filter import Measured
from wirebayes.model.problem import Problem
from wirebayes.model.sample import Sample
from wirebayes.numeric import linear_algebra
from wirebayes.numeric.any_distribution import ours
from wirebayes.numeric.distributions import Normal
from wirebayes.numeric.typing import Array
from wirebayes.wire.effect import Effect
from wirebayes.wire.staircase import Linearised, simulate

_ROWS = 2048  # draws completed at once
# relative; far more than rounding errors of parameters that fit, far less than a log-likelihood has to resolve
_ROUNDING = 1e-6


@dataclass(frozen=True)
class MarginalisedProblem(Problem):
    """A problem with its linear amplitudes integrated out.

    Attributes
    ----------
    whole : Problem
        The one with all parameters.
    columns : tuple of str
        What was integrated out and shows in the readings; the rest of it follows its prior.
    shapes : tuple of (H, R, k) arrays
        What one of each adds to the readings of each sample, N.
    mean, sd : (k,) arrays
        Of their priors.
    """

    whole: Problem = None  # type: ignore[assignment]
    columns: tuple[str, ...] = ()
    shapes: tuple[Array, ...] = ()
    mean: Array = None  # type: ignore[assignment]
    sd: Array = None  # type: ignore[assignment]

    def log_likelihood(self, theta: Array, readings: Any = None) -> Array:
        """(n,) log-likelihood of the other parameters; -inf where the model cannot be computed."""
        with np.errstate(all="ignore"):
            lines = self._lines(theta, readings)
            seen = self._seen(lines)
            if _are_linear(lines):
                return self._log_likelihood(seen)
            best = seen.amplitudes(seen.along)
            height: Any = 0.0
            for line, without in self._without(theta, lines, best):
                height = height + likelihoods.chain(line, without).log_likelihood.sum(axis=0)
            return self._at_best(seen, best, height)

    def standardised(self, theta: Array, readings: Any = None) -> tuple[Array, Array]:
        """(n,) log-likelihood of the other parameters, and (m, n) residuals with the amplitudes at their best."""
        with np.errstate(all="ignore"):
            lines = self._lines(theta, readings)
            seen = self._seen(lines)
            best = seen.amplitudes(seen.along)
            height: Any = 0.0
            residuals = []
            for line, without in self._without(theta, lines, best):
                value, left = likelihoods.standardised(line, without)
                height = height + value
                residuals.append(left)
            residuals += [best.T, np.log(seen.diagonal.T)]
            total = self._log_likelihood(seen) if _are_linear(lines) else self._at_best(seen, best, height)
            return total, np.concatenate(residuals)

    def _without(self, theta: Array, lines: Sequence["_Line"], best: Array) -> list["_Line"]:
        """The samples with readings less what amplitudes (n, k) add, in standard deviations of their priors.

        Holds that may be slack are expanded about what is read of them, so their samples are linearised anew.
        """
        out = []
        for sample, shapes, (line, measured) in zip(self.samples, self.shapes, lines, strict=True):
            added = np.einsum("hrk,nk->hrn", shapes * self.sd, best)
            without = replace(measured, readings=measured.readings - added)
            if line.edges is not None:
                line, without = self.linearised(theta, sample, without.readings)
            out.append((line, without))
        return out

    def _at_best(self, seen: "_Seen", best: Array, height: Array) -> Array:
        """(n,) log-likelihood where setting errors may leave the wire slack.

        Readings then are no linear function of the setting errors, and what is linear about those of no amplitudes may
        be far off: so the density at the best amplitudes is evaluated itself (Laplace's approximation).

        Parameters
        ----------
        seen : _Seen
        best : (n, k) array
            Amplitudes, in standard deviations of their priors.
        height : (n,) array
            Log-likelihood with these.
        """
        off = best - self.mean / self.sd
        total = height - 0.5 * (off**2).sum(axis=1) - np.log(seen.diagonal).sum(axis=1)
        return np.where(seen.is_precise & np.isfinite(total), total, -np.inf)

    def _lines(self, theta: Array, readings: Any) -> list["_Line"]:
        return [self.linearised(theta, sample, y) for sample, y in self.observed(readings)]

    def _log_likelihood(self, seen: "_Seen") -> Array:
        explained = (seen.along**2).sum(axis=1)
        # At absurd parameters rounding may make more of the readings than there is to explain.
        regular = seen.is_precise & (explained <= (1.0 + _ROUNDING) * seen.square)
        by_prior = ((self.mean / self.sd) ** 2).sum()
        total = seen.total + 0.5 * (explained - by_prior) - np.log(seen.diagonal).sum(axis=1)
        return np.where(regular & np.isfinite(total), total, -np.inf)

    def drawn(self, theta: Array, rng: Generator) -> tuple[Array, Array]:
        """(n, k) amplitudes given the other parameters, and (n,) the log density of being drawn."""
        parts = [self._drawn(theta[i : i + _ROWS], rng) for i in range(0, len(theta), _ROWS)]
        amplitudes, log_density = zip(*parts, strict=True)
        return np.concatenate(amplitudes), np.concatenate(log_density)

    def _drawn(self, theta: Array, rng: Generator) -> tuple[Array, Array]:
        """The same of a few."""
        seen = self._seen(self._lines(theta, None))
        normal = rng.normal(size=seen.along.shape)
        amplitudes = seen.amplitudes(seen.along + normal) * self.sd
        log_densities = np.log(seen.diagonal) - 0.5 * normal**2 - 0.5 * np.log(2.0 * np.pi)
        log_volume = np.log(self.sd).sum()
        return amplitudes, log_densities.sum(axis=1) - log_volume

    def _seen(self, lines: Sequence["_Line"]) -> "_Seen":
        """What the readings say of the amplitudes."""
        expected = self.mean / self.sd
        total: Any = 0.0
        square: Any = (expected**2).sum()
        precision: Any = np.eye(len(self.sd))
        pull: Any = expected
        for shapes, (line, measured) in zip(self.shapes, lines, strict=True):
            by_side = likelihoods.on_sides(line, measured)
            gram, along = likelihoods.seen(by_side.line, by_side.filtered, measured, shapes * self.sd)
            precision = precision + gram
            pull = pull + along
            height = (by_side.filtered.log_likelihood + by_side.beside).sum(axis=0)
            total = total + height
            log_volume = measured.mask.sum() * np.log(2.0 * np.pi * measured.variance)
            square = square - 2.0 * height - log_volume
        return _Seen.of(total, square, precision, pull)


_Line = tuple[Linearised, Measured]


@dataclass(frozen=True)
class _Seen:
    """What readings say of the amplitudes, in standard deviations of their priors.

    Attributes
    ----------
    total : (n,)
        Log-likelihood of no amplitudes.
    square : (n,)
        No less than what there is to explain, prior included.
    factor : (n, k, k)
        Lower Cholesky factor of the posterior precision, which is no less than one.
    along : (n, k)
        Its transpose times the posterior mean.
    """

    total: Array
    square: Array
    factor: Array
    along: Array

    @classmethod
    def of(cls, total: Array, square: Array, precision: Array, pull: Array) -> "_Seen":
        """The same by the posterior precision, without a likelihood where that has no factor.

        Parameters
        ----------
        total, square : (n,) arrays
        precision : (n, k, k) array
        pull : (n, k) array
            Its product with the posterior mean.
        """
        factor = linear_algebra.cholesky(precision)
        finite = np.isfinite(factor).all(axis=(1, 2))
        factor[~finite] = np.eye(pull.shape[1])
        along = np.linalg.solve(factor, pull[..., None])[..., 0]
        return cls(np.where(finite, total, -np.inf), square, factor, along)

    @property
    def diagonal(self) -> Array:
        """(n, k) of the factor."""
        return np.einsum("nii->ni", self.factor)

    @property
    def is_precise(self) -> Array:
        """(n,) whether rounding has left the precision no less than one."""
        return np.asarray((self.diagonal > 1.0 - _ROUNDING).all(axis=1))

    def amplitudes(self, along: Array) -> Array:
        """(n, k) those whose product with the factor's transpose is `along` (n, k)."""
        inverse = np.swapaxes(linear_algebra.inv(self.factor), 1, 2)
        return (inverse @ along[..., None])[..., 0]


def _are_linear(lines: Sequence[_Line]) -> bool:
    """Whether no setting error can leave the wire slack: the readings are then linear in these errors, too."""
    return all(line.edges is None for line, _ in lines)


def integrated(problem: Problem) -> Problem:
    """The problem with the amplitudes integrated out that it depends on linearly; itself where there are none.

    That are those of effects that only add to the reading, if no other effect comes after them and their priors are
    normal.
    """
    additive = _additive_effects(problem)
    columns = [column for effect in additive.values() for column in effect.columns()]
    gone = [column for column in columns if column in problem.names]
    if not gone or problem.likelihood != "chain":
        return problem
    priors = [ours(problem.prior.distributions[column]) for column in gone]
    if not all(isinstance(prior, Normal) for prior in priors):
        return problem
    shapes = [_shapes(problem, i, gone) for i in range(len(problem.samples))]
    shows = np.any([(shape != 0).any(axis=(0, 1)) for shape in shapes], axis=0)
    left = {name: prior for name, prior in problem.prior.distributions.items() if name not in gone}
    mean = np.array([prior.mean() for prior in priors])
    sd = np.array([prior.std() for prior in priors])
    return MarginalisedProblem(
        tuple(_without(sample, additive) for sample in problem.samples),
        replace(problem.prior, distributions=left),
        "chain",
        scales=problem.scales,
        units=problem.units,
        stated=problem.stated,
        told=problem.told,
        whole=problem,
        columns=tuple(np.array(gone)[shows]),
        shapes=tuple(shape[..., shows] for shape in shapes),
        mean=mean[shows],
        sd=sd[shows],
    )


def _additive_effects(problem: Problem) -> dict[str, Effect]:
    """The effects, by key, that only add to the reading of a sample, and come last of all that act on it."""
    found = {}
    for sample in problem.samples:
        for effect in sample.model.at("reading")[-1:]:
            if effect.adds:
                found[effect.key] = effect
    return found


def _without(sample: Sample, effects: Container[str]) -> Sample:
    kept = tuple(effect for effect in sample.model.effects if effect.key not in effects)
    return replace(sample, model=replace(sample.model, effects=kept))


def completed(problem: Problem, theta: Array, rng: Generator) -> tuple[Problem, Array, Array]:
    """Draws with everything that was integrated out.

    Parameters
    ----------
    problem : Problem
        As `integrated` returned it.
    theta : (n, d) array
        Draws of its posterior.
    rng : numpy Generator

    Returns
    -------
    The problem with all parameters, draws (n, D) of its posterior, and (n,) the log density of what was drawn here.
    """
    if not isinstance(problem, MarginalisedProblem):
        return problem, theta, np.zeros(len(theta))
    amplitudes, log_density = problem.drawn(theta, rng)
    names = [*problem.names, *problem.columns]
    columns = [*theta.T, *amplitudes.T]
    values = dict(zip(names, columns, strict=True))
    whole = problem.whole
    for name, distribution in whole.prior.distributions.items():
        if name not in values:
            values[name] = distribution.rvs(len(theta), random_state=rng)
            log_density = log_density + distribution.logpdf(values[name])
    return whole, np.column_stack([values[name] for name in whole.names]), log_density


def _shapes(problem: Problem, i: int, columns: list[str]) -> Array:
    """(H, R, k) what one of each amplitude adds to the readings of a sample, at any place of the other parameters."""
    sample = problem.samples[i]
    theta = np.array([[d.median() for d in problem.prior.distributions.values()]]).repeat(1 + len(columns), axis=0)
    where = [problem.names.index(c) for c in columns]
    theta[:, where] = np.vstack([np.zeros(len(columns)), np.eye(len(columns))])
    made = simulate(sample.protocol, problem.parameters(theta, sample), sample.model)
    return made[..., 1:] - made[..., :1]

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
from wirebayes.model.problem import Problem
from wirebayes.model.sample import Sample
from wirebayes.numeric import linear_algebra
from wirebayes.numeric.distributions import Normal, ours
from wirebayes.numeric.typing import Array
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
            return self._log_likelihood(self._seen(self._lines(theta), readings))

    def standardised(self, theta: Array, readings: Any = None) -> tuple[Array, Array]:
        """(n,) log-likelihood of the other parameters, and (m, n) residuals with the amplitudes at their best."""
        residuals = []
        with np.errstate(all="ignore"):
            lines = self._lines(theta)
            seen = self._seen(lines, readings)
            best = (np.swapaxes(linear_algebra.inv(seen.factor), 1, 2) @ seen.along[..., None])[..., 0].T
            for i, (sample, (line, variance, setting_sd)) in enumerate(zip(self.samples, lines, strict=True)):
                y = sample.readings if readings is None else readings[i]
                left = y - np.einsum("hrk,kn->hrn", self.shapes[i] * self.sd, best)
                residuals.append(likelihoods.standardised(line, left, sample.protocol.mask, variance, setting_sd)[1])
            return self._log_likelihood(seen), np.concatenate([*residuals, best, np.log(seen.diagonal.T)])

    def _lines(self, theta: Array) -> list[tuple[Linearised, Array, Array]]:
        return [self.linearised(theta, sample) for sample in self.samples]

    def _log_likelihood(self, seen: "_Seen") -> Array:
        explained = (seen.along**2).sum(axis=1)
        # At absurd parameters rounding may make more of the readings than there is to explain.
        regular = (seen.diagonal > 1.0 - _ROUNDING).all(axis=1) & (explained <= (1.0 + _ROUNDING) * seen.square)
        total = seen.total + 0.5 * (explained - ((self.mean / self.sd) ** 2).sum()) - np.log(seen.diagonal).sum(axis=1)
        return np.where(regular & np.isfinite(total), total, -np.inf)

    def drawn(self, theta: Array, rng: Generator) -> tuple[Array, Array]:
        """(n, k) amplitudes given the other parameters, and (n,) the log density of being drawn."""
        seen = self._seen(self._lines(theta), None)
        normal = rng.normal(size=seen.along.shape)
        inverse = np.swapaxes(linear_algebra.inv(seen.factor), 1, 2)
        amplitudes = (inverse @ (seen.along + normal)[..., None])[..., 0] * self.sd
        log_density = (np.log(seen.diagonal) - 0.5 * normal**2 - 0.5 * np.log(2.0 * np.pi)).sum(axis=1)
        return amplitudes, log_density - np.log(self.sd).sum()

    def _seen(self, lines: Sequence[tuple[Linearised, Array, Array]], readings: Any) -> "_Seen":
        """What the readings say of the amplitudes."""
        total: Any = 0.0
        square: Any = ((self.mean / self.sd) ** 2).sum()
        precision: Any = np.eye(len(self.sd))
        pull: Any = self.mean / self.sd
        for i, sample in enumerate(self.samples):
            y, mask = sample.readings if readings is None else readings[i], sample.protocol.mask
            line, variance, setting_sd = lines[i]
            filtered = likelihoods.chain(line, y, mask, variance, setting_sd)
            gram, along = likelihoods.seen(line, filtered, y, self.shapes[i] * self.sd, mask, variance, setting_sd)
            height = filtered.log_likelihood.sum(axis=0)
            total = total + height
            square = square - 2.0 * height - mask.sum() * np.log(2.0 * np.pi * variance)
            precision, pull = precision + gram, pull + along
        factor = linear_algebra.cholesky(precision)
        finite = np.isfinite(factor).all(axis=(1, 2))
        factor[~finite] = np.eye(len(self.sd))
        along = np.linalg.solve(factor, pull[..., None])[..., 0]
        return _Seen(np.where(finite, total, -np.inf), square, factor, along)


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

    @property
    def diagonal(self) -> Array:
        """(n, k) of the factor."""
        return np.einsum("nii->ni", self.factor)


def integrated(problem: Problem) -> Problem:
    """The problem with the amplitudes integrated out that it depends on linearly; itself where there are none.

    That are those of effects that only add to the reading, if no other effect comes after them and their priors are
    normal.
    """
    last = {effect.key: effect for sample in problem.samples for effect in sample.model.at("reading")[-1:]}
    additive = {key: effect for key, effect in last.items() if effect.adds}
    gone = [column for effect in additive.values() for column in effect.columns() if column in problem.names]
    priors = [ours(problem.prior.distributions[column]) for column in gone]
    if not gone or problem.likelihood != "chain" or not all(isinstance(p, Normal) for p in priors):
        return problem
    shapes = [_shapes(problem, i, gone) for i in range(len(problem.samples))]
    shows = np.any([(s != 0).any(axis=(0, 1)) for s in shapes], axis=0)
    left = {name: d for name, d in problem.prior.distributions.items() if name not in gone}
    samples = tuple(_without(sample, additive) for sample in problem.samples)
    return MarginalisedProblem(
        samples,
        replace(problem.prior, distributions=left),
        "chain",
        scales=problem.scales,
        units=problem.units,
        stated=problem.stated,
        whole=problem,
        columns=tuple(np.array(gone)[shows]),
        shapes=tuple(s[..., shows] for s in shapes),
        mean=np.array([p.mean() for p in priors])[shows],
        sd=np.array([p.std() for p in priors])[shows],
    )


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
    whole = problem.whole.prior
    parts = [problem.drawn(theta[i : i + _ROWS], rng) for i in range(0, len(theta), _ROWS)]
    amplitudes, log_density = (np.concatenate(part) for part in zip(*parts, strict=True))
    values = dict(zip((*problem.names, *problem.columns), np.hstack([theta, amplitudes]).T, strict=True))
    for name in whole.names:
        if name not in values:
            values[name] = whole.distributions[name].rvs(len(theta), random_state=rng)
            log_density = log_density + whole.distributions[name].logpdf(values[name])
    return problem.whole, np.stack([values[name] for name in whole.names], axis=1), log_density


def _shapes(problem: Problem, i: int, columns: list[str]) -> Array:
    """(H, R, k) what one of each amplitude adds to the readings of a sample, at any place of the other parameters."""
    sample = problem.samples[i]
    theta = np.array([[d.median() for d in problem.prior.distributions.values()]]).repeat(1 + len(columns), axis=0)
    where = [problem.names.index(c) for c in columns]
    theta[:, where] = np.vstack([np.zeros(len(columns)), np.eye(len(columns))])
    made = simulate(sample.protocol, problem.parameters(theta, sample), sample.model)
    return made[..., 1:] - made[..., :1]

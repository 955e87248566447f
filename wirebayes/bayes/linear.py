"""Amplitudes that readings depend on linearly, integrated out of a posterior and drawn back into it.

Given everything else, such amplitudes are normal if their priors are. So what is walked is the posterior of everything
else, with them integrated out, and every draw of it is completed by a draw of them: together, a draw of the whole.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wirebayes.bayes import noise
from wirebayes.bayes.prior import Prior
from wirebayes.bayes.problem import Problem
from wirebayes.wire.staircase import linearise, simulate

Array = NDArray[Any]
_ROWS = 2048  # draws completed at once


@dataclass(frozen=True)
class Integrated(Problem):
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
            total, precision, pull = self._seen(theta, readings)
            sign, log_volume = np.linalg.slogdet(precision)
            regular = (sign > 0) & np.isfinite(log_volume)
            mean = _solved(np.where(regular[:, None, None], precision, np.eye(len(self.sd))), pull)
            total = total + 0.5 * ((pull * mean).sum(axis=1) - log_volume)
            total = total - np.log(self.sd).sum() - 0.5 * ((self.mean / self.sd) ** 2).sum()
        return np.where(regular & np.isfinite(total), total, -np.inf)

    def drawn(self, theta: Array, rng: np.random.Generator) -> tuple[Array, Array]:
        """(n, k) amplitudes given the other parameters, and (n,) the log density of being drawn."""
        _, precision, pull = self._seen(theta, None)
        root = np.linalg.cholesky(precision)
        normal = rng.normal(size=pull.shape)
        amplitudes = _solved(precision, pull) + _solved(np.swapaxes(root, 1, 2), normal)
        log_root = np.log(np.einsum("nkk->nk", root)).sum(axis=1)
        return amplitudes, log_root - 0.5 * (normal**2 + np.log(2.0 * np.pi)).sum(axis=1)

    def _seen(self, theta: Array, readings: Any) -> tuple[Array, Array, Array]:
        """Log-likelihood of no amplitudes (n,), precision of theirs (n, k, k) and its product with the mean (n, k)."""
        total: Any = 0.0
        precision: Any = np.diag(self.sd**-2.0)
        pull: Any = self.mean / self.sd**2
        for i, sample in enumerate(self.samples):
            own = self.parameters(theta, sample)
            y = sample.readings if readings is None else readings[i]
            variance = noise.reading_variance(own["sensor_sd"], sample.resolution_N)
            line = linearise(sample.protocol, own, sample.model)
            filtered = noise.chain(line, y, sample.protocol.mask, variance, own["setting_sd"])
            gram, along = noise.seen(
                line, filtered, y, self.shapes[i], sample.protocol.mask, variance, own["setting_sd"]
            )
            total = total + filtered.log_likelihood.sum(axis=0)
            precision, pull = precision + gram, pull + along
        return total, precision, pull


def integrated(problem: Problem) -> Problem:
    """The problem with the amplitudes integrated out that it depends on linearly; itself where there are none.

    That are those of effects that only add to the reading, if no other effect comes after them and their priors are
    normal.
    """
    last = {e.key: e for s in problem.samples for e in s.model.at("reading")[-1:] if e.adds}
    gone = [c for e in last.values() for c in e.columns() if c in problem.names]
    priors = [problem.prior.distributions[c] for c in gone]
    if not gone or problem.likelihood != "chain" or any(p.dist.name != "norm" for p in priors):
        return problem
    shapes = [_shapes(problem, i, gone) for i in range(len(problem.samples))]
    shows = np.any([(s != 0).any(axis=(0, 1)) for s in shapes], axis=0)
    left = {name: d for name, d in problem.prior.distributions.items() if name not in gone}
    samples = tuple(
        replace(s, model=replace(s.model, effects=tuple(e for e in s.model.effects if e.key not in last)))
        for s in problem.samples
    )
    return Integrated(
        samples, Prior(left, problem.prior.fixed, problem.prior.logarithmic), "chain", problem,
        tuple(np.array(gone)[shows]), tuple(s[..., shows] for s in shapes),
        np.array([p.mean() for p in priors])[shows], np.array([p.std() for p in priors])[shows],
    )  # fmt: skip


def completed(problem: Problem, theta: Array, rng: np.random.Generator) -> tuple[Problem, Array, Array]:
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
    if not isinstance(problem, Integrated):
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


def _solved(matrix: Array, right: Array) -> Array:
    """(n, k) solutions of a system each."""
    return np.asarray(np.linalg.solve(matrix, right[..., None])[..., 0])

"""Samples of one material fitted with the effects accepted so far, ready to be tested for one more effect."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from wirebayes.inference.climb import climb, curved
from wirebayes.inference.log_posterior import Density, LogPosterior
from wirebayes.inference.modes import modes
from wirebayes.inference.optimum import Optimum
from wirebayes.io.experiment import Experiment
from wirebayes.model.build import build
from wirebayes.model.column_units import parameter_of, unit_of_column
from wirebayes.model.linear_amplitudes import integrated
from wirebayes.model.problem import Problem
from wirebayes.model.scales import NATURAL, Scales
from wirebayes.model.spec import ModelSpec
from wirebayes.numeric.distributions import Normal
from wirebayes.numeric.typing import Array
from wirebayes.wire.effect import Effect

_FLAT = Normal(0.0, 1e9)  # a prior that no amplitude feels; in standard deviations of its own, of density
# its log density in those units, taken out again: the amplitude's own prior is not in the evidence
_LOG_FLAT = float(Normal().logpdf(0.0))


@dataclass(frozen=True)
class LaplaceFit:
    """What shares parameters, fitted in units of the tests' scales.

    Attributes
    ----------
    experiments : tuple of Experiment
        All of one material.
    effects : tuple of Effect
        Accepted so far.
    spec : ModelSpec
    target : LogPosterior
    modes : Optimum
        Distinct modes, best first.
    """

    experiments: tuple[Experiment, ...]
    effects: tuple[Effect, ...]
    spec: ModelSpec
    target: LogPosterior
    modes: Optimum

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(e.name for e in self.experiments)

    @property
    def z(self) -> Array:
        """(1, d): the best mode, as it is sampled."""
        return self.modes.z[:1]

    @property
    def theta(self) -> Array:
        """(1, d): the best parameters, in units of the tests' scales."""
        return self.target.coordinates.to_natural(self.z)

    @property
    def best(self) -> dict[str, float]:
        """The best parameters, all of them, in mm, N and s."""
        theta = self.theta
        natural = self.target.problem.theta_in(NATURAL, theta)[0]
        return dict(zip(self.target.problem.names, natural.tolist(), strict=True))

    def parameters(self, name: str) -> dict[str, float]:
        """The best parameters in mm, N and s, by the names they have where one of the experiments is fitted alone."""
        problem = self.target.problem.in_units(NATURAL)
        theta = self.theta
        natural = self.target.problem.theta_in(NATURAL, theta)
        own = problem.parameters(natural, problem.samples[self.names.index(name)])
        return {key: float(value[0]) for key, value in own.items()}

    def along(self, effect: Effect, deviations: Sequence[float], amplitude: int = 0) -> Array:
        """An effect's amplitude so many standard deviations from its best, by the normal approximation as sampled.

        Parameters
        ----------
        deviations : sequence of float
        amplitude : int
            Its number; the shape constants come after the amplitude itself.

        Returns
        -------
        array
            In its natural unit.
        """
        name = effect.columns()[amplitude]
        column = _column(self.target.problem, name)
        sd = np.sqrt(self.modes.covariance[0, column, column])
        z = np.repeat(self.z, len(deviations), axis=0)
        z[:, column] += np.asarray(deviations) * sd
        amplitudes = self.target.coordinates.to_natural(z)[:, column]
        return amplitudes * self.target.problem.units.of(self._unit(effect, name))

    def problem_with(self, effect: Effect) -> Problem:
        """The same samples with one more effect, nothing integrated out."""
        effects = (*self.effects, effect)
        problem = build(self.experiments, effects, self.spec, scales=self.scales)
        return problem.in_units(problem.own_units)

    def unit(self, effect: Effect) -> str:
        """The natural unit of an effect's amplitude, which depends on what is read."""
        return self._unit(effect, effect.amplitude_column)

    def _unit(self, effect: Effect, column: str) -> str:
        problem = self.target.problem
        here = [s for s in problem.samples if effect.acts_on(s.name, s.protocol.control)]
        with_effect = [replace(s, model=replace(s.model, effects=(effect,))) for s in here]
        return unit_of_column(column, with_effect)

    def natural_amplitude(self, effect: Effect, amplitude: float) -> float:
        """An amplitude as the block counts it, in its natural unit."""
        return amplitude * self.target.problem.units.of(self.unit(effect))

    @property
    def scales(self) -> Scales | None:
        """The scales of the tests, which its units are made of."""
        return self.target.problem.scales

    @property
    def log_evidence(self) -> float:
        return float(self.modes.log_evidence.max())


def fitted(
    experiments: Sequence[Experiment],
    effects: Sequence[Effect],
    spec: ModelSpec,
    rng: np.random.Generator,
    near: Array | None = None,
    scales: Scales | None = None,
) -> LaplaceFit:
    """Find the modes of the posterior of some experiments with some effects, from many starts.

    What the readings depend on linearly is integrated out (`wirebayes.model.linear_amplitudes`).

    Parameters
    ----------
    experiments : sequence of Experiment
        Samples of one material, fitted jointly.
    effects : sequence of Effect
    near : (d,) array, optional
        Parameters known to be good, in units of the scales: one more start.
    scales : Scales, optional
        In whose units the fit is made; those of the experiments when left out.
    """
    problem = build(experiments, effects, spec, scales=scales)
    target = LogPosterior(integrated(problem.in_units(problem.own_units)))
    extra = None if near is None else target.coordinates.to_sampled(near[None])
    found = modes(target, rng, extra)
    return LaplaceFit(tuple(experiments), tuple(effects), spec, target, found)


_HOPELESS = 12.0  # nats below the best amplitude, which no curvature makes up for
_BEST_MODES = 2  # of the fit without an effect, from which climbs with it start
_INSIDE = np.array([0.01, 0.99])  # of its prior, where a shape begins: at its ends, a score has no slope
_TOLERANCE = 1e-2  # nats that a climb may still gain: evidence is compared in tenths of a nat


class Pinned:
    """The density of a block with one more effect, its amplitude pinned row by row; shape constants stay free.

    Points lack the amplitude's column; what is left is climbed or integrated. The amplitude has a flat prior here;
    `prior` is the one it has otherwise.
    """

    def __init__(self, block: LaplaceFit, effect: Effect) -> None:
        problem = block.problem_with(effect)
        self.column = column_of(problem, effect)
        self.prior = problem.prior.distributions[problem.names[self.column]]
        self.common = [_column(problem, name) for name in effect.common_shapes()]
        named_units = [unit_of_column(problem.names[column], problem.samples) for column in self.common]
        self._units = np.array([problem.units.of(unit) for unit in named_units])
        free = problem.prior.distributions | {problem.names[self.column]: _FLAT}
        self.target = LogPosterior(replace(problem, prior=replace(problem.prior, distributions=free)))
        self._plain = block

    def starts(self, shapes: Mapping[str, float]) -> Array:
        """(k, d) starts: the best modes without the effect, its shape constants as given, or else at their medians."""
        problem = self.target.problem
        plain = self._plain.target
        best = self._plain.modes.z[:_BEST_MODES]
        natural = plain.coordinates.to_natural(best)
        known = dict(zip(plain.problem.names, natural.T, strict=True))
        theta = np.zeros((len(natural), len(problem.names)))
        for i, name in enumerate(problem.names):
            if name in known:
                theta[:, i] = known[name]
            elif i != self.column:
                prior = problem.prior.distributions[name]
                given = shapes.get(parameter_of(name), prior.median())
                theta[:, i] = np.clip(given, *prior.ppf(_INSIDE))
        sampled = self.target.coordinates.to_sampled(theta)
        return self._drop(sampled)

    def climb(self, start: Array, amplitude: Array) -> Optimum:
        """Climb every row with its own amplitude; the curvature is the expected information, which is nearly it."""

        def residuals(points: Array, rows: Array) -> tuple[Array, Array]:
            value, every = self.target.standardised(self._insert(points, amplitude[rows]))
            return value - _LOG_FLAT, every

        density = self._density(amplitude)
        return climb(
            density, start, residuals, iterations=40, tolerance=_TOLERANCE, reach=_HOPELESS, curvature_at_end=False
        )

    def curved(self, ends: Optimum, amplitude: Array) -> Optimum:
        """The ends of climbs, each with its own amplitude, with the curvature of the density itself."""
        return curved(self._density(amplitude), ends)

    def _density(self, amplitude: Array) -> Density:
        def density(points: Array, rows: Array) -> Array:
            return self.target(self._insert(points, amplitude[rows])) - _LOG_FLAT

        return density

    def shapes(self, ends: Optimum, amplitude: Array) -> tuple[Array, Array]:
        """(n, s) logarithms of the shape constants that all tests have alike, and their standard deviations.

        Parameters
        ----------
        ends : Optimum
            Where n climbs ended.
        amplitude : (n,) array
            With which.
        """
        own = [column - (column > self.column) for column in self.common]
        variance = np.diagonal(ends.covariance, axis1=1, axis2=2)[:, own]
        value = self.natural(ends.z, amplitude)[:, self.common] * self._units
        return np.log(value), np.sqrt(variance)

    def log_prior_of_shape(self, number: int, log_value: Array) -> Array:
        """(n,) log density of the logarithm of one of these constants.

        Parameters
        ----------
        number : int
            Of the constant.
        log_value : (n,) array
            Of mm, N or s.
        """
        problem = self.target.problem
        name = problem.names[self.common[number]]
        prior = problem.prior.distributions[name]
        log_own = log_value - np.log(self._units[number])
        return prior.logpdf(np.exp(log_own)) + log_own

    def natural(self, z: Array, amplitude: Array) -> Array:
        """(n, d) parameters of all columns."""
        return self.target.coordinates.to_natural(self._insert(z, amplitude))

    def _insert(self, z: Array, amplitude: Array) -> Array:
        own = amplitude / self.target.coordinates.scale[self.column]
        return np.concatenate([z[:, : self.column], own[:, None], z[:, self.column :]], axis=1)

    def _drop(self, z: Array) -> Array:
        return np.delete(z, self.column, axis=1)


def column_of(problem: Problem, effect: Effect) -> int:
    """The column of an effect's amplitude."""
    return _column(problem, effect.amplitude_column)


def _column(problem: Problem, name: str) -> int:
    """The column of a parameter of an effect, whichever material has it."""
    return next(i for i, own in enumerate(problem.names) if parameter_of(own) == name)

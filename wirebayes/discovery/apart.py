"""Do the samples that were fitted at once differ? A likelihood ratio, with p from refitted simulations."""

import numpy as np

from wirebayes.inference.climb import climb
from wirebayes.inference.laplace_fit import LaplaceFit
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.io.experiment import Experiment
from wirebayes.model.build import build
from wirebayes.model.column_units import parameter_of
from wirebayes.model.linear_amplitudes import integrated
from wirebayes.model.replicate import readings as replicate
from wirebayes.numeric.typing import Array

APART = 0.01  # level: one material of alike samples in a hundred is said to have different ones
REFITTED = 499  # p at the level is then known to .0045


def p_alike(block: LaplaceFit, rng: np.random.Generator, simulations: int = REFITTED) -> float | None:
    """Probability of samples that seem to differ at least as much, were their parameters the same.

    How much they seem to differ is by how much the log-likelihood rises where each sample has parameters of its own.

    Parameters
    ----------
    block : LaplaceFit
        Of samples that share parameters.
    rng : numpy Generator
    simulations : int
        Data sets simulated at the fit, and refitted in both ways.

    Returns
    -------
    float or None
        None of a single sample.
    """
    if len(block.experiments) == 1:
        return None
    target = block.target
    problem = target.problem
    z = np.repeat(block.z, 1 + simulations, axis=0)
    simulated_at = target.coordinates.to_natural(z[1:])
    readings = []
    for sample in problem.samples:
        simulated = replicate(problem, simulated_at, sample, rng)
        readings.append(np.concatenate([sample.readings, simulated], axis=-1))
    shared = _climbed(target, z, readings)
    gain = -problem.log_likelihood(shared, readings)
    for experiment, sample, own in zip(block.experiments, problem.samples, readings, strict=True):
        alone = _alone(block, experiment)
        start = _own_columns(alone, problem.parameters(shared, sample))
        best = _climbed(alone, alone.coordinates.to_sampled(start), [own])
        gain += alone.problem.log_likelihood(best, [own])
    as_different = int((gain[1:] >= gain[0]).sum())
    return (1 + as_different) / (1 + simulations)


def _climbed(target: LogPosterior, z: Array, readings: list[Array]) -> Array:
    """(n, d) best parameters, each row for its own readings."""
    density, residuals = target.rowwise(readings)
    found = climb(density, z, residuals, iterations=25, tolerance=1e-2, curvature_at_end=False)
    return target.coordinates.to_natural(found.z)


def _alone(block: LaplaceFit, experiment: Experiment) -> LogPosterior:
    """The posterior of one sample by itself, with the effects that act on it."""
    effects = [effect for effect in block.effects if effect.acts_on(experiment.name, experiment.control)]
    problem = build([experiment], effects, block.spec, scales=block.scales)
    return LogPosterior(integrated(problem.in_units(problem.own_units)))


def _own_columns(alone: LogPosterior, parameters: dict[str, Array]) -> Array:
    """(n, d) the parameters of one sample as its own problem has them."""
    return np.stack([parameters[parameter_of(name)] for name in alone.problem.names], axis=1)

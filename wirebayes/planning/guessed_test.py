"""A planned test on the wire that is guessed: its readings at the centre of the guess."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from wirebayes.io.experiment import Experiment
from wirebayes.model.build import build
from wirebayes.model.problem import Problem
from wirebayes.model.spec import ModelSpec
from wirebayes.numeric.frozen import frozen
from wirebayes.numeric.typing import Array
from wirebayes.wire.model import PLAIN, Model
from wirebayes.wire.staircase import simulate

Guess = Mapping[str, Array]


def central(guess: Guess) -> dict[str, float]:
    """The median of each parameter."""
    return {name: float(np.median(values)) for name, values in guess.items()}


def as_guessed(problem: Problem, guessed: Model) -> Problem:
    """A planned test's problem, whose effects refer to the tension and the hold that those of a guess refer to.

    Parameters
    ----------
    problem : Problem
    guessed : Model
        Of the fit that the guess comes from.
    """
    samples = []
    for sample in problem.samples:
        model = replace(sample.model, tension_ref_N=guessed.tension_ref_N, typical=guessed.typical)
        samples.append(replace(sample, model=model))
    return replace(problem, samples=tuple(samples))


def at_centre(test: Experiment, guess: Guess, spec: ModelSpec, guessed: Model = PLAIN) -> Experiment:
    """The test with the readings, tensions or displacements, that the guess's centre gives without errors.

    Parameters
    ----------
    test : Experiment
        The planned test; the readings that it holds are replaced.
    guess : mapping of name to (n,) array
    spec : ModelSpec
    guessed : Model
        Of the guess; its effects act on the test, too.
    """
    problem = as_guessed(build([test], guessed.effects, spec), guessed)
    (sample,) = problem.samples
    centre = {name: np.array([value]) for name, value in central(guess).items()}
    read = simulate(sample.protocol, centre, sample.model)[..., 0]
    holds = []
    for hold, row, mask in zip(test.holds, read, sample.protocol.mask, strict=True):
        if hold.recorded:
            hold = replace(hold, readings=frozen(row[mask].tolist()))
        holds.append(hold)
    return replace(test, holds=tuple(holds))


def middle_tension(test: Experiment) -> float:
    """The middle one of the tensions with which the holds of a test begin, N."""
    first = [np.ravel(hold.tension_N)[0] for hold in test.recorded_holds]
    return float(np.median(first))

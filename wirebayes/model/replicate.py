"""Readings drawn from the model: replicates with setting, sensor and rounding error, entering exactly."""

import numpy as np

from wirebayes.model.problem import Problem
from wirebayes.model.sample import Sample
from wirebayes.model.single_holds import hold_courses
from wirebayes.numeric.typing import Array
from wirebayes.wire.staircase import simulate


def readings(problem: Problem, theta: Array, sample: Sample, rng: np.random.Generator) -> Array:
    """(H, R, n) simulated readings of one sample, one replicate a row of `theta` (n, d).

    Hold by hold, each replicate starts from the measured first reading, which stays as it is.

    Parameters
    ----------
    problem : Problem
        Says which likelihood holds and which column is which parameter.
    theta : (n, d) array
        Parameters, for instance draws of a posterior.
    sample : Sample
        The test that is repeated: its protocol, its model and its resolution.

    Returns
    -------
    (H, R, n) array
        N, or mm where the tension is set, rounded to the sample's resolution; entries outside the protocol's mask mean
        nothing.
    """
    own = problem.parameters(theta, sample)
    protocol, n = sample.protocol, len(theta)
    holds, width = protocol.time_s.shape
    noise = rng.normal(size=(holds, width, n)) * own["sensor_sd"]
    if problem.likelihood == "hold":
        # The first reading carries noise, so what it says of the length does too.
        first = sample.readings[:, 0] - noise[:, 0]
        out = np.zeros((holds, width, n))
        for j, course in enumerate(hold_courses(protocol, own, sample.model, first)):
            if course is not None:
                out[j] = course[0] + noise[j]
    else:
        setting = rng.normal(size=(holds, n)) * own["setting_sd"]
        out = simulate(protocol, own, sample.model, setting) + noise
    return rounded(out, sample.resolution)


def rounded(readings: Array, resolution: float) -> Array:
    """Readings as the instrument writes them down."""
    return readings if resolution == 0 else np.round(readings / resolution) * resolution

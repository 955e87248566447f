"""Readings drawn from the model: replicates with setting, sensor and rounding error, entering exactly."""

import numpy as np

from wirebayes.model.problem import Problem
from wirebayes.model.sample import Sample
from wirebayes.model.single_holds import from_first_readings
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
    protocol = sample.protocol
    holds, width = protocol.time_s.shape
    n = len(theta)
    noise = rng.normal(size=(holds, width, n)) * own["sensor_sd"]
    if problem.likelihood == "hold":
        first = sample.readings[:, 0, 0]
        read = from_first_readings(protocol, own, sample.model, first, noise)
    else:
        setting_error = rng.normal(size=(holds, n)) * own["setting_sd"]
        read = simulate(protocol, own, sample.model, setting_error) + noise
    return rounded(read, sample.resolution)


def rounded(readings: Array, resolution: float) -> Array:
    """Readings as the instrument writes them down."""
    return readings if resolution == 0 else np.round(readings / resolution) * resolution

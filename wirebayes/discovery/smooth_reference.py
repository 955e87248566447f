"""The reference for something unknown: a smooth discrepancy over hold and time, as a few functions of the readings."""

import numpy as np

from wirebayes.typing import Array
from wirebayes.wire.protocol import Protocol

FUNCTIONS = 16  # they hold 99 % of the process's variance on the paper's protocols


def basis(protocol: Protocol, scale_N: float) -> Array:
    """(H, R, q) functions whose independent unit-normal combinations are the Gaussian process, N.

    The covariance is a product: over the order of holds (smooth, or wandering so that a step is not excluded) and over
    displacement (which differ once the wire is unloaded), times over the time within the hold (constant, or smooth
    in its logarithm). Zero where there is no reading.
    """
    mask = protocol.mask
    j, r = np.nonzero(mask)
    holds = len(protocol.displacement_mm)
    order = j / max(holds - 1, 1)
    span = np.ptp(protocol.displacement_mm) or 1.0
    place = (protocol.displacement_mm[j] - protocol.displacement_mm.min()) / span
    typical = np.median(protocol.time_s[mask][protocol.time_s[mask] > 0]) if (protocol.time_s[mask] > 0).any() else 1.0
    time = np.log1p(protocol.time_s[j, r] / (0.2 * typical))
    over_hold = 0.5 * _smooth(order, 0.3) + 0.5 * np.minimum(order[:, None], order[None]) + 0.5 * _smooth(place, 0.3)
    over_time = 0.5 + 0.5 * _smooth(time, 0.7)
    values, vectors = np.linalg.eigh(over_hold * over_time)
    top = np.argsort(values)[::-1][:FUNCTIONS]
    out = np.zeros((*mask.shape, len(top)))
    out[j, r] = vectors[:, top] * np.sqrt(np.maximum(values[top], 0.0)) * scale_N
    return out


def _smooth(x: Array, length: float) -> Array:
    return np.asarray(np.exp(-0.5 * ((x[:, None] - x[None]) / length) ** 2))

"""The reference for something unknown: a smooth discrepancy over hold and time, as a few functions of the readings."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wirebayes.discovery.settings import HOLD_LENGTHS, TIME_LENGTHS
from wirebayes.typing import Array
from wirebayes.wire.protocol import Protocol

FUNCTIONS = 16  # they hold 99 % of the process's variance on the paper's protocols
SHORT_FUNCTIONS = 40  # of the other processes; short lengths need more to hold 99 % of their variance


@dataclass(frozen=True)
class _Readings:
    """(N,) of every reading: number of its hold, displacement above the least, logarithm of its time in the hold."""

    hold: NDArray[np.int64]
    place: Array
    time: Array

    @staticmethod
    def of(protocol: Protocol) -> "_Readings":
        mask = protocol.mask
        j, r = np.nonzero(mask)
        later = protocol.time_s[mask][protocol.time_s[mask] > 0]
        typical = np.median(later) if len(later) else 1.0
        place = protocol.displacement_mm[j] - protocol.displacement_mm.min()
        return _Readings(j, place, np.log1p(protocol.time_s[j, r] / (0.2 * typical)))


def basis(protocol: Protocol, scale_N: float) -> Array:
    """(H, R, q) functions whose independent unit-normal combinations are the Gaussian process, N.

    The covariance is a product: over the order of holds (smooth, or wandering so that a step is not excluded) and over
    displacement (which differ once the wire is unloaded), times over the time within the hold (constant, or smooth
    in its logarithm). Zero where there is no reading.
    """
    at = _Readings.of(protocol)
    order = at.hold / max(len(protocol.displacement_mm) - 1, 1)
    place = at.place / (np.ptp(protocol.displacement_mm) or 1.0)
    over_hold = 0.5 * _smooth(order, 0.3) + 0.5 * np.minimum(order[:, None], order[None]) + 0.5 * _smooth(place, 0.3)
    return _functions(protocol, over_hold * (0.5 + 0.5 * _smooth(at.time, 0.7)), FUNCTIONS) * scale_N


def family(protocol: Protocol) -> list[Array]:
    """(H, R, q) functions of several processes, N: that of `basis`, and local to global ones over holds and over time.

    Nobody knows which of them something unknown resembles, so its evidence is the mean of theirs. By `basis` alone a
    deviation of a few holds, or early in each, was no remainder, and was given the name of an effect.
    """
    at = _Readings.of(protocol)
    kernels = [_smooth(at.hold, holds) * _smooth(at.time, times) for holds in HOLD_LENGTHS for times in TIME_LENGTHS]
    return [basis(protocol, 1.0), *(_functions(protocol, kernel, SHORT_FUNCTIONS) for kernel in kernels)]


def _functions(protocol: Protocol, covariance: Array, most: int) -> Array:
    """(H, R, q) functions that make up a covariance (N, N) of the readings; zero where there is no reading."""
    values, vectors = np.linalg.eigh(covariance)
    top = np.argsort(values)[::-1][:most]
    out = np.zeros((*protocol.mask.shape, len(top)))
    out[np.nonzero(protocol.mask)] = vectors[:, top] * np.sqrt(np.maximum(values[top], 0.0))
    return out


def _smooth(x: Array | NDArray[np.int64], length: float) -> Array:
    return np.asarray(np.exp(-0.5 * ((x[:, None] - x[None]) / length) ** 2))

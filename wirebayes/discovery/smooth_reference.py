"""The reference for something unknown: a smooth discrepancy over hold and time, as a few functions of the readings."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from wirebayes.discovery.settings import HOLD_LENGTHS, TIME_LENGTHS
from wirebayes.numeric.evenly import evenly
from wirebayes.numeric.rows import rows_of
from wirebayes.numeric.typing import Array, Ints
from wirebayes.wire.protocol import Protocol

FUNCTIONS = 16  # they hold 99 % of the process's variance on the paper's protocols
SHORT_FUNCTIONS = 40  # of the other processes; short lengths need more to hold 99 % of their variance
_DECOMPOSED = 600  # readings, at most, whose covariance is decomposed: smooth functions of more follow from these
_LEAST = 1e-6  # of the largest function's size: smaller ones are rounding errors, and would be divided by themselves


@dataclass(frozen=True)
class _Readings:
    """(N,) of every reading: number of its hold, displacement above the least, logarithm of its time in the hold."""

    hold: Ints
    place: Array
    time: Array

    @staticmethod
    def of(protocol: Protocol) -> "_Readings":
        mask = protocol.mask
        j, r = np.nonzero(mask)
        later = protocol.time_s[mask][protocol.time_s[mask] > 0]
        typical = np.median(later) if len(later) else 1.0
        place = protocol.setting[j] - protocol.setting.min()
        return _Readings(j, place, np.log1p(protocol.time_s[j, r] / (0.2 * typical)))

    def rows(self, which: Ints) -> "_Readings":
        """Some of the readings."""
        return rows_of(self, which)


_Covariance = Callable[[_Readings, _Readings], Array]


def basis(protocol: Protocol) -> Array:
    """(H, R, q) functions whose independent unit-normal combinations are the Gaussian process, N.

    The covariance is a product: over the order of holds (smooth, or wandering so that a step is not excluded) and over
    displacement (which differ once the wire is unloaded), times over the time within the hold (constant, or smooth
    in its logarithm). Zero where there is no reading.
    """
    holds = max(len(protocol.setting) - 1, 1)
    reach = np.ptp(protocol.setting) or 1.0  # of unrecorded holds, too

    def covariance(one: _Readings, other: _Readings) -> Array:
        orders = one.hold / holds, other.hold / holds
        over_hold = 0.5 * _smooth(*orders, 0.3) + 0.5 * np.minimum.outer(*orders)
        over_hold += 0.5 * _smooth(one.place / reach, other.place / reach, 0.3)
        return over_hold * (0.5 + 0.5 * _smooth(one.time, other.time, 0.7))

    return _functions(protocol, covariance, FUNCTIONS)


def family(protocol: Protocol) -> list[Array]:
    """(H, R, q) functions of several processes, N: that of `basis`, and local to global ones over holds and over time.

    Nobody knows which of them something unknown resembles, so its evidence is the mean of theirs. By `basis` alone a
    deviation of a few holds, or early in each, was no remainder, and was given the name of an effect.
    """

    def product(holds: float, times: float) -> _Covariance:
        return lambda one, other: _smooth(one.hold, other.hold, holds) * _smooth(one.time, other.time, times)

    kernels = [product(holds, times) for holds in HOLD_LENGTHS for times in TIME_LENGTHS]
    return [basis(protocol), *(_functions(protocol, kernel, SHORT_FUNCTIONS) for kernel in kernels)]


def _functions(protocol: Protocol, covariance: _Covariance, most: int) -> Array:
    """(H, R, q) functions that make up a covariance of the readings; zero where there is no reading.

    Of many readings the covariance of some is decomposed and its eigenvectors are extended to all (Nyström's method).
    """
    every = _Readings.of(protocol)
    n = len(every.hold)
    some = every.rows(evenly(n, min(n, _DECOMPOSED)))
    values, vectors = np.linalg.eigh(covariance(some, some))
    largest = np.argsort(values)[::-1][:most]
    size = np.sqrt(np.maximum(values[largest], 0.0))
    vectors = vectors[:, largest]
    functions = vectors * size
    if n > _DECOMPOSED:
        scaled = vectors / np.maximum(size, _LEAST * size[0])
        functions = covariance(every, some) @ scaled
    out = np.zeros((*protocol.mask.shape, len(largest)))
    out[np.nonzero(protocol.mask)] = functions
    return out


def _smooth(one: Array | Ints, other: Array | Ints, length: float) -> Array:
    return np.exp(-0.5 * (np.subtract.outer(one, other) / length) ** 2)

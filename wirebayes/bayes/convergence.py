"""How long a chain remembers, and whether ensembles agree."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
WINDOW = 5.0  # Sokal's: autocorrelations are summed over so many autocorrelation times


def autocorrelation_steps(values: Array) -> Array:
    """(d,) integrated autocorrelation time in steps, of (ensembles, steps, walkers, d) draws.

    The autocovariance about the mean of all ensembles is averaged over all walkers before the sum (the window is
    Sokal's, five times the time), so that walkers stuck apart lengthen it instead of vanishing into their own means.
    """
    m, steps, walkers, d = values.shape
    centred = values - values.mean(axis=(0, 1, 2))
    size = 1 << (2 * steps - 1).bit_length()
    out = np.empty(d)
    for k in range(d):
        series = np.moveaxis(centred[..., k], 1, -1).reshape(-1, steps)
        transform = np.fft.rfft(series, size, axis=-1)
        power = (transform.real**2 + transform.imag**2).sum(axis=0)
        covariance = np.fft.irfft(power, size)[:steps] / np.arange(steps, 0, -1)
        if covariance[0] <= 0:
            out[k] = np.inf
            continue
        times = 2.0 * np.cumsum(covariance / covariance[0]) - 1.0
        window = np.flatnonzero(np.arange(steps) >= WINDOW * times)
        out[k] = max(times[window[0] if len(window) else -1], 1.0)
    return out


def nested_r_hat(values: Array) -> Array:
    """(d,) nested R-hat of (ensembles, steps, walkers, d) draws, each ensemble a super-chain of its walkers."""
    walker_means = values.mean(axis=1)
    between_walkers = walker_means.var(axis=1, ddof=1)
    within_walkers = values.var(axis=1, ddof=1).mean(axis=1)
    between = walker_means.mean(axis=1).var(axis=0, ddof=1)
    return np.sqrt(1.0 + between / (between_walkers + within_walkers).mean(axis=0))

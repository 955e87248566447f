"""Which power U of the tension suits the losses that a test measured, for each rate that the creep may have.

Where creep is slow, a hold loses tension in proportion to the power of its tension. Where creep is over within a hold,
what earlier holds gained is missing, and only the step of the power is left: it takes a larger power to lose as much.
So U and the rate of the creep lie on a bent ridge, along which the measured losses hardly change.
"""

import numpy as np

from wirebayes.numeric.typing import Array


def suiting_powers(
    lost: Array, log_tension: Array, relative_s: Array, N: float, middle: float, spread: float
) -> tuple[Array, Array]:
    """Log U that suits the losses of a staircase of holds best, at several log hazards.

    The elongations that the creep law gives for B = 1, with the measured tensions driving it, are scaled to the losses
    by least squares. Independent normal residuals of unknown size give log U a likelihood. What is returned is its
    mean under this likelihood times the prior: where losses say nothing, the middle of the prior.

    Parameters
    ----------
    lost : (H,) array
        Tension lost in every hold, NaN where it was not measured, N.
    log_tension : (H,) array
        Logarithm of the tension that drives the creep of every hold.
    relative_s : (H,) array
        Durations over half of a typical hold.
    N : float
        The exponent of time; it hardly matters here.
    middle, spread : float
        Of log U under its prior.

    Returns
    -------
    log_hazards : (m,) array
        Logarithms of ``k2 t^N`` at half of a typical hold.
    log_powers : (m,) array
    """
    powers = middle + spread * _SPREADS
    known = np.isfinite(lost)
    if known.sum() < _LEAST_HOLDS or not lost[known].any():
        return _LOG_HAZARDS, np.full(len(_LOG_HAZARDS), middle)
    gained = _gained(np.exp(powers), log_tension, relative_s**N)
    log_likelihood = _log_likelihood(lost[known, None, None], gained[known])
    log_density = log_likelihood - 0.5 * _SPREADS**2
    weight = np.exp(log_density - log_density.max(axis=1, keepdims=True))
    return _LOG_HAZARDS, weight @ powers / weight.sum(axis=1)


def _log_likelihood(lost: Array, gained: Array) -> Array:
    """(m, p) of losses (h, 1, 1) in proportion to elongations (h, m, p), residuals being of unknown size."""
    product = (gained * lost).sum(axis=0)
    scale = product / np.maximum((gained**2).sum(axis=0), 1e-300)
    square = ((lost - scale * gained) ** 2).sum(axis=0)
    left = square / (lost**2).sum() + _LEAST_LEFT
    return -0.5 * len(lost) * np.log(left)


def _gained(powers: Array, log_tension: Array, relative_s: Array) -> Array:
    """(H, m, p) elongation gained in every hold for B = 1 and N = 1, at each hazard and each power U."""
    hazards = np.exp(_LOG_HAZARDS)[:, None, None]
    reached = -np.expm1(-hazards * relative_s)  # (m, 1, H)
    below_largest = log_tension - log_tension.max()
    drive = np.exp(powers[:, None] * below_largest)  # (p, H)
    carried = np.zeros((len(_LOG_HAZARDS), len(powers)))
    gained = np.empty((len(log_tension), *carried.shape))
    for j in range(len(log_tension)):
        gained[j] = (drive[:, j] - carried) * reached[..., j]
        carried = carried + gained[j]
    return gained


_LOG_HAZARDS = np.arange(-10.0, 4.01, 0.25)  # beyond, creep is linear in time, or over at once: nothing changes
_SPREADS = np.linspace(-5.0, 5.0, 161)  # standard deviations of the prior
_LEAST_HOLDS = 3  # a scale and a power fit two losses exactly, whatever the hazard
_LEAST_LEFT = 1e-6  # of the sum of squares: losses are not known better than to a thousandth

"""How much of one density's integral another has, where hardly a draw of the first is worth anything in the second."""

from collections.abc import Callable

import numpy as np

from wirebayes.resampling import next_power, systematic_rows
from wirebayes.typing import Array

_EFFECTIVE = 0.5  # share of the draws that stays so at each step
_MOVES = 10  # at each step; with three of them kite line's first hold, an elpd of -3.6, came out a nat too low
_STEPS = 200  # at most: from far apart densities a step still covers a hundredth of a nat of ten thousand


def log_ratio_of_integrals(
    density: Callable[[Array], tuple[Array, Array]], z: Array, rng: np.random.Generator
) -> tuple[float, Array]:
    """Logarithm of the integral of a second density over that of a first, by steps from the first to the second.

    The draws are weighted by the ratio of the densities to the smallest power that leaves half of them effective,
    resampled, and moved by differential evolution; then by the next power, until the second density is reached.

    Parameters
    ----------
    density : function of (n, d) points to two (n,) arrays
        Logarithms of both densities, neither of them normalised; the first is finite at its draws.
    z : (n, d) array
        Draws of the first.
    rng : numpy Generator

    Returns
    -------
    float
    (n, d) array
        Draws of the second.

    References
    ----------
    P. Del Moral, A. Doucet and A. Jasra, Sequential Monte Carlo samplers, J. R. Stat. Soc. B 68 (2006).
    """
    n, d = z.shape
    first, second = density(z)
    power, total = 0.0, 0.0
    for _ in range(_STEPS):
        gain = np.where(np.isfinite(second), second - first, -np.inf)
        step = next_power(gain, 1.0 - power, _EFFECTIVE)
        top = step * gain.max()
        weight = np.exp(step * gain - top)
        total += float(top + np.log(weight.mean()))
        power += step
        rows = systematic_rows(weight, n, rng)
        z, first, second = z[rows], first[rows], second[rows]
        for _ in range(_MOVES):
            one, other = rng.integers(n, size=(2, n))
            moved = z + 2.38 / np.sqrt(2.0 * d) * (z[one] - z[other]) + 1e-6 * z.std(axis=0) * rng.normal(size=z.shape)
            new_first, new_second = density(moved)
            with np.errstate(invalid="ignore"):
                climbed = (1.0 - power) * (new_first - first) + power * (new_second - second)
            taken = np.log(rng.uniform(size=n)) < climbed
            z = np.where(taken[:, None], moved, z)
            first, second = np.where(taken, new_first, first), np.where(taken, new_second, second)
        if power >= 1.0:
            return total, z
    return float("nan"), z

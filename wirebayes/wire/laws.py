"""The paper's laws of one wire.

Equation numbers are those of the paper the toolkit reproduces (see ``docs``).
"""

from typing import Any, Literal

import numpy as np

from wirebayes.numeric.typing import Array

ElasticLaw = Literal["hooke", "modified"]
History = Literal["saturating", "additive"]


class Hooke:
    """Eq (1): strain relative to the zero-tension length, ``L/L0 - 1``; its product with k1 is the tension.

    Arguments are arrays, real or complex, or balls of interval arithmetic, in one unit of length: the stretched length
    L, the distance between the wire's ends; the zero-tension length L0, creep included. A negative strain is slack; the
    caller clips the tension, so that the slope stays available.
    """

    def strain(self, stretched: Any, zero: Any) -> Any:
        """Strain at a stretched length."""
        return stretched / zero - 1

    def by_stretched(self, stretched: Any, zero: Any) -> Any:
        """Derivative of the strain by the stretched length."""
        return 1 / zero

    def by_zero(self, stretched: Any, zero: Any) -> Any:
        """Derivative of the strain by the zero-tension length."""
        by_stretched = 1 / zero
        return -stretched * by_stretched * by_stretched

    def stretched(self, strain: Array, zero: Array) -> Array:
        """Stretched length at a strain."""
        return zero * (1.0 + strain)

    def zero_length(self, stretched: Array, strain: Array) -> Array:
        """Zero-tension length of what has a strain at a stretched length."""
        return stretched / (1.0 + strain)

    def energy(self, stretched: Array, zero: Array) -> Array:
        """Elastic energy for a k1 of one: the integral of the strain from the zero-tension length."""
        stretch = stretched - zero
        return 0.5 * stretch * stretch / zero


class Modified(Hooke):
    """Eq (3): strain relative to the stretched length, ``1 - L0/L``."""

    def strain(self, stretched: Any, zero: Any) -> Any:
        return 1 - zero / stretched

    def by_stretched(self, stretched: Any, zero: Any) -> Any:
        by_zero = 1 / stretched
        return zero * by_zero * by_zero

    def by_zero(self, stretched: Any, zero: Any) -> Any:
        return -1 / stretched

    def stretched(self, strain: Array, zero: Array) -> Array:
        """Stretched length at a strain; NaN where there is none."""
        return zero / np.where(strain.real < 1.0, 1.0 - strain, np.nan)

    def zero_length(self, stretched: Array, strain: Array) -> Array:
        return stretched * (1.0 - strain)

    def energy(self, stretched: Array, zero: Array) -> Array:
        x = (stretched - zero) / zero
        return np.asarray(zero * (x - np.log1p(x)))


LAWS: dict[ElasticLaw, Hooke] = {"hooke": Hooke(), "modified": Modified()}


def creep_target(tension_N: Array, B: Array, U: Array) -> Array:
    """Final creep elongation at a tension, eqs (2) and (4), mm; zero when slack.

    Parameters
    ----------
    tension_N : array
    B : array
        Final creep elongation at 1 N, mm N^-U.
    U : array
        Exponent of the tension.

    Returns
    -------
    array
        The broadcast of all three.
    """
    taut = tension_N > 0
    return np.where(taut, B * np.power(np.where(taut, tension_N, 1.0), U), 0.0)


def creep_fraction(time_s: Array, k2: Array, N: Array) -> Array:
    """Share of the creep reached after a time, eq (5): ``1 - exp(-k2 t^N)``.

    Parameters
    ----------
    time_s : array
        Since the hold began.
    k2 : array
        Rate, s^-N.
    N : array
        Exponent of time: 1 is an exponential, less a stretched one.

    Returns
    -------
    array
        From 0 to 1, the broadcast of all three.
    """
    return -np.expm1(-k2 * np.power(time_s, N))

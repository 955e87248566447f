"""The paper's laws of one wire, each a plain function of arrays.

Equation numbers are those of the paper the toolkit reproduces (see ``docs``).
"""

from typing import Literal

import numpy as np

from wirebayes.numeric.typing import Array

ElasticLaw = Literal["hooke", "modified"]
History = Literal["saturating", "additive"]


def strain(stretched_mm: Array, zero_tension_mm: Array, law: ElasticLaw = "hooke") -> Array:
    """Strain whose product with k1 is the tension: eq (1) ``L/L0 - 1``, eq (3) ``1 - L0/L``.

    Negative when slack; the caller clips the tension, so that the slope stays available.

    Parameters
    ----------
    stretched_mm : array
        Distance between the wire's ends, L.
    zero_tension_mm : array
        Length under no tension, L0, creep included.
    law : {"hooke", "modified"}
        Eq (1) or eq (3).

    Returns
    -------
    array
        The broadcast of both; real or complex.
    """
    if law == "hooke":
        return stretched_mm / zero_tension_mm - 1.0
    return 1.0 - zero_tension_mm / stretched_mm


def stretched(strain: Array, zero_tension_mm: Array, law: ElasticLaw = "hooke") -> Array:
    """Stretched length at a strain, the inverse of `strain`, mm; NaN where eq (3) has none.

    Parameters
    ----------
    strain, zero_tension_mm : array
    law : {"hooke", "modified"}

    Returns
    -------
    array
        The broadcast of both; real or complex.
    """
    if law == "hooke":
        return zero_tension_mm * (1.0 + strain)
    return zero_tension_mm / np.where(strain.real < 1.0, 1.0 - strain, np.nan)


def strain_slopes(stretched_mm: Array, zero_tension_mm: Array, law: ElasticLaw = "hooke") -> tuple[Array, Array]:
    """Derivatives of `strain` by stretched and by zero-tension length, 1/mm.

    Parameters
    ----------
    stretched_mm, zero_tension_mm : array
    law : {"hooke", "modified"}

    Returns
    -------
    by_stretched, by_zero_tension : array
    """
    if law == "hooke":
        by_stretched = 1.0 / zero_tension_mm
        return by_stretched, -stretched_mm * by_stretched * by_stretched
    by_stretched = 1.0 / stretched_mm
    return zero_tension_mm * by_stretched * by_stretched, -by_stretched


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

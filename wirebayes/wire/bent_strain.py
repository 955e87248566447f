"""Elasticity with effects: the strain whose product with k1 is the tension, its slope, and the inverse."""

import numpy as np

from wirebayes.numeric.typing import Array
from wirebayes.wire.effect import HoldContext, Placed
from wirebayes.wire.inverse import inverse

_STEP = 1e-30  # a complex step has no truncation error, so it may be this small


def bent(effects: Placed, strain: Array, hold: HoldContext) -> tuple[Array, Array]:
    """Effective strain, and its slope by the strain (a complex step).

    Parameters
    ----------
    effects : Placed
        Those at ``strain`` take part.
    strain : array
        Geometric strain, as `wirebayes.wire.laws` gives it.

    Returns
    -------
    effective, slope : arrays of the shape of `strain`
        k1 times the effective strain is the tension.
    """
    if "strain" not in effects.at:
        return strain, np.ones_like(strain)
    value = effects.change("strain", strain + 1j * _STEP, hold)
    return np.asarray(value.real), np.asarray(value.imag / _STEP)


def strain_of(effects: Placed, effective: Array, hold: HoldContext) -> Array:
    """Strain that has an effective strain; NaN where none has.

    Parameters
    ----------
    effective : array
        Tension over k1, real or complex.

    Returns
    -------
    array
        Of the shape of `effective`, or of the readings where effects differ between them.
    """
    if "strain" not in effects.at:
        return effective
    return inverse(lambda strain: effects.change("strain", strain, hold), effective)

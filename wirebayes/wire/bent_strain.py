"""Elasticity with effects: the strain whose product with k1 is the tension, its slope, and the inverse."""

import numpy as np

from wirebayes.typing import Array
from wirebayes.wire.effect import HoldContext, Placed

_STEP = 1e-30  # a complex step has no truncation error, so it may be this small


def bent(effects: Placed, strain: Array, hold: HoldContext) -> tuple[Array, Array]:
    """Effective strain, and its slope by the strain (a complex step).

    Parameters
    ----------
    effects : Placed
        Those at ``strain`` take part.
    strain : array
        Geometric strain, as `laws.strain` gives it.
    hold : HoldContext

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
    """Strain that has an effective strain, by Newton's steps; NaN where none has.

    Parameters
    ----------
    effects : Placed
    effective : array
        Tension over k1.
    hold : HoldContext

    Returns
    -------
    array of the shape of `effective`
    """
    strain = effective
    if "strain" in effects.at:
        for _ in range(50):
            value, slope = bent(effects, strain, hold)
            move = (value - effective) / np.where(slope > 0, slope, np.nan)
            strain = strain - move
            if not np.any(np.abs(move) > 1e-15):
                break
    return strain

"""The inverse of a rising function, by Newton's steps between bounds; its derivatives come with it."""

import numpy as np

from wirebayes.numeric.typing import Array, Function

_STEP = 1e-30  # a complex step has no truncation error, so it may be this small
_MOST_STEPS = 200  # halving a bracket takes 60 from any start; a root far above the first guess some more
_EXACT = 4.0 * np.finfo(float).eps  # relative; a smaller step is rounding
_MISSED = 1e-9  # of the target: no step got nearer, so the function never rises so high


def inverse(function: Function, target: Array) -> Array:
    """Where a function takes given values.

    Parameters
    ----------
    function : function of an array
        Rises from zero at zero, and is the identity for negative values; real or complex (an imaginary part is a
        derivative, and what the function refers to may have one, too).
    target : array
        Real or complex.

    Returns
    -------
    array
        Of the shape that `function` returns for `target`; NaN where the function rises no further than below the
        target, the target itself where that is not above zero.
    """
    wanted = target.real
    with np.errstate(all="ignore"):
        at = _nearest(function, wanted)
        value, slope = _with_slope(function, at)
        reached = (np.abs(value - wanted) <= _MISSED * wanted) & (slope > 0)
        found = np.where(reached, at, np.nan)
        if np.iscomplexobj(target) or np.iscomplexobj(function(at)):
            found = found - (function(at + 0j) - target) / slope  # one more step from the root has its derivatives
    return np.where(wanted > 0, found, target)


def _nearest(function: Function, wanted: Array) -> Array:
    """Where the function comes nearest to real values, by Newton's steps as long as they stay between bounds."""
    at = np.where(wanted > 0, wanted, 1.0)
    low = np.zeros_like(at)
    high = np.full_like(at, np.inf)
    for _ in range(_MOST_STEPS):
        value, slope = _with_slope(function, at)
        beyond = ~((value <= wanted) & (slope > 0))  # or past where the function stops rising
        low = np.where(beyond, low, at)
        high = np.where(beyond, at, high)
        newton = at - (value - wanted) / slope
        between = (newton >= low) & (newton <= high) & (slope > 0)  # where it falls, steps lead further off
        halved = np.where(np.isinf(high), 2.0 * at, 0.5 * (low + high))
        moved = np.where(between, newton, halved)
        open_still = (np.abs(moved - at) > _EXACT * moved) & (wanted > 0)
        at = moved
        if not open_still.any():
            break
    return at


def _with_slope(function: Function, at: Array) -> tuple[Array, Array]:
    """Real value, and slope by the argument alone: what else the function refers to may be complex."""
    moved = function(at + 1j * _STEP)
    rest = function(at + 0j).imag if np.iscomplexobj(function(at)) else 0.0
    return moved.real, (moved.imag - rest) / _STEP

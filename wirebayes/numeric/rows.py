"""Rows of arrays, picked."""

import numpy as np

from wirebayes.numeric.typing import Array, Bools


def chosen_rows(first: Bools, one: Array, other: Array) -> Array:
    """The rows of one array or of another.

    Parameters
    ----------
    first : (n,) bool array
        True where the row is of `one`.
    one, other : (n, ...) arrays
    """
    return np.where(first.reshape(-1, *[1] * (one.ndim - 1)), one, other)

"""Stacks whose batch comes first, as linear algebra has it, or last, as mechanics has it."""

import numpy as np

from wirebayes.numeric.typing import Array


def batch_first(values: Array) -> Array:
    """``(n, ...)`` of ``(..., n)``."""
    return np.moveaxis(values, -1, 0)


def batch_last(values: Array) -> Array:
    """``(..., n)`` of ``(n, ...)``."""
    return np.moveaxis(values, 0, -1)

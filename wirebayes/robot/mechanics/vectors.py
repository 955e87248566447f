"""Vectors whose components come first, ``(3, ...)``."""

import numpy as np

from wirebayes.numeric.typing import Floats


def dot(a: Floats, b: Floats) -> Floats:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Floats, b: Floats) -> Floats:
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def norm(a: Floats) -> Floats:
    return np.sqrt(dot(a, a))

"""Rotations as matrices and rotation vectors, batched along the leading axes."""

import numpy as np

from wirebayes.numeric.typing import Floats


def matrix(rotation_vector_rad: Floats) -> Floats:
    """Rotation matrices ``(..., 3, 3)`` of rotation vectors ``(..., 3)``, rad (Rodrigues)."""
    v = np.asarray(rotation_vector_rad, float)
    angle = np.sqrt((v * v).sum(-1))[..., None, None]
    a = np.sinc(angle / np.pi)
    b = 0.5 * np.sinc(angle / (2 * np.pi)) ** 2
    k = cross_matrix(v)
    return np.eye(3) + a * k + b * (k @ k)


def vector(rotation: Floats) -> Floats:
    """Rotation vectors ``(..., 3)``, rad, of rotation matrices ``(..., 3, 3)``; exact also near zero and near pi.

    NaN where a matrix is not finite, as searches may try.
    """
    from scipy.spatial.transform import Rotation

    flat = np.reshape(rotation, (-1, 3, 3))
    known = np.isfinite(flat).all(axis=(1, 2))
    out = np.full((len(flat), 3), np.nan)
    if known.any():
        out[known] = Rotation.from_matrix(flat[known]).as_rotvec()
    return out.reshape(*np.shape(rotation)[:-2], 3)


def cross_matrix(v: Floats) -> Floats:
    """``(..., 3, 3)`` matrices K with ``K x = v × x``."""
    out = np.zeros((*np.shape(v)[:-1], 3, 3))
    x, y, z = v[..., 0], v[..., 1], v[..., 2]
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -z, y, -x
    out[..., 1, 0], out[..., 2, 0], out[..., 2, 1] = z, -y, x
    return out


def antisymmetric(rotation: Floats) -> Floats:
    """``(..., 3)``: the sine of the angle along the axis, of ``(..., 3, 3)`` matrices."""
    R = rotation
    return 0.5 * np.stack([R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]], -1)


def tilt(rotation: Floats, commanded: Floats | None = None) -> Floats:
    """Angle between the platform's normal (its third axis) and another, rad; `(...)` of `(..., 3, 3)`.

    Parameters
    ----------
    rotation : (..., 3, 3) array
    commanded : (3, 3) array, optional
        The orientation whose normal counts; default: upright, and the normal is compared with the vertical.
    """
    turned = rotation if commanded is None else np.swapaxes(commanded, -1, -2) @ rotation
    angle = np.arctan2(np.hypot(turned[..., 0, 2], turned[..., 1, 2]), turned[..., 2, 2])
    return without_rounding(np.asarray(angle))


def without_rounding(angle_rad: Floats) -> Floats:
    """Angles of rotations (...), rad, without what rounding makes of the product of a rotation and its inverse."""
    return np.where(angle_rad < _ROUNDING_RAD, 0.0, angle_rad)


_ROUNDING_RAD = 1e-15  # a few units of the last place


def compose(increment_rad: Floats, rotation: Floats) -> Floats:
    """Batch-last: ``exp(increment)`` times the rotation, ``(3, n)`` and ``(3, 3, n)`` arrays."""
    angle2 = (increment_rad**2).sum(0)
    angle = np.sqrt(angle2)
    sine = np.sinc(angle / np.pi)
    cosine = 0.5 * np.sinc(angle / (2 * np.pi)) ** 2
    crossed = np.moveaxis(cross_matrix(increment_rad.T), 0, -1)
    along = increment_rad[:, None] * increment_rad
    turn = np.eye(3)[..., None] * (1 - cosine * angle2) + sine * crossed + cosine * along
    return np.einsum("ikn,kjn->ijn", turn, rotation)

"""Sobol' points: a sequence that fills a cube evenly.

`scipy.stats` has them, too, but takes longer to load than a fit takes to sample.

References
----------
S. Joe and F. Y. Kuo, Constructing Sobol sequences with better two-dimensional projections, SIAM Journal on Scientific
Computing 30, 2008: the numbers below.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray


@cache
def strata(dimensions: int, size: int) -> NDArray[np.uint32]:
    """Which of `size` equal parts of its range each coordinate of the first points lies in.

    Parameters
    ----------
    size : int
        Points: a power of two.

    Returns
    -------
    (size, dimensions) array
        The origin first; each next point differs in one direction from the one before it, in the order of Gray's code.
    """
    if dimensions > 1 + len(_DIRECTIONS):
        from scipy.stats import qmc

        unscrambled = qmc.Sobol(dimensions, scramble=False)
        return np.asarray(unscrambled.random(size) * size, np.uint32)
    digits = size.bit_length() - 1
    rows = [(), *_DIRECTIONS[: dimensions - 1]]
    steps = np.stack([_steps(row, digits) for row in rows], axis=1)
    turned = [_lowest_one(point) for point in range(1, size)]
    origin = np.zeros((1, dimensions), np.uint32)
    moves = np.concatenate([origin, steps[turned]])
    return np.bitwise_xor.accumulate(moves, axis=0)


def _lowest_one(number: int) -> int:
    """The place of the lowest binary digit that is one."""
    return (number & -number).bit_length() - 1


def _steps(row: tuple[int, ...], digits: int) -> NDArray[np.uint32]:
    """(digits,) directions of one coordinate; of the first one, whose row is empty, each moves by half of the last."""
    shifts = range(digits - 1, -1, -1)
    if not row:
        return np.array([1 << shift for shift in shifts], np.uint32)
    polynomial, *odd = row
    degree = len(odd)
    for k in range(degree, digits):
        first = odd[k - degree]
        new = first ^ (first << degree)
        for back in range(1, degree):
            if polynomial >> (degree - back) & 1:
                new ^= odd[k - back] << back
        odd.append(new)
    steps = [number << shift for number, shift in zip(odd[:digits], shifts, strict=True)]
    return np.array(steps, np.uint32)


# For each coordinate but the first: a primitive polynomial over two elements, its coefficients as binary digits, and
# as many odd numbers as its degree.
_DIRECTIONS: tuple[tuple[int, ...], ...] = (
    (3, 1),
    (7, 1, 3),
    (11, 1, 3, 1),
    (13, 1, 1, 1),
    (19, 1, 1, 3, 3),
    (25, 1, 3, 5, 13),
    (37, 1, 1, 5, 5, 17),
    (41, 1, 1, 5, 5, 5),
    (47, 1, 1, 7, 11, 19),
    (55, 1, 1, 5, 1, 1),
    (59, 1, 1, 1, 3, 11),
    (61, 1, 3, 5, 5, 31),
    (67, 1, 3, 3, 9, 7, 49),
    (91, 1, 1, 1, 15, 21, 21),
    (97, 1, 3, 1, 13, 27, 49),
    (103, 1, 1, 1, 15, 7, 5),
    (109, 1, 3, 1, 15, 13, 25),
    (115, 1, 1, 5, 5, 19, 61),
    (131, 1, 3, 7, 11, 23, 15, 103),
    (137, 1, 3, 7, 13, 13, 15, 69),
    (143, 1, 1, 3, 13, 7, 35, 63),
    (145, 1, 3, 5, 9, 1, 25, 53),
    (157, 1, 3, 1, 13, 9, 35, 107),
    (167, 1, 3, 1, 5, 27, 61, 31),
    (171, 1, 1, 5, 11, 19, 41, 61),
    (185, 1, 3, 5, 3, 3, 13, 69),
    (191, 1, 1, 7, 13, 1, 19, 1),
    (193, 1, 3, 7, 5, 13, 19, 59),
    (203, 1, 1, 3, 9, 25, 29, 41),
    (211, 1, 3, 5, 13, 23, 1, 55),
    (213, 1, 3, 7, 3, 13, 59, 17),
    (229, 1, 3, 1, 3, 5, 53, 69),
    (239, 1, 1, 5, 5, 23, 33, 13),
    (241, 1, 1, 7, 7, 1, 61, 123),
    (247, 1, 1, 7, 9, 13, 61, 49),
    (253, 1, 3, 3, 5, 3, 55, 33),
    (285, 1, 3, 1, 15, 31, 13, 49, 245),
    (299, 1, 3, 5, 15, 31, 59, 63, 97),
    (301, 1, 3, 1, 11, 11, 11, 77, 249),
)  # fmt: skip

"""Points that fill a cube evenly, one of them given: Sobol' points under nested uniform (Owen) scrambling.

Of n points, a power of two, each coordinate has exactly one in every n-th of its range, and pairs of coordinates are
filled nearly as evenly. Every point is uniform, and the joint distribution of all does not depend on which of them was
given: a Markov chain may take one for the place where it stands, and go to any other.

References
----------
A. B. Owen, Randomly permuted (t, m, s)-nets and (t, s)-sequences, Monte Carlo and Quasi-Monte Carlo Methods in
Scientific Computing, Springer 1995.
"""

from typing import Any

import numpy as np

from wirebayes.numeric import sobol
from wirebayes.numeric.typing import Array


def around(given: Array, size: int, random: Any) -> Array:
    """Nets of which one point each is given.

    Parameters
    ----------
    given : (n, m) array
        A point of every net, between 0 and 1.
    size : int
        Points of a net: a power of two.
    random : numpy RandomState or Generator

    Returns
    -------
    (n, size, m) array
        The given points first, the others in the order of Sobol's sequence, which goes to and fro.
    """
    n, m = given.shape
    net = sobol.strata(m, size)
    # Each binary digit is flipped by a coin of its own for all digits before it. Those of the given point, the origin
    # of the net, are not tossed: it is known where that point has to go, and all others follow it.
    flips = np.zeros((n, m, 1), net.dtype)
    for level in range(size.bit_length() - 1):
        tossed = np.frombuffer(random.bytes(n * m << level), np.uint8)
        coins = tossed.reshape(n, m, -1) & 1
        coins[..., 0] = 0
        flips = np.repeat(2 * flips + coins, 2, axis=-1)
    place = (given * size).astype(net.dtype)
    place = np.minimum(place, size - 1)
    stratum = net ^ flips[:, np.arange(m), net] ^ place[:, None]
    within = random.uniform(size=stratum.shape)
    points: Array = (stratum + within) / size
    points[:, 0] = given
    return points


def even(n: int, m: int, random: Any) -> Array:
    """The first points of one net, in random order.

    Parameters
    ----------
    n : int
        How many: most even where it is a power of two.
    m : int
        Coordinates.
    random : numpy RandomState or Generator

    Returns
    -------
    (n, m) array
    """
    return around(random.uniform(size=(1, m)), 1 << (n - 1).bit_length(), random)[0, random.permutation(n)]

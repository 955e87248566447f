"""The tensions that a redundant robot is meant to have: rules with one interface, by name or as a user's function.

A rule takes wrench matrix, wrench, lowest and highest tension and returns tensions, or None where none fit.
"""

from collections.abc import Callable

import numpy as np
from scipy.optimize import nnls

from wirebayes.numeric.typing import Floats

Choice = Callable[[Floats, Floats, float, float], Floats | None]


def nearest(reference_N: Floats, structure: Floats, load: Floats, lowest_N: float, highest_N: float) -> Floats | None:
    """Tensions nearest (2-norm) to a reference that carry a load within bounds.

    A least-distance problem in the null space of the structure matrix, solved exactly by Lawson and Hanson's
    non-negative least squares (*Solving Least Squares Problems*, ch. 23).

    Parameters
    ----------
    reference_N : (w,) array
    structure : (d, w) array
        Wrench of unit tensions.
    load : (d,) array
        Wrench to be made by the wires.
    lowest_N, highest_N : float

    Returns
    -------
    (w,) array, or None when no tensions within the bounds carry the load.
    """
    scale = float(np.abs(load).max()) or max(lowest_N, float(np.abs(reference_N).max()), 1.0)
    tau = _nearest(reference_N / scale, structure, load / scale, lowest_N / scale, highest_N / scale)
    return None if tau is None else scale * tau


def _nearest(reference: Floats, structure: Floats, load: Floats, lowest: float, highest: float) -> Floats | None:
    """`nearest` with forces in units of the load."""
    left, sizes, right = np.linalg.svd(structure)
    rank = int((sizes > 1e-10 * sizes[0]).sum())
    along = (left.T @ load)[:rank] / sizes[:rank]
    particular = right[:rank].T @ along
    unbalanced = np.abs(structure @ particular - load).max()
    if unbalanced > 1e-9 * np.abs(load).max():
        return None
    null = right[rank:].T
    wished = null.T @ (reference - particular)
    tau = particular + null @ wished
    too_low = lowest - tau.min()
    too_high = tau.max() - highest
    outside = float(max(too_low, too_high))
    if null.shape[1] == 0:  # there is no choice
        return tau if outside <= 1e-9 * _size(tau) else None
    if outside <= 0.0:
        return tau
    return _brought_inside(tau, null, outside, lowest, highest)


def _size(tau: Floats) -> float:
    """The largest tension, or that of the load."""
    return max(1.0, float(np.abs(tau).max()))


def _brought_inside(tau: Floats, null: Floats, outside: float, lowest: float, highest: float) -> Floats | None:
    """The tensions within bounds that are nearest to others, which leave them by `outside`, in a null space.

    Lawson and Hanson's least-distance problem, as a non-negative one with a row more.
    """
    # In units of the worst violation, so that the size of the answer does not look like an answer.
    h = np.concatenate([lowest - tau, tau - highest]) / outside
    result = tau + null @ (outside * _least_distance(np.vstack([null, -null]), h))
    margin = 1e-8 * _size(result)
    inside = result.min() >= lowest - margin and result.max() <= highest + margin
    return np.asarray(result) if inside else None


def _least_distance(G: Floats, h: Floats) -> Floats:
    """The least vector with ``G x >= h``, if there is one.

    The dual non-negative problem says which rows are equalities. Its residual, over its last component, is the vector
    too, but where hardly any vector fits that is a ratio of rounding errors.
    """
    E = np.vstack([G.T, h])
    f = np.zeros(len(E))
    f[-1] = 1.0
    multiplier, _ = nnls(E, f, maxiter=50 * E.shape[1])
    tight = multiplier > 0
    return np.asarray(np.linalg.lstsq(G[tight], h[tight], rcond=None)[0])


def minimum_norm(structure: Floats, load: Floats, lowest_N: float, highest_N: float) -> Floats | None:
    """The smallest tensions (2-norm) above the floor.

    Parameters
    ----------
    structure : (6 or 3, w) array
        Wrench matrix: wrench of each wire at 1 N.
    load : (6 or 3,) array
        Wrench that the wires have to produce.
    lowest_N, highest_N : float

    Returns
    -------
    (w,) array or None
        None where no tensions within the limits produce the load.
    """
    return nearest(np.zeros(structure.shape[1]), structure, load, lowest_N, highest_N)


def middle(structure: Floats, load: Floats, lowest_N: float, highest_N: float) -> Floats | None:
    """The tensions nearest to the middle of the allowed range: stiffer, further from slackness.

    Parameters
    ----------
    structure, load, lowest_N, highest_N
        As for `minimum_norm`.

    Returns
    -------
    (w,) array or None
    """
    reference = np.full(structure.shape[1], 0.5 * (lowest_N + highest_N))
    return nearest(reference, structure, load, lowest_N, highest_N)


CHOICES: dict[str, Choice] = {"minimum_norm": minimum_norm, "middle": middle}

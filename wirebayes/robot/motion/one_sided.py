"""Stiffness of a platform on wires of which some are just not slack: they resist one way only.

A wire at its zero-tension length adds to the energy where a displacement stretches it, and nothing where it slackens:
to second order the energy is a quadratic form in each cone of displacements that stretch the same wires. An equilibrium
is stable where every displacement raises it. The form is continuously differentiable across the cones, so that its
minimum on the unit sphere is an eigenvector of the form that adds all wires of one set: trying every set finds it.
"""

from itertools import product

import numpy as np

from wirebayes.numeric.typing import Bools, Floats
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import Lengths, Poses, Robot
from wirebayes.robot.mechanics.wires import Wires, tension

TOUCHING = 1e-9  # strain from zero within which a wire is neither taut nor slack: a nanometre a metre
# Of the stiffness: added so that no two of its eigenvalues are alike. Symmetric robots have whole planes of
# eigenvectors, of which the one that matters would have to be looked for.
_APART = 1e-9


def lowest_stiffness(robot: Robot, wires: Wires, pose: Poses, lengths: Lengths) -> Floats:
    """Least stiffness against any displacement, rotations in metres at the platform's edge.

    Parameters
    ----------
    robot : Robot
    wires : Wires
        ``n`` draws.
    pose : (position, rotation)
        (n, 3), m, and (n, 3, 3).
    lengths : (zero, offset)
        Zero-tension lengths (n, w) and lengths beyond the exit points, m.

    Returns
    -------
    (n,) array
        N/m; an equilibrium is stable where it is above zero. NaN where there is no pose.
    """
    return _bounds(robot, wires, pose, lengths)[1]


def held(robot: Robot, wires: Wires, pose: Poses, lengths: Lengths) -> Bools:
    """Whether wires that are just not slack make balances stable that the taut ones alone leave loose, ``(n,)``.

    Parameters
    ----------
    robot, wires, pose, lengths
        As for `lowest_stiffness`.
    """
    touching, least, largest = _bounds(robot, wires, pose, lengths)
    return np.asarray(touching & (least > _APART * largest))


def _bounds(robot: Robot, wires: Wires, pose: Poses, lengths: Lengths) -> tuple[Bools, Floats, Floats]:
    """Where any wire is just not slack, and least and largest stiffness, ``(n,)`` each; NaN where there is no pose."""
    turn, zero = np.moveaxis(pose[1], 0, -1), lengths[0].T
    shape = statics.geometry(robot, pose[0].T, turn)
    stretched = statics.stretched(robot, shape, np.broadcast_to(lengths[1], lengths[0].shape).T)
    touching = np.abs(stretched / zero - 1.0) < TOUCHING
    any_touching = np.asarray(touching.any(axis=0))
    # the form of the taut wires, which resist both ways, and its values
    tau, slope = (np.where(touching, 0.0, value) for value in tension(wires, stretched, zero))
    _, stiffness = statics.unbalance_and_stiffness(robot, shape, turn, tau, slope)
    both = _at_edge(robot, stiffness)
    values = np.asarray(np.linalg.eigvalsh(both), np.float64)
    least, largest = values[:, 0].copy(), values[:, -1]
    # what each wire would add as soon as it is taut
    _, slope = tension(wires, np.maximum(stretched, zero * (1.0 + TOUCHING)), zero)
    resisting = statics.wire_jacobian(robot, shape) * robot.edge_scale[:, None, None] * np.sqrt(slope)
    known = np.isfinite(pose[0]).all(axis=1)
    decided = known & np.isfinite(resisting).all(axis=(0, 1))
    for k in np.flatnonzero(decided & any_touching & (least <= _APART * largest)):
        least[k] = _least_of(both[k], resisting[:, touching[:, k], k])
    return any_touching, np.where(known, least, np.nan), largest


def _at_edge(robot: Robot, stiffness: Floats) -> Floats:
    """(n, d, d) stiffnesses (d, d, n) with rotations in metres at the platform's edge; zero where there is none."""
    scale = robot.edge_scale[:, None]
    first = np.moveaxis(stiffness, -1, 0)
    return np.where(np.isfinite(first), first, 0.0) * (scale * scale.T)


def _least_of(both: Floats, one_way: Floats) -> Floats:
    """Least value on the unit sphere of a quadratic form with squares that count where they are of positive numbers.

    Parameters
    ----------
    both : (d, d) array
        Of the form.
    one_way : (d, m) array
        Of the numbers.
    """
    d, m = one_way.shape
    noise = np.random.default_rng(0).standard_normal((d, d))
    size = np.abs(both).max() + (one_way**2).sum()
    apart = both + _APART * size * (noise + noise.T)
    sets = np.array(list(product((0.0, 1.0), repeat=m)))
    of_sets = np.einsum("im,sm,jm->sij", one_way, sets, one_way)
    _, vectors = np.linalg.eigh(apart + of_sets)
    tried = np.concatenate([vectors, -vectors], axis=-1).swapaxes(1, 2).reshape(-1, d)
    stretch = np.maximum(tried @ one_way, 0.0)
    value = np.einsum("vi,ij,vj->v", tried, both, tried) + (stretch**2).sum(axis=1)
    return np.asarray(value.min())

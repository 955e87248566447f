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
    known = np.asarray(np.isfinite(pose[0]).all(1))
    turn, zero = np.moveaxis(pose[1], 0, -1), lengths[0].T
    shape = statics.geometry(robot, pose[0].T, turn)
    stretched = statics.stretched(robot, shape, np.broadcast_to(lengths[1], lengths[0].shape).T)
    touching = np.abs(stretched / zero - 1.0) < TOUCHING
    tau, slope = (np.where(touching, 0.0, value) for value in tension(wires, stretched, zero))
    scale = robot.edge_scale[:, None]
    both = np.moveaxis(statics.unbalance_and_stiffness(robot, shape, turn, tau, slope)[1], -1, 0)
    both = np.where(np.isfinite(both), both, 0.0) * (scale * scale.T)
    values = np.asarray(np.linalg.eigvalsh(both), np.float64)
    least = values[:, 0].copy()
    along = statics.wire_jacobian(robot, shape) * scale[:, None]
    taut = tension(wires, np.maximum(stretched, zero * (1.0 + TOUCHING)), zero)[1]
    resisting = along * np.sqrt(taut)
    decided = known & np.isfinite(resisting).all(axis=(0, 1))
    for k in np.flatnonzero(decided & touching.any(0) & (least <= _APART * values[:, -1])):
        least[k] = _least_of(both[k], resisting[:, touching[:, k], k])
    return np.asarray(touching.any(0)), np.where(known, least, np.nan), values[:, -1]


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
    vectors = np.linalg.eigh(apart + np.einsum("im,sm,jm->sij", one_way, sets, one_way))[1]
    tried = np.concatenate([vectors, -vectors], -1).swapaxes(1, 2).reshape(-1, d)
    stretch = np.maximum(tried @ one_way, 0.0)
    value = np.einsum("vi,ij,vj->v", tried, both, tried) + (stretch**2).sum(1)
    return np.asarray(value.min())

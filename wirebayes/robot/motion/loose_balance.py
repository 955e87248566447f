"""The balance of a platform that the wires do not hold in every direction: its equations, slopes and stability."""

import numpy as np

from wirebayes.numeric.batches import batch_first, batch_last
from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics import rotation as turning
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import GRAVITY, Robot

DEPENDENT = 1e-9  # singular value, of the largest, of equations that depend on each other


def stiffness_at_tension(robot: Robot, shape: statics.Geometry, turn: Floats, tau: Floats) -> Floats:
    """(n, d, d) Stiffness of wires whose tension does not change: what turns and swings leave of the balance.

    Parameters
    ----------
    robot : Robot
    shape : Geometry
    turn, tau : (3, 3, n) and (w, n) arrays
        Rotations, and tensions, N.
    """
    _, hessian = statics.unbalance_and_stiffness(robot, shape, turn, tau, np.zeros_like(tau))
    return batch_first(hessian)


def equations(robot: Robot, x: Floats, R: Floats, tau: Floats) -> tuple[Floats, Floats, Floats]:
    """Imbalance (n, d), N; its change by a turn, (n, d, 3), N/rad, and by tensions, (n, d, w); moments in newtons.

    Parameters
    ----------
    robot : Robot
    x, R, tau : (n, 3), (n, 3, 3) and (n, w) arrays
        Positions, m, rotations and tensions, N.
    """
    turn = batch_last(R)
    shape = statics.geometry(robot, x.T, turn)
    force, hessian = statics.unbalance_and_stiffness(robot, shape, turn, tau.T, np.zeros_like(tau.T))
    scale = robot.edge_scale[:, None]
    by_turn = np.zeros((len(x), robot.degrees, 3))  # of a platform that cannot turn
    by_turn[..., : robot.degrees - 3] = batch_first(hessian)[:, :, 3:] * scale
    by_tension = batch_first(statics.wire_jacobian(robot, shape)) * scale
    return (force * scale).T, by_turn, by_tension


def slope_by_place(robot: Robot, x: Floats, R: Floats, tau: Floats) -> Floats:
    """Change of the imbalance by a displacement, (n, d, 3), N/m.

    Parameters
    ----------
    robot : Robot
    x, R, tau : (n, 3), (n, 3, 3) and (n, w) arrays
        Positions, m, rotations and tensions, N.
    """
    turn = batch_last(R)
    shape = statics.geometry(robot, x.T, turn)
    stiffness = stiffness_at_tension(robot, shape, turn, tau.T)
    return stiffness[:, :, :3] * robot.edge_scale[:, None]


def largest_imbalance(robot: Robot, x: Floats, R: Floats, tau: Floats) -> tuple[Floats, Floats]:
    """Largest force left over, and the largest at all, (n,) N.

    Parameters
    ----------
    robot : Robot
    x, R, tau : (n, 3), (n, 3, 3) and (n, w) arrays
        Positions, m, rotations and tensions, N.
    """
    force, _, _ = equations(robot, x, R, tau)
    largest = np.abs(tau).max(1) * robot.lines.max()
    return np.abs(force).max(1), np.maximum(largest, robot.mass_kg * GRAVITY)


def null_space(matrix: Floats) -> Floats:
    """Orthonormal columns that a matrix maps to zero."""
    _, sizes, right = np.linalg.svd(matrix)
    if not sizes.size:
        return right.T
    least = DEPENDENT * max(float(sizes[0]), 1e-300)
    rank = int((sizes > least).sum())
    return right[rank:].T


def vector_by_turn(vector: Floats) -> Floats:
    """(n, 3, 3) Change of rotation vectors (n, 3) by small turns in the world: the inverse left Jacobian of SO(3)."""
    angle = np.linalg.norm(vector, axis=-1)[:, None, None]
    turned = angle > 1e-4
    safe = np.where(turned, angle, 1.0)
    half = 0.5 * safe
    share = np.where(turned, (1.0 - half / np.tan(half)) / safe**2, 1.0 / 12.0)
    k = turning.cross_matrix(vector)
    return np.eye(3) - 0.5 * k + share * (k @ k)

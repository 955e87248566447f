"""Forces, stiffness and tensions that lengths give at poses, in balance or not."""

import numpy as np

from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.wires import Wires, tension


def in_metres(gradient: Floats, H: Floats, scale: Floats) -> tuple[Floats, Floats]:
    """Gradient and Hessian by rotations in metres at the platform's edge.

    Parameters
    ----------
    gradient : (d, n) array
    H : (d, d, n) array
        Changed in place.
    scale : (d, 1) array
        Radians of a metre at the platform's edge; 1 for displacements.

    Returns
    -------
    gradient, H
    """
    if len(gradient) == 6:
        H[3:] *= scale[3, 0]
        H[:, 3:] *= scale[3, 0]
    return gradient * scale, H


def balance_at(
    robot: Robot, wires: Wires, position_m: Floats, rotation: Floats, zero_m: Floats, offset_m: Floats
) -> tuple[Floats, Floats]:
    """Gradient and Hessian of the energy at poses; rotations count in metres at the platform's edge.

    Parameters
    ----------
    robot : Robot
    wires : Wires
    position_m : (n, 3) array
    rotation : (n, 3, 3) array
    zero_m : (n, w) array
        Zero-tension lengths, creep included.
    offset_m : (n, w) or (w,) array
        Length beyond the exit points.

    Returns
    -------
    gradient : (6 or 3, n) array
        N.
    hessian : (6, 6, n) or (3, 3, n) array
        N/m.
    """
    R = rotation.transpose(1, 2, 0)
    shape = statics.geometry(robot, position_m.T, R)
    tau, slope = _pulls(robot, wires, shape, zero_m, offset_m)
    return in_metres(*statics.unbalance_and_stiffness(robot, shape, R, tau, slope), robot.edge_scale[:, None])


def _pulls(
    robot: Robot, wires: Wires, shape: statics.Geometry, zero_m: Floats, offset_m: Floats
) -> tuple[Floats, Floats]:
    """Tensions, N, and their slopes by the stretched length, N/m; ``(w, n)`` each."""
    beyond = np.broadcast_to(offset_m, zero_m.shape).T
    return tension(wires, statics.stretched(robot, shape, beyond), zero_m.T)


def tensions_at(
    robot: Robot, wires: Wires, position_m: Floats, rotation: Floats, zero_m: Floats, offset_m: Floats
) -> Floats:
    """Tensions that lengths give at poses, in balance or not.

    Parameters
    ----------
    robot, wires, position_m, rotation, zero_m, offset_m
        As for `balance_at`.

    Returns
    -------
    (n, w) array
        N.
    """
    shape = statics.geometry(robot, position_m.T, rotation.transpose(1, 2, 0))
    pull, _ = _pulls(robot, wires, shape, zero_m, offset_m)
    return pull.T

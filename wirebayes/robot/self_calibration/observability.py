"""How equilibria answer when wires change: small motions and tensions, by zero-tension lengths."""

import numpy as np

from wirebayes.numeric.batches import batch_first, batch_last
from wirebayes.numeric.linear_algebra import solve
from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.wires import Wires, tension


def response(
    robot: Robot, wires: Wires, position_m: Floats, rotation: Floats, zero_m: Floats, offset_m: Floats
) -> tuple[Floats, Floats, Floats]:
    """How an equilibrium answers when wires pull differently, in closed form.

    Parameters
    ----------
    robot : Robot
    wires : Wires
        ``n`` draws, or one.
    position_m, rotation : (n, 3), (n, 3, 3) arrays
        Poses of equilibrium.
    zero_m, offset_m : (n, w) arrays

    Returns
    -------
    motion : (n, 6 or 3, w) array
        Small motion when a wire's law gives 1 N more at the same stretched length: m and rad.
    change : (n, w, w) array
        Change of all tensions, that newton included.
    by_zero : (n, w) array
        Change of a wire's tension with its zero-tension length at the same stretched length, N/m.
    """
    turn = batch_last(rotation)
    zero = zero_m.T
    shape = statics.geometry(robot, position_m.T, turn)
    stretched = statics.stretched(robot, shape, offset_m.T)
    tau, slope = tension(wires, stretched, zero)
    _, hessian = statics.unbalance_and_stiffness(robot, shape, turn, tau, slope)
    J = batch_first(statics.wire_jacobian(robot, shape))
    motion = -solve(batch_first(hessian), J)
    lengthening = J.mT @ motion
    by_lengthening = slope.T[:, :, None] * lengthening
    change = by_lengthening + np.eye(robot.legs)
    # The tension depends on stretched / zero alone under either law, so its slope by zero follows from the other.
    by_zero = -slope * stretched / zero
    return motion, change, by_zero.T


def length_sensitivity(
    robot: Robot, wires: Wires, position_m: Floats, rotation: Floats, zero_m: Floats, offset_m: Floats
) -> tuple[Floats, Floats]:
    """Small motion and change of the tensions per metre of zero-tension length.

    Parameters
    ----------
    robot : Robot
    wires : Wires
    position_m : (n, 3) array
    rotation : (n, 3, 3) array
        Poses of equilibrium.
    zero_m : (n, w) array
        Zero-tension lengths, creep included.
    offset_m : (n, w) or (w,) array
        Length beyond the exit points.

    Returns
    -------
    motion : (n, 6 or 3, w) array
    change : (n, w, w) array
        N/m.
    """
    motion, change, by_zero = response(robot, wires, position_m, rotation, zero_m, offset_m)
    return motion * by_zero[:, None], change * by_zero[:, None]

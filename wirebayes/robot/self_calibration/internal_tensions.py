"""Tensions that nobody read: what is usual of them is said of internal tension alone.

At a pose, balance leaves as many combinations of the tensions open as there are wires beyond the platform's degrees of
freedom. Those are what a robot's owner chooses and what may be near a usual value. All others carry the platform,
wherever geometry and pose have them. Were they thought to be usual too, geometry would be bent until they are: lower
wires slack, and upper ones with little to carry.

Of the residuals r of a hold's tensions, the part along the wires' pulls J (w, d) is taken out by a least motion a:
``|r - J a|^2 + e |a|^2`` counts in place of ``|r|^2``, which is the prior whose variance is larger by ``J J^T / e``.
"""

import numpy as np

from wirebayes.numeric.batches import batch_first, batch_last
from wirebayes.numeric.linear_algebra import solve
from wirebayes.numeric.typing import Bools, Floats
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.self_calibration.by_points import by_points, swing
from wirebayes.robot.self_calibration.equations import Equations
from wirebayes.robot.self_calibration.unknowns import Unknowns

# Of the variance of internal tensions over that of tensions that carry loads: with three times the standard deviation,
# which is the width of the range that the robot's file allows, those may lie anywhere in it. With much more, searches
# take to wandering between holds with a wire slack and taut.
_CARRIED = 0.1


def without_carried(
    out: Equations, unknowns: Unknowns, robot: Robot, shape: statics.Geometry, rotation: Floats, unread: Bools
) -> None:
    """Take what carries the platform out of the residuals of tensions that nobody read, and out of their slopes.

    Parameters
    ----------
    out : Equations
        With residuals of tensions from what is usual and their slopes; the rows ``carried`` are written, too.
    unknowns : Unknowns
    robot : Robot
        With its points where the state has them.
    shape : Geometry
        At the state.
    rotation : (p, 3, 3) array
    unread : (p, w) bool array
    """
    rows, own = out.rows["tension"], out.rows["carried"]
    J = batch_first(statics.wire_jacobian(robot, shape)).mT * robot.edge_scale
    J = J * unread[..., None]
    weight = np.sqrt(_CARRIED)
    lead = solve(J.mT @ J + _CARRIED * np.eye(robot.degrees), J.mT)  # (p, d, w)
    usual = np.where(unread, out.residual[:, rows], 0.0)[..., None]
    motion = lead @ usual
    changes = _turning(unknowns, robot, shape, rotation, motion[..., 0])
    chosen = unread[..., None]
    for values, change in zip((out.by_hold, out.by_robot), changes, strict=True):
        # the motion is the least one, so that its own slopes leave the sum of squares alone
        slope = chosen * (values[:, rows] - change)
        moves = lead @ slope
        values[:, rows] = np.where(chosen, slope - J @ moves, values[:, rows])
        values[:, own] = -weight * moves
    out.residual[:, rows] = np.where(unread, (usual - J @ motion)[..., 0], out.residual[:, rows])
    out.residual[:, own] = -weight * motion[..., 0]
    out.known[:, own] = False


def _turning(
    unknowns: Unknowns, robot: Robot, shape: statics.Geometry, rotation: Floats, motion: Floats
) -> tuple[Floats, Floats]:
    """Slopes ``(p, w, .)`` of each wire's growth along a motion ``(p, d)``, by the hold's unknowns and the robot's."""
    holds, d = motion.shape
    legs = robot.legs
    by_hold = np.zeros((holds, legs, d + legs))
    by_hold[:, :, :d] = np.einsum("wpij,pj->pwi", _bends(robot, shape, rotation), motion)
    pulls = swing(robot, shape, rotation, np.ones((holds, legs)))
    along = motion * robot.edge_scale
    by_exit, by_platform = (np.einsum("pdwi,pd->pwi", pull, along) for pull in pulls)
    by_robot = np.zeros((holds, legs, unknowns.count))
    by_points(by_robot, unknowns, by_exit, by_platform)
    return by_hold, by_robot


def _bends(robot: Robot, shape: statics.Geometry, rotation: Floats) -> Floats:
    """(w, p, d, d) second slopes of each wire's length by a small motion."""
    turn = batch_last(rotation)
    none = np.zeros((robot.legs, len(rotation)))
    _, of_weight = statics.unbalance_and_stiffness(robot, shape, turn, none, none)
    bends = []
    for leg in range(robot.legs):
        pull = none.copy()
        pull[leg] = 1.0
        _, stiffness = statics.unbalance_and_stiffness(robot, shape, turn, pull, none)
        bends.append(batch_first(stiffness - of_weight))
    return np.array(bends) * robot.edge_scale * robot.edge_scale[:, None]

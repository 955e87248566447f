"""How equations of a calibration change with the points at which wires leave and hold the platform."""

import numpy as np

from wirebayes.numeric.batches import batch_first
from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics import rotation as turns
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.self_calibration.unknowns import Unknowns


def by_points(out: Floats, unknowns: Unknowns, by_exit: Floats, by_platform: Floats) -> None:
    """Write slopes by exit and platform points, where these are unknown.

    Parameters
    ----------
    out : (p, w, m) or (p, d, m) array
        Slopes by the robot's unknowns, which are written.
    unknowns : Unknowns
    by_exit, by_platform : arrays
        ``(p, w, 3)`` of equations that speak of one leg each, or ``(p, d, w, 3)``.
    """
    errors = unknowns.errors
    leg = np.arange(unknowns.robot.legs)
    for name, slope, sd in (("exit", by_exit, errors.exit_m), ("platform", by_platform, errors.platform_m)):
        at = unknowns.slices[name]
        if at.stop == at.start:
            continue
        scaled = slope * sd
        if slope.ndim == 3:
            first = at.start + 3 * leg
            for axis in range(3):
                out[:, leg, first + axis] = scaled[..., axis]
        else:
            out[:, :, at] = scaled.reshape(*slope.shape[:2], -1)


def swing(robot: Robot, shape: statics.Geometry, rotation: Floats, pull: Floats) -> tuple[Floats, Floats]:
    """How the wires' pull on the platform changes when a point moves: ``(p, d, w, 3)`` by exit and platform points.

    Parameters
    ----------
    robot : Robot
    shape : Geometry
    rotation : (p, 3, 3) array
    pull : (p, w) array
    """
    tau = (pull * robot.lines).T  # (w, p)
    turn = _turn_of_pull(shape, tau)
    by_line = np.moveaxis(turn, 1, 2)  # (p, 3, w, 3)
    by_arm = np.zeros_like(by_line)
    if robot.degrees == 6:
        direction = batch_first(shape.direction).mT
        arm = turns.cross_matrix(batch_first(shape.arm_m).mT)  # (p, w, 3, 3)
        pulls = turns.cross_matrix(direction * tau.T[..., None])
        moment_by_line = np.moveaxis(arm @ turn, 1, 2)
        moment_by_arm = np.moveaxis(-pulls, 1, 2)
        by_line = np.concatenate([by_line, moment_by_line], 1)
        by_arm = np.concatenate([by_arm, moment_by_arm], 1)
    by_platform = np.einsum("pdwi,pij->pdwj", by_line + by_arm, rotation)
    return -by_line, by_platform


def _turn_of_pull(shape: statics.Geometry, tau: Floats) -> Floats:
    """(p, w, 3, 3) change of forces ``(w, p)`` along the wires when their platform points move."""
    by_length = tau / shape.straight_m
    u = batch_first(shape.direction)  # (p, 3, w)
    turn = by_length.T[..., None, None] * np.eye(3)
    turn = turn - np.einsum("wp,piw,pjw->pwij", by_length, u, u)
    if shape.over is not None:
        side = batch_first(shape.over.across)
        turn = turn + np.einsum("wp,piw,pjw->pwij", tau * shape.over.swing_1_m, side, side)
    return turn

"""Inverse kinematics: pose and mass to tensions, zero-tension lengths and joint values."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.tensions import CHOICES, Choice
from wirebayes.robot.mechanics.wires import Wires, stretched_length, zero_tension_length


@dataclass(frozen=True)
class Commands:
    """The commands of the actuators.

    Attributes
    ----------
    zero_m : (n, w) array
        Zero-tension length between exit (and beyond) and platform, creep included.
    joint_m : (n, w) array
        Drum: the zero-tension length paid out, creep subtracted. Linear actuator: its displacement q.
    offset_m : (n, w) array
        Stretched length that is not between exit and platform point.
    tension_N : (n, w) array
    feasible : (n,) bool array
        False where no tensions within the bounds hold the pose; the other values are NaN there.
    """

    zero_m: Floats
    joint_m: Floats
    offset_m: Floats
    tension_N: Floats
    feasible: NDArray[np.bool_]


def tensions(robot: Robot, position_m: Floats, rotation: Floats, choice: Choice | None = None) -> Floats:
    """Tensions that hold the platform at poses, ``(p, w)`` N; NaN where none within the bounds do.

    They depend on geometry and mass alone, not on the wires: one set serves all draws. None hold a pose with a platform
    point on an exit point, inside a pulley or on its swivel axis.

    Parameters
    ----------
    robot : Robot
    position_m : (p, 3) array
    rotation : (p, 3, 3) array
    choice : function, optional
        Default: the choice named in the robot's file.
    """
    rule = robot.rule
    chosen = choice or CHOICES[rule.choice]
    R = np.moveaxis(rotation, 0, -1)
    shape = statics.geometry(robot, position_m.T, R)
    structure = -statics.jacobian(robot, shape) * robot.lines[:, None]
    load = -statics.weight(robot, R)
    # Moments are brought to newtons so that the rank test and the residual weigh both alike.
    structure[3:] /= robot.size_m
    load[3:] /= robot.size_m
    out = np.full((len(position_m), robot.legs), np.nan)
    for p in np.flatnonzero(shape.clear):
        tau = chosen(structure[:, :, p], load[:, p], rule.lowest_N, rule.highest_N)
        if tau is not None:
            out[p] = tau
    return out


def commands(
    robot: Robot,
    wires: Wires,
    position_m: Floats,
    rotation: Floats,
    tension_N: Floats,
    creep: Floats | float = 0.0,
    error_m: Floats | float = 0.0,
) -> Commands:
    """Zero-tension lengths and joint values that give tensions at poses, eqs (1), (3) or (6).

    Parameters
    ----------
    robot : Robot
    wires : Wires
    position_m : (p, 3) array
        ``p`` is 1 or the number of draws ``n`` (or ``n`` is 1).
    rotation : (p, 3, 3) array
    tension_N : (p, w) array
    creep : (w, n) array
        Creep strain that the wires are known or thought to carry.
    error_m : (w, n) array
        What the zero-tension lengths before creep are known or thought to be beyond what the joint values say.

    Returns
    -------
    Commands
    """
    grown = 1.0 + creep
    shape = statics.geometry(robot, position_m.T, rotation.transpose(1, 2, 0))
    linear = robot.is_linear[:, None]
    tau = tension_N.T
    free = statics.stretched(robot, shape, robot.beyond_m[:, None])
    drum = zero_tension_length(wires, free, tau)
    if not linear.any():
        return _of_drums(robot, drum, grown, error_m, tau)
    fixed = (robot.wire_m[:, None] + error_m) * grown
    moved = stretched_length(wires, np.where(linear, fixed, 1.0), tau) - free
    zero = np.where(linear, fixed, drum)
    joint = np.where(linear, moved / np.where(linear, robot.ratio[:, None], 1.0), drum / grown - error_m)
    offset = robot.beyond_m[:, None] + np.where(linear, moved, 0.0)
    feasible = np.isfinite(zero).all(0) & np.isfinite(tau).all(0)
    zero, joint, offset, tau = np.broadcast_arrays(zero, joint, offset, tau)
    return Commands(zero.T, joint.T, offset.T, tau.T, np.broadcast_to(feasible, zero.shape[1:]))


def _of_drums(robot: Robot, zero: Floats, grown: Floats | float, error_m: Floats | float, tau: Floats) -> Commands:
    """Commands of a robot without linear actuators, whose lengths beyond the exit points stay."""
    feasible = np.isfinite(zero).all(0) & np.isfinite(tau).all(0)
    joint = zero / grown - error_m
    zero, offset, tau = (np.broadcast_to(v, joint.shape) for v in (zero, robot.beyond_m[:, None], tau))
    return Commands(zero.T, joint.T, offset.T, tau.T, np.broadcast_to(feasible, joint.shape[1:]))


def lengths(robot: Robot, joint_m: Floats) -> tuple[Floats, Floats]:
    """Zero-tension lengths before creep and offsets of joint values, ``(n, w)`` each: what forward kinematics needs."""
    zero = np.where(robot.is_linear, robot.wire_m, joint_m)
    offset = robot.beyond_m + np.where(robot.is_linear, robot.ratio * joint_m, 0.0)
    return zero, offset

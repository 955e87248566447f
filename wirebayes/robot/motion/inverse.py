"""Inverse kinematics: pose and mass to tensions, zero-tension lengths and joint values."""

from dataclasses import dataclass

import numpy as np

from wirebayes.numeric.batches import batch_last
from wirebayes.numeric.rows import chosen_rows
from wirebayes.numeric.typing import Bools, Floats
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.tensions import CHOICES, Choice
from wirebayes.robot.mechanics.winches import lengths as lengths
from wirebayes.robot.mechanics.wires import Wires, stretched_length, zero_tension_length
from wirebayes.robot.motion.tied import tied


@dataclass(frozen=True)
class Commands:
    """The commands of the actuators.

    Attributes
    ----------
    zero_m : (n, w) array
        Zero-tension length between exit (and beyond) and platform, creep included.
    joint_m : (n, w) array
        Drum: the zero-tension length paid out, creep subtracted. Linear actuator: its displacement q. Leg by leg, legs
        of one winch alike.
    offset_m : (n, w) array
        Stretched length that is not between exit and platform point.
    tension_N : (n, w) array
    feasible : (n,) bool array
        False where no tensions within the bounds hold the pose; the other values are NaN there.
    rotation : (n, 3, 3) array
        The orientation: the one asked for, or what winches that drive several lines make of it.
    """

    zero_m: Floats
    joint_m: Floats
    offset_m: Floats
    tension_N: Floats
    feasible: Bools
    rotation: Floats


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
    clear, structure, load = _balance(robot, position_m, rotation)
    out = np.full((len(position_m), robot.legs), np.nan)
    for p in np.flatnonzero(clear):
        tau = chosen(structure[:, :, p], load[:, p], rule.lowest_N, rule.highest_N)
        if tau is not None:
            out[p] = tau
    return out


def _balance(robot: Robot, position_m: Floats, rotation: Floats) -> tuple[Bools, Floats, Floats]:
    """Where wires run, ``(p,)``, the structure matrices ``(d, w, p)`` and the loads ``(d, p)``."""
    turn = batch_last(rotation)
    shape = statics.geometry(robot, position_m.T, turn)
    structure = -statics.wire_jacobian(robot, shape)
    load = -statics.weight(robot, turn)
    # Moments are brought to newtons so that the rank test and the residual weigh both alike.
    structure[3:] /= robot.size_m
    load[3:] /= robot.size_m
    return shape.clear, structure, load


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
    each = _of_each_line(robot, wires, position_m, rotation, tension_N, creep, error_m)
    if robot.winch is None:
        return each
    x = np.broadcast_to(position_m, (len(each.joint_m), 3))
    found = tied(robot, wires, x, each.rotation, each.tension_N, each.joint_m, creep, error_m)
    joint = chosen_rows(found.held, found.joint_m, np.nan)
    pull = chosen_rows(found.held, found.tension_N, np.nan)
    bare, offset = lengths(robot, joint)
    zero = (bare.T + error_m) * (1.0 + creep)
    return Commands(zero.T, joint, offset, pull, found.held, found.rotation)


def commands_at(robot: Robot, wires: Wires, position_m: Floats, rotation: Floats) -> Commands:
    """`commands` of one pose, under the tensions that the robot's file chooses for it.

    Parameters
    ----------
    robot : Robot
    wires : Wires
    position_m, rotation : (3,), (3, 3) arrays
    """
    x, R = position_m[None], rotation[None]
    return commands(robot, wires, x, R, tensions(robot, x, R))


def _of_each_line(
    robot: Robot,
    wires: Wires,
    position_m: Floats,
    rotation: Floats,
    tension_N: Floats,
    creep: Floats | float,
    error_m: Floats | float,
) -> Commands:
    """`commands` as if every line had a winch of its own."""
    tau = tension_N.T
    offset = robot.beyond_m[:, None]
    shape = statics.geometry(robot, position_m.T, rotation.transpose(1, 2, 0))
    free = statics.stretched(robot, shape, offset)
    zero = zero_tension_length(wires, free, tau)
    grown = 1.0 + creep
    beyond = robot.beyond_joint_m[:, None] + error_m
    joint = zero / grown - beyond
    if robot.is_linear.any():
        linear = robot.is_linear[:, None]
        fixed = (robot.wire_m[:, None] + error_m) * grown
        zero = np.where(linear, fixed, zero)
        held = np.where(linear, fixed, 1.0)
        drawn = stretched_length(wires, held, tau) - free
        moved = drawn / _ratio(robot)
        joint = np.where(linear, moved, joint)
        offset = offset + np.where(linear, drawn, 0.0)
    return _of_draws(zero, joint, offset, tau, rotation)


def _ratio(robot: Robot) -> Floats:
    """(w, 1) wire that a linear actuator draws by its displacement; 1 of drums."""
    return np.where(robot.is_linear, robot.ratio, 1.0)[:, None]


def _of_draws(zero: Floats, joint: Floats, offset: Floats, tau: Floats, rotation: Floats) -> Commands:
    """Commands of values ``(w, n)``, ``(w, 1)`` or ``(w, p)``, all of as many draws."""
    feasible = np.isfinite(zero).all(0) & np.isfinite(tau).all(0)
    zero, joint, offset, tau = np.broadcast_arrays(zero, joint, offset, tau)
    n = zero.shape[1]
    turn = np.broadcast_to(rotation, (n, 3, 3))
    return Commands(zero.T, joint.T, offset.T, tau.T, np.broadcast_to(feasible, (n,)), turn)

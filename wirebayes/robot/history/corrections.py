"""Joint values that bring a drifted platform back, how sure they are, and what error they leave."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from wirebayes.numeric.typing import Floats, Indices
from wirebayes.robot.history.estimate import Estimate
from wirebayes.robot.history.history import History
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.tensions import nearest
from wirebayes.robot.motion import forward, inverse


@dataclass(frozen=True)
class Target:
    """Where the platform is meant to be at each row, ``(t, 3)`` and ``(t, 3, 3)``, and its tensions, ``(t, w)``."""

    position_m: Floats
    rotation: Floats
    tension_N: Floats


def target(robot: Robot, history: History, found: Estimate) -> Target:
    """The commanded poses; where none are given, what the joint values would give if no wire crept.

    Tensions are those without creep, or the nearest to them that hold the commanded pose.

    Parameters
    ----------
    robot : Robot
    history : History
        Its poses are the targets where it has them.
    found : Estimate
        Its robot without creep gives the targets otherwise.

    Returns
    -------
    Target
    """
    plain = found.plain
    if history.position_m is None or history.rotation is None:
        return Target(plain.position_m[0], plain.rotation[0], plain.tension_N[0])
    tension = np.empty_like(plain.tension_N[0])
    for k, before in enumerate(plain.tension_N[0]):
        choice = partial(nearest, np.where(np.isfinite(before), before, 0.0))
        x, R = history.position_m[k][None], history.rotation[k][None]
        tension[k] = inverse.tensions(history.robot_at(robot, k), x, R, choice)[0]
    return Target(history.position_m, history.rotation, tension)


def wanted(robot: Robot, history: History, found: Estimate, to: Target) -> Floats:
    """Joint values that bring every draw to its target, creep so far included.

    Parameters
    ----------
    robot : Robot
    history : History
        Has the payloads.
    found : Estimate
        Of n draws at t rows.
    to : Target

    Returns
    -------
    (n, t, w) array
        m; NaN where no joint values reach the target.
    """
    out = np.empty_like(found.track.tension_N)
    for k in range(out.shape[1]):
        strain = found.track.strain[:, k].T
        x, R, tau = to.position_m[k][None], to.rotation[k][None], to.tension_N[k][None]
        loaded = history.robot_at(robot, k)
        out[:, k] = inverse.commands(loaded, found.wires, x, R, tau, strain, found.error_at(k).T).joint_m
    return out


def error_left(robot: Robot, history: History, found: Estimate, to: Target, joint_m: Floats, rows: Indices) -> Floats:
    """Distance from the target that corrected joint values leave.

    Parameters
    ----------
    robot : Robot
    history : History
    found : Estimate
        Of n draws at t rows.
    to : Target
    joint_m : (t, w) or (n, t, w) array
        The same for all draws, or each its own.
    rows : int array
        Rows of the history that are evaluated.

    Returns
    -------
    (n, len(rows)) array
        m; NaN where the platform is not held.
    """
    n = len(found.track.position_m)
    out = np.full((n, len(rows)), np.nan)
    for i, k in enumerate(rows):
        position = to.position_m[k]
        joints = np.broadcast_to(joint_m[..., k, :], (n, robot.legs))
        bare, offset = inverse.lengths(robot, joints)
        zero = (bare + found.error_at(int(k))) * (1.0 + found.track.strain[:, k])
        loaded = history.robot_at(robot, int(k))
        there = forward.solve_equilibrium(loaded, found.wires, zero, offset, position, to.rotation[k])
        distance = np.linalg.norm(there.position_m - position, axis=1)
        is_held = there.found & found.track.held[:, k]
        out[:, i] = np.where(is_held, distance, np.nan)
    return out

"""Winches that drive several lines: one joint value, and as many zero-tension lengths as it has lines.

Each line has its own exit point and platform point and carries its own tension, unlike the parallel parts of one wire
(``lines``). Within the package joint values stand leg by leg, those of one winch alike; who reads or writes them sees
one for each winch.
"""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from wirebayes.numeric.typing import Floats, Indices
from wirebayes.robot.mechanics.description import Lengths, Robot

_T = TypeVar("_T", bound=np.generic)


def of_each_leg(robot: Robot, joint: NDArray[_T]) -> NDArray[_T]:
    """Values of all legs ``(..., w)`` from those of their winches ``(..., j)``.

    Parameters
    ----------
    robot : Robot
    joint : (..., j) array
    """
    return joint if robot.winch is None else joint[..., robot.winch]


def of_each_winch(robot: Robot, value: NDArray[_T]) -> NDArray[_T]:
    """Values of all winches ``(..., j)`` from those of their legs ``(..., w)``, which are alike within a winch.

    Parameters
    ----------
    robot : Robot
    value : (..., w) array
    """
    return value if robot.winch is None else value[..., first_legs(robot)]


def mean_of_each_winch(robot: Robot, value: Floats) -> Floats:
    """Means over the legs of each winch, ``(..., j)``.

    Parameters
    ----------
    robot : Robot
    value : (..., w) array
    """
    if robot.winch is None:
        return value
    share = turned_by(robot)
    return value @ (share / share.sum(0))


def first_legs(robot: Robot) -> Indices:
    """(j,) The first leg of every winch."""
    return np.arange(robot.legs) if robot.winch is None else np.unique(robot.winch, return_index=True)[1]


def turned_by(robot: Robot) -> Floats:
    """(w, j) 1 where a winch drives a leg, 0 elsewhere."""
    return np.eye(robot.legs) if robot.winch is None else np.eye(robot.joints)[robot.winch]


def lengths(robot: Robot, joint_m: Floats) -> Lengths:
    """Zero-tension lengths before creep and offsets of joint values, ``(n, w)`` each: what forward kinematics needs.

    Parameters
    ----------
    robot : Robot
    joint_m : (n, w) array
        Leg by leg.
    """
    zero = np.where(robot.is_linear, robot.wire_m, joint_m + robot.beyond_joint_m)
    offset = robot.beyond_m + np.where(robot.is_linear, robot.ratio * joint_m, 0.0)
    return zero, offset

"""Lengths as firmware counts them, and as the wires are: straight from exit to platform point, or all of the wire.

A wire that runs in several lines is ``lines`` times as long as the straight way, and has what is beyond the exit point:
``wire = lines x straight + beyond_exit``. Firmware for Hangprinters counts straight lengths, wirebayes wires. It knows
one straight length of each winch: of several lines the joint value is the mean of what each would have.
"""

import numpy as np
from numpy.typing import ArrayLike

from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.winches import mean_of_each_winch


def wire_of(robot: Robot, straight_m: ArrayLike) -> Floats:
    """Joint values, m, of straight lengths ``(..., j)``, m: lengths of whole wires, less their joint offsets.

    Parameters
    ----------
    robot : Robot
    straight_m : (..., j) array
    """
    lines = mean_of_each_winch(robot, robot.lines)
    beyond = mean_of_each_winch(robot, robot.beyond_m - robot.beyond_joint_m)
    return lines * np.asarray(straight_m, float) + beyond

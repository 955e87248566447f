"""Lengths as firmware counts them, and as the wires are: straight from exit to platform point, or all of the wire.

A wire that runs in several lines is ``lines`` times as long as the straight way, and has what is beyond the exit point:
``wire = lines x straight + beyond_exit``. Firmware for Hangprinters counts straight lengths, wirebayes wires.
"""

import numpy as np
from numpy.typing import ArrayLike

from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics.description import Robot


def wire_of(robot: Robot, straight_m: ArrayLike) -> Floats:
    """Lengths of whole wires, m, of straight lengths ``(..., w)``, m.

    Parameters
    ----------
    robot : Robot
    straight_m : (..., w) array
    """
    return np.asarray(robot.lines * np.asarray(straight_m, float) + robot.beyond_m)


def straight_of(robot: Robot, wire_m: ArrayLike) -> Floats:
    """Straight lengths, m, of whole wires ``(..., w)``, m: the inverse of `wire_of`.

    Parameters
    ----------
    robot : Robot
    wire_m : (..., w) array
    """
    return np.asarray((np.asarray(wire_m, float) - robot.beyond_m) / robot.lines)

"""Commanded poses whose orientation balance decides: of robots with fewer wires than degrees of freedom."""

from dataclasses import replace

import numpy as np

from wirebayes.robot.history.history import History
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.motion import hanging


def balanced(robot: Robot, history: History) -> History:
    """The history with orientations in which the platform and its payload hang at the commanded positions.

    Parameters
    ----------
    robot : Robot
    history : History
        Its own orientations choose where there are several solutions.

    Returns
    -------
    History
        The same where orientations can be commanded, or none are.
    """
    if history.position_m is None or history.rotation is None or not robot.is_underactuated:
        return history
    turn = np.array(history.rotation)
    loads = np.column_stack([history.payload_kg, history.payload_m])
    for load in np.unique(loads, axis=0):
        rows = np.flatnonzero((loads == load).all(1))
        loaded = history.robot_at(robot, int(rows[0]))
        turn[rows] = hanging.orientations(loaded, history.position_m[rows], turn[rows])
    return replace(history, rotation=turn)

"""Commanded poses whose orientation balance decides: of robots with fewer wires than degrees of freedom."""

from dataclasses import replace

import numpy as np

from wirebayes.result_warnings import Notice
from wirebayes.robot.history.history import History
from wirebayes.robot.mechanics import rotation as turning
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.motion import hanging
from wirebayes.robot.motion.home import TURNED_AWAY, turned_away


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


def turned_rows(robot: Robot, asked: History, history: History) -> list[Notice]:
    """Notices that balance does not give the rotations that were commanded, or that of the robot's file.

    Parameters
    ----------
    robot : Robot
    asked : History
        With the rotations as they were given.
    history : History
        The same as `balanced` left it.
    """
    if asked.rotation is None or history.rotation is None or not robot.is_underactuated:
        return []
    if not asked.rotation_is_stated:
        return turned_away(robot, turning.matrix(robot.home_rotation_rad))
    apart = np.degrees(np.linalg.norm(turning.vector(history.rotation @ np.swapaxes(asked.rotation, 1, 2)), axis=1))
    row = int(apart.argmax())
    if apart[row] < TURNED_AWAY:
        return []
    text = (
        f"balance, to which {robot.legs} wires leave the orientation, does not give the rotations that are commanded "
        f"(rx_rad, ry_rad, rz_rad): the platform hangs up to {apart[row]:.3g} degrees away from them, "
        f"at {history.times_s[row]:.10g} s; leave the columns out if that is meant, else check their unit (rad)"
    )
    return [Notice("unheld", text)]

"""The home pose of a robot's file where nothing holds it: how far from there the platform hangs."""

import numpy as np

from wirebayes.numeric.typing import Floats
from wirebayes.result_warnings import Notice
from wirebayes.robot.mechanics import rotation as turning
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.motion import hanging, inverse
from wirebayes.sentences import coordinates, short

TURNED_AWAY = 1.0  # degrees from the home orientation: nobody levels a platform by eye to much better


def turned_away(robot: Robot, rotation: Floats) -> list[Notice]:
    """Notices that the platform hangs away from the orientation of the robot's file.

    Parameters
    ----------
    robot : Robot
    rotation : (3, 3) array
        How the platform hangs at a position where the file's orientation was meant.
    """
    if robot.is_underactuated and not robot.home_rotation_is_stated:
        return []
    stated = robot.home_rotation_rad if robot.rotation_of_file_rad is None else robot.rotation_of_file_rad
    away = float(np.degrees(np.linalg.norm(turning.vector(rotation @ turning.matrix(stated).T))))
    if away < TURNED_AWAY:
        return []
    why, accepted = "no tensions within the bounds hold", ""
    if robot.is_underactuated:
        why = f"balance, to which {robot.legs} wires leave the orientation, does not give"
        accepted = f"write [{coordinates(turning.vector(rotation), 4)}] there if that is meant, else "
    text = (
        f"{why} the rotation that the robot's file asks for (pose.rotation_vector_rad): the platform hangs {away:.3g} "
        f"degrees away from it; {accepted}check that rotation (rad), the centre of mass and the points (m)"
    )
    return [Notice("unheld", text)]


_UNHELD = "no tensions within the bounds hold the home pose of the robot's file (pose.position_m)"


def home_notices(robot: Robot) -> list[Notice]:
    """Notices that nothing holds the home pose of the robot's file, with the degrees or metres to the nearest balance.

    Parameters
    ----------
    robot : Robot
        `hanging.at_home` has turned it where balance decides the orientation.
    """
    x, R = robot.home_m, turning.matrix(robot.home_rotation_rad)
    if np.isfinite(inverse.tensions(robot, x[None], R[None])).all():
        return turned_away(robot, R)
    if robot.freedom == "pose" and robot.plane is None:
        found = hanging.hang(robot, x[None], R)
        if found.held[0]:
            return turned_away(robot, found.rotation[0])
    near = hanging.nearest_position(robot, x, R) if robot.motions is None else None
    where = "" if near is None else f"; {nearest_balance(x, near)}"
    return [Notice("unheld", f"{_UNHELD}{where}")]


def nearest_balance(position_m: Floats, near_m: Floats) -> str:
    """Where the nearest position with a balance is, and how far away.

    Parameters
    ----------
    position_m, near_m : (3,) array
    """
    far = float(np.linalg.norm(near_m - position_m))
    return (
        f"the nearest position that was found to have a balance is {short(far, 3)} m away, ({coordinates(near_m, 5)}) m"
    )

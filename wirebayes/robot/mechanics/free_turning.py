"""Platforms that turn freely: some turn moves no platform point and not the centre of mass, so nothing decides it."""

import numpy as np

from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics import rotation as turning
from wirebayes.robot.mechanics.description import Robot

_ONE_POINT = 1e-9  # of the robot's span: points that are nearer are one


def turns_freely(robot: Robot) -> str:
    """About what the platform turns freely, wherever it hangs; empty where its wires and its weight decide the turn.

    Parameters
    ----------
    robot : Robot
    """
    if robot.freedom == "position":
        return ""
    on_joint = robot.freedom == "orientation"
    arms = robot.platform_m if on_joint else robot.platform_m - robot.platform_m[0]
    far = robot.centre_of_mass_m if on_joint else robot.centre_of_mass_m - robot.platform_m[0]
    if robot.plane is not None:
        normal = _in_platform(robot, robot.plane.normal)
        arms = arms - np.outer(arms @ normal, normal)
        return "the one point where all wires meet" if _directions(arms, robot) == 0 else ""
    directions = _directions(arms, robot)
    if directions == 0 and not on_joint:
        return "the one point where all wires meet"
    if directions > 1 or _directions(np.vstack([arms, far]), robot) > 1:
        return ""
    if on_joint:
        return "the line of all platform points and the centre of mass through the ball joint"
    return "the line on which all platform points and the centre of mass lie"


def _directions(arms_m: Floats, robot: Robot) -> int:
    """In how many directions points lie apart."""
    extents = np.linalg.svd(arms_m, compute_uv=False)
    return int((extents > _ONE_POINT * robot.span_m).sum())


def _in_platform(robot: Robot, direction: Floats) -> Floats:
    """A direction of the world in the platform's frame at home."""
    return direction @ turning.matrix(robot.home_rotation_rad)

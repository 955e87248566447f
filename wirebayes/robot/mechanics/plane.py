"""A platform that a plane carries: poses in the plane, the plane's force, and where friction can hold the platform.

Friction that creep or a move has overcome stops the platform anywhere in the set of poses at which it can hold: the
displacements ``K^-1 f`` of all forces and moments ``f`` of friction, ``K`` the stiffness along the plane. Force and
moment of a sled that presses evenly on a ring lie in the ellipsoid ``(|force| / F)^2 + (moment / F r)^2 <= 1`` with
``F`` the coefficient times the plane's force and ``r`` the ring's radius [1]_; so the set of poses is an ellipsoid
too, and its half widths are exact in it.

References
----------
.. [1] R. D. Howe and M. R. Cutkosky, Practical force-motion models for sliding manipulation, International Journal of
   Robotics Research 15 (1996) 557-572.
"""

import numpy as np

from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics import rotation as turning
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import GRAVITY, Poses, Robot
from wirebayes.robot.mechanics.rotation import matrix


def onto(robot: Robot, position_m: Floats, rotation: Floats) -> Poses:
    """Poses moved into the plane through the home pose, or onto the ball joint; the same where there is neither.

    Parameters
    ----------
    robot : Robot
    position_m : (n, 3) array
    rotation : (n, 3, 3) array

    Returns
    -------
    position_m : (n, 3) array
    rotation : (n, 3, 3) array
        Turned from the home orientation about the normal only.
    """
    if robot.freedom == "orientation":
        return np.broadcast_to(robot.home_m, position_m.shape).copy(), rotation
    if robot.plane is None:
        return position_m, rotation
    normal, home = robot.plane.normal, matrix(robot.home_rotation_rad)
    away = (position_m - robot.home_m) @ normal
    about = turning.vector(rotation @ home.T) @ normal
    return position_m - away[:, None] * normal, matrix(about[:, None] * normal) @ home


def off(robot: Robot, position_m: Floats, rotation: Floats) -> Floats:
    """How far poses are from the plane or the ball joint: (n,) m, rotations at the platform's edge; 0 without one.

    Parameters
    ----------
    robot : Robot
    position_m : (n, 3) array
    rotation : (n, 3, 3) array
    """
    x, R = onto(robot, position_m, rotation)
    return np.maximum(np.abs(x - position_m).max(1), robot.size_m * np.abs(R - rotation).max((1, 2)))


def normal_force(robot: Robot, position_m: Floats, rotation: Floats, tension_N: Floats) -> float:
    """Force with which the plane carries the platform, N; below zero it would have to pull.

    Parameters
    ----------
    robot : Robot
        On a plane.
    position_m : (3,) array
    rotation : (3, 3) array
    tension_N : (w,) array
    """
    assert robot.plane is not None
    shape = statics.geometry_at(robot, position_m, rotation)
    pull = shape.direction[..., 0] @ (robot.lines * tension_N)
    return float(robot.plane.normal @ (pull + np.array([0.0, 0.0, robot.mass_kg * GRAVITY])))


def friction_half_width(robot: Robot, stiffness: Floats, normal_N: float) -> tuple[Floats, Floats]:
    """Half widths of the set of poses at which friction can hold the platform.

    Parameters
    ----------
    robot : Robot
        On a plane.
    stiffness : (n, 6, 6) or (n, 3, 3) array
        As `statics.stiffness` gives it.
    normal_N : float
        Force of the plane.

    Returns
    -------
    displacement_m : (n, 3) array
        Along the world's axes.
    turn_rad : (n,) array
        About the normal; zeros where parallel lines keep the orientation.
    """
    plane, P = robot.plane, robot.motions
    assert plane is not None and P is not None
    most_N = plane.friction * abs(normal_N)
    size = np.ones(robot.degrees)
    size[3:] = plane.contact_radius_m
    # columns: the displacement of each unit force and of each unit moment that the ring can bear
    answer = np.linalg.inv(stiffness) @ (P * size)
    width = most_N * np.linalg.norm(answer, axis=2)
    turn = most_N * np.linalg.norm(plane.normal @ answer[:, 3:], axis=1) if robot.degrees == 6 else np.zeros(len(width))
    return width[:, :3], turn

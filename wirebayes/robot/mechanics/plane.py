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

from wirebayes.numeric.batches import batch_first, batch_last
from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics import rotation as turning
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import GRAVITY, Lengths, Poses, Robot
from wirebayes.robot.mechanics.rotation import matrix
from wirebayes.robot.mechanics.wires import Wires, tension


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
    plane = robot.plane
    assert plane is not None
    square = _held_square(robot, stiffness, normal_N)
    width = np.sqrt(np.einsum("nii->ni", square)[:, :3])
    if robot.degrees == 3:
        return width, np.zeros(len(width))
    about = plane.normal @ square[:, 3:, 3:] @ plane.normal
    return width, np.sqrt(about)


def _held_square(robot: Robot, stiffness: Floats, normal_N: float) -> Floats:
    """``(n, d, d)`` matrices ``A`` of the ellipsoids ``x^T A^-1 x <= 1`` of poses at which friction can hold."""
    plane, P = robot.plane, robot.motions
    assert plane is not None and P is not None
    most_N = plane.friction * abs(normal_N)
    # columns: the displacement of each unit force and of each unit moment that the ring can bear
    answer = most_N * np.linalg.inv(stiffness) @ (P * _ring(robot))
    return answer @ answer.mT


def _ring(robot: Robot) -> Floats:
    """(d,) What friction of the ring makes of 1 N: a force, or a moment."""
    assert robot.plane is not None
    size = np.ones(robot.degrees)
    size[3:] = robot.plane.contact_radius_m
    return size


def friction_departure(robot: Robot, wires: Wires, poses: Poses, lengths: Lengths, normal_N: float) -> float:
    """How far the wires' pull at the farthest poses that friction can hold is from what their stiffness foresees.

    Parameters
    ----------
    robot : Robot
        On a plane.
    wires : Wires
        ``n`` draws.
    poses : (n, 3), (n, 3, 3) arrays
    lengths : (n, w), (n, w) arrays
        That hold these poses.
    normal_N : float
        Force of the plane.

    Returns
    -------
    float
        Of the largest friction, the largest difference at the ends of the ellipsoid, median over draws.
    """
    plane, (x, R) = robot.plane, poses
    assert plane is not None and robot.motions is not None
    most_N = plane.friction * abs(normal_N)
    if most_N == 0:
        return 0.0
    pull, stiffness = _pull(robot, wires, x, R, lengths)
    square = _held_square(robot, stiffness, normal_N)
    departures = []
    for way in _ways(robot):
        end = _end_along(square, way)
        at_end = x + end[:, :3], _turned(robot, R, end)
        there, _ = _pull(robot, wires, *at_end, lengths)
        foreseen = (stiffness @ end[..., None])[..., 0] @ robot.motions
        surplus = _as_forces(robot, there - pull - foreseen)
        departures.append(np.linalg.norm(surplus, axis=1))
    largest = np.max(departures, axis=0)
    return float(np.median(largest) / most_N)


def _ways(robot: Robot) -> Floats:
    """(k, d) unit displacements along the axes and, of a platform that turns, about the normal."""
    assert robot.plane is not None
    ways = np.eye(robot.degrees)
    if robot.degrees == 6:
        about_normal = np.append(np.zeros(3), robot.plane.normal)
        ways = np.vstack([ways[:3], about_normal])
    return ways


def _end_along(square: Floats, way: Floats) -> Floats:
    """(n, d) ends along a way (d,) of ellipsoids with the matrices (n, d, d)."""
    across = square @ way
    half = np.sqrt(across @ way)[:, None]
    return np.divide(across, half, out=np.zeros_like(across), where=half > 0)


def _turned(robot: Robot, R: Floats, displacement: Floats) -> Floats:
    """Rotations (n, 3, 3) turned on by displacements (n, d); of a point, as they are."""
    if robot.degrees < 6:
        return R
    turned = turning.compose(displacement[:, 3:].T, batch_last(R))
    return batch_first(turned)


def _as_forces(robot: Robot, wrench: Floats) -> Floats:
    """Forces and moments (n, d), moments as the forces at the ring that bear them."""
    ring = _ring(robot)
    unit = np.divide(1.0, ring, out=np.zeros_like(ring), where=ring > 0)
    return wrench * unit


def _pull(robot: Robot, wires: Wires, x: Floats, R: Floats, lengths: Lengths) -> tuple[Floats, Floats]:
    """(n, d) forces and moments along the plane that poses need, and (n, d, d) their slopes."""
    zero_m, offset_m = (length.T for length in lengths)
    turn = batch_last(R)
    shape = statics.geometry(robot, x.T, turn)
    tension_N, slope = tension(wires, statics.stretched(robot, shape, offset_m), zero_m)
    force, stiffness = statics.unbalance_and_stiffness(robot, shape, turn, tension_N, slope)
    return force.T, batch_first(stiffness)

"""Proof by interval arithmetic that a box of poses holds exactly one equilibrium, for all wire parameters in a box.

Krawczyk's operator on the balance of forces and moments (`balance`). For parameters that vary much, see `reach`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.proof.ball_arithmetic import Balance, Bounds, ball_matrix, balls, column, identity, upper_bounds
from wirebayes.robot.proof.krawczyk import box_around_image, image_of_centre, preconditioner
from wirebayes.wire.laws import ElasticLaw


@dataclass(frozen=True)
class Certificate:
    """What was proved.

    Attributes
    ----------
    proved : bool
        For every choice of parameters within their bounds, exactly one equilibrium lies in the enclosure.
    centre_m, rotation : (3,), (3, 3) arrays
        Pose that the enclosure is about.
    radius_m : (6 or 3,) array
        Half widths of the enclosure: displacements, then turns times the platform's size. NaN when not proved.
    unique_m : float
        Half width of the largest tried box about the pose that was proved to hold no second equilibrium.
    """

    proved: bool
    centre_m: Floats
    rotation: Floats
    radius_m: Floats
    unique_m: float


def certify(
    robot: Robot,
    law: ElasticLaw,
    k1_N: Bounds,
    zero_m: Bounds,
    offset_m: Floats,
    position_m: Floats,
    rotation: Floats,
    how_alone: bool = True,
) -> Certificate:
    """Try to prove that one equilibrium, and only one, lies near a pose.

    Parameters
    ----------
    robot : Robot
    law : {"hooke", "modified"}
    k1_N, zero_m : pairs of (w,) arrays
        Bounds of stiffness and zero-tension length; equal bounds for known values.
    offset_m : (w,) array
        As in `forward.solve_equilibrium`.
    position_m, rotation : (3,), (3, 3) arrays
        Approximate solution for the middle of the bounds.
    how_alone : bool
        Whether to look for the largest box without a second equilibrium, which costs most of the time.

    Returns
    -------
    Certificate

    Raises
    ------
    ImportError
        python-flint is not installed.
    """
    system = Balance(robot, law, k1_N, zero_m, offset_m, position_m, rotation)
    C = preconditioner(system)
    if C is None:
        return _unproved(robot, position_m, rotation)
    image = partial(_image, system, C)
    radius = box_around_image(image, robot.degrees, robot.span_m)
    if radius is None:
        return _unproved(robot, position_m, rotation)
    for _ in range(3):  # inside, further images only shrink the enclosure
        radius = np.minimum(radius, image(radius))
    unique = float(radius.min())
    if how_alone:
        unique = _alone_within(image, radius, robot.span_m)
    return Certificate(True, position_m, rotation, radius, unique)


def _unproved(robot: Robot, position_m: Floats, rotation: Floats) -> Certificate:
    return Certificate(False, position_m, rotation, np.full(robot.degrees, np.nan), 0.0)


def _alone_within(image: Callable[[Floats], Floats], radius: Floats, span_m: float) -> float:
    """Half width of the largest of ever wider boxes that hold their images, at least the proved box."""
    unique, width = float(radius.min()), 1e-7 * span_m
    while width < span_m:
        box = np.maximum(radius, width)
        if not np.all(image(box) < box):
            break
        unique = max(unique, width)
        width *= 1.5
    return unique


def _image(system: Balance, C: Floats, radius: Floats) -> Floats:
    """Largest distance from the centre of Krawczyk's image of the box of half widths `radius`."""
    box = balls(radius)
    _, slope = system.evaluate(box)
    precondition = ball_matrix(C)
    remainder = (identity(len(box)) - precondition * slope) * column(box)
    return upper_bounds(remainder + image_of_centre(system, precondition))

"""What proofs by Krawczyk's operator share: a box that holds its own image holds exactly one equilibrium."""

from collections.abc import Callable
from typing import Any

import numpy as np

from wirebayes.numeric.typing import Floats
from wirebayes.robot.proof.ball_arithmetic import Balance

_FIRST = 1e-10  # of the robot's size: the first box, larger than rounding and smaller than any answer
_GROWTH = 1.2  # of the image: the next box, so that its own image has room in it
_IMAGES = 40  # tried: most proofs need less than ten


def preconditioner(system: Balance) -> Floats | None:
    """Inverse of the slope at the centre; None where the platform is free to move: no isolated equilibrium."""
    try:
        return np.asarray(np.linalg.inv(system.middle_slope()), np.float64)
    except np.linalg.LinAlgError:
        return None


def box_around_image(image: Callable[[Floats], Floats], directions: int, span_m: float) -> Floats | None:
    """A box grown until it holds its image.

    Parameters
    ----------
    image : function of half widths ``(d,)``
        Half widths of the image of a box.
    directions : int
        d.
    span_m : float
        The robot's size: a box as wide will not come back.

    Returns
    -------
    (d,) array or None
        Half widths; None where no box holds its image.
    """
    radius = np.full(directions, _FIRST * span_m)
    for _ in range(_IMAGES):
        reached = image(radius)
        if np.all(reached < radius):
            return radius
        radius = _GROWTH * reached
        if not np.all(radius < span_m):
            return None
    return None


def image_of_centre(system: Balance, precondition: Any) -> Any:
    """A Newton step from the centre, in balls ``(d, 1)``.

    Wire by wire: an uncertain tension moves all balances together, so it is multiplied in last.
    """
    weight, pulls = system.at_centre()
    image = -(precondition * weight)
    for wrench, tension in pulls:
        image -= (precondition * wrench) * tension
    return image

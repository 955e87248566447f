"""Proof by interval arithmetic that a box of poses holds exactly one equilibrium, for all wire parameters in a box.

Krawczyk's operator on the balance of forces and moments (`balance`). For parameters that vary much, see `reach`.
"""

from dataclasses import dataclass

import numpy as np

from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.proof.ball_arithmetic import Balance, Bounds, above
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
    d = robot.degrees
    nothing = Certificate(False, position_m, rotation, np.full(d, np.nan), 0.0)
    try:
        C = np.asarray(np.linalg.inv(system.middle_slope()), np.float64)
    except np.linalg.LinAlgError:  # the platform is free to move: no isolated equilibrium
        return nothing
    span = robot.span_m
    radius = np.full(d, 1e-10 * span)
    for _ in range(40):
        image = _krawczyk(system, C, radius)
        if np.all(image < radius):
            break
        radius = 1.2 * image
        if not np.all(radius < span):  # all of the robot: it grows and will not come back
            return nothing
    else:
        return nothing
    # Inside, further images only shrink the enclosure.
    for _ in range(3):
        radius = np.minimum(radius, _krawczyk(system, C, radius))
    unique, width = float(radius.min()), 1e-7 * span
    while how_alone and width < span:
        box = np.maximum(radius, width)
        if not np.all(_krawczyk(system, C, box) < box):
            break
        unique, width = max(unique, width), 1.5 * width
    return Certificate(True, position_m, rotation, radius, unique)


def _krawczyk(system: Balance, C: Floats, radius: Floats) -> Floats:
    """Largest distance from the centre of Krawczyk's image of the box of half widths `radius`."""
    import flint

    d = len(radius)
    box = [flint.arb(0, float(r)) for r in radius]
    _, slope = system.evaluate(box)
    precondition = flint.arb_mat(C.tolist())
    eye = flint.arb_mat([[int(i == j) for j in range(d)] for i in range(d)])
    image = (eye - precondition * slope) * flint.arb_mat([[b] for b in box])
    # Wire by wire: an uncertain tension moves all balances together, so it is multiplied in last.
    weight, pulls = system.at_centre()
    image -= precondition * weight
    for wrench, tau in pulls:
        image -= (precondition * wrench) * tau
    out = [image[i, 0].abs_upper() for i in range(d)]
    return above(out)

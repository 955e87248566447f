"""Creep follows the tensions of earlier holds, and these follow the robot's unknowns."""

from dataclasses import replace

import numpy as np
from scipy.linalg import solve_triangular

from wirebayes.numeric.linear_algebra import solve
from wirebayes.numeric.typing import Floats
from wirebayes.robot.self_calibration.equations import LEAST_DAMPING, Equations, own_normal


def followed(e: Equations) -> Equations:
    """Equations whose slopes by the robot's unknowns count what reaches a hold through the tensions before it.

    Loops and balance determine a hold's tensions once the robot's unknowns are given. What a hold's tensions err by
    themselves is small beside that in later loops, and left out, so that holds can still be eliminated one by one.

    Parameters
    ----------
    e : Equations
    """
    if e.by_earlier is None:
        return e
    holds, _, legs, _ = e.by_earlier.shape
    size = holds * legs
    loop = e.rows["loop"]
    answer = _tensions_by_residuals(e, legs)
    own = (answer @ e.by_robot).reshape(size, -1)
    later = np.einsum("hij,hkjl->hikl", answer[..., loop], e.by_earlier)
    chain = np.eye(size) - later.reshape(size, size)
    if not (np.isfinite(chain).all() and np.isfinite(own).all()):  # no equilibrium yet: nothing follows
        return e
    tensions = solve_triangular(chain, own, lower=True, unit_diagonal=True, check_finite=False)
    loops = e.by_earlier.swapaxes(1, 2).reshape(size, size) @ tensions
    by_robot = e.by_robot.copy()
    by_robot[:, loop] += loops.reshape(holds, legs, -1)
    return replace(e, by_robot=by_robot, by_earlier=None)


def _tensions_by_residuals(e: Equations, legs: int) -> Floats:
    """(p, w, k) how the tensions that fit a hold's equations best answer to their residuals."""
    best = solve(own_normal(e.by_hold, LEAST_DAMPING), e.by_hold.mT)
    return -best[:, -legs:]

"""What the residuals of a calibration show: the noise in them, and whether they are as small as they should be."""

import numpy as np
from scipy.special import chdtrc, fdtrc

from wirebayes.numeric.means import root_mean_square
from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.self_calibration.equations import EXACT, FRICTIONLESS, Holds
from wirebayes.robot.self_calibration.posterior import Whole
from wirebayes.robot.self_calibration.trust import joint_test
from wirebayes.robot.self_calibration.unknowns import Unknowns

# Of the span: half a millimetre of five metres is thought of joint values before anything was read, as drums that wind
# layers have them. Thought exact, they would stay so: loops that are closed exactly show no error.
USUAL = 1e-4
# Weight of `USUAL` beside the readings, in degrees of freedom. Where nobody read tensions, their scatter explains what
# errors of lengths would, and ten readings or more must say otherwise.
_LEAST_DEGREES, _BLIND_DEGREES = 1.0, 10.0
_FINEST = 1e-2  # of the usual error: no encoder with drum and wire does better
# Of the span: loops that stay so far open belong to another robot, in another unit or another order. Layers on a drum
# and a printer's anchors that are off by a decimetre leave less.
_LOST = 0.01
_EXPLAINED = 3.0  # times the stated error of a joint value: loops that are no further open say nothing of the robot


def trust(found: Whole) -> float:
    """Probability of residuals and estimates this far from model and priors: `trust.joint_test`.

    A hold's own unknowns have no prior, so each of them costs a degree of freedom. Geometry and references are tested
    alone too. Where nobody read tensions, two more tests share the level: tensions far outside the range that the
    robot's file allows, or an error of the loops far above what is usual, show that lengths and geometry contradict
    each other.
    """
    e, unknowns = found.equations, found.unknowns
    rows = e.rows["tension"]
    unread = ~e.known[:, rows]
    open_ = float(leverage(found, rows)[unread].sum())
    beyond = float((e.residual[:, rows][unread] ** 2).sum())
    count = float(e.known.sum()) - e.by_hold.shape[0] * e.by_hold.shape[2] + open_
    first = np.r_[0 : unknowns.slices["wires"].start, unknowns.references]
    white, spread = found.state.white[first], found.covariance[np.ix_(first, first)]
    p = float(joint_test(np.array([found.cost - beyond]), max(count, 1.0), white[None], spread[None], len(first))[0])
    if not unread.any():
        return p
    tensions = float(chdtrc(max(unread.sum() - open_, 1.0), beyond))
    return min(1.0, 2.0 * p, 4.0 * tensions, 4.0 * _usual_noise(found))  # p has the better of two tests times two


def misfit(found: Whole) -> float:
    """Mean squared residual of what was read or stated, the balance aside."""
    e = found.equations
    read = [e.residual[:, part][e.known[:, part]] for name, part in e.rows.items() if name != "balance"]
    return float(np.mean(np.concatenate(read) ** 2))


def length_rms_m(found: Whole) -> float:
    """Root mean square of what is left of the loops, along one line each, m."""
    e = found.equations
    left = e.residual[:, e.rows["loop"]] * found.noise.joint_m / found.unknowns.robot.lines
    return root_mean_square(left)


def lost(found: Whole) -> bool:
    """Whether nothing near the robot, however it errs, has these joint values."""
    return not length_rms_m(found) <= lost_m(found)


def lost_m(found: Whole) -> float:
    """How far loops are open, m, from where on they are those of another robot."""
    return most_open_m(found, _LOST)


def most_open_m(found: Whole, share: float) -> float:
    """How far loops may stay open along one line: a share of the span, or what stated errors of joint values explain.

    Parameters
    ----------
    found : Whole
    share : float
    """
    robot, stated = found.unknowns.robot, found.unknowns.errors.joint_m
    line = (stated or 0.0) * float(np.sqrt(np.mean(1.0 / robot.lines**2)))
    return max(share * robot.span_m, _EXPLAINED * line)


def usual_joint(robot: Robot, holds: Holds) -> tuple[float, float]:
    """Error of a joint value before anything was read, m, and its weight in degrees of freedom."""
    read = np.isfinite(holds.tension_N).any()
    return USUAL * robot.span_m, _LEAST_DEGREES if read else _BLIND_DEGREES


def joint_error(unknowns: Unknowns, holds: Holds) -> float:
    """Error of a joint value before anything was read, m: as stated, or usual."""
    stated, robot = unknowns.errors.joint_m, unknowns.robot
    return usual_joint(robot, holds)[0] if stated is None else max(stated, EXACT * robot.span_m)


def noise_shown(found: Whole, usual_m: float, worth: float) -> tuple[Floats, float]:
    """Logarithms of the noises of loops and balance that the residuals show, and the degrees of freedom of the first.

    Restricted maximum likelihood; the usual error of the loops, `usual_m`, is `worth` some degrees of freedom.

    Parameters
    ----------
    found : Whole
    usual_m, worth : float
        What `usual_joint` returned.
    """
    e, robot, stated = found.equations, found.unknowns.robot, found.unknowns.errors.joint_m

    def shown(rows: str, sd: float, usual: float, worth: float) -> tuple[float, float]:
        residual = e.residual[:, e.rows[rows]]
        left = 1.0 - leverage(found, e.rows[rows])
        squares = float((residual**2).sum()) * sd**2
        free = float(np.maximum(left, 0.0).sum()) + worth
        return float(np.sqrt((squares + worth * usual**2) / free)), free

    balance, _ = shown("balance", found.noise.balance, FRICTIONLESS, _LEAST_DEGREES)
    balance = float(np.clip(balance, 1e-2 * FRICTIONLESS, 1e2))
    if stated is not None:  # every error is: what is left unbalanced then speaks against them
        return np.log([found.noise.joint_m, FRICTIONLESS]), np.inf
    joint, degrees = shown("loop", found.noise.joint_m, usual_m, worth)
    return np.log([np.clip(joint, _FINEST * usual_m, robot.span_m), balance]), degrees


def leverage(found: Whole, rows: slice) -> Floats:
    """(p, r) share of each residual's variance that the unknowns take up."""
    z, g = found.equations.by_hold[:, rows], found.equations.by_robot[:, rows]
    total = g + z @ found.by_robot
    alone = found.hold_covariance - found.by_robot @ found.covariance @ found.by_robot.swapaxes(1, 2)
    own = np.einsum("pri,pij,prj->pr", z, alone, z)
    return own + np.einsum("pri,ij,prj->pr", total, found.covariance, total)


def _usual_noise(found: Whole) -> float:
    """Probability of an error of the loops as large as found, where what is usual is all that was known of it."""
    if not np.isfinite(found.degrees) or found.equations.known[:, found.equations.rows["tension"]].any():
        return 1.0
    usual, worth = USUAL * found.unknowns.robot.span_m, _BLIND_DEGREES
    free = max(found.degrees - worth, 1e-9)
    shown = (found.degrees * found.noise.joint_m**2 - worth * usual**2) / free
    return float(fdtrc(free, worth, max(shown, 0.0) / usual**2))

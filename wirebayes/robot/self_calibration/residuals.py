"""What the residuals of a calibration show: the noise in them, and whether they are as small as they should be."""

import numpy as np
from scipy.special import chdtrc, fdtrc

from wirebayes.numeric.means import root_mean_square
from wirebayes.numeric.typing import Bools, Floats
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.self_calibration.equations import EXACT, FRICTIONLESS, Equations, Holds
from wirebayes.robot.self_calibration.posterior import RobotPosterior
from wirebayes.robot.self_calibration.trust import SIGNIFICANT, joint_test
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
_TESTS = 4.0  # that share the level where nobody read tensions; those of all residuals are two of them
_CONTRADICTED = 1e2  # mean squared residual: readings ten standard errors off
_EXPLAINED = 3.0  # times the stated error of a joint value: loops that are no further open say nothing of the robot


def trust(found: RobotPosterior) -> float:
    """Probability of residuals and estimates this far from model and priors: `trust.joint_test`.

    A hold's own unknowns have no prior, so each of them costs a degree of freedom. Geometry and references are tested
    alone too. Where nobody read tensions, and lengths do not tell them, two more tests share the level: tensions far
    outside the range that the robot's file allows, or an error of the loops far above what is usual, show that lengths
    and geometry contradict each other.
    """
    p = _joint_probability(found)
    unread = _unread(found)
    if not unread.any() or lengths_tell(found.unknowns, ~unread):
        return p
    tensions = _outside_range(found)
    return min(1.0, 2.0 * p, _TESTS * tensions, _TESTS * _usual_noise(found))  # p has the better of two tests times two


def lengths_tell(unknowns: Unknowns, read: Bools) -> bool:
    """Whether tensions that nobody read follow from joint values that are exact, and these from tensions that were.

    Parameters
    ----------
    unknowns : Unknowns
    read : (p, w) bool array
        Which tensions were.
    """
    return unknowns.errors.joint_m == 0 and bool(read.any())


def _joint_probability(found: RobotPosterior) -> float:
    """`trust.joint_test` of what was read and stated."""
    cost, count = whole_cost(found)
    unknowns = found.unknowns
    alone = [unknowns.geometry, unknowns.of_lines]
    p = joint_test(np.array([cost]), count, found.state.white[None], found.covariance[None], alone)
    return float(p[0])


def whole_cost(found: RobotPosterior) -> tuple[float, float]:
    """Sum of squares of what was read and stated, the prior's included, and its degrees of freedom."""
    e = found.equations
    holds, _, own = e.by_hold.shape
    count = float(e.known.sum()) - holds * own + _taken_up(found)
    return found.cost - _beyond_usual(found), max(count, 1.0)


def _taken_up(found: RobotPosterior) -> float:
    """Degrees of freedom that the unknowns take up of the tensions that nobody read."""
    e = found.equations
    of_tensions = leverage(found, e.rows["tension"])[_unread(found)]
    carried = leverage(found, _carried(e))
    return float(of_tensions.sum() + carried.sum())


def _beyond_usual(found: RobotPosterior) -> float:
    """Squared residuals, summed, of tensions that nobody read about what is usual."""
    e = found.equations
    usual = e.residual[:, e.rows["tension"]][_unread(found)]
    carried = e.residual[:, _carried(e)]
    return float((usual**2).sum() + (carried**2).sum())


def _carried(equations: Equations) -> slice:
    """Rows of what the tensions that nobody read carry; none where nothing is usual of tensions."""
    return equations.rows.get("carried", slice(0, 0))


def _outside_range(found: RobotPosterior) -> float:
    """Probability of tensions, those that nobody read, as far from each wire's own level and that from what is usual.

    Of all of them: those that carry the platform leave the file's range, too, where geometry is wrong.
    """
    unread = _unread(found)
    unit_N = found.noise.pull_N
    off = np.where(unread, found.state.pull_N - found.noise.usual_N, 0.0) / unit_N
    scale = found.unknowns.errors.level_N / unit_N
    level = scale * off.sum(0) / (1.0 + scale**2 * unread.sum(0))
    left = (off - scale * level)[unread]
    return float(chdtrc(unread.sum(), (left**2).sum() + (level**2).sum()))


def _unread(found: RobotPosterior) -> Bools:
    """(p, w) Which tensions nobody read."""
    rows = found.equations.rows["tension"]
    return ~found.equations.known[:, rows]


def misfit(found: RobotPosterior) -> float:
    """Mean squared residual of what was read or stated with an error, the balance aside."""
    e = found.equations
    errors = found.unknowns.errors
    exact = {"balance"}
    if errors.joint_m == 0:
        exact.add("loop")
    if errors.pose_m == 0:
        exact.add("pose")
    read = []
    for name, part in e.rows.items():
        if name not in exact:
            known = e.known[:, part]
            read.append(e.residual[:, part][known])
    residuals = np.concatenate(read)
    return float(np.mean(residuals**2)) if residuals.size else 0.0


def contradicted(found: RobotPosterior) -> bool:
    """Whether what was read contradicts stated errors beyond doubt: of readings that may err more, nothing is known."""
    return found.unknowns.errors.joint_m is not None and misfit(found) > _CONTRADICTED


def length_rms_m(found: RobotPosterior) -> float:
    """Root mean square of what is left of the loops, along one line each, m."""
    e = found.equations
    left = e.residual[:, e.rows["loop"]] * found.noise.joint_m / found.unknowns.robot.lines
    return root_mean_square(left)


def lost(found: RobotPosterior) -> bool:
    """Whether nothing near the robot, however it errs, has these joint values."""
    return not length_rms_m(found) <= lost_m(found)


def lost_m(found: RobotPosterior) -> float:
    """How far loops are open, m, from where on they are those of another robot."""
    return most_open_m(found, _LOST)


def most_open_m(found: RobotPosterior, share: float) -> float:
    """How far loops may stay open along one line: a share of the span, or what stated errors of joint values explain.

    Parameters
    ----------
    found : RobotPosterior
    share : float
    """
    robot = found.unknowns.robot
    stated = found.unknowns.errors.joint_m
    line = (stated or 0.0) * float(np.sqrt(np.mean(1.0 / robot.lines**2)))
    return max(share * robot.span_m, _EXPLAINED * line)


def usual_joint(robot: Robot, holds: Holds) -> tuple[float, float]:
    """Error of a joint value before anything was read, m, and its weight in degrees of freedom."""
    read = np.isfinite(holds.tension_N).any()
    return USUAL * robot.span_m, _LEAST_DEGREES if read else _BLIND_DEGREES


def joint_error(unknowns: Unknowns, holds: Holds) -> float:
    """Error of a joint value before anything was read, m: as stated, or usual."""
    stated = unknowns.errors.joint_m
    robot = unknowns.robot
    return usual_joint(robot, holds)[0] if stated is None else max(stated, EXACT * robot.span_m)


def noise_shown(found: RobotPosterior, usual_m: float, worth: float) -> tuple[Floats, float]:
    """Logarithms of the noises of loops and balance that the residuals show, and the degrees of freedom of the first.

    Restricted maximum likelihood; the usual error of the loops, `usual_m`, is `worth` some degrees of freedom.

    Parameters
    ----------
    found : RobotPosterior
    usual_m, worth : float
        What `usual_joint` returned.
    """
    robot = found.unknowns.robot
    stated = found.unknowns.errors.joint_m
    balance, _ = _shown(found, "balance", found.noise.balance, FRICTIONLESS, _LEAST_DEGREES)
    balance = float(np.clip(balance, 1e-2 * FRICTIONLESS, 1e2))
    if stated is not None:  # every error is: what is left unbalanced then speaks against them
        return np.log([found.noise.joint_m, FRICTIONLESS]), np.inf
    joint, degrees = _shown(found, "loop", found.noise.joint_m, usual_m, worth)
    joint = np.clip(joint, _FINEST * usual_m, robot.span_m)
    return np.log([joint, balance]), degrees


def _shown(found: RobotPosterior, rows: str, sd: float, usual: float, worth: float) -> tuple[float, float]:
    """The noise of some equations by restricted maximum likelihood, and its degrees of freedom."""
    at = found.equations.rows[rows]
    residual = found.equations.residual[:, at]
    left = 1.0 - leverage(found, at)
    squares = float((residual**2).sum()) * sd**2
    free = float(np.maximum(left, 0.0).sum()) + worth
    return float(np.sqrt((squares + worth * usual**2) / free)), free


def shown_joint_m(found: RobotPosterior) -> float:
    """Error of a joint value that the readings show by themselves, without what is usual, m."""
    loops = found.equations.rows["loop"]
    checks = np.maximum(1.0 - leverage(found, loops), 0.0).sum()
    squares = (found.equations.residual[:, loops] ** 2).sum()
    return float(found.noise.joint_m * np.sqrt(squares / max(checks, 1.0)))


def leverage(found: RobotPosterior, rows: slice) -> Floats:
    """(p, r) share of each residual's variance that the unknowns take up."""
    by_hold = found.equations.by_hold[:, rows]
    by_robot = found.equations.by_robot[:, rows]
    total = by_robot + by_hold @ found.by_robot
    from_robot = found.by_robot @ found.covariance @ found.by_robot.mT
    alone = found.hold_covariance - from_robot
    own = np.einsum("pri,pij,prj->pr", by_hold, alone, by_hold)
    return own + np.einsum("pri,ij,prj->pr", total, found.covariance, total)


def unusually_open(found: RobotPosterior) -> bool:
    """Whether loops are open so much farther than is usual that `trust` is lost, where lengths alone were read."""
    return _TESTS * _usual_noise(found) < SIGNIFICANT


def _usual_noise(found: RobotPosterior) -> float:
    """Probability of an error of the loops as large as found, where what is usual is all that was known of it."""
    e = found.equations
    read = e.known[:, e.rows["tension"]].any()
    if read or not np.isfinite(found.degrees):
        return 1.0
    usual = USUAL * found.unknowns.robot.span_m
    free = max(found.degrees - _BLIND_DEGREES, 1.0)  # where loops hardly check each other, rounding is no evidence
    shown = (found.degrees * found.noise.joint_m**2 - _BLIND_DEGREES * usual**2) / free
    return float(fdtrc(free, _BLIND_DEGREES, max(shown, 0.0) / usual**2))

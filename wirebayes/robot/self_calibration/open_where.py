"""Where readings contradict each other: in one hold, or in one wire or two, rather than everywhere."""

import numpy as np
from scipy.special import betainc

from wirebayes.numeric.means import root_mean_square
from wirebayes.numeric.typing import Floats
from wirebayes.result_warnings import Notice
from wirebayes.robot.mechanics import rotation
from wirebayes.robot.self_calibration.posterior import RobotPosterior
from wirebayes.robot.self_calibration.residuals import USUAL, leverage
from wirebayes.robot.self_calibration.session import Session
from wirebayes.sentences import listed, number, short

# Shares of the sum of squares of all loops. A wrong column left 70 to 96 % in its wire, two columns in the place of
# each other 81 % in their two of eight wires; scatter in all lengths left at most 28 % in one of four, 41 % in two of
# eight.
_ONE, _TWO, _HOLD = 0.6, 0.75, 0.5
_WIRES, _MORE_WIRES, _HOLDS = 4, 6, 4  # with fewer, such shares mean nothing
# Times the error of a reference length and the creep of the wire that crept most, by which a pose may be off. In
# simulated sessions of every shipped robot it was off by at most 2.7 times their sum.
_FAR = 10.0
_CHANCE = 1e-4  # that some hold of a sound session stands out as much


def most_open(found: RobotPosterior, session: Session) -> str:
    """Which hold, or which wires, have most of what is open; empty where it is everywhere.

    Parameters
    ----------
    found : RobotPosterior
        Of a search that found no robot with these joint values.
    session : Session
    """
    share = _shares(found)
    if not np.isfinite(share).all():
        return ""
    said = _open_wires(share.sum(0))
    holds = share.sum(1)
    worst = int(holds.argmax())
    if len(holds) >= _HOLDS and holds[worst] > _HOLD:
        said.append(f"hold {session.numbers[worst]:g} ({100 * holds[worst]:.0f} %)")
    return f", mostly in {' and in '.join(said)}" if said else ""


def _open_wires(share: Floats) -> list[str]:
    """The wire or two that have most of what is open; none where all have their part."""
    order = np.argsort(share)[::-1]
    largest = share[order[0]]
    two_largest = share[order[:2]].sum()
    if len(share) >= _WIRES and largest > _ONE:
        return [f"joint value {order[0] + 1} ({100 * largest:.0f} % of the sum of squares)"]
    if len(share) >= _MORE_WIRES and two_largest > _TWO:
        two = listed([str(leg + 1) for leg in sorted(order[:2])])
        return [f"joint values {two} ({100 * two_largest:.0f} % of the sum of squares)"]
    return []


def odd_hold(found: RobotPosterior, session: Session) -> list[Notice]:
    """A notice that one hold's lengths contradict the others, estimated with it, by far more than these do.

    Parameters
    ----------
    found : RobotPosterior
        Of a search that converged.
    session : Session
    """
    unknowns = found.unknowns
    equations = found.equations
    if unknowns.errors.joint_m is not None:
        return []  # then the joint test knows
    robot = unknowns.robot
    joint_m = found.noise.joint_m
    share = _shares(found).sum(1)
    p = _chances(found, share)
    worst = int(p.argmin())
    residual = equations.residual[worst, equations.rows["loop"]]
    open_m = residual * joint_m / robot.lines
    visible = root_mean_square(open_m) > USUAL * robot.span_m
    unlikely = len(p) * p[worst] < _CHANCE
    if not (unlikely and visible):
        return []
    leg = int(np.abs(open_m).argmax())
    text = _odd_in_words(session.numbers[worst], share[worst], leg, joint_m)
    return [Notice("data", text)]


def contradicted_requests(found: RobotPosterior, requested: Session | None) -> list[Notice]:
    """A notice for each hold whose requested pose is not where the joint values lead, for any plausible lengths.

    Parameters
    ----------
    found : RobotPosterior
    requested : Session, optional
        With the poses that the robot was sent to.
    """
    if requested is None or not found.converged:
        return []
    robot = found.unknowns.robot
    prior = found.unknowns.prior
    shift = np.linalg.norm(found.state.position_m - requested.position_m, axis=1)
    turn = rotation.vector(requested.rotation.mT @ found.state.rotation)
    angle = np.linalg.norm(turn, axis=1)
    apart = np.maximum(shift, robot.size_m * angle)
    creep_m = float((found.creep.strain[-1] * found.last_m).max())
    plausible_m = _FAR * (prior.reference_sd_m + creep_m)
    out = []
    for i in np.flatnonzero(apart > plausible_m):
        text = (
            f"hold {requested.numbers[i]:g}: the requested pose is {shift[i]:.3g} m and {angle[i]:.2g} rad from the "
            f"one that its joint values lead to, more than errors of the lengths and creep explain "
            f"({short(plausible_m, 2)} m); check both"
        )
        out.append(Notice("misfit", text))
    return out


def _odd_in_words(hold: float, share: float, leg: int, joint_m: float) -> str:
    return (
        f"hold {hold:g} contradicts the others: {100 * share:.0f} % of the sum of squares of "
        f"all lengths is its own, most of it joint value {leg + 1}; correct that row or leave it out, for the error of "
        f"all joint values, {number(1e3 * joint_m, 2)} mm, was estimated with it"
    )


def _chances(found: RobotPosterior, share: Floats) -> Floats:
    """(p,) Probability that a hold of a sound session has so large a share."""
    left = 1.0 - leverage(found, found.equations.rows["loop"])
    free = np.maximum(left, 0.0).sum(1)
    others = free.sum() - free
    with np.errstate(invalid="ignore"):
        p = betainc(0.5 * others, 0.5 * free, 1.0 - share)
    return np.where((free > 0) & (others > 0), p, 1.0)


def _shares(found: RobotPosterior) -> Floats:
    """(p, w) of the sum of squares of all loops, a line each."""
    e = found.equations
    squares = (e.residual[:, e.rows["loop"]] / found.unknowns.robot.lines) ** 2
    return squares / squares.sum()

"""Following an equilibrium while lengths change: where a stable pose goes, and where it ceases to exist.

A solver finds some equilibrium of the new lengths; the platform stays on the one that continues its own. A step is
accepted when it ends where the stiffness at its start predicts; otherwise it is divided until it does, or until a
jump is left that no division removes: there the platform falls.
"""

from dataclasses import dataclass

import numpy as np

from wirebayes.numeric import cholesky
from wirebayes.numeric.batches import batch_first
from wirebayes.numeric.rows import chosen_rows, pair_at, put_rows, rows_of
from wirebayes.numeric.typing import Bools, Floats, Indices, Ints
from wirebayes.robot.mechanics.description import Lengths, Poses, Robot
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion import forward, mixed, outcome
from wirebayes.robot.motion.balance import balance_at, tensions_at

SMALLEST = 2.0**-20  # of a step: a jump that is left there is a fall
_TRUST = 0.5  # a step that ends further from its prediction, relative to its length, is divided
# The longest prediction that is believed, of the robot's span, and rad: where wires slacken at the new lengths the
# stiffness is all but singular, the prediction goes anywhere, and any jump would be within its trust.
_FARTHEST, _FARTHEST_RAD = 0.05, 0.5
_STRAY = 4.0  # times what is trusted: Newton's method comes back from as far, a platform that falls goes on
_ASIDE = 1e-6  # of the platform's size: a disturbance too small to be seen, too large to be rounding
_SMALL = 1e-7  # of the platform's size: so short a Newton step leaves only rounding
_JUMP = 1e-7  # of the robot's span: the smallest jump that counts as one
_SLIP = 1e-5  # of the robot's span, a hundredth of a millimetre a metre: a longer jump is a fall whoever asks

Slip = tuple[float, float]  # distance, m, and angle, rad, of a jump


@dataclass(frozen=True)
class Followed:
    """Where ``n`` equilibria went.

    Attributes
    ----------
    here : Equilibria
        At the new lengths; of those that fell the last pose before, with the status `outcome.FELL`.
    share : (n,) array
        Share of the change up to which each could be followed; 1 where to the end.
    drop_m : (n,) array
        How far the platform falls, to the equilibrium that catches it; infinite where none does, 0 without a fall.
    slip : (distance_m, angle_rad)
        The largest jump that is no fall.
    """

    here: forward.Equilibria
    share: Floats
    drop_m: Floats
    slip: Slip

    def _go_on(self, rows: Indices, there: forward.Equilibria, held: Bools, share: Floats) -> None:
        """Take over the poses that held, in their rows, and how far along they are."""
        for name in ("position_m", "rotation", "tension_N", "status", "residual_N"):
            getattr(self.here, name)[rows] = getattr(there, name)[held]
        self.share[rows] = share[held]

    def _catch(
        self, robot: Robot, wires: Wires, rows: Indices, share: Floats, lengths: Lengths, begin: Poses, may_slip: Bools
    ) -> Bools:
        """Note where platforms that jumped come to rest; (n,) says which of them fell.

        The others slip to an equilibrium so near that they go on from there, at their `share` of the change.
        """
        caught = at_rest(robot, wires, lengths, begin)
        slips = caught.found & may_slip & _within(self.slip, caught.poses, begin)
        self._go_on(rows[slips], caught, slips, share)
        distance = np.linalg.norm(caught.position_m - begin[0], axis=1)
        lost = caught.status == outcome.NOT_CONVERGED
        ended = np.where(lost, outcome.NOT_CONVERGED, outcome.FELL)
        dropped = np.where(caught.found, distance, np.inf)
        self.here.status[rows[~slips]] = ended[~slips]
        self.drop_m[rows[~slips]] = dropped[~slips]
        return ~slips


def follow(
    robot: Robot,
    wires: Wires,
    start: Poses,
    old: Lengths,
    new: Lengths,
    smallest: float = SMALLEST,
    slip: Slip | None = None,
) -> Followed:
    """Follow equilibria from old lengths to new ones, in a straight line.

    Parameters
    ----------
    robot : Robot
    wires : Wires
        ``n`` draws.
    start : (n, 3), (n, 3, 3) arrays
        Stable poses at the old lengths.
    old, new : pairs of (n, w) arrays
        Zero-tension lengths and offsets, as in `forward.solve_equilibrium`.
    smallest : float
        Share of the change down to which it is divided; what jumps there still counts as a fall.
    slip : pair of floats, optional
        The largest jump that is no fall, m and rad: the platform is followed from where it is caught. It is at most a
        share of the robot's span, the default.

    Returns
    -------
    Followed
    """
    followed, good = _undivided(robot, wires, start, old, new, slip_of(robot, slip))
    here = followed.here
    n = len(good)
    divided = _Divided(np.full(n, 0.5), np.zeros(n, bool), np.full(n, robot.legs))
    balanced = np.isfinite(here.position_m).all(1)
    live = np.flatnonzero(~good & balanced)
    while live.size:
        ahead = followed.share[live] + divided.step[live]
        share = np.minimum(ahead, 1.0)
        between = _between(old, new, live, share)
        part = wires.part(live)
        pose = pair_at(here.poses, live)
        there, held = _step(robot, part, pose, here.tension_N[live], between)
        followed._go_on(live[held], there, held, share)
        divided.adapt(live, held)
        fell = ~held & (divided.step[live] < smallest)
        jumped = np.flatnonzero(fell)
        if jumped.size:
            rows = live[jumped]
            at = share[jumped], pair_at(between, jumped), pair_at(pose, jumped)
            fell[jumped] = followed._catch(robot, part.part(jumped), rows, *at, divided.slips[rows] > 0)
            divided.go_on(rows[~fell[jumped]])
        going_on = ~fell & (followed.share[live] < 1.0)
        live = live[going_on]
    return followed


def _between(old: Lengths, new: Lengths, rows: Indices, share: Floats) -> Lengths:
    """Some lengths and offsets on the straight line from old to new ones, each at its own share of the way."""
    zero = old[0][rows] + share[:, None] * (new[0][rows] - old[0][rows])
    offset = old[1][rows] + share[:, None] * (new[1][rows] - old[1][rows])
    return zero, offset


def slip_of(robot: Robot, slip: Slip | None) -> Slip:
    """The largest jump that is no fall: a share of the robot's span, or what is given if it is less.

    Parameters
    ----------
    robot : Robot
    slip : (distance_m, angle_rad) or None
    """
    most_m = _SLIP * robot.span_m
    distance_m, angle_rad = slip or (np.inf, np.inf)
    return min(distance_m, most_m), min(angle_rad, most_m / robot.size_m)


def _undivided(
    robot: Robot, wires: Wires, start: Poses, old: Lengths, new: Lengths, slip: Slip
) -> tuple[Followed, Bools]:
    """All at once, as most need no division; the others are where they were, and (n,) says which are not."""
    x, R = np.array(start[0]), np.array(start[1])
    tau = tensions_at(robot, wires, x, R, *old)
    whole, good = _step(robot, wires, (x, R), tau, new)
    whole.position_m[~good] = x[~good]
    whole.rotation[~good] = R[~good]
    whole.tension_N[~good] = tau[~good]
    return Followed(whole, np.where(good, 1.0, 0.0), np.zeros(len(x)), slip), good


@dataclass(frozen=True)
class _Divided:
    """Into what the change of each of n is divided.

    Attributes
    ----------
    step : (n,) array
        Share of the change that is tried next.
    hesitant : (n,) bool array
        Whether the last step was not held.
    slips : (n,) int array
        How many more jumps may be slips: every wire lets go or takes over once, and what jumps on and on is a fall.
    """

    step: Floats
    hesitant: Bools
    slips: Ints

    def go_on(self, rows: Indices) -> None:
        """Long steps again after slips: what was hard lies behind."""
        self.step[rows] = 0.5
        self.slips[rows] -= 1

    def adapt(self, live: Indices, held: Bools) -> None:
        """Longer steps where one held, half as long where it did not.

        After a division one step of the same length: what was hard a moment ago is still near.
        """
        rows = live[held]
        self.step[rows] *= np.where(self.hesitant[rows], 1.0, 2.0)
        self.hesitant[live] = ~held
        self.step[live[~held]] *= 0.5


def _step(
    robot: Robot, wires: Wires, start: Poses, tension_N: Floats, lengths: Lengths
) -> tuple[forward.Equilibria, Bools]:
    """Solutions from starts, and whether each is where one Newton step says that it is.

    Where the step leads further than is believed, nothing is solved: no solution would be taken.
    """
    zero, offset = lengths
    near, ahead = mixed.approach(robot, wires, start, tension_N, lengths)
    predicted = mixed.after_step(robot, start, ahead)
    # Where the stiffness predicts nothing, as of wires that part just now, what does not jump has not fallen.
    ahead = np.where(np.isfinite(ahead), ahead, 0.0)
    believed = _believed(robot, ahead)
    solvable = chosen_rows(believed, zero, np.nan)
    way = np.linalg.norm(ahead, axis=1)
    trusted = _TRUST * way + _JUMP * robot.span_m
    # what strays farther than this and ends there is farther from its prediction than is trusted
    leash = _STRAY * (trusted + _apart_m(robot, near, predicted))
    there = forward.solve_equilibrium(robot, wires, solvable, offset, *near, leash_m=leash)
    _let_go(robot, wires, there, lengths)
    near_prediction = _apart_m(robot, there.poses, predicted) <= trusted
    held = there.found & believed & near_prediction
    return there, held


def _believed(robot: Robot, ahead: Floats) -> Bools:
    """(n,) Which predicted steps are no longer than is believed."""
    displaced = np.linalg.norm(ahead[:, :3], axis=1)
    turned = np.linalg.norm(ahead[:, 3:], axis=1)
    short = displaced <= _FARTHEST * robot.span_m
    return short & (turned <= _FARTHEST_RAD * robot.size_m)


def _apart_m(robot: Robot, there: Poses, predicted: Poses) -> Floats:
    """(n,) how far poses lie from predicted ones: in place, or by the turn at the platform's edge."""
    position, rotation = predicted
    displaced = np.linalg.norm(there[0] - position, axis=1)
    turn = there[1] @ rotation.mT - np.eye(3)
    turned = np.linalg.norm(turn, axis=(1, 2))
    return np.maximum(displaced, robot.size_m * turned)


def _within(slip: Slip, there: Poses, here: Poses) -> Bools:
    """(n,) Which poses lie no farther from others than a slip."""
    displaced = np.linalg.norm(there[0] - here[0], axis=1)
    turn = there[1] @ here[1].mT - np.eye(3)
    angle = np.linalg.norm(turn, axis=(1, 2)) / np.sqrt(2.0)
    return (displaced <= slip[0]) & (angle <= slip[1])


def _let_go(robot: Robot, wires: Wires, there: forward.Equilibria, lengths: Lengths) -> None:
    """Put in place of unstable balances the equilibria next to them, to which the least disturbance leads.

    Where wires that were just not slack part from a symmetric platform, it tilts until some are taut again.
    """
    loose = np.flatnonzero(there.status == outcome.NOT_HELD)
    if not loose.size:
        return
    zero, offset = lengths
    own_lengths = pair_at((zero, np.broadcast_to(offset, zero.shape)), loose)
    own_wires = wires.part(loose)
    balance = pair_at(there.poses, loose)
    softest = _softest(robot, own_wires, balance, own_lengths)
    aside = mixed.after_step(robot, balance, _ASIDE * robot.size_m * softest)
    found = forward.solve_equilibrium(robot, own_wires, *own_lengths, *aside)
    put_rows(there, loose[found.found], rows_of(found, found.found))


def at_rest(robot: Robot, wires: Wires, lengths: Lengths, start: Poses) -> forward.Equilibria:
    """Where platforms come to rest from poses: no unstable balance, but the equilibrium next to it.

    Parameters
    ----------
    robot : Robot
    wires : Wires
        ``n`` draws.
    lengths : pair of (n, w) arrays
        As in `forward.solve_equilibrium`.
    start : (position, rotation)
        (n, 3) or (3,), m, and (n, 3, 3) or (3, 3).
    """
    there = forward.solve_equilibrium(robot, wires, *lengths, *start)
    _let_go(robot, wires, there, lengths)
    return there


def _softest(robot: Robot, wires: Wires, balance: Poses, lengths: Lengths) -> Floats:
    """(n, d) motions against which the stiffness is least."""
    _, hessian = balance_at(robot, wires, *balance, *lengths)
    _, directions = np.linalg.eigh(batch_first(hessian))
    return directions[..., 0]


def settle(robot: Robot, wires: Wires, near: Poses, lengths: Lengths, small: float = _SMALL) -> forward.Equilibria:
    """Solutions hardly away from poses: one Newton step is exact enough for most, the others are solved in full.

    Parameters
    ----------
    robot : Robot
    wires : Wires
    near : (position, rotation)
        Poses (n, 3), m, and (n, 3, 3), which the solutions are expected to be close to.
    lengths : (zero, offset)
        Zero-tension lengths (n, w) and lengths beyond the exit points, m.
    small : float
        Longest Newton step, of the platform's size, that is taken as the solution.

    Returns
    -------
    Equilibria
    """
    step = newton_step(robot, wires, near, lengths)
    pose = mixed.after_step(robot, near, step)
    tau = tensions_at(robot, wires, *pose, *lengths)
    out = _as_found(*pose, tau)
    # the error left is of the order of the step's square over a wire's length
    exact = np.linalg.norm(step, axis=1) < small * robot.size_m
    far = np.flatnonzero(~exact)
    if far.size:
        rest = forward.solve_equilibrium(robot, wires.part(far), *pair_at(lengths, far), *pair_at(near, far))
        put_rows(out, far, rest)
    return out


def _as_found(position_m: Floats, rotation: Floats, tension_N: Floats) -> forward.Equilibria:
    """Poses as equilibria that one step led to."""
    n = len(position_m)
    status, count = np.full(n, outcome.FOUND), np.ones(n, np.int64)
    return forward.Equilibria(position_m, rotation, tension_N, status, count, np.zeros(n))


def newton_step(robot: Robot, wires: Wires, start: Poses, lengths: Lengths) -> Floats:
    """Where one Newton step towards equilibrium leads.

    Parameters
    ----------
    robot : Robot
    wires : Wires
    start : (position, rotation)
        (n, 3), m, and (n, 3, 3).
    lengths : (zero, offset)
        Zero-tension lengths (n, w) and lengths beyond the exit points, m.

    Returns
    -------
    (n, 6 or 3) array
        Displacement, m, then turn in metres at the platform's edge; NaN where the stiffness is not positive definite.
    """
    gradient, H = balance_at(robot, wires, *start, *lengths)
    step, positive = cholesky.solve_symmetric(H, -gradient)
    return np.where(positive, step, np.nan).T

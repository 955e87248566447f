"""The balance that is nearest to a pose, the tensions within bounds: sequential linearisation.

Unknown are rotation and tensions; known is the position, unless it may move. Balance and the components of the rotation
vector that are asked for are equations. Every step is the smallest that solves the equations where they are linearised,
by a singular value decomposition, so that robots whose equations depend on each other (all wires in one plane) need no
case of their own. A wire whose tension leaves its bounds is held at the bound; where the search has come to rest and
could come nearer without, it is let go, once. So is the one that is held longest where no step leads to a balance.
"""

from dataclasses import dataclass

import numpy as np

from wirebayes.numeric.batches import batch_first, batch_last
from wirebayes.numeric.rows import chosen_rows, rows_of
from wirebayes.numeric.typing import Bools, Floats, Indices, Ints
from wirebayes.robot.mechanics import rotation as turning
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import GRAVITY, Poses, Robot
from wirebayes.robot.motion.loose_balance import DEPENDENT, equations, largest_imbalance, slope_by_place, vector_by_turn

_STEPS = 80  # of linearisation; a dozen are usual, and a family of solutions that bends much takes more
_LONGEST_RAD = 0.3  # turned in a step: beyond, what was linearised means little
_BALANCED = 1e-11  # of the weight: an imbalance of rounding
_NEARLY = 1e-3  # rad: so small a step has nearly come to rest, and tensions are what they will be
_FAR_FROM_BALANCE = 0.1  # of the unit of forces: balance comes first
_SETTLED = 1e-10  # rad: a step so small changes nothing
_PLACE = 30.0  # weight of a position, in spans, that may move: it is what shall stay, before angles and tensions
_HINDERED = 1e-6  # of the goal's slope by a tension: what holds a search back by less does not hold it back
_UNSOLVED = 100.0  # times the step, both in units of the equations: what is left is not what the step takes away
_LESSER = 1e-3  # weight of what decides only where the first aim, tensions or angles, leaves a choice


@dataclass(frozen=True)
class Balances:
    """Where ``n`` beginnings led: poses, tensions, the distance from the target, and whether that is a balance."""

    position_m: Floats
    rotation: Floats
    tension_N: Floats
    distance_rad: Floats
    balanced: Bools


def nearest_balances(
    robot: Robot, position_m: Floats, begin: Floats, target: Floats, asked: Floats, movable: bool = False
) -> Balances:
    """Balances nearest to target orientations, the tensions within the robot's bounds.

    Parameters
    ----------
    robot : Robot
    position_m : (n, 3) array
    begin, target : (n, 3, 3) arrays
        Where the search begins, and what it shall come near to.
    asked : (3,) array
        Components of the rotation vector, NaN where free.
    movable : bool
        Whether the position may change too, as little as possible.
    """
    aim = _Aim(robot, asked, movable)
    search = _Search.beginning(aim, position_m, begin)
    for _ in range(_STEPS):
        rows = search.going_on()
        if not rows.size:
            break
        here = search.at(rows)
        goal = position_m[rows], target[rows]
        step = aim.step(here, goal, search.bound[rows])
        known = np.isfinite(step.change).all(1)
        lost = rows[~known]
        search.dead[lost] = True
        search.take(rows[known], rows_of(step, known))
    return search.balances(target)


@dataclass(frozen=True)
class _Step:
    """A step of ``n`` searches.

    Attributes
    ----------
    change : (n, 6 + w) array
        Displacement, turn, and change of the tensions in units of force; NaN where none leads on.
    imbalance : (n,) array
        What the equations leave before the step, in units of force.
    hindrance : (n, w) array
        How much nearer to the goal a search would come by leaving each wire's bound inwards; below 0: not at all.
    """

    change: Floats
    imbalance: Floats
    hindrance: Floats


@dataclass(frozen=True)
class _Search:
    """Where n searches for a balance stand.

    Attributes
    ----------
    aim : _Aim
    x, R, tau : (n, 3), (n, 3, 3) and (n, w) arrays
    bound : (n, w) int array
        -1 and 1: held at the lowest and the highest tension.
    since : (n, w) int array
        How many wires were held before each.
    freed : (n, w) bool array
        Whether each wire was let go already: a second time would be a circle.
    done, dead : (n,) bool arrays
        Whether each has come to rest, and whether it can go no further.
    """

    aim: "_Aim"
    x: Floats
    R: Floats
    tau: Floats
    bound: Ints
    since: Ints
    freed: Bools
    done: Bools
    dead: Bools

    @classmethod
    def beginning(cls, aim: "_Aim", position_m: Floats, rotation: Floats) -> "_Search":
        x, R = np.array(position_m), np.array(rotation)
        tau = _first_tensions(aim.robot, x, R)
        bound = np.zeros(tau.shape, np.int64)
        none = np.zeros(len(tau), bool)
        return cls(aim, x, R, tau, bound, bound.copy(), bound != 0, none, none.copy())

    def at(self, rows: Indices) -> tuple[Floats, Floats, Floats]:
        """Poses and tensions of some searches."""
        return self.x[rows], self.R[rows], self.tau[rows]

    def going_on(self) -> Indices:
        """The searches that have neither come to rest nor are lost."""
        return np.flatnonzero(~self.done & ~self.dead)

    def take(self, rows: Indices, step: _Step) -> None:
        """Take the steps of some searches, then hold wires at their bounds or let them go."""
        self.move(rows, step.change)
        change = np.abs(step.change[:, :6]).max(1)
        newly = self.hold_at_bounds(rows, change < _NEARLY)
        balanced = step.imbalance < _BALANCED
        rest = balanced & (change < _SETTLED) & ~newly
        self.done[rows] = rest & ~self.let_go(rows, rest, step.hindrance)
        unsolved = step.imbalance > _UNSOLVED * np.abs(step.change).max(1)
        self.let_go_oldest(rows[unsolved & ~rest & ~newly])

    def move(self, rows: Indices, change: Floats) -> None:
        """Take the steps (k, 6 + w) of some searches."""
        self.x[rows] += change[:, :3]
        turned = turning.compose(change[:, 3:6].T, self.R[rows].transpose(1, 2, 0))
        self.R[rows] = turned.transpose(2, 0, 1)
        self.tau[rows] += self.aim.unit * change[:, 6:]

    def hold_at_bounds(self, rows: Indices, nearly: Bools) -> Bools:
        """Hold what has left its bounds where a search is `nearly` there, and say which searches hold more now."""
        tau = self.tau[rows]
        newly = self.aim.newly_bound(tau, self.bound[rows]) & nearly[:, None]
        side = np.where(tau < self.aim.robot.rule.lowest_N, -1, 1)
        self.bound[rows] += np.where(newly, side, 0)
        since = self.since[rows]
        last = since.max(1, keepdims=True)
        self.since[rows] = np.where(newly, last + 1, since)
        return np.asarray(newly.any(1))

    def let_go(self, rows: Indices, rest: Bools, hindrance: Floats) -> Bools:
        """Let go the wire whose bound keeps a search most from its goal, and say which searches have one.

        Parameters
        ----------
        rows : (k,) int array
            The searches.
        rest : (k,) bool array
            Which of them have come to rest.
        hindrance : (k, w) array
            As in `_Step`.
        """
        most = np.where(self.freed[rows], 0.0, hindrance).argmax(1)
        there = rows, most
        hinders = hindrance[np.arange(len(rows)), most] > _HINDERED
        wrongly = rest & ~self.freed[there] & hinders
        self.bound[there] = np.where(wrongly, 0, self.bound[there])
        self.freed[there] |= wrongly
        return wrongly

    def let_go_oldest(self, rows: Indices) -> None:
        """Let go, in searches that no step brings to a balance, the wire that is held longest."""
        held = (self.bound[rows] != 0) & ~self.freed[rows]
        oldest = np.where(held, self.since[rows], np.iinfo(np.int64).max).argmin(1)
        there = rows, oldest
        some = held.any(1)
        self.bound[there] = np.where(some, 0, self.bound[there])
        self.freed[there] |= some

    def balances(self, target: Floats) -> Balances:
        """What has come to rest in balance, within the bounds of tensions, with what is asked for."""
        rule = self.aim.robot.rule
        left, size = largest_imbalance(self.aim.robot, self.x, self.R, self.tau)
        balanced = left < 100 * _BALANCED * size
        good = self.done & balanced & self._inside() & self.aim.reached(self.R)
        turn = turning.vector(self.R @ target.mT)
        far = np.linalg.norm(turn, axis=1)
        return Balances(self.x, self.R, np.clip(self.tau, rule.lowest_N, rule.highest_N), far, good)

    def _inside(self) -> Bools:
        """(n,) Whether all tensions are within their bounds, but for rounding."""
        rule = self.aim.robot.rule
        slack = 1e-9 * np.maximum(np.abs(self.tau).max(1), self.aim.unit)
        lowest, highest = self.tau.min(1), self.tau.max(1)
        return (lowest >= rule.lowest_N - slack) & (highest <= rule.highest_N + slack)


@dataclass(frozen=True)
class _Aim:
    """What searches of a robot aim at beside balance.

    Attributes
    ----------
    robot : Robot
    asked : (3,) array
        Components of the rotation vector, NaN where free.
    movable : bool
        Whether the position may change too.
    """

    robot: Robot
    asked: Floats
    movable: bool

    @property
    def unit(self) -> float:
        """The unit in which forces are counted, N."""
        return float(max(self.robot.mass_kg * GRAVITY, self.robot.rule.lowest_N))

    def step(self, at: tuple[Floats, Floats, Floats], goal: Poses, bound: Ints) -> _Step:
        """The smallest step from poses and tensions that solves the linearised equations and comes nearest to a goal.

        Parameters
        ----------
        at : position, rotation and tensions
        goal : position and rotation
        bound : (n, w) int array
        """
        A, value = self._linearised(at, bound)
        imbalance = np.abs(value).max(1)
        wish, weight = self._wish(at, goal)
        far = imbalance > _FAR_FROM_BALANCE
        wish[far] = 0.0
        sound = _all_finite(A, value)  # a wire without length has no direction
        B = chosen_rows(sound, A / weight, 0.0)
        wished = chosen_rows(sound, wish * weight, np.nan)
        changed = (B @ wished[..., None])[..., 0]
        back, multiplier = _least_change(B, value + changed)
        of_bounds = multiplier[:, -bound.shape[1] :]  # the bounds' equations are the last
        hindrance = -bound * of_bounds
        change = _cut((wished - back) / weight)
        return _Step(change, imbalance, hindrance)

    def _linearised(self, at: tuple[Floats, Floats, Floats], bound: Ints) -> tuple[Floats, Floats]:
        """Slopes (n, e, 6 + w) and values (n, e) of all equations."""
        force, by_turn, by_tension = equations(self.robot, *at)
        by_place = np.zeros((*force.shape, 3))
        if self.movable:
            by_place = slope_by_place(self.robot, *at)
        A = np.concatenate([by_place / self.unit, by_turn / self.unit, by_tension], 2)
        extra, more = self._side_conditions(at[1], at[2], bound)
        return np.concatenate([A, extra], 1), np.concatenate([force / self.unit, more], 1)

    def _wish(self, at: tuple[Floats, Floats, Floats], goal: Poses) -> tuple[Floats, Floats]:
        """What the step (n, 6 + w) should be if nothing had to balance, and how much each part (6 + w,) weighs."""
        x, R, tau = at
        place = goal[0] - x if self.movable else np.zeros_like(x)
        turn = turning.vector(goal[1] @ R.mT)
        pull = (_reference(self.robot) - tau) / self.unit
        weights = _PLACE / self.robot.span_m, *self._angle_and_pull()
        return np.concatenate([place, turn, pull], 1), np.repeat(weights, (3, 3, tau.shape[1]))

    def _angle_and_pull(self) -> tuple[float, float]:
        """Weights of angles and tensions."""
        if self.movable:
            return _LESSER, _LESSER
        return (_LESSER, 1.0) if self.robot.is_underactuated else (1.0, _LESSER)

    def _side_conditions(self, R: Floats, tau: Floats, bound: Ints) -> tuple[Floats, Floats]:
        """Rows of the equations that say what is asked for, and which tensions are held at a bound."""
        n, legs = tau.shape
        rows, values = np.zeros((n, 3 + legs, 6 + legs)), np.zeros((n, 3 + legs))
        vector = turning.vector(R)
        wanted = np.isfinite(self.asked)
        rows[:, :3, 3:6] = np.where(wanted[:, None], vector_by_turn(vector), 0.0)
        values[:, :3] = np.where(wanted, vector - np.where(wanted, self.asked, 0.0), 0.0)
        held = bound != 0
        rows[:, 3:, 6:] = np.eye(legs) * held[:, None]
        values[:, 3:] = np.where(held, self._beyond(tau, bound) / self.unit, 0.0)
        return rows, values

    def _beyond(self, tau: Floats, bound: Ints) -> Floats:
        """(n, w) How far tensions are beyond the bounds at which they are held, N."""
        rule = self.robot.rule
        return tau - np.where(bound < 0, rule.lowest_N, rule.highest_N)

    def newly_bound(self, tau: Floats, bound: Ints) -> Bools:
        """(n, w) Of each row the wire that is farthest beyond its bounds, where there is one."""
        rule = self.robot.rule
        beyond = np.maximum(rule.lowest_N - tau, tau - rule.highest_N)
        beyond = np.where(bound == 0, beyond, -np.inf)
        out = np.zeros(tau.shape, bool)
        out[np.arange(len(tau)), beyond.argmax(1)] = beyond.max(1) > 1e-9 * self.unit
        return out

    def reached(self, R: Floats) -> Bools:
        """(n,) Whether rotations have the components that are asked for."""
        near = np.abs(turning.vector(R) - self.asked) < 1e-8
        return np.asarray((np.isnan(self.asked) | near).all(1))


def _all_finite(A: Floats, value: Floats) -> Bools:
    """(n,) Which equations are finite."""
    return np.asarray(np.isfinite(A).all((1, 2)) & np.isfinite(value).all(1))


def _least_change(A: Floats, value: Floats) -> tuple[Floats, Floats]:
    """The smallest vectors that linear equations map to values, and Lagrange's multipliers."""
    inverse = np.linalg.pinv(A, rcond=DEPENDENT)
    least = inverse @ value[..., None]
    return least[..., 0], (inverse.mT @ least)[..., 0]


def _cut(change: Floats) -> Floats:
    """Steps (n, 6 + w), long ones shorter in the same direction."""
    turned = np.linalg.norm(change[:, 3:6], axis=1)
    share = np.minimum(1.0, _LONGEST_RAD / np.maximum(turned, 1e-300))
    return change * share[:, None]


def _first_tensions(robot: Robot, x: Floats, R: Floats) -> Floats:
    """Tensions that come nearest to balance, none below the lowest."""
    turn = batch_last(R)
    shape = statics.geometry(robot, x.T, turn)
    J = batch_first(statics.wire_jacobian(robot, shape))[:, :3]
    load = statics.weight(robot, turn).T[:, :3]
    tau = (np.linalg.pinv(J, rcond=1e-3) @ load[..., None])[..., 0]
    lowest = max(robot.rule.lowest_N, 1e-3 * robot.mass_kg * GRAVITY)
    return np.clip(tau, lowest, robot.rule.highest_N)


def _reference(robot: Robot) -> float:
    """The tension that the robot's rule comes nearest to, N."""
    rule = robot.rule
    return 0.0 if rule.choice == "minimum_norm" else 0.5 * (rule.lowest_N + rule.highest_N)

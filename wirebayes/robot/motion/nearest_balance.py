"""The balance that is nearest to a pose, the tensions within bounds: sequential linearisation.

Unknown are rotation and tensions; known is the position, unless it may move. Balance and the components of the rotation
vector that are asked for are equations. Every step is the smallest that solves the equations where they are linearised,
by a singular value decomposition, so that robots whose equations depend on each other (all wires in one plane) need no
case of their own. A wire whose tension leaves its bounds is held at the bound; where the search has come to rest and
could come nearer without, it is let go, once. So is the one that is held longest where no step leads to a balance.
"""

from dataclasses import dataclass

import numpy as np

from wirebayes.numeric.typing import Bools, Floats, Indices, Ints
from wirebayes.robot.mechanics import rotation as turning
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import GRAVITY, Robot
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
    unit = _unit(robot)
    search = _Search.beginning(robot, position_m, begin)
    for _ in range(_STEPS):
        rows = np.flatnonzero(~search.done & ~search.dead)
        if not rows.size:
            break
        goal = position_m[rows], target[rows]
        step, imbalance, hindrance = _step(robot, search.at(rows), goal, asked, search.bound[rows], unit, movable)
        turned = np.linalg.norm(step[:, 3:6], axis=1)
        step *= np.minimum(1.0, _LONGEST_RAD / np.maximum(turned, 1e-300))[:, None]
        lost = ~np.isfinite(step).all(1)
        search.dead[rows[lost]] = True
        rows, step, imbalance, hindrance = rows[~lost], step[~lost], imbalance[~lost], hindrance[~lost]
        search.move(rows, step, unit)
        change = np.abs(step[:, :6]).max(1)
        newly = search.hold_at_bounds(rows, change < _NEARLY, robot, unit)
        rest = (imbalance < _BALANCED) & (change < _SETTLED) & ~newly
        search.done[rows] = rest & ~search.let_go(rows, rest, hindrance)
        search.let_go_oldest(rows[(imbalance > _UNSOLVED * np.abs(step).max(1)) & ~rest & ~newly])
    return search.balances(robot, target, asked)


def _unit(robot: Robot) -> float:
    """In which forces are counted, N."""
    return float(max(robot.mass_kg * GRAVITY, robot.rule.lowest_N))


@dataclass(frozen=True)
class _Search:
    """Where n searches for a balance stand.

    Attributes
    ----------
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

    x: Floats
    R: Floats
    tau: Floats
    bound: Ints
    since: Ints
    freed: Bools
    done: Bools
    dead: Bools

    @classmethod
    def beginning(cls, robot: Robot, position_m: Floats, rotation: Floats) -> "_Search":
        n = len(rotation)
        x, R = np.array(position_m), np.array(rotation)
        bound = np.zeros((n, robot.legs), np.int64)
        none = np.zeros(n, bool)
        return cls(x, R, _first_tensions(robot, x, R), bound, bound.copy(), bound != 0, none, none.copy())

    def at(self, rows: Indices) -> tuple[Floats, Floats, Floats]:
        """Poses and tensions of some searches."""
        return self.x[rows], self.R[rows], self.tau[rows]

    def move(self, rows: Indices, step: Floats, unit: float) -> None:
        """Take the steps (k, 6 + w) of some searches."""
        self.x[rows] += step[:, :3]
        self.R[rows] = turning.compose(step[:, 3:6].T, self.R[rows].transpose(1, 2, 0)).transpose(2, 0, 1)
        self.tau[rows] += unit * step[:, 6:]

    def hold_at_bounds(self, rows: Indices, nearly: Bools, robot: Robot, unit: float) -> Bools:
        """Hold what has left its bounds where a search is `nearly` there, and say which searches hold more now."""
        low, high = robot.rule.lowest_N, robot.rule.highest_N
        tau = self.tau[rows]
        newly = _newly_bound(tau, self.bound[rows], (low, high), unit) & nearly[:, None]
        self.bound[rows] += np.where(newly, np.where(tau < low, -1, 1), 0)
        self.since[rows] = np.where(newly, self.since[rows].max(1, keepdims=True) + 1, self.since[rows])
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
            As `_step` returns it.
        """
        most = np.where(self.freed[rows], 0.0, hindrance).argmax(1)
        there = rows, most
        wrongly = rest & ~self.freed[there] & (hindrance[np.arange(len(rows)), most] > _HINDERED)
        self.bound[there] = np.where(wrongly, 0, self.bound[there])
        self.freed[there] |= wrongly
        return np.asarray(wrongly)

    def let_go_oldest(self, rows: Indices) -> None:
        """Let go, in searches that no step brings to a balance, the wire that is held longest."""
        held = (self.bound[rows] != 0) & ~self.freed[rows]
        there = rows, np.where(held, self.since[rows], np.iinfo(np.int64).max).argmin(1)
        some = held.any(1)
        self.bound[there] = np.where(some, 0, self.bound[there])
        self.freed[there] |= some

    def balances(self, robot: Robot, target: Floats, asked: Floats) -> Balances:
        """What has come to rest in balance, within the bounds of tensions, with what is asked for."""
        low, high = robot.rule.lowest_N, robot.rule.highest_N
        left, size = largest_imbalance(robot, self.x, self.R, self.tau)
        slack = 1e-9 * np.maximum(np.abs(self.tau).max(1), _unit(robot))
        inside = (self.tau.min(1) >= low - slack) & (self.tau.max(1) <= high + slack)
        reached = np.isnan(asked) | (np.abs(turning.vector(self.R) - asked) < 1e-8)
        good = self.done & (left < 100 * _BALANCED * size) & inside & reached.all(1)
        far = np.linalg.norm(turning.vector(self.R @ target.swapaxes(1, 2)), axis=1)
        return Balances(self.x, self.R, np.clip(self.tau, low, high), far, good)


def _step(
    robot: Robot,
    at: tuple[Floats, Floats, Floats],
    goal: tuple[Floats, Floats],
    asked: Floats,
    bound: Ints,
    unit: float,
    movable: bool,
) -> tuple[Floats, Floats, Floats]:
    """The smallest step from poses and tensions that solves the linearised equations and comes nearest to the goal.

    Returns
    -------
    step : (n, 6 + w) array
        Displacement, turn, and change of the tensions in `unit`.
    imbalance : (n,) array
        What the equations leave before the step, in `unit`.
    hindrance : (n, w) array
        How much nearer to the goal a search would come by leaving each wire's bound inwards; below 0: not at all.
    """
    A, value = _linearised(robot, at, asked, bound, unit, movable)
    wish, weight = _wish(robot, at, goal, unit, movable)
    wish[np.abs(value).max(1) > _FAR_FROM_BALANCE] = 0.0
    sound = np.asarray(np.isfinite(A).all((1, 2)) & np.isfinite(value).all(1))  # a wire without length has no direction
    B = np.where(sound[:, None, None], A / weight, 0.0)
    step = np.where(sound[:, None], wish * weight, np.nan)
    missed = value + (B @ step[..., None])[..., 0]
    inverse = np.linalg.pinv(B, rcond=DEPENDENT)
    back = inverse @ missed[..., None]
    multiplier = (inverse.swapaxes(1, 2) @ back)[..., 0]  # Lagrange's; the bounds' equations are the last
    return (step - back[..., 0]) / weight, np.abs(value).max(1), -bound * multiplier[:, -bound.shape[1] :]


def _linearised(
    robot: Robot,
    at: tuple[Floats, Floats, Floats],
    asked: Floats,
    bound: Ints,
    unit: float,
    movable: bool,
) -> tuple[Floats, Floats]:
    """Slopes (n, e, 6 + w) and values (n, e) of all equations."""
    x, R, tau = at
    force, by_turn, by_tension = equations(robot, x, R, tau)
    by_place = slope_by_place(robot, x, R, tau) if movable else np.zeros((len(tau), len(force[0]), 3))
    A = np.concatenate([by_place / unit, by_turn / unit, by_tension], 2)
    extra, more = _side_conditions(robot, R, tau, asked, bound, unit)
    return np.concatenate([A, extra], 1), np.concatenate([force / unit, more], 1)


def _wish(
    robot: Robot, at: tuple[Floats, Floats, Floats], goal: tuple[Floats, Floats], unit: float, movable: bool
) -> tuple[Floats, Floats]:
    """What the step (n, 6 + w) should be if nothing had to balance, and how much each part (6 + w,) of it weighs."""
    x, R, tau = at
    place = goal[0] - x if movable else np.zeros_like(x)
    turn = turning.vector(goal[1] @ R.swapaxes(1, 2))
    wish = np.concatenate([place, turn, (_reference(robot) - tau) / unit], 1)
    aim = (_LESSER, 1.0) if robot.is_underactuated else (1.0, _LESSER)
    angle, pull = (_LESSER, _LESSER) if movable else aim
    weights = _PLACE / robot.span_m, angle, pull
    return wish, np.repeat(weights, (3, 3, tau.shape[1]))


def _side_conditions(
    robot: Robot, R: Floats, tau: Floats, asked: Floats, bound: Ints, unit: float
) -> tuple[Floats, Floats]:
    """Rows of the equations that say what is asked for, and which tensions are held at a bound."""
    n, legs = tau.shape
    rows, values = np.zeros((n, 3 + legs, 6 + legs)), np.zeros((n, 3 + legs))
    vector = turning.vector(R)
    wanted = np.isfinite(asked)
    rows[:, :3, 3:6] = np.where(wanted[:, None], vector_by_turn(vector), 0.0)
    values[:, :3] = np.where(wanted, vector - np.where(wanted, asked, 0.0), 0.0)
    at = np.where(bound < 0, robot.rule.lowest_N, robot.rule.highest_N)
    rows[:, 3:, 6:] = np.eye(legs) * (bound != 0)[:, None]
    values[:, 3:] = np.where(bound != 0, (tau - at) / unit, 0.0)
    return rows, values


def _newly_bound(tau: Floats, bound: Ints, limits: tuple[float, float], unit: float) -> Bools:
    """(n, w) Of each row the wire that is farthest beyond its bounds, where there is one."""
    beyond = np.where(bound == 0, np.maximum(limits[0] - tau, tau - limits[1]), -np.inf)
    worst = beyond.argmax(1)
    out = np.zeros(tau.shape, bool)
    out[np.arange(len(tau)), worst] = beyond.max(1) > 1e-9 * unit
    return out


def _first_tensions(robot: Robot, x: Floats, R: Floats) -> Floats:
    """Tensions that come nearest to balance, none below the lowest."""
    turn = np.moveaxis(R, 0, -1)
    shape = statics.geometry(robot, x.T, turn)
    J = np.moveaxis(statics.wire_jacobian(robot, shape), -1, 0)[:, :3]
    load = statics.weight(robot, turn).T[:, :3]
    tau = (np.linalg.pinv(J, rcond=1e-3) @ load[..., None])[..., 0]
    return np.asarray(np.clip(tau, max(robot.rule.lowest_N, 1e-3 * robot.mass_kg * GRAVITY), robot.rule.highest_N))


def _reference(robot: Robot) -> float:
    """The tension that the robot's rule comes nearest to, N."""
    rule = robot.rule
    return 0.0 if rule.choice == "minimum_norm" else 0.5 * (rule.lowest_N + rule.highest_N)

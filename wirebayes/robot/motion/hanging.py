"""The orientation in which a platform hangs in balance at a position: what fewer wires than freedoms leave to gravity.

Unknown are rotation and tensions; known is the position. Balance and the components of the rotation vector that are
asked for are equations; of the solutions the one nearest to a reference orientation is meant, with tensions within
bounds. Sequential linearisation finds it: every step is the smallest that solves the equations where they are
linearised, by a singular value decomposition, so that robots whose equations depend on each other (all wires in one
plane) need no case of their own. A wire whose tension leaves its bounds is held at the bound.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics import rotation as turning
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import GRAVITY, Robot
from wirebayes.robot.motion import inverse
from wirebayes.robot.motion.loose_balance import (
    DEPENDENT,
    equations,
    largest_imbalance,
    null_space,
    scale_of,
    slope_by_place,
    stiffness_at_tension,
    vector_by_turn,
)

_STEPS = 80  # of linearisation; a dozen are usual, and a family of solutions that bends much takes more
_LONGEST_RAD = 0.3  # turned in a step: beyond, what was linearised means little
_BALANCED = 1e-11  # of the weight: an imbalance of rounding
_SETTLED = 1e-10  # rad: a step so small changes nothing
_PLACE = 30.0  # weight of a position, in spans, that may move: it is what shall stay, before angles and tensions
_LESSER = 1e-3  # weight of what decides only where the first aim, tensions or angles, leaves a choice
_ALIKE = 1e-6  # rad, and of the robot's span: nearer, two solutions are one
# Beginnings beside the reference: turned by so much about each axis, both ways; a solution further away than that is
# another one than was meant.
_TURNED_RAD = 0.7


@dataclass(frozen=True)
class Hanging:
    """How a platform hangs at ``p`` positions.

    Attributes
    ----------
    rotation : (p, 3, 3) array
        NaN where it cannot hang.
    tension_N : (p, w) array
    others : tuple of (k, 3) arrays
        Rotation vectors of the other stable orientations that were found at each position, rad.
    choice : (p,) int array
        How many components of the rotation can be chosen there.
    """

    rotation: Floats
    tension_N: Floats
    others: tuple[Floats, ...]
    choice: NDArray[np.int64]

    @property
    def held(self) -> NDArray[np.bool_]:
        """(p,) True where the platform hangs."""
        return np.asarray(np.isfinite(self.tension_N).all(1))


def hang(robot: Robot, position_m: Floats, reference: Floats, asked_rad: Floats | None = None) -> Hanging:
    """The stable orientation in balance that is nearest to a reference.

    Parameters
    ----------
    robot : Robot
        Whose platform may turn.
    position_m : (p, 3) array
    reference : (3, 3) or (p, 3, 3) array
        Orientation, level for example.
    asked_rad : (3,) array, optional
        Components of the rotation vector that are asked for, NaN where free; default: none is.

    Returns
    -------
    Hanging
        Stable means for wires that do not stretch.
    """
    p = len(position_m)
    near = np.broadcast_to(reference, (p, 3, 3))
    asked = np.full(3, np.nan) if asked_rad is None else asked_rad
    turns = _TURNED_RAD * np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])
    begin = (turning.matrix(turns)[None] @ near[:, None]).reshape(-1, 3, 3)
    x, target = (np.repeat(v, len(turns), 0) for v in (position_m, near))
    found = _balance(robot, x, begin, target, asked)
    good = found.balanced & _stable(robot, found)
    out = np.full((p, 3, 3), np.nan)
    tension, choice, others = np.full((p, robot.legs), np.nan), np.zeros(p, np.int64), []
    for k in range(p):
        rows = k * len(turns) + np.flatnonzero(good.reshape(p, -1)[k])
        rows = _distinct(found.rotation, rows[np.argsort(found.distance_rad[rows], kind="stable")])
        others.append(turning.vector(found.rotation[rows[1:]]).reshape(-1, 3))
        if rows.size:
            out[k], tension[k] = found.rotation[rows[0]], found.tension_N[rows[0]]
            choice[k] = len(chosen(robot, position_m[k], out[k], tension[k]))
    return Hanging(out, tension, tuple(others), choice)


def orientations(robot: Robot, position_m: Floats, reference: Floats) -> Floats:
    """Orientations at positions: the reference, or those in balance nearest to it where balance decides.

    Parameters
    ----------
    robot : Robot
    position_m : (p, 3) array
    reference : (3, 3) or (p, 3, 3) array

    Returns
    -------
    (p, 3, 3) array
        The reference also where the platform cannot hang.
    """
    near = np.broadcast_to(reference, (len(position_m), 3, 3))
    if not robot.is_underactuated:
        return near
    found = hang(robot, position_m, near)
    return np.where(found.held[:, None, None], found.rotation, near)


def at_home(robot: Robot) -> Robot:
    """The robot with a home orientation that is in balance, where balance decides it and there is one."""
    x, R = robot.home_m[None], turning.matrix(robot.home_rotation_rad)[None]
    if not robot.is_underactuated or np.isfinite(inverse.tensions(robot, x, R)).all():
        return robot
    found = hang(robot, x, R)
    return replace(robot, home_rotation_rad=turning.vector(found.rotation)[0]) if found.held[0] else robot


def chosen(robot: Robot, position_m: Floats, rotation: Floats, tension_N: Floats) -> Floats:
    """Ways in which the rotation vector can change at a position while the platform stays in balance.

    Parameters
    ----------
    robot : Robot
    position_m : (3,) array
    rotation : (3, 3) array
    tension_N : (w,) array
        A balance there.

    Returns
    -------
    (k, 3) array
        Orthonormal; k components of the rotation can be chosen.
    """
    _, by_turn, by_tension = equations(robot, position_m[None], rotation[None], tension_N[None])
    free = null_space(np.concatenate([by_turn, by_tension], 2)[0])
    ways = free[:3].T @ vector_by_turn(turning.vector(rotation[None]))[0].T
    return _basis(ways)


def commandable(robot: Robot, position_m: Floats, rotation: Floats, tension_N: Floats) -> tuple[Floats, int]:
    """What the wires can command about a pose in balance.

    Parameters
    ----------
    robot : Robot
    position_m : (3,) array
    rotation : (3, 3) array
    tension_N : (w,) array
        A balance there.

    Returns
    -------
    places : (k, 3) array
        Orthonormal displacements of the position; with fewer than three it cannot be chosen freely.
    degrees : int
        Of freedom that are commanded, in all.
    """
    shape = statics.geometry(robot, position_m[:, None], rotation[..., None])
    tau = tension_N[:, None]
    scale = scale_of(robot)
    K = stiffness_at_tension(robot, shape, rotation[..., None], tau)[0] * scale * scale[:, None]
    J = statics.jacobian(robot, shape)[..., 0] * (robot.lines * scale[:, None])
    free = null_space(np.concatenate([K / max(float(tension_N.max()), 1e-300), J], 1))[: robot.degrees].T
    return _basis(free[:, :3]), len(_basis(free))


def nearest_position(robot: Robot, position_m: Floats, reference: Floats) -> Floats | None:
    """The position nearest to another at which the platform hangs in balance.

    Parameters
    ----------
    robot : Robot
    position_m : (3,) array
    reference : (3, 3) array
        Orientation that is aimed at.

    Returns
    -------
    (3,) array, or None where nothing was found
    """
    found = _balance(robot, position_m[None], reference[None], reference[None], np.full(3, np.nan), movable=True)
    return found.position_m[0] if found.balanced[0] and _stable(robot, found)[0] else None


@dataclass(frozen=True)
class _Balances:
    """Where ``n`` beginnings led: poses, tensions, the distance from the target, and whether that is a balance."""

    position_m: Floats
    rotation: Floats
    tension_N: Floats
    distance_rad: Floats
    balanced: NDArray[np.bool_]


def _balance(
    robot: Robot, position_m: Floats, begin: Floats, target: Floats, asked: Floats, movable: bool = False
) -> _Balances:
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
    n, legs, low, high = len(begin), robot.legs, robot.rule.lowest_N, robot.rule.highest_N
    unit = max(robot.mass_kg * GRAVITY, low)
    x, R = np.array(position_m), np.array(begin)
    tau = _first_tensions(robot, x, R)
    bound = np.zeros((n, legs), np.int64)  # -1 and 1: held at the lowest and the highest tension
    done, dead = np.zeros(n, bool), np.zeros(n, bool)
    for _ in range(_STEPS):
        rows = np.flatnonzero(~done & ~dead)
        if not rows.size:
            break
        step, imbalance = _step(
            robot, (x[rows], R[rows], tau[rows]), (position_m[rows], target[rows]), asked, bound[rows], unit, movable
        )
        length = np.linalg.norm(step[:, 3:6], axis=1)
        step *= np.minimum(1.0, _LONGEST_RAD / np.maximum(length, 1e-300))[:, None]
        lost = ~np.isfinite(step).all(1)
        dead[rows[lost]] = True
        rows, step, imbalance = rows[~lost], step[~lost], imbalance[~lost]
        x[rows] += step[:, :3]
        R[rows] = turning.compose(step[:, 3:6].T, R[rows].transpose(1, 2, 0)).transpose(2, 0, 1)
        tau[rows] += unit * step[:, 6:]
        settled = (imbalance < _BALANCED) & (np.abs(step[:, :6]).max(1) < _SETTLED)
        nearly = np.abs(step[:, :6]).max(1) < 1e-3
        newly = _newly_bound(tau[rows], bound[rows], (low, high), unit) & nearly[:, None]
        bound[rows] += np.where(newly, np.where(tau[rows] < low, -1, 1), 0)
        done[rows] = settled & ~newly.any(1)
    left, size = largest_imbalance(robot, x, R, tau)
    slack = 1e-9 * np.maximum(np.abs(tau).max(1), unit)
    inside = (tau.min(1) >= low - slack) & (tau.max(1) <= high + slack)
    reached = np.isnan(asked) | (np.abs(turning.vector(R) - asked) < 1e-8)
    good = done & (left < 100 * _BALANCED * size) & inside & reached.all(1)
    tau = np.clip(tau, low, high)
    far = np.linalg.norm(turning.vector(R @ target.swapaxes(1, 2)), axis=1)
    return _Balances(x, R, tau, far, good)


def _step(
    robot: Robot,
    at: tuple[Floats, Floats, Floats],
    goal: tuple[Floats, Floats],
    asked: Floats,
    bound: NDArray[np.int64],
    unit: float,
    movable: bool,
) -> tuple[Floats, Floats]:
    """The smallest step from poses and tensions that solves the linearised equations and comes nearest to the goal.

    Returns
    -------
    step : (n, 6 + w) array
        Displacement, turn, and change of the tensions in `unit`.
    imbalance : (n,) array
        What the equations leave before the step, in `unit`.
    """
    x, R, tau = at
    n, legs = tau.shape
    force, by_turn, by_tension = equations(robot, x, R, tau)
    by_place = slope_by_place(robot, x, R, tau) if movable else np.zeros((n, len(force[0]), 3))
    A = np.concatenate([by_place / unit, by_turn / unit, by_tension], 2)
    value = force / unit
    extra, more = _side_conditions(robot, R, tau, asked, bound, unit)
    A, value = np.concatenate([A, extra], 1), np.concatenate([value, more], 1)
    # What the step should be if nothing had to balance, and how much each part of it weighs.
    wish = np.zeros((n, 6 + legs))
    wish[:, :3] = goal[0] - x
    wish[:, 3:6] = turning.vector(goal[1] @ R.swapaxes(1, 2))
    wish[:, 6:] = (_reference(robot) - tau) / unit
    far = np.abs(value).max(1) > 0.1
    wish[far] = 0.0
    aim = (_LESSER, 1.0) if robot.is_underactuated else (1.0, _LESSER)
    angle, pull = (_LESSER, _LESSER) if movable else aim
    weigh = np.concatenate([np.full(3, _PLACE / robot.span_m), np.full(3, angle), np.full(legs, pull)])
    if not movable:
        wish[:, :3] = 0.0
    bad = ~(np.isfinite(A).all((1, 2)) & np.isfinite(value).all(1))  # a wire without length has no direction
    B = np.where(bad[:, None, None], 0.0, A / weigh)
    step = np.where(bad[:, None], np.nan, wish * weigh)
    step = step - (np.linalg.pinv(B, rcond=DEPENDENT) @ (value + (B @ step[..., None])[..., 0])[..., None])[..., 0]
    return step / weigh, np.abs(value).max(1)


def _side_conditions(
    robot: Robot, R: Floats, tau: Floats, asked: Floats, bound: NDArray[np.int64], unit: float
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


def _newly_bound(tau: Floats, bound: NDArray[np.int64], limits: tuple[float, float], unit: float) -> NDArray[np.bool_]:
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


def _stable(robot: Robot, found: _Balances) -> NDArray[np.bool_]:
    """(n,) Whether every motion that stretches no wire raises the energy."""
    out = np.zeros(len(found.rotation), bool)
    scale = scale_of(robot)
    for k in np.flatnonzero(found.balanced):
        turn = found.rotation[k][..., None]
        shape = statics.geometry(robot, found.position_m[k][:, None], turn)
        K = stiffness_at_tension(robot, shape, turn, found.tension_N[k][:, None])[0] * scale * scale[:, None]
        pulled = found.tension_N[k] > 0
        J = statics.jacobian(robot, shape)[..., 0] * scale[:, None]
        loose = null_space(J[:, pulled].T)
        out[k] = loose.shape[1] == 0 or np.linalg.eigvalsh(loose.T @ K @ loose)[0] > 0
    return out


def _basis(rows: Floats) -> Floats:
    """Orthonormal rows that span what rows of size one or less span."""
    _, sizes, right = np.linalg.svd(rows)
    return np.asarray(right[: int((sizes > _ALIKE).sum())])


def _distinct(rotation: Floats, rows: NDArray[np.intp]) -> NDArray[np.intp]:
    """Rows whose rotations differ, the first of each kind kept."""
    kept: list[int] = []
    for row in rows:
        if all(np.abs(rotation[row] - rotation[k]).max() > _ALIKE for k in kept):
            kept.append(int(row))
    return np.array(kept, np.intp)

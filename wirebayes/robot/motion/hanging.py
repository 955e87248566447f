"""The orientation in which a platform hangs in balance at a position: what fewer wires than freedoms leave to gravity.

Of the balances nearest to a reference (`wirebayes.robot.motion.nearest_balance`) the stable ones count.
"""

from dataclasses import dataclass, replace

import numpy as np

from wirebayes.numeric.typing import Bools, Floats, Indices, Ints
from wirebayes.robot.mechanics import rotation as turning
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.plane import off
from wirebayes.robot.motion import inverse
from wirebayes.robot.motion.loose_balance import (
    equations,
    null_space,
    stiffness_at_tension,
    vector_by_turn,
)
from wirebayes.robot.motion.nearest_balance import Balances, nearest_balances

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
    choice: Ints

    @property
    def held(self) -> Bools:
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
    near = np.broadcast_to(reference, (len(position_m), 3, 3))
    asked = np.full(3, np.nan) if asked_rad is None else asked_rad
    found, good = _balances(robot, position_m, near, asked)
    out = np.full(near.shape, np.nan)
    tension = np.full((len(near), robot.legs), np.nan)
    others = []
    for k, fine in enumerate(good):
        rows = np.flatnonzero(fine) + k * len(fine)
        rows = _nearest_first(found, rows)
        if rows.size:
            out[k] = found.rotation[rows[0]]
            tension[k] = found.tension_N[rows[0]]
        other = turning.vector(found.rotation[rows[1:]])
        others.append(other.reshape(-1, 3))
    return Hanging(out, tension, tuple(others), _choices(robot, position_m, out, tension))


def _choices(robot: Robot, position_m: Floats, rotation: Floats, tension_N: Floats) -> Ints:
    """(p,) How many components of the rotation can be chosen; 0 where nothing hangs."""
    out = np.zeros(len(position_m), np.int64)
    for k in np.flatnonzero(np.isfinite(tension_N).all(1)):
        out[k] = len(chosen(robot, position_m[k], rotation[k], tension_N[k]))
    return out


def _balances(robot: Robot, position_m: Floats, near: Floats, asked: Floats) -> tuple[Balances, Bools]:
    """Balances from several beginnings at each of p positions, and which of them, ``(p, k)``, are good and stable."""
    turns = _TURNED_RAD * np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])
    begin = turning.matrix(turns)[None] @ near[:, None]
    x, target = np.repeat(position_m, len(turns), 0), np.repeat(near, len(turns), 0)
    found = nearest_balances(robot, x, begin.reshape(-1, 3, 3), target, asked)
    there = off(robot, found.position_m, found.rotation) < _ALIKE * robot.span_m
    good = found.balanced & there & _stable(robot, found)
    return found, good.reshape(len(position_m), -1)


def _nearest_first(found: Balances, rows: Indices) -> Indices:
    """Rows of different balances, by their distance from the target."""
    order = np.argsort(found.distance_rad[rows], kind="stable")
    return _distinct(found.rotation, rows[order])


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
    if not found.held[0]:
        return robot
    balance = turning.vector(found.rotation)[0]
    return replace(robot, home_rotation_rad=balance, rotation_of_file_rad=robot.home_rotation_rad)


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
    shape = statics.geometry_at(robot, position_m, rotation)
    tau = tension_N[:, None]
    scale = robot.edge_scale
    K = stiffness_at_tension(robot, shape, rotation[..., None], tau)[0] * scale * scale[:, None]
    J = statics.jacobian(robot, shape)[..., 0] * (robot.lines * scale[:, None])
    largest = max(float(tension_N.max()), 1e-300)
    free = null_space(np.concatenate([K / largest, J], 1))[: robot.degrees].T
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
    near = reference[None]
    free = np.full(3, np.nan)
    found = nearest_balances(robot, position_m[None], near, near, free, movable=True)
    if not found.balanced[0] or not _stable(robot, found)[0]:
        return None
    return found.position_m[0]


def _stable(robot: Robot, found: Balances) -> Bools:
    """(n,) Whether every motion that stretches no wire raises the energy."""
    out = np.zeros(len(found.rotation), bool)
    for k in np.flatnonzero(found.balanced):
        out[k] = _is_stable(robot, found.position_m[k], found.rotation[k], found.tension_N[k])
    return out


def _is_stable(robot: Robot, position_m: Floats, rotation: Floats, tension_N: Floats) -> bool:
    shape = statics.geometry_at(robot, position_m, rotation)
    scale = robot.edge_scale[:, None]
    K = stiffness_at_tension(robot, shape, rotation[..., None], tension_N[:, None])[0] * robot.edge_scale * scale
    J = statics.jacobian(robot, shape)[..., 0] * scale
    loose = null_space(J[:, tension_N > 0].T)
    if not loose.shape[1]:
        return True
    return bool(np.linalg.eigvalsh(loose.T @ K @ loose)[0] > 0)


def _basis(rows: Floats) -> Floats:
    """Orthonormal rows that span what rows of size one or less span."""
    _, sizes, right = np.linalg.svd(rows)
    return right[: int((sizes > _ALIKE).sum())]


def _distinct(rotation: Floats, rows: Indices) -> Indices:
    """Rows whose rotations differ, the first of each kind kept."""
    kept: list[int] = []
    for row in rows:
        if all(np.abs(rotation[row] - rotation[k]).max() > _ALIKE for k in kept):
            kept.append(int(row))
    return np.array(kept, np.intp)

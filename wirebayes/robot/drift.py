"""Drift: what becomes of a pose while the wires creep under their own, changing tension."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from wirebayes.robot import forward, inverse
from wirebayes.robot.creep import CreepState, Follow, HoldCreep, fresh
from wirebayes.robot.description import Robot
from wirebayes.robot.wires import Wires

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Course:
    """Poses of ``n`` draws at ``t`` times of one hold.

    Attributes
    ----------
    times_s : (t,) array
    position_m : (n, t, 3) array
    rotation : (n, t, 3, 3) array
    tension_N : (n, t, w) array
    status : (n, t) int array
        As in `forward.Equilibria`.
    end : CreepState
        What the wires carry out of the last time.
    """

    times_s: Floats
    position_m: Floats
    rotation: Floats
    tension_N: Floats
    status: NDArray[np.int64]
    end: CreepState

    @property
    def found(self) -> NDArray[np.bool_]:
        """(n,) True where every time has a stable equilibrium."""
        return np.asarray((self.status == forward.FOUND).all(1))


def hold(
    robot: Robot,
    wires: Wires,
    joint_m: Floats | Callable[[float], Floats],
    times_s: Floats,
    start_m: Floats,
    start_rotation: Floats,
    carried: CreepState | None = None,
    follow: Follow = "current",
    longest_step: float = 0.35,
) -> Course:
    """Hold the actuators still, or let them follow a slow schedule, while the wires creep.

    Parameters
    ----------
    robot : Robot
    wires : Wires
        ``n`` draws.
    joint_m : (n, w) or (w,) array, or function of time returning one
        Joint values; a drum's is the zero-tension length before creep. A schedule's corrections are taken to be too
        small and slow to restart the wires' clocks.
    times_s : (t,) array
        Rising times since the command; the wires' clocks start with it.
    start_m, start_rotation : (3,) or (n, 3); (3, 3) or (n, 3, 3) arrays
        Where the first forward solution starts from.
    carried : CreepState, optional
        Creep from earlier holds; default: wires never loaded.
    follow : {"current", "start"}
        Whether the creep still to come follows the tension or is fixed when the hold begins.
    longest_step : float
        Longest step in the logarithm of time between tension updates; the first is a thousandth of the last time.

    Returns
    -------
    Course
    """
    n = max(v.shape[-1] for v in wires.theta.values())
    times = np.asarray(times_s, float)
    state = carried or fresh(robot.legs, n)

    def settle(time: float, x: Floats, R: Floats) -> forward.Equilibria:
        joint = joint_m(time) if callable(joint_m) else joint_m
        bare, offset = inverse.lengths(robot, np.broadcast_to(joint, (n, robot.legs)))
        return forward.solve(robot, wires, bare * (1.0 + state.strain(wires).T), offset, x, R)

    here = settle(0.0, start_m, start_rotation)
    creep = HoldCreep(wires, state, here.tension_N.T, follow)
    position, rotation = np.empty((n, len(times), 3)), np.empty((n, len(times), 3, 3))
    tension, status = np.empty((n, len(times), robot.legs)), np.empty((n, len(times)), np.int64)
    now = 0.0
    for k, time in enumerate(times):
        for step in steps_between(now, float(time), float(times[-1]), longest_step):
            state = creep.advance(step, here.tension_N.T)
            here = settle(step, here.position_m, here.rotation)
        now = float(time)
        position[:, k], rotation[:, k] = here.position_m, here.rotation
        tension[:, k], status[:, k] = here.tension_N, here.status
    return Course(times, position, rotation, tension, status, state)


def steps_between(start: float, stop: float, last: float, longest: float) -> Floats:
    """Times after `start` up to `stop`, geometrically spaced no wider than `longest`."""
    if stop <= start:
        return np.empty(0)
    first = max(start, 1e-3 * last)
    if stop <= first:
        return np.array([stop])
    steps = int(np.ceil(np.log(stop / first) / longest))
    points = first * (stop / first) ** (np.arange(1, steps + 1) / steps)
    points[-1] = stop
    return np.concatenate([[first], points]) if start < first else points


def from_command(
    robot: Robot, wires: Wires, position_m: Floats, rotation: Floats, times_s: Floats, follow: Follow = "current"
) -> Course:
    """Drift from a pose that every draw takes exactly when the hold begins (its own inverse kinematics).

    Parameters
    ----------
    robot : Robot
    wires : Wires
    position_m : (3,) array
    rotation : (3, 3) array
    times_s : (t,) array

    Returns
    -------
    Course
        NaN poses when no tensions hold the pose.
    """
    tau = inverse.tensions(robot, position_m[None], rotation[None])
    told = inverse.commands(robot, wires, position_m[None], rotation[None], tau)
    return hold(robot, wires, told.joint_m, times_s, position_m, rotation, follow=follow)


def moved(course: Course, origin_m: Floats, origin_rotation: Floats) -> tuple[Floats, Floats]:
    """Displacement ``(n, t, 3)``, m, and rotation angle ``(n, t)``, rad, from an origin (of all draws or of each)."""
    x0 = np.broadcast_to(origin_m, (len(course.position_m), 3))[:, None]
    R0 = np.broadcast_to(origin_rotation, (len(course.position_m), 3, 3))[:, None]
    turn = course.rotation @ np.swapaxes(R0, -1, -2)
    # The antisymmetric part keeps small angles exact where the trace would lose half the digits.
    axis = 0.5 * np.stack(
        [turn[..., 2, 1] - turn[..., 1, 2], turn[..., 0, 2] - turn[..., 2, 0], turn[..., 1, 0] - turn[..., 0, 1]], -1
    )
    cosine = 0.5 * (np.trace(turn, axis1=-2, axis2=-1) - 1.0)
    return course.position_m - x0, np.arctan2(np.linalg.norm(axis, axis=-1), cosine)


def without_creep(wires: Wires) -> Wires:
    """The same wires under Hooke's law alone."""
    theta = dict(wires.theta) | {"B": np.zeros_like(wires.theta["B"])}
    kept = tuple(e for e in wires.effects if e.place == "strain")
    return replace(wires, theta=theta, effects=kept)

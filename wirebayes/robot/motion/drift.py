"""Drift: what becomes of a pose while the wires creep under their own, changing tension."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from wirebayes.numeric.rows import chosen_rows
from wirebayes.numeric.typing import Bools, Floats, Ints
from wirebayes.progress import ShareDone, unseen
from wirebayes.robot.mechanics import rotation as turning
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.rotation import antisymmetric
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion import inverse, one_sided, outcome
from wirebayes.robot.motion.course import Course
from wirebayes.robot.motion.creep import CreepState, Follow
from wirebayes.robot.motion.creeping_hold import TOLERANCE, CreepingHold
from wirebayes.robot.motion.path import Slip


def hold(
    robot: Robot,
    wires: Wires,
    joint_m: Floats | Callable[[float], Floats],
    times_s: Floats,
    start_m: Floats,
    start_rotation: Floats,
    carried: CreepState | None = None,
    follow: Follow = "current",
    tolerance: float = TOLERANCE,
    progress: ShareDone = unseen,
    slip: Slip | None = None,
) -> Course:
    """Hold the actuators still, or let them follow a slow schedule, while the wires creep.

    The equilibrium is followed through time. Steps are as long as their error allows, so that no time's answer depends
    on later ones; draws whose platform falls have no pose from then on.

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
    tolerance : float
        Error allowed in a step, of the creep so far. A tenth of the draws may err ten times as much where a wire goes
        slack, which each does but once.
    progress : function of a share between 0 and 1
    slip : pair of floats, optional
        As in `path.follow`.

    Returns
    -------
    Course
    """
    times = np.asarray(times_s, float)
    walk = CreepingHold(robot, wires, joint_m, (start_m, start_rotation), carried, follow, tolerance, slip=slip)
    rows = _Rows.empty(walk.n, len(times), robot.legs)
    for k, time in enumerate(times):
        walk.to(float(time))
        rows.put(k, walk)
        progress((k + 1) / len(times))
    rows.rest_at(start_m, start_rotation, robot.span_m)
    carried_on, falls = walk.creep.state(), walk.falls()
    return Course(times, rows.position_m, rows.rotation, rows.tension_N, rows.status, carried_on, falls)


@dataclass(frozen=True)
class _Rows:
    """Poses of ``n`` draws at ``t`` times, ``(n, t, ...)``; NaN of draws that have fallen."""

    position_m: Floats
    rotation: Floats
    tension_N: Floats
    status: Ints

    @classmethod
    def empty(cls, draws: int, times: int, legs: int) -> "_Rows":
        rows = draws, times
        return cls(np.empty((*rows, 3)), np.empty((*rows, 3, 3)), np.empty((*rows, legs)), np.empty(rows, np.int64))

    def put(self, k: int, walk: CreepingHold) -> None:
        """Write down where a hold is at the k-th time."""
        here, live = walk.here, walk.live
        self.position_m[:, k] = chosen_rows(live, here.position_m, np.nan)
        self.rotation[:, k] = chosen_rows(live, here.rotation, np.nan)
        self.tension_N[:, k] = chosen_rows(live, here.tension_N, np.nan)
        self.status[:, k] = here.status

    def rest_at(self, start_m: Floats, start_rotation: Floats, span_m: float) -> None:
        """Take poses that differ from the start by nothing but rounding for the start: wires that do not creep."""
        draws = len(self.position_m)
        start = np.broadcast_to(start_m, (draws, 3))[:, None]
        turned = np.broadcast_to(start_rotation, (draws, 3, 3))[:, None]
        shift_m, angle = shift_and_turn(self.position_m, self.rotation, start, turned)
        draw, time = np.nonzero(are_rounding(shift_m, angle, span_m))
        self.position_m[draw, time] = start[draw, 0]
        self.rotation[draw, time] = turned[draw, 0]


def are_rounding(shift_m: Floats, angle_rad: Floats, span_m: float) -> Bools:
    """Whether displacements (..., 3) and turns (...) are so small that they are rounding of equilibria, and no drift.

    Parameters
    ----------
    shift_m : (..., 3) array
    angle_rad : (...) array
    span_m : float
        The extent of the robot.
    """
    return (np.linalg.norm(shift_m, axis=-1) < ROUNDING * span_m) & (angle_rad < ROUNDING)


ROUNDING = 1e-11  # of the robot's extent, and rad: more than equilibria are rounded by, a millionth of any real drift


def from_command(
    robot: Robot,
    wires: Wires,
    position_m: Floats,
    rotation: Floats,
    times_s: Floats,
    follow: Follow = "current",
    progress: ShareDone = unseen,
    slip: Slip | None = None,
) -> Course:
    """Drift from a pose that every draw takes exactly when the hold begins (its own inverse kinematics).

    Parameters
    ----------
    robot : Robot
    wires : Wires
    position_m : (3,) array
    rotation : (3, 3) array
    times_s : (t,) array
    follow : {"current", "start"}
        As for `hold`.
    progress : function of a share between 0 and 1
    slip : pair of floats, optional
        As in `path.follow`.

    Returns
    -------
    Course
        NaN poses when no tensions hold the pose, or not stably (status `outcome.NOT_HELD`).
    """
    commands = inverse.commands_at(robot, wires, position_m, rotation)
    stable = stably(robot, wires, commands, position_m, commands.rotation)
    joint = np.where(stable[:, None], commands.joint_m, np.nan)
    start = position_m, commands.rotation
    course = hold(robot, wires, joint, times_s, *start, follow=follow, progress=progress, slip=slip)
    course.status[commands.feasible & ~stable] = outcome.NOT_HELD
    return course


def stably(robot: Robot, wires: Wires, commands: inverse.Commands, position_m: Floats, rotation: Floats) -> Bools:
    """Whether commands hold their own poses stably: not every balance is stable.

    Parameters
    ----------
    robot : Robot
    wires : Wires
    commands : Commands
        What `inverse.commands` returned for the poses.
    position_m : (3,) or (n, 3) array
    rotation : (3, 3) or (n, 3, 3) array

    Returns
    -------
    (n,) bool array
    """
    n = len(commands.zero_m)
    pose = np.broadcast_to(position_m, (n, 3)), np.broadcast_to(rotation, (n, 3, 3))
    zero = chosen_rows(commands.feasible, commands.zero_m, 1.0)
    stiffness = one_sided.lowest_stiffness(robot, wires, pose, (zero, commands.offset_m))
    return commands.feasible & (stiffness > 0)


def distance_moved(course: Course, origin_m: Floats, origin_rotation: Floats) -> tuple[Floats, Floats]:
    """How far the poses of a course are from an origin.

    Parameters
    ----------
    course : Course
        n draws at t times.
    origin_m : (3,) or (n, 3) array
    origin_rotation : (3, 3) or (n, 3, 3) array
        One for all draws, or one of each.

    Returns
    -------
    displacement : (n, t, 3) array
        m.
    angle : (n, t) array
        Of the rotation, rad.
    """
    draws = len(course.position_m)
    origin = np.broadcast_to(origin_m, (draws, 3))[:, None]
    origin_turn = np.broadcast_to(origin_rotation, (draws, 3, 3))[:, None]
    return shift_and_turn(course.position_m, course.rotation, origin, origin_turn)


def shift_and_turn(
    position_m: Floats, rotation: Floats, origin_m: Floats, origin_rotation: Floats
) -> tuple[Floats, Floats]:
    """How far poses are from an origin: displacements ``(..., 3)``, m, and angles ``(...)`` of the rotations, rad.

    Parameters
    ----------
    position_m, origin_m : (..., 3) arrays
    rotation, origin_rotation : (..., 3, 3) arrays
    """
    turn = rotation @ origin_rotation.mT
    # The antisymmetric part keeps small angles exact where the trace would lose half the digits.
    sine = np.linalg.norm(antisymmetric(turn), axis=-1)
    cosine = 0.5 * (np.trace(turn, axis1=-2, axis2=-1) - 1.0)
    return position_m - origin_m, turning.without_rounding(np.arctan2(sine, cosine))

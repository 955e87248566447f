"""Control under creep: commands that compensate for it, the remaining error, and how long a calibration lasts."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from wirebayes.numeric.typing import Bools, Floats
from wirebayes.progress import ShareDone, unseen
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion import drift, inverse, outcome
from wirebayes.robot.motion.creep import CreepState, HoldCreep, fresh, without_creep
from wirebayes.robot.motion.creeping_hold import CreepingHold
from wirebayes.robot.motion.path import Slip

Schedule = Callable[[float], Floats]
_SLIP = 0.1  # of the tolerance: a jump no longer hardly uses it up
# of the tolerance: less creep decides nothing, and where it makes slack wires begin to pull, steps would be tiny
_UNSEEN = 0.1
PROBABILITY = 0.95  # with which a pose is to be within tolerance


def known(wires: Wires) -> Wires:
    """One wire without creep, the mean of every other parameter: what statics uses for uncertain wires."""
    plain = without_creep(wires)
    return replace(plain, theta={k: v.mean(axis=-1, keepdims=True) for k, v in plain.theta.items()})


def hooke_only(robot: Robot, model: Wires, position_m: Floats, rotation: Floats) -> Schedule:
    """Commands of a controller that knows the mean stiffness and nothing of creep.

    Parameters
    ----------
    robot : Robot
    model : Wires
        Draws of the wires that the controller knows; it uses their mean stiffness.
    position_m : (3,) array
    rotation : (3, 3) array
        The pose that is to be held.

    Returns
    -------
    callable
        Of a time, s, to the joint values (1, w): here the same at all times.
    """
    joint = inverse.commands_at(robot, known(model), position_m, rotation).joint_m
    return lambda time_s: joint


def creep_aware(robot: Robot, model: Wires, position_m: Floats, rotation: Floats) -> Schedule:
    """Commands that compensate, at every time, for the creep expected under the tensions required there.

    The expectation is over the draws of `model`: parameters of creep are too entangled for their means to mean a wire.

    Parameters
    ----------
    robot : Robot
    model : Wires
        Draws of the wires that the controller knows.
    position_m : (3,) array
    rotation : (3, 3) array
        The pose that is to be held.

    Returns
    -------
    callable
        Of a time, s, to the joint values (1, w).
    """
    tau = inverse.tensions(robot, position_m[None], rotation[None])
    ahead = HoldCreep(model, fresh(robot.legs, model.count), np.repeat(tau.T, model.count, 1), "start")
    plain = known(model)

    def joint(time_s: float) -> Floats:
        strain = ahead.advance(time_s, tau.T).strain(model).mean(1, keepdims=True)
        return inverse.commands(robot, plain, position_m[None], rotation[None], tau, strain).joint_m

    return joint


def largest_slip(tolerance_m: float, tolerance_rad: float) -> Slip:
    """The largest jump that is no fall of a platform that may be off by tolerances.

    Parameters
    ----------
    tolerance_m, tolerance_rad : float
    """
    return _SLIP * tolerance_m, _SLIP * tolerance_rad


@dataclass(frozen=True)
class PoseError:
    """How far the platform is from its commanded pose.

    Attributes
    ----------
    times_s : (t,) array
    distance_m : (n, t) array
    angle_rad : (n, t) array
    held : (n, t) bool array
        Whether there is an equilibrium: not before the first, and not from a fall on.
    """

    times_s: Floats
    distance_m: Floats
    angle_rad: Floats
    held: Bools

    @property
    def found(self) -> Bools:
        """(n,) True where every time has an equilibrium."""
        return np.asarray(self.held.all(1))

    def probability(self, tolerance_m: float, tolerance_rad: float = np.inf) -> Floats:
        """(t,) share of draws within both tolerances; a draw without equilibrium at a time is not within then."""
        inside = (self.distance_m < tolerance_m) & (self.angle_rad < tolerance_rad) & self.held
        return inside.mean(0)


def error(
    robot: Robot,
    wires: Wires,
    schedule: Schedule,
    position_m: Floats,
    rotation: Floats,
    times_s: Floats,
    carried: CreepState | None = None,
    progress: ShareDone = unseen,
    slip: Slip | None = None,
) -> PoseError:
    """Pose error over time of uncertain wires under one controller's commands.

    Parameters
    ----------
    robot : Robot
    wires : Wires
        ``n`` draws: what the wires may really be.
    schedule : function
        From `hooke_only` or `creep_aware`.
    position_m, rotation : (3,), (3, 3) arrays
        The requested pose.
    times_s : (t,) array
    carried : CreepState, optional
        Creep that the wires bring along; default: they were never loaded.
    progress : function of a share between 0 and 1
    slip : pair of floats, optional
        As in `path.follow`.
    """
    at = position_m, rotation
    course = drift.hold(robot, wires, schedule, times_s, *at, carried, progress=progress, slip=slip)
    shift, angle = drift.distance_moved(course, position_m, rotation)
    return PoseError(course.times_s, np.linalg.norm(shift, axis=-1), angle, course.status == outcome.FOUND)


def longest_interval(
    errors: PoseError, tolerance_m: float, tolerance_rad: float = np.inf, probability: float = PROBABILITY
) -> float:
    """Longest time up to which the pose is within tolerance with a probability, at every time before, s.

    Zero when not even the first time is; infinite when the last time still is.

    Parameters
    ----------
    errors : PoseError
        At rising times.
    tolerance_m : float
    tolerance_rad : float
        Infinite where only the position counts.
    probability : float

    Returns
    -------
    float
        One of the times of `errors`, zero or infinity.
    """
    good = errors.probability(tolerance_m, tolerance_rad) >= probability
    if good.all():
        return float("inf")
    first = int(np.argmin(good))
    return float(errors.times_s[first - 1]) if first else 0.0


@dataclass(frozen=True)
class Limits:
    """A pose, and how far from it a platform may be.

    Attributes
    ----------
    position_m, rotation : (3,), (3, 3) arrays
    distance_m, angle_rad : float
    """

    position_m: Floats
    rotation: Floats
    distance_m: float
    angle_rad: float = np.inf

    def keeps(self, walk: CreepingHold) -> Bools:
        """(n,) Which draws of a hold are within them now.

        Parameters
        ----------
        walk : CreepingHold
        """
        shift, angle = drift.shift_and_turn(walk.here.position_m, walk.here.rotation, self.position_m, self.rotation)
        near = np.linalg.norm(shift, axis=-1) < self.distance_m
        return walk.live & near & (angle < self.angle_rad)


@dataclass(frozen=True)
class Lasting:
    """How long a pose stays within limits with `PROBABILITY`.

    Attributes
    ----------
    longest_s : float
        The last time before one at which it is not: one of those looked at, or zero; infinite where there is none.
    held : float
        Share of draws that have not lost their equilibrium by the last time that was looked at.
    """

    longest_s: float
    held: float


def lasting_within(
    robot: Robot,
    wires: Wires,
    schedule: Schedule,
    limits: Limits,
    times_s: Floats,
    carried: CreepState,
    progress: ShareDone = unseen,
) -> Lasting:
    """How long a pose stays within limits, followed no longer than until it does not.

    Parameters
    ----------
    robot : Robot
    wires : Wires
        ``n`` draws.
    schedule : function
        Of a time, s, to the joint values ``(1, w)`` or ``(n, w)``.
    limits : Limits
    times_s : (t,) array
        Rising times at which it is looked at.
    carried : CreepState
        Creep that the wires bring along.
    progress : function of a share between 0 and 1
    """
    start = limits.position_m, limits.rotation
    slip = largest_slip(limits.distance_m, limits.angle_rad)
    least_mm = 1e3 * _UNSEEN * min(limits.distance_m, limits.angle_rad * robot.size_m)
    walk = CreepingHold(robot, wires, schedule, start, carried, needed=PROBABILITY, slip=slip, least_mm=least_mm)
    longest = 0.0
    for k, time in enumerate(times_s):
        walk.to(float(time))
        if limits.keeps(walk).mean() < PROBABILITY:
            progress(1.0)
            return Lasting(longest, float(walk.live.mean()))
        longest = float(time)
        progress((k + 1) / len(times_s))
    return Lasting(np.inf, float(walk.live.mean()))


def calibrated_schedules(
    robot: Robot, wires: Wires, carried: CreepState, position_m: Floats, rotation: Floats
) -> tuple[Schedule, Schedule]:
    """Commands from a perfect calibration on, after a load history.

    Parameters
    ----------
    robot : Robot
    wires : Wires
        ``n`` draws.
    carried : CreepState
        What the load history left in the wires; the command at the calibration restarts their clocks.
    position_m : (3,) array
    rotation : (3, 3) array

    Returns
    -------
    still, foreseen : functions of a time, s, to the joint values (n, w)
        `foreseen` compensates for the mean creep of the draws, given the same history.
    """
    at = position_m[None], rotation[None]
    tau = inverse.tensions(robot, *at)
    load = np.repeat(tau.T, wires.count, 1)
    before = carried.strain(wires)

    def joint_of(strain: Floats) -> Floats:
        return inverse.commands(robot, wires, *at, tau, strain).joint_m

    joint = joint_of(before)
    ahead = HoldCreep(wires, carried, load, "start")

    def expected(time_s: float) -> Floats:
        # every robot starts exact; what is foreseen is the mean growth since then
        strain = ahead.advance(time_s, load).strain(wires)
        growth = (strain - before).mean(1, keepdims=True)
        return joint_of(before + growth)

    return lambda time_s: joint, expected

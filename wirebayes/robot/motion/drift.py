"""Drift: what becomes of a pose while the wires creep under their own, changing tension."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from wirebayes.numeric.typing import Bools, Floats
from wirebayes.robot.mechanics.description import Poses, Robot
from wirebayes.robot.mechanics.rotation import antisymmetric
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion import forward, inverse, one_sided, outcome, path
from wirebayes.robot.motion.course import Course, Falls
from wirebayes.robot.motion.creep import CreepState, Follow, HoldCreep, fresh

_TOLERANCE = 2e-4  # of the creep so far, a step: the drift is then right to .2 % even where wires go slack
_FIRST = 0.02  # first step tried, in creep's own clock k2 t^N
# of the way so far: so short a step is taken whatever its error, which a shorter one would not make smaller
_LEAST_STEP = 1e-4
# of the way so far: the longest step in which a platform may fall. Where within it is told by a straight line, while
# creep runs away as the square root of the time that is left: a twentieth of the step is then a thousandth of the time.
_FALL_STEP = 0.02
# of a longer step: the smallest part that a search for a fall tries there. A shorter step is taken next in any case, so
# that it is enough to know that something happens; where exactly, the last and short one tells.
_GLANCE = 2.0**-4
_RESOLVED = 1e-6  # of all creep that tension leads to: what grows less is rounding in tensions, not a drift
_POWERS = 0.1, 3.0  # of time, between which steps are laid; draws of an estimate may have any N


def hold(
    robot: Robot,
    wires: Wires,
    joint_m: Floats | Callable[[float], Floats],
    times_s: Floats,
    start_m: Floats,
    start_rotation: Floats,
    carried: CreepState | None = None,
    follow: Follow = "current",
    tolerance: float = _TOLERANCE,
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

    Returns
    -------
    Course
    """
    times = np.asarray(times_s, float)
    walk = CreepingHold(robot, wires, joint_m, (start_m, start_rotation), carried, follow, tolerance)
    rows = walk.n, len(times)
    position = np.empty((*rows, 3))
    rotation = np.empty((*rows, 3, 3))
    tension = np.empty((*rows, robot.legs))
    status = np.empty(rows, np.int64)
    for k, time in enumerate(times):
        walk.to(float(time))
        here = walk.here
        position[:, k] = here.position_m
        rotation[:, k] = here.rotation
        tension[:, k] = here.tension_N
        status[:, k] = here.status
        for values in (position, rotation, tension):
            values[~walk.live, k] = np.nan
    return Course(times, position, rotation, tension, status, walk.creep.state(), walk.falls())


class CreepingHold:
    """One hold on its way: creep's state, the pose of every draw, and which draws still have one.

    Parameters
    ----------
    robot, wires, joint_m, carried, follow, tolerance
        As in `hold`.
    start : (3,) or (n, 3), (3, 3) or (n, 3, 3) arrays
        Where the first forward solution starts from.
    error_m : (n, w) array or float
        What the zero-tension lengths before creep are beyond what the joint values say.

    Attributes
    ----------
    here : Equilibria
        The poses now.
    live : (n,) bool array
        Draws whose platform has not fallen.
    creep : HoldCreep
    """

    def __init__(
        self,
        robot: Robot,
        wires: Wires,
        joint_m: Floats | Callable[[float], Floats],
        start: Poses,
        carried: CreepState | None = None,
        follow: Follow = "current",
        tolerance: float = _TOLERANCE,
        error_m: Floats | float = 0.0,
    ) -> None:
        self.robot, self.wires, self.joint, self.tolerance = robot, wires, joint_m, tolerance
        self.error_m = error_m
        self.n = wires.count
        state = carried or fresh(robot.legs, self.n)
        self.lengths = self._lengths(0.0, state)
        self.here = forward.solve_equilibrium(robot, wires, *self.lengths, *start)
        self.live = self.here.found
        self.creep = HoldCreep(wires, state, self.here.tension_N.T, follow)
        # steps are laid in t^power, in which creep starts straight
        self.power = float(np.clip(np.median(wires.theta["N"]), *_POWERS))
        fastest = np.max(self.creep.k2, initial=1e-300, where=np.isfinite(self.creep.k2))
        self.step = self.first = _FIRST / float(fastest)
        self.slope: Floats | None = None  # of the amount by creep's clock, and the length of the step it comes from
        self.before: Floats = np.zeros(1)
        self.fall_s, self.drop_m = np.full(self.n, np.inf), np.zeros(self.n)
        self.first_N = self.here.tension_N.copy()
        self.lowest_N = self.first_N.copy()
        self.slack_s = np.where(self.first_N > 0, np.inf, 0.0)
        self.stiff = self._stiffness()
        self.left = np.full(self.n, np.nan)  # of the stiffness, at the last pose before a fall

    def _lengths(self, time_s: float, state: CreepState) -> tuple[Floats, Floats]:
        joint = self.joint(time_s) if callable(self.joint) else self.joint
        bare, offset = inverse.lengths(self.robot, np.broadcast_to(joint, (self.n, self.robot.legs)))
        bare = bare + self.error_m
        return bare * (1.0 + state.strain(self.wires).T), np.broadcast_to(offset, bare.shape)

    def to(self, stop_s: float) -> None:
        """Go on to a time, by steps of bounded error."""
        while self.creep.time_s < stop_s:
            clock, end = self.creep.time_s**self.power, stop_s**self.power
            whole = clock + self.step >= end * (1 - 1e-12) or not self.live.any()
            time = stop_s if whole else (clock + self.step) ** (1 / self.power)
            length = end - clock if whole else self.step
            least = length <= _LEAST_STEP * (clock + self.first)
            error = self._try(time, least)
            factor = min(max(0.8 * (self.tolerance / max(error, 1e-300)) ** (1 / 3), 0.2), 3.0)
            if least and error > self.tolerance:  # shorter steps do not help
                self.step = 3.0 * length
            elif error > self.tolerance or not whole or factor < 1:
                self.step = factor * length
            else:  # cut short by the requested time: no reason to go on so cautiously
                self.step = max(self.step, factor * length)

    def load(self, robot: Robot) -> None:
        """Go on with another mass on the platform; the wires' clocks run on."""
        self.robot = robot
        zero = np.where(self.live[:, None], self.lengths[0], np.nan)
        self.here = forward.solve_equilibrium(
            robot, self.wires, zero, self.lengths[1], self.here.position_m, self.here.rotation
        )
        fell = self.live & ~self.here.found
        self.fall_s[fell], self.live = self.creep.time_s, self.live & ~fell
        creep, self.slope = self.creep, None
        creep.amount = np.where(self.live, creep.amount_at(self.here.tension_N.T), creep.amount)

    def _try(self, time: float, least: bool) -> float:
        """One step by prediction and correction; taken unless its error, which is returned, is too large.

        Parameters
        ----------
        time : float
            Where it leads.
        least : bool
            It is taken in any case.
        """
        now = self.creep.time_s
        done = np.maximum(self.creep.progress(time), 1e-300)
        guess = self.creep.toward(time, np.zeros(1) if self.slope is None else self.slope)
        long = not least and 1.0 - (now / time) ** self.power > _FALL_STEP
        there = self._follow(guess, time, _GLANCE if long else path.SMALLEST)
        last, off = self._corrected(guess, there.here, time, done)
        worst = self._worst(off, last, self.live & there.here.found)
        if worst > self.tolerance and not least:
            return worst
        here = self._settle(last, time, there.here)
        fell = self.live & ~(there.here.found & here.found)
        if fell.any() and long:
            return np.inf
        self._note(fell, there, here, (now, time))
        if self.creep.follow == "current":
            last.amount = np.where(self.live, self.creep.amount_at(here.tension_N.T), self.creep.amount)
            self.slope, self.before = (last.amount - self.creep.amount) / done, done
        self.creep, self.here = last, here
        self.lengths = self._lengths(time, last.state())
        return worst

    def _corrected(
        self, guess: HoldCreep, there: forward.Equilibria, time: float, done: Floats
    ) -> tuple[HoldCreep, Floats]:
        """The creep at the end of a step by the tensions there, and by how much it may be off, (w, n) mm or less."""
        first = self._toward(time, there)
        if self.slope is None:
            # Nothing to extrapolate from yet: correct twice, the change says how good the first correction was.
            last = self._toward(time, self._settle(first, time, there))
            return last, np.abs(last.grown - first.grown)
        # Errors of prediction and correction are in a known ratio; the part of the corrected is taken off.
        share = 1.0 / (3.0 * (1.0 + self.before / done))
        change = first.grown - guess.grown
        first.grown = first.grown - change * share
        return first, np.abs(change) * share

    def _toward(self, time: float, there: forward.Equilibria) -> HoldCreep:
        """The creep at a time by the amounts that belong to the tensions there."""
        return self.creep.toward(time, np.zeros(1), self.creep.amount_at(there.tension_N.T))

    def _worst(self, off: Floats, last: HoldCreep, alive: Bools) -> float:
        """The error of a step, relative to what creeps in it: that of nearly all draws, a tenth of the largest."""
        least = _RESOLVED * np.abs(self.creep.carried.creep_mm + self.creep.amount)
        size = self._of_worst_wire(np.maximum(np.abs(last.grown), least))
        error = (self._of_worst_wire(off) / np.maximum(size, 1e-300))[alive]
        return float(max(np.quantile(error, 0.9), 0.1 * error.max())) if error.size else 0.0

    def _of_worst_wire(self, values: Floats) -> Floats:
        """(n,) the largest of (w, n) values, or of what spreads to these."""
        return np.asarray(np.broadcast_to(values, (self.robot.legs, self.n)).max(0))

    def _follow(self, creep: HoldCreep, time_s: float, smallest: float) -> path.Followed:
        rows = np.flatnonzero(self.live)
        new = self._lengths(time_s, creep.state())
        part = [(a[rows], b[rows]) for a, b in (self.lengths, new, (self.here.position_m, self.here.rotation))]
        found = path.follow(self.robot, self.wires.part(rows), part[2], part[0], part[1], smallest)
        if len(rows) == self.n:
            return found
        whole = path.Followed(forward.put_back(found.here, rows, self.n), np.ones(self.n), np.zeros(self.n))
        whole.share[rows], whole.drop_m[rows] = found.share, found.drop_m
        return whole

    def _settle(self, creep: HoldCreep, time_s: float, near: forward.Equilibria) -> forward.Equilibria:
        """The pose at corrected lengths, hardly away from one that was followed."""
        zero, offset = self._lengths(time_s, creep.state())
        zero = np.where(near.found[:, None], zero, np.nan)
        return path.settle(self.robot, self.wires, (near.position_m, near.rotation), (zero, offset))

    def _note(self, fell: Bools, there: path.Followed, here: forward.Equilibria, span_s: tuple[float, float]) -> None:
        """Write down falls and slack wires of a step."""
        last = there.here
        self._note_falls(fell, there, span_s)
        tau = np.where(fell[:, None], last.tension_N, here.tension_N)
        self._note_slack(fell[:, None], tau, span_s[1])
        moving = self.live[:, None] & np.isfinite(tau)
        self.lowest_N = np.where(moving, np.minimum(self.lowest_N, tau), self.lowest_N)
        if fell.any():
            stiffness = self._stiffness((last.position_m, last.rotation))
            self.left = np.where(fell, stiffness, self.left)
        self.live = self.live & ~fell
        here.status[fell] = np.where(last.found, outcome.FELL, last.status)[fell]
        lost = ~self.live & ~fell
        here.status[lost] = self.here.status[lost]

    def _note_falls(self, fell: Bools, there: path.Followed, span_s: tuple[float, float]) -> None:
        """When platforms fell, and how far."""
        begin, end = (t**self.power for t in span_s)
        share = np.where(there.share < 1, there.share, 1.0)
        time_s = (begin + share * (end - begin)) ** (1 / self.power)
        drop_m = np.where(there.drop_m > 0, there.drop_m, np.inf)
        self.fall_s[fell] = time_s[fell]
        self.drop_m[fell] = drop_m[fell]

    def _note_slack(self, fell: Bools, tau: Floats, now_s: float) -> None:
        """When wires go slack, of which these are the tensions (n, w); `fell` (n, 1) are those whose platform fell."""
        goes_slack = self.live[:, None] & np.isfinite(tau) & (tau <= 0) & (self.here.tension_N > 0)
        newly = goes_slack & np.isinf(self.slack_s) & ~fell
        self.slack_s = np.where(newly, now_s, self.slack_s)
        # A wire that has all but lost its tension when the platform falls is the one that goes slack.
        slackens = fell & np.isinf(self.slack_s) & (tau < 1e-3 * self.first_N)
        self.slack_s = np.where(slackens, self.fall_s[:, None], self.slack_s)

    def _stiffness(self, pose: Poses | None = None) -> Floats:
        pose = pose or (self.here.position_m, self.here.rotation)
        return one_sided.lowest_stiffness(self.robot, self.wires, pose, self.lengths)

    def falls(self) -> Falls:
        """What was written down on the way."""
        with np.errstate(invalid="ignore", divide="ignore"):
            share = np.where(self.first_N > 0, self.lowest_N / self.first_N, np.nan)
            stiff = np.where(self.live, self._stiffness(), self.left) / self.stiff
        lowest = np.argmin(np.where(np.isfinite(share), share, np.inf), axis=1)
        wire = np.where(np.isfinite(self.fall_s), lowest, -1)
        return Falls(self.fall_s, wire, self.drop_m, self.slack_s, share, stiff)


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
        NaN poses when no tensions hold the pose, or not stably (status `outcome.NOT_HELD`).
    """
    commands = inverse.commands_at(robot, wires, position_m, rotation)
    stable = stably(robot, wires, commands, position_m, commands.rotation)
    joint = np.where(stable[:, None], commands.joint_m, np.nan)
    course = hold(robot, wires, joint, times_s, position_m, commands.rotation, follow=follow)
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
    zero = np.where(commands.feasible[:, None], commands.zero_m, 1.0)
    return commands.feasible & (one_sided.lowest_stiffness(robot, wires, pose, (zero, commands.offset_m)) > 0)


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
    x0 = np.broadcast_to(origin_m, (len(course.position_m), 3))[:, None]
    R0 = np.broadcast_to(origin_rotation, (len(course.position_m), 3, 3))[:, None]
    turn = course.rotation @ np.swapaxes(R0, -1, -2)
    # The antisymmetric part keeps small angles exact where the trace would lose half the digits.
    sine = np.linalg.norm(antisymmetric(turn), axis=-1)
    cosine = 0.5 * (np.trace(turn, axis1=-2, axis2=-1) - 1.0)
    return course.position_m - x0, np.arctan2(sine, cosine)


def without_creep(wires: Wires) -> Wires:
    """The same wires under Hooke's law alone."""
    theta = dict(wires.theta) | {"B": np.zeros_like(wires.theta["B"])}
    kept = tuple(e for e in wires.effects if e.place == "strain")
    return replace(wires, theta=theta, effects=kept)

"""A hold on its way: equilibria followed while creep lengthens the wires, by steps of bounded error."""

from collections.abc import Callable

import numpy as np

from wirebayes.numeric.rows import chosen_rows, pair_at
from wirebayes.numeric.typing import Bools, Floats
from wirebayes.robot.mechanics.description import Lengths, Poses, Robot
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion import forward, inverse, one_sided, outcome, path
from wirebayes.robot.motion.course import Falls
from wirebayes.robot.motion.creep import CreepState, Follow, HoldCreep, fresh

TOLERANCE = 2e-4  # of the creep so far, a step: the drift is then right to .2 % even where wires go slack
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


class CreepingHold:
    """One hold on its way: creep's state, the pose of every draw, and which draws still have one.

    Parameters
    ----------
    robot, wires, joint_m, carried, follow, tolerance
        As in `drift.hold`.
    start : (3,) or (n, 3), (3, 3) or (n, 3, 3) arrays
        Where the first forward solution starts from.
    error_m : (n, w) array, function of the time since the hold began, or float
        What the zero-tension lengths before creep are beyond what the joint values say.
    needed : float
        The hold is followed while at least this share of the draws have not fallen.
    slip : pair of floats, optional
        As in `path.follow`.
    least_mm : float
        Creep that is too little to matter: the errors of steps are measured against no less.

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
        tolerance: float = TOLERANCE,
        error_m: Floats | Callable[[float], Floats] | float = 0.0,
        needed: float = 0.0,
        slip: path.Slip | None = None,
        least_mm: float = 0.0,
    ) -> None:
        self.robot = robot
        self.wires = wires
        self.joint = joint_m
        self.tolerance = tolerance
        self.error_m = error_m
        self.needed = needed
        self.slip = slip
        self.least_mm = least_mm
        self.n = wires.count
        state = carried or fresh(robot.legs, self.n)
        self.lengths = self._lengths(0.0, state)
        self.here = path.at_rest(robot, wires, self.lengths, start)
        self.live = self.here.found
        self.creep = HoldCreep(wires, state, self.here.tension_N.T, follow)
        self.slope: Floats | None = None  # of the amount by creep's clock, and the length of the step it comes from
        self.before: Floats = np.zeros(1)
        self._lay_steps()
        self._begin_notes()

    def _lay_steps(self) -> None:
        """How long the first step is; steps are laid in t^power, in which creep starts straight."""
        self.power = float(np.clip(np.median(self.wires.theta["N"]), *_POWERS))
        k2 = self.creep.k2
        fastest = np.max(k2, initial=1e-300, where=np.isfinite(k2))
        self.step = self.first = _FIRST / float(fastest)

    def _begin_notes(self) -> None:
        """What is written down on the way, of a hold that begins."""
        self.fall_s, self.drop_m = np.full(self.n, np.inf), np.zeros(self.n)
        self.first_N = self.here.tension_N.copy()
        self.lowest_N = self.first_N.copy()
        self.slack_s = np.where(self.first_N > 0, np.inf, 0.0)
        self.stiff = self._stiffness()
        self.left = np.full(self.n, np.nan)  # of the stiffness, at the last pose before a fall

    def _lengths(self, time_s: float, state: CreepState) -> Lengths:
        joint = self.joint(time_s) if callable(self.joint) else self.joint
        each = np.broadcast_to(joint, (self.n, self.robot.legs))
        bare, offset = inverse.lengths(self.robot, each)
        bare = bare + (self.error_m(time_s) if callable(self.error_m) else self.error_m)
        return bare * (1.0 + state.strain(self.wires).T), np.broadcast_to(offset, bare.shape)

    def to(self, stop_s: float) -> None:
        """Go on to a time, by steps of bounded error, while as many draws as needed have not fallen."""
        end = stop_s**self.power
        while self.creep.time_s < stop_s and self.live.mean() >= self.needed:
            clock = self.creep.time_s**self.power
            ahead = clock + self.step
            whole = ahead >= end * (1 - 1e-12) or not self.live.any()
            time = stop_s if whole else ahead ** (1 / self.power)
            length = end - clock if whole else self.step
            least = length <= _LEAST_STEP * (clock + self.first)
            error = self._try(time, least)
            self.step = self._next_step(length, error, whole, least)

    def _next_step(self, length: float, error: float, whole: bool, least: bool) -> float:
        """How long the next step may be.

        Parameters
        ----------
        length, error : float
            Of the one that was tried.
        whole, least : bool
            Whether it led to the requested time, and whether it was as short as any.
        """
        longer = 0.8 * (self.tolerance / max(error, 1e-300)) ** (1 / 3)
        factor = min(max(longer, 0.2), 3.0)
        refused = error > self.tolerance
        if least and refused:  # shorter steps do not help
            return 3.0 * length
        if refused or not whole or factor < 1:
            return factor * length
        # cut short by the requested time: no reason to go on so cautiously
        return max(self.step, factor * length)

    def load(self, robot: Robot) -> None:
        """Go on with another mass on the platform; the wires' clocks run on."""
        self.robot = robot
        zero, offset = self.lengths
        zero = chosen_rows(self.live, zero, np.nan)
        self.here = path.at_rest(robot, self.wires, (zero, offset), self.here.poses)
        fell = self.live & ~self.here.found
        self.fall_s[fell] = self.creep.time_s
        self.live = self.live & ~fell
        self.slope = None
        self.creep.amount = self._amount_at(self.here)

    def _try(self, time: float, least: bool) -> float:
        """One step by prediction and correction; taken unless its error, which is returned, is too large.

        Parameters
        ----------
        time : float
            Where it leads.
        least : bool
            It is taken in any case.
        """
        long = not least and self._is_long(time)
        done = np.maximum(self.creep.progress(time), 1e-300)
        guess = self.creep.onward(time, self.slope)
        there = self._follow(guess, time, _GLANCE if long else path.SMALLEST)
        found = there.here.found
        last, off = self._corrected(guess, there.here, time, done)
        worst = self._worst(off, last, self.live & found)
        if worst > self.tolerance and not least:
            return worst
        here = self._settle(last, time, there.here)
        fell = self.live & ~(found & here.found)
        if long and fell.any():
            return np.inf
        self._note(fell, there, here, (self.creep.time_s, time))
        self._take(last, here, done)
        return worst

    def _is_long(self, time: float) -> bool:
        """Whether a step to a time is long enough for a platform to fall within it."""
        passed = self.creep.time_s / time
        return bool(1.0 - passed**self.power > _FALL_STEP)

    def _take(self, last: HoldCreep, here: forward.Equilibria, done: Floats) -> None:
        """Go on from the end of a step in which creep's clock has gone so far."""
        if self.creep.follow == "current":
            last.amount = self._amount_at(here)
            self.slope, self.before = (last.amount - self.creep.amount) / done, done
        self.creep, self.here = last, here
        self.lengths = self._lengths(last.time_s, last.state())

    def _amount_at(self, here: forward.Equilibria) -> Floats:
        """The amount that belongs to the tensions, of draws that have not fallen."""
        return np.where(self.live, self.creep.amount_at(here.tension_N.T), self.creep.amount)

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
        return self.creep.toward(time, self.creep.amount_at(there.tension_N.T))

    def _worst(self, off: Floats, last: HoldCreep, alive: Bools) -> float:
        """The error of a step, relative to what creeps in it: that of nearly all draws, a tenth of the largest."""
        least = np.maximum(_RESOLVED * np.abs(self.creep.carried.creep_mm + self.creep.amount), self.least_mm)
        size = self._of_worst_wire(np.maximum(np.abs(last.grown), least))
        relative = self._of_worst_wire(off) / np.maximum(size, 1e-300)
        error = relative[alive]
        if not error.size:
            return 0.0
        return float(max(np.quantile(error, 0.9), 0.1 * error.max()))

    def _of_worst_wire(self, values: Floats) -> Floats:
        """(n,) the largest of (w, n) values, or of what spreads to these."""
        return np.broadcast_to(values, (self.robot.legs, self.n)).max(0)

    def _follow(self, creep: HoldCreep, time_s: float, smallest: float) -> path.Followed:
        """The platforms that have not fallen, led along to the lengths at a time."""
        rows = np.flatnonzero(self.live)
        new = self._lengths(time_s, creep.state())
        start = pair_at(self.here.poses, rows)
        wires = self.wires.part(rows)
        old, onward = pair_at(self.lengths, rows), pair_at(new, rows)
        found = path.follow(self.robot, wires, start, old, onward, smallest, self.slip)
        if len(rows) == self.n:
            return found
        here = forward.put_back(found.here, rows, self.n)
        whole = path.Followed(here, np.ones(self.n), np.zeros(self.n), found.slip)
        whole.share[rows] = found.share
        whole.drop_m[rows] = found.drop_m
        return whole

    def _settle(self, creep: HoldCreep, time_s: float, near: forward.Equilibria) -> forward.Equilibria:
        """The pose at corrected lengths, hardly away from one that was followed."""
        zero, offset = self._lengths(time_s, creep.state())
        zero = chosen_rows(near.found, zero, np.nan)
        return path.settle(self.robot, self.wires, near.poses, (zero, offset))

    def _note(self, fell: Bools, there: path.Followed, here: forward.Equilibria, span_s: tuple[float, float]) -> None:
        """Write down falls and slack wires of a step."""
        last = there.here
        self._note_falls(fell, there, span_s)
        tau = chosen_rows(fell, last.tension_N, here.tension_N)
        self._note_slack(fell[:, None], tau, span_s[1])
        moving = self.live[:, None] & np.isfinite(tau)
        lower = np.minimum(self.lowest_N, tau)
        self.lowest_N = np.where(moving, lower, self.lowest_N)
        if fell.any():
            self.left = np.where(fell, self._stiffness(last.poses), self.left)
        self.live = self.live & ~fell
        self._note_status(fell, last, here)

    def _note_status(self, fell: Bools, last: forward.Equilibria, here: forward.Equilibria) -> None:
        """How draws ended that fell now, or before."""
        ended = np.where(last.found, outcome.FELL, last.status)
        here.status[fell] = ended[fell]
        lost = ~self.live & ~fell
        here.status[lost] = self.here.status[lost]

    def _note_falls(self, fell: Bools, there: path.Followed, span_s: tuple[float, float]) -> None:
        """When platforms fell, and how far."""
        begin, end = span_s[0] ** self.power, span_s[1] ** self.power
        share = np.where(there.share < 1, there.share, 1.0)
        time_s = (begin + share * (end - begin)) ** (1 / self.power)
        drop_m = np.where(there.drop_m > 0, there.drop_m, np.inf)
        self.fall_s[fell] = time_s[fell]
        self.drop_m[fell] = drop_m[fell]

    def _note_slack(self, fell: Bools, tau: Floats, now_s: float) -> None:
        """When wires go slack, of which these are the tensions (n, w); `fell` (n, 1) are those whose platform fell."""
        goes_slack = (tau <= 0) & (self.here.tension_N > 0)
        newly = self.live[:, None] & np.isfinite(tau) & goes_slack & np.isinf(self.slack_s) & ~fell
        self.slack_s = np.where(newly, now_s, self.slack_s)
        # A wire that has all but lost its tension when the platform falls is the one that goes slack.
        all_but_slack = tau < 1e-3 * self.first_N
        slackens = fell & np.isinf(self.slack_s) & all_but_slack
        self.slack_s = np.where(slackens, self.fall_s[:, None], self.slack_s)

    def _stiffness(self, pose: Poses | None = None) -> Floats:
        pose = pose or self.here.poses
        return one_sided.lowest_stiffness(self.robot, self.wires, pose, self.lengths)

    def falls(self) -> Falls:
        """What was written down on the way."""
        with np.errstate(invalid="ignore", divide="ignore"):
            share = np.where(self.first_N > 0, self.lowest_N / self.first_N, np.nan)
            stiff = np.where(self.live, self._stiffness(), self.left) / self.stiff
        lowest = np.argmin(np.where(np.isfinite(share), share, np.inf), axis=1)
        wire = np.where(np.isfinite(self.fall_s), lowest, -1)
        return Falls(self.fall_s, wire, self.drop_m, self.slack_s, share, stiff)

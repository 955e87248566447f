"""A session's holds one after another: every wire's creep under the tensions it meets, by steps of bounded error."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from wirebayes.numeric.rows import chosen_rows
from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics.description import Lengths, Poses, Robot
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion import forward, inverse, mixed, path
from wirebayes.robot.motion.creep import CreepState, HoldCreep, fresh
from wirebayes.robot.self_calibration import observability
from wirebayes.robot.self_calibration.session import Session

LONGEST = 2.5  # in the logarithm of time: a third of a hold's thousandfold, between two updates of the tensions
_FIRST = 1e-3  # of a hold: its first step, at most
_EARLIEST = 1e-9  # and at least
_ERROR = 0.01  # of what is resolved of a tension, a step: twenty holds of ten steps leave less than a tenth of it
_SHORTER, _LONGER, _SAFE = 0.1, 3.0, 0.8
_SMALL = 1e-4  # of the robot's size: an error of its square in a pose on the way changes no tension that matters
_FAR = 0.02  # of the robot's size: no slope foretells a pose farther away
_MOST = 100  # steps of a hold: from there on they are as long as those of a wire that hardly creeps
_POWERS = 0.1, 3.0  # of time, between which a first step is shortened; unknowns may have any N


@dataclass(frozen=True)
class SessionHold:
    """A hold of the session: the poses at its end, lengths before creep, and what is carried out."""

    here: forward.Equilibria
    bare_m: Floats
    state: CreepState


@dataclass
class _Pace:
    """How long steps may be: the first of a hold, as a share of it, and the next, in the logarithm of time."""

    first: float
    next: float


def holds(
    robot: Robot,
    wires: Wires,
    error_m: Floats,
    session: Session,
    resolved_N: float,
    longest_step: float = LONGEST,
) -> Iterator[SessionHold]:
    """Every hold of a session, in order.

    Parameters
    ----------
    robot : Robot
    wires : Wires
        ``n`` columns.
    error_m : (n, w) or (p, n, w) array
        Of the reference lengths, or of the lengths at every hold.
    session : Session
    resolved_N : float
        What is resolved of a tension: steps err by a small share of it.
    longest_step : float
        Longest step in the logarithm of time between tension updates; the first is a thousandth of the hold.
    """
    n, legs = error_m.shape[-2:]
    errors = np.broadcast_to(error_m, (len(session.duration_s), n, legs))
    state = fresh(legs, n)
    pace = _Pace(_FIRST, longest_step)
    starts = zip(session.position_m, session.rotation, strict=True)
    each = zip(session.joint_m, session.duration_s, starts, errors, strict=True)
    for joint, duration, start, error in each:
        bare, offset = inverse.lengths(robot, np.broadcast_to(joint, (n, legs)))
        walk = _Walk(robot, wires, (bare + error, offset), start, state, resolved_N)
        walk.through(float(duration), pace, longest_step)
        state = walk.creep.state()
        yield SessionHold(walk.here, walk.bare, state)


class _Walk:
    """One hold on its way.

    Parameters
    ----------
    robot, wires
        As in `holds`.
    lengths : (n, w) arrays
        Before creep, and beyond the exit points.
    start : position and rotation
        Where the first solution starts from.
    carried : CreepState
    resolved_N : float
        What is resolved of a tension.
    """

    def __init__(
        self,
        robot: Robot,
        wires: Wires,
        lengths: Lengths,
        start: Poses,
        carried: CreepState,
        resolved_N: float,
    ) -> None:
        self.robot = robot
        self.wires = wires
        self.resolved_N = resolved_N
        self.bare, self.offset = lengths
        self.size = robot.size_m if robot.degrees == 6 else robot.span_m  # what small motions are small beside
        zero = self._zero(carried)
        self.here = forward.solve_equilibrium(robot, wires, zero, self.offset, *start)
        self.creep = HoldCreep(wires, carried, self.here.tension_N.T)
        self.slope: Floats | None = None  # of the amount by creep's clock
        self.before: Floats = np.zeros(1)  # length of the step that it comes from
        self._look(self.here, zero)

    def through(self, duration_s: float, pace: _Pace, longest: float) -> None:
        """To the hold's end.

        Parameters
        ----------
        duration_s : float
        pace : _Pace
            Of the hold before; left for the next one.
        longest : float
            Step, in the logarithm of time.
        """
        step = pace.next
        taken = 0
        opening = None
        while self.creep.time_s < duration_s:
            free = taken >= _MOST
            taken += 1
            now = self.creep.time_s
            if now == 0.0:
                self._begin(duration_s, pace, free)
                continue
            allowed_error = np.inf if free else _ERROR
            error = self._try(_next(now, duration_s, step), allowed_error)
            factor = _factor(error, 3)
            if self.creep.time_s > now and opening is None:
                opening = step * min(max(factor, 1.0), _LONGER)
            longer = step * min(max(factor, _SHORTER), _LONGER)
            step = longest if free else min(longest, longer)
        pace.next = min(longest, opening or step)
        zero = self._zero(self.creep.state())
        self.here = path.settle(self.robot, self.wires, self.here.poses, (zero, self.offset))

    def _begin(self, duration_s: float, pace: _Pace, free: bool) -> None:
        """Try a hold's first step, and say how long the next first one may be."""
        free = free or pace.first <= _EARLIEST
        error = self._try(duration_s * pace.first, np.inf if free else _ERROR)
        power = float(np.clip(np.median(self.wires.theta["N"]), *_POWERS))
        longer = np.clip(_factor(error, 2), _SHORTER, _LONGER) ** (1 / power)
        pace.first = float(np.clip(pace.first * longer, _EARLIEST, _FIRST))

    def _zero(self, state: CreepState) -> Floats:
        return self.bare * (1 + state.strain(self.wires).T)

    def _look(self, here: forward.Equilibria, zero: Floats) -> None:
        """How poses and tensions answer to strains of the wires; not at all where nothing holds the platform."""
        offset = np.broadcast_to(self.offset, zero.shape)
        motion, change = observability.length_sensitivity(
            self.robot, self.wires, here.position_m, here.rotation, zero, offset
        )
        motion = motion * zero[:, None]
        change = change * zero[:, None]
        finite = np.isfinite(change).all((1, 2)) & np.isfinite(motion).all((1, 2))
        motion[:, 3:] *= self.robot.size_m
        held = here.found & finite
        self.motion = chosen_rows(held, motion, 0.0)
        self.answer = chosen_rows(held, change, 0.0)

    def _solved(self, zero: Floats, grown_mm: Floats) -> forward.Equilibria:
        """The poses at other lengths, where the wires have grown by as much."""
        ahead = self._by_growth(self.motion, grown_mm)
        short = np.linalg.norm(ahead, axis=1) < _FAR * self.size
        ahead = chosen_rows(short, ahead, 0.0)
        near = mixed.after_step(self.robot, self.here.poses, ahead)
        offset = np.broadcast_to(self.offset, zero.shape)
        small = _SMALL * self.size / self.robot.size_m
        return path.settle(self.robot, self.wires, near, (zero, offset), small)

    def _try(self, time_s: float, allowed: float) -> float:
        """One step by prediction and correction, taken unless its error, over what is resolved, is too large."""
        creep = self.creep
        guess = creep.onward(time_s, self.slope)
        zero = self._zero(guess.state())
        here = self._solved(zero, guess.grown - creep.grown)
        were_taut = self.here.tension_N > 0
        are_taut = here.tension_N > 0
        if (are_taut != were_taut).any():
            self._look(here, zero)
        done = np.maximum(creep.progress(time_s), 1e-300)
        amount = creep.amount_at(here.tension_N.T)
        last = creep.toward(time_s, amount)
        off = last.grown - guess.grown
        share = self._share_of_error(done)
        worst = self._worst(here, share * off)
        if worst > allowed:
            return worst
        if self.slope is not None:
            off = (1.0 - share) * off
            last.grown = guess.grown + off
        last.amount = self._amount(here, off)
        self.slope = (last.amount - creep.amount) / done
        self.before = done
        self.creep = last
        self.here = here
        return worst

    def _share_of_error(self, done: Floats) -> Floats:
        """The part of a correction's change that is the corrected value's own error.

        Errors of prediction and correction are in a known ratio, once there is a slope to predict by.
        """
        if self.slope is None:
            return np.full(1, 1 / 3)
        return 1.0 / (3.0 * (1.0 + self.before / done))

    def _worst(self, here: forward.Equilibria, off_mm: Floats) -> float:
        """The largest error of a tension, over what is resolved, of creep that is off."""
        error = np.abs(self._by_growth(self.answer, off_mm)) / self.resolved_N
        return float(error[here.found].max(initial=0.0))

    def _amount(self, here: forward.Equilibria, off_mm: Floats) -> Floats:
        """The amount at the end of a step that led to poses, and wires that are longer than there."""
        tension = np.maximum(here.tension_N + self._by_growth(self.answer, off_mm), 0.0)
        return self.creep.amount_at(chosen_rows(here.found, tension, here.tension_N).T)

    def _by_growth(self, slope: Floats, grown_mm: Floats) -> Floats:
        """What slopes ``(n, ., w)`` make of creep ``(w, n)`` of the tested length."""
        strain = np.broadcast_to(grown_mm / self.wires.length_mm, self.bare.T.shape)
        return np.einsum("nij,jn->ni", slope, strain)


def _factor(error: float, order: int) -> float:
    """How much longer a step may be whose error grows with this power of it."""
    return float(_SAFE * (_ERROR / max(error, 1e-300)) ** (1 / order))


def _next(now_s: float, end_s: float, step: float) -> float:
    """The end of the next step, where the rest of the hold is divided evenly in the logarithm of time."""
    left = float(np.log(end_s / now_s))
    parts = int(np.ceil(left / step - 1e-9))
    return end_s if parts <= 1 else now_s * float(np.exp(left / parts))

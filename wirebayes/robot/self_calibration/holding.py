"""A session's holds one after another: every wire's creep under the tensions it meets, by steps of bounded error."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

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
    """A hold of the session: the poses at its beginning and end, lengths before creep, and what is carried out."""

    begun: forward.Equilibria
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
    near: Poses | None = None,
) -> Iterator[SessionHold]:
    """Every hold of a session, in order.

    Parameters
    ----------
    robot : Robot
    wires : Wires
        ``n`` columns.
    error_m : (n, w) array
        Of the reference lengths.
    session : Session
    resolved_N : float
        What is resolved of a tension: steps err by a small share of it.
    longest_step : float
        Longest step in the logarithm of time between tension updates; the first is a thousandth of the hold.
    near : (n, p, 3), (n, p, 3, 3) arrays, optional
        Where the holds are known to begin, about; default: the requested poses.
    """
    n, legs = error_m.shape
    state, pace = fresh(legs, n), _Pace(_FIRST, longest_step)
    for k, (joint, duration) in enumerate(zip(session.joint_m, session.duration_s, strict=True)):
        bare, offset = inverse.lengths(robot, np.broadcast_to(joint, (n, legs)))
        begin = (session.position_m[k], session.rotation[k]) if near is None else (near[0][:, k], near[1][:, k])
        walk = _Walk(robot, wires, (bare + error_m, offset), begin, state, resolved_N)
        begun = walk.here
        walk.through(float(duration), pace, longest_step)
        state = walk.creep.state()
        yield SessionHold(begun, walk.here, walk.bare, state)


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
        self.robot, self.wires, self.resolved_N = robot, wires, resolved_N
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
        power = float(np.clip(np.median(self.wires.theta["N"]), *_POWERS))
        step, opening, taken = pace.next, None, 0
        while self.creep.time_s < duration_s:
            now = self.creep.time_s
            first = now == 0.0
            time = duration_s * pace.first if first else _next(now, duration_s, step)
            free = taken >= _MOST or (first and pace.first <= _EARLIEST)
            error = self._try(time, np.inf if free else _ERROR)
            taken += 1
            factor = _SAFE * (_ERROR / max(error, 1e-300)) ** (1 / 2 if first else 1 / 3)
            if first:
                share = pace.first * np.clip(factor, _SHORTER, _LONGER) ** (1 / power)
                pace.first = float(np.clip(share, _EARLIEST, _FIRST))
                continue
            if self.creep.time_s > now and opening is None:
                opening = step * min(max(factor, 1.0), _LONGER)
            step = longest if free else min(longest, step * min(max(factor, _SHORTER), _LONGER))
        pace.next = min(longest, opening or step)
        zero = self._zero(self.creep.state())
        self.here = path.settle(self.robot, self.wires, (self.here.position_m, self.here.rotation), (zero, self.offset))

    def _zero(self, state: CreepState) -> Floats:
        return np.asarray(self.bare * (1 + state.strain(self.wires).T))

    def _look(self, here: forward.Equilibria, zero: Floats) -> None:
        """How poses and tensions answer to strains of the wires; not at all where nothing holds the platform."""
        offset = np.broadcast_to(self.offset, zero.shape)
        motion, change = observability.length_sensitivity(
            self.robot, self.wires, here.position_m, here.rotation, zero, offset
        )
        motion, change = motion * zero[:, None], change * zero[:, None]
        held = here.found & np.isfinite(change).all((1, 2)) & np.isfinite(motion).all((1, 2))
        motion[:, 3:] *= self.robot.size_m
        self.motion, self.answer = (np.where(held[:, None, None], v, 0.0) for v in (motion, change))

    def _solved(self, zero: Floats, grown_mm: Floats) -> forward.Equilibria:
        """The poses at other lengths, where the wires have grown by as much."""
        ahead = self._by_growth(self.motion, grown_mm)
        ahead = np.where(np.linalg.norm(ahead, axis=1, keepdims=True) < _FAR * self.size, ahead, 0.0)
        near = mixed.after_step(self.robot, (self.here.position_m, self.here.rotation), ahead)
        small = _SMALL * self.size / self.robot.size_m
        return path.settle(self.robot, self.wires, near, (zero, np.broadcast_to(self.offset, zero.shape)), small)

    def _try(self, time_s: float, allowed: float) -> float:
        """One step by prediction and correction, taken unless its error, over what is resolved, is too large."""
        creep = self.creep
        guess = creep.toward(time_s, np.zeros(1) if self.slope is None else self.slope)
        zero = self._zero(guess.state())
        here = self._solved(zero, guess.grown - creep.grown)
        if ((here.tension_N > 0) != (self.here.tension_N > 0)).any():
            self._look(here, zero)
        done = np.maximum(creep.progress(time_s), 1e-300)
        last = creep.toward(time_s, np.zeros(1), creep.amount_at(here.tension_N.T))
        off = last.grown - guess.grown
        # errors of prediction and correction are in a known ratio, once there is a slope to predict by
        share = 1.0 / (3.0 * (1.0 + self.before / done)) if self.slope is not None else np.full(1, 1 / 3)
        error = np.abs(self._by_growth(self.answer, share * off)) / self.resolved_N
        worst = float(error[here.found].max(initial=0.0))
        if worst > allowed:
            return worst
        if self.slope is not None:
            off = (1.0 - share) * off
            last.grown = guess.grown + off
        tension = np.maximum(here.tension_N + self._by_growth(self.answer, off), 0.0)
        last.amount = creep.amount_at(np.where(here.found[:, None], tension, here.tension_N).T)
        self.slope, self.before = (last.amount - creep.amount) / done, done
        self.creep, self.here = last, here
        return worst

    def _by_growth(self, slope: Floats, grown_mm: Floats) -> Floats:
        """What slopes ``(n, ., w)`` make of creep ``(w, n)`` of the tested length."""
        strain = np.broadcast_to(grown_mm / self.wires.length_mm, self.bare.T.shape)
        return np.asarray(np.einsum("nij,jn->ni", slope, strain))


def _next(now_s: float, end_s: float, step: float) -> float:
    """The end of the next step, where the rest of the hold is divided evenly in the logarithm of time."""
    left = float(np.log(end_s / now_s))
    parts = int(np.ceil(left / step - 1e-9))
    return end_s if parts <= 1 else now_s * float(np.exp(left / parts))

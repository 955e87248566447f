"""The pose while the robot runs: fed with joint values step by step, every draw's creep carried along.

A fixed set of posterior draws, each with its own creep, integrated as it goes: their spread is the band, whatever its
shape, and nothing is sampled while the robot runs. A step is short, so that one Newton step on the balance of forces is
the forward solution. Where tensions or angles are read, columns beside the draws give the derivatives by everything
unknown, and the draws are moved by what the readings so far say (`readings`): the batch estimate in one pass.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from wirebayes.errors import InputError
from wirebayes.numeric.rows import chosen_rows, pair_at
from wirebayes.numeric.typing import Bools, Floats, Indices
from wirebayes.robot.history import live_input
from wirebayes.robot.history.beside import beside, beside_fresh
from wirebayes.robot.history.follow import RESTART, pulling_more
from wirebayes.robot.history.history import roll_and_pitch, with_payload
from wirebayes.robot.history.live_pose import LivePose
from wirebayes.robot.history.readings import Information, Sensors, reading_weight, sensors
from wirebayes.robot.history.unknowns import LogUnknowns, Uncertain, slopes, unknowns
from wirebayes.robot.mechanics import firmware, wire_doubts
from wirebayes.robot.mechanics.description import Poses, Robot
from wirebayes.robot.mechanics.draws import WireDraws
from wirebayes.robot.mechanics.rotation import antisymmetric
from wirebayes.robot.mechanics.winches import of_each_leg, of_each_winch
from wirebayes.robot.motion import balance, forward, inverse, mixed, path, plausible
from wirebayes.robot.motion.creep import HoldCreep

_LONG = 5e-2  # of the platform's size: a longer Newton step is followed with care instead
_AGAIN = 5e-3  # of the platform's size: after a shorter one, less than a micrometre is left
_SHARE, _SHORT_S = 0.2, 1.0  # a step may last so much of its hold's age, and so long in any case
_FAR = 8.0  # prior sd: a draw that readings move so far contradicts them (a wire is slack, say) and is left out
_LEAP = 1.5  # times the length at the step before: straight lengths are at most half of a wire of several lines
_REFRESH_S = 0.1  # what all readings say together changes slowly


class LiveEstimator:
    """The pose of a running robot, from joint values and, where they are read, tensions and angles.

    Made by `wirebayes.live`.

    Parameters
    ----------
    robot : Robot
    line : WireDraws
        Its draws are the columns that are carried along.
    errors : Uncertain
    reads : bool
        Whether tensions or angles will be given; without them a step is faster.
    start : (3,), (3, 3) arrays
        About where the platform is at the first step.
    seed : int

    Attributes
    ----------
    warnings : tuple of Notice
        What the fits of the wires say against using them.

    Examples
    --------
    >>> joints = held.summary()["inverse"]["joint_value_m"]["q50"]
    >>> running = wb.live("linear-7", posterior, draws=16)
    >>> first = running.step(0.0, joints)
    >>> later = running.step(60.0, joints)
    >>> bool(later.position_m[2] < first.position_m[2])  # the platform sinks
    True
    """

    def __init__(
        self,
        robot: Robot,
        line: WireDraws,
        errors: Uncertain,
        start: Poses,
        reads: bool = True,
        seed: int = 0,
    ) -> None:
        self._rng = np.random.default_rng(seed)
        known = unknowns(robot, line, errors, self._rng)
        self._bare, self.robot, self._reads = robot, robot, reads
        self.warnings = (*wire_doubts.doubts(robot, line), *plausible.robot_notices(robot))
        self._start, self._last = start, -np.inf
        self._n = line.count
        self._prepare_columns(known)
        self._prepare_readings(known.count, sensors(robot, errors))

    def _prepare_columns(self, known: LogUnknowns) -> None:
        """Wires of the draws, of differences for derivatives where readings come, and the one that never creeps."""
        legs = self.robot.legs
        white = known.draws
        if self._reads:
            at_zero = np.zeros(known.count)
            white = np.concatenate([white, known.differences(at_zero)])
        wires, error = known.columns(white)
        carried = known.carried(white)
        self._known, self._white = known, white
        self._wires = beside(wires, known.plain)
        self._error = np.concatenate([error, np.zeros((1, legs))])
        self._more = np.zeros_like(self._error)
        self._state = beside_fresh(carried, legs)
        self._columns = len(self._error)
        self._live = np.ones(self._columns, bool)
        self._joint = np.empty((self._columns, legs))

    def _prepare_readings(self, count: int, of: Sensors) -> None:
        """What the sensors will say, of so many unknowns: nothing yet."""
        m = self.robot.legs + 2
        self._of = of
        self._offset = self._rng.standard_normal((self._n, m))
        self._information = Information.none(count, m, self._n)
        self._moves = np.zeros((self._n, count))
        self._sane = np.ones(self._n, bool)
        self._refreshed = -np.inf

    def wire_m(self, straight_m: ArrayLike) -> Floats:
        """Joint values, ``(j,)`` m, of the straight lengths that firmware counts: ``lines x straight + beyond_exit``.

        Parameters
        ----------
        straight_m : (j,) array
            From exit point to platform point, one of each winch.

        Raises
        ------
        InputError
            A leg has a linear actuator, whose joint value is no length.
        """
        if self.robot.is_linear.any():
            raise InputError(f"straight_m: found lengths, expected displacements of the actuators of {self.robot.name}")
        return firmware.wire_of(self.robot, live_input.checked_vector("straight_m", straight_m, self.robot.joints))

    def load(self, mass_kg: float, centre_m: ArrayLike | None = None) -> None:
        """Set what the platform carries from now on beside its own mass.

        Parameters
        ----------
        mass_kg : float
        centre_m : (3,) array, optional
            Its centre of mass in the platform's frame; the platform's own when left out.

        Raises
        ------
        InputError
            A negative mass, or what is not finite; the load stays as it was.
        """
        mass, centre = live_input.checked_number("mass_kg", mass_kg), self._bare.centre_of_mass_m
        if not 0 <= mass < np.inf:
            raise InputError(f"mass_kg: found {mass:g}, expected kilograms, 0 or more")
        if centre_m is not None:
            centre = live_input.checked_vector("centre_m", centre_m, 3)
            live_input.refuse_bad("centre_m", centre, np.isfinite(centre), "a finite number")
        self.robot = with_payload(self._bare, mass, centre)

    def step(
        self,
        time_s: float,
        joint_m: ArrayLike,
        tension_N: ArrayLike | None = None,
        tilt_rad: ArrayLike | None = None,
        nominal_m: ArrayLike | None = None,
    ) -> LivePose:
        """Take in what was measured at a time, and say where the platform is.

        Parameters
        ----------
        time_s : float
            Later than at the step before; at the first step the wires are new.
        joint_m : (j,) array
            Joint values, one of each winch, corrections included; a drum's is the length of the whole wire (`wire_m`).
        tension_N : (w,) array, optional
            NaN where a sensor was not read.
        tilt_rad : (2,) array, optional
            Roll and pitch.
        nominal_m : (j,) array, optional
            Joint values before any correction; `joint_m` when left out.

        Returns
        -------
        LivePose

        Raises
        ------
        InputError
            A ValueError: time does not go on, readings are given to an estimator that was made without them, or
            something is not finite or of a wrong shape. Nothing is taken in then, and the next step goes on from the
            last good one.
        """
        time = self._later(time_s)
        if (tension_N is not None or tilt_rad is not None) and not self._reads:
            raise InputError("readings: found some, expected none; make the estimator with reads=True")
        joint = self._joints("joint_m", joint_m)
        nominal = joint if nominal_m is None else self._joints("nominal_m", nominal_m)
        tension = live_input.checked_reading("tension_N", tension_N, self.robot.legs)
        tilt = live_input.checked_reading("tilt_rad", tilt_rad, 2)
        with np.errstate(all="ignore"):  # a draw whose platform falls has no numbers
            return self._step(time, joint, nominal, np.concatenate([tension, tilt]))

    def _later(self, time_s: float) -> float:
        """A time that is later than at the step before."""
        time = live_input.checked_number("time_s", time_s)
        if not time > self._last:
            raise InputError(f"time_s: found {time:g} after {self._last:g}, expected a later time")
        if time == np.inf:
            raise InputError("time_s: found inf, expected a finite time")
        return time

    def _joints(self, name: str, values: ArrayLike) -> Floats:
        """Joint values as they can be: a drum has paid out some length, a linear actuator may stand on either side."""
        given = live_input.checked_vector(name, values, self.robot.joints)
        linear = of_each_winch(self.robot, self.robot.is_linear)
        finite = np.isfinite(given)
        live_input.refuse_bad(name, given, finite | ~linear, "a finite number")
        live_input.refuse_bad(name, given, (finite & (given > 0)) | linear, "a finite length above 0")
        each = of_each_leg(self.robot, given)
        if self._leaps(each):
            live_input.refuse_unlikely(self.robot, name, each)
        return each

    def _leaps(self, given: Floats) -> bool:
        """Whether joint values are the first, or far from the last: only those may be of another kind."""
        if self._last == -np.inf:
            return True
        last, drum = self._joint[-1], ~self.robot.is_linear
        longer, shorter = np.maximum(given, last), np.minimum(given, last)
        return bool((longer > _LEAP * shorter)[drum].any())

    def _step(self, time_s: float, joint: Floats, nominal: Floats, readings: Floats) -> LivePose:
        """A step with arguments that are right; of all sensors, ``(w + 2,)``, NaN where one was not read."""
        each: Floats = np.broadcast_to(joint, (self._columns, self.robot.legs)).copy()
        each[-1] = nominal
        if self._last == -np.inf:
            self._settle(each)
            self._begin(time_s)
        else:
            self._move(time_s, each)
        self._joint = each
        if np.isfinite(readings).any():
            self._read(time_s, readings)
        self._last = time_s
        return self._pose(time_s, nominal)

    def _move(self, time_s: float, joint: Floats) -> None:
        """On to other joint values, which change evenly, by parts of the time since the step before."""
        before, joints = self._last, self._joint
        for part in self._parts(time_s):
            share = (part - before) / (time_s - before)
            self._advance(part, joints + share * (joint - joints))

    def _parts(self, time_s: float) -> list[float]:
        """Where a long step is divided: while a hold is young, its creep is fast."""
        out, time = [], self._last
        while time < time_s:
            longest = max(_SHARE * (time - self._since), _SHORT_S)
            time = min(time_s, time + longest)
            out.append(time)
        return out

    def _advance(self, time_s: float, joint_m: Floats) -> None:
        """Creep under the tensions so far, then the pose."""
        bare, offset = inverse.lengths(self.robot, joint_m)
        self._state = self._creep.advance(time_s - self._since, self._tension.T)
        self._go(self._grown(bare), offset)
        if self._known.errors_move:
            self._place_errors((self._x[-1:], self._R[-1:]), self._tension[-1:])
            self._go(self._grown(bare), offset)
        change = np.abs(self._tension[-1] - self._reference).max()
        if change > RESTART * self._reference.mean():
            self._begin(time_s)

    def _grown(self, bare: Floats) -> Floats:
        """Zero-tension lengths with the errors of references and the creep so far."""
        strain = self._state.strain(self._wires).T
        return (bare + self._error) * (1.0 + strain)

    def _settle(self, joint_m: Floats) -> None:
        """The first pose, found from afar; once more where the lengths depend on it."""
        x, R = self._start
        self._place_errors((x[None], R[None]), np.zeros((1, self.robot.legs)))
        self._settle_at(joint_m)
        if self._known.errors_move:
            self._place_errors((self._x[-1:], self._R[-1:]), self._tension[-1:])
            self._settle_at(joint_m)

    def _place_errors(self, poses: Poses, tension_N: Floats) -> None:
        """Errors of the lengths are those at a pose; the wires that never creep have none."""
        error, more = self._known.errors_at(self._white, poses, tension_N)
        self._error[:-1] = error[0]
        self._more[:-1] = more[0]

    @property
    def _pull(self) -> Floats:
        """Tensions of every column, of wires that run to where its own points are."""
        return pulling_more(self._tension, self._more)

    def _settle_at(self, joint_m: Floats) -> None:
        bare, offset = inverse.lengths(self.robot, joint_m)
        zero = self._grown(bare)
        here = forward.solve_equilibrium(self.robot, self._wires, zero, offset, *self._start)
        self._live = here.found
        x, R = self._start
        self._x = chosen_rows(here.found, here.position_m, x)
        self._R = chosen_rows(here.found, here.rotation, R)
        self._tension = chosen_rows(here.found, here.tension_N, 0.0)
        self._lengths = zero, np.broadcast_to(offset, zero.shape)

    def _begin(self, time_s: float) -> None:
        """The wires' clocks restart."""
        state = self._state if self._wires.effects else replace(self._state, past=())
        self._creep = HoldCreep(self._wires, state, self._tension.T)
        self._since, self._reference = time_s, self._tension[-1]

    def _go(self, zero: Floats, offset: Floats) -> None:
        """Poses at new lengths, a short way on."""
        for _ in range(3):
            length, hard = self._newton(zero, offset)
            if hard.any():
                self._carefully(np.flatnonzero(hard), zero, offset)
            moved = length[self._live & ~hard]
            if not (moved > _AGAIN * self.robot.size_m).any():
                break
        self._tension = balance.tensions_at(self.robot, self._wires, self._x, self._R, zero, offset)
        self._lengths = zero, offset

    def _newton(self, zero: Floats, offset: Floats) -> tuple[Floats, Bools]:
        """Newton's step of every column whose own is short: how long each is, and which columns stay where they are."""
        step = path.newton_step(self.robot, self._wires, (self._x, self._R), (zero, offset))
        length = np.sqrt((step * step).sum(1))
        short = length < _LONG * self.robot.size_m
        hard = self._live & ~short
        step[hard] = np.nan
        self._x, self._R = mixed.after_step(self.robot, (self._x, self._R), step)
        return length, hard

    def _carefully(self, rows: Indices, zero: Floats, offset: Floats) -> None:
        """Columns whose way is long or unstable: followed in parts; lost where the platform falls."""
        old = pair_at(self._lengths, rows)
        new = pair_at((zero, offset), rows)
        start = self._x[rows], self._R[rows]
        there = path.follow(self.robot, self._wires.part(rows), start, old, new).here
        good = rows[there.found]
        self._x[good] = there.position_m[there.found]
        self._R[good] = there.rotation[there.found]
        self._live[rows[~there.found]] = False

    def _read(self, time_s: float, y: Floats) -> None:
        """What the sensors say, added to what they said before."""
        n = self._n
        of = self._of
        predicted = np.concatenate([self._pull, roll_and_pitch(self._R)], 1)[:-1]
        since = None if self._last == -np.inf else time_s - self._last
        counts = reading_weight(since)
        normal = self._rng.standard_normal((n, len(y)))
        noise = of.error * normal / np.sqrt(counts)
        left = y - predicted[:n] - of.offset * self._offset + noise
        left = chosen_rows(self._live[:n], left, np.nan)
        self._information.add(of, slopes(predicted[n:]), left, counts)
        if time_s - self._refreshed >= _REFRESH_S:
            self._refresh(time_s)

    def _refresh(self, time_s: float) -> None:
        """How all readings so far move the draws."""
        moves = self._information.moves(np.zeros(1), None)
        self._moves = moves[:, : self._moves.shape[1]]
        self._sane = np.abs(self._moves).max(1) < _FAR
        self._refreshed = time_s

    def _pose(self, time_s: float, nominal: Floats) -> LivePose:
        """The draws, moved by the readings, in numbers."""
        centre = self._R[self._n if self._reads else -1]
        held = float(self._live[: self._n].mean())
        return LivePose.of(time_s, self.robot, self._own_draws(centre), centre, nominal, held)

    def _own_draws(self, centre: Floats) -> Floats:
        """Position, rotation from `centre`, joint values and tensions of the draws that count; NaN if none does."""
        values = self._values(centre)
        own = values[: self._n]
        if self._reads:
            own = own + self._moves @ slopes(values[self._n : -1])
        shown = self._shown()
        own = own if shown.all() else own[shown]
        return own if len(own) else np.full((1, values.shape[1]), np.nan)

    def _values(self, centre: Floats) -> Floats:
        """What `_own_draws` speaks of, of every column."""
        turned = antisymmetric(self._R @ centre.T)
        target = self._x[-1:], self._R[-1:], self._tension[-1:]
        strain = self._state.strain(self._wires)
        commands = inverse.commands(self.robot, self._wires, *target, strain, self._error.T)
        return np.concatenate([self._x, turned, commands.joint_m, self._pull], 1)

    def _shown(self) -> Bools:
        """(n,) Draws that count: those that hang and are moved sanely, or all that hang where none is."""
        live = self._live[: self._n]
        sane = live & self._sane
        return sane if sane.any() else live

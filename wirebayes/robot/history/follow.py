"""Carrying wires through a history: every draw's creep under its own tensions, every draw's pose at each row."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from wirebayes.numeric.typing import Bools, Floats, Indices, Ints
from wirebayes.robot.history.history import History, divided, stated_starts
from wirebayes.robot.mechanics.description import Poses, Robot
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion.creep import CreepState, fresh
from wirebayes.robot.motion.creeping_hold import CreepingHold

# Share of the mean tension by which a command must change a wire's tension to restart the clocks. On the paper's
# bench every step changed the tension by a tenth or more; of smaller changes the tests say nothing.
RESTART = 0.1
_EVEN = 0.005  # of the robot's span: over so short a way tensions change evenly, even of wires that pull at each other


@dataclass(frozen=True)
class Track:
    """Poses of ``n`` columns at the ``t`` rows of a history.

    Attributes
    ----------
    position_m, rotation : (n, t, 3), (n, t, 3, 3) arrays
        NaN from a fall on.
    tension_N : (n, t, w) array
    strain : (n, t, w) array
        Creep of every wire.
    hold : (t,) int array
        How often the wires' clocks had been restarted.
    """

    position_m: Floats
    rotation: Floats
    tension_N: Floats
    strain: Floats
    hold: Ints

    @property
    def held(self) -> Bools:
        """(n, t) True where the platform hangs in an equilibrium."""
        return np.asarray(np.isfinite(self.position_m).all(-1))

    def part(self, index: Indices) -> "Track":
        """Some of the columns."""
        return replace(
            self,
            position_m=self.position_m[index],
            rotation=self.rotation[index],
            tension_N=self.tension_N[index],
            strain=self.strain[index],
        )

    def pulled_more(self, more_N: Floats) -> "Track":
        """The same where wires that bear pull by more, ``(t, n, w)`` or ``(n, w)`` N, and none by less than nothing."""
        more = np.swapaxes(more_N, 0, 1) if more_N.ndim == 3 else more_N[:, None]
        return replace(self, tension_N=pulling_more(self.tension_N, more))

    def at_rows(self, rows: Indices) -> "Track":
        """Some of the rows."""
        position, rotation = self.position_m[:, rows], self.rotation[:, rows]
        return Track(position, rotation, self.tension_N[:, rows], self.strain[:, rows], self.hold[rows])

    def with_columns(self, at: Bools, other: "Track") -> "Track":
        """The columns of another in the places of some of its own."""
        out = self.part(np.arange(len(at)))
        out.position_m[at] = other.position_m
        out.rotation[at] = other.rotation
        out.tension_N[at] = other.tension_N
        out.strain[at] = other.strain
        return out


def pulling_more(tension_N: Floats, more_N: Floats) -> Floats:
    """Tensions of wires of which those that bear pull by more, and none by less than nothing."""
    return np.where(tension_N > 0, np.maximum(tension_N + more_N, 0.0), tension_N)


def follow_log(
    robot: Robot,
    wires: Wires,
    history: History,
    joint_m: Floats,
    start: Poses,
    starts_s: Floats,
    error_m: Floats | float = 0.0,
    progress: Callable[[int], None] = lambda row: None,
    carried: CreepState | None = None,
) -> Track:
    """Follow every column's equilibrium through a history, its creep under its own tensions.

    Parameters
    ----------
    robot : Robot
    wires : Wires
        ``n`` columns.
    history : History
    joint_m : (t, w) or (t, n, w) array
        Joint values at the rows.
    start : (3,) or (n, 3), (3, 3) or (n, 3, 3) arrays
        Where the first forward solution starts from.
    starts_s : array
        Rising times at which the wires' clocks restart (`clock_starts`).
    error_m : (n, w) or (t, n, w) array or float
        What the zero-tension lengths before creep are beyond what the joint values say; at every row, or always.
    progress : function of a row
    carried : CreepState, optional
        What the wires bring along; default: they were never loaded.

    Returns
    -------
    Track
    """
    times = history.times_s
    since = float(times[0])
    hold = np.searchsorted(starts_s, times, "right") - 1
    track = _empty(wires.count, robot.legs, np.maximum(hold, 0))
    brought = fresh(robot.legs, wires.count)
    if carried is not None:
        brought = _without_clocks(carried, wires)
    schedule = _schedule(times, joint_m)
    errors = _errors_by_time(times, error_m)
    first_robot = history.robot_at(robot, 0)
    walk = _begin(first_robot, wires, schedule, since, start, brought, errors)
    ahead = [float(time) for time in starts_s if time > since]
    for k, time in enumerate(times):
        while ahead and ahead[0] < time:
            walk.to(ahead[0] - since)
            since = ahead.pop(0)
            walk = _again(walk, schedule, errors, since)
        walk.to(float(time) - since)
        if k and _loaded(history, k):
            walk.load(history.robot_at(robot, k))
        if ahead and ahead[0] == time:
            since = ahead.pop(0)
            walk = _again(walk, schedule, errors, since)
        _note(track, k, walk)
        progress(k)
    return track


def _note(track: Track, row: int, walk: CreepingHold) -> None:
    """Write down a row: where the platform hangs, and the creep of every wire."""
    here, live = walk.here, walk.live
    track.position_m[live, row] = here.position_m[live]
    track.rotation[live, row] = here.rotation[live]
    track.tension_N[live, row] = here.tension_N[live]
    track.strain[:, row] = walk.creep.state().strain(walk.wires).T


def _empty(columns: int, legs: int, hold: Ints) -> Track:
    """A track of which no row is known yet."""
    rows = columns, len(hold)
    position = np.full((*rows, 3), np.nan)
    rotation = np.full((*rows, 3, 3), np.nan)
    tension = np.full((*rows, legs), np.nan)
    strain = np.full((*rows, legs), np.nan)
    return Track(position, rotation, tension, strain, hold)


def clock_starts(history: History, tension_N: Floats, share: float = RESTART) -> Floats:
    """Times at which the wires' clocks start: the history's own holds, or where a command or a load changes tensions.

    A hold begins when a wire's tension has changed by a share of the mean tension since the one before. Between rows
    tensions are taken to change evenly, as they do where rows are as near as those of `refined_joints`: along a long
    even motion of the joints they do not, least of all in a redundant robot.

    Parameters
    ----------
    history : History
    tension_N : (t, w) array
        At the rows, of wires that do not creep: changed by what is commanded or carried only.
    share : float
        Infinite: the clocks start once.

    Returns
    -------
    (s,) array
        Rising, the first row's time first.
    """
    times = history.times_s
    if history.hold is not None and np.isfinite(share):
        return stated_starts(history)
    starts = [float(times[0])]
    reference = tension_N[0]
    for k in range(1, len(times)):
        before, after = tension_N[k - 1], tension_N[k]
        if _loaded(history, k):
            if _changed(reference, after, share):
                starts.append(float(times[k]))
                reference = after
            continue
        lasts = times[k] - times[k - 1]
        while _changed(reference, after, share):
            reached, reference = _first_changed(reference, before, after, share)
            start = times[k - 1] + reached * lasts
            starts.append(float(start))
    return np.array(starts)


def _changed(reference: Floats, tension_N: Floats, share: float) -> bool:
    """Whether a wire's tension has changed by a share of the mean tension."""
    limit = share * float(reference.mean())
    return bool(np.abs(tension_N - reference).max() > limit > 0)


def _first_changed(reference: Floats, before: Floats, after: Floats, share: float) -> tuple[float, Floats]:
    """The share of an even change after which a first tension has changed by `share`, and all tensions then."""
    limit = share * float(reference.mean())
    beyond = np.abs(after - reference) > limit
    edge = reference + limit * np.sign(after - reference)
    reached = float(((edge - before)[beyond] / (after - before)[beyond]).min())
    return reached, before + reached * (after - before)


def refined_joints(robot: Robot, history: History) -> tuple[History, Indices]:
    """A history of joint values with rows between distant ones, and where its own rows are among them."""
    assert history.joint_m is not None
    wire = np.where(robot.is_linear, robot.ratio, 1.0) / robot.lines  # paid out in each line, by the joint value
    far = (np.abs(np.diff(history.joint_m, axis=0)) * wire).max(1)
    pieces = np.ceil(far / (_EVEN * robot.span_m)).astype(int)
    return divided(history, np.maximum(pieces, 1))


def _begin(
    robot: Robot,
    wires: Wires,
    schedule: Callable[[float], Floats],
    since_s: float,
    start: Poses,
    carried: CreepState,
    errors: Callable[[float], Floats],
) -> CreepingHold:
    """A hold that begins at a time of the history."""

    def joint(time_s: float) -> Floats:
        return schedule(since_s + time_s)

    def error(time_s: float) -> Floats:
        return errors(since_s + time_s)

    return CreepingHold(robot, wires, joint, start, carried, error_m=error)


def _again(
    walk: CreepingHold, schedule: Callable[[float], Floats], errors: Callable[[float], Floats], since_s: float
) -> CreepingHold:
    """The hold that follows one: from its pose, with its creep."""
    carried = _without_clocks(walk.creep.state(), walk.wires)
    return _begin(walk.robot, walk.wires, schedule, since_s, _pose(walk), carried, errors)


def _loaded(history: History, row: int) -> bool:
    """Whether what the platform carries changes at a row."""
    now, before = history.payload_kg[row], history.payload_kg[row - 1]
    return bool(now != before or (now > 0 and np.any(history.payload_m[row] != history.payload_m[row - 1])))


def _schedule(times_s: Floats, joint_m: Floats) -> Callable[[float], Floats]:
    """Joint values, or errors of lengths, by time, even between the rows."""

    def joint(time_s: float) -> Floats:
        k = int(np.clip(np.searchsorted(times_s, time_s, "right") - 1, 0, len(times_s) - 2))
        share = min(max((time_s - times_s[k]) / (times_s[k + 1] - times_s[k]), 0.0), 1.0)
        return joint_m[k] + share * (joint_m[k + 1] - joint_m[k])

    return joint


def _errors_by_time(times_s: Floats, error_m: Floats | float) -> Callable[[float], Floats]:
    """Errors of the lengths by time: even between the rows, or the same always."""
    errors = np.asarray(error_m, float)
    return _schedule(times_s, errors) if errors.ndim == 3 else lambda time_s: errors


def errors_at(error_m: Floats, rows: int | Indices) -> Floats:
    """Errors of the lengths at a row, or at several: of ``(t, n, w)`` errors those, of ``(n, w)`` the same at all."""
    return error_m[rows] if error_m.ndim == 3 else error_m


def _without_clocks(state: CreepState, wires: Wires) -> CreepState:
    """What goes into the next hold; the clocks of earlier ones only where an effect may remember them."""
    return state if wires.effects else replace(state, past=())


def _pose(walk: CreepingHold) -> Poses:
    """Where the next hold starts from; NaN where the platform has fallen, so that nothing more is solved there."""
    lost = ~walk.live[:, None]
    return np.where(lost, np.nan, walk.here.position_m), walk.here.rotation


def uncreeping(wires: Wires) -> Wires:
    """One column: the mean wire, which never creeps."""
    elastic = {column for effect in wires.at("strain") for column in effect.columns()}
    neutral = _neutral_values(wires)
    theta = {}
    for name, value in wires.theta.items():
        mean = value.mean(-1, keepdims=True)
        if name == "B":
            mean = np.zeros_like(mean)
        elif name in neutral and name not in elastic:
            mean = np.full_like(mean, neutral[name])
        theta[name] = mean
    return replace(wires, theta=theta)


def _neutral_values(wires: Wires) -> dict[str, float]:
    """The value of each amplitude of the wires' effects at which it changes nothing."""
    neutral = {}
    for effect in wires.effects:
        for amplitude, column in zip(effect.amplitudes, effect.columns(), strict=True):
            neutral[column] = amplitude.neutral
    return neutral

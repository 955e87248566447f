"""What speaks against an answer about a history: poses out of reach, falls, readings that contradict, fast motion."""

import numpy as np

from wirebayes.json_files.pose_history import PoseHistoryJson
from wirebayes.numeric.typing import Bools, Floats, Ints
from wirebayes.result_warnings import Notice
from wirebayes.robot.history.corrections import Target
from wirebayes.robot.history.estimate import Estimate
from wirebayes.robot.history.follow import Track
from wirebayes.robot.history.history import History
from wirebayes.robot.mechanics import sag, wire_doubts
from wirebayes.robot.mechanics.description import GRAVITY, Robot
from wirebayes.robot.mechanics.draws import WireDraws
from wirebayes.robot.motion import inverse, plausible
from wirebayes.sentences import counted, short

_FEWEST = 50  # effective draws; of so many, what lies beyond a 5 % quantile is 2 to 8 %
_NAMED = 6  # times in a warning: as many as a line holds
_INERTIA = 0.05  # of the weight: a force above it changes tensions by as much as the creep that is looked for
_POSSIBLE = 50.0  # of the weight: cable robots built for speed reach 43 times the acceleration of gravity
_STILL = 1e-2  # of the speed of a move: a platform that is so slow beside it stands still
_MISFIT = 2.0  # mean squared residual from which on the readings contradict the model


def unreached(history: History, found: Estimate, to: Target, change_m: Floats) -> list[Notice]:
    """Which commanded poses no corrections ``(n, t, w)`` lead to, though the platform still hangs then.

    Parameters
    ----------
    history : History
        Without commanded poses all are reached.
    found : Estimate
    to : Target
    change_m : (n, t, w) array
        Corrections, NaN where there are none.
    """
    if history.position_m is None:
        return []
    never = found.track.held.any(0) & ~np.isfinite(change_m).all(-1).any(0)
    unheld = ~np.isfinite(to.tension_N).all(-1)
    reasons = {
        "no tensions within the bounds hold the platform at the pose": unheld,
        "no draw's wires can pull as hard as it takes at the pose": ~unheld,
    }
    out = []
    for reason, why in reasons.items():
        rows = np.flatnonzero(never & why)
        if rows.size:
            times = _times_in_words(history.times_s[rows])
            out.append(Notice("unheld", f"{reason} commanded at {times}: no corrections lead there"))
    return out


def _times_in_words(times_s: Floats) -> str:
    """The first times, and how many there are more."""
    named = ", ".join(f"{time:.10g}" for time in times_s[:_NAMED])
    more = len(times_s) - _NAMED
    return f"{named} s and {more} times more" if more > 0 else f"{named} s"


def history_warnings(
    robot: Robot, line: WireDraws, history: History, found: Estimate, joint_m: Floats, content: PoseHistoryJson
) -> list[Notice]:
    """What speaks against poses that were found over time.

    Parameters
    ----------
    robot : Robot
    line : WireDraws
    history : History
    found : Estimate
    joint_m : (t, w) or (n, t, w) array
        Joint values at the rows.
    content : dict
        Of ``pose.json``, with ``clock`` and ``drift``.
    """
    position = found.plain.position_m[0]
    tension = found.plain.tension_N[0]
    longest_s = _longest_hold(history.times_s, found.track.hold)
    lengths = inverse.lengths(robot, joint_m)[0]
    return [
        *_lost(history.times_s, found.track),
        *_contradicted(history, found, line.count),
        *_unsure_clock(history, content),
        *_dynamics(history.times_s, position),
        *wire_doubts.wire_warnings(robot, line, found.track.tension_N, longest_s, lengths),
        *plausible.robot_notices(robot),
        *plausible.strain_notices(robot, line, tension[-1]),
        *sag.sag_warnings_of_poses(robot, position, found.plain.rotation[0], tension),
    ]


def _longest_hold(times_s: Floats, hold: Ints) -> float:
    """How long the longest hold took, s, by the number of the hold at each time."""
    begun = np.flatnonzero(np.diff(hold)) + 1
    ends = [0, *begun, len(times_s) - 1]
    return float(np.diff(times_s[ends]).max())


def _lost(times_s: Floats, track: Track) -> list[Notice]:
    """Notices that the platform falls, or that wires go slack, in some of the draws."""
    out = []
    lost = 1.0 - track.held[:, -1].mean()
    if lost > 0:
        first = times_s[np.argmin(track.held.all(0))]
        text = f"the platform falls or loses its hold in {short(100 * lost, 3)} % of the draws, first at {first:g} s"
        out.append(Notice("fall", text))
    slack = ((track.tension_N <= 0) & track.held[..., None]).any(1).mean(0)
    for i in np.flatnonzero(slack > 0.05):
        out.append(Notice("slack", f"wire {i + 1} goes slack in {100 * slack[i]:.0f} % of the draws"))
    return out


def _contradicted(history: History, found: Estimate, draws_used: int) -> list[Notice]:
    """Notices that the readings do not agree with the joint values, or that few draws agree with both."""
    out = []
    if history.read and not found.converged:
        text = (
            "the readings could not be brought together with the joint values, whatever the wires: check units and "
            "signs of all columns, the payload, and --reference-sd; the bands are those without the readings"
        )
        out.append(Notice("not-converged", text))
    elif found.misfit is not None and found.misfit > _MISFIT:
        text = (
            f"the readings contradict joint values and wires: mean squared residual {short(found.misfit, 3)}, "
            "expected about 1; check signs, units, payload and the standard errors"
        )
        out.append(Notice("misfit", text))
    if found.converged and found.effective is not None and found.effective < _FEWEST:
        then = "the bands' ends are rough" if found.used else "the readings are not used, the bands are those without"
        text = (
            f"only about {found.effective:.0f} of {draws_used} draws agree with the readings: {then}; take more "
            "--draws, and check payload and standard errors"
        )
        out.append(Notice("few-draws", text))
    return out


def _unsure_clock(history: History, content: PoseHistoryJson) -> list[Notice]:
    """A notice that poses depend on when the wires' clocks restart."""
    clock = content["clock"]
    largest_mm = max(clock["largest_mm"], clock.get("at_stops_largest_mm", 0.0))
    distance = content["drift"][0]["distance_mm"]
    widths = np.asarray(distance["q95"], float) - np.asarray(distance["q05"], float)
    if not largest_mm > 0.5 * np.max(widths, initial=0.0, where=np.isfinite(widths)):
        return []
    much = f"by up to {short(largest_mm, 3)} mm, more than half of the band"
    if history.hold is None:
        text = f"when the wires' clocks restart matters here: {much}; give a column hold to say it"
    else:
        text = f"clocks of the wires that ran on from hold to hold would move the poses {much}: the test cannot show it"
    return [Notice("clock", text)]


def _dynamics(times_s: Floats, position_m: Floats) -> list[Notice]:
    """Notices that a platform accelerates too much for its inertia to be left out, or faster than any can.

    Parameters
    ----------
    times_s : (t,) array
    position_m : (t, 3) array
    """
    if len(times_s) < 3:
        return []
    share = _accelerations(times_s, position_m) / GRAVITY
    share = np.where(np.isfinite(share), share, 0.0)
    at_once = share > _POSSIBLE
    of_moves = np.where(at_once, 0.0, share)
    out = _timeless(times_s, position_m, at_once) if at_once.any() else []
    k = int(of_moves.argmax())
    if of_moves[k] > _INERTIA:
        text = (
            f"the platform's inertia is left out: at {times_s[k + 1]:.10g} s it takes {short(100 * of_moves[k], 2)} % "
            "of its weight or more to accelerate it, so tensions and poses are those of a slower motion along the same "
            "way"
        )
        out.append(Notice("left-out", text))
    return out


def _timeless(times_s: Floats, position_m: Floats, at_once: Bools) -> list[Notice]:
    """A notice of moves for which the log leaves no time, so that it says nothing of their inertia.

    Parameters
    ----------
    times_s : (t,) array
    position_m : (t, 3) array
    at_once : (t - 2,) bool array
        Rows between the first and the last at which no platform could be accelerated as the rows say.
    """
    step = np.diff(times_s)
    way = np.linalg.norm(np.diff(position_m, axis=0), axis=1)
    speed = np.nan_to_num(way / step)
    before = np.flatnonzero(at_once)
    moves = np.unique(np.where(speed[before] >= speed[before + 1], before, before + 1))
    first = moves[0]
    more = len(moves) - 1
    others = f", and in {counted(more, 'other move')}" if more else ""
    text = (
        f"from {times_s[first]:.10g} s on the log leaves {short(step[first], 2)} s for {short(1e3 * way[first], 2)} mm"
        f"{others}: no platform is so fast, so how long such moves took is not known, and their inertia is left out"
    )
    return [Notice("left-out", text)]


def _accelerations(times_s: Floats, position_m: Floats) -> Floats:
    """(t - 2,) m/s² at the rows between the first and the last: the least that leads through the poses in time.

    Three rows alone say no more than their second difference, which is exact for a steady acceleration however unequal
    the steps. A platform that stands still before or after a move gains or loses the move's speed within the move.
    """
    step = np.diff(times_s)
    velocity = np.diff(position_m, axis=0) / step[:, None]
    change = np.linalg.norm(np.diff(velocity, axis=0), axis=1)
    through = change / (0.5 * (step[1:] + step[:-1]))
    speed = np.linalg.norm(velocity, axis=1)
    is_still_before = np.r_[False, speed[:-1] <= _STILL * speed[1:]]
    is_still_after = np.r_[speed[1:] <= _STILL * speed[:-1], False]
    ends_at_rest = is_still_before.astype(int) + is_still_after.astype(int)
    within = 2.0 * ends_at_rest * speed / step  # from rest to rest: to twice the mean speed in half the time
    return np.fmax(through, np.fmax(within[:-1], within[1:]))

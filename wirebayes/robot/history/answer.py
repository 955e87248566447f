"""What `pose` answers about a history: where the platform was, its drift, and the joint values that bring it back."""

from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Protocol

import numpy as np

from wirebayes.json_files.pose_history import ClockJson, DriftOverTime, HistoryReadings, PoseHistoryJson
from wirebayes.json_files.values import Band, Statistic
from wirebayes.numeric.evenly import evenly
from wirebayes.numeric.means import mean_of_finite
from wirebayes.numeric.typing import Floats, Indices
from wirebayes.progress import Progress, silent
from wirebayes.result_warnings import to_json
from wirebayes.robot.history import commanded, corrections
from wirebayes.robot.history.balanced import balanced, turned_rows
from wirebayes.robot.history.corrections import Target
from wirebayes.robot.history.doubts import history_warnings, unreached
from wirebayes.robot.history.estimate import Estimate, estimate_poses
from wirebayes.robot.history.follow import RESTART, Track, follow_log
from wirebayes.robot.history.history import History, at_every_stop, stated_starts
from wirebayes.robot.history.tables import correction_table, pose_table, rotation_vectors
from wirebayes.robot.history.unknowns import Uncertain, unknowns
from wirebayes.robot.mechanics import rotation as turning
from wirebayes.robot.mechanics import winches
from wirebayes.robot.mechanics.description import Poses, Robot
from wirebayes.robot.mechanics.draws import WireDraws
from wirebayes.robot.mechanics.wires_used import wires_summary
from wirebayes.robot.motion import drift as drifting
from wirebayes.robot.motion.course import Course
from wirebayes.robot.motion.creep import fresh
from wirebayes.robot.pose.answer import unheld
from wirebayes.robot.pose.request import band_over_draws

_SHOWN = 200  # times in pose.json and in pictures; the tables have every row
_CLOCK_DRAWS = 12  # draws that show how much it matters when the wires' clocks start
_NEVER_HELD = "No draw of the wires holds the platform at the first row; see --position for where it starts."


class _Again(Protocol):
    """The same history with few draws, whose clocks restart at a share, or as one says that has holds."""

    def __call__(self, few: WireDraws, restart: float, stated: History | None = None, /) -> Track: ...


@dataclass(frozen=True)
class HistoryAnswer:
    """What was found.

    Attributes
    ----------
    content : dict
        The content of ``pose.json`` (arrays not yet lists).
    tables : dict of file name to (header, rows)
        ``poses.csv`` and ``corrections.csv``.
    rows : (r,) array
        Rows of the history that ``pose.json`` and pictures show.
    found : Estimate or None
        None where no tensions hold the platform.
    to : Target or None
    """

    content: PoseHistoryJson
    tables: dict[str, tuple[list[str], list[list[Any]]]]
    rows: Indices
    found: Estimate | None = None
    to: Target | None = None


def history_report(
    robot: Robot,
    line: WireDraws,
    history: History,
    errors: Uncertain,
    start: Poses,
    seed: int,
    progress: Progress = silent,
) -> HistoryAnswer:
    """Poses over time from measured joint values, or the drift from commanded poses where there are none.

    Parameters
    ----------
    robot : Robot
    line : WireDraws
    history : History
    errors : Uncertain
    start : (3,), (3, 3) arrays
        About where the platform is at the first row, where no pose was commanded.
    seed : int
    progress : function of name, done and total
    """
    asked_rotations, history = history, balanced(robot, history)
    rows = evenly(len(history.times_s), _SHOWN)
    content = _requested(robot, line, history, errors)
    asked = _Asked(robot, history, start, errors, seed)
    try:
        found, joint, again = asked.followed(line, progress)
    except commanded.Unheld as why:
        return HistoryAnswer(_without_answer(robot, content, f"No{str(why)[2:]}."), {}, rows)
    if not found.track.held[:, 0].any():
        return HistoryAnswer(_without_answer(robot, content, _NEVER_HELD), {}, rows)
    to = corrections.target(robot, history, found)
    change = corrections.wanted(robot, history, found, to) - joint
    left = corrections.error_left(robot, history, found, to, _corrected(joint, change), rows)
    of_winches = winches.of_each_winch(robot, change)[:, rows]
    course = _course(history, found, rows)
    content |= {
        "history": content["history"] | {"holds": int(found.track.hold[-1]) + 1},
        "drift": [_drift(robot, course, to, rows, errors.spread)],
        "position_m": _bands(course.position_m),
        "rotation_vector_rad": _bands(rotation_vectors(course.rotation)) if robot.degrees == 6 else None,
        "corrections": {
            "times_s": course.times_s,
            "change_mm": _bands(1e3 * of_winches),
            "left_mm": _bands(1e3 * left),
        },
        "clock": _clock(line, again, history),
    }
    if history.read:
        content["readings"] = _with_agreement(content["readings"], found)
    warnings = unreached(history, found, to, change)
    warnings += turned_rows(robot, asked_rotations, history)
    warnings += history_warnings(robot, line, history, found, joint, content)
    content["warnings"] = to_json(warnings)
    tables = {
        "poses.csv": pose_table(robot, history, found, to),
        "corrections.csv": correction_table(robot, history, joint, change),
    }
    return HistoryAnswer(content, tables, rows, found, to)


@dataclass(frozen=True)
class _Asked:
    """A history of a robot that starts near a pose, with the errors of what was read."""

    robot: Robot
    history: History
    start: Poses
    errors: Uncertain
    seed: int

    @property
    def near(self) -> Poses:
        """Where the first pose is sought: at the commanded one where there is one."""
        history = self.history
        if history.position_m is None or history.rotation is None:
            return self.start
        return history.position_m[0], history.rotation[0]

    def followed(self, line: WireDraws, progress: Progress) -> tuple[Estimate, Floats, _Again]:
        """Poses, joint values, and how to follow once more; `commanded.Unheld` where nothing holds the first pose."""
        robot, history, rng = self.robot, self.history, np.random.default_rng(self.seed)
        if history.joint_m is None:
            found, joint_m = commanded.drift_along(robot, line, history, self.errors, rng, progress)
            return found, joint_m, self._commanded_again
        found = estimate_poses(robot, line, history, self.near, self.errors, rng, progress)
        return found, history.joint_m, partial(self._measured_again, history.joint_m, found)

    def _measured_again(
        self, joint_m: Floats, found: Estimate, few: WireDraws, restart: float, stated: History | None = None
    ) -> Track:
        """With few draws, the same each time, whose clocks start at every hold; once where `restart` is infinite."""
        known = unknowns(self.robot, few, _alike(self.errors), np.random.default_rng(self.seed))
        starts_s = found.starts_s
        if stated is not None:
            starts_s = stated_starts(stated)
        elif np.isinf(restart):
            starts_s = starts_s[:1]
        wires, _ = known.columns(known.draws)
        error_m, _ = known.errors_along(known.draws, found.plain)
        carried = known.carried(known.draws)
        return follow_log(self.robot, wires, self.history, joint_m, self.near, starts_s, error_m, carried=carried)

    def _commanded_again(self, few: WireDraws, restart: float, stated: History | None = None) -> Track:
        """With few draws, the same each time, whose clocks start anew at a share `restart` of the mean tension."""
        rng = np.random.default_rng(self.seed)
        history = stated or self.history
        found, _ = commanded.drift_along(self.robot, few, history, _alike(self.errors), rng, restart=restart)
        return found.track


def _alike(errors: Uncertain) -> Uncertain:
    """No errors that differ between draws: one way of starting the clocks is compared with another."""
    return replace(errors, reference_m=0.0, spread=0.0)


def _corrected(joint_m: Floats, change_m: Floats) -> Floats:
    """Joint values to be set, of which measured ones are the same in every draw."""
    return mean_of_finite(joint_m + change_m) if joint_m.ndim == 2 else joint_m + mean_of_finite(change_m)


def _with_agreement(readings: HistoryReadings, found: Estimate) -> HistoryReadings:
    """What was read, and how well it agrees with what was found."""
    return readings | {
        "misfit": found.misfit,
        "converged": found.converged,
        "effective_draws": found.effective,
        "used": found.used,
    }


def _without_answer(robot: Robot, content: PoseHistoryJson, sentence: str) -> PoseHistoryJson:
    """An answer that ends because nothing holds the platform, and why."""
    return content | {"feasible": False, "sentence": sentence, "warnings": unheld(robot, sentence)}


def _requested(robot: Robot, line: WireDraws, history: History, errors: Uncertain) -> PoseHistoryJson:
    """The history, the robot and the wires."""
    kind = "measured" if history.joint_m is not None else "commanded"
    out: PoseHistoryJson = {
        "version": 1,
        "robot": robot.name,
        "mass_kg": robot.mass_kg,
        "wires": wires_summary(robot, line),
        "feasible": True,
        "warnings": [],
        "history": {
            "kind": kind,
            "rows": len(history.times_s),
            "duration_s": history.times_s[-1] - history.times_s[0],
            "highest_payload_kg": history.payload_kg.max(),
            "restart_share": RESTART if history.hold is None else None,
            "specimen_spread": errors.spread,
        },
    }
    known = errors.calibrated
    if known is not None:
        out["history"]["calibration"] = {
            "holds": len(known.session.duration_s),
            "duration_s": known.session.duration_s.sum(),
            "reference_error_mm": {"mean": 1e3 * known.mean[: robot.legs], "sd": 1e3 * known.reference_sd_m},
        }
    if kind == "measured":
        if known is None:
            out["history"]["reference_sd_mm"] = 1e3 * errors.reference_m
        out["history"]["target"] = "commanded" if history.position_m is not None else "without creep"
    if history.read:
        counts = [0 if v is None else int(np.isfinite(v).sum()) for v in (history.tension_N, history.tilt_rad)]
        out["readings"] = {
            "tensions": counts[0],
            "tilts": counts[1],
            "tension_sd_N": errors.tension_N,
            "tilt_sd_rad": errors.tilt_rad,
        }
    return out


def _course(history: History, found: Estimate, rows: Indices) -> Course:
    """The rows that are shown, as drift from one command is."""
    track = found.track
    status = np.where(track.held[:, rows], 0, 4)
    return Course(
        history.times_s[rows],
        track.position_m[:, rows],
        track.rotation[:, rows],
        track.tension_N[:, rows],
        status,
        fresh(track.tension_N.shape[-1], 1),
    )


def _moved(course: Course, to: Target, rows: Indices) -> tuple[Floats, Floats, Floats]:
    """Displacement ``(n, r, 3)`` m, rotation and tilt ``(n, r)`` rad, each row from its own target."""
    shift = course.position_m - to.position_m[rows]
    angle, tilt = np.empty(shift.shape[:2]), np.empty(shift.shape[:2])
    for i, k in enumerate(rows):
        one = replace(course, position_m=course.position_m[:, [i]], rotation=course.rotation[:, [i]])
        angle[:, i] = drifting.distance_moved(one, to.position_m[k], to.rotation[k])[1][:, 0]
        tilt[:, i] = turning.tilt(course.rotation[:, i], to.rotation[k])
    return shift, angle, tilt


def _drift(robot: Robot, course: Course, to: Target, rows: Indices, spread: float) -> DriftOverTime:
    shift, angle, tilt = _moved(course, to, rows)
    nothing = drifting.are_rounding(shift, angle, robot.span_m)
    shift[nothing], angle[nothing], tilt[nothing] = 0.0, 0.0, 0.0
    return {
        "specimen_spread": spread,
        "times_s": course.times_s,
        "solved": float((course.status == 0).all(1).mean()),
        "held": (course.status == 0).mean(0),
        "displacement_mm": _bands(1e3 * shift),
        "distance_mm": _bands(1e3 * np.linalg.norm(shift, axis=-1)),
        "tilt_deg": _bands(np.degrees(tilt)),
        "from_vertical_deg": _bands(np.degrees(turning.tilt(course.rotation))),
        "rotation_deg": _bands(np.degrees(angle)),
        "tension_N": _bands(course.tension_N),
    }


def _bands(values: Floats) -> Band:
    """Bands at each time of ``(n, r, ...)`` over the draws whose platform still hangs then."""
    each = [band_over_draws(values[:, i]) for i in range(values.shape[1])]
    empty = np.full(values.shape[2:], np.nan)

    def over_time(key: Statistic) -> Floats:
        return np.array([empty if one[key] is None else one[key] for one in each])

    return {
        "mean": over_time("mean"),
        "sd": over_time("sd"),
        "q05": over_time("q05"),
        "q50": over_time("q50"),
        "q95": over_time("q95"),
    }


def _clock(line: WireDraws, run: _Again, history: History) -> ClockJson:
    """How far poses move if the clocks start once and run on, or anew at every stop: no test of holds shows which."""
    few = line.part(evenly(line.count, _CLOCK_DRAWS))
    taken = run(few, RESTART)
    largest_mm, at_the_end_mm = _apart_mm(taken, run(few, np.inf))
    clock: ClockJson = {"largest_mm": largest_mm, "at_the_end_mm": at_the_end_mm}
    stops = at_every_stop(history)
    if stops is not None:
        largest_mm, at_the_end_mm = _apart_mm(taken, run(few, RESTART, stops))
        clock |= {"at_stops_largest_mm": largest_mm, "at_stops_at_the_end_mm": at_the_end_mm}
    return clock


def _apart_mm(one: Track, other: Track) -> tuple[float, float]:
    """The largest distance between two tracks over time, in the median of the draws, and that at the end."""
    apart = np.linalg.norm(one.position_m - other.position_m, axis=-1)
    middle = np.array([np.median(row[np.isfinite(row)]) if np.isfinite(row).any() else np.nan for row in apart.T])
    return 1e3 * float(np.nanmax(middle)), 1e3 * float(middle[-1])

"""Joint values, and tensions and tilts where they were read, to poses with their uncertainty at every row."""

from dataclasses import dataclass, replace

import numpy as np

from wirebayes.numeric.means import mean_of_finite
from wirebayes.numeric.typing import Bools, Floats
from wirebayes.progress import Progress, silent
from wirebayes.robot.history.conditioning import Draws, LogReadings, Mode, draw_posterior, find_mode, slack_wires
from wirebayes.robot.history.follow import Track, clock_starts, errors_at, follow_log, refined_joints
from wirebayes.robot.history.history import History
from wirebayes.robot.history.readings import reading_weight, sensors
from wirebayes.robot.history.unknowns import LogUnknowns, Uncertain, unknowns
from wirebayes.robot.mechanics.description import Poses, Robot
from wirebayes.robot.mechanics.draws import WireDraws
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion.creep import CreepState

_TOO_FEW = 20.0  # effective draws: of fewer, not one lies beyond a 5 % quantile
_NONE = 1e-9  # of a wire's stiffness: it bears nothing, and the equations keep their form


@dataclass(frozen=True)
class Estimate:
    """Poses of ``n`` draws at the rows of a history, and the robot without creep beside them.

    Attributes
    ----------
    track : Track
        The draws.
    plain : Track
        One column: the mean wire, which never creeps; where the same commands lead it.
    wires : Wires
    error_m : (n, w) or (t, n, w) array
        Errors of the reference lengths, or of the lengths at every row.
    starts_s : (s,) array
        Times at which the wires' clocks start.
    misfit : float or None
        Mean squared standardised residual of the readings at the mode; well above one when no wire explains them.
    converged : bool
        Whether the mode was reached, where there were readings.
    effective : float or None
        How many independent draws agree with the readings.
    used : bool
        False where they are too few to give bands: the draws are then those of the joint values alone.
    """

    track: Track
    plain: Track
    wires: Wires
    error_m: Floats
    starts_s: Floats
    misfit: float | None = None
    converged: bool = True
    effective: float | None = None
    used: bool = True

    def error_at(self, row: int) -> Floats:
        """(n, w) errors of the lengths at a row."""
        return errors_at(self.error_m, row)


def estimate_poses(
    robot: Robot,
    line: WireDraws,
    history: History,
    start: Poses,
    errors: Uncertain,
    rng: np.random.Generator,
    progress: Progress = silent,
) -> Estimate:
    """Where the platform was at each row: forward kinematics of creeping wires, with what the sensors say of them.

    Without tensions and tilts every draw of the posterior is followed through the history. With them, the draws are
    those of reference lengths, parameters and specimens given the readings (`conditioning`).

    Parameters
    ----------
    robot : Robot
    line : WireDraws
    history : History
        With joint values.
    start : (3,), (3, 3) arrays
        About where the platform is at the first row.
    errors : Uncertain
    rng : numpy Generator
    progress : function of name, done and total

    Returns
    -------
    Estimate
    """
    known = unknowns(robot, line, errors, rng)
    way = _Way(known, history, start, *plain_track(known, history, start, progress), progress)
    if not history.read:
        return way.followed(known.draws)
    read = LogReadings(log_readings(history, robot.legs), weights(history.times_s), sensors(robot, errors))
    mode = _mode(known, read, way)
    if mode is None or not mode.converged:  # not even the mean wires hang in balance, or no wires explain the readings
        return replace(way.followed(known.draws), converged=False, effective=0.0, used=False)
    out = draw_posterior(lambda: unknowns(robot, line, errors, rng), read, mode, way.white, rng)
    return replace(_used(way, out, line.count), misfit=_misfit(read, out))


def _used(way: "_Way", out: Draws, count: int) -> Estimate:
    """The posterior's draws, or those of the joint values alone where too few of the former are worth anything."""
    used = out.effective >= min(_TOO_FEW, 0.5 * count)
    found = way.estimate(out) if used else way.followed(way.known.draws)
    return replace(found, effective=out.effective, used=used)


def _mode(known: LogUnknowns, read: LogReadings, way: "_Way") -> Mode | None:
    """The mode without the wires that are read as slack, or with all where there is none; None where nothing hangs."""
    loose = slack_wires(read, known.robot.legs)
    mode = find_mode(known, read, way.white, loose)
    return mode or find_mode(known, read, way.white, np.zeros_like(loose))


def _misfit(read: LogReadings, out: Draws) -> float:
    """Mean squared residual of what the draws leave on average; NaN where nothing is left to compare."""
    left = mean_of_finite(read.residual(out.track, np.zeros_like(out.white)))
    squares = (left / read.of.sd) ** 2
    if not np.isfinite(squares).any():
        return np.nan
    return float(np.nanmean(squares))


def log_readings(history: History, legs: int) -> Floats:
    """All readings ``(t, w + 2)``: tensions, roll and pitch; NaN where nothing was read."""
    out = np.full((len(history.times_s), legs + 2), np.nan)
    if history.tension_N is not None:
        out[:, :legs] = history.tension_N
    if history.tilt_rad is not None:
        out[:, legs:] = history.tilt_rad
    return out


def weights(times_s: Floats) -> Floats:
    """How many readings the sensors of each row count as, ``(t,)``."""
    return np.array([reading_weight(None)] + [reading_weight(float(since)) for since in np.diff(times_s)])


def plain_track(known: LogUnknowns, history: History, start: Poses, progress: Progress) -> tuple[Track, Floats]:
    """The mean wire, which never creeps, under measured joint values; and when it makes the wires' clocks start.

    Those times do not depend on how finely an even motion was sampled: it is divided where rows are far apart.

    Parameters
    ----------
    known : LogUnknowns
        Holds the robot and the mean wire.
    history : History
        With joint values.
    start : (position, rotation)
        The pose near which the first row's is sought.
    progress : callable
        Called with a name, the rows done and all rows.

    Returns
    -------
    Track
        One column.
    starts_s : (s,) array
        As of `clock_starts`.
    """
    fine, kept = refined_joints(known.robot, history)
    assert fine.joint_m is not None
    rows = len(fine.times_s)
    track = follow_log(
        known.robot,
        known.plain,
        fine,
        fine.joint_m,
        start,
        fine.times_s[:1],
        progress=lambda row: progress("without creep", row + 1, rows),
    )
    return track.at_rows(kept), clock_starts(fine, track.tension_N[0])


@dataclass(frozen=True)
class _Way:
    """What every pass over one history shares."""

    known: LogUnknowns
    history: History
    start: Poses
    plain: Track
    starts_s: Floats
    progress: Progress

    def track(self, wires: Wires, error_m: Floats, carried: CreepState, name: str) -> Track:
        """The platform's way on given wires.

        Parameters
        ----------
        wires : Wires
            n draws.
        error_m : (n, w) or (t, n, w) array
            Errors of the reference lengths, or of the lengths at every row.
        carried : CreepState
        name : str
            For the progress.

        Returns
        -------
        Track
        """
        history, rows = self.history, len(self.history.times_s)
        assert history.joint_m is not None
        return follow_log(
            self.known.robot,
            wires,
            history,
            history.joint_m,
            self.start,
            self.starts_s,
            error_m,
            lambda row: self.progress(name, row + 1, rows),
            carried,
        )

    def white(self, white: Floats, name: str, without: Bools) -> Track:
        """White unknowns followed, some wires without stiffness.

        Parameters
        ----------
        white : (n, d) array
        name : str
            For the progress.
        without : (w,) bool array
            Wires that bear nothing.
        """
        wires, _ = self.known.columns(white)
        error, pull = self.known.errors_along(white, self.plain)
        if without.any():
            stiffness = np.where(without[:, None], _NONE * wires.theta["k1"], wires.theta["k1"])
            wires = replace(wires, theta=dict(wires.theta) | {"k1": stiffness})
        track = self.track(wires, error, self.known.carried(white), name)
        return track.pulled_more(np.where(without, 0.0, pull))

    def followed(self, white: Floats) -> Estimate:
        """White draws followed."""
        track = self.white(white, "poses", np.zeros(self.known.robot.legs, bool))
        return self._estimate(white, track)

    def estimate(self, out: Draws) -> Estimate:
        """Draws of the posterior that were followed."""
        return self._estimate(out.white[:, : self.known.count], out.track)

    def _estimate(self, white: Floats, track: Track) -> Estimate:
        wires, _ = self.known.columns(white)
        error, _ = self.known.errors_along(white, self.plain)
        return Estimate(track, self.plain, wires, error, self.starts_s)

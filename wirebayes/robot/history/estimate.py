"""Joint values, and tensions and tilts where they were read, to poses with their uncertainty at every row."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from wirebayes.robot.history.follow import Track, clock_starts, follow
from wirebayes.robot.history.history import History, roll_and_pitch
from wirebayes.robot.history.readings import Information, Sensors, sensors, weight
from wirebayes.robot.history.unknowns import Uncertain, Unknowns, slopes, unknowns
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.draws import WireDraws
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.typing import Floats

Progress = Callable[[str, float, float], None]
_MOST = 8  # Gauss-Newton passes to the mode
_ASTRAY = 3.0  # posterior sd: a draw that would still have to move so far is none of the posterior
_NEAR = 0.2  # of a posterior sd: nearer to its end, a pass need not be repeated


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
    error_m : (n, w) array
        Errors of the reference lengths.
    misfit : float or None
        Mean squared standardised residual of the readings at the mode; well above one when no wire explains them.
    converged : bool
        Whether the mode was reached, where there were readings.
    """

    track: Track
    plain: Track
    wires: Wires
    error_m: Floats
    misfit: float | None = None
    converged: bool = True


def estimate(
    robot: Robot,
    line: WireDraws,
    history: History,
    start: tuple[Floats, Floats],
    errors: Uncertain,
    rng: np.random.Generator,
    progress: Progress = lambda name, done, total: None,
) -> Estimate:
    """Where the platform was at each row: forward kinematics of creeping wires, with what the sensors say of them.

    Without tensions and tilts every draw of the posterior is followed through the history. With them, Gauss-Newton over
    the whole history finds the mode of reference lengths, parameters and specimens; the draws are moved by what the
    readings say (`readings`), and followed again.

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
    way = _Way(known, history, start, plain_track(known, history, start, progress), progress)
    if not history.read:
        return way.followed(known.draws)
    of = sensors(robot, errors)
    y, counts = readings(history, robot.legs), weights(history.times_s)
    m, d, n = y.shape[1], known.count, line.count
    z, last, cost, found, converged = np.zeros(d + m), np.zeros(d + m), np.inf, None, False
    slope = np.empty(0)
    for number in range(_MOST):
        track = way.track(*known.columns(known.differences(z[:d])), f"mode, pass {number + 1}")
        h = predicted(track)
        left = y - h[0] - of.offset * z[d:]
        new = float(np.nansum(counts[:, None] * (left / of.noise) ** 2) + z @ z) if track.held[0].all() else np.inf
        if not new <= cost:  # no better, or not in balance: go half as far
            z = 0.5 * (z + last)
            continue
        slope = slopes(h)
        found, cost, last = _gathered(of, slope, left[None], counts), new, z
        move = found.moves(-z[None], np.zeros((1, d + m)))[0]
        if _small(move[None], found):
            converged = True
            break
        z = z + move
    if found is None:  # not even the mean wires hang in balance
        return replace(way.followed(known.draws), converged=False)
    noise = rng.standard_normal((n, d + m))
    prior = np.concatenate([known.draws, rng.standard_normal((n, m))], 1)
    draws = last + found.moves(prior - last, noise)
    out = way.followed(draws[:, :d])
    for _ in range(2):  # where the way from the mode was not straight, or a draw left it
        left = y - predicted(out.track) - of.offset * draws[:, None, d:]
        move = _gathered(of, slope, left, counts).moves(prior - draws, noise)
        astray = ~(np.abs(move / found.sd).max(1) < _ASTRAY)
        near = _small(move[~astray], found)
        if near and not astray.any():
            break
        draws = _without(astray, draws if near else draws + move, rng)
        out = way.followed(draws[:, :d])
    misfit = float(np.nanmean((_mean(y - predicted(out.track)) / of.sd) ** 2))
    return replace(out, misfit=misfit, converged=converged)


def _without(astray: NDArray[np.bool_], draws: Floats, rng: np.random.Generator) -> Floats:
    """Draws that contradict the readings (their platform fell, say) replaced by others."""
    good = np.flatnonzero(~astray)
    if not good.size:
        return draws
    return np.asarray(draws[np.where(astray, rng.choice(good, len(draws)), np.arange(len(draws)))])


def _small(move: Floats, found: Information) -> bool:
    return not move.size or bool(np.sqrt(np.mean((move / found.sd) ** 2)) < _NEAR)


def _mean(left: Floats) -> Floats:
    """Mean over the draws ``(n, t, m)`` that hold the platform; NaN where nothing was read."""
    good = np.isfinite(left)
    return np.asarray(np.where(good, left, 0.0).sum(0) / np.where(good.any(0), good.sum(0), np.nan))


def readings(history: History, legs: int) -> Floats:
    """All readings ``(t, w + 2)``: tensions, roll and pitch; NaN where nothing was read."""
    out = np.full((len(history.times_s), legs + 2), np.nan)
    if history.tension_N is not None:
        out[:, :legs] = history.tension_N
    if history.tilt_rad is not None:
        out[:, legs:] = history.tilt_rad
    return out


def predicted(track: Track) -> Floats:
    """What the sensors of every column should read, ``(n, t, w + 2)``."""
    return np.concatenate([track.tension_N, roll_and_pitch(track.rotation)], -1)


def weights(times_s: Floats) -> Floats:
    """How many readings the sensors of each row count as, ``(t,)``."""
    return np.array([weight(None)] + [weight(float(since)) for since in np.diff(times_s)])


def _gathered(of: Sensors, slope: Floats, left: Floats, counts: Floats) -> Information:
    out = Information.none(len(slope), slope.shape[-1], len(left))
    for k, count in enumerate(counts):
        out.add(of, slope[:, k], left[:, k], float(count))
    return out


def plain_track(known: Unknowns, history: History, start: tuple[Floats, Floats], progress: Progress) -> Track:
    """The mean wire, which never creeps, under measured joint values.

    Parameters
    ----------
    known : Unknowns
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
    """
    assert history.joint_m is not None
    rows = len(history.times_s)
    once = history.times_s[:1]
    return follow(known.robot, known.plain, history, history.joint_m, start, once,
                  progress=lambda row: progress("without creep", row + 1, rows))  # fmt: skip


@dataclass(frozen=True)
class _Way:
    """What every pass over one history shares."""

    known: Unknowns
    history: History
    start: tuple[Floats, Floats]
    plain: Track
    progress: Progress

    def track(self, wires: Wires, error_m: Floats, name: str) -> Track:
        """The platform's way on given wires.

        Parameters
        ----------
        wires : Wires
            n draws.
        error_m : (n, w) array
            Errors of the reference lengths.
        name : str
            For the progress.

        Returns
        -------
        Track
        """
        history, rows = self.history, len(self.history.times_s)
        assert history.joint_m is not None
        starts = clock_starts(history, self.plain.tension_N[0])
        return follow(self.known.robot, wires, history, history.joint_m, self.start, starts, error_m,
                      lambda row: self.progress(name, row + 1, rows))  # fmt: skip

    def followed(self, white: Floats) -> Estimate:
        """White draws followed."""
        wires, error = self.known.columns(white)
        return Estimate(self.track(wires, error, "poses"), self.plain, wires, error)

"""Draws of the posterior given tensions and angles: the mode, draws moved there, and what weight each of them has.

Each draw of the prior is moved to where it fits its own readings, with noise of their own ("randomise, then optimise",
Bardsley et al., SIAM J. Sci. Comput. 36, 2014). Where the readings are linear in the unknowns that gives the posterior
itself. Where they are not, a draw has the weight of what linear moves cannot explain: the squared residual that is left
beside its own randomised one. The determinant of the change of slope is left out: it is near one where weights are.

A wire that is read as slack is the worst of it: it is only known to be at least so long, and slopes jump where it gets
taut. The mode is then that of the robot without it, its length is left as the prior has it, and draws that would be
taut lose their weight.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator

from wirebayes.numeric.resampling import systematic_rows
from wirebayes.numeric.typing import Bools, Floats
from wirebayes.robot.history.follow import Track
from wirebayes.robot.history.history import roll_and_pitch
from wirebayes.robot.history.readings import Information, Sensors
from wirebayes.robot.history.unknowns import LogUnknowns, slopes

Way = Callable[[Floats, str, Bools], Track]  # of white unknowns (n, d), a name for the progress, no wires
_MOST = 12  # passes to the mode; four or five are usual
_PASSES = 5  # to move the draws; two or three are usual
_NEAR = 0.2  # posterior sd, in whatever direction it is largest: less than a band of 200 draws can show
_SLACK = 3.0  # standard errors of a tension: nearer to zero, a wire may be slack
_BATCHES = 4  # at most, of as many draws, where weights differ
_ENOUGH = 0.5  # effective share of the draws from which on another batch is not worth its time


@dataclass(frozen=True)
class LogReadings:
    """What was read.

    Attributes
    ----------
    values : (t, m) array
        Tensions, roll and pitch; NaN where nothing was read.
    counts : (t,) array
        How many readings those of a row count as.
    of : Sensors
    """

    values: Floats
    counts: Floats
    of: Sensors

    def residual(self, track: Track, white: Floats) -> Floats:
        """What unknowns with the sensors' offsets, ``(n, d + m)``, leave of the readings, ``(n, t, m)``."""
        first = white.shape[1] - len(self.of.offset)
        offset = white[:, None, first:] * self.of.offset
        return self.values - predicted_readings(track) - offset

    def cost(self, residual: Floats, white: Floats) -> Floats:
        """Twice the negative log of the posterior density, ``(n,)``; infinite where a platform fell that was read."""
        scaled = self.counts[:, None] * (residual / self.of.error) ** 2
        squares = np.nansum(scaled, (1, 2)) + (white**2).sum(1)
        return np.where(self.missed(residual), np.inf, squares)

    def missed(self, residual: Floats) -> Bools:
        """(n,) Which platforms had fallen when they were read."""
        return np.asarray((np.isnan(residual) & np.isfinite(self.values)).any((1, 2)))

    def gathered(self, slope: Floats, residual: Floats) -> Information:
        """All rows' information about unknowns and offsets."""
        out = Information.none(len(slope), slope.shape[-1], len(residual))
        for k, count in enumerate(self.counts):
            out.add(self.of, slope[:, k], residual[:, k], float(count))
        return out


@dataclass(frozen=True)
class Mode:
    """Where the posterior is highest.

    Attributes
    ----------
    white : (d + m,) array
    slope : (d, t, m) array
        Of the predicted readings there.
    found : Information
        Of one draw that is there.
    converged : bool
    """

    white: Floats
    slope: Floats
    found: Information
    converged: bool


@dataclass(frozen=True)
class Draws:
    """Draws of the posterior, all of the same weight.

    Attributes
    ----------
    white : (n, d + m) array
    track : Track
    effective : float
        How many independent draws they are worth; 0 where none agrees with its readings.
    """

    white: Floats
    track: Track
    effective: float


def predicted_readings(track: Track) -> Floats:
    """What the sensors of every column should read, ``(n, t, w + 2)``."""
    return np.concatenate([track.tension_N, roll_and_pitch(track.rotation)], -1)


def slack_wires(read: LogReadings, legs: int) -> Bools:
    """Wires ``(w,)`` that all readings say are slack, as far as a sensor can tell."""
    tension = read.values[:, :legs]
    loose = ~(tension > _SLACK * read.of.sd[:legs]) & np.isfinite(tension).any(0)
    return np.asarray(loose.all(0))


def find_mode(known: LogUnknowns, read: LogReadings, way: Way, without: Bools) -> Mode | None:
    """The mode by Gauss-Newton; None where mean wires do not hold the platform.

    Parameters
    ----------
    known : LogUnknowns
    read : LogReadings
    way : function of white unknowns (n, d), a name, and wires that are left out
    without : (w,) bool array
        Wires that are left out.
    """
    d = known.count
    size = d + len(read.of.offset)
    z, last = np.zeros(size), np.zeros(size)
    cost, best = np.inf, None
    for number in range(_MOST):
        columns = known.differences(z[:d])
        track = way(columns, f"mode, pass {number + 1}", without)
        predicted = predicted_readings(track)
        missed = read.values - predicted[0] - read.of.offset * z[d:]
        residual = missed[None]
        new = np.inf
        if track.held[0].all():
            new = float(read.cost(residual, z[None])[0])
        if not new <= cost:  # no better, or not in balance: go half as far
            z = 0.5 * (z + last)
            continue
        cost, last = new, z
        slope = slopes(predicted)
        found = read.gathered(slope, residual)
        move = found.moves(-z[None], None)
        near = bool(_length(move, found)[0] < _NEAR)
        best = Mode(z, slope, found, near)
        if near:
            break
        z = z + _within_reach(known, z, move[0])
    return best


def _within_reach(known: LogUnknowns, white: Floats, move: Floats) -> Floats:
    """A move ``(d + m,)``, shortened to end where its wires are still some that there may be."""
    d = known.count
    here = known.root @ white[:d]
    onward = known.root @ move[:d]
    room = known.reach - np.sign(onward) * here
    share = room / np.maximum(np.abs(onward), 1e-300)
    return move * float(np.clip(share.min(initial=1.0), 0.0, 1.0))


def draw_posterior(known: Callable[[], LogUnknowns], read: LogReadings, mode: Mode, way: Way, rng: Generator) -> Draws:
    """Draws of the posterior: moved from draws of the prior, weighted, and drawn again by their weights.

    Parameters
    ----------
    known : function
        Gives the unknowns with new draws of the prior.
    read : LogReadings
    mode : Mode
    way : function of white unknowns (n, d), a name, and wires that are left out
    rng : numpy Generator
    """
    white, tracks, logs = [], [], []
    for _ in range(_BATCHES):
        prior = known().draws
        n = len(prior)
        batch = _moved(prior, read, mode, way, rng)
        white.append(batch.white)
        tracks.append(batch.track)
        logs.append(batch.log_weight)
        share, effective = _shares(np.concatenate(logs))
        if effective >= _ENOUGH * n:
            break
    if not effective:
        return Draws(white[0], tracks[0], 0.0)
    pick = systematic_rows(share, n, rng)
    picked = np.concatenate(white)[pick]
    track = _joined(tracks).part(pick)
    return Draws(picked, track, min(effective, float(n)))


def _shares(logs: Floats) -> tuple[Floats, float]:
    """Normalised weights of their logarithms, and how many equal ones they are worth."""
    if not np.isfinite(logs).any():
        return np.zeros(len(logs)), 0.0
    weight = np.exp(logs - logs.max())
    share = weight / weight.sum()
    return share, float(1.0 / (share**2).sum())


@dataclass(frozen=True)
class _Batch:
    """Draws ``(n, d + m)`` that fit readings of their own, their way, and the logarithms of their weights."""

    white: Floats
    track: Track
    log_weight: Floats


def _moved(prior: Floats, read: LogReadings, mode: Mode, way: Way, rng: Generator) -> _Batch:
    """Draws of the prior, moved until each fits its own readings."""
    n, d = prior.shape
    every = np.zeros(1, bool)
    noise = rng.standard_normal((n, len(mode.white)))
    offsets = rng.standard_normal((n, len(read.of.offset)))
    prior = np.concatenate([prior, offsets], 1)
    draws = _linear_draws(prior, mode, noise)
    track = way(draws[:, :d], "poses", every)
    todo = np.ones(n, bool)
    before = np.full(n, np.inf)
    for number in range(_PASSES):
        residual = read.residual(track, draws)
        found = read.gathered(mode.slope, residual)
        move = found.moves(prior - draws, noise)
        length = _length(move, found)
        size = np.where(read.missed(residual), np.inf, length)
        todo &= (size > _NEAR) & (size < before)  # one that goes astray is left where it is
        before = size
        if number == _PASSES - 1 or not todo.any():
            break
        draws[todo] += move[todo]
        moved = way(draws[todo, :d], "poses", every)
        track = track.with_columns(todo, moved)
    weight = _log_weight(read, draws, residual, found)
    near = size <= _NEAR
    return _Batch(draws, track, np.where(near, weight, -np.inf))


def _linear_draws(prior: Floats, mode: Mode, noise: Floats) -> Floats:
    """Draws of the posterior, were readings straight about the mode."""
    of_each = np.tile(mode.found.vector, (len(prior), 1))
    about = replace(mode.found, vector=of_each)
    return mode.white + about.moves(prior - mode.white, noise)


def _log_weight(read: LogReadings, draws: Floats, residual: Floats, found: Information) -> Floats:
    """(n,) of what linear moves cannot explain."""
    explained = _length(found.moves(-draws, None), found) ** 2
    return -0.5 * (read.cost(residual, draws) - explained)


def _length(move: Floats, found: Information) -> Floats:
    """Length of moves ``(n, d + m)`` in posterior standard deviations, whatever their direction."""
    precision = found.matrix + np.eye(move.shape[1])
    return np.sqrt(np.einsum("ni,ij,nj->n", move, precision, move))


def _joined(tracks: list[Track]) -> Track:
    """The columns of all."""
    joined = {}
    for name in ("position_m", "rotation", "tension_N", "strain"):
        joined[name] = np.concatenate([getattr(track, name) for track in tracks])
    return replace(tracks[0], **joined)

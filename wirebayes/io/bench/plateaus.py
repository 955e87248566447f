"""A continuous recording divided into holds: where what is set stays constant, between moves.

The setting is divided where its mean changes most, repeatedly (binary segmentation), until no division explains
more than noise would. Neighbours at one level are joined; segments that are short or sloping are moves.
"""

from dataclasses import dataclass

import numpy as np

from wirebayes.numeric.typing import Floats

PENALTY = 4.0  # times the log of the readings: noise alone is then split less often than once in a hundred recordings
SAME_LEVEL = 2.0  # noise levels between neighbours that are one hold
LEAN = 3.0  # noise levels of drift along a hold; a piece of a move leans by more
STAIRS = 0.5  # of the way to the pieces beside it: pieces of a slow move lean by all of it
EDGE = 5  # readings averaged at either end of a hold, to see a move that noise hides
ARRIVED = 2.5  # standard errors of that mean from the level of the hold: nearer is at rest
LONG = 10  # times the edge: a hold of more readings can spare some at its end, where the next move may have begun
RANGE_SHARE = 0.0025  # of the whole range: no bench that is read holds better, and settling is no step
SHORTEST_SHARE = 0.05  # of the usual hold: shorter ones are pauses of a move
FEWEST = 3  # readings of a hold


@dataclass(frozen=True)
class Plateau:
    """A stretch of a recording at one displacement.

    Attributes
    ----------
    begin, end : int
        First reading, and the one after the last.
    level : float
    left : int
        The reading at which the next move may begin: a few after `end`, which are not trusted.
    """

    begin: int
    end: int
    level: float
    left: int


def plateaus(x: Floats, time: Floats, step: float, shortest: float = SHORTEST_SHARE) -> list[Plateau]:
    """Where the setting stays.

    Parameters
    ----------
    x : (r,) array
        What was set: the displacement, or the tension.
    time : (r,) array
        Rising.
    step : float
        To which settings are written; 0 where it is not known.
    shortest : float
        Share of the usual duration below which a stretch is a pause of a move.

    Returns
    -------
    list of Plateau
        In order; empty where the displacement never stays.
    """
    noise = noise_of(x, step)
    scatter = scatter_of(x, step)
    if noise == 0.0:
        return []
    bounds = _split(x / noise)
    pieces = _joined(bounds, x, noise)
    durations, counts = [], []
    for begin, end in pieces:
        durations.append(time[end - 1] - time[begin])
        counts.append(end - begin)
    # seen over readings, most are of long holds: moves have few
    usual = float(np.median(np.repeat(durations, counts)))
    found = []
    for piece, lasts, apart in zip(pieces, durations, _steps_beside(x, pieces), strict=True):
        begin, end = piece
        if end - begin < FEWEST:
            continue
        most_drift = min(LEAN * noise, STAIRS * apart)
        if _drift(x[begin:end]) > most_drift:
            continue
        hold = _at_rest(x, piece, scatter)
        if hold is not None and lasts >= shortest * usual:
            found.append(hold)
    return found


def _steps_beside(x: Floats, pieces: list[tuple[int, int]]) -> Floats:
    """How far the level of each piece is from those beside it, in the mean; zero for an only piece."""
    if len(pieces) == 1:
        return np.zeros(1)
    levels = [np.median(x[begin:end]) for begin, end in pieces]
    steps = np.abs(np.diff(levels))
    padded = np.pad(steps, 1, mode="edge")
    return 0.5 * (padded[:-1] + padded[1:])


def _at_rest(x: Floats, piece: tuple[int, int], scatter: float) -> Plateau | None:
    """The hold in a piece, without the ends of the moves beside it, seen or hidden in the noise; None if little is."""
    begin, left = _trimmed(x, *piece, scatter)
    end = left
    if left - begin > LONG * EDGE:
        end -= _hidden(x, begin, left, scatter)
    if end - begin < FEWEST:
        return None
    return Plateau(begin, end, float(np.median(x[begin:end])), left)


def scatter_of(x: Floats, step: float) -> float:
    """Standard deviation of a displacement that mostly stays: from its changes, at least that of its rounding."""
    changes = np.abs(np.diff(x))
    return max(float(np.median(changes)) / (0.6745 * np.sqrt(2.0)) if len(changes) else 0.0, step / np.sqrt(12.0))


def noise_of(x: Floats, step: float) -> float:
    """What a displacement may change by and still count as the same: its scatter, or a share of its range."""
    return max(scatter_of(x, step), RANGE_SHARE * float(np.ptp(x)))


def _split(x: Floats) -> list[int]:
    """Where means change, in noise levels: boundaries, the first 0 and the last the number of readings."""
    n = len(x)
    total = np.concatenate([[0.0], np.cumsum(x - x.mean())])
    worth = PENALTY * np.log(n)
    bounds = {0, n}
    todo = [(0, n)]
    while todo:
        begin, end = todo.pop()
        count = end - begin
        if count < 2:
            continue
        left = np.arange(1, count)
        right = count - left
        rise = total[end] - total[begin]
        risen = total[begin + 1 : end] - total[begin]
        away = risen - left * rise / count
        gain = away**2 * count / (left * right)
        best = int(gain.argmax())
        if gain[best] > worth:
            middle = begin + 1 + best
            bounds.add(middle)
            todo.append((begin, middle))
            todo.append((middle, end))
    return sorted(bounds)


def _joined(bounds: list[int], x: Floats, noise: float) -> list[tuple[int, int]]:
    """Pieces between the bounds, neighbours at one level joined, the nearest first."""
    pieces = list(zip(bounds[:-1], bounds[1:], strict=True))
    levels = [float(np.median(x[begin:end])) for begin, end in pieces]
    while len(pieces) > 1:
        apart = np.abs(np.diff(levels))
        i = int(apart.argmin())
        if apart[i] > SAME_LEVEL * noise:
            break
        pieces[i : i + 2] = [(pieces[i][0], pieces[i + 1][1])]
        levels[i : i + 2] = [float(np.median(x[slice(*pieces[i])]))]
    return pieces


def _trimmed(x: Floats, begin: int, end: int, scatter: float) -> tuple[int, int]:
    """A piece without the ends of the moves beside it: from the first few readings at its level to the last few."""
    edge = min(EDGE, end - begin)
    piece = x[begin:end]
    off = piece - np.median(piece)
    means = np.convolve(off, np.full(edge, 1.0 / edge), "valid")
    level = np.abs(means) <= _away(x, scatter / np.sqrt(edge))
    alone = np.abs(off) <= _away(x, scatter)  # where there is little noise, the mean is not as sharp
    first = np.flatnonzero(level & alone[: len(level)])
    last = np.flatnonzero(level & alone[edge - 1 :])
    if not len(first) or not len(last):
        return begin, begin
    return begin + int(first[0]), begin + int(last[-1]) + edge


def _away(x: Floats, error: float) -> float:
    """How far from its hold a displacement with this error may be and still count as at rest."""
    return SAME_LEVEL * RANGE_SHARE * float(np.ptp(x)) + ARRIVED * error


def _hidden(x: Floats, begin: int, end: int, scatter: float) -> int:
    """Readings at the end of a hold in which the next move may have begun: the slower it is, the more."""
    later = x[end : end + EDGE]
    speed = abs(later[-1] - np.median(x[begin:end])) / EDGE if len(later) == EDGE else 0.0
    unseen = 2.0 * _away(x, scatter)  # as far again, for a move that gains speed
    return int(np.ceil(unseen / speed)) if EDGE * speed > unseen else EDGE


def _drift(x: Floats) -> float:
    """How much a straight line through it rises or falls."""
    place = np.arange(len(x)) - 0.5 * (len(x) - 1)
    return float(abs(place @ x) / (place @ place) * (len(x) - 1))

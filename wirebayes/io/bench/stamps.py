"""Clocks too coarse for their rate: readings that share a time stamp are spread over the time to the next one."""

import numpy as np

from wirebayes.io.bench.table import RawTable
from wirebayes.numeric.typing import Bools, Floats, Ints
from wirebayes.sentences import short

TICKS_S = (0.001, 0.01, 0.1, 1.0, 60.0)  # what clocks count; rarer stamps are a person's, or a test's own steps
FEWEST = 10  # stamps between the first and the last that show a habit
OFTEN = 1.5  # readings of the usual stamp: fewer repeat now and then, by mistake
ALIKE, ALIKE_SHARE = 0.2, 0.9  # stamps have as many readings to a fifth, or to one, but where a recording pauses
RISING_SHARE = 0.9  # of the stamps that rise do so by one tick, for the same reason
IN_TURN = 0.5  # of the pairs of stamps with the same cells in the same order: by chance there are few


def is_coarse(table: RawTable, column: int) -> bool:
    """Whether the stamps of a column repeat regularly.

    Not where cells of another column come back in the same order under each stamp: then channels take turns, or the
    column counts what the stamps leave out.
    """
    cells = table.column(column)
    begins = _begins(cells)
    counts = np.diff(begins)[1:]  # the first and the last may be cut off
    if len(counts) < FEWEST:
        return False
    usual = float(counts.mean())
    if usual < OFTEN:
        return False
    alike = np.abs(counts - usual) <= max(1.0, ALIKE * usual)
    if alike.mean() < ALIKE_SHARE:
        return False
    for other in range(len(table.header)):
        if other != column and _takes_turns(table.column(other), begins):
            return False
    return True


def _begins(cells: list[str]) -> Ints:
    """The rows with another stamp than the one before, and the first."""
    changes = [i for i in range(1, len(cells)) if cells[i] != cells[i - 1]]
    return np.array([0, *changes])


def _runs(changes: Bools) -> Ints:
    return np.concatenate([[0], np.flatnonzero(changes)])


def _takes_turns(cells: list[str], begins: Ints) -> bool:
    under = [cells[begin:end] for begin, end in zip(begins[1:-1], begins[2:], strict=True)]
    same = sum(a == b and len(set(a)) > 1 for a, b in zip(under, under[1:], strict=False))
    return same > IN_TURN * (len(under) - 1)


def spread(time_s: Floats) -> tuple[Floats, list[str]]:
    """Times of readings whose stamps repeat: those of one stamp evenly from it to the next, one tick later.

    Returns
    -------
    time_s : (r,) array
        As it was where stamps do not mostly follow each other by a clock's tick.
    notes : list of str
    """
    n = len(time_s)
    is_new = np.concatenate([[False], np.diff(time_s) != 0])
    begins = _runs(is_new)
    steps = np.diff(time_s[begins])
    tick = _tick(steps)
    if tick is None:
        return time_s, []
    counts = np.diff(np.append(begins, n))
    usual = float(np.mean(counts[1:-1]))
    followed = np.append(_are(steps, tick), False)
    # a stamp after which the recording pauses or ends may lack readings at its end
    complete = np.maximum(counts, round(usual))
    places = np.where(followed, counts, complete)
    within = np.arange(n) - np.repeat(begins, counts)
    since_stamp = tick * within / np.repeat(places, counts)
    stamped = f"each time stamp, of {tick:g} s, is that of {short(usual, 2)} readings"
    return time_s + since_stamp, [f"{stamped}: they are spread evenly up to the next one"]


def _tick(steps_s: Floats) -> float | None:
    """What a clock counts by whose stamps follow each other after these steps; None where they mostly do not by one."""
    rising = steps_s[steps_s > 0]  # it falls where a hold begins at 0 again
    for tick in TICKS_S:
        if _are(rising, tick).sum() >= RISING_SHARE * len(rising):
            return tick
    return None


def _are(steps_s: Floats, tick_s: float) -> Bools:
    return np.isclose(steps_s, tick_s, rtol=1e-4)

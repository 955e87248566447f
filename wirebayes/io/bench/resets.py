"""Pieces of a continuous recording whose logger was reset: joined where what was set goes on."""

from dataclasses import replace

import numpy as np

from wirebayes.io.bench.plateaus import EDGE, SAME_LEVEL, noise_of
from wirebayes.io.bench.recorded import Readings, is_continuous, restarts, wanders


def joined_at_resets(readings: Readings) -> tuple[Readings, list[str]]:
    """A continuous recording whose logger was reset, as one piece: where time starts again and the setting goes on.

    Raises
    ------
    InputError
        The setting does not go on.
    """
    resets = np.flatnonzero(restarts(readings))
    if not len(resets):
        return readings, []
    x, time = readings.setting, readings.time_s.copy()
    pieces = np.split(np.arange(len(x)), resets)
    if not is_continuous(pieces) or not wanders(x, pieces):
        return readings, []
    steps = np.diff(time)
    interval = float(np.median(steps[steps > 0]))
    notes = []
    for row in resets.tolist():
        before_s, begin_s = time[row - 1], time[row]
        if not _goes_on(readings, row):
            found = f"{begin_s:g} s after {before_s:g} s, and {x[row]:g} {readings.unit} after {x[row - 1]:g}"
            expected = "a recording in one piece: shift the times from here on, or import each piece for itself"
            raise readings.complain(row, "time", found, expected)
        notes.append(
            f"time starts again at {_line(readings, row)}, where the {readings.role} goes on: the pieces are joined "
            "as if the recording had not paused"
        )
        time[row:] += before_s + interval - begin_s
    return replace(readings, time_s=time), notes


def _goes_on(readings: Readings, row: int) -> bool:
    """Whether the setting after a reset is that before it."""
    x = readings.setting
    before = np.median(x[max(0, row - EDGE) : row])
    after = np.median(x[row : row + EDGE])
    return bool(abs(after - before) <= SAME_LEVEL * noise_of(x, readings.step))


def _line(readings: Readings, row: int) -> str:
    """The line of the file that a reading stands in."""
    complaint = str(readings.complain(row, "time", "", ""))
    place = complaint.partition(": found")[0].partition(", ")[2]
    return place.partition(",")[0]

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
    x, time = readings.setting, readings.time_s
    pieces = np.split(np.arange(len(x)), resets)
    if not len(resets) or not is_continuous(pieces) or not wanders(x, pieces):
        return readings, []
    interval = float(np.median(np.diff(time)[np.diff(time) > 0]))
    time, notes = time.copy(), []
    for row in resets:
        before, after = x[max(0, row - EDGE) : row], x[row : row + EDGE]
        if abs(np.median(after) - np.median(before)) > SAME_LEVEL * noise_of(x, readings.step):
            found = f"{time[row]:g} s after {time[row - 1]:g} s, and {x[row]:g} {readings.unit} after {x[row - 1]:g}"
            expected = "a recording in one piece: shift the times from here on, or import each piece for itself"
            raise readings.complain(int(row), "time", found, expected)
        place = str(readings.complain(int(row), "time", "", "")).partition(": found")[0].partition(", ")[2]
        notes.append(
            f"time starts again at {place.partition(',')[0]}, where the {readings.role} goes on: the pieces are joined "
            "as if the recording had not paused"
        )
        time[row:] += time[row - 1] + interval - time[row]
    return replace(readings, time_s=time), notes

"""Cycles of loading and unloading in a recording, as a preconditioning makes them: what the wire creeps under them.

They become a hold that was not recorded. The wire creeps as much as at their mean, to first order in the duration of
one of them beside the time that the creep takes.
"""

import numpy as np

from wirebayes.io.bench.recorded import Cycles, Readings
from wirebayes.io.readings import HANGS_FREE
from wirebayes.numeric.typing import Floats
from wirebayes.sentences import lasting, short

DEPARTS = 0.05  # of the range of the cycles: nearer to where the wire was before them it still rests there
TAUT = 0.05  # of the largest reading: at less, an unloaded wire pulls with next to nothing however far it is let go


def cycles_before(readings: Readings, before_hold: int, left: int, turn: int, end_s: float) -> Cycles:
    """The cycles between two readings.

    Parameters
    ----------
    readings : Readings
    before_hold : int
        Its number.
    left, turn : int
        The last reading before what lies between the holds, and the one at which the last move to this hold began.
    end_s : float
        When that move was half made: until then the wire counts as where it turned.
    """
    x = readings.setting[left : turn + 1]
    low = float(x.min())
    high = float(x.max())
    begin = left + _departure(x)
    begin_s = float(readings.time_s[begin])
    setting = _equivalent(readings, begin, turn, end_s)
    role, unit = readings.role, readings.unit
    if role == "tension":
        setting = max(setting, HANGS_FREE * high)
    lasts = lasting(end_s - begin_s)
    sentence = (
        f"before hold {before_hold} the {role} went to and fro between {short(low, 4)} and {short(high, 4)} {unit} for "
        f"{lasts}: what the wire crept meanwhile is that of a hold without readings at {short(setting, 4)} {unit}, "
        "where it first pulled as in the mean of the cycles"
    )
    rounded = float(f"{setting:.6g}")
    return Cycles(before_hold, rounded, begin_s, end_s, sentence)


def _departure(x: Floats) -> int:
    """The last reading at which the wire is still where it was at the first one."""
    away = np.abs(x - x[0])
    departed = int((away > DEPARTS * np.ptp(x)).argmax())
    return max(departed - 1, 0)


def _equivalent(readings: Readings, begin: int, turn: int, end_s: float) -> float:
    """The setting at which the wire pulls as in the mean of the cycles; of tensions their mean.

    Displacements at which it pulls with nothing are alike, so their own mean says too little.
    """
    rows = slice(begin, turn + 1)
    time = np.append(readings.time_s[rows], end_s)
    setting = _mean(readings.setting[rows], time)
    read = readings.read[rows]
    taut = read > TAUT * read.max()
    first = taut & (np.arange(len(read)) <= read.argmax())  # before it crept: the hold begins so, too
    if readings.role == "tension" or first.sum() < 2 or np.ptp(read[first]) == 0.0:
        return setting
    slope, at_zero = np.polyfit(read[first], readings.setting[rows][first], 1)
    return float(at_zero + slope * _mean(read, time))


def _mean(values: Floats, time_s: Floats) -> float:
    """The mean over time (r + 1,) of values (r,), the last of which stays until the end."""
    stays = np.append(values, values[-1])
    return float(np.trapezoid(stays, time_s) / (time_s[-1] - time_s[0]))

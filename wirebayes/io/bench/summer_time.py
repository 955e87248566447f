"""Clocks on the wall that are put forward by an hour in spring and back in autumn, amid a recording."""

from collections.abc import Sequence

import numpy as np

from wirebayes.numeric.typing import Floats

_HOUR = 3600.0
_DAY_HOURS = 24  # of a clock that goes round once a day
_LAST_HOUR = 3  # of the night: no country leaves out a later one
_OFTEN = 0.1 * _HOUR  # between readings around the change: where they are farther apart an hour may just have passed
_PASSED = 4.0  # times the longest step beside it: a move to the next hold takes longer than one between readings
_BESIDE = 2  # steps before and after


def without_summer_time(wall_s: Floats, lines: Sequence[int]) -> tuple[Floats, list[str]]:
    """Times as a clock shows them that is left alone, and what was done about one that was put forward or back.

    Parameters
    ----------
    wall_s : (r,) array
        What the clock shows, counted on over midnights.
    lines : sequence of int
        Of the file, one a row.
    """
    steps = np.diff(wall_s, prepend=wall_s[0])
    out, notes = wall_s, []
    falls = np.flatnonzero(steps < 0.0)
    if len(falls) == 1 and _is_the_change(steps, int(falls[0]), -_HOUR):
        row = int(falls[0])
        out = out + _HOUR * (np.arange(len(out)) >= row)
        notes.append(f"the clock is put back by an hour at line {lines[row]}: an hour is added to times from there on")
    leaps = [row for row in np.flatnonzero(steps > _HOUR).tolist() if _is_the_change(steps, row, _HOUR)]
    if len(leaps) == 1 and _leaves_out_an_hour_of_the_night(wall_s, leaps[0]):
        row = leaps[0]
        out = out - _HOUR * (np.arange(len(out)) >= row)
        notes.append(
            f"the clock is put forward by an hour at line {lines[row]}, as where summer time begins: an hour is taken "
            "from times from there on; if nothing was read in that hour, write times with their offset from UTC"
        )
    return out, notes


def _is_the_change(steps: Floats, row: int, change_s: float) -> bool:
    """Whether a step (r,) is like those beside it but for a change of the clock."""
    beside = np.concatenate([steps[max(1, row - _BESIDE) : row], steps[row + 1 : row + 1 + _BESIDE]])
    longest = beside.max(initial=0.0)
    passed = steps[row] - change_s
    return bool(0.0 < longest <= _OFTEN and 0.0 < passed <= _PASSED * longest)


def _leaves_out_an_hour_of_the_night(wall_s: Floats, row: int) -> bool:
    """Whether the full hour between a reading and the one before, of (r,), is one that clocks leave out in spring."""
    before, after = (int(wall_s[i] // _HOUR) for i in (row - 1, row))
    return after == before + 2 and (before + 1) % _DAY_HOURS <= _LAST_HOUR

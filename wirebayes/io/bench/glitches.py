"""Single rows in which what was set is far off and what was read is not: misprints, and glitches of an encoder."""

import numpy as np

from wirebayes.io.bench.recorded import Readings
from wirebayes.io.bench.table_numbers import Recorded
from wirebayes.numeric.typing import Floats, Ints
from wirebayes.sentences import counted
from wirebayes.wire.protocol import Control

_OFF = 0.1  # of the range of all settings, at least: smaller ones may be scatter
_SCATTERS = 20.0  # times the median difference between rows
_BACK = 0.05  # of how far it is off: so near are the rows before and after to each other
_FOLLOWS = 0.2  # of what a wire would show that was moved so far: less is none that was


def without_glitches(recorded: Recorded, control: Control, drop_breaks: bool) -> tuple[Recorded, list[str]]:
    """The readings without rows whose setting alone is far off.

    Parameters
    ----------
    recorded : Recorded
    control : {"displacement", "force"}
        What was set.
    drop_breaks : bool
        Whether such rows are to be left out.

    Returns
    -------
    Recorded, list of str
        And how many were left out, in a sentence.

    Raises
    ------
    InputError
        There are such rows, and they are not to be left out.
    """
    readings = recorded.readings(control)
    rows = glitches(readings.setting, readings.read)
    if not len(rows):
        return recorded, []
    if not drop_breaks:
        raise _misprint(readings, int(rows[0]))
    kept = np.setdiff1d(np.arange(len(readings.setting)), rows)
    line = recorded.table.line_text(recorded.table.rows[rows[0]].line)
    note = f"left out: {counted(len(rows), 'row')} in which the {readings.role} alone is far off, from line {line} on"
    return recorded.of_rows(kept), [note]


def glitches(setting: Floats, read: Floats) -> Ints:
    """The rows in which a setting is far from that of the rows round it, which agree, while the reading is not.

    Parameters
    ----------
    setting, read : (r,) array

    Returns
    -------
    (g,) array of int
    """
    if len(setting) < 3:
        return np.empty(0, dtype=np.int64)
    before, own, after = setting[:-2], setting[1:-1], setting[2:]
    off = np.abs(own - 0.5 * (before + after))
    back = np.abs(after - before) <= _BACK * off
    suspect = 1 + np.flatnonzero(back & (off > _SCATTERS * np.median(np.abs(np.diff(setting)))))
    others = np.setdiff1d(np.arange(len(setting)), suspect)
    span = float(np.ptp(setting[others]))
    if not len(suspect) or span == 0.0:
        return suspect[:0]
    stiffness = float(np.ptp(read[others])) / span
    moved = np.abs(read[suspect] - 0.5 * (read[suspect - 1] + read[suspect + 1]))
    far = off[suspect - 1] > _OFF * span
    return suspect[far & (moved < _FOLLOWS * stiffness * off[suspect - 1])]


def _misprint(readings: Readings, row: int) -> Exception:
    found = f"{readings.setting[row]:g} {readings.unit} in a single row between {readings.setting[row - 1]:g} and "
    found += f"{readings.setting[row + 1]:g} {readings.unit}, while what was read stays as it was"
    expected = "what was set; correct a misprint, delete the row, or leave all such rows out by --drop-breaks"
    return readings.complain(row, readings.role, found, expected)

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
    none = np.empty(0, dtype=np.int64)
    if len(setting) < 3:
        return none
    off = _off_neighbours(setting)
    apart = np.abs(setting[2:] - setting[:-2])
    back = apart <= _BACK * off
    usual_step = np.median(np.abs(np.diff(setting)))
    alone = back & (off > _SCATTERS * usual_step)
    suspect = 1 + np.flatnonzero(alone)
    if not len(suspect):
        return none
    others = np.setdiff1d(np.arange(len(setting)), suspect)
    span = float(np.ptp(setting[others]))
    if span == 0.0:
        return none
    stiffness = float(np.ptp(read[others])) / span
    off = off[alone]
    moved = _off_neighbours(read)[alone]
    far = off > _OFF * span
    stays = moved < _FOLLOWS * stiffness * off
    return suspect[far & stays]


def _off_neighbours(values: Floats) -> Floats:
    """(r - 2,) how far each value but the first and the last is from the middle of the two beside it."""
    middle = 0.5 * (values[:-2] + values[2:])
    return np.abs(values[1:-1] - middle)


def _misprint(readings: Readings, row: int) -> Exception:
    found = f"{readings.setting[row]:g} {readings.unit} in a single row between {readings.setting[row - 1]:g} and "
    found += f"{readings.setting[row + 1]:g} {readings.unit}, while what was read stays as it was"
    expected = "what was set; correct a misprint, delete the row, or leave all such rows out by --drop-breaks"
    return readings.complain(row, readings.role, found, expected)

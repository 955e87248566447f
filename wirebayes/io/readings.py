"""The strict reader of a readings' CSV: every error names the file, the line and the column.

The format: UTF-8 (a byte-order mark is accepted), one header line with the columns in any order, one reading per line,
fields separated by commas, plain decimal numbers with optional spaces around them, any line ending, blank lines only at
the end. There are no comments and no quotes. A row whose read value is empty says that its hold lasted until then.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import lgamma
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wirebayes.errors import InputError
from wirebayes.numeric.frozen import frozen
from wirebayes.strict.table import Table, read_table
from wirebayes.wire.protocol import Control

REQUIRED = ("hold", "displacement_mm", "time_s", "tension_N")
OPTIONAL = ("temperature_C",)
# the column that is one value a hold, and the one with a value a reading
SET: dict[Control, str] = {"displacement": "displacement_mm", "force": "tension_N"}
READ: dict[Control, str] = {"displacement": "tension_N", "force": "displacement_mm"}

UNIT: dict[str, str] = {"displacement_mm": "mm", "tension_N": "N"}


@dataclass(frozen=True, eq=False)
class Hold:
    """One setting held, with the readings taken there.

    Attributes
    ----------
    number : int or None
        The hold's number in the readings' file; None when it was held but not recorded.
    setting : float
        The displacement in mm, or the tension in N where the tension is set.
    duration_s : float
        Until the last row of the hold, which may be one without a reading.
    time_s, readings : (r,) array
        Time since the hold began and what was read then: tensions in N, or displacements in mm where the tension is
        set. Empty when unrecorded. A protocol without measured values has NaN.
    temperature_C : (r,) array or None
    start_s : float
        Time elapsed before this hold since the first one began.
    control : {"displacement", "force"}
        What is set.
    """

    number: int | None
    setting: float
    duration_s: float
    time_s: NDArray[np.float64]
    readings: NDArray[np.float64]
    temperature_C: NDArray[np.float64] | None = None
    start_s: float = 0.0
    control: Control = "displacement"

    @property
    def recorded(self) -> bool:
        """True when the hold has readings."""
        return self.time_s.size > 0

    @property
    def displacement_mm(self) -> Any:
        """The displacement that was set, or the (r,) ones that were read."""
        return self.setting if self.control == "displacement" else self.readings

    @property
    def tension_N(self) -> Any:
        """The (r,) tensions that were read, or the one that was set."""
        return self.readings if self.control == "displacement" else self.setting


def read_readings(path: Path, length_mm: float, control: Control = "displacement") -> tuple[Hold, ...]:
    """Read and check a readings' CSV.

    Parameters
    ----------
    path : Path
    length_mm : float
        Zero-tension length, so that a displacement that leaves no wire is found.
    control : {"displacement", "force"}
        What was set.

    Returns
    -------
    tuple of Hold
        In order of the file, each starting when the one before it ended.

    Raises
    ------
    InputError
        With the file, line, column, what was found and what was expected.
    """
    return readings_of(readings_table(path), length_mm, control)


def readings_table(path: Path) -> Table:
    """A readings' CSV split into fields, not checked any further."""
    return read_table(path, REQUIRED, OPTIONAL)


def readings_of(table: Table, length_mm: float, control: Control = "displacement") -> tuple[Hold, ...]:
    """Check a table of readings, as `read_readings` does.

    Parameters
    ----------
    table : Table
    length_mm : float
        Zero-tension length, so that a displacement that leaves no wire is found.
    control : {"displacement", "force"}
        What was set.
    """
    column = READ[control]
    values = [table.number(row, column) if table.cell(row, column) else np.nan for row in range(len(table.rows))]
    if not np.isfinite(values).any():
        raise table.complain(0, column, "no reading", "at least one")
    holds = tuple(_without_empty(hold) for hold in _holds(table, length_mm, control, values))
    if control == "displacement":
        _check_sign(table, [hold for hold in holds if hold.recorded])
    return holds


def _without_empty(hold: Hold) -> Hold:
    """A hold without its rows of no reading; one without any reading is unrecorded."""
    read = np.isfinite(hold.readings)
    if read.all():
        return hold
    temperature = None if hold.temperature_C is None else frozen(hold.temperature_C[read])
    return replace(
        hold,
        number=hold.number if read.any() else None,
        time_s=frozen(hold.time_s[read]),
        readings=frozen(hold.readings[read]),
        temperature_C=temperature if read.any() else None,
    )


def protocol_columns(control: Control) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Required and optional columns of a protocol to predict."""
    return ("hold", SET[control], "time_s"), (READ[control], *OPTIONAL)


def protocol_table(path: Path, control: Control = "displacement") -> Table:
    """The CSV of a protocol to predict, split into fields: the readings' columns, with what is read optional."""
    return read_table(path, *protocol_columns(control))


def protocol_holds(table: Table, length_mm: float, control: Control = "displacement") -> tuple[Hold, ...]:
    """Check a protocol.

    The column of what is read, when there is one, is filled at most at the first time of a hold; every other
    reading has NaN.

    Parameters
    ----------
    table : Table
    length_mm : float
        Zero-tension length, so that a displacement that leaves no wire is found.
    control : {"displacement", "force"}
        What is set.

    Raises
    ------
    InputError
        As `read_readings`, and where a value stands at a later time of its hold.
    """
    column = READ[control]
    values = [np.nan] * len(table.rows)
    if column in table.header:
        for row in range(len(table.rows)):
            if not table.cell(row, column):
                continue
            values[row] = table.number(row, column)
            if row and table.cell(row, "hold") == table.cell(row - 1, "hold"):
                raise table.complain(row, column, table.cell(row, column), "an empty cell after the hold's first time")
    return _holds(table, length_mm, control, values)


def _holds(table: Table, length_mm: float, control: Control, values: Sequence[float]) -> tuple[Hold, ...]:
    rows = range(len(table.rows))
    set_column = SET[control]
    number = [table.whole(row, "hold") for row in rows]
    setting = [table.number(row, set_column) for row in rows]
    time = [table.number(row, "time_s") for row in rows]
    temperature = _temperatures(table, values)
    displacement = setting if control == "displacement" else values
    first = []
    for row in rows:
        _check_displacement(table, row, displacement[row], length_mm)
        if control == "force" and not setting[row] > 0:
            raise table.complain(row, set_column, table.cell(row, set_column), "a tension above 0 N")
        if time[row] < 0:
            raise table.complain(row, "time_s", table.cell(row, "time_s"), "0 s or later")
        if row and number[row] == number[row - 1]:
            if setting[row] != setting[row - 1]:
                expected = f"{table.cell(row - 1, set_column)} as before in hold {number[row]}"
                raise table.complain(row, set_column, table.cell(row, set_column), expected)
            if time[row] <= time[row - 1]:
                expected = f"a time after {table.cell(row - 1, 'time_s')} s in hold {number[row]}"
                raise table.complain(row, "time_s", table.cell(row, "time_s"), expected)
            continue
        if row and number[row] < number[row - 1]:
            interleaved = " (its rows must stand together)" if number[row] in number[:row] else ""
            expected = f"a hold number above {number[row - 1]}{interleaved}"
            raise table.complain(row, "hold", str(number[row]), expected)
        first.append(row)
    holds, start = [], 0.0
    for begin, end in zip(first, [*first[1:], len(table.rows)], strict=True):
        holds.append(
            Hold(
                number=number[begin],
                setting=setting[begin],
                duration_s=time[end - 1],
                time_s=frozen(time[begin:end]),
                readings=frozen(values[begin:end]),
                temperature_C=None if temperature is None else frozen(temperature[begin:end]),
                start_s=start,
                control=control,
            )
        )
        start += time[end - 1]
    longest = max(hold.time_s.size for hold in holds)
    if len(holds) * longest > MOST:
        found = f"{len(holds)} holds, the longest of {longest} readings"
        expected = f"at most {MOST} as holds times readings of the longest; `wirebayes import` thins a recording"
        raise InputError(f"{table.path}: found {found}, expected {expected}")
    if times_run_on([hold.time_s for hold in holds]) < RUN_ON_CERTAIN:
        expected = f"the time since hold {number[first[1]]} began, not since the test began (0 s at each hold's start)"
        raise table.complain(first[1], "time_s", table.cell(first[1], "time_s"), expected)
    return tuple(holds)


def _temperatures(table: Table, values: Sequence[float]) -> list[float] | None:
    """Logged temperatures, where there is a column of them; a row without a reading need not have one."""
    if "temperature_C" not in table.header:
        return None
    out = []
    for row, value in enumerate(values):
        empty = np.isnan(value) and not table.cell(row, "temperature_C")
        temperature = np.nan if empty else table.number(row, "temperature_C")
        if temperature < -273.15:
            raise table.complain(row, "temperature_C", table.cell(row, "temperature_C"), "at least -273.15 °C")
        out.append(temperature)
    return out


def _check_displacement(table: Table, row: int, displacement: float, length_mm: float) -> None:
    """Refuse a displacement that leaves no wire, or stretches it beyond what any thread bears."""
    if length_mm + displacement <= 0:
        expected = f"a displacement above -{length_mm:g} mm, the wire's length"
        raise table.complain(row, "displacement_mm", table.cell(row, "displacement_mm"), expected)
    if displacement > STRETCH * length_mm:
        expected = f"at most {STRETCH:g} times the wire's length of {length_mm:g} mm (is length_mm in mm?)"
        raise table.complain(row, "displacement_mm", table.cell(row, "displacement_mm"), expected)


MOST = 100_000  # padded readings: thousands of walkers and simulations of more fill the memory of a desk's computer
STRETCH = 8.0  # the most elastic thread breaks at seven times its length
RUN_ON_CERTAIN = 1e-4  # three holds of four readings; two holds of five may still be an odd protocol (0.004)


def times_run_on(times_s: Sequence[NDArray[np.float64]]) -> float:
    """How likely the reading times would run on from hold to hold over the whole test, had they nothing to do with it.

    Parameters
    ----------
    times_s : sequence of (r,) arrays
        Of each hold; those without readings do not count.

    Returns
    -------
    float
        Share of the orders of all reading times in which every hold begins after the last reading of the one before;
        1 where the times do not run on, or most holds have a single reading (durations may well grow).
    """
    recorded = [times for times in times_s if times.size]
    counts = [times.size for times in recorded]
    runs_on = all(after[0] >= before[-1] for before, after in zip(recorded, recorded[1:], strict=False))
    if len(recorded) < 2 or not runs_on or float(np.median(counts)) < 2:
        return 1.0
    return float(np.exp(sum(lgamma(n + 1) for n in counts) - lgamma(sum(counts) + 1)))


def _check_sign(table: Table, holds: Sequence[Hold]) -> None:
    """Refuse tensions that are clearly a push: a wire only pulls, and a slack one reads nothing but noise."""
    tension = np.concatenate([hold.tension_N for hold in holds])
    means = np.array([hold.tension_N.mean() for hold in holds])
    place = np.array([hold.displacement_mm for hold in holds])
    if len(holds) < 3 or np.ptp(place) == 0 or np.ptp(means) == 0 or -tension.min() < PUSH * max(tension.max(), 0.0):
        return
    within = np.sqrt(np.mean([hold.tension_N.var() for hold in holds]))
    follows = float(np.corrcoef(place, means)[0, 1])
    if abs(follows) > FOLLOWS and np.ptp(means) > PUSH * within:
        row = int(tension.argmin())
        change = "change the sign of tension_N" if follows < 0 else "undo the zeroing of tension_N"
        if follows > 0 and place.max() <= 0:  # a machine that counts compression positive
            change = "change the signs of displacement_mm and of tension_N"
        expected = f"a pull counted positive: {change} (a slack wire reads 0 N)"
        raise table.complain(row, "tension_N", table.cell(row, "tension_N"), expected)


PUSH = 5.0  # times the pull, and times the readings' spread in a hold: far beyond a sensor's noise or offset
FOLLOWS = 0.9  # correlation with the displacement, which noise on a slack wire does not have

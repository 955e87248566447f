"""The strict reader of a readings' CSV: every error names the file, the line and the column.

The format: UTF-8 (a byte-order mark is accepted), one header line with the columns in any order, one reading per line,
fields separated by commas, plain decimal numbers with optional spaces or double quotes around them, any line ending,
blank lines only at the end, no comments. A row whose read value is empty says that its hold lasted until then.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import lgamma
from pathlib import Path
from typing import Any

import numpy as np

from wirebayes.errors import InputError
from wirebayes.numeric.frozen import frozen
from wirebayes.numeric.typing import Bools, Floats
from wirebayes.strict.table import CsvTable, read_table
from wirebayes.wire.protocol import Control

REQUIRED = ("hold", "displacement_mm", "time_s", "tension_N")
OPTIONAL = ("temperature_C",)
# the column that is one value a hold, and the one with a value a reading
SET: dict[Control, str] = {"displacement": "displacement_mm", "force": "tension_N"}
READ: dict[Control, str] = {"displacement": "tension_N", "force": "displacement_mm"}

HANGS_FREE = 1e-6  # of the smallest weight, where none hangs: creep goes with a power of a tension above zero

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
    time_s: Floats
    readings: Floats
    temperature_C: Floats | None = None
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

    def of_readings(self, kept: Bools) -> "Hold":
        """The hold with some of its readings; without any it is unrecorded."""
        if kept.all():
            return self
        temperature = None if self.temperature_C is None else frozen(self.temperature_C[kept])
        return replace(
            self,
            number=self.number if kept.any() else None,
            time_s=frozen(self.time_s[kept]),
            readings=frozen(self.readings[kept]),
            temperature_C=temperature if kept.any() else None,
        )


def readings_table(path: Path) -> CsvTable:
    """A readings' CSV split into fields, not checked any further."""
    return read_table(path, REQUIRED, OPTIONAL)


def checked_readings(table: CsvTable, length_mm: float, control: Control = "displacement") -> tuple[Hold, ...]:
    """Check a table of readings.

    Parameters
    ----------
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
    column = READ[control]
    values = [table.number(row, column) if table.cell(row, column) else np.nan for row in range(len(table.rows))]
    if not np.isfinite(values).any():
        raise table.complain(0, column, "no reading", "at least one")
    read = _holds(table, length_mm, control, values)
    holds = tuple(hold.of_readings(np.isfinite(hold.readings)) for hold in read)  # without rows of no reading
    if control == "displacement":
        _check_sign(table, [hold for hold in holds if hold.recorded])
    return holds


def protocol_columns(control: Control) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Required and optional columns of a protocol to predict."""
    return ("hold", SET[control], "time_s"), (READ[control], *OPTIONAL)


def protocol_table(path: Path, control: Control = "displacement") -> CsvTable:
    """The CSV of a protocol to predict, split into fields: the readings' columns, with what is read optional."""
    return read_table(path, *protocol_columns(control))


def protocol_holds(table: CsvTable, length_mm: float, control: Control = "displacement") -> tuple[Hold, ...]:
    """Check a protocol.

    The column of what is read, when there is one, is filled at most at the first time of a hold; every other
    reading has NaN.

    Parameters
    ----------
    length_mm : float
        Zero-tension length, so that a displacement that leaves no wire is found.
    control : {"displacement", "force"}
        What is set.

    Raises
    ------
    InputError
        As `checked_readings`, and where a value stands at a later time of its hold.
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


@dataclass(frozen=True)
class _Rows:
    """The columns of a table of readings, a value a row; `read` is NaN where nothing was read."""

    table: CsvTable
    control: Control
    number: Sequence[int]
    setting: Sequence[float]
    time_s: Sequence[float]
    read: Sequence[float]
    temperature_C: Sequence[float] | None

    def complain(self, row: int, column: str, expected: str) -> InputError:
        """The error for a cell, which it shows.

        Parameters
        ----------
        expected : str
            As the message shows it.
        """
        return self.table.complain(row, column, self.table.cell(row, column), expected)

    def check(self, row: int, length_mm: float) -> None:
        """Refuse what cannot be, whatever the rows before it say."""
        displacement = self.setting if self.control == "displacement" else self.read
        _check_displacement(self.table, row, displacement[row], length_mm)
        if self.control == "force" and not self.setting[row] > 0:
            rest = ""
            if self.setting[row] == 0:
                rest = ": of a rest, the weight of the empty hook; one that is not read is an unrecorded hold"
            raise self.complain(row, SET[self.control], f"a tension above 0 N{rest}")
        if self.time_s[row] < 0:
            raise self.complain(row, "time_s", "0 s or later")

    def begins(self, row: int) -> bool:
        """Whether a hold begins in a row; otherwise it has the setting of the row before, and a later time."""
        if not row:
            return True
        before = row - 1
        number, last = self.number[row], self.number[before]
        if number > last:
            return True
        if number < last:
            seen = number in self.number[:row]
            together = " (its rows must stand together)" if seen else ""
            raise self.complain(row, "hold", f"a hold number above {last}{together}")
        if self.setting[row] != self.setting[before]:
            column = SET[self.control]
            cell = self.table.cell(before, column)
            raise self.complain(row, column, f"{cell} as before in hold {number}")
        if self.time_s[row] <= self.time_s[before]:
            earlier = self.table.cell(before, "time_s")
            raise self.complain(row, "time_s", f"a time after {earlier} s in hold {number}")
        return False

    def hold(self, begin: int, end: int, start_s: float) -> Hold:
        """The hold of some rows.

        Parameters
        ----------
        begin, end : int
            The first of its rows, and the one after its last.
        start_s : float
            When the holds before it ended.
        """
        rows = slice(begin, end)
        return Hold(
            number=self.number[begin],
            setting=self.setting[begin],
            duration_s=self.time_s[end - 1],
            time_s=frozen(self.time_s[rows]),
            readings=frozen(self.read[rows]),
            temperature_C=None if self.temperature_C is None else frozen(self.temperature_C[rows]),
            start_s=start_s,
            control=self.control,
        )


def _holds(table: CsvTable, length_mm: float, control: Control, values: Sequence[float]) -> tuple[Hold, ...]:
    count = range(len(table.rows))
    rows = _Rows(
        table,
        control,
        number=[table.whole(row, "hold") for row in count],
        setting=[table.number(row, SET[control]) for row in count],
        time_s=[table.number(row, "time_s") for row in count],
        read=values,
        temperature_C=_temperatures(table, values),
    )
    first = []
    for row in count:
        rows.check(row, length_mm)
        if rows.begins(row):
            first.append(row)
    holds, start = [], 0.0
    for begin, end in zip(first, [*first[1:], len(table.rows)], strict=True):
        hold = rows.hold(begin, end, start)
        holds.append(hold)
        start += hold.duration_s
    _check_size(table, holds)
    if times_run_on([hold.time_s for hold in holds]) < RUN_ON_CERTAIN:
        since = f"the time since hold {holds[1].number} began, not since the test began"
        raise rows.complain(first[1], "time_s", f"{since} (0 s at each hold's start)")
    return tuple(holds)


def _check_size(table: CsvTable, holds: Sequence[Hold]) -> None:
    """Refuse more readings than a fit can pad and hold in memory."""
    longest = max(hold.time_s.size for hold in holds)
    if len(holds) * longest > MOST:
        found = f"{len(holds)} holds, the longest of {longest} readings"
        expected = f"at most {MOST} as holds times readings of the longest; `wirebayes import` thins a recording"
        raise InputError(f"{table.path}: found {found}, expected {expected}")


def _temperatures(table: CsvTable, values: Sequence[float]) -> list[float] | None:
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


def _check_displacement(table: CsvTable, row: int, displacement: float, length_mm: float) -> None:
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


def times_run_on(times_s: Sequence[Floats]) -> float:
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


def _check_sign(table: CsvTable, holds: Sequence[Hold]) -> None:
    """Refuse tensions that are clearly a push: a wire only pulls, and a slack one reads nothing but noise."""
    if len(holds) < 3:
        return
    tension = np.concatenate([hold.tension_N for hold in holds])
    means = np.array([hold.tension_N.mean() for hold in holds])
    place = np.array([hold.displacement_mm for hold in holds])
    span = np.ptp(means)
    if np.ptp(place) == 0 or span == 0:
        return
    largest_pull = max(tension.max(), 0.0)
    if -tension.min() < PUSH * largest_pull:
        return
    variances = [hold.tension_N.var() for hold in holds]
    within = np.sqrt(np.mean(variances))
    follows = float(np.corrcoef(place, means)[0, 1])
    if abs(follows) <= FOLLOWS or span <= PUSH * within:
        return
    if follows < 0:
        change = "change the sign of tension_N"
    elif place.max() <= 0:  # a machine that counts compression positive
        change = "change the signs of displacement_mm and of tension_N"
    else:
        change = "undo the zeroing of tension_N"
    row = int(tension.argmin())
    expected = f"a pull counted positive: {change} (a slack wire reads 0 N)"
    raise table.complain(row, "tension_N", table.cell(row, "tension_N"), expected)


PUSH = 5.0  # times the pull, and times the readings' spread in a hold: far beyond a sensor's noise or offset
FOLLOWS = 0.9  # correlation with the displacement, which noise on a slack wire does not have

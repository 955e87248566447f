"""Times as seconds: clocks (m:ss, h:mm:ss, 1 h 30 min), dates with clocks; midnight passes."""

import re
from collections.abc import Sequence

import numpy as np

from wirebayes.errors import shown
from wirebayes.io.bench.compound_times import is_spelt, spelt_s
from wirebayes.io.bench.dates import days_s
from wirebayes.io.bench.quantities import Unit
from wirebayes.io.bench.sheet import is_moment, is_number, is_value, moment
from wirebayes.io.bench.summer_time import without_summer_time
from wirebayes.io.bench.table import RawTable
from wirebayes.io.bench.undecided import Undecided
from wirebayes.numeric.typing import Array, Bools, Floats
from wirebayes.sentences import counted

_Moments = Sequence[re.Match[str]]  # the parts of each cell
_Times = tuple[Floats, bool, list[str]]  # seconds, whether they are moments of a day, and what was done
_DAY, _HOUR, _MINUTE = 86400.0, 3600.0, 60.0
_ROUND = 0.5 * _DAY  # of a clock with hands
_MIDNIGHT = 0.5 * _DAY  # a fall larger than this is a new day
_PUT_BACK = 3600.0  # clocks are put back by an hour in autumn
_LATE = 3.0  # times the least time between readings: nobody who counts from zero begins so late
CALLED = {60.0: "minutes and seconds", 3600.0: "hours and minutes"}  # by the seconds of one of the first part
_WRITTEN = {60.0: "mm:ss", 3600.0: "hh:mm"}  # the same, as a unit of `--map`
_WITHOUT_DOUBT = (
    "AM or PM behind the times, hours to 24, or dates; or --time-since hold, if they are durations since each hold "
    "began"
)
UNDERSTOOD = (
    "a time such as 0:01:30 or 10:01:30 AM, or with a date such as 2024-05-31 10:01:30, 2024-05-31T10:01:30+02:00, "
    "20240531 10:01:30, 31.05.2024 10:01:30, 05/31/2024 10:01:30 AM or 31-May-2024 10:01:30"
)


def looks_like_a_moment(cell: str) -> bool:
    """Whether a cell has the three numbers or more of a clock or a date, but is none that is understood."""
    return not is_value(cell) and len(re.findall(r"\d+", cell)) > 2


def has_moments(table: RawTable, column: int) -> bool:
    """Whether a column holds clocks or dates."""
    return any(is_moment(cell) for cell in table.column(column))


def are_moments(table: RawTable, column: int) -> bool:
    """Whether a column holds dates with times in all readings, whatever its name; lines of words may stand between."""
    found = [moment(row.cell(column)) for row in table.rows if row.may_be_a_reading]
    return bool(found) and all(m is not None and m["date"] and m["first"] for m in found)


def is_clock(table: RawTable, column: int, unit: Unit | None) -> bool:
    """Whether a column holds clocks or dates, or is said to.

    Parameters
    ----------
    unit : Unit or None
        Of the column.
    """
    return (unit is not None and unit.clock is not None) or has_moments(table, column)


def seconds(table: RawTable, column: int, unit: Unit | None, *, durations: bool = False) -> _Times:
    """Times of a column of clocks or dates.

    Parameters
    ----------
    unit : Unit or None
        Where the header says how clocks are written.
    durations : bool
        Whether clocks without a date count from the beginning of each hold, and so begin anew, whatever they show.

    Returns
    -------
    time_s : (r,) array
    of_day : bool
        Whether they are moments of a calendar or a clock on the wall, so that nothing restarts.
    passed : list of str
        That a clock without dates has passed midnight, or one of minutes and seconds the hour, and how often; that
        one on the wall was put forward or back.

    Raises
    ------
    InputError
        A cell is no clock; `Undecided` where ``a:b`` may be minutes or hours.
    """
    if any(map(is_spelt, table.column(column))):
        return _of_spelt(_spelt(table, column))
    moments = _moments(table, column, unit)
    # what follows a date or stands before AM is of the day, and leaves no doubt
    of_clock = [m["date"] is None and m["half"] is None for m in moments]
    short = _first_short(moments, of_clock)
    leading = _HOUR
    if short is not None:
        leading = _leading(table, column, unit, moments, short)
    values = _values(moments, of_clock, leading)
    lines = [row.line for row in table.rows]
    if moments[0]["date"] is not None:
        days = days_s(table, column, moments, unit)
        time_s = (days - days[0]) + values
        if moments[0]["zone"] is not None:
            return time_s, True, []
        time_s, changed = without_summer_time(time_s, lines)
        return time_s, True, changed
    if durations and all(of_clock):
        return values, False, []
    if leading == _MINUTE and _minutes_go_round(values):
        falls = np.diff(values, prepend=values[0]) < 0.0
        hours = np.cumsum(falls)
        return values + _HOUR * hours, False, _passed("the hour", hours)
    if all(of_clock):
        _check_hours_go_beyond_twelve(table, column, values)
    of_day = short is None and (not of_clock[0] or values[0] >= _HOUR)
    midnights = np.cumsum(_days_begin(values, of_day))
    time_s, passed = values + _DAY * midnights, _passed("midnight", midnights)
    if of_day:
        time_s, changed = without_summer_time(time_s, lines)
        passed += changed
    return time_s, of_day, passed


def _values(moments: _Moments, of_clock: Sequence[bool], leading: float) -> Floats:
    """Seconds of each cell; the first part of those of a clock is so many."""
    values = []
    for found, is_clock_alone in zip(moments, of_clock, strict=True):
        values.append(_value(found, leading if is_clock_alone else _HOUR))
    return np.array(values)


def _first_short(moments: _Moments, of_clock: Sequence[bool]) -> int | None:
    """The first clock of two parts, ``a:b``, which may be minutes and seconds."""
    for i, found in enumerate(moments):
        if of_clock[i] and found["third"] is None:
            return i
    return None


def _of_spelt(values: Floats) -> _Times:
    """What `seconds` returns of times in two units or more: durations from zero, or a clock on the wall."""
    on_the_wall = values[0] >= _HOUR and values.max() < _DAY
    begins = _days_begin(values, of_day=False)
    midnights = np.cumsum(begins & on_the_wall)
    return values + _DAY * midnights, False, _passed("midnight", midnights)


def _passed(what: str, rounds: Array) -> list[str]:
    """How often a clock has gone round, (r,) counted up, in a sentence."""
    return [f"the clock passes {what} {counted(int(rounds[-1]), 'time')}"] if rounds[-1] else []


def _minutes_go_round(values: Floats) -> bool:
    """Whether minutes and seconds (r,) in s count from the last full hour, and so fall by most of one where it is over.

    Durations that begin anew begin alike, near zero or where the first of them began.
    """
    steps = np.diff(values)
    falls = steps < 0.0
    if not falls.any() or values.max() >= _HOUR or (steps[falls] > -0.5 * _HOUR).any():
        return False
    near = _LATE * steps[steps > 0.0].min(initial=np.inf)
    after = values[1:][falls]
    return bool(((after > near) & (np.abs(after - values[0]) > near)).any())


def calendar_s(table: RawTable, column: int, unit: Unit | None) -> Floats:
    """Seconds from the beginning of the calendar to each reading (r,), in a column of dates with times.

    Parameters
    ----------
    unit : Unit or None
        Where the header or the user says whether dates begin with the day.

    Raises
    ------
    UndecidedDates
        Nobody says it, and dates may begin with the day or with the month.
    """
    moments = _moments(table, column, unit)
    of_day = [_value(found, _HOUR) for found in moments]
    return days_s(table, column, moments, unit) + np.array(of_day)


def _check_hours_go_beyond_twelve(table: RawTable, column: int, values: Floats) -> None:
    """Refuse clocks (r,) in s that may go round twice a day: they fall by half a round or more, and know no hour 13."""
    steps = np.diff(values, prepend=values[0])
    closest = steps[steps > 0.0].min(initial=np.inf)
    goes_round = (steps > -_ROUND) & (steps <= -0.5 * _ROUND) & (values > _LATE * closest)
    within_twelve = values.min() >= _HOUR and values.max() < _ROUND + _HOUR
    if not goes_round.any() or not within_twelve:
        return
    number = int(np.flatnonzero(goes_round)[0])
    row = table.rows[number]
    before = table.rows[number - 1].cell(column)
    found = f"{shown(row.cell(column))} after {shown(before)}, and no hour above 12"
    raise table.complain(row.line, column, found, _WITHOUT_DOUBT)


def _days_begin(values: Floats, of_day: bool) -> Bools:
    """(r,) where a clock (r,) has passed midnight since the row before.

    On the next day a clock of the day may read nearly as much as before. A clock that starts again counts from zero:
    its first reading is hardly much later than its readings are apart. Rows with the newest first fall throughout.
    """
    steps = np.diff(values, prepend=values[0])
    rises, falls = steps > 0.0, steps < -_PUT_BACK
    closest = steps[rises].min(initial=np.inf)
    goes_on = of_day and rises.sum() > falls.sum()
    return (steps < -_MIDNIGHT) | (falls & goes_on & (values > _LATE * closest))


def _spelt(table: RawTable, column: int) -> Floats:
    """Seconds of cells that name their units; nothing is zero in every unit."""
    values = []
    for row in table.rows:
        cell = row.cell(column)
        value = 0.0 if cell == "0" else spelt_s(cell)
        if value is None:
            raise table.complain(row.line, column, shown(cell), "a time such as 1 h 30 min, 2 min 5 s or 30 s")
        values.append(value)
    return np.array(values, dtype=float)


def _moments(table: RawTable, column: int, unit: Unit | None) -> list[re.Match[str]]:
    """The parts of each cell; either all have a date, or none, and likewise an offset from UTC."""
    joint = ":"
    if unit is not None and unit.clock is not None:
        joint = unit.clock.joint
    cells = [_with_colons(cell, joint) for cell in table.column(column)]
    if unit is not None and all(map(is_number, cells)):
        raise _no_clock(table, column, unit)
    moments: list[re.Match[str]] = []
    for row, cell in zip(table.rows, cells, strict=True):
        found = moment(cell)
        expected = UNDERSTOOD
        if found is not None:
            first = moments[0] if moments else found
            expected = _expected_in_place_of(found, first)
        if found is None or expected:
            as_given = row.cell(column)
            raise table.complain(row.line, column, shown(as_given), expected)
        moments.append(found)
    return moments


def _expected_in_place_of(found: re.Match[str], first: re.Match[str]) -> str:
    """What should stand in place of a moment, beside the first one; empty where nothing is wrong with it."""
    if found["first"] is None or (found["half"] and not 1 <= int(found["first"]) <= 12):
        return UNDERSTOOD
    if max(int(found["second"]), int(found["third"] or 0)) >= 60:
        return "minutes and seconds below 60 after the first number"
    for part, called in (("date", "a date"), ("zone", "an offset from UTC")):
        if (found[part] is None) != (first[part] is None):
            without = "out" if first[part] is None else ""
            return f"a time with{without} {called}, as in the lines before"
    return ""


def _with_colons(cell: str, joint: str) -> str:
    """A clock with colons between its parts, in place of points, commas or dashes where the header has such a sign."""
    signs = {".": ".,", ",": ".,", "-": "-\u2013", "\u2013": "-\u2013"}.get(joint)
    digits = r"\d{1,2}" if joint in "-\u2013" else r"\d\d"  # 1-5 is no fraction, and 1.5 may be
    if signs is None or not re.fullmatch(rf"\d+([{signs}]{digits}){{1,2}}", cell):
        return cell
    return re.sub(rf"[{signs}]", ":", cell)


def _no_clock(table: RawTable, column: int, unit: Unit) -> Undecided:
    """The question what plain numbers mean under a header that speaks of clocks."""
    units = {"s": "seconds", "min": "minutes", "h": "hours", "d": "days, as spreadsheets count"}
    leading = None if unit.clock is None else unit.clock.leading_s
    if leading and all(_with_colons(cell, ".") != cell for cell in table.column(column)):
        with_points = _WRITTEN[leading].replace(":", ".")
        units = {with_points: CALLED[leading], **units}
    name = table.header[column]
    answers = {f"--map {name}=time [{text}]": called for text, called in units.items()}
    first = table.rows[0]
    where = table.where(first.line, column)
    return Undecided(f"{where}: found {first.cell(column)!r} under {unit.text!r}", "the unit of time", answers)


def _value(found: re.Match[str], leading: float) -> float:
    """Seconds since midnight in Greenwich, if the offset from UTC is given, or on the clock."""
    fraction = float(f"0.{found['fraction']}") if found["fraction"] else 0.0
    first, second = int(found["first"]), int(found["second"])
    if found["half"]:  # 12 AM is midnight, 12 PM noon
        first = first % 12 + 12 * (found["half"] in "pP")
    if found["third"] is None:
        return leading * first + leading / 60.0 * (second + fraction) - _offset(found["zone"])
    return 3600.0 * first + 60.0 * second + int(found["third"]) + fraction - _offset(found["zone"])


def _offset(zone: str | None) -> float:
    """Seconds by which clocks of a zone are ahead of UTC."""
    if zone is None or zone.upper() in ("Z", "UTC"):
        return 0.0
    digits = zone[1:].replace(":", "").ljust(4, "0")
    return (1.0 if zone[0] == "+" else -1.0) * (3600.0 * int(digits[:2]) + 60.0 * int(digits[2:]))


def _leading(table: RawTable, column: int, unit: Unit | None, moments: _Moments, short: int) -> float:
    """Seconds of one of the first part of ``a:b``: as the header says, or as only one reading of the cells has it.

    A fraction is one of seconds. Beside cells ``a:b:c`` one of the two makes times fall where the other does not.
    """
    stated = None if unit is None else unit.clock
    if stated is not None and stated.leading_s is not None:
        return stated.leading_s
    if any(m["fraction"] for m in moments if m["third"] is None):
        return _MINUTE
    falls = {leading: _falls(moments, leading) for leading in CALLED}
    fewest = min(falls, key=lambda leading: falls[leading])
    if max(falls.values()) > falls[fewest]:
        return fewest
    row = table.rows[short]
    cell = row.cell(column)
    where = table.where(row.line, column)
    found = f"found {cell!r}, which is minutes and seconds or hours and minutes"
    map_to = f"--map {table.header[column]}=time"
    answers = {}
    for leading, called in CALLED.items():
        answers[f"{map_to} [{_WRITTEN[leading]}]"] = called
    raise Undecided(f"{where}: {found}", "which", answers)


def _falls(moments: _Moments, leading: float) -> int:
    """How often times fall whose first part counts so many seconds."""
    times = [_value(m, leading) for m in moments]
    return int(np.sum(np.diff(times) < 0.0))

"""Readings divided into holds: by a column of hold numbers, by what was set, or by times that start again.

What was set is the displacement, or the tension in a test under weights. Times of the whole test become times since
each hold began: its first reading, or the middle of a move that is recorded.
"""

from collections.abc import Sequence
from itertools import pairwise
from math import comb

import numpy as np

from wirebayes.errors import InputError
from wirebayes.io.bench.clock_again import clock_started_again
from wirebayes.io.bench.continuous import COVERED, by_plateaus
from wirebayes.io.bench.control import BY_CHANCE as TREND_BY_CHANCE
from wirebayes.io.bench.control import trend_by_chance
from wirebayes.io.bench.flicker import flickers, without_flicker
from wirebayes.io.bench.hold_clock import by_both
from wirebayes.io.bench.plateaus import FEWEST, plateaus
from wirebayes.io.bench.recorded import (
    BEGUN_BEFORE,
    CONTINUOUS,
    PAUSE,
    Cut,
    HoldClock,
    Readings,
    Rows,
    changes,
    groups_between,
    level_of,
    restarts,
    usual_size,
    wanders,
)
from wirebayes.io.bench.resets import joined_at_resets
from wirebayes.io.bench.row_order import check_row_order
from wirebayes.io.bench.undecided import TimeSince, Undecided
from wirebayes.io.readings import times_run_on
from wirebayes.io.unread_ends import unread_s
from wirebayes.numeric.typing import Floats
from wirebayes.sentences import counted, holds_in_words, lasting, listed, short

BY_CHANCE = 0.01  # as `wirebayes.io.data_checks` suspects times that run on
MOVE_SHARE = 0.2  # of the readings of the usual hold: fewer at one displacement are passed in a move
SOON = 5  # intervals after a move that show how often a device reads there
LATE = 3.0  # times the least time between readings: nobody who counts from the beginning of a hold begins so late
ENDS_UNKNOWN = (
    "when a hold ended is not known: if the wire rested between its last reading and the next move, add a row without "
    "a reading at the moment of that move"
)
WEIGHTS_LEFT_UNKNOWN = (
    "when a weight was taken off is not known: if it hung on after its last reading, add a row without a reading at "
    "that moment; if the wire rested without a weight before the next one, say so with unrecorded_holds, tension_N = 0"
)


def cut(readings: Readings, time_since: TimeSince | None) -> Cut:
    """Cut readings into holds.

    Raises
    ------
    InputError
        The setting never stays, times fall within a hold, or rows stand in another order than that of time;
        `Undecided` where times may count from the beginning of each hold or of the test.
    """
    check_row_order(readings)
    if readings.of_day and time_since == "hold":
        raise InputError(f"--time-since hold: found moments of a day in {readings.time_name}, which restart nowhere")
    readings, resets = joined_at_resets(readings)
    x = readings.setting
    if readings.hold is not None:
        groups = groups_between(changes(readings.hold))
        if not wanders(x, groups):
            return _cut_into_groups(readings, groups, time_since, resets)
        if usual_size(groups) < CONTINUOUS:  # moves may have numbers of their own
            raise _wandering(readings, groups)
        resets = [*resets, f"hold numbers are not used: the {readings.role} changes within them"]
        return by_plateaus(readings, resets)
    groups = _by_restarts_and_changes(readings)
    if groups:
        return _cut_into_groups(readings, groups, time_since, resets)
    return by_plateaus(readings, resets)


def _by_restarts_and_changes(readings: Readings) -> list[Rows]:
    """Rows between restarts of time and changes of what is set; none where these make no holds."""
    x = readings.setting
    restart = restarts(readings)
    if not restart.any():
        return _by_changes(x)
    groups = without_flicker(x, groups_between(restart | changes(x)), restart)
    shortest = min(map(len, groups))
    most = 2 * (int(restart.sum()) + 1)
    if shortest == 1 and len(groups) > most:
        groups = groups_between(restart)  # a measured setting that scatters
        if wanders(x, groups):
            raise _wandering(readings, groups)
    return groups


def _by_changes(x: Floats) -> list[Rows]:
    """Rows between changes of what is set; none where these make no holds, as in a recording that flickers."""
    groups = groups_between(changes(x))
    steady = without_flicker(x, groups, np.zeros(len(x), bool))
    if len(steady) == len(groups) and flickers(x, groups):
        return []
    return steady if _are_holds(steady) else []


def stretches(readings: Readings, fewest: int = FEWEST) -> list[Rows]:
    """Rows of each stretch of some readings in which the setting stays; none where it does not stay.

    The same holds as those of `cut`, without their times: to see whether this is what was set.
    """
    x = readings.setting
    candidates = []
    if readings.hold is not None:
        candidates.append(groups_between(changes(readings.hold)))
    restart = restarts(readings)
    if restart.any():
        candidates.append(groups_between(restart))
    by_setting = _by_changes(x)
    if by_setting:
        candidates.append(by_setting)
    for groups in candidates:
        if not wanders(x, groups):
            return [rows for rows in groups if len(rows) >= fewest]
    index = np.arange(len(x), dtype=float)
    found = plateaus(x, index, readings.step)
    covered = sum(p.end - p.begin for p in found)
    if covered < COVERED * len(x):
        return []
    return [np.arange(p.begin, p.end) for p in found]


def _are_holds(groups: Sequence[Rows]) -> bool:
    """Whether groups of one setting each are holds as people write them down, without moves between them."""
    sizes = np.array([len(rows) for rows in groups])
    usual = usual_size(groups)
    no_moves = sizes.min() > MOVE_SHARE * usual
    return bool(2 * len(groups) <= sizes.sum() and (usual < CONTINUOUS or no_moves))


def _wandering(readings: Readings, groups: Sequence[Rows]) -> InputError:
    x = readings.setting
    rows = max(groups, key=lambda rows: float(np.ptp(x[rows])))
    row = int(rows[np.abs(x[rows] - x[rows[0]]).argmax()])
    found = f"{x[row]:g} {readings.unit} in a hold that begins at {x[rows[0]]:g} {readings.unit}"
    return readings.complain(row, readings.role, found, f"one {readings.role} in each hold")


def _cut_into_groups(
    readings: Readings, groups: list[Rows], time_since: TimeSince | None, resets: Sequence[str]
) -> Cut:
    """Holds whose rows are known."""
    x = readings.setting
    notes = list(resets)
    times = [readings.time_s[rows] for rows in groups]
    both = None if readings.hold_clock is None else by_both(groups, readings.time_s, readings.hold_clock)
    _check_rising(readings, groups, times if both is None else both[0])
    of_test = both is not None or _since(readings, times, time_since) == "test"
    ends: list[float | None] = [None] * len(groups)
    if both is not None:
        times, begins = both
        ends = [*np.diff(begins).tolist(), None]
        notes.append(_by_two_clocks(readings.hold_clock))
        notes += _unread_ends(times, ends, readings.role)
    elif of_test:
        _check_resets(readings, groups)
        zeros = _between_readings(times)
        ends, of_resets = _ends(times, zeros)
        notes += _how_times_count(times, zeros, of_resets)
        for hold, zero in enumerate(zeros):
            times[hold] = times[hold] - zero
        notes += _unread_ends(times, ends, readings.role)
    elif len(groups) > 1:
        notes.append(ENDS_UNKNOWN if readings.role == "displacement" else WEIGHTS_LEFT_UNKNOWN)
    if any(np.ptp(x[rows]) > 0 for rows in groups):
        levels = [level_of(x[rows]) for rows in groups]
        notes.append(_scatter(readings, groups))
    else:
        levels = [float(x[rows[0]]) for rows in groups]
    number, numbering = _numbers(readings, groups, levels)
    notes += numbering
    warnings = () if readings.hold is not None else clock_started_again(number, levels, readings.role)
    return Cut(groups, number, levels, times, ends, of_test, notes, readings.time_s, warnings)


def _by_two_clocks(clock: HoldClock | None) -> str:
    """What two clocks tell together, in a sentence."""
    assert clock is not None
    return f"each hold begins where {clock.name!r} counts from and, by {clock.of_test!r}, lasts until the next begins"


def _how_times_count(times: list[Floats], zeros: list[float], resets: Sequence[int]) -> list[str]:
    """What times of a whole test were taken to mean, in sentences."""
    begins = "between the last reading before it and its first"
    before = ""
    if all(zero == of_hold[0] for zero, of_hold in zip(zeros, times, strict=True)):
        begins = "at its first reading"
        before = f"; {BEGUN_BEFORE}"
    notes = [f"times of the whole test: each hold begins {begins} and lasts until the next begins{before}"]
    if resets:
        holds = listed([str(i + 2) for i in resets])
        notes.append(
            f"time starts again at the beginning of hold {holds}: the hold before is taken to end as long after "
            "its last reading as the others"
        )
    return notes


def _numbers(readings: Readings, groups: Sequence[Rows], levels: Sequence[float]) -> tuple[list[int], list[str]]:
    """The numbers of holds, and how they were numbered where the file does not do it."""
    in_order, count = list(range(1, len(groups) + 1)), counted(len(groups), "hold")
    if readings.hold is None:
        return in_order, [f"{count}: a new one wherever the {readings.role} changes or the time starts again"]
    number = [int(readings.hold[rows[0]]) for rows in groups]
    come_again = any(b <= a for a, b in zip(number, number[1:], strict=False))
    if come_again and all(np.diff(levels) != 0.0):
        return in_order, [f"{count}, numbered in order: what numbers or names them comes again"]
    return number, []


def _check_rising(readings: Readings, groups: list[Rows], times: list[Floats]) -> None:
    """Refuse times that do not rise within a hold."""
    for rows, of_hold in zip(groups, times, strict=True):
        stays = np.flatnonzero(np.diff(of_hold) <= 0)
        if len(stays):
            row = int(rows[stays[0] + 1])
            found = f"{of_hold[stays[0] + 1]:g} s after {of_hold[stays[0]]:g} s in one hold"
            raise readings.complain(row, "time", found, "times that rise; a later hold needs another number or place")


def _scatter(readings: Readings, groups: Sequence[Rows]) -> str:
    """What is done with a setting that was measured."""
    x, long = readings.setting, [rows for rows in groups if len(rows) >= FEWEST]
    largest = max(float(np.ptp(x[rows])) for rows in groups)
    drifts = bool(long) and trend_by_chance(long, x) < TREND_BY_CHANCE
    how = "drift" if drifts else "scatter"
    role = readings.role
    return f"{role}s {how} by up to {short(largest, 2)} {readings.unit} in a hold: its median is its {role}"


def _check_resets(readings: Readings, groups: Sequence[Rows]) -> None:
    """Refuse a clock of the test that starts again within a hold: how long the hold lasted is not known.

    One that falls to times between two earlier holds was not started again: the rows of that hold stand elsewhere.
    """
    _check_order_of_holds(readings, groups)
    for before, after in pairwise(groups):
        last, row = int(before[-1]), int(after[0])
        setting, time = readings.setting, readings.time_s
        same_hold = setting[row] == setting[last] and readings.hold is None
        if same_hold and time[row] < time[last]:
            found = f"{time[row]:g} s after {time[last]:g} s at {setting[row]:g} {readings.unit}"
            raise readings.complain(row, "time", found, "times that rise in a hold; shift those from here on")


def _check_order_of_holds(readings: Readings, groups: Sequence[Rows]) -> None:
    """Refuse a hold whose times lie between those of two earlier ones."""
    time = readings.time_s
    for j, rows in enumerate(groups):
        begin, end = time[rows[0]], time[rows[-1]]
        for before, after in pairwise(groups[:j]):
            if time[before[-1]] < begin and end < time[after[0]]:
                above = time[groups[j - 1][-1]]
                found = f"{begin:g} s after {above:g} s, which is between two holds above"
                raise readings.complain(int(rows[0]), "time", found, "rows in the order of time, the oldest first")


def _ends(times: list[Floats], zeros: list[float]) -> tuple[list[float | None], list[int]]:
    """When each hold ended, since it began: when the next one began; and the holds before which a clock was reset.

    At a reset it is not known, and taken as long after the last reading as at the other borders.
    """
    borders = list(zip(times, zeros[1:], strict=False))
    passed = []
    for before, zero in borders:
        if zero >= before[-1]:
            passed.append(zero - before[-1])
    usual = float(np.median(passed)) if passed else 0.0
    ends: list[float | None] = []
    resets = []
    for j, (before, zero) in enumerate(borders):
        end = zero
        if zero < before[-1]:
            resets.append(j)
            end = before[-1] + usual
        ends.append(float(end - zeros[j]))
    ends.append(None)
    return ends, resets


def _unread_ends(times: list[Floats], ends: Sequence[float | None], role: str) -> list[str]:
    """Sentences that holds go on long after their last readings, as rests do whose rows are not in the file."""
    unread: dict[int, float] = {}
    for number, (of_hold, end) in enumerate(zip(times, ends, strict=True), start=1):
        after = 0.0 if end is None else unread_s(of_hold, end)
        if after:
            unread[number] = after
    if not unread:
        return []
    longest = lasting(max(unread.values()))
    rest = "a rest in between is one of unrecorded_holds"
    if role == "tension":
        rest = "if the wire rested without a weight in between, say so with unrecorded_holds, tension_N = 0"
    return [
        f"{holds_in_words(unread)}: the next one begins up to {longest} after the last reading, and the {role} is "
        f"taken to stay until then; {rest}"
    ]


def _between_readings(times: list[Floats]) -> list[float]:
    """When each hold began: between two readings of a device that never paused, else at its first reading.

    One that reads often after a move and seldom later was started by the move, and its late intervals tell nothing.
    """
    zeros = [float(of_hold[0]) for of_hold in times]
    for i, (before, after) in enumerate(zip(times, times[1:], strict=False), 1):
        gap = float(after[0] - before[-1])
        intervals = np.diff(after)
        usual = min(float(np.median(intervals)), float(np.median(intervals[:SOON]))) if len(after) > 1 else 0.0
        if len(after) >= CONTINUOUS and 0.0 <= gap <= PAUSE * usual:
            zeros[i] -= 0.5 * gap
    return zeros


def _since(readings: Readings, times: list[Floats], stated: TimeSince | None) -> TimeSince:
    """What times count from: of the test where they run on over more borders between holds than chance would have it.

    The clock of a test may be started again now and then; one of the hold starts again at every border.
    """
    if stated is not None:
        return stated
    if readings.of_day:
        return "test"
    runs_on = [bool(after[0] >= before[-1]) for before, after in pairwise(times)]
    if len(times) == 1 and _begins_late(times[0]):
        raise _which_zero(readings, 0, f"{times[0][0]:g} s at the first reading of the only hold")
    if not any(runs_on):
        return "hold"
    resets = [j for j, on in enumerate(runs_on, start=1) if not on]
    if _run_on_by_chance(times, resets) < BY_CHANCE:
        return "test"
    if 2 * len(resets) >= len(runs_on):
        return "hold"
    border = runs_on.index(True)
    raise _unclear_at(readings, times, border)


def _run_on_by_chance(times: list[Floats], resets: Sequence[int]) -> float:
    """How likely times of holds run on over all borders but so many: those of each piece, and where resets are."""
    begins = [0, *resets]
    ends = [*resets, len(times)]
    of_pieces = [times_run_on(times[begin:end]) for begin, end in zip(begins, ends, strict=True)]
    return float(comb(len(times) - 1, len(resets)) * np.prod(of_pieces))


def _unclear_at(readings: Readings, times: list[Floats], border: int) -> Undecided:
    """The question what times count from, at the first border over which they run on."""
    last_s = times[border][-1]
    first_s = times[border + 1][0]
    ordinal = f"hold {border + 2}, after {last_s:g} s in the one before"
    if border == 0:
        ordinal = f"the second hold, after {last_s:g} s in the first"
    row = sum(len(of_hold) for of_hold in times[: border + 1])
    return _which_zero(readings, row, f"{first_s:g} s at the first reading of {ordinal}")


def _begins_late(of_hold: Floats) -> bool:
    """Whether the times of an only hold begin later than somebody would who reads from its beginning on."""
    return len(of_hold) > 1 and bool(of_hold[0] > LATE * np.diff(of_hold).min())


def _which_zero(readings: Readings, row: int, found: str) -> Undecided:
    answers = {"--time-since hold": "each hold", "--time-since test": "the whole test"}
    place = str(readings.complain(row, "time", found, "")).removesuffix(", expected ")
    return Undecided(place, "what times count from", answers)

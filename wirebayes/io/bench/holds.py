"""Readings divided into holds: by a column of hold numbers, by the displacement, or by times that start again.

Times of the whole test become times since each hold began: its first reading, or the middle of a move that is recorded.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wirebayes.errors import InputError
from wirebayes.io.bench.plateaus import FEWEST, Plateau, noise_of, plateaus
from wirebayes.io.bench.undecided import TimeSince, Undecided
from wirebayes.io.readings import times_run_on
from wirebayes.typing import Floats

Complain = Callable[[int, str, str, str], InputError]  # row, role, found, expected

CONTINUOUS = 30  # readings of the usual hold that nobody writes by hand
BY_CHANCE = 0.01  # as `wirebayes.io.data_checks` suspects times that run on
MOVE_SHARE = 0.2  # of the readings of the usual hold: fewer at one displacement are passed in a move
PAUSE = 1.5  # of the usual interval between readings: a longer one is a pause in the recording
STEADY = 0.25  # of the smallest step: less scatter in a hold is the encoder's
ARRIVING = 2  # readings by which the end of a move is known: none of them counts
LONG = 10  # times as many readings: shorter holds have none to spare
AFTER_MOVE = 0.1  # of a hold at most is left out after a slow move
COVERED = 0.5  # of the readings in holds; a recording with less is a pull, not a test of holds
BACKWARDS = 0.5  # of the steps in time: holds of two readings or more whose times start again fall at fewer


@dataclass(frozen=True)
class Readings:
    """Columns of numbers as a bench recorded them, in our units.

    Attributes
    ----------
    displacement_mm, time_s : (r,) array
    hold : (r,) array of int or None
    of_day : bool
        Whether times are moments of a day, which restart nowhere.
    displacement_step_mm, time_name : float, str
        To what displacements were rounded, 0 where it is not known; what the file calls the time.
    complain : function
        Makes the error of a cell.
    """

    displacement_mm: Floats
    time_s: Floats
    hold: NDArray[np.int64] | None
    of_day: bool
    displacement_step_mm: float
    time_name: str
    complain: Complain


@dataclass(frozen=True)
class Cut:
    """Readings cut into holds.

    Attributes
    ----------
    rows : list of (k,) arrays of int
        Of each hold.
    number : list of int
    displacement_mm : list of float
    time_s : list of (k,) arrays
        Since the hold began.
    of_test : bool
        Whether the file counts time from the beginning of the test.
    notes : list of str
        What was done, in sentences.
    """

    rows: list[NDArray[np.int64]]
    number: list[int]
    displacement_mm: list[float]
    time_s: list[Floats]
    of_test: bool
    notes: list[str]


def cut(readings: Readings, time_since: TimeSince | None) -> Cut:
    """Cut readings into holds.

    Raises
    ------
    InputError
        The displacement never stays, times fall within a hold, or the newest reading stands first; `Undecided` where
        times may count from the beginning of each hold or of the test.
    """
    _check_order(readings)
    x, time = readings.displacement_mm, readings.time_s
    if readings.of_day and time_since == "hold":
        raise InputError(f"--time-since hold: found moments of a day in {readings.time_name}, which restart nowhere")
    restart = np.concatenate([[False], np.diff(time) < 0])
    change = np.concatenate([[False], np.diff(x) != 0])
    if readings.hold is not None:
        border = np.concatenate([[False], np.diff(readings.hold) != 0])
        groups = _groups(border)
        if _wanders(x, groups):
            if not _is_continuous(groups):
                raise _wandering(readings, groups)
            return _by_plateaus(readings, "hold numbers are not used: the displacement changes within them")
        return _in_groups(readings, groups, time_since)
    if restart.any() and not readings.of_day:
        groups = _groups(restart | change)
        if any(len(rows) == 1 for rows in groups) and len(groups) > 2 * (int(restart.sum()) + 1):
            groups = _groups(restart)  # a measured displacement that scatters
            if _wanders(x, groups):
                raise _wandering(readings, groups)
        return _in_groups(readings, groups, time_since or "hold")
    groups = _groups(change)
    sizes = np.array([len(rows) for rows in groups])
    usual = float(np.median(np.repeat(sizes, sizes)))
    no_moves = sizes.min() > MOVE_SHARE * usual
    if 2 * len(groups) <= len(x) and (usual < CONTINUOUS or no_moves):
        return _in_groups(readings, groups, time_since)
    return _by_plateaus(readings, "")


def _check_order(readings: Readings) -> None:
    """Refuse rows whose newest reading stands first: each would become a hold of its own."""
    time = readings.time_s
    steps = np.arange(1, len(time))
    if readings.hold is not None:  # holds of one reading each may last ever shorter
        steps = steps[np.diff(readings.hold) == 0]
    falling = steps[time[steps] < time[steps - 1]]
    if len(falling) > BACKWARDS * len(steps):
        row = int(falling[0])
        found = f"{time[row]:g} s after {time[row - 1]:g} s, and times that fall in {len(falling)} of {len(steps)} rows"
        raise readings.complain(row, "time", found, "rows in the order of time, the oldest first; turn them round")


def _groups(border: NDArray[np.bool_]) -> list[NDArray[np.int64]]:
    return np.split(np.arange(len(border)), np.flatnonzero(border))


def _is_continuous(groups: Sequence[NDArray[np.int64]]) -> bool:
    return float(np.median([len(rows) for rows in groups])) >= CONTINUOUS


def _wanders(x: Floats, groups: Sequence[NDArray[np.int64]]) -> bool:
    """Whether the displacement changes within a hold by more than a measured position scatters."""
    within = max(float(np.ptp(x[rows])) for rows in groups)
    steps = np.abs(np.diff([float(np.median(x[rows])) for rows in groups]))
    steps = steps[steps > within]
    return within > 0 and (not len(steps) or within > STEADY * float(steps.min()))


def _wandering(readings: Readings, groups: Sequence[NDArray[np.int64]]) -> InputError:
    x = readings.displacement_mm
    rows = max(groups, key=lambda rows: float(np.ptp(x[rows])))
    row = int(rows[np.abs(x[rows] - x[rows[0]]).argmax()])
    found = f"{x[row]:g} mm in a hold that begins at {x[rows[0]]:g} mm"
    return readings.complain(row, "displacement", found, "one displacement in each hold")


def _in_groups(readings: Readings, groups: list[NDArray[np.int64]], time_since: TimeSince | None) -> Cut:
    """Holds whose rows are known."""
    x, notes = readings.displacement_mm, []
    times = [readings.time_s[rows] for rows in groups]
    for rows, of_hold in zip(groups, times, strict=True):
        stays = np.flatnonzero(np.diff(of_hold) <= 0)
        if len(stays):
            row = int(rows[stays[0] + 1])
            found = f"{of_hold[stays[0] + 1]:g} s after {of_hold[stays[0]]:g} s in one hold"
            raise readings.complain(row, "time", found, "times that rise; a later hold needs another number or place")
    of_test = _since(readings, times, time_since) == "test"
    if of_test:
        zeros = _between_readings(times)
        at_first = all(zero == of_hold[0] for zero, of_hold in zip(zeros, times, strict=True))
        begins = "at its first reading" if at_first else "between the last reading before it and its first"
        notes.append(f"times of the whole test: each hold begins {begins}")
        times = [of_hold - zero for of_hold, zero in zip(times, zeros, strict=True)]
    levels = [float(x[rows[0]]) for rows in groups]
    if any(np.ptp(x[rows]) > 0 for rows in groups):
        largest = max(float(np.ptp(x[rows])) for rows in groups)
        notes.append(f"displacements scatter by up to {largest:.2g} mm in a hold: its median is its displacement")
        levels = [_level(x[rows]) for rows in groups]
    number = [int(readings.hold[rows[0]]) if readings.hold is not None else i + 1 for i, rows in enumerate(groups)]
    if readings.hold is None:
        notes.append(f"{len(groups)} holds: a new one wherever the displacement changes or the time starts again")
    return Cut(groups, number, levels, times, of_test, notes)


def _between_readings(times: list[Floats]) -> list[float]:
    """When each hold began: between two readings of a device that never paused, else at its first reading."""
    zeros = [float(of_hold[0]) for of_hold in times]
    for i, (before, after) in enumerate(zip(times, times[1:], strict=False), 1):
        gap = float(after[0] - before[-1])
        if len(after) >= CONTINUOUS and gap <= PAUSE * float(np.median(np.diff(after))):
            zeros[i] -= 0.5 * gap
    return zeros


def _since(readings: Readings, times: list[Floats], stated: TimeSince | None) -> TimeSince:
    """What times count from."""
    if stated is not None:
        return stated
    if readings.of_day:
        return "test"
    runs_on = all(after[0] >= before[-1] for before, after in zip(times, times[1:], strict=False))
    if not runs_on or len(times) < 2:
        return "hold"
    if times_run_on(times) < BY_CHANCE:
        return "test"
    row = len(times[0])
    answers = {"--time-since hold": "each hold", "--time-since test": "the whole test"}
    found = f"{times[1][0]:g} s at the first reading of the second hold, after {times[0][-1]:g} s in the first"
    place = str(readings.complain(row, "time", found, "")).removesuffix(", expected ")
    raise Undecided(place, "what times count from", answers)


def _by_plateaus(readings: Readings, note: str) -> Cut:
    """Holds of a continuous recording."""
    x, time = readings.displacement_mm, readings.time_s
    stays = np.flatnonzero(np.diff(time) <= 0)
    if len(stays):
        row = int(stays[0]) + 1
        found = f"{time[row]:g} s after {time[row - 1]:g} s"
        raise readings.complain(row, "time", found, "times that rise")
    found_holds = plateaus(x, time, readings.displacement_step_mm)
    kept = sum(p.end - p.begin for p in found_holds)
    if len(found_holds) < 2 or kept < COVERED * len(x):
        raise _too_few(readings, found_holds, kept)
    lefts = [0, *(p.left - 1 for p in found_holds[:-1])]
    moves = [float(time[p.begin] - time[left]) for p, left in zip(found_holds, lefts, strict=True)]
    zeros = [_moved(x, time, left, p) for p, left in zip(found_holds, lefts, strict=True)]
    rows = [_after_move(time, p, move) for p, move in zip(found_holds, moves, strict=True)]
    noise = noise_of(x, readings.displacement_step_mm)
    notes = [note] if note else []
    notes.append(
        f"a continuous recording of {len(x)} readings: {len(rows)} holds where the displacement stays within "
        f"{noise:.2g} mm or so, {len(x) - kept} readings of moves dropped"
    )
    notes.append(
        f"each hold begins in the middle of the move to it, for the wire creeps while it moves; moves took "
        f"{np.median(moves):.3g} s (median), and readings as soon after one are left out"
    )
    since = [time[r] - zero for r, zero in zip(rows, zeros, strict=True)]
    return Cut(rows, list(range(1, len(rows) + 1)), [_level(x[r]) for r in rows], since, True, notes)


def _too_few(readings: Readings, found_holds: Sequence[Plateau], kept: int) -> InputError:
    """The error of a recording without two holds; a stretch that is short beside the only one passes for a move."""
    rows = len(readings.time_s)
    expected = "at least two displacements that are held while tension is read"
    if len(found_holds) == 1 and kept >= COVERED * rows:
        hold = found_holds[0]
        before, after = hold.begin, rows - hold.left
        if max(before, after) >= FEWEST:
            row, where = (hold.begin, "from here on") if before >= after else (hold.left, "up to here")
            passed = f"{before} readings before" if before >= after else f"{after} readings after"
            found = f"one displacement that is held, {where}; the {passed} were taken for a move"
            expected += "; if those are a hold, number the holds in a column, without the readings of the move"
            return readings.complain(row, "displacement", found, expected)
    share = f"{100.0 * kept / rows:.0f} % of the readings"
    found = f"a displacement that stays in {share}, {len(found_holds)} time{'s' * (len(found_holds) != 1)}"
    row = found_holds[0].end if found_holds and found_holds[0].end < rows else 0
    return readings.complain(row, "displacement", found, f"{expected} (or a column of hold numbers)")


def _moved(x: Floats, time: Floats, left: int, hold: Plateau) -> float:
    """When the wire was moved to a hold: the mean time of the displacement's change, from the last reading before it.

    Creep that follows each small part of a move adds up, to first order in the move's duration, to that of the whole
    move made at this moment.
    """
    if hold.begin == left:
        return float(time[left])
    on_the_way = x[left : hold.begin + 1].copy()
    on_the_way[-1] = hold.level
    whole = hold.level - on_the_way[0]
    to_go = np.trapezoid(hold.level - on_the_way, time[left : hold.begin + 1])
    lasts = float(time[hold.begin] - time[left])
    return float(time[left]) + (float(np.clip(to_go / whole, 0.0, lasts)) if whole else 0.5 * lasts)


def _after_move(time: Floats, hold: Plateau, move_s: float) -> NDArray[np.int64]:
    """The rows of a hold that are as long after the move before it as that move took, or nearly all."""
    rows = np.arange(hold.begin, hold.end)
    since = time[rows] - time[hold.begin]
    if move_s <= 0.0 or len(rows) <= LONG * ARRIVING:
        return rows
    wait = min(move_s, AFTER_MOVE * float(since[-1]))
    return rows[max(ARRIVING, int(np.searchsorted(since, wait))) :]


def _level(x: Floats) -> float:
    """The median of displacements of one hold, with the digits that its standard error leaves."""
    level, error = float(np.median(x)), float(np.std(x)) / np.sqrt(len(x))
    digits = 6 if error == 0.0 else int(np.clip(1 - np.floor(np.log10(error)), 0, 6))
    return round(level, digits) + 0.0

"""Holds of a continuous recording: where what was set stays, each from the middle of the move to it.

A wire creeps while it moves, to first order as if the whole move were made at that moment.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from wirebayes.errors import InputError
from wirebayes.io.bench.cycles import cycles_before
from wirebayes.io.bench.plateaus import FEWEST, Plateau, noise_of, plateaus
from wirebayes.io.bench.recorded import BEGUN_BEFORE, CONTINUOUS, PAUSE, Cut, Cycles, Readings, level_of
from wirebayes.numeric.typing import Floats, Ints
from wirebayes.result_warnings import Notice
from wirebayes.sentences import counted, short, some_of

ARRIVING = 2  # readings by which the end of a move is known: none of them counts
LONG = 10  # times as many readings: shorter holds have none to spare
# of a hold at most is left out after a slow move; of slower ones k2 is off by up to 5 standard deviations
AFTER_MOVE = 0.1
SLACK = 0.05  # of what is read in the hold: a rest before it with less says nothing of the wire
AT_TURN = 0.05  # of the range of the way: as near to its end cycles turn
TURN = 0.5  # of the way to a hold: smaller ones are an overshoot or a drive that hunts
READ_ENOUGH = 10  # readings of a hold that is short beside the others: with fewer it is passed
OF_MOVES = 3.0  # times the moves beside it: a stop of a move that is made bit by bit is hardly longer than these
COVERED = 0.5  # of the readings in holds; a recording with less is a pull, not a test of holds


def by_plateaus(readings: Readings, resets: Sequence[str]) -> Cut:
    """Holds of a continuous recording.

    Raises
    ------
    InputError
        The setting never stays, a stretch of it would be dropped, or times do not rise.
    """
    x, time = readings.setting, readings.time_s
    found_holds = _found(readings)
    lefts = _lefts(found_holds)
    turns = [_last_turn(x, left, hold) for left, hold in zip(lefts, found_holds, strict=True)]
    moves, zeros = _moves_to(x, time, found_holds, turns)
    cycles = _cycles(readings, lefts, turns, zeros)
    rows: list[Ints] = []
    since: list[Floats] = []
    settings: list[float] = []
    durations: list[float] = []
    for hold, move, zero in zip(found_holds, moves, zeros, strict=True):
        kept = _after_move(time, hold, move)
        rows.append(kept)
        settings.append(level_of(x[kept]))
        since.append(time[kept] - zero)
        durations.append(time[hold.end - 1] - time[hold.begin])
    last = found_holds[-1].left - 1
    notes = [*resets, *_notes(readings, found_holds, float(np.median(moves)))]
    for each in cycles:
        notes.append(each.sentence)
    return Cut(
        rows=rows,
        number=list(range(1, len(rows) + 1)),
        setting=settings,
        time_s=since,
        end_s=_lengths(zeros, cycles, float(time[last])),
        of_test=True,
        notes=notes,
        clock_s=time,
        warnings=(*_slow(np.array(moves), np.array(durations)), *_unseen_moves(time, found_holds, moves)),
        cycles=cycles,
    )


def _found(readings: Readings) -> Sequence[Plateau]:
    """The holds, which have to be most of the recording."""
    _check_rising(readings)
    found_holds = _with_short_ones(readings, plateaus(readings.setting, readings.time_s, readings.step))
    kept = sum(p.end - p.begin for p in found_holds)
    if not found_holds or kept < COVERED * len(readings.setting):
        raise _too_few(readings, found_holds, kept)
    if len(found_holds) == 1:
        _check_only_hold(readings, found_holds[0])
    return found_holds


def _with_short_ones(readings: Readings, long_ones: Sequence[Plateau]) -> list[Plateau]:
    """The holds of a recording, and those that are short beside them but long beside the moves to and from them.

    Times of tests may go through decades. A short rest at zero before the test is none of its holds.
    """
    rests = plateaus(readings.setting, readings.time_s, readings.step, shortest=0.0)
    found = []
    for i, rest in enumerate(rests):
        at_zero = abs(rest.level) <= noise_of(readings.setting, readings.step)
        before_test = i == 0 and at_zero
        is_short_hold = not before_test and _pulls(readings, rest, long_ones) and _is_held(readings.time_s, rests, i)
        if rest in long_ones or is_short_hold:
            found.append(rest)
    return found


def _is_held(time: Floats, rests: Sequence[Plateau], i: int) -> bool:
    """Whether a rest is read often enough, and lasts long beside the moves to and from it."""
    rest = rests[i]
    begin_s, end_s = time[rest.begin], time[rest.end - 1]
    before_s = time[rests[i - 1].end - 1] if i else time[0]
    after_s = time[rests[i + 1].begin] if i + 1 < len(rests) else time[-1]
    move_s = max(begin_s - before_s, after_s - end_s)
    return bool(OF_MOVES * move_s <= end_s - begin_s and rest.end - rest.begin >= READ_ENOUGH)


def _pulls(readings: Readings, rest: Plateau, holds: Sequence[Plateau]) -> bool:
    """Whether more than next to nothing is read in a rest, beside the most that is read in some holds."""
    most = max((_read_in(readings, hold) for hold in holds), default=np.inf)
    return _read_in(readings, rest) > SLACK * most


def _read_in(readings: Readings, rest: Plateau) -> float:
    """What is read in a rest, in size."""
    return abs(float(np.median(readings.read[rest.begin : rest.end])))


def _moves_to(
    x: Floats, time: Floats, found_holds: Sequence[Plateau], turns: Sequence[int]
) -> tuple[list[float], list[float]]:
    """How long the move to each hold took, and when the hold begins.

    Parameters
    ----------
    x, time : (r,) array
    found_holds : sequence of Plateau
    turns : sequence of int
        The reading at which the move to each began.
    """
    zeros = [_moved(x, time, turn, p) for p, turn in zip(found_holds, turns, strict=True)]
    moves = [_lasted(time, turn, p, zero) for p, turn, zero in zip(found_holds, turns, zeros, strict=True)]
    moves[0] = min(moves[0], 2.0 * (float(time[found_holds[0].begin]) - zeros[0]))  # without a rest before the test
    return moves, zeros


def _lefts(found_holds: Sequence[Plateau]) -> list[int]:
    """The last reading before what lies between each hold and the one before."""
    return [0, *(p.left - 1 for p in found_holds[:-1])]


def _cycles(
    readings: Readings, lefts: Sequence[int], turns: Sequence[int], zeros: Sequence[float]
) -> tuple[Cycles, ...]:
    """The cycles before holds.

    Parameters
    ----------
    lefts, turns, zeros : sequences
        Of each hold the last reading before what lies before it, the one at which the last move to it began, and when
        it begins.
    """
    before = enumerate(zip(lefts, turns, zeros, strict=True), start=1)
    return tuple(cycles_before(readings, hold, left, turn, zero) for hold, (left, turn, zero) in before if turn > left)


def _lengths(zeros: Sequence[float], cycles: Sequence[Cycles], last_s: float) -> list[float | None]:
    """How long each hold lasts: until the next one begins, or the cycles before that."""
    cycled = {c.before_hold: c.begin_s for c in cycles}
    next_begins = [cycled.get(hold, zero) for hold, zero in enumerate(zeros[1:], start=2)]
    return [end - zero for end, zero in zip([*next_begins, last_s], zeros, strict=True)]


def _last_turn(x: Floats, left: int, hold: Plateau) -> int:
    """The reading at which the last move to a hold began: `left`, or after cycles without holds where the last turned.

    A turn counts that is as far from the hold as half of what lies between, as an overshoot is not, or where the wire
    turned before, as at the foot of cycles.
    """
    way = x[left : hold.begin + 1]
    return left + max(_far_turn(way, hold.level), _turn_again(way, hold.level))


def _far_turn(way: Floats, level: float) -> int:
    """The last turn that is as far from the hold as half of the way to it; 0 without one."""
    away = np.abs(level - way)
    farthest = len(away) - 1
    for i in range(len(away) - 1, -1, -1):
        if away[i] > away[farthest]:
            farthest = i
        if away[farthest] >= TURN * away.max() and away[i] < (1.0 - TURN) * away[farthest] and i < farthest:
            return farthest
    return 0


def _turn_again(way: Floats, level: float) -> int:
    """The last turn at the lowest or highest place of the way, where it was before and which it left; 0 without one."""
    span = float(np.ptp(way))
    last = 0
    for side in (way, -way):
        height = side - side.min()
        at_end = height <= AT_TURN * span
        hold_is_there = abs(level - way[height.argmin()]) <= AT_TURN * span
        left_between = np.flatnonzero(height > 0.5 * span)
        if hold_is_there or not left_between.size:
            continue
        visits = np.flatnonzero(at_end)
        beyond = left_between[left_between < visits[-1]]
        if beyond.size and visits[0] < beyond[-1]:
            last_visit = visits[visits > beyond[-1]]
            last = max(last, int(last_visit[height[last_visit].argmin()]))
    return last


def _lasted(time: Floats, left: int, hold: Plateau, zero_s: float) -> float:
    """How long a move took; 0 where nothing was recorded on the way, and a hold begins with its first reading."""
    return float(time[hold.begin]) - _set_out_s(time, left, hold) if zero_s < time[hold.begin] else 0.0


def _set_out_s(time: Floats, left: int, hold: Plateau) -> float:
    """When a move began: at the last reading before it, or after a pause an interval before the first on the way."""
    intervals = np.diff(time[left : hold.begin + 1])
    if len(intervals) > 1 and intervals[0] > PAUSE * np.median(intervals[1:]):
        return float(time[left + 1] - np.median(intervals[1:]))
    return float(time[left])


def _check_rising(readings: Readings) -> None:
    time = readings.time_s
    stays = np.flatnonzero(np.diff(time) <= 0)
    if len(stays):
        row = int(stays[0]) + 1
        raise readings.complain(row, "time", f"{time[row]:g} s after {time[row - 1]:g} s", "times that rise")


def _notes(readings: Readings, found_holds: Sequence[Plateau], move_s: float) -> list[str]:
    """What was understood and done."""
    kept = sum(p.end - p.begin for p in found_holds)
    noise = noise_of(readings.setting, readings.step)
    count = len(readings.setting)
    begins = f"each hold begins at its first reading, for no move to one was recorded; {BEGUN_BEFORE}"
    if move_s > 0.0:
        begins = (
            "each hold begins in the middle of the move to it, for the wire creeps while it moves; moves took "
            f"{short(move_s, 3)} s (median), and readings as soon after one are left out, up to a tenth of the hold"
        )
    return [
        f"a continuous recording of {count} readings: {counted(len(found_holds), 'hold')} where the {readings.role} "
        f"stays within {short(noise, 2)} {readings.unit} or so, {count - kept} readings of moves dropped",
        begins,
    ]


def _slow(moves_s: Floats, held_s: Floats) -> tuple[Notice, ...]:
    """A notice that most moves, (H,), took longer than the share of their holds, (H,), that is left out after them."""
    if np.median(moves_s / held_s) <= AFTER_MOVE:
        return ()
    text = (
        f"moves took {short(np.median(moves_s), 3)} s, {100.0 * np.median(moves_s / held_s):.0f} % of their holds "
        "(medians): what the wire does while it moves is taken as one step in the middle of the move, which is right "
        f"for moves of up to {100.0 * AFTER_MOVE:.0f} % of a hold; beyond, creep rates may be off by more than their "
        "intervals say, and discover may name effects that the moves made: move faster or hold longer"
    )
    return (Notice("left-out", text),)


def _unseen_moves(time: Floats, found_holds: Sequence[Plateau], moves_s: Sequence[float]) -> tuple[Notice, ...]:
    """A notice that the recording paused over the moves to some holds, while it shows those to others.

    If it always pauses, the notes say so.

    Parameters
    ----------
    time : array
        Of the readings, s.
    found_holds : sequence of Plateau, of length H
    moves_s : (H,) sequence of float
        How long the recording shows the wire moving to each hold, 0 where it shows nothing.
    """
    usual_s = float(np.median(moves_s))
    if usual_s == 0.0:
        return ()
    pauses: dict[int, float] = {}
    for i, (before, hold) in enumerate(pairwise(found_holds), start=1):
        pause_s = float(time[hold.begin] - time[before.left - 1])
        if moves_s[i] == 0.0 and pause_s > usual_s:
            pauses[i + 1] = pause_s
    if not pauses:
        return ()
    plural = "s" if len(pauses) > 1 else ""
    holds = some_of([str(number) for number in pauses])
    longest = short(max(pauses.values()), 3)
    text = (
        f"the recording pauses before hold{plural} {holds}, for up to {longest} s, and the move "
        "is not in it: such a hold is taken to begin at its first reading, and the hold before it to last "
        "until then; where the wire was moved earlier, creep rates are off by more than their intervals say"
    )
    return (Notice("hold-ends", text),)


def _check_only_hold(readings: Readings, hold: Plateau) -> None:
    """Refuse a recording in which the setting stays elsewhere, too, but too shortly for a hold beside the only one.

    A rest before the test, in which next to nothing was read, is none.
    """
    x, rows = readings.setting, len(readings.setting)
    of_hold = abs(float(np.median(readings.read[hold.begin : hold.end])))
    for rest in plateaus(x, readings.time_s, readings.step, shortest=0.0):
        if rest.begin < hold.end and hold.begin < rest.end:
            continue
        slack = abs(float(np.median(readings.read[rest.begin : rest.end]))) <= SLACK * of_hold
        if rest.end <= hold.begin and slack:
            continue
        raise _too_few(readings, [hold], rows)


def _too_few(readings: Readings, found_holds: Sequence[Plateau], kept: int) -> InputError:
    """The error of a recording without holds; a stretch that is short beside the only one passes for a move."""
    rows = len(readings.time_s)
    role = readings.role
    other = "tension" if role == "displacement" else "displacement"
    expected = f"{role}s that are held while {other} is read"
    if len(found_holds) == 1 and kept >= COVERED * rows:
        passed = _taken_for_a_move(readings, found_holds[0])
        if passed is not None:
            row, found = passed
            expected += "; if those are a hold, number the holds in a column, without the readings of the move"
            return readings.complain(row, role, found, expected)
    percent = 100.0 * kept / rows
    times = counted(len(found_holds), "time")
    found = f"a {role} that stays in {percent:.0f} % of the readings, {times}"
    expected += " (or a column of hold numbers)"
    row = 0
    if found_holds:
        end = found_holds[0].end
        row = end if end < rows else 0
    return readings.complain(row, role, found, expected)


def _taken_for_a_move(readings: Readings, hold: Plateau) -> tuple[int, str] | None:
    """The longer stretch beside the only hold, by its row and in words; None where neither could be a hold."""
    before = hold.begin
    after = len(readings.time_s) - hold.left
    if max(before, after) < FEWEST:
        return None
    held = f"one {readings.role} that is held"
    if before >= after:
        return hold.begin, f"{held}, from here on; the {before} readings before were taken for a move"
    return hold.left, f"{held}, up to here; the {after} readings after were taken for a move"


def _moved(x: Floats, time: Floats, left: int, hold: Plateau) -> float:
    """When the wire was moved to a hold: the mean time of the displacement's change, from the last reading before it.

    Creep that follows each small part of a move adds up, to first order in the move's duration, to that of the whole
    move made at this moment.
    """
    begin_s = float(time[hold.begin])
    if hold.begin == left:
        return begin_s
    if hold.begin == left + 1 and _paused(time, left, hold):
        return begin_s  # nothing was recorded on the way
    begun = _set_out_s(time, left, hold)
    lasts = begin_s - begun
    on_the_way = x[left : hold.begin + 1].copy()
    on_the_way[-1] = hold.level
    whole = hold.level - on_the_way[0]
    moments = np.concatenate([[begun], time[left + 1 : hold.begin + 1]])
    to_go = np.trapezoid(hold.level - on_the_way, moments)
    if not whole:
        return begun + 0.5 * lasts
    mean_s = np.clip(to_go / whole, 0.0, lasts)
    return begun + float(mean_s)


def _paused(time: Floats, left: int, hold: Plateau) -> bool:
    """Whether the recording paused before a hold, which may be read too seldom to say so."""
    of_hold = time[hold.begin : hold.end]
    if len(of_hold) < CONTINUOUS:
        return True
    interval = float(np.median(np.diff(of_hold)))
    return bool(time[hold.begin] - time[left] > PAUSE * interval)


def _after_move(time: Floats, hold: Plateau, move_s: float) -> Ints:
    """The rows of a hold that are as long after the move before it as that move took, or nearly all."""
    rows = np.arange(hold.begin, hold.end)
    since = time[rows] - time[hold.begin]
    if move_s <= 0.0 or len(rows) <= LONG * ARRIVING:
        return rows
    wait = min(move_s, AFTER_MOVE * float(since[-1]))
    return rows[max(ARRIVING, int(np.searchsorted(since, wait))) :]

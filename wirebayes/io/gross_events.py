"""Gross events of a test: a break, a sensor at its limit, a zeroed sensor, a dropout, each with its readings.

What is compared are readings with readings and settings with settings of the same test, so no unit matters. One list
for `import`, `check`, `fit` and `discover`: they name the same events in the same words, and leave out the same
readings where that is asked for.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from wirebayes.io.checked_test import reading_noise
from wirebayes.io.experiment import Experiment
from wirebayes.io.readings import Hold
from wirebayes.numeric.typing import Floats, Ints
from wirebayes.sentences import counted, holds_in_words, short
from wirebayes.wire.protocol import Protocol

NOTHING = 0.03  # of the reading before: no wire relaxes so far from one reading to the next
SUBSTANTIAL = 0.1  # of the largest reading: a fall from less may be a wire that goes slack
KEPT = 0.7  # of its first reading a hold keeps until a fall that is one; a wire that relaxes by more may go slack
FEWEST, KEPT_IN_ALL = 3, 0.85  # earlier holds that show how little the wire relaxes, where its own hold cannot
SUDDEN = 3.0  # times the time of the reading before: by then creep has gone on little further
STAYED = 0.5  # of the reading before a dropout: the wire is still there; less is another zero
JUMP = 1.0  # of all elongation before, beyond what a further weight adds: no creep from one reading to the next
AT_LIMIT = 3  # readings at one value, in two holds at least
MOVED = 5.0  # steps and noise levels by which readings at a limit should differ: not by chance the same


@dataclass(frozen=True)
class Event:
    """Something gross that happened to the readings of a test.

    Attributes
    ----------
    kind : str
        ``break``, ``dropout``, ``tared``, ``saturation`` or ``clipped``.
    text : str
        What, where, what to do.
    readings : (n,) array of int
        Which of the test's readings, counted through all holds.
    """

    kind: str
    text: str
    readings: Ints


@dataclass(frozen=True)
class _Test:
    """The readings of a test in one row.

    Attributes
    ----------
    hold, number : (n,) array of int
        Position among the recorded holds, and number, of each reading's hold.
    setting, time_s, read : (n,) array
    noise : float
        Standard deviation of a reading beside the course of its hold; rounding at least.
    what, unit : str
        What is read.
    """

    hold: Ints
    number: Ints
    setting: Floats
    time_s: Floats
    read: Floats
    noise: float
    what: str
    unit: str

    def place(self, i: int) -> str:
        """Where a reading stands."""
        return f"hold {self.number[i]} from {self.time_s[i]:g} s on"

    def holds(self, readings: Ints) -> str:
        """The holds of some readings, in words."""
        numbers = np.unique(self.number[readings])
        if len(numbers) > 2 and np.isin(self.number[readings[0] : readings[-1] + 1], numbers).all():
            return f"holds {numbers[0]} to {numbers[-1]}"
        return holds_in_words(numbers)


def of_readings(protocol: Protocol, readings: Floats, resolution: float) -> list[Event]:
    """The gross events of a test.

    Parameters
    ----------
    readings : (H, R) array
        Tensions, or displacements where tensions were set; padded as the protocol is.
    resolution : float
        To which they were rounded; 0 where it is not stated.

    Returns
    -------
    list of Event
        In order of the test; none where the readings are as a bench gives them.
    """
    rows, _ = np.nonzero(protocol.mask)
    if len(rows) < AT_LIMIT:
        return []
    each = [row[mask] for row, mask in zip(readings, protocol.mask, strict=True) if mask.any()]
    forces = protocol.control == "displacement"
    _, recorded_hold = np.unique(rows, return_inverse=True)
    test = _Test(
        recorded_hold,
        protocol.number[rows],
        protocol.setting[rows],
        protocol.time_s[protocol.mask],
        readings[protocol.mask],
        reading_noise(each, resolution),
        "tension" if forces else "displacement",
        "N" if forces else "mm",
    )
    # an elongation that returns to zero is a recovery, not a fall to nothing
    found = _falls(test) if forces else _jumps(test)
    away = {int(i) for event in found for i in event.readings}
    for event in _limits(test, resolution):
        if not away.issuperset(event.readings.tolist()):
            found.append(event)
    return sorted(found, key=lambda event: int(event.readings[0]))


def gross_events_of(experiment: Experiment) -> list[Event]:
    """The gross events of one test."""
    return of_readings(experiment.protocol(), experiment.readings(), experiment.resolution)


def readings_left(protocol: Protocol, readings: Floats, events: Sequence[Event]) -> tuple[Protocol, Floats]:
    """Protocol and readings without those of some events; holds keep their durations.

    Parameters
    ----------
    readings : (H, R) array
    events : sequence of Event
    """
    if not events:
        return protocol, readings
    kept = protocol.mask.copy()
    rows, columns = np.nonzero(protocol.mask)
    gone = np.concatenate([event.readings for event in events])
    kept[rows[gone], columns[gone]] = False
    first = np.argsort(~kept, axis=1, kind="stable")  # what is kept moves to the front of its hold

    def moved(values: Floats) -> Floats:
        left = np.where(kept, values, 0.0)
        return np.take_along_axis(left, first, axis=1)

    warming = None
    if protocol.warming_K is not None:
        warming = moved(protocol.warming_K)
    mask = np.take_along_axis(kept, first, axis=1)
    shorter = replace(protocol, time_s=moved(protocol.time_s), mask=mask, warming_K=warming)
    return shorter, moved(readings)


def without_gross_events(experiment: Experiment, events: Sequence[Event]) -> Experiment:
    """The experiment without the readings of some events.

    Holds keep their durations; one that keeps no reading is unrecorded. Nothing is kept after a last reading.

    Parameters
    ----------
    events : sequence of Event
    """
    dropped = {int(reading) for event in events for reading in event.readings}
    holds: list[Hold] = []
    begin = 0
    for hold in experiment.holds:
        end = begin + hold.time_s.size
        kept = np.array([reading not in dropped for reading in range(begin, end)], dtype=bool)
        holds.append(hold.of_readings(kept))
        begin = end
    while holds and not holds[-1].recorded:
        holds.pop()
    last_reading = begin - 1
    if holds and last_reading in dropped:  # how long the last one was as it should be, its last reading says
        last = holds.pop()
        duration_s = float(last.time_s[-1])
        holds.append(replace(last, duration_s=duration_s))
    return replace(experiment, holds=tuple(holds))


def _falls(test: _Test) -> list[Event]:
    """Runs of readings that fall to nothing where the displacement did not: to the end, for a while, or to a new zero.

    A wire that is unloaded may go slack, so it counts only within a hold or where the wire was stretched further.
    """
    read = test.read
    events = list[Event]()
    least = max(SUBSTANTIAL * float(read.max()), MOVED * test.noise)
    i = 1
    while i < len(read):
        if not _falls_at(test, i, least):
            i += 1
            continue
        end = _end_of_fall(read, i)
        event = _fall(test, i, end)
        events.append(event)
        if event.kind != "dropout":
            break
        i = end
    return events


def _falls_at(test: _Test, i: int, least: float) -> bool:
    """Whether a tension of at least so much falls to nothing at a reading, and unloading does not explain it."""
    before = float(test.read[i - 1])
    if before < least or abs(test.read[i]) > NOTHING * before:
        return False
    same_hold = test.hold[i] == test.hold[i - 1]
    stretched = test.setting[i] > test.setting[i - 1]
    return bool(same_hold or stretched) and _held_before(test, i)


def _end_of_fall(read: Floats, begin: int) -> int:
    """The first reading after a fall that is something again; the number of readings where none is."""
    before = float(read[begin - 1])
    something = np.flatnonzero(np.abs(read[begin:]) > NOTHING * before)
    return begin + int(something[0]) if len(something) else len(read)


def _held_before(test: _Test, i: int) -> bool:
    """Whether the tension had stayed before a fall: a wire may creep until it is slack, but not all at once."""
    own = test.read[:i][test.hold[:i] == test.hold[i]]
    sudden = test.time_s[i] <= SUDDEN * test.time_s[i - 1]
    if len(own) > 1 and sudden:
        return bool(own[-1] >= KEPT * own[0])
    kept = []
    for hold in np.unique(test.hold[test.hold < test.hold[i]]):
        row = test.read[test.hold == hold]
        if len(row) > 1 and row[0] > 0:
            kept.append(row[-1] / row[0])
    return len(kept) >= FEWEST and min(kept) >= KEPT_IN_ALL


def _fall(test: _Test, begin: int, end: int) -> Event:
    """The event of readings that fell to nothing, by what came after them."""
    read, place = test.read, test.place(begin)
    if end == len(read):
        text = f"tension falls to 0 in {place} and stays there: did the wire break or slip? leave these readings out"
        return Event("break", text, np.arange(begin, end))
    if read[end] >= STAYED * read[begin - 1]:
        count = end - begin
        times = counted(count, "reading")
        text = f"tension falls to 0 in {place} for {times} and comes back: did the sensor drop out? leave them out"
        return Event("dropout", text, np.arange(begin, end))
    text = (
        f"tension falls to 0 in {place} and rises from there: was the sensor zeroed, or did the wire slip? leave these "
        "readings out, or add the tension that was taken off"
    )
    return Event("tared", text, np.arange(begin, len(read)))


def _jumps(test: _Test) -> list[Event]:
    """The readings from where a displacement under weights leaves its course, never to come back, if it does.

    What a further weight adds is taken from the holds before. A hold with less weight than the one before may give back
    what it likes, and the first two holds have nothing to compare with.
    """
    hold, time_s, setting, read = test.hold, test.time_s, test.setting, test.read
    for i in np.flatnonzero(hold >= 2).tolist():
        begins = hold[i] != hold[i - 1]
        sudden = begins or time_s[i] <= SUDDEN * time_s[i - 1]
        if not sudden:
            continue
        jump = _beyond_weight(test, i)
        weight_before = setting[hold < hold[i]][-1]
        if jump < 0.0 and setting[i] < weight_before:
            continue
        before = np.ptp(read[:i])
        usual = max(JUMP * before, MOVED * test.noise)
        if abs(jump) > usual and _stays_away(read, i, jump):
            text = (
                f"displacement jumps by {short(jump, 3)} mm in {test.place(i)} and stays there: did the wire break "
                "or slip? leave these readings out"
            )
            return [Event("break", text, np.arange(i, len(read)))]
    return []


def _beyond_weight(test: _Test, i: int) -> float:
    """How far a displacement moves to a reading, beyond what a further weight adds by the readings before."""
    read, weight = test.read, test.setting
    before, hung = np.ptp(read[:i]), np.ptp(weight[:i])
    added = 0.0
    if hung > 0.0:
        added = before / hung * (weight[i] - weight[i - 1])
    return float(read[i] - read[i - 1] - added)


def _stays_away(read: Floats, i: int, jump: float) -> bool:
    """Whether no later reading comes back over a jump."""
    way = (read[i:] - read[i - 1]) * np.sign(jump)
    return bool((way >= STAYED * abs(jump)).all())


def _limits(test: _Test, resolution: float) -> list[Event]:
    """The same extreme value again and again while the setting moves."""
    read, unit = test.read, test.unit
    events = []
    set_what = "displacement" if unit == "N" else "tension"
    step = max(resolution, test.noise)
    nothing = max(NOTHING * float(np.abs(read).max()), MOVED * step)
    for kind, value, word in (("saturation", read.max(), "largest"), ("clipped", read.min(), "smallest")):
        at = np.flatnonzero(read == value)
        if len(at) < AT_LIMIT or value <= nothing:  # a slack wire rightly reads nothing, or a little less
            continue
        moved = float(np.ptp(test.setting[at]))
        expected = _slope_beside(test, at) * moved
        if expected <= MOVED * step:
            continue
        text = (
            f"{len(at)} readings in {test.holds(at)} all read {value:g} {unit}, the {word} of the test, while the "
            f"{set_what} changes: the sensor or its amplifier is at its limit; leave these readings out"
        )
        events.append(Event(kind, text, at))
    return events


def _slope_beside(test: _Test, at: Ints) -> float:
    """How far readings change with the setting between neighbouring holds without readings at a limit; the median."""
    free = np.setdiff1d(test.hold, test.hold[at])
    settings = np.array([test.setting[test.hold == h][0] for h in free])
    means = np.array([test.read[test.hold == h].mean() for h in free])
    moves = np.diff(settings)
    slopes = np.abs(np.diff(means)[moves != 0.0] / moves[moves != 0.0])
    return float(np.median(slopes)) if len(slopes) else 0.0

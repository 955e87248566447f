"""What a protocol file requests of a stored posterior: replicates, holds that continue the test, or a new sample."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from wirebayes.errors import InputError, shown
from wirebayes.io.experiment import protocol_of
from wirebayes.io.readings import READ, SET, Hold, protocol_holds
from wirebayes.numeric.typing import Array, Bools, Floats, Ints
from wirebayes.prediction.predictive import PredictionRequest
from wirebayes.results.read_back import Stored
from wirebayes.sentences import counted, short
from wirebayes.strict.table import CsvTable
from wirebayes.wire.effect import EventEffect
from wirebayes.wire.protocol import Protocol


@dataclass(frozen=True)
class ProtocolRequest:
    """A checked protocol file.

    Attributes
    ----------
    stored : Stored
        The posterior; for a fresh sample without the one-off events, which happened to the tested one.
    prediction : PredictionRequest
    holds : tuple of Hold
        As the file has them; the requested holds of `prediction` in the same order.
    sentence : str
        Which sample is predicted, given what.
    """

    stored: Stored
    prediction: PredictionRequest
    holds: tuple[Hold, ...]
    sentence: str


def request_of(table: CsvTable, stored: Stored, *, fresh: bool = False) -> ProtocolRequest:
    """Check the table of a protocol against what was trained on.

    Parameters
    ----------
    table : CsvTable
        Rows of a protocol file, or of arrays given in its place: ``hold``, what is set (``displacement_mm``, or
        ``tension_N`` under weights) and ``time_s``, with ``temperature_C`` where the training data had it, and
        optionally what is read, filled only at a hold's first time.
    stored : Stored
        The posterior.
    fresh : bool
        The table is the whole history of another sample. Otherwise its holds are those of the tested sample: repeated
        ones are replicated, later ones begin when the last trained hold ended.

    Raises
    ------
    InputError
        With the line, column, what was found and what was expected.
    """
    trained = stored.sample.protocol
    file = _File(table, protocol_holds(table, trained.length_mm, trained.control))
    file.check_temperature(trained.reference_C is not None)
    if stored.likelihood == "hold":
        file.check_first_readings()
    elif trained.control == "force" and stored.sample.model.law == "modified":
        file.check_weights(stored)
    return _of_fresh_sample(file, stored) if fresh else _of_tested_sample(file, stored)


def _of_fresh_sample(file: "_File", stored: Stored) -> ProtocolRequest:
    """The holds are all that ever happens to another sample."""
    for i in range(len(file.holds)):
        file.check_temperatures_given(i)
    temperature_C = file.holds[0].temperature_C
    began_at = None if temperature_C is None else float(temperature_C[0])
    alone = protocol_of(file.holds, stored.sample.protocol.length_mm, began_at)
    every = np.ones(len(file.holds), bool)
    prediction = PredictionRequest(alone, 0, every, file.first)
    return ProtocolRequest(_without_events(stored), prediction, file.holds, _FRESH)


def _of_tested_sample(file: "_File", stored: Stored) -> ProtocolRequest:
    """Holds that were trained on are replicated; the others follow the last one."""
    trained = stored.sample.protocol
    row_of = {int(number): row for row, number in enumerate(trained.number) if number >= 0}
    file.check_repeats(trained, row_of)
    rows = []
    later = []
    repeated = []
    for hold in file.holds:
        number = int(hold.number or 0)
        is_known = number in row_of
        repeated.append(is_known)
        if is_known:
            rows.append(row_of[number])
        else:
            later.append(number)
    own_rows = np.array(rows, int)
    prediction = _continued(file, trained, own_rows, np.array(repeated))
    replicates = tuple(trained.number[own_rows])
    sentence = _tested(replicates, later, max(row_of), stored.likelihood)
    return ProtocolRequest(stored, prediction, file.holds, sentence)


def _continued(file: "_File", trained: Protocol, rows: Ints, repeated: Bools) -> PredictionRequest:
    """The holds of a test with those that a file adds.

    Parameters
    ----------
    rows : (m,) int array
        Trained holds that the file repeats.
    repeated : (holds of the file,) bool array
    """
    holds = len(trained.number)
    requested = np.zeros(holds, bool)
    requested[rows] = True
    first = np.full(holds, np.nan)
    first[rows] = file.first[repeated]
    after = []
    for hold, known in zip(file.holds, repeated, strict=True):
        if not known:
            after.append(hold)
    whole = trained
    if after:
        later = protocol_of(tuple(after), trained.length_mm, trained.reference_C)
        whole = _joined(trained, later)
    all_later = np.ones(len(after), bool)
    requested = np.append(requested, all_later)
    first = np.append(first, file.first[~repeated])
    return PredictionRequest(whole, holds, requested, first)


_FRESH = "predicted as a fresh sample with no history: the protocol is all that happens to it"


def _tested(replicates: Sequence[int], later: Sequence[int], last: int, likelihood: str) -> str:
    """Which holds of the tested sample are predicted, what is given of them, and which holds the history omits."""
    parts = []
    if replicates:
        parts.append(f"{_listed(_ranges(replicates))} predicted as replicates of the tested ones")
    if later:
        given = "all readings of the test" if likelihood == "chain" else "the first reading of each"
        parts.append(
            f"{_listed(_ranges(later))} predicted as a continuation of the test from the end of hold {last} on, given "
            f"{given} (--fresh predicts a fresh sample instead)"
        )
    skipped = _skipped([last, *later])
    if skipped:
        parts.append(f"nothing is assumed to have happened in between: {_listed(skipped)} not in its history")
    return "; ".join(parts)


def _skipped(numbers: Sequence[int]) -> list[tuple[int, int]]:
    """First and last of each run of numbers that is missing among rising ones."""
    gaps = []
    for before, after in pairwise(numbers):
        if after > before + 1:
            gaps.append((before + 1, after - 1))
    return gaps


def _ranges(numbers: Sequence[int]) -> list[tuple[int, int]]:
    """First and last of each run of neighbours among rising numbers."""
    ranges: list[tuple[int, int]] = []
    for number in map(int, numbers):
        if ranges and number == ranges[-1][1] + 1:
            ranges[-1] = (ranges[-1][0], number)
        else:
            ranges.append((number, number))
    return ranges


def _listed(ranges: Sequence[tuple[int, int]]) -> str:
    first, last = ranges[0]
    several = len(ranges) > 1 or first != last
    word = "holds" if several else "hold"
    each = [str(first) if first == last else f"{first} to {last}" for first, last in ranges]
    return f"{word} {', '.join(each)}"


@dataclass(frozen=True)
class _File:
    """The holds of a protocol file, and where each reading stands in it."""

    table: CsvTable
    holds: tuple[Hold, ...]

    @property
    def first(self) -> Floats:
        """What was read first in each hold; NaN where it is not given."""
        return np.array([hold.readings[0] for hold in self.holds])

    def complain(self, hold: int, reading: int, column: str, found: str, expected: str) -> InputError:
        """The error for one cell of the file.

        Parameters
        ----------
        hold, reading : int
            Positions of the hold in the file and of the reading in its hold.
        found, expected : str
            As the message shows them.
        """
        row = sum(len(h.time_s) for h in self.holds[:hold]) + reading
        return self.table.complain(row, column, found, expected)

    def check_temperature(self, logged: bool) -> None:
        given = self.holds[0].temperature_C
        if logged and given is None:
            expected = "one, because the training data had temperatures"
            raise self.complain(0, 0, "temperature_C", "no column temperature_C", expected)
        if given is not None and not logged:
            expected = "no column temperature_C, because the training data had no temperatures"
            raise self.complain(0, 0, "temperature_C", f"{given[0]:g}", expected)

    def check_first_readings(self) -> None:
        for i, hold in enumerate(self.holds):
            first = hold.readings[0]
            column = READ[hold.control]
            if not np.isfinite(first):
                expected = "the hold's first reading, because the posterior is hold by hold"
                raise self.complain(i, 0, column, f"no {column}", expected)
            if hold.control == "displacement" and first <= 0:
                expected = "the hold's first reading, above 0 N, because the posterior is hold by hold"
                raise self.complain(i, 0, column, shown(float(first)), expected)

    def check_weights(self, stored: Stored) -> None:
        """Refuse weights that by eq (3) no wire as stiff as the posterior says can bear."""
        limit = float(np.min(stored.draws["k1"] - _WEIGHT_SDS * stored.draws["setting_sd"]))
        for i, hold in enumerate(self.holds):
            if hold.setting >= limit:
                expected = f"a tension below {short(limit, 4)} N: eq (3) allows none as large as k1"
                raise self.complain(i, 0, SET[hold.control], f"{hold.setting:g}", expected)

    def check_repeats(self, trained: Protocol, row_of: dict[int, int]) -> None:
        """Refuse holds between the trained ones, and repeated ones that are not as they were trained on."""
        last = max(row_of)
        for i, hold in enumerate(self.holds):
            number = int(hold.number or 0)
            if number in row_of:
                self._check_repeat(i, trained, row_of[number])
            elif number < last:
                known = ", ".join(str(n) for n in sorted(row_of))
                expected = f"one of the trained holds ({known}), or one after hold {last}, or --fresh"
                raise self.complain(i, 0, "hold", str(number), expected)
            else:
                self.check_temperatures_given(i)

    def check_temperatures_given(self, i: int) -> None:
        """Refuse a hold to come whose temperature is not known at all times."""
        temperature_C = self.holds[i].temperature_C
        if temperature_C is not None and np.isnan(temperature_C).any():
            k = int(np.flatnonzero(np.isnan(temperature_C))[0])
            raise self.complain(i, k, "temperature_C", "an empty cell", "a temperature in °C")

    def _check_repeat(self, i: int, trained: Protocol, row: int) -> None:
        hold = self.holds[i]
        setting = trained.setting[row]
        if hold.setting != setting:
            expected = f"{setting:g}, as hold {hold.number} was trained on"
            raise self.complain(i, 0, SET[hold.control], f"{hold.setting:g}", expected)
        mask = trained.mask[row]
        times = read = trained.time_s[row][mask]
        ends = trained.duration_s[row]
        count = len(read)
        one_more = len(hold.time_s) == count + 1
        if one_more and ends > read[-1]:
            times = np.append(read, ends)  # the row that says when the hold ended
        self._check_times(i, times)
        reference_C = trained.reference_C
        if trained.warming_K is not None and reference_C is not None:
            warming = trained.warming_K[row]
            logged = reference_C + warming[:count]
            self._check_temperatures(i, logged)

    def _check_times(self, i: int, times: Floats) -> None:
        hold = self.holds[i]
        for k in range(max(len(times), len(hold.time_s))):
            if k >= len(hold.time_s):
                found = f"{counted(k, 'reading')} of hold {hold.number}"
                raise self.complain(i, k - 1, "time_s", found, f"{len(times)}, as it was trained on")
            if k >= len(times) or hold.time_s[k] != times[k]:
                listed = ", ".join(f"{t:g}" for t in times)
                expected = f"the times hold {hold.number} was trained on: {listed}"
                raise self.complain(i, k, "time_s", f"{hold.time_s[k]:g}", expected)

    def _check_temperatures(self, i: int, logged: Floats) -> None:
        hold = self.holds[i]
        if hold.temperature_C is None:
            return
        same = np.abs(hold.temperature_C[: len(logged)] - logged) <= _SAME_K  # an empty cell, NaN, is not the same
        if not same.all():
            k = int(np.flatnonzero(~same)[0])
            empty = np.isnan(hold.temperature_C[k])
            found = "an empty cell" if empty else f"{hold.temperature_C[k]:g}"
            expected = f"{logged[k]:g}, as hold {hold.number} was trained on"
            raise self.complain(i, k, "temperature_C", found, expected)


_WEIGHT_SDS = 6.0  # standard deviations of a weight's error: among millions of draws none is further off
_SAME_K = 1e-6  # kelvin: readings are stored as differences from the first, so only rounding is forgiven


def _joined(before: Protocol, after: Protocol) -> Protocol:
    """One protocol after another, padded to the same width."""
    width = max(before.time_s.shape[1], after.time_s.shape[1])

    def padded(array: Array) -> Floats:
        return np.pad(array.astype(float), [(0, 0), (0, width - array.shape[1])])

    time_s = np.concatenate([padded(before.time_s), padded(after.time_s)])
    mask = np.concatenate([padded(before.mask), padded(after.mask)]) > 0
    warming = None
    if before.warming_K is not None and after.warming_K is not None:
        warming = np.concatenate([padded(before.warming_K), padded(after.warming_K)])
    return Protocol(
        length_mm=before.length_mm,
        setting=np.concatenate([before.setting, after.setting]),
        time_s=time_s,
        mask=mask,
        duration_s=np.concatenate([before.duration_s, after.duration_s]),
        number=np.concatenate([before.number, after.number]),
        warming_K=warming,
        reference_C=before.reference_C,
        control=before.control,
    )


def _without_events(stored: Stored) -> Stored:
    sample = stored.sample
    lasting = []
    for effect in sample.model.effects:
        if not isinstance(effect, EventEffect) and effect.place != "before":
            lasting.append(effect)
    model = replace(sample.model, effects=tuple(lasting))
    return replace(stored, sample=replace(sample, model=model))

"""What a protocol file asks of a stored posterior: replicates, holds to come, or a fresh sample."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wirebayes.bayes.result import Stored
from wirebayes.discrepancy.predictive import Question
from wirebayes.errors import InputError
from wirebayes.experiment import protocol_of
from wirebayes.readings import Hold, read_protocol, read_text, shown
from wirebayes.wire.effect import EventEffect
from wirebayes.wire.protocol import Protocol

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Asked:
    """A checked protocol file.

    Attributes
    ----------
    stored : Stored
        The posterior; without the one-off events where a fresh sample is asked for, as they happened to another.
    question : Question
    holds : tuple of Hold
        As the file has them; the asked holds of the question in the same order.
    fresh : bool
        No hold of the training is repeated, so nothing went before.
    """

    stored: Stored
    question: Question
    holds: tuple[Hold, ...]
    fresh: bool


def read_question(path: Path, stored: Stored) -> Asked:
    """Read a protocol file and check it against what was trained on.

    Parameters
    ----------
    path : Path
        Columns ``hold,displacement_mm,time_s``, with ``temperature_C`` where the training data had it, and optionally
        ``tension_N``, filled only at a hold's first time.
    stored : Stored

    Returns
    -------
    Asked

    Raises
    ------
    InputError
        With the file, line, column, what was found and what was expected.
    """
    trained = stored.sample.protocol
    file = _File(path, read_protocol(path, trained.length_mm))
    file.check_temperature(trained.warming_K is not None)
    if stored.likelihood == "hold":
        file.check_first_readings()
    row_of = {int(number): row for row, number in enumerate(trained.number) if number >= 0}
    first = np.array([hold.tension_N[0] for hold in file.holds])
    repeated = np.array([hold.number in row_of for hold in file.holds])
    if not repeated.any():
        began_at = None if file.holds[0].temperature_C is None else float(file.holds[0].temperature_C[0])
        alone = protocol_of(file.holds, trained.length_mm, began_at)
        return Asked(_without_events(stored), Question(alone, 0, np.ones(len(first), bool), first), file.holds, True)
    file.check_repeats(trained, row_of)
    rows = np.array([row_of[int(h.number or 0)] for h, known in zip(file.holds, repeated, strict=True) if known])
    asked = np.zeros(len(trained.number), bool)
    asked[rows] = True
    given = np.full(len(trained.number), np.nan)
    given[rows] = first[repeated]
    after = tuple(h for h, known in zip(file.holds, repeated, strict=True) if not known)
    reference = file.reference_C(trained, row_of)
    whole = _joined(trained, protocol_of(after, trained.length_mm, reference)) if after else trained
    everything = np.append(asked, np.ones(len(after), bool))
    question = Question(whole, len(trained.number), everything, np.append(given, first[~repeated]))
    return Asked(stored, question, file.holds, False)


@dataclass(frozen=True)
class _File:
    """The holds of a protocol file, and where each reading stands in it."""

    path: Path
    holds: tuple[Hold, ...]

    def complain(self, hold: int, reading: int, column: str, found: str, expected: str) -> InputError:
        header = [field.strip() for field in read_text(self.path).splitlines()[0].split(",")]
        line = 2 + sum(len(h.time_s) for h in self.holds[:hold]) + reading
        place = f"line {line}, column {header.index(column) + 1} ({column})" if column in header else "line 1, header"
        return InputError(f"{self.path}, {place}: found {found}, expected {expected}")

    def check_temperature(self, logged: bool) -> None:
        if logged and self.holds[0].temperature_C is None:
            raise self.complain(
                0, 0, "temperature_C", "no column temperature_C", "one, because the training data had temperatures"
            )

    def check_first_readings(self) -> None:
        for i, hold in enumerate(self.holds):
            if not hold.tension_N[0] > 0:
                expected = "the hold's first reading, above 0 N, because the posterior is hold by hold"
                found = "no tension_N" if np.isnan(hold.tension_N[0]) else shown(float(hold.tension_N[0]))
                raise self.complain(i, 0, "tension_N", found, expected)

    def check_repeats(self, trained: Protocol, row_of: dict[int, int]) -> None:
        last = max(row_of)
        for i, hold in enumerate(self.holds):
            number = int(hold.number or 0)
            if number not in row_of:
                if number < last:
                    known = ", ".join(str(n) for n in sorted(row_of))
                    expected = f"one of the trained holds ({known}), or one after hold {last}"
                    raise self.complain(i, 0, "hold", str(number), expected)
                continue
            row = row_of[number]
            if hold.displacement_mm != trained.displacement_mm[row]:
                expected = f"{trained.displacement_mm[row]:g}, as hold {number} was trained on"
                raise self.complain(i, 0, "displacement_mm", f"{hold.displacement_mm:g}", expected)
            times = trained.time_s[row][trained.mask[row]]
            for k in range(max(len(times), len(hold.time_s))):
                if k >= len(hold.time_s):
                    found = f"{k} reading{'s' * (k != 1)} of hold {number}"
                    raise self.complain(i, k - 1, "time_s", found, f"{len(times)}, as it was trained on")
                if k >= len(times) or hold.time_s[k] != times[k]:
                    listed = ", ".join(f"{t:g}" for t in times)
                    expected = f"the times hold {number} was trained on: {listed}"
                    raise self.complain(i, k, "time_s", f"{hold.time_s[k]:g}", expected)

    def reference_C(self, trained: Protocol, row_of: dict[int, int]) -> float | None:
        """The temperature that warming counts from: what the repeated holds' temperatures say it was."""
        if self.holds[0].temperature_C is None or trained.warming_K is None:
            return None
        reference: float | None = None
        for i, hold in enumerate(self.holds):
            if hold.number not in row_of or hold.temperature_C is None:
                continue
            row = row_of[int(hold.number)]
            warming = trained.warming_K[row][trained.mask[row]]
            if reference is None:
                reference = float(hold.temperature_C[0] - warming[0])
            wrong = np.flatnonzero(np.abs(hold.temperature_C - reference - warming) > _SAME_K)
            if len(wrong):
                k = int(wrong[0])
                expected = f"{reference + warming[k]:g}, as hold {hold.number} was trained on"
                raise self.complain(i, k, "temperature_C", f"{hold.temperature_C[k]:g}", expected)
        return reference


_SAME_K = 1e-6


def _joined(before: Protocol, after: Protocol) -> Protocol:
    """One protocol after another, padded to the same width."""
    width = max(before.time_s.shape[1], after.time_s.shape[1])

    def padded(array: NDArray[Any]) -> Array:
        return np.pad(array.astype(float), [(0, 0), (0, width - array.shape[1])])

    warming = None
    if before.warming_K is not None and after.warming_K is not None:
        warming = np.concatenate([padded(before.warming_K), padded(after.warming_K)])
    return Protocol(
        length_mm=before.length_mm,
        displacement_mm=np.concatenate([before.displacement_mm, after.displacement_mm]),
        time_s=np.concatenate([padded(before.time_s), padded(after.time_s)]),
        mask=np.concatenate([padded(before.mask), padded(after.mask)]) > 0,
        duration_s=np.concatenate([before.duration_s, after.duration_s]),
        number=np.concatenate([before.number, after.number]),
        warming_K=warming,
    )


def _without_events(stored: Stored) -> Stored:
    model = stored.sample.model
    lasting = tuple(effect for effect in model.effects if not isinstance(effect, EventEffect))
    return replace(stored, sample=replace(stored.sample, model=replace(model, effects=lasting)))

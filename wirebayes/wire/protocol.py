"""What was done to a wire: the sequence of holds, padded to rectangular arrays."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np

from wirebayes.numeric.typing import Bools, Floats, Ints

Control = Literal["displacement", "force"]  # what is set in a hold; the other is read


@dataclass(frozen=True)
class Protocol:
    """Holds of one test, in order, unrecorded ones included.

    Ragged reading times are padded with zeros to ``R`` columns; `mask` marks real readings. Where a hold goes on after
    its last reading, the column behind that reading holds the time of its end, which the mask leaves out; a column is
    added where there is none.

    Attributes
    ----------
    length_mm : float
        Zero-tension length of the sample before the test.
    setting : (H,) array
        What was set in each hold: the displacement, mm, or the tension, N.
    time_s : (H, R) array
        Time of each reading since its hold began.
    mask : (H, R) bool array
        True where a reading was taken; a row of False is an unrecorded hold.
    duration_s : (H,) array
        How long each hold lasted: until its last reading, or longer.
    number : (H,) int array
        The hold numbers of the readings' file; -1 for an unrecorded hold.
    warming_K : (H, R) array or None
        Logged temperature minus the first logged reading.
    reference_C : float or None
        That first logged reading; None where no temperature was logged.
    control : {"displacement", "force"}
        What was set; the other was read.
    """

    length_mm: float
    setting: Floats
    time_s: Floats
    mask: Bools
    duration_s: Floats
    number: Ints
    warming_K: Floats | None = None
    reference_C: float | None = None
    control: Control = "displacement"

    def __post_init__(self) -> None:
        longer = self._longer
        if not longer.any():
            return
        rows = np.flatnonzero(longer)
        at = self.last_reading[rows] + 1
        more = int(at.max() == self.mask.shape[1])
        time_s = _widened(self.time_s, more)
        time_s[rows, at] = self.duration_s[rows]
        object.__setattr__(self, "time_s", time_s)
        if self.warming_K is not None:
            warming_K = _widened(self.warming_K, more)
            warming_K[rows, at] = warming_K[rows, at - 1]  # the wire keeps the temperature that was read last
            object.__setattr__(self, "warming_K", warming_K)
        object.__setattr__(self, "mask", _widened(self.mask, more))

    @property
    def _longer(self) -> Bools:
        """(H,) True where a hold went on after its last reading."""
        last_s = np.max(self.time_s * self.mask, axis=1, initial=0.0)
        return self.recorded & (self.duration_s > last_s)

    @property
    def recorded(self) -> Bools:
        """(H,) True for holds with readings."""
        return np.asarray(self.mask.any(axis=1))

    @property
    def start_s(self) -> Floats:
        """(H,) elapsed time at which each hold begins; moves take none."""
        return np.concatenate([[0.0], np.cumsum(self.duration_s)[:-1]])

    @property
    def _asked_s(self) -> Floats:
        """(H, R) times of the readings, of an unrecorded hold its end."""
        return np.where(self.recorded[:, None], self.time_s, self.duration_s[:, None])

    @cached_property
    def distinct_times(self) -> tuple[Floats, tuple[slice | Ints, ...]]:
        """Times of readings (T,), of an unrecorded hold its end, each once, and for every hold where its own stand."""
        time = self._asked_s
        times, where = np.unique(time, return_inverse=True)
        return times, tuple(_slice_of(row) for row in where.reshape(time.shape))

    @cached_property
    def last_reading(self) -> Ints:
        """(H,) column of each hold's last reading."""
        return np.maximum(self.mask.sum(axis=1) - 1, 0)

    @cached_property
    def end(self) -> Ints:
        """(H,) column in which each hold ends: that of its last reading, or the one behind it."""
        return self.last_reading + self._longer

    @cached_property
    def flat(self) -> dict[str, Any]:
        """The same as contiguous arrays: what compiled code calls a ``Test`` (``wire/_kernel.pyx``)."""
        times, where = self.distinct_times
        which = np.array([np.arange(len(times))[rows] for rows in where], np.intc)
        order, direction = (np.array([hold[key] for hold in self.holds], float) for key in ("order", "direction"))
        return {
            "length_mm": float(self.length_mm),
            "weights": self.control == "force",
            "setting": np.array(self.setting, float),
            "time_s": times[which],
            "warming_K": np.zeros(which.shape) if self.warming_K is None else np.array(self.warming_K, float),
            "start_s": self.start_s,
            "order": order,
            "direction": direction,
            "times": times,
            "log_times": _log(times),
            "which": which,
            "last": self.end.astype(np.intc),
            "recorded": self.recorded.view(np.uint8),
            "which_age": np.zeros((0, 0, 0), np.intc),
            "read_times": len(times),
        }

    @cached_property
    def flat_with_ages(self) -> dict[str, Any]:
        """The same with how long ago each earlier hold began, at the start of a hold and at its readings."""
        start_s, time_s, times = self.flat["start_s"], self.flat["time_s"], self.flat["times"]
        age = np.maximum(np.subtract.outer(start_s, start_s), 0.0)[..., None]
        ages, which = np.unique(np.concatenate([age, age + time_s[:, None]], axis=2), return_inverse=True)
        which = which.reshape(len(age), len(age), -1).astype(np.intc) + np.intc(len(times))
        all_times = np.concatenate([times, ages])
        return self.flat | {"times": all_times, "log_times": _log(all_times), "which_age": which}

    @cached_property
    def holds(self) -> tuple[dict[str, Any], ...]:
        """What `wirebayes.wire.effect.HoldContext` says of each hold whatever the wire."""
        start_s = self.start_s
        recorded = self.recorded
        time = self._asked_s
        warming = np.zeros_like(time) if self.warming_K is None else self.warming_K
        directions = _directions(self.setting)
        out = []
        for j, setting in enumerate(self.setting):
            out.append(
                {
                    "index": j,
                    "recorded": bool(recorded[j]),
                    "order": self._order(j),
                    "setting": float(setting),
                    "displacement_mm": float(setting) if self.control == "displacement" else np.nan,
                    "direction": int(directions[j]),
                    "first_direction": int(directions[0]),
                    "start_s": float(start_s[j]),
                    "duration_s": float(self.duration_s[j]),
                    "time_s": time[j][:, None],
                    "warming_K": warming[j][:, None],
                    "length_mm": self.length_mm,
                }
            )
        return tuple(out)

    def _order(self, j: int) -> float:
        """The number of a hold; of an unrecorded one half less than the next number, or infinity."""
        later = self.number[j:]
        later = later[later >= 0]
        if not later.size:
            return np.inf
        return float(later[0]) if self.number[j] >= 0 else float(later[0]) - 0.5


def _slice_of(numbers: Ints) -> slice | Ints:
    """Numbers in a row as a slice, which copies nothing: most holds are read in the same order. Others as they are."""
    end = numbers[0] + len(numbers)
    is_run = np.array_equal(numbers, np.arange(numbers[0], end))
    return slice(numbers[0], end) if is_run else numbers


def _widened(array: Any, columns: int) -> Any:
    """A copy with so many columns of nothing behind."""
    return np.pad(array, [(0, 0), (0, columns)])


def _log(times: Floats) -> Floats:
    """Logarithms of times; of none, minus infinity."""
    with np.errstate(divide="ignore"):
        return np.log(times)


def _directions(setting: Floats) -> Floats:
    """(H,) sign of the last move; a hold without a move keeps the one before, and a test begins upwards."""
    out = np.empty(len(setting))
    current = 1.0
    for j, move in enumerate(np.sign(np.diff(setting, prepend=0.0))):
        current = move or current
        out[j] = current
    return out

"""A single reading far from its neighbours, as a misprint leaves it."""

from collections.abc import Sequence

import numpy as np

from wirebayes.io.checked_test import CheckedTest
from wirebayes.numeric.typing import Floats
from wirebayes.sentences import short

ISOLATED = 10.0  # times as far from its neighbours as nine in ten readings
GROSS = 0.2  # of the range of all other tensions; smaller ones are the model check's affair


def outlier(readings: CheckedTest) -> str:
    """One reading far from its neighbours, in a test whose other readings are close to theirs.

    Creep runs one way within a hold, so a reading counts by what it stands above both neighbours, or below both. A
    hold's last one counts beyond the range of all others once more. Creep may be over after the first, which counts
    where neither creep nor the move before it explains the change to the second (see `_first_apart`).
    """
    each, unit = readings.each, readings.unit
    places: list[tuple[int, int]] = []
    distances = []
    first = _first_apart(readings)
    for j, row in enumerate(each):
        if len(row) >= 3:
            places += [(j, i) for i in range(len(row))]
            later = _later_apart(each, j)
            distances.append(np.concatenate([first[j : j + 1], later]))
    if not distances:
        return ""
    distance = np.concatenate(distances)
    worst = int(distance.argmax())
    hold, at = places[worst]
    others = np.delete(distance, worst)
    usual = max(float(np.quantile(others, 0.9)), readings.noise)
    span = np.ptp(_others(each, hold, at))
    if distance[worst] <= max(ISOLATED * usual, GROSS * span):
        return ""
    return (
        f"the reading of {short(each[hold][at], 5)} {unit} in hold {readings.number[hold]} at "
        f"{readings.times_s[hold][at]:g} s is {short(distance[worst], 3)} {unit} from its neighbours: check it, "
        "correct a misprint or leave its row out"
    )


def _first_apart(readings: CheckedTest) -> Floats:
    """(H,) how far the first reading of each hold is from the second, 0 where the wire may have gone that way itself.

    It cannot where the change is against creep, or begins below zero. Otherwise the share of the move's own effect that
    is gone by the second reading is compared with the shares of the other holds, and so is the change itself.
    """
    each = readings.each
    changes = np.array([row[1] - row[0] if len(row) > 1 else 0.0 for row in each])
    ends = np.array([0.0, *(row[-1] for row in each[:-1])])
    added = np.array([row[0] for row in each]) - ends
    if readings.protocol.control == "force":
        added[0] = np.nan  # the zero of a gauge is arbitrary
    sizes = np.abs(changes)
    shares = np.divide(sizes, np.abs(added), out=np.full(sizes.size, np.inf), where=added != 0.0)
    apart = np.zeros(sizes.size)
    for j in range(sizes.size):
        beside = np.arange(sizes.size) != j
        others = shares[beside & ~np.isnan(shares)]
        unlike_others = bool(others.size and shares[j] > ISOLATED * others.max())
        is_impossible = _is_impossible(readings, j, float(changes[j]))
        is_larger = sizes[j] > ISOLATED * sizes[beside].max(initial=0.0)
        if is_larger and (is_impossible or unlike_others):
            apart[j] = sizes[j]
    return apart


def _is_impossible(readings: CheckedTest, j: int, change: float) -> bool:
    """Whether no wire changes so after the first reading of a hold.

    A setting above all before it lets the tension fall, or the displacement grow; a wire does not push.
    """
    setting = readings.setting
    is_furthest = j == 0 or setting[j] > setting[:j].max()
    if readings.protocol.control == "force":
        return bool(is_furthest and change < 0.0)
    pushes = readings.each[j][0] < 0.0
    return bool(change > 0.0 and (is_furthest or pushes))


def _later_apart(each: Sequence[Floats], j: int) -> Floats:
    """(r - 1,) how far each reading of a hold but the first stands apart, as `outlier` counts it."""
    row = each[j]
    inner = row[1:-1]
    before = inner - row[:-2]
    after = inner - row[2:]
    nearest = np.minimum(np.abs(before), np.abs(after))
    is_peak = before * after > 0
    peaks = np.where(is_peak, nearest, 0.0)
    last = row[-1]
    others = _others(each, j, -1)
    outside = max(last - others.max(), others.min() - last)
    beyond = max(0.0, outside - np.ptp(others))
    return np.append(peaks, beyond)


def _others(each: Sequence[Floats], j: int, at: int) -> Floats:
    """All readings of the test but one of hold j."""
    return np.concatenate([np.delete(row, at) if k == j else row for k, row in enumerate(each)])

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
    hold's last one counts beyond the range of all others once more; creep may be over after the first.
    """
    each, unit = readings.each, readings.unit
    places: list[tuple[int, int]] = []
    distances = []
    for j, row in enumerate(each):
        if len(row) >= 3:
            places += [(j, i) for i in range(len(row))]
            distances.append(_apart(each, j))
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


def _apart(each: Sequence[Floats], j: int) -> Floats:
    """(r,) how far each reading of a hold stands apart, as `outlier` counts it."""
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
    return np.concatenate([[0.0], peaks, [beyond]])


def _others(each: Sequence[Floats], j: int, at: int) -> Floats:
    """All readings of the test but one of hold j."""
    return np.concatenate([np.delete(row, at) if k == j else row for k, row in enumerate(each)])

"""Rows of a test under weights in which no weight hung: before the first load, between loads, after the last one.

A wire that hangs free is not straight, so what a gauge shows of it is not read. It recovers meanwhile: a rest between
loads stays as a hold without readings, under next to nothing.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from wirebayes.io.bench.recorded import Cut
from wirebayes.numeric.typing import Floats
from wirebayes.sentences import listed

NEXT_TO_NOTHING = 1e-6  # of the smallest weight: creep goes with a power of the tension, which has to be above zero

SCATTER = 3.0  # median distances of tensions from that of their hold: nearer zero, a load cell reads no weight


def without_weight(holds: Cut, tension_N: Floats) -> Cut:
    """Holds of weights, and between them those of none, which are not read.

    Parameters
    ----------
    holds : Cut
        Of weights.
    tension_N : (r,) array
        Of all rows: a measured tension that is zero but for its scatter is none.
    """
    free = [_is_none(tension_N[rows], level) for rows, level in zip(holds.rows, holds.setting, strict=True)]
    loaded = [i for i, is_free in enumerate(free) if not is_free]
    if not any(free) or not loaded:
        return holds
    first, end = loaded[0], loaded[-1] + 1
    rests = [i for i in range(first, end) if free[i]]
    nothing = NEXT_TO_NOTHING * min(holds.setting[i] for i in loaded)
    setting = [nothing if is_free else level for is_free, level in zip(free, holds.setting, strict=True)]
    return replace(
        holds,
        rows=holds.rows[first:end],
        number=holds.number[first:end],
        setting=setting[first:end],
        time_s=holds.time_s[first:end],
        end_s=holds.end_s[first:end],
        notes=[*holds.notes, *_notes(first, len(free) - end, [holds.number[i] for i in rests])],
        unread=frozenset(holds.number[i] for i in rests),
        cycles=tuple(cycles for cycles in holds.cycles if cycles.before_hold <= holds.number[end - 1]),
    )


def _notes(before: int, after: int, rests: Sequence[int]) -> list[str]:
    """What was done with holds without a weight: so many before all loads and after them, and those between."""
    notes = []
    outside = [("before the first load", before), ("after the last one", after)]
    if before or after:
        where = listed([place for place, count in outside if count])
        notes.append(f"rows without a weight {where} left out: a wire that hangs free is not straight")
    if rests:
        numbers = listed([str(number) for number in rests])
        notes.append(
            f"hold{'s' * (len(rests) > 1)} {numbers} without a weight: the wire recovers meanwhile, and what the gauge "
            "shows of it is not read; if a hook hung on it, write the weight of the hook"
        )
    return notes


def _is_none(tension_N: Floats, level: float) -> bool:
    """Whether the tensions of a hold are no weight: zero, or no further from it than they scatter."""
    scatter = float(np.median(np.abs(tension_N - level)))
    return level <= SCATTER * scatter

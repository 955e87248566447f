"""Rows of a test under weights in which no weight hung: before the first load, between loads, after the last one.

A wire that hangs free is not straight, so what a gauge shows of it is not read. It recovers meanwhile: a rest between
loads stays as a hold without readings, under next to nothing.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from wirebayes.io.bench.recorded import Cut
from wirebayes.io.readings import HANGS_FREE
from wirebayes.numeric.typing import Floats
from wirebayes.sentences import holds_in_words, listed

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
    free = []
    for rows, level in zip(holds.rows, holds.setting, strict=True):
        free.append(_is_none(tension_N[rows], level))
    loaded = [i for i, is_free in enumerate(free) if not is_free]
    if not any(free) or not loaded:
        return holds
    first, end = loaded[0], loaded[-1] + 1
    kept = slice(first, end)
    nothing = HANGS_FREE * min(holds.setting[i] for i in loaded)
    setting = [*holds.setting]
    rests = []
    for i in range(first, end):
        if free[i]:
            setting[i] = nothing
            rests.append(holds.number[i])
    last_number = holds.number[end - 1]
    cycles = [each for each in holds.cycles if each.before_hold <= last_number]
    notes = _notes(first, len(free) - end, rests)
    return replace(
        holds,
        rows=holds.rows[kept],
        number=holds.number[kept],
        setting=setting[kept],
        time_s=holds.time_s[kept],
        end_s=holds.end_s[kept],
        notes=holds.notes + notes,
        unread=frozenset(rests),
        cycles=tuple(cycles),
    )


def _notes(before: int, after: int, rests: Sequence[int]) -> list[str]:
    """What was done with holds without a weight: so many before all loads and after them, and those between."""
    notes = []
    outside = [("before the first load", before), ("after the last one", after)]
    if before or after:
        where = listed([place for place, count in outside if count])
        notes.append(f"rows without a weight {where} left out: a wire that hangs free is not straight")
    if rests:
        notes.append(
            f"{holds_in_words(rests)} without a weight: the wire recovers meanwhile, and what the gauge "
            "shows of it is not read; if a hook hung on it, write the weight of the hook"
        )
    return notes


def _is_none(tension_N: Floats, level: float) -> bool:
    """Whether the tensions of a hold are no weight: zero, or no further from it than they scatter."""
    scatter = float(np.median(np.abs(tension_N - level)))
    return level <= SCATTER * scatter

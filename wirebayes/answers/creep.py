"""Which creep an answer speaks of: that within a time as long as the wire was held, if it was held for long."""

from typing import cast

from wirebayes.json_files.summary import CREEP_TIMES_S, SummaryJson
from wirebayes.json_files.values import Statistics
from wirebayes.sentences import lasting


def creep_as_long_as_held(summary: SummaryJson) -> tuple[str, Statistics | None]:
    """A time in words, and the creep within it.

    Two minutes, as a hold of the paper; an hour or a day where a hold lasted so long, for then two minutes may be over
    before the first reading.
    """
    held_s = summary.get("longest_hold_s", 0.0)
    shortest, *longer = CREEP_TIMES_S
    name = [shortest, *(name for name in longer if CREEP_TIMES_S[name] <= held_s)][-1]
    creep = cast(dict[str, Statistics | None], summary["derived"])[name]
    return lasting(CREEP_TIMES_S[name]), creep

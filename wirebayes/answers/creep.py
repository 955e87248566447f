"""Which creep an answer speaks of: that within a time as long as the wire was held, if it was held for long."""

from wirebayes.json_files.summary import SummaryJson
from wirebayes.json_files.values import Statistics
from wirebayes.sentences import lasting


def creep_as_long_as_held(summary: SummaryJson) -> tuple[str, Statistics | None]:
    """A time in words, and the creep within it.

    Two minutes, as a hold of the paper; an hour or a day where a hold lasted so long, for then two minutes may be over
    before the first reading.
    """
    derived = summary["derived"]
    held_s = summary.get("longest_hold_s", 0.0)
    if held_s >= _DAY_S:
        return lasting(_DAY_S), derived["creep_1day_mm"]
    if held_s >= _HOUR_S:
        return lasting(_HOUR_S), derived["creep_1h_mm"]
    return lasting(_TWO_MINUTES_S), derived["creep_2min_mm"]


_TWO_MINUTES_S, _HOUR_S, _DAY_S = 120.0, 3600.0, 86400.0  # those that a summary has

"""Which creep an answer speaks of: within a time as long as the wire was held, if for long, and of which length."""

from math import isclose
from typing import cast

from wirebayes.json_files.summary import CREEP_TIMES_S, SummaryJson
from wirebayes.json_files.values import Statistics
from wirebayes.sentences import lasting, short


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


def lengths_in_words(summary: SummaryJson) -> tuple[str, str]:
    """The lengths of wire that the creep and B are for, in words; empty where both are of the one sample's."""
    of_creep = summary["derived"].get("length_mm")
    of_amount = summary.get("B_length_mm")
    if of_creep is None or of_amount is None or isclose(of_creep, of_amount):
        return "", ""
    return f" in {short(of_creep)} mm of wire", f" in {short(of_amount)} mm of wire"

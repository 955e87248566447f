"""A clock that starts again while what was set stays: a new hold, or a stopwatch that somebody started again."""

from collections.abc import Sequence
from itertools import pairwise

from wirebayes.result_warnings import Notice
from wirebayes.sentences import holds_in_words


def clock_started_again(number: Sequence[int], levels: Sequence[float], role: str) -> tuple[Notice, ...]:
    """A notice of holds at the setting of the hold before, which only the clock tells apart.

    Parameters
    ----------
    number : (H,) sequence of int
        Of the holds.
    levels : (H,) sequence of float
        What was set in each.
    role : {"displacement", "tension"}
        What that is.
    """
    again = [second for second, (before, level) in zip(number[1:], pairwise(levels), strict=True) if level == before]
    if not again:
        return ()
    begin = "begins" if len(again) == 1 else "begin"
    text = (
        f"{holds_in_words(again)} {begin} only because the time starts again, at the {role} of the hold before: if it "
        "was held on while the clock was started again, let its times go on, for a new hold begins its creep anew"
    )
    return (Notice("data", text),)

"""What an unrecorded end of holds may cost, as ``summary.json`` and ``check.json`` hold it."""

from typing import TypedDict


class MovedByHoldEnds(TypedDict):
    """How far the best value of a quantity moves; `sd_share` in standard deviations of its posterior.

    `relative` is the size of the shift as a share of that value: null for an amplitude, which may be zero.

    `quantity` is the parameter itself, but for k2, whose value depends on the unit of time: there it is k2 t^N after a
    hundredth of a typical hold.
    """

    quantity: str
    shift: float
    sd_share: float
    relative: float | None
    unit: str


class HoldEnds(TypedDict):
    """What follows if readings cover only the share `covered` of each hold."""

    covered: float
    moved: dict[str, MovedByHoldEnds]
    sentence: str

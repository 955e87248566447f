"""``check.json``: what was understood of an experiment, and what such a test can determine."""

from typing import NotRequired, TypedDict

from wirebayes.json_files.hold_ends import HoldEnds
from wirebayes.json_files.values import Quantiles
from wirebayes.result_warnings import Warned


class HoldUnderstood(TypedDict):
    """A hold, a step or a weight; an unrecorded one has no first reading."""

    number: int | None
    displacement_mm: NotRequired[float]
    tension_N: NotRequired[float]
    start_s: float
    duration_s: float
    readings: int
    first_s: float | None
    first_N: NotRequired[float | None]
    last_N: NotRequired[float | None]
    first_mm: NotRequired[float | None]
    last_mm: NotRequired[float | None]


class Understood(TypedDict):
    """What the files say."""

    material: str
    length_mm: float
    control: str
    resolution_N: NotRequired[float | None]
    resolution_mm: NotRequired[float | None]
    holds: list[HoldUnderstood]
    recorded_holds: int
    unrecorded_holds: int
    readings: int
    duration_s: float
    temperature_C: list[float] | None


class ParameterRange(Quantiles):
    """A parameter by a rough fit, its prior's range, and which of both determines it."""

    unit: str
    prior_q05: float
    prior_q95: float
    determined_by: str


class EffectSize(TypedDict):
    """Whether the test shows an effect (yes, if unusually large, no) and the smallest it would detect, 80 % power."""

    shows: str
    amplitude_80: float | None
    unit: str
    reason: str | None


class CheckedExperiment(Understood, Warned):
    """All that is said of one experiment."""

    parameters: dict[str, ParameterRange]
    effects: dict[str, EffectSize]
    hold_ends: HoldEnds | None


class CheckJson(Warned):
    """The whole file."""

    experiments: dict[str, CheckedExperiment]

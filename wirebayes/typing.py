"""The types that many modules share, and those of ``discovery.json``."""

from typing import Any, Literal, TypedDict

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]  # of numbers; sums of several kinds have no narrower type
Floats = NDArray[np.float64]

Verdict = Literal["nothing-missing", "named", "ambiguous", "partial", "unknown"]


class Amplitude(TypedDict):
    """The amplitude of an accepted effect; `hold` is that of an event."""

    mean: float
    q05: float
    q95: float
    unit: str
    hold: int | None


class Remainder(TypedDict):
    """What is left beside the accepted effects, and the p-value of the global test with them in the model."""

    probability: float
    where: list[str]
    p: float | None


class Answer(TypedDict):
    """What the experiments of one material share."""

    verdict: Verdict
    effects: list[str]
    best: str | None
    set: list[str]
    group: list[str]
    accepted: list[str]
    amplitudes: dict[str, Amplitude]
    probabilities: dict[str, float]
    probability_nothing: float | None
    inclusion: dict[str, float]
    remainder: Remainder
    p_global: float
    shared_with: list[str]
    where: list[dict[str, Any]]


class Outlook(TypedDict):
    """What could have been seen, what cannot be, and what to measure next."""

    power: dict[str, dict[str, Any]]
    not_identifiable: list[str]
    next_measurement: str


class HeldOutReport(TypedDict):
    """How models predict an experiment's holds that they did not see."""

    steps: list[dict[str, Any]]
    held_out: dict[str, Any]
    residual_rms_N: float
    gross_errors: list[dict[str, Any]]


class ExperimentFindings(Answer, Outlook, HeldOutReport):
    """All that ``discovery.json`` says of one experiment."""

"""``discovery.json``: what the plain model is missing."""

from typing import Any, Literal, TypedDict

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


class Disagreement(TypedDict):
    """Along what model and readings disagree; `hold` where it is one hold."""

    covariate: str
    hold: int | None
    p: float
    sentence: str


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
    where: list[Disagreement]


class Outlook(TypedDict):
    """What could have been seen, what cannot be, and what to measure next."""

    power: dict[str, dict[str, Any]]
    not_identifiable: list[str]
    next_measurement: str


class GrossError(TypedDict):
    """A single reading that was set aside; `reading` counts from 0 within its hold."""

    experiment: str
    hold: int
    reading: int
    log_bayes: float


class HeldOutReport(TypedDict):
    """How models predict an experiment's holds that they did not see."""

    steps: list[dict[str, Any]]
    held_out: dict[str, Any]
    residual_rms_N: float
    gross_errors: list[GrossError]


class ExperimentFindings(Answer, Outlook, HeldOutReport):
    """All that is said of one experiment."""


class DiscoveryJson(TypedDict):
    """The whole file."""

    version: int
    experiments: dict[str, ExperimentFindings]

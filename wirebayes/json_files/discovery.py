"""``discovery.json``: what the plain model is missing."""

from typing import Literal, NotRequired, TypedDict

from wirebayes.result_warnings import Warned

Verdict = Literal["nothing-missing", "named", "ambiguous", "partial", "unknown"]


class AmplitudeEstimate(TypedDict):
    """The amplitude of an accepted effect; `hold` is that of an event. Files of earlier versions have no median."""

    mean: float
    q05: float
    q50: NotRequired[float]
    q95: float
    unit: str
    hold: int | None


class Remainder(TypedDict):
    """What is left beside the accepted effects, and the p-value of the global test with them in the model.

    `leave_one_hold_out` is what a smooth discrepancy beside the established effects gains; None where a remainder is
    not likely, and it was not asked.
    """

    probability: float
    where: list[str]
    p: float | None
    leave_one_hold_out: float | None


class FamilyReport(TypedDict):
    """Effects that these tests cannot tell apart, the most probable first.

    `inclusion` is the probability that any of them is missing; `leave_one_hold_out` what the mixture over them gains
    against the model without them, None where they are not in the best model.
    """

    name: str
    members: list[str]
    inclusion: float
    leave_one_hold_out: float | None
    established: bool
    sentence: str


class IntervalJson(TypedDict):
    """A parameter in one model."""

    mean: float
    q05: float
    q95: float


class ParameterReport(TypedDict):
    """A parameter before and after; None where a model does not have it."""

    unit: str
    plain: IntervalJson | None
    final: IntervalJson | None


class Disagreement(TypedDict):
    """Along what covariate model and readings disagree; `hold` where it is one hold."""

    covariate: str
    hold: int | None
    p: float
    sentence: str


class SharedFindings(TypedDict):
    """What the experiments of one material share.

    `p_simulations` is the number of refitted simulations that `p_global` is a share of, and `p_interval` the share's
    95 % interval.
    """

    verdict: Verdict
    effects: list[str]
    best: str | None
    set: list[str]
    group: list[str]
    accepted: list[str]
    amplitudes: dict[str, AmplitudeEstimate]
    probabilities: dict[str, float]
    probability_nothing: float | None
    inclusion: dict[str, float]
    families: list[FamilyReport]
    parameters: dict[str, ParameterReport]
    remainder: Remainder
    p_global: float
    p_interval: list[float]
    p_simulations: int
    shared_with: list[str]
    where: list[Disagreement]


class DetectableAmplitude(TypedDict):
    """The smallest amplitude that is detected in 80 % of such tests; None where none is large enough."""

    amplitude_80: float | None
    unit: str


class Outlook(TypedDict):
    """What could have been seen, what cannot be, and what to measure next."""

    power: dict[str, DetectableAmplitude]
    not_identifiable: list[str]
    next_measurement: str


class GrossError(TypedDict):
    """A single reading that was set aside; `reading` counts from 0 within its hold."""

    experiment: str
    hold: int
    reading: int
    log_bayes: float


class ScoresJson(TypedDict):
    """How one model predicts the held-out holds; None where no holds were held out."""

    rmse_N: float | None
    elpd: float | None
    coverage_90: float | None


class StepJson(ScoresJson):
    """The plain model, or the model with one accepted effect more than the step before."""

    model: str


class FinalScores(ScoresJson):
    """Scores with the standard error of the elpd's difference from the plain model; None for a single hold."""

    elpd_difference_se: float | None


class LeaveOneHoldOutGain(TypedDict):
    """What the final model, and a smooth discrepancy alone, gain over the plain one with holds left out in turn."""

    elpd_difference: float
    elpd_difference_se: float
    flexible_elpd_difference: float


class HeldOutJson(TypedDict):
    """The last holds predicted from the first; `floor_N` is the rms error that sensor noise alone would leave."""

    holds: list[int]
    plain: ScoresJson
    final: FinalScores
    flexible: NotRequired[ScoresJson | None]
    floor_N: NotRequired[float]
    gap_closed: float | None
    leave_one_hold_out: NotRequired[LeaveOneHoldOutGain | None]
    shrinks: bool


class HeldOutReport(Warned):
    """How models predict an experiment's holds that they did not see."""

    steps: list[StepJson]
    held_out: HeldOutJson
    residual_rms_N: float
    gross_errors: list[GrossError]


class ExperimentFindings(SharedFindings, Outlook, HeldOutReport):
    """All that is said of one experiment."""


class DiscoveryJson(Warned):
    """The whole file."""

    version: int
    experiments: dict[str, ExperimentFindings]

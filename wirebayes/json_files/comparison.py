"""``comparison.json``: models side by side; and the file of each model, ``NAME/models/MODEL.json``."""

from typing import NotRequired, TypedDict

from wirebayes.json_files.values import Integers, Numbers
from wirebayes.result_warnings import Warned


class LeaveOneHoldOut(TypedDict):
    """Log predictive density of each hold from all others, and the holds without which posteriors were sampled."""

    holds: Integers
    elpd: float
    se: float
    per_hold: Numbers
    pareto_k: Numbers
    refitted: Integers


class ReadingsJson(TypedDict):
    """Measured and predicted readings of held-out holds, a row a reading; for pictures."""

    hold: Integers
    time_s: Numbers
    observed_N: Numbers
    mean_N: Numbers
    sd_N: Numbers
    quantiles_N: Numbers
    pit: Numbers


class PredictionScores(TypedDict):
    """How predicted readings met the measured ones; `coverage` by the level of the band in per cent."""

    rmse_N: float
    elpd: float
    per_hold: Numbers
    elpd_together: float
    coverage: dict[str, float]
    pit_p: float
    readings: NotRequired[ReadingsJson]  # in the model's own file only
    pit_band: NotRequired[Numbers]


class HeldOutHolds(TypedDict):
    """The last holds predicted from the first: freely, and given each hold's first reading."""

    trained_on: int
    holds: Integers
    free: PredictionScores | None
    given_first: PredictionScores | None
    effects: list[str]


class JudgementJson(TypedDict):
    """What fits of one model came to."""

    effects: list[str]
    parameters: int
    converged: bool
    convergence: str
    leave_one_hold_out: LeaveOneHoldOut
    held_out: HeldOutHolds | None


class ModelJson(Warned):
    """One model; where it could not be judged, `failed` is the reason and what a fit would have said is not there."""

    name: str
    question: str
    sentence: str
    elastic_law: str
    history: str
    likelihood: str
    scored: str
    effects: NotRequired[list[str]]
    parameters: NotRequired[int]
    converged: NotRequired[bool]
    convergence: NotRequired[str]
    leave_one_hold_out: NotRequired[LeaveOneHoldOut]
    held_out: NotRequired[HeldOutHolds | None]
    failed: str | None


class Difference(TypedDict):
    """A difference of elpd from the model that all are compared with, and its standard error."""

    elpd: float
    se: float


class Differences(TypedDict):
    """Differences by leaving out each hold, by the last holds, and by these given their first readings.

    None where models were not scored on the same readings.
    """

    difference: Difference | None
    held_out_difference: Difference | None
    given_first_difference: Difference | None


class ComparedModel(ModelJson, Differences):
    """A model's row: where it was scored on the same readings its stacking weight and differences, and the result."""

    weight: float | None
    meaning: str


class ComparedModels(Warned):
    """The models of one experiment, best first among those scored alike, failures last."""

    base: str
    models: list[ComparedModel]


class ComparisonJson(Warned):
    """The whole file."""

    version: int
    seed: int
    experiments: dict[str, ComparedModels]

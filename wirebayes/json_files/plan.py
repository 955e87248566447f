"""``plan.json``: what tests would teach before they are done."""

from typing import TypedDict

from wirebayes.json_files.discovery import DetectableAmplitude
from wirebayes.json_files.values import Statistics
from wirebayes.result_warnings import Warned


class ExpectedWidth(TypedDict):
    """How wide a quantity's posterior is expected to be, over the simulated tests.

    `sd` is the median of its standard deviation, `width_90` that of the length of its 90 % interval; in 90 % of the
    tests that length lies between `width_90_low` and `width_90_high`. Means would depend on the one test in thirty
    whose posterior has a second mode or a long tail. `guess_sd` is the standard deviation before the test; all are in
    `unit`.
    """

    sd: float
    width_90: float
    width_90_low: float
    width_90_high: float
    guess_sd: float
    unit: str


class EffectPower(DetectableAmplitude):
    """What a test would show of one effect.

    `delta_80` is the signature of `amplitude_80` in standard deviations of what the readings leave it, `delta_prior`
    the same of one standard deviation of the effect's prior. The signatures of the effects in `confused_with` are as
    good as the same (cosine above `discovery.power.ALIKE`).
    """

    delta_80: float | None
    delta_prior: float
    confused_with: list[str]


class RobotDrift(TypedDict):
    """How well a robot's drift would be known after the test, and how well it is known now."""

    time_s: float
    drift_mm: float
    drift_sd_mm: float
    drift_sd_guess_mm: float


class ExpectedCreep(TypedDict):
    """How well creep would be known, at which tension and length."""

    tension_N: float
    length_mm: float
    longest_hold_s: float
    creep_longest_hold_mm: ExpectedWidth
    creep_1h_mm: ExpectedWidth


class JudgedProtocol(TypedDict):
    """A test; `cosines` are those of the signatures of two effects, ``NAME NAME``."""

    rank: int
    name: str
    words: str
    length_mm: float
    holds: int
    readings: int
    duration_min: float
    within_budget: bool
    score: float
    information_bits: float
    simulated_tests: int
    parameters: dict[str, ExpectedWidth]
    creep: ExpectedCreep
    effects: dict[str, EffectPower]
    cosines: dict[str, float]
    not_identifiable: list[str]
    robot: RobotDrift | None


class GuessedParameters(TypedDict):
    """What was assumed about the wire, and where it comes from."""

    source: str
    length_mm: float
    parameters: dict[str, Statistics]


class PlanJson(Warned):
    """The whole file, the best protocol first."""

    version: int
    aim: list[str]
    budget_min: float | None
    best: str
    guess: GuessedParameters
    robot: str | None
    protocols: list[JudgedProtocol]

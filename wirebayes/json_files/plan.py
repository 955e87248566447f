"""``plan.json``: what tests would teach before they are done."""

from typing import TypedDict

from wirebayes.json_files.values import Statistics


class ExpectedWidth(TypedDict):
    """Of a quantity's posterior; `planning.widths.Width` says what each value is."""

    sd: float
    sd_se: float
    sd_median: float
    width_90: float
    width_90_low: float
    width_90_high: float
    guess_sd: float


class EffectSeen(TypedDict):
    """What a test would show of one effect; `planning.sensitivity.EffectPower` says what each value is."""

    amplitude_80: float | None
    unit: str
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
    effects: dict[str, EffectSeen]
    cosines: dict[str, float]
    not_identifiable: list[str]
    robot: RobotDrift | None


class GuessedParameters(TypedDict):
    """What was assumed about the wire, and where it comes from."""

    source: str
    length_mm: float
    parameters: dict[str, Statistics]


class PlanJson(TypedDict):
    """The whole file, the best protocol first."""

    version: int
    aim: list[str]
    budget_min: float | None
    best: str
    guess: GuessedParameters
    robot: str | None
    protocols: list[JudgedProtocol]

"""``summary.json`` of a fit."""

from typing import NotRequired, TypedDict

from wirebayes.json_files.discovery import GrossError
from wirebayes.json_files.hold_ends import HoldEnds
from wirebayes.json_files.values import Numbers, Statistics
from wirebayes.result_warnings import Warned

# a hold of the paper, and what a robot on the wire works through
CREEP_TIMES_S = {"creep_2min_mm": 120.0, "creep_1h_mm": 3600.0, "creep_1day_mm": 86400.0}


class Mixed(Statistics):
    """Statistics of the draws of several chains, and how well these have mixed."""

    ess_bulk: float
    ess_tail: float
    r_hat: float


class Parameter(Mixed):
    """A parameter's posterior with its unit."""

    unit: str


class Derived(TypedDict):
    """Derived quantities of a fresh sample of `length_mm` under a constant `tension_N` that was tested.

    None where a draw has no finite value, as of endless creep.
    """

    tension_N: float
    length_mm: float
    creep_2min_mm: Statistics | None
    creep_1h_mm: Statistics | None
    creep_1day_mm: Statistics | None
    final_creep_mm: Statistics | None
    median_creep_time_s: Statistics | None
    stiffness_N: Statistics | None


class IdentifiabilityFigures(TypedDict):
    """How far the data determine one parameter.

    `contraction` is 1 - posterior variance / prior variance (of the logarithm, for a positive parameter). The ranges
    are widths of the central 90 %: a factor for a positive parameter, else a difference. The sensitivities are those of
    its posterior to its own prior and to the likelihood. `ridges` has the parameters that it is correlated with, and
    the correlation. Of B and k2 all are those of the creep at the test's typical tension and of the rate over a typical
    hold, which depend on no unit, unless a prior was stated for B or k2 itself.
    """

    contraction: float
    prior_range_90: float
    posterior_range_90: float
    range_is_factor: bool
    prior_sensitivity: float
    likelihood_sensitivity: float
    ridges: dict[str, float]


class Identifiability(IdentifiabilityFigures):
    """The same with a sentence."""

    sentence: str


class CreepBand(TypedDict):
    """Quantiles of the creep at each time."""

    q05: Numbers
    q50: Numbers
    q95: Numbers


class ExtrapolatedCreep(TypedDict):
    """Creep of a fresh sample against time, with the prior's part in it."""

    tension_N: float
    time_s: Numbers
    posterior_mm: CreepBand
    weaker_prior_mm: CreepBand
    prior_mm: CreepBand
    prior_share: Numbers
    pareto_k: float
    sentence: str
    warning: str | None


class ModelCheckResult(TypedDict):
    """Whether the fitted model describes its own readings; None where that was not checked."""

    passed: bool | None
    p: float | None
    p_alike: float | None
    alpha: float
    simulations: int
    most_surprising: list[str]
    gross_errors: list[GrossError]
    sentence: str


class SummaryJson(Warned):
    """The whole file; `B_length_mm` is the zero-tension length that B among the parameters belongs to."""

    model_check: NotRequired[ModelCheckResult]
    experiment: str
    B_length_mm: float
    likelihood: str
    elastic_law: str
    history: str
    effects: list[str]
    converged: bool
    convergence: str
    parameters: dict[str, Parameter]
    derived: Derived
    longest_hold_s: float
    identifiability: dict[str, Identifiability]
    extrapolation: ExtrapolatedCreep
    hold_ends: HoldEnds | None
    likelihood_evaluations: int
    kept_evaluations: int
    autocorrelation_steps: float
    smallest_ess: float
    largest_nested_r_hat: float
    acceptance: float
    learned_move: float
    modes_found: int

"""``calibration.json``: the zero-tension lengths of a robot's wires."""

from typing import NotRequired, TypedDict

from wirebayes.json_files.values import MeanAndSd, Numbers
from wirebayes.numeric.typing import Array
from wirebayes.result_warnings import Warned


class CalibrationPrior(TypedDict):
    """What was known before; `tension_bias_sign` is constant, or that of the wire's last motion."""

    reference_sd_mm: float
    specimen_spread: float
    anchor_sd_mm: NotRequired[float]
    platform_sd_mm: NotRequired[float]
    pose_sd_mm: NotRequired[float]
    drum_sd: NotRequired[float]
    tension_bias_sd_N: NotRequired[float]
    tension_bias_sign: NotRequired[str]


class Interval(MeanAndSd):
    """Mean, standard deviation and 90 % interval, a number for each wire."""

    q05: Numbers
    q95: Numbers


class EstimatedLengths(TypedDict):
    """What one model of the wires makes of the readings, a value a wire; `p_joint` tests readings and references."""

    converged: bool
    misfit: float
    p_joint: float
    length_m: Interval
    creep_strain: Numbers
    reference_error_mm: MeanAndSd
    tension_bias_N: NotRequired[MeanAndSd]


class EstimatedPoses(Interval):
    """A row of x, y, z (m) and of the rotation vector (rad) for each hold, at its end."""

    hold: list[float]


class CombinationJson(TypedDict):
    """A motion of all exit points together."""

    name: str
    before_mm: float
    after_mm: float
    determined: bool


class IdentifiedJson(TypedDict):
    """How many independent combinations the readings determine, and what they leave open, in words."""

    determined: int
    of: int
    combinations: list[CombinationJson]
    not_determined: list[str]


class PoseNow(TypedDict):
    """Where the platform is."""

    position_m: Numbers
    rotation_vector_rad: Numbers


class ObservabilityJson(TypedDict):
    """How many combinations of lengths the poses determine, and which one worst."""

    rank: int
    of: int
    weakest_combination: Numbers
    sentence: str


class Observed(TypedDict):
    """What the poses can determine, and which to read next."""

    observability: ObservabilityJson
    next_positions_m: Array | list[list[float]]


class CalibratedPoses(TypedDict):
    """The pose now, and joint values for the home pose.

    Both are None where the search did not converge; joint values also where nothing holds the home pose.
    """

    pose_now: PoseNow | None
    joint_values_for_home_m: Numbers | None
    motor_angles_for_home_rad: NotRequired[Numbers]


class SessionDone(TypedDict):
    """What the robot did, a row a hold."""

    position_m: Numbers
    rotation_vector_rad: Numbers
    joint_m: Numbers
    duration_s: Numbers


class CalibratedUnknowns(TypedDict):
    """The posterior that ``pose --calibration`` starts from.

    `mean` and `covariance` are of the reference errors of all wires (m), the line's parameters (`line` names them;
    logarithms of those that are positive) and the logarithmic deviations of every wire's own parameters; then how far
    the `points` of all legs that were estimated are from where they were found (m).
    """

    version: int
    reference_sd_mm: float
    specimen_spread: float
    line: list[str]
    mean: Numbers
    covariance: Numbers
    points: list[str]
    pull_N: Numbers
    session: SessionDone


class BelongsTo(TypedDict):
    """Hashes of the robot and of the posterior of its wires."""

    robot: str
    wires: str


class UnknownsJson(BelongsTo, CalibratedUnknowns):
    """The whole of ``unknowns.json``."""


class NamedEstimates(TypedDict):
    """Estimates of geometry (a row a leg), lengths and poses."""

    exit_points_m: Interval
    platform_points_m: Interval
    zero_tension_lengths_m: Interval
    references_m: Interval
    poses: EstimatedPoses
    identified: IdentifiedJson


class EstimatedDrums(TypedDict):
    """How much wider the drum of each leg is than the robot's file says, where ``--drum-sd`` asks for it."""

    drum_wider_percent: NotRequired[Interval]


class SensorsAtFault(TypedDict):
    """Tension sensors one of which would explain what contradicts, with the error that it would have.

    `wires`, from 1, is empty where nothing contradicts, and where no single sensor explains it; `explains` is the share
    that each does. `p_none` tests that no sensor has an error.
    """

    wires: list[int]
    bias_N: MeanAndSd
    explains: Numbers
    p_none: float


class JointErrors(TypedDict):
    """How far lengths are from joint values, and the error of these; None where joint values are exact."""

    length_rms_mm: float | None
    joint_sd_mm: float | None


class CalibrateJson(CalibratedPoses, Observed, NamedEstimates, EstimatedDrums, JointErrors, Warned):
    """The whole file."""

    next_pose_sd_mm: Numbers

    version: int
    robot: str
    holds: int
    read: int
    usable: bool
    sensors_at_fault: SensorsAtFault | None
    misfit: float
    prior: CalibrationPrior
    with_creep_model: EstimatedLengths
    by_hooke_alone: EstimatedLengths

"""``pose.json``: a robot's pose on creeping wires."""

from typing import NotRequired, TypedDict

from wirebayes.json_files.calibrate import PoseNow
from wirebayes.json_files.values import Band, Numbers, Quantiles
from wirebayes.result_warnings import Warned


class Specimens(TypedDict):
    """How many specimens of a line were tested, and how far they differ."""

    tests: int
    spread: dict[str, Quantiles]


class ModelShare(TypedDict):
    """A model that the readings of a line leave possible: its effects, and which share of the draws is of it."""

    effects: list[str]
    share: float


class WiresUsed(TypedDict):
    """Which posterior the answer is for; `legs` has the line of each wire."""

    draws: int
    tested_length_mm: float | None  # of a line that was tested
    elastic_law: str
    history: str
    effects: list[str]
    left_out: list[str]
    legs: list[str]
    lines: list[str]
    specimens: NotRequired[dict[str, Specimens]]
    undecided: NotRequired[dict[str, list[ModelShare]]]  # of lines whose draws are of several models


class TensionDistribution(TypedDict):
    """How the tensions are chosen."""

    choice: str
    lowest_N: float
    highest_N: float


class MotorAngles(TypedDict):
    """Angles of the motors; None for legs without a drum of known radius."""

    motor_angle_rad: Band
    wire_per_motor_angle_m_rad: Band


class InverseKinematics(TypedDict):
    """What the pose requires of the wires."""

    tension_N: Numbers
    zero_tension_length_m: Band
    joint_value_m: Band
    motor_angle_rad: NotRequired[Band]
    wire_per_motor_angle_m_rad: NotRequired[Band]


class ForwardKinematics(TypedDict):
    """The pose found again from those lengths."""

    solved: float
    statuses: dict[str, int]
    largest_round_trip_error_m: float
    slack_wires: int
    lowest_stiffness_N_m: Band


class EquilibriumPose(PoseNow):
    """A pose that the same lengths allow."""

    slack_wires: int
    commanded: bool
    stable: bool


class OrientationFound(TypedDict):
    """Which part of the orientation was commanded, and which balance decided."""

    commanded_degrees: int
    of_degrees: int
    position_directions: int
    rotation_choice: int
    commanded_components: list[str]
    free_components: list[str]
    refused_components: list[str]
    other_rotation_vectors_rad: Numbers
    sentence: str


class OnPlane(TypedDict):
    """The plane that carries the platform, and the half widths of the poses at which friction can hold it."""

    normal: Numbers
    contact: str
    normal_force_N: float
    friction_coefficient: float
    contact_radius_m: float
    friction_half_width_mm: Band
    friction_half_width_rad: Band
    friction_departure: float
    sentence: str


class EquilibriaJson(TypedDict):
    """All equilibria that were found from many starts."""

    stable_found: int
    starts: int
    commanded_stable: bool
    poses: list[EquilibriumPose]


class ProvedBand(TypedDict):
    """A box that holds the platform while the wires lie in a share of their bands, from the commanded position."""

    time_s: float
    share: float
    low_mm: Numbers | None
    high_mm: Numbers | None


class EnclosedBand(TypedDict, total=False):
    """The band that was proved; not there where no proof can be tried."""

    band: ProvedBand


class CertificateJson(EnclosedBand):
    """What interval arithmetic proves; `proved` is None where nothing was tried, for the reason in `sentence`."""

    proved: bool | None
    sentence: NotRequired[str]
    enclosure_m: NotRequired[Numbers]
    alone_within_m: NotRequired[float]


class DriftBands(TypedDict):
    """Drift from the commanded pose, a value a time."""

    times_s: Numbers
    solved: float
    displacement_mm: Band
    distance_mm: Band
    tilt_deg: Band
    from_vertical_deg: Band
    rotation_deg: Band
    tension_N: Band


class Drift(DriftBands):
    """Drift of wires that differ from specimen to specimen by so much."""

    specimen_spread: float


class Times(TypedDict):
    """When the first, the median and the last of the draws reach something that only some of them reach."""

    first: float
    median: float
    last: float


class FallsReport(TypedDict):
    """Falls, slack wires and margins over the draws that began; `pose.stability` says what each value is."""

    began: float
    fall_probability: NotRequired[float]
    fall_probability_at: NotRequired[Numbers]
    fall_time_s: NotRequired[Times | None]
    fall_wires: NotRequired[Numbers]
    fall_distance_mm: NotRequired[Times | None]
    caught_probability: NotRequired[float | None]
    slack_probability: NotRequired[Numbers]
    slack_time_s: NotRequired[list[Times | None]]
    least_tension_wire: NotRequired[int]
    least_tension_share: NotRequired[Band]
    stiffness_share: NotRequired[Band]


class Stability(FallsReport):
    """Falls and margins for one spread of specimens."""

    specimen_spread: float


class ClaimHolds(TypedDict):
    """Probability that the paper's figures are kept; None where its time was not requested."""

    specimen_spread: float
    probability: float | None


class Claim(TypedDict):
    """The paper's figures, and whether they are kept here."""

    time_s: float
    distance_mm: float
    tilt_deg: float
    holds: list[ClaimHolds]


class Tolerances(TypedDict):
    """Tolerances of the pose."""

    tolerance_mm: float
    tolerance_deg: float


class TimeWithin(TypedDict):
    """How long the pose stays within tolerance with a probability of 95 %: the last such time of those evaluated."""

    longest_time_within_s: float
    still_within_at_the_end: bool


class ControllerError(Tolerances, TimeWithin):
    """Pose error under one controller."""

    specimen_spread: float
    controller: str
    times_s: Numbers
    solved: float
    distance_mm: Band
    rotation_deg: Band


class BetweenCalibrations(Tolerances, TimeWithin):
    """How long a calibration lasts after a load history."""

    specimen_spread: float
    loaded_before_s: float
    controller: str
    solved: float


class SpreadOfDrift(TypedDict):
    """Standard deviation of the drift's size."""

    specimen_spread: float
    sd_mm: float | None


class VarianceShares(TypedDict):
    """Each parameter's share of the variance of the drift's size at the last time."""

    time_s: float
    output: str
    sentence: NotRequired[str]
    shared_draw: NotRequired[dict[str, float]]
    sd_mm: NotRequired[list[SpreadOfDrift]]


class ClaimNumbers(TypedDict):
    """The drift of a minute over part of a workspace, and how probable it is that the paper's figures are kept."""

    q05_drift_mm: float
    q50_drift_mm: float
    q95_drift_mm: float
    q05_tilt_deg: float
    q50_tilt_deg: float
    q95_tilt_deg: float
    probability: float
    probability_everywhere: float
    lowest_tension_N: float
    highest_tension_N: float
    feasible: float
    solved: float


class SliceOfWorkspace(TypedDict):
    """A slice across `axis` at one place; without numbers where no tensions hold the platform anywhere in it."""

    rotation_vector_rad: Numbers
    axis: str
    at_m: float
    feasible: float
    q05_drift_mm: NotRequired[float]
    q50_drift_mm: NotRequired[float]
    q95_drift_mm: NotRequired[float]
    q05_tilt_deg: NotRequired[float]
    q50_tilt_deg: NotRequired[float]
    q95_tilt_deg: NotRequired[float]
    probability: NotRequired[float]
    probability_everywhere: NotRequired[float]
    lowest_tension_N: NotRequired[float]
    highest_tension_N: NotRequired[float]
    solved: NotRequired[float]


class Workspace(ClaimNumbers):
    """The first orientation as a whole, then every slice of each."""

    slices: list[SliceOfWorkspace]


class RobotOnWires(Warned):
    """What every answer says; where nothing holds the platform, `sentence` says so and ends it."""

    version: int
    robot: str
    mass_kg: float
    wires: WiresUsed
    feasible: bool
    sentence: NotRequired[str]


class PoseJson(RobotOnWires):
    """The whole file for one pose."""

    pose: PoseNow
    tension_distribution: TensionDistribution
    orientation: NotRequired[OrientationFound]
    nearest_position_m: NotRequired[Numbers]
    plane: NotRequired[OnPlane]
    feasible_draws: NotRequired[float]
    inverse: NotRequired[InverseKinematics]
    forward: NotRequired[ForwardKinematics]
    equilibria: NotRequired[EquilibriaJson]
    certificate: NotRequired[CertificateJson]
    drift: NotRequired[list[Drift]]
    stability: NotRequired[list[Stability]]
    claim: NotRequired[Claim]
    pose_error: NotRequired[list[ControllerError]]
    between_calibrations: NotRequired[list[BetweenCalibrations]]
    variance_shares: NotRequired[VarianceShares]
    workspace: NotRequired[Workspace | None]


def stays(drift: Drift) -> bool:
    """Whether no draw of the wires moves the platform at any time: wires that do not creep."""
    return _is_zero(drift["distance_mm"]) and _is_zero(drift["rotation_deg"])


def _is_zero(band: Band) -> bool:
    """Whether what is never negative is zero at every time."""
    high = band["q95"]
    return high is not None and all(value == 0 for value in high)


def known_at_the_end(drift: Drift) -> bool:
    """Whether any draw holds the platform at the last time."""
    middle = drift["distance_mm"]["q50"]
    return middle is not None and middle[-1] is not None

"""``pose.json`` of a robot over time: poses from measured joint values, or where commanded poses lead."""

from typing import NotRequired, TypedDict

from wirebayes.json_files.pose import Drift, RobotOnWires
from wirebayes.json_files.values import Band, MeanAndSd, Numbers


class CalibratedStart(TypedDict):
    """The session that the history goes on from, and what it left known of the wires' reference lengths.

    Errors of points that it estimated are among those of the lengths, as far as they come to the same.
    """

    holds: int
    duration_s: float
    reference_error_mm: MeanAndSd


class HistoryOfRobot(TypedDict):
    """What the robot went through; `target` is what drift is counted from."""

    kind: str
    rows: int
    duration_s: float
    highest_payload_kg: float
    restart_share: float | None
    specimen_spread: float
    reference_sd_mm: NotRequired[float]
    calibration: NotRequired[CalibratedStart]
    target: NotRequired[str]
    holds: NotRequired[int]


class HistoryReadings(TypedDict):
    """Tensions and tilts that were read on the way, and how well they agree with joint values and wires.

    Given them, the draws are worth `effective_draws` independent ones; with too few the readings are not `used`.
    """

    tensions: int
    tilts: int
    tension_sd_N: float
    tilt_sd_rad: float
    misfit: NotRequired[float | None]
    converged: NotRequired[bool]
    effective_draws: NotRequired[float | None]
    used: NotRequired[bool]


class Corrections(TypedDict):
    """Changes of the joint values that bring the platform back, and what they leave."""

    times_s: Numbers
    change_mm: Band
    left_mm: Band


class ClockJson(TypedDict):
    """How far poses move if the wires' clocks run on instead of starting anew, or start anew at every stop."""

    largest_mm: float
    at_the_end_mm: float
    at_stops_largest_mm: NotRequired[float]
    at_stops_at_the_end_mm: NotRequired[float]


class DriftOverTime(Drift):
    """Drift from where the platform is meant to be; `held` is the share of the draws that hold it at each time."""

    held: Numbers


class PoseHistoryJson(RobotOnWires):
    """The whole file for a history."""

    history: HistoryOfRobot
    readings: NotRequired[HistoryReadings]
    drift: NotRequired[list[DriftOverTime]]
    position_m: NotRequired[Band]
    rotation_vector_rad: NotRequired[Band | None]
    corrections: NotRequired[Corrections]
    clock: NotRequired[ClockJson]

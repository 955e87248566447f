"""A pose of a robot on creeping wires."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from wirebayes.commands.asked_pose import AskedPose, asked_place, carried_options, loaded, spelled
from wirebayes.commands.options import (
    Numbers,
    above_zero,
    check_seed,
    check_spread,
    numbers,
    path_of,
    rising_times,
    text_of,
)
from wirebayes.commands.pose_history import Begun, calibrated_errors, checked_errors, pose_over_time
from wirebayes.commands.wires import (
    RobotLike,
    Wires,
    configuration,
    content_of,
    draws_for,
    robot_of,
)
from wirebayes.errors import InputError
from wirebayes.io.run_folder import open_run, write_csv, write_json
from wirebayes.json_files.plain import plain
from wirebayes.numeric.typing import Floats
from wirebayes.processes.workers import computing
from wirebayes.progress import Progress, silent
from wirebayes.robot.history.unknowns import Uncertain
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.draws import WireDraws, typical_spread
from wirebayes.robot.motion.boundless_creep import refuse_boundless_creep
from wirebayes.robot.pose.answer import PoseAnswer, pose_report
from wirebayes.robot.pose.maps import LEVEL, TABLE, Slices, rows
from wirebayes.robot.pose.orientation import balanced_orientation
from wirebayes.robot.pose.request import PoseRequest
from wirebayes.strict.files import PathLike
from wirebayes.views.calibration import Calibration
from wirebayes.views.pose import Pose
from wirebayes.views.result import ResultFolder

# an option; closest in the minute that the paper speaks of, and on to an hour
TIMES_S = (0.0, 10.0, 30.0, 60.0, 120.0, 300.0, 600.0, 1800.0, 3600.0)
TOLERANCE_MM, TOLERANCE_DEG = 0.3, 0.055  # what the paper claims
TENSION_SD_N, TILT_SD_RAD = 0.02, 1e-3
DRAWS, OVER_TIME = 1000, 200  # of the posterior; over time each is followed through every row


def pose(
    robot: RobotLike,
    wires: Wires | None = None,
    *,
    position: Numbers | None = None,
    rotation: Numbers | None = None,
    times: Numbers = TIMES_S,
    tolerance: float = TOLERANCE_MM,
    tolerance_tilt: float = TOLERANCE_DEG,
    specimen_spread: float = 0.05,
    map_heights: Numbers | None = None,
    map_rotations: Sequence[Numbers] | None = None,
    other_fit: Wires | None = None,
    joints: Any = None,
    trajectory: Any = None,
    payload: float | None = None,
    payload_at: Numbers | None = None,
    tension_sd: float = TENSION_SD_N,
    tilt_sd: float = TILT_SD_RAD,
    reference_sd: float = 0.0,
    calibration: PathLike | Calibration | None = None,
    draws: int | None = None,
    experiment: str | None = None,
    own_effects: PathLike | None = None,
    seed: int = 0,
    output: PathLike | None = None,
    progress: Progress = silent,
) -> Pose:
    """Kinematics of a robot on creeping wires; drift and pose error with uncertainty bands.

    Of one pose; of measured joint values over time (`joints`), for where the platform was; or of commanded poses and
    loads over time (`trajectory`). Over time it also writes ``poses.csv`` and ``corrections.csv``.

    Parameters
    ----------
    robot : Robot, name of a shipped robot, or path
    wires : Posterior, Findings, or path of a folder with a ``posterior.nc``; or a mapping of wire name to one of them
        May be left out where the robot's file gives the parameters of all wires.
        The line that the wires are cut from; of findings the final model. A list of several: tests of one line, from
        which the spread of its specimens is estimated.
    position : (3,) array, optional
        Of the platform in m; the robot's home pose when left out. With `joints`: about where it starts.
    rotation : (3,) array, optional
        Rotation vector in rad, None for a component that balance decides. When left out: of the home pose where the
        wires can command and hold it, else as the platform hangs in balance.
    times : sequence of float
        Rising times after the command, s.
    tolerance : float
        Allowed error of a single pose, mm.
    tolerance_tilt : float
        Allowed rotation of a single pose, degrees.
    specimen_spread : float
        Relative difference between wires of one line, where it is not estimated from several tests.
    map_heights : sequence of float, optional
        Heights of the workspace's slices that are mapped, m; three through the robot's box when left out.
    map_rotations : sequence of (3,) arrays, optional
        Rotation vectors, rad, of the platforms that are mapped; level when left out.
    other_fit : Posterior or path, optional
        Another fit of the line, which one more controller uses.
    joints : path of a CSV, DataFrame, or mapping of name to (t,) array, optional
        Joint values over time, and tensions, roll and pitch, payload and commanded poses where they are known.
    trajectory : path of a CSV, DataFrame, or mapping of name to (t,) array, optional
        Commanded poses over time, and payload.
    payload : float, optional
        Carried beside the platform's own mass, kg.
    payload_at : (3,) array, optional
        Centre of mass of `payload` in the platform's frame, m; the platform's own when left out.
    tension_sd, tilt_sd : float
        Over time: standard errors of measured tensions, N, and of roll and pitch, rad.
    reference_sd : float
        Over time: standard error of the lengths that joint values stand for, mm.
    calibration : Calibration or path of its folder, optional
        What `calibrate` found for this robot: with `joints` or `trajectory`, which then go on where its session ended.
    draws : int, optional
        Posterior draws used, evenly thinned; 1000 when left out, 200 over time.
    experiment : str, optional
        Which one, where several were fitted.
    own_effects : path, optional
        A Python file with effects of your own, where the fit used one and is read from a folder.
    seed : int
    output : path, optional
        Folder for the results.
    progress : function of name, done and total, optional

    Returns
    -------
    Pose
        Its `summary` is the content of ``pose.json``.

    Raises
    ------
    InputError
        Something that was given is wrong; in a table with line and column.

    Examples
    --------
    >>> held = wb.pose("linear-7", posterior, times=[0, 60], draws=40, output="out/pose")
    >>> held.summary()["drift"][0]["times_s"]
    [0.0, 60.0]
    >>> path = {"time_s": [0, 60, 3600], "x_m": [0, 0.1, 0.1], "y_m": [0, 0, 0], "z_m": [0.6, 0.6, 0.6]}
    >>> moved = wb.pose("linear-7", posterior, trajectory=path | {"payload_kg": [0, 0.2, 0.2]}, draws=20)
    >>> moved.summary()["history"]["rows"]
    3

    After a calibration, whose session wore the wires in and told their lengths:

    >>> known = wb.pose("linear-7", thin, trajectory=path, calibration=lengths, draws=20)
    >>> known.summary()["history"]["calibration"]["holds"]
    9
    """
    over_time = joints is not None or trajectory is not None
    if draws is None:
        draws = OVER_TIME if over_time else DRAWS
    given = _Given(robot, wires, draws, experiment, path_of(own_effects), check_seed(seed), output, progress)
    bare = robot_of(robot)
    machine = loaded(bare, payload, payload_at)
    allowed = _Allowed.of(times, tolerance, tolerance_tilt)
    specimen_spread = check_spread(specimen_spread, alike=False)
    asked = given.asked(machine, position, rotation, payload)
    specimen_spread = typical_spread(asked.line, specimen_spread)
    carried = carried_options(payload, payload_at)
    at = spelled({"--position": position, "--rotation": rotation})
    errors = checked_errors(reference_sd, specimen_spread, tension_sd, tilt_sd)
    if over_time:
        _refuse_single_only(allowed, map_heights, map_rotations, other_fit)
        errors = calibrated_errors(errors, calibration, bare, asked.line, wires, experiment)
        return _along(asked, joints, trajectory, errors, given.begun({**carried, **at}))
    _refuse_over_time_only(errors, calibration)
    slices = _slices(machine, map_heights, map_rotations)
    other, of_other = given.other(other_fit, machine)
    request = _request(asked, allowed, specimen_spread, slices)
    options = {
        **at,
        "--times": text_of(times),
        **allowed.options(),
        "--specimen-spread": specimen_spread,
        "--other-fit": of_other,
        **carried,
        **_options_of(slices),
    }
    begun = given.begun(options)
    return pose_at(asked, request, other, begun)


def _along(asked: AskedPose, joints: Any, trajectory: Any, errors: Uncertain, begun: Begun) -> Pose:
    """Poses over time, of measured joint values or of commands."""
    if errors.calibrated is not None:
        asked = replace(asked, line=errors.calibrated.prior.line)
    if joints is None:
        return pose_over_time(asked, "--trajectory", trajectory, errors, begun)
    if trajectory is not None:
        raise InputError("--joints and --trajectory: found both, expected one (a file of --joints may hold poses too)")
    return pose_over_time(asked, "--joints", joints, errors, begun)


def _options_of(slices: Slices) -> dict[str, Any]:
    """The slices as options decide a result; none where they were left out."""
    return {} if slices is LEVEL else {"--map-heights, --map-rotation": plain(asdict(slices))}


@dataclass(frozen=True)
class _Given:
    """What a single pose and poses over time are given alike."""

    robot: RobotLike
    wires: Wires | None
    draws: int
    experiment: str | None
    own_effects: Path | None
    seed: int
    output: PathLike | None
    progress: Progress

    def draws_of(self, wires: Wires | None, machine: Robot) -> WireDraws:
        """Draws of the posterior of some wires, for the robot with its payload."""
        return draws_for(machine, wires, self.draws, self.experiment, self.own_effects)

    def asked(
        self, machine: Robot, position: Numbers | None, rotation: Numbers | None, payload_kg: float | None
    ) -> AskedPose:
        """The pose of the robot with its payload, and its wires."""
        line = self.draws_of(self.wires, machine)
        place = asked_place(machine, position, rotation)
        return AskedPose(machine, line, *place, self.seed, self.own_effects, float(payload_kg or 0.0))

    def other(self, fit: Wires | None, machine: Robot) -> tuple[WireDraws | None, str | None]:
        """Draws of another fit of the line, and what its content is known by; none where there is none."""
        if fit is None:
            return None, None
        return self.draws_of(fit, machine), content_of(fit, self.experiment)

    def begun(self, options: Mapping[str, Any]) -> Begun:
        """Where results go, and what decides them."""
        content = content_of(self.wires, self.experiment)
        every = {"--experiment": self.experiment, **options}
        decides = configuration("pose", self.robot, content, self.draws, self.seed, self.own_effects, every)
        return Begun(decides, ResultFolder.at(self.output), self.progress)


@dataclass(frozen=True)
class _Allowed:
    """How far the platform may be from its pose, and when that is looked at."""

    times_s: Floats
    distance_mm: float
    tilt_deg: float

    @classmethod
    def of(cls, times: Numbers, tolerance: float, tolerance_tilt: float) -> "_Allowed":
        """What was asked for; what allows nothing is refused."""
        moments = rising_times(times)
        return cls(moments, *above_zero(("--tolerance", tolerance), ("--tolerance-tilt", tolerance_tilt)))

    def options(self) -> dict[str, float]:
        """As the command's options have it."""
        return {"--tolerance": self.distance_mm, "--tolerance-tilt": self.tilt_deg}


def _request(asked: AskedPose, allowed: _Allowed, specimen_spread: float, slices: Slices) -> PoseRequest:
    """The pose that is asked for, balance deciding what was left free."""
    there = balanced_orientation(asked.robot, asked.position_m, asked.rotation_rad)
    refuse_boundless_creep(asked.robot, asked.line, there.position_m, there.rotation, allowed.times_s[-1])
    return PoseRequest(
        there.position_m,
        there.rotation,
        allowed.times_s,
        tolerance_m=1e-3 * allowed.distance_mm,
        tolerance_rad=math.radians(allowed.tilt_deg),
        specimen_spread=specimen_spread,
        seed=asked.seed,
        slices=slices,
        orientation=there,
    )


def pose_at(asked: AskedPose, request: PoseRequest, other: WireDraws | None, begun: Begun) -> Pose:
    """One pose: ``pose.json``, the mapped workspace and pictures.

    Parameters
    ----------
    asked : AskedPose
    request : PoseRequest
    other : WireDraws or None
        Another fit of the line, which one more controller uses.
    begun : Begun
    """
    with open_run(begun.place.path, begun.decides) as run, computing():
        if run.state == "done":
            return Pose(begun.place, asked.own_effects, computed=False)
        _write(
            run.directory, asked.robot, request, pose_report(asked.robot, asked.line, request, other, begun.progress)
        )
        run.finish()
    return Pose(begun.place, asked.own_effects)


def _write(folder: Path, robot: Robot, request: PoseRequest, found: PoseAnswer) -> None:
    from wirebayes.report.pictures import robot as pictures  # matplotlib only where it is needed

    write_json(folder / "pose.json", found.content)
    if found.maps:
        write_csv(folder / "workspace.csv", TABLE, rows(found.maps))
    pictures.save_pose(folder, robot, request, found)


def _refuse_single_only(
    allowed: _Allowed, map_heights: Numbers | None, map_rotations: Sequence[Numbers] | None, other_fit: Wires | None
) -> None:
    """Refuse, beside poses over time, what is said of a single pose only."""
    usual = _Allowed(np.array(TIMES_S), TOLERANCE_MM, TOLERANCE_DEG)
    given = {
        "--map-heights and --map-rotation": map_heights is not None or map_rotations is not None,
        "--times and --other-fit": other_fit is not None or not np.array_equal(allowed.times_s, usual.times_s),
        "--tolerance and --tolerance-tilt": allowed.options() != usual.options(),
    }
    for options, are_given in given.items():
        if are_given:
            raise InputError(f"{options}: found beside a history, expected them for a single pose only")


def _refuse_over_time_only(errors: Uncertain, calibration: PathLike | Calibration | None) -> None:
    """Refuse, beside a single pose, what would change nothing there."""
    given = {
        "--calibration": calibration is not None,
        "--reference-sd": errors.reference_m != 0.0,
        "--tension-sd": errors.tension_N != TENSION_SD_N,
        "--tilt-sd": errors.tilt_rad != TILT_SD_RAD,
    }
    for option, is_given in given.items():
        if is_given:
            raise InputError(f"{option}: found beside a single pose, expected it beside --joints or --trajectory")


def _slices(robot: Robot, heights: Numbers | None, rotations: Sequence[Numbers] | None) -> Slices:
    """The requested slices; refused where the robot has only one height or one orientation."""
    if heights is None and rotations is None:
        return LEVEL
    _refuse_slices(robot, heights is not None, rotations is not None)
    levels = None if heights is None else np.unique(numbers("--map-heights", heights))
    turns = [numbers("--map-rotation", turn, 3) for turn in rotations or ()]
    return Slices(levels, np.array(turns) if turns else LEVEL.rotations_rad)


def _refuse_slices(robot: Robot, heights: bool, rotations: bool) -> None:
    """Refuse slices of what has only one height, or one orientation."""
    if robot.freedom == "orientation":
        raise InputError("--map-heights, --map-rotation: found for a platform on a ball joint, expected none")
    if heights and robot.plane is not None:
        raise InputError("--map-heights: found heights for a robot in a plane, expected none")
    if heights and (robot.upper_m[:2] == robot.lower_m[:2]).any():
        raise InputError("--map-heights: found heights for a workspace in a vertical plane, expected none")
    if rotations and robot.degrees == 3:
        raise InputError("--map-rotation: found one for a robot whose lines keep the orientation, expected none")

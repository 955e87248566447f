"""The zero-tension lengths of a robot's wires, from its own readings."""

import os
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from wirebayes.commands.options import above_zero, check_seed, check_spread, check_whole, from_zero, path_of
from wirebayes.commands.wires import (
    RobotLike,
    Wires,
    configuration,
    content_hash,
    content_of,
    draws_for,
    hash_of,
    robot_of,
)
from wirebayes.errors import InputError
from wirebayes.io.run_folder import open_run, read_json, stored_results, write_json
from wirebayes.json_files.calibrate import BelongsTo, CalibrateJson, UnknownsJson
from wirebayes.numeric.typing import Floats
from wirebayes.processes.workers import computing
from wirebayes.progress import Progress, silent
from wirebayes.robot.exchange.points import with_points
from wirebayes.robot.mechanics import schema
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.draws import WireDraws, typical_spread
from wirebayes.robot.mechanics.rotation import matrix
from wirebayes.robot.mechanics.undecided_models import most_probable
from wirebayes.robot.self_calibration import answer, session_file
from wirebayes.robot.self_calibration.calibrated import Calibrated, from_dict, to_dict
from wirebayes.robot.self_calibration.search import StatedPoses
from wirebayes.robot.self_calibration.session import LengthPrior, Session
from wirebayes.robot.self_calibration.unknowns import StatedErrors
from wirebayes.strict.columns import columns_table
from wirebayes.strict.files import PathLike
from wirebayes.views.calibration import Calibration
from wirebayes.views.result import ResultFolder

ROBOT = "robot.toml"  # with the calibrated points
_EXACT_MM = 1e-6  # what is exact is known this well
_MOST_VISITS = 100  # nobody visits more before calibrating again
UNKNOWNS = "unknowns.json"  # the posterior that a history can start from


def calibrate(
    robot: RobotLike,
    readings: Any,
    wires: Wires | None = None,
    *,
    tension_sd: float = 0.02,
    tilt_sd: float = 1e-3,
    reference_sd: float = 5.0,
    tension_bias: float | None = None,
    anchor_sd: float = 0.0,
    platform_sd: float = 0.0,
    pose_sd: float | None = None,
    drum_sd: float = 0.0,
    joint_sd: float | None = None,
    next_poses: int = 5,
    specimen_spread: float = 0.05,
    draws: int = 1000,
    experiment: str | None = None,
    own_effects: PathLike | None = None,
    seed: int = 0,
    output: PathLike | None = None,
    progress: Progress = silent,
) -> Calibration:
    """Estimate a robot's lengths, geometry and poses from joint values, tensions and whatever else was read.

    With exact geometry and tensions that were read the lengths alone are unknown, and stated poses are requests. An
    error of the anchors, of the platform points or of the drums makes these unknown too; with an error of the poses or
    the joint values, poses that nobody knows or a session without tensions, stated poses are readings.

    Parameters
    ----------
    robot : Robot, name of a shipped robot, or path
    readings : path of a CSV, DataFrame, or mapping of name to (r,) array
        A row per hold, in order: pose or NaN, duration, joint values or motor angles, and tensions at its end or
        NaN.
    wires : Posterior, Findings, or path of a folder with a ``posterior.nc``; or a mapping of wire name to one of them
        May be left out where the robot's file gives the parameters of all wires.
    tension_sd : float
        Standard error of a tension, N.
    tilt_sd : float
        Standard error of the platform's normal, rad.
    reference_sd : float
        Standard error of the reference lengths, mm; 0: exact.
    anchor_sd, platform_sd : float
        Standard error of every coordinate of the exit points, of the platform points, mm; 0: exact.
    pose_sd : float, optional
        Standard error of every coordinate of the poses that the readings state, mm; 0: exact. Left out, exact poses
        that contradict the joint values, or only repeat them, are taken for requests, and said so.
    drum_sd : float
        Standard error of every drum's radius, percent; 0: exact.
    joint_sd : float, optional
        Standard error of a joint value as a length, mm. Left out, it is estimated where geometry is unknown, and zero
        where it is exact.
    next_poses : int
        Number of poses to propose for the next session.
    tension_bias : float, optional
        Standard deviation of each tension sensor's bias, N: its zero or, where the readings say in which direction a
        wire moved last (``motion_1`` and so on: 1 pulled in, -1 let out), friction between sensor and wire. Left out:
        what the robot's file says, none unless it says one.
    specimen_spread : float
        Relative difference between wires of one line.
    draws : int
        Posterior draws used, evenly thinned.
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
    Calibration
        Its `summary` is the content of ``calibration.json``.

    Raises
    ------
    InputError
        Something that was given is wrong, with line and column.

    Examples
    --------
    >>> lengths = wb.calibrate("linear-7", "linear-7-session.csv", thin, draws=100, output="out/calibrate")
    >>> len(lengths.summary()["with_creep_model"]["length_m"]["mean"])
    7
    """
    own = path_of(own_effects)
    seed = check_seed(seed)
    given = _GivenErrors(tension_sd, tilt_sd, reference_sd, anchor_sd, platform_sd, pose_sd, drum_sd, joint_sd)
    specimen_spread = check_spread(specimen_spread)
    given = given.checked()
    check_whole("--next-poses", next_poses, 0, _MOST_VISITS)
    machine = _known_robot(robot)
    bias = _tension_bias(machine, tension_bias)
    session, values, read = _session(readings, machine, given, bias)
    line = most_probable(draws_for(machine, wires, draws, experiment, own))
    options = {
        "--experiment": experiment,
        **given.of_readings(),
        "--specimen-spread": specimen_spread,
        "readings": read,
    }
    if bias:
        options["--tension-bias"] = bias
    options |= given.of_geometry()
    options["--next-poses"] = next_poses
    place = ResultFolder.at(output)
    decides = configuration("calibrate", robot, content_of(wires, experiment), draws, seed, own, options)
    with open_run(place.path, decides) as run:
        if run.state != "done":
            spread = typical_spread(line, specimen_spread)
            prior = LengthPrior(line, 1e-3 * max(given.reference_mm, _EXACT_MM), spread, bias_sd_N=bias)
            found, known, whole = _estimated(machine, prior, given, (session, values), seed, next_poses, progress)
            calibrated = _calibrated_robot(run.directory / ROBOT, robot, machine, whole, found["usable"])
            _write(run.directory, calibrated, found, known, _belongs_to(calibrated, wires, experiment))
            run.finish()
    return Calibration(place, own, computed=run.state != "done")


def _known_robot(robot: RobotLike) -> Robot:
    """A robot whose platform is one that can be calibrated."""
    machine = robot_of(robot)
    if machine.freedom == "orientation":
        raise InputError(f"{machine.name}: found a platform on a ball joint, expected one that calibrate knows")
    return machine


@dataclass(frozen=True)
class _GivenErrors:
    """Standard errors as they are given: of tensions, tilts, lengths, points, poses, drums and joint values."""

    tension_N: float
    tilt_rad: float
    reference_mm: float
    anchor_mm: float
    platform_mm: float
    pose_mm: float | None
    drum_percent: float
    joint_mm: float | None

    def checked(self) -> "_GivenErrors":
        """With errors of readings as Python floats; what cannot be a standard error is refused."""
        tension_N, tilt_rad = above_zero(("--tension-sd", self.tension_N), ("--tilt-sd", self.tilt_rad))
        reference_mm, *_ = from_zero(
            ("--reference-sd", self.reference_mm),
            ("--anchor-sd", self.anchor_mm),
            ("--platform-sd", self.platform_mm),
            ("--pose-sd", self.pose_mm or 0.0),
            ("--drum-sd", self.drum_percent),
            ("--joint-sd", self.joint_mm or 0.0),
        )
        return replace(self, tension_N=tension_N, tilt_rad=tilt_rad, reference_mm=reference_mm)

    def of_readings(self) -> dict[str, float]:
        """Options that say how well tensions, tilts and references are known."""
        return {
            "--tension-sd": self.tension_N,
            "--tilt-sd": self.tilt_rad,
            "--reference-sd": self.reference_mm,
        }

    def of_geometry(self) -> dict[str, float | None]:
        """Options that say how well points, poses, drums and joint values are known."""
        return {
            "--anchor-sd": float(self.anchor_mm),
            "--platform-sd": float(self.platform_mm),
            "--pose-sd": self.pose_mm,
            "--drum-sd": float(self.drum_percent),
            "--joint-sd": self.joint_mm,
        }

    @property
    def exact(self) -> bool:
        """Whether the robot is as its file says, but for its lengths."""
        return not (self.anchor_mm or self.platform_mm or self.drum_percent)

    def poses(self, session: Session) -> StatedPoses:
        """What the poses of a session are."""
        stated = self.pose_mm or self.joint_mm is not None
        all_known = np.isfinite(session.position_m).all() and np.isfinite(session.rotation).all()
        if self.exact and not stated and all_known and session.read.any():
            return StatedPoses.REQUESTED
        return StatedPoses.EITHER if self.pose_mm is None else StatedPoses.MEASURED

    def stated(self, robot: Robot) -> StatedErrors:
        """Errors of geometry, poses and joint values in metres."""
        joint_m = 0.0 if self.exact else None
        if self.joint_mm is not None:
            joint_m = 1e-3 * self.joint_mm
        platform_mm = self.platform_mm if robot.degrees == 6 else 0.0  # of a point, they are errors of the exit points
        pose_mm = self.pose_mm or 0.0
        return StatedErrors(
            1e-3 * self.anchor_mm,
            1e-3 * platform_mm,
            1e-3 * pose_mm,
            joint_m,
            1e-2 * self.drum_percent,
        )


def _tension_bias(robot: Robot, given: float | None) -> float:
    """Standard deviation of the tension sensors' bias, N: as given, or what the robot's file says."""
    if given is None:
        return robot.tension_bias_N
    (bias,) = from_zero(("--tension-bias", given))
    return bias


def _session(readings: Any, robot: Robot, given: _GivenErrors, bias: float) -> tuple[Session, Floats, str]:
    """A session, its standardised readings, and the hash of the table that they are from."""
    sds = given.tension_N, given.tilt_rad
    if isinstance(readings, str | os.PathLike):
        session, values = session_file.read_session(Path(readings), robot, *sds, bias > 0)
        return session, values, content_hash(Path(readings))
    table = columns_table(readings, Path("readings"), session_file.may_be_empty)
    session, values = session_file.parse_session(table, robot, *sds, bias > 0)
    return session, values, hash_of({"readings": [table.header, *table.rows]})


def _estimated(
    robot: Robot,
    prior: LengthPrior,
    given: _GivenErrors,
    read: tuple[Session, Floats],
    seed: int,
    visits: int,
    progress: Progress,
) -> tuple[CalibrateJson, Calibrated, Robot | None]:
    """The content of ``calibration.json``, the posterior, and the robot where more than lengths is estimated."""
    errors = given.stated(robot)
    poses = given.poses(read[0])
    with computing(), np.errstate(all="ignore"):  # what cannot be computed is not converged, and said so
        found = answer.calibration_report(robot, prior, errors, *read, seed, poses, visits, progress)
    return found.content, found.known, None if given.exact else found.robot


def _write(folder: Path, robot: Robot, found: CalibrateJson, known: Calibrated, of: BelongsTo) -> None:
    """Write what was found; the posterior that a history can start from only where it is usable."""
    write_json(folder / "calibration.json", found)
    if found["usable"]:
        unknowns: UnknownsJson = {**of, **to_dict(known)}
        write_json(folder / UNKNOWNS, unknowns)
    _write_scene(folder / "scene.json", robot, found)


def _write_scene(path: Path, robot: Robot, found: CalibrateJson) -> None:
    """Write the points of the view that can be turned, where the platform's place is known."""
    pose = found["pose_now"]
    if pose is None:
        return
    from wirebayes.report.pictures.robot import still_points  # matplotlib only where it is needed

    position = np.asarray(pose["position_m"])
    rotation = matrix(np.asarray(pose["rotation_vector_rad"]))
    write_json(path, still_points(robot, position, rotation))


def _calibrated_robot(path: Path, given: RobotLike, before: Robot, whole: Robot | None, usable: bool) -> Robot:
    """The robot as calibrated, where more than lengths was estimated; what its file says, where it may be used."""
    if whole is None:
        return before
    return _write_robot(path, given, whole) if usable else whole


def _write_robot(path: Path, given: RobotLike, calibrated: Robot) -> Robot:
    """Write the robot's file with its calibrated points, and read what it says; a robot without a file has none."""
    if isinstance(given, Robot):
        return calibrated
    text = with_points(schema.robot_text(Path(given)), calibrated)
    path.write_text(text, encoding="utf-8")
    return robot_of(schema.parse(text, str(path)))


def calibrated_of(
    calibration: PathLike | Calibration, robot: Robot, line: WireDraws, wires: Wires | None, experiment: str | None
) -> Calibrated:
    """What a calibration left known, for a robot and a line that must be those it was done with.

    Parameters
    ----------
    calibration : Calibration or path of its folder
    robot : Robot
        Without payload.
    line : WireDraws
    wires : Posterior, path or mapping
        What `line` was read from.
    experiment : str or None

    Returns
    -------
    Calibrated

    Raises
    ------
    InputError
        It has not converged, is not usable, is of another robot or line, or is no calibration.
    """
    folder = calibration.folder if isinstance(calibration, Calibration) else Path(calibration)
    _check_usable(folder, robot.name)
    path = folder / UNKNOWNS
    absent = f"{path}: found no such file, expected what calibrate writes; run it again in a new folder"
    stored: UnknownsJson = read_json(path, absent)
    with stored_results(path):
        own = _belongs_to(robot, wires, experiment)
        same_robot = stored["robot"] == own["robot"]
        if not same_robot:
            of_another = f"found one of another {robot.name} in {folder}"
            raise InputError(f"--calibration: {of_another}, expected one of the robot given")
        same_wires = stored["wires"] == own["wires"]
        if not same_wires:
            raise InputError(f"--calibration: found one with other wires in {folder}, expected those of --wires")
        return from_dict(stored, robot, line)


def _check_usable(folder: Path, name: str) -> None:
    """Refuse what is no calibration of a robot, or one that says it is not to be used."""
    expected = f"expected a calibration of {name} that has converged"
    summary = folder / "calibration.json"
    found: CalibrateJson = read_json(summary, f"--calibration: found no calibration.json in {folder}, {expected}")
    with stored_results(summary):
        of_robot = str(found["robot"])
        converged = bool(found["with_creep_model"]["converged"])
        usable = bool(found["usable"])
        has_drums = "drum_wider_percent" in found
        kinds = sorted({notice["kind"] for notice in found["warnings"]})
    if of_robot != name:
        raise InputError(f"--calibration: found one of {of_robot} in {folder}, {expected}")
    if not converged:
        raise InputError(f"--calibration: found one that has not converged in {folder}, {expected}")
    if not usable:
        reasons = f" (warnings: {', '.join(kinds)})" if kinds else ""
        raise InputError(
            f"--calibration: found one that says it is not usable in {folder}{reasons}, "
            f"expected a calibration of {name} that may be set in a controller"
        )
    if has_drums:  # nobody knows which radii later joint values are computed with
        raise InputError(
            f"--calibration: found one with --drum-sd in {folder}, expected one without: set the radii that {summary} "
            "gives (drum_wider_percent) in the controller and calibrate again"
        )


def _belongs_to(robot: Robot, wires: Wires | None, experiment: str | None) -> BelongsTo:
    """What tells a robot and the posterior of its wires from others."""
    kept = content_of(wires, experiment)
    return {"robot": hash_of(asdict(robot)), "wires": kept}

"""The zero-tension lengths of a robot's wires, from its own readings."""

import math
import os
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from wirebayes.commands.options import above_zero, check_seed, check_spread, from_zero, path_of
from wirebayes.commands.wires import (
    RobotLike,
    Wires,
    configuration,
    content_hash,
    draws_for,
    hash_of,
    posterior_of,
    robot_of,
)
from wirebayes.errors import InputError
from wirebayes.io.run_folder import open_run, read_json, stored_results, write_json
from wirebayes.json_files.calibrate import BelongsTo, CalibrateJson, UnknownsJson
from wirebayes.processes.workers import computing
from wirebayes.robot.exchange.points import with_points
from wirebayes.robot.mechanics import schema
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.draws import WireDraws, typical_spread
from wirebayes.robot.mechanics.rotation import matrix
from wirebayes.robot.self_calibration import session_file, whole_answer
from wirebayes.robot.self_calibration.answer import lengths_report
from wirebayes.robot.self_calibration.calibrated import Calibrated, from_dict, to_dict
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
    wires: Wires,
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
) -> Calibration:
    """Estimate a robot's lengths, geometry and poses from joint values, tensions and whatever else was read.

    With exact geometry, tensions and requested poses this is the calibration of the lengths alone. An error of the
    anchors, of the platform points, of the drums or of stated poses, poses that nobody knows or a session without
    tensions make it the calibration of the whole robot.

    Parameters
    ----------
    robot : Robot, name of a shipped robot, or path
    readings : path of a CSV, DataFrame, or mapping of name to (r,) array
        A row per hold, in order: pose or NaN, duration, joint values or motor angles, and tensions at its end or
        NaN.
    wires : Posterior, Findings, or path of a folder with a ``posterior.nc``; or a mapping of wire name to one of them
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
    own, seed = path_of(own_effects), check_seed(seed)
    tension_sd, tilt_sd, reference_sd = float(tension_sd), float(tilt_sd), float(reference_sd)
    specimen_spread = check_spread(specimen_spread)
    above_zero(("--tension-sd", tension_sd), ("--tilt-sd", tilt_sd))
    from_zero(
        ("--reference-sd", reference_sd), ("--anchor-sd", anchor_sd), ("--platform-sd", platform_sd),
        ("--pose-sd", pose_sd or 0.0), ("--drum-sd", drum_sd), ("--joint-sd", joint_sd or 0.0),
    )  # fmt: skip
    if not 0 <= next_poses <= _MOST_VISITS:
        raise InputError(f"--next-poses: found {next_poses}, expected a number from 0 to {_MOST_VISITS}")
    machine = robot_of(robot)
    if machine.freedom == "orientation":
        raise InputError(f"{machine.name}: found a platform on a ball joint, expected one that calibrate knows")
    bias = machine.tension_bias_N if tension_bias is None else float(tension_bias)
    if not 0 <= bias < math.inf:
        raise InputError(f"--tension-bias: found {bias:g}, expected a number of at least 0")
    if isinstance(readings, str | os.PathLike):
        session, values = session_file.read_session(Path(readings), machine, tension_sd, tilt_sd, bias > 0)
        read = content_hash(Path(readings))
    else:
        table = columns_table(readings, Path("readings"), session_file.may_be_empty)
        session, values = session_file.parse_session(table, machine, tension_sd, tilt_sd, bias > 0)
        read = hash_of({"readings": [table.header, *table.rows]})
    line = draws_for(machine, wires, draws, experiment, own)
    options = {
        "--experiment": experiment, "--tension-sd": tension_sd, "--tilt-sd": tilt_sd, "--reference-sd": reference_sd,
        "--specimen-spread": specimen_spread, "readings": read, **({"--tension-bias": bias} if bias else {}),
        "--anchor-sd": float(anchor_sd), "--platform-sd": float(platform_sd), "--pose-sd": pose_sd,
        "--drum-sd": float(drum_sd), "--joint-sd": joint_sd, "--next-poses": next_poses,
    }  # fmt: skip
    place = ResultFolder.at(output)
    decides = configuration("calibrate", robot, posterior_of(wires, experiment), draws, seed, own, options)
    with open_run(place.path, decides) as run:
        if run.state != "done":
            prior = LengthPrior(
                line, 1e-3 * max(reference_sd, _EXACT_MM), typical_spread(line, specimen_spread), bias_sd_N=bias
            )
            errors = _errors(machine, session, anchor_sd, platform_sd, pose_sd, drum_sd, joint_sd)
            calibrated = machine
            with computing(), np.errstate(all="ignore"):  # what cannot be computed is not converged, and said so
                if errors is None:
                    found, known = lengths_report(machine, prior, session, values, seed, next_poses)
                else:
                    requests = pose_sd is None
                    whole = whole_answer.calibration_report(
                        machine, prior, errors, session, values, seed, requests, next_poses
                    )
                    found, known = whole.content, whole.known
                    path = run.directory / ROBOT
                    calibrated = _write_robot(path, robot, whole.robot) if found["usable"] else whole.robot
            write_json(run.directory / "calibration.json", found)
            if found["usable"]:
                unknowns: UnknownsJson = {**_belongs_to(calibrated, wires, experiment), **to_dict(known)}
                write_json(run.directory / UNKNOWNS, unknowns)
            _write_scene(run.directory / "scene.json", calibrated, found)
            run.finish()
    return Calibration(place, own, computed=run.state != "done")


def _errors(
    robot: Robot,
    session: Session,
    anchor_sd: float,
    platform_sd: float,
    pose_sd: float | None,
    drum_sd: float,
    joint_sd: float | None,
) -> StatedErrors | None:
    """Errors of geometry and poses in metres; None where the lengths alone are to be estimated."""
    somewhere = bool(np.isfinite(session.position_m).all() and np.isfinite(session.rotation).all())
    exact = not (anchor_sd or platform_sd or drum_sd)
    if exact and not pose_sd and joint_sd is None and somewhere and session.read.any():
        return None
    joint = joint_sd if joint_sd is not None else (0.0 if exact else None)
    return StatedErrors(
        1e-3 * anchor_sd,
        1e-3 * platform_sd if robot.degrees == 6 else 0.0,  # of a point, they are errors of the exit points
        1e-3 * (pose_sd or 0.0),
        None if joint is None else 1e-3 * joint,
        1e-2 * drum_sd,
    )


def _write_scene(path: Path, robot: Robot, found: CalibrateJson) -> None:
    """Write the points of the view that can be turned, where the platform's place is known."""
    if found["pose_now"] is None:
        return
    from wirebayes.report.pictures.robot import still_points  # matplotlib only where it is needed

    here, turn = (np.asarray(found["pose_now"][key]) for key in ("position_m", "rotation_vector_rad"))
    write_json(path, still_points(robot, here, matrix(turn)))


def _write_robot(path: Path, given: RobotLike, calibrated: Robot) -> Robot:
    """Write the robot's file with its calibrated points, and read what it says; a robot without a file has none."""
    if isinstance(given, Robot):
        return calibrated
    text = with_points(schema.robot_text(Path(given)), calibrated)
    path.write_text(text, encoding="utf-8")
    return schema.parse(text, str(path))


def calibrated_of(
    calibration: PathLike | Calibration, robot: Robot, line: WireDraws, wires: Wires, experiment: str | None
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
    expected = f"expected a calibration of {robot.name} that has converged"
    summary = folder / "calibration.json"
    found: CalibrateJson = read_json(summary, f"--calibration: found no calibration.json in {folder}, {expected}")
    with stored_results(summary):
        name, converged = str(found["robot"]), bool(found["with_creep_model"]["converged"])
        usable, kinds = bool(found["usable"]), sorted({one["kind"] for one in found["warnings"]})
    if name != robot.name:
        raise InputError(f"--calibration: found one of {name} in {folder}, {expected}")
    if not converged:
        raise InputError(f"--calibration: found one that has not converged in {folder}, {expected}")
    if not usable:
        reasons = f" (warnings: {', '.join(kinds)})" if kinds else ""
        raise InputError(
            f"--calibration: found one that says it is not usable in {folder}{reasons}, "
            f"expected a calibration of {name} that may be set in a controller"
        )
    path = folder / UNKNOWNS
    absent = f"{path}: found no such file, expected what calibrate writes; run it again in a new folder"
    stored: UnknownsJson = read_json(path, absent)
    with stored_results(path):
        own = _belongs_to(robot, wires, experiment)
        if stored["robot"] != own["robot"]:
            raise InputError(f"--calibration: found one of another {name} in {folder}, expected one of the robot given")
        if stored["wires"] != own["wires"]:
            raise InputError(f"--calibration: found one with other wires in {folder}, expected those of --wires")
        return from_dict(stored, robot, line)


def _belongs_to(robot: Robot, wires: Wires, experiment: str | None) -> BelongsTo:
    """What tells a robot and the posterior of its wires from others."""
    posterior = posterior_of(wires, experiment)
    kept = posterior if isinstance(posterior, str) else content_hash(posterior)
    return {"robot": hash_of(asdict(robot)), "wires": kept}

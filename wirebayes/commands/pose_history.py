"""A robot's measured or commanded history: what `pose` does where it is given one."""

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from wirebayes.commands.asked_pose import OFF_PLANE, AskedPose
from wirebayes.commands.calibrate import calibrated_of
from wirebayes.commands.options import above_zero, one_number
from wirebayes.commands.wires import Wires, content_hash, hash_of
from wirebayes.errors import InputError
from wirebayes.io.run_folder import open_run, write_csv, write_json
from wirebayes.processes.workers import computing
from wirebayes.progress import Progress
from wirebayes.robot.history import table
from wirebayes.robot.history.another_unit import refuse_another_unit
from wirebayes.robot.history.answer import history_report
from wirebayes.robot.history.history import History
from wirebayes.robot.history.unknowns import Uncertain
from wirebayes.robot.mechanics import plane
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.draws import WireDraws
from wirebayes.robot.mechanics.undecided_models import most_probable
from wirebayes.robot.motion.boundless_creep import refuse_boundless_creep
from wirebayes.robot.self_calibration.calibrated import to_dict
from wirebayes.sentences import short
from wirebayes.strict.columns import columns_table
from wirebayes.strict.files import PathLike
from wirebayes.views.calibration import Calibration
from wirebayes.views.pose import Pose
from wirebayes.views.result import ResultFolder


def checked_errors(reference_sd: float, specimen_spread: float, tension_sd: float, tilt_sd: float) -> Uncertain:
    """Standard errors in the robot's units, mm and N and rad in.

    Parameters
    ----------
    reference_sd : float
        Of a wire's reference length, mm.
    specimen_spread : float
        Relative difference between specimens of one line.
    tension_sd : float
        Of a tension reading, N.
    tilt_sd : float
        Of an inclinometer's angle, rad.

    Returns
    -------
    Uncertain

    Raises
    ------
    InputError
        If one is not a number that it can be.
    """
    reference_sd = one_number("--reference-sd", reference_sd, "millimetres, 0 or more")
    tension_sd, tilt_sd = above_zero(("--tension-sd", tension_sd), ("--tilt-sd", tilt_sd))
    if not 0 <= reference_sd < np.inf:
        raise InputError(f"--reference-sd: found {reference_sd:g}, expected millimetres, 0 or more")
    return Uncertain(1e-3 * reference_sd, float(specimen_spread), tension_sd, tilt_sd)


def calibrated_errors(
    errors: Uncertain,
    calibration: PathLike | Calibration | None,
    robot: Robot,
    line: WireDraws,
    wires: Wires | None,
    experiment: str | None,
) -> Uncertain:
    """The same standard errors, with what a calibration left known in the place of reference error and spread.

    Parameters
    ----------
    errors : Uncertain
    calibration : Calibration, path of its folder, or None
        None leaves the errors as they are.
    robot : Robot
        Without payload.
    line : WireDraws
        Of undecided models the most probable counts.
    wires : Posterior, path or mapping
        What `line` was read from.
    experiment : str or None

    Returns
    -------
    Uncertain

    Raises
    ------
    InputError
        The calibration is not one of this robot and these wires, or a reference error was given beside it.
    """
    if calibration is None:
        return errors
    if errors.reference_m:
        raise InputError("--reference-sd: found beside --calibration, which knows the lengths, expected one of them")
    known = calibrated_of(calibration, robot, most_probable(line), wires, experiment)
    return replace(errors, spread=known.prior.spread, calibrated=known)


@dataclass(frozen=True)
class Begun:
    """A command that knows what decides its results, and where they go.

    Attributes
    ----------
    decides : dict
        For ``configuration.json``.
    place : ResultFolder
        Folder of the results.
    progress : callable
        Called with a name, what is done and the total.
    """

    decides: dict[str, Any]
    place: ResultFolder
    progress: Progress


_COLUMNS = {"--joints": table.measured_columns, "--trajectory": table.commanded_columns}


def pose_over_time(asked: AskedPose, option: str, given: Any, errors: Uncertain, begun: Begun) -> Pose:
    """Poses over time from measured joint values or for commanded poses: ``pose.json``, two tables and pictures.

    Parameters
    ----------
    asked : AskedPose
        The pose near which the first row's is sought.
    option : {"--joints", "--trajectory"}
        What is given.
    given : path of a CSV, DataFrame, or mapping of name to (t,) array
    errors : Uncertain
    begun : Begun

    Raises
    ------
    InputError
        The table is wrong (line and column).
    """
    robot = asked.robot
    columns = _COLUMNS[option]
    name = option[2:]
    if isinstance(given, str | os.PathLike):
        file = Path(given)
        history = table.read_log(file, robot, columns)
        read = content_hash(file)
    else:
        cells = columns_table(given, Path(name), table.may_be_unread)
        history = table.parse_log(cells, robot, columns)
        read = hash_of({option: [cells.header, *cells.rows]})
    _refuse_two_payloads(asked, option, history)
    _refuse_off_plane(robot, option, history)
    refuse_boundless_creep(robot, asked.line, *asked.start, history.times_s[-1] - history.times_s[0])
    with np.errstate(all="ignore"):
        refuse_another_unit(robot, asked.line, history, asked.start, errors)
    lasting = {  # in a fixed order, as in `wires.configuration`
        "of": name,
        "content": read,
        "--reference-sd (m)": errors.reference_m,
        "--specimen-spread": errors.spread,
        "--tension-sd": errors.tension_N,
        "--tilt-sd": errors.tilt_rad,
    }
    if errors.calibrated is not None:
        lasting["--calibration"] = hash_of(to_dict(errors.calibrated))
    decides = begun.decides | {"history": lasting}
    with open_run(begun.place.path, decides) as opened:
        if opened.state == "done":
            return Pose(begun.place, asked.own_effects, computed=False)
        with computing(), np.errstate(all="ignore"):  # a draw whose platform falls has no numbers
            found = history_report(robot, asked.line, history, errors, asked.start, asked.seed, begun.progress)
        folder = opened.directory
        write_json(folder / "pose.json", found.content)
        for file_name, (header, rows) in found.tables.items():
            write_csv(folder / file_name, header, rows)
        from wirebayes.report.pictures import robot_history as pictures  # matplotlib only where it is needed

        pictures.save_history_pictures(folder, robot, history, found)
        opened.finish()
    return Pose(begun.place, asked.own_effects)


def _refuse_two_payloads(asked: AskedPose, option: str, history: History) -> None:
    """Refuse a payload of the table beside one of the command: whether they add up, nobody said."""
    if asked.payload_kg and history.payload_kg.any():
        given = f"found {table.PAYLOAD} in the table of {option} beside --payload {asked.payload_kg:g}"
        raise InputError(f"{given}, expected one of them: write what is carried in all into the table")


def _refuse_off_plane(robot: Robot, option: str, history: History) -> None:
    """Refuse commanded poses that a plane does not allow."""
    if robot.motions is None or history.position_m is None or history.rotation is None:
        return
    far = plane.off(robot, history.position_m, history.rotation)
    if far.max() > OFF_PLANE * robot.span_m:
        when = history.times_s[int(far.argmax())]
        raise InputError(
            f"{option}: found a pose {short(far.max(), 3)} m off the robot's plane or ball joint at {when:g} s, "
            "expected none"
        )

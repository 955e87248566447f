"""The robot's commands: `pose`, `calibrate` and `export`."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from wirebayes.cli.options import ExperimentName, Output, Seed

if TYPE_CHECKING:
    from wirebayes.bayes.result import Stored
    from wirebayes.robot.draws import WireDraws

RobotFile = Annotated[str, typer.Argument(metavar="ROBOT.toml", help="A robot's file, or the name of a shipped robot.")]
Wires = Annotated[Path, typer.Option("--wires", metavar="FOLDER", help="A folder with a posterior.nc.")]
Draws = Annotated[int, typer.Option("--draws", min=1, help="Posterior draws used, evenly thinned.")]


def pose(
    robot: RobotFile,
    wires: Wires,
    output: Output,
    position: Annotated[str | None, typer.Option(metavar="X,Y,Z", help="Pose in metres; default: the file's.")] = None,
    rotation: Annotated[str | None, typer.Option(metavar="X,Y,Z", help="Rotation vector in radians.")] = None,
    times: Annotated[str, typer.Option(metavar="T,T,…", help="Times in seconds.")] = "0,10,30,60,120,300,600,1800,3600",
    draws: Draws = 1000,
    experiment: ExperimentName = None,
    seed: Seed = 0,
) -> None:
    """Kinematics with creeping wires, drift and pose error with bands."""
    from wirebayes.robot import schema

    machine = schema.read(robot)
    line = read_wires(wires, draws, experiment)
    where = machine.home_m if position is None else _numbers("--position", position, 3)
    turn = machine.home_rotation_rad if rotation is None else _numbers("--rotation", rotation, 3)
    moments = _times(times)

    from wirebayes.output import open_run, write_json
    from wirebayes.report import robot as pictures
    from wirebayes.robot.answer import Question, answer
    from wirebayes.robot.rotation import matrix

    asked = Question(where, matrix(turn), moments, seed=seed)
    run = open_run(output, _configuration("pose", robot, wires, draws, seed, experiment, position, rotation, times))
    if run.state == "done":
        return
    content, courses = answer(machine, line, asked)
    write_json(run.directory / "pose.json", content)
    pictures.save_pose(run.directory, machine, asked, content, courses)
    run.finish()
    for warning in content.get("warnings", []):
        typer.echo(f"warning: {warning}", err=True)


def calibrate(
    robot: RobotFile,
    readings: Annotated[Path, typer.Argument(metavar="READINGS.csv", help="Poses, joints and tensions, in order.")],
    wires: Wires,
    output: Output,
    tension_sd: Annotated[float, typer.Option("--tension-sd", metavar="N", help="Error of a tension, newtons.")] = 0.02,
    tilt_sd: Annotated[float, typer.Option("--tilt-sd", metavar="RAD", help="Error of the normal.")] = 1e-3,
    reference_sd: Annotated[
        float, typer.Option("--reference-sd", metavar="MM", help="How wrong the reference lengths may be.")
    ] = 5.0,
    spread: Annotated[float, typer.Option("--specimen-spread", help="Relative, from wire to wire of one line.")] = 0.05,
    draws: Draws = 1000,
    experiment: ExperimentName = None,
    seed: Seed = 0,
) -> None:
    """Current zero-tension length of every wire from joint values and tensions, no external sensor needed."""
    from wirebayes.errors import InputError
    from wirebayes.output import open_run, write_json
    from wirebayes.robot import schema, session_file
    from wirebayes.robot.calibration_answer import answer
    from wirebayes.robot.session import Prior

    for name, value in (("--tension-sd", tension_sd), ("--tilt-sd", tilt_sd), ("--reference-sd", reference_sd)):
        if not 0 < value < float("inf"):
            raise InputError(f"{name}: found {value:g}; expected a finite number above 0")
    if not 0 <= spread < 1:
        raise InputError(f"--specimen-spread: found {spread:g}; expected a number from 0 to 1")
    machine = schema.read(robot)
    session, values = session_file.read(readings, machine, tension_sd, tilt_sd)
    line = read_wires(wires, draws, experiment)
    options = (experiment, tension_sd, tilt_sd, reference_sd, spread, _content(readings))
    run = open_run(output, _configuration("calibrate", robot, wires, draws, seed, *options))
    if run.state == "done":
        return
    prior = Prior(line, 1e-3 * reference_sd, spread)
    write_json(run.directory / "calibrate.json", answer(machine, prior, session, values, seed))
    run.finish()


def export(
    robot: RobotFile,
    wires: Wires,
    output: Output,
    tensions: Annotated[str, typer.Option(metavar="N,N,…", help="Tensions of the creep table.")] = "1,2,4,8",
    times: Annotated[str, typer.Option(metavar="T,T,…", help="Times of the creep table, s.")] = "60,600,3600,86400",
    draws: Draws = 1000,
    experiment: ExperimentName = None,
    seed: Seed = 0,
) -> None:
    """Spring constants and creep in firmware units (Hangprinter), and the robot as a MuJoCo model."""
    import numpy as np

    from wirebayes.errors import InputError
    from wirebayes.output import open_run, write_csv, write_text
    from wirebayes.robot import export as files
    from wirebayes.robot import inverse, schema
    from wirebayes.robot.draws import for_robot
    from wirebayes.robot.mujoco_model import mjcf
    from wirebayes.robot.rotation import matrix

    machine = schema.read(robot)
    loads, moments = _numbers("--tensions", tensions), _times(times)
    if loads.min() <= 0:
        raise InputError(f"--tensions: found {tensions!r}; expected numbers above 0")
    line = read_wires(wires, draws, experiment)
    run = open_run(output, _configuration("export", robot, wires, draws, seed, experiment, tensions, times))
    if run.state == "done":
        return
    write_csv(run.directory / "creep-table.csv", files.TABLE, files.creep_table(machine, line, loads, moments))
    if files.is_hangprinter(machine):
        write_text(run.directory / "reprapfirmware.g", files.reprapfirmware(machine, line))
        write_text(run.directory / "klipper.cfg", files.klipper(machine, line))
    else:
        typer.echo("no firmware settings: they exist for four or five drums with a position-only platform", err=True)
    x, R = machine.home_m[None], matrix(machine.home_rotation_rad)[None]
    told = inverse.commands(machine, for_robot(machine, line.centre()), x, R, inverse.tensions(machine, x, R))
    if told.feasible.all() and line.law == "hooke":
        k1 = np.broadcast_to(for_robot(machine, line.centre()).theta["k1"][:, 0], machine.legs)
        write_text(run.directory / "robot.xml", mjcf(machine, k1, told.zero_m[0], told.offset_m[0]))
    run.finish()


def read_wires(folder: Path, count: int, experiment: str | None = None) -> "WireDraws":
    """Draws of a fitted line as the robot takes them, evenly thinned; an `InputError` names what is wrong."""
    from wirebayes.bayes.result import load

    return wire_draws(load(folder, experiment), count)


def wire_draws(stored: "Stored", count: int) -> "WireDraws":
    """Material parameters of a stored posterior with what was tested; bench quantities stay behind."""
    import numpy as np

    from wirebayes.robot.draws import CORE, PLACES, WireDraws

    sample = stored.sample
    effects = tuple(sample.model.effects)
    names = [*CORE, *(c for e in effects if e.scope == "material" and e.place in PLACES for c in e.columns())]
    pick = np.unique(np.linspace(0, len(stored.draws["k1"]) - 1, count).round().astype(int))
    protocol, readings = sample.protocol, sample.readings[..., 0][sample.protocol.mask]
    return WireDraws(
        {name: stored.draws[name][pick] for name in names},
        protocol.length_mm,
        sample.model.law,
        sample.model.history,
        effects,
        (float(readings.min()), float(readings.max())),
        (0.0, float(protocol.duration_s.max())),
        sample.model.tension_ref_N,
    )


def _numbers(option: str, text: str, count: int | None = None) -> Any:
    import numpy as np

    from wirebayes.errors import InputError

    try:
        values = np.array([float(word) for word in text.split(",")])
    except ValueError:
        values = np.array([np.nan])
    if not np.isfinite(values).all() or (count is not None and len(values) != count):
        raise InputError(f"{option}: found {text!r}; expected {count or 'some'} finite numbers separated by commas")
    return values


def _times(text: str) -> Any:
    import numpy as np

    from wirebayes.errors import InputError

    values = _numbers("--times", text)
    if values[0] < 0 or np.any(np.diff(values) <= 0):
        raise InputError(f"--times: found {text!r}; expected rising times from 0 on")
    return values


def _configuration(command: str, robot: str, wires: Path, draws: int, seed: int, *rest: Any) -> dict[str, Any]:
    """Everything that decides the results; files by their content, not by where they lie."""
    from wirebayes import __version__

    return {
        "command": command,
        "version": __version__,
        "robot": _content(Path(robot)),
        "wires": _content(wires / "posterior.nc"),
        "draws": draws,
        "seed": seed,
        "options": list(rest),
    }


def _content(path: Path) -> str:
    from hashlib import sha256

    return sha256(path.read_bytes()).hexdigest() if path.is_file() else str(path)

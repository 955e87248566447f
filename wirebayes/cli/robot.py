"""The robot's commands: `pose`, `calibrate` and `export`."""

import math
from pathlib import Path
from typing import Annotated, Any

import typer

from wirebayes.cli.options import ExperimentName, Output, OwnEffects, Seed
from wirebayes.cli.wires import numbers, read_wires, rising_times

RobotFile = Annotated[str, typer.Argument(metavar="ROBOT.toml", help="A robot's file, or the name of a shipped robot.")]
Wires = Annotated[Path, typer.Option("--wires", metavar="FOLDER", help="A folder with a posterior.nc.")]
Draws = Annotated[int, typer.Option("--draws", min=1, help="Posterior draws used, evenly thinned.")]


Spread = Annotated[float, typer.Option("--specimen-spread", help="Relative difference between wires of one line.")]
POSTERIOR = "posterior.nc"


def pose(
    robot: RobotFile,
    wires: Wires,
    output: Output,
    position: Annotated[str | None, typer.Option(metavar="X,Y,Z", help="Pose in metres; default: the file's.")] = None,
    rotation: Annotated[str | None, typer.Option(metavar="X,Y,Z", help="Rotation vector in radians.")] = None,
    times: Annotated[str, typer.Option(metavar="T,T,…", help="Times in seconds.")] = "0,10,30,60,120,300,600,1800,3600",
    tolerance: Annotated[float, typer.Option("--tolerance", metavar="MM", help="Allowed pose error.")] = 0.3,
    tolerance_tilt: Annotated[float, typer.Option("--tolerance-tilt", metavar="DEG", help="Allowed rotation.")] = 0.055,
    spread: Spread = 0.05,
    told: Annotated[
        Path | None,
        typer.Option("--told", metavar="FOLDER", help="Another fit of the wire, used by one more controller."),
    ] = None,
    draws: Draws = 1000,
    experiment: ExperimentName = None,
    own_effects: OwnEffects = None,
    seed: Seed = 0,
) -> None:
    """Kinematics on creeping wires; drift and pose error with uncertainty bands.

    Give the final fit of discover as --wires and its plain one as --told to see what the effects are worth.
    """
    from wirebayes.robot.mechanics import schema

    machine = schema.read(robot)
    line = read_wires(wires, draws, experiment, own_effects)
    where = machine.home_m if position is None else numbers("--position", position, 3)
    turn = machine.home_rotation_rad if rotation is None else numbers("--rotation", rotation, 3)
    moments = rising_times(times)
    _above_zero(("--tolerance", tolerance), ("--tolerance-tilt", tolerance_tilt), ("--specimen-spread", spread))
    other = read_wires(told, draws, experiment, own_effects) if told else None

    from wirebayes.io.run_folder import open_run, write_json
    from wirebayes.report.pictures import robot as pictures
    from wirebayes.robot.mechanics.rotation import matrix
    from wirebayes.robot.pose.answer import answer
    from wirebayes.robot.pose.request import Question

    asked = Question(where, matrix(turn), moments, 1e-3 * tolerance, math.radians(tolerance_tilt), spread, seed)
    limits = (tolerance, tolerance_tilt, spread)
    options = (experiment, position, rotation, times, *limits, told and _content(told / POSTERIOR))
    run = open_run(output, _configuration("pose", robot, wires, draws, seed, own_effects, *options))
    if run.state == "done":
        return
    found = answer(machine, line, asked, other)
    write_json(run.directory / "pose.json", found.content)
    pictures.save_pose(run.directory, machine, asked, found)
    run.finish()
    if "sentence" in found.content:
        typer.echo(found.content["sentence"], err=True)
    for warning in found.content.get("warnings", []):
        typer.echo(f"warning: {warning}", err=True)


def calibrate(
    robot: RobotFile,
    readings: Annotated[Path, typer.Argument(metavar="READINGS.csv", help="Poses, joints and tensions, in order.")],
    wires: Wires,
    output: Output,
    tension_sd: Annotated[
        float, typer.Option("--tension-sd", metavar="N", help="Standard error of a tension, in newtons.")
    ] = 0.02,
    tilt_sd: Annotated[
        float, typer.Option("--tilt-sd", metavar="RAD", help="Standard error of the platform's normal.")
    ] = 1e-3,
    reference_sd: Annotated[
        float, typer.Option("--reference-sd", metavar="MM", help="Standard error of the reference lengths.")
    ] = 5.0,
    spread: Spread = 0.05,
    draws: Draws = 1000,
    experiment: ExperimentName = None,
    own_effects: OwnEffects = None,
    seed: Seed = 0,
) -> None:
    """Estimate every wire's current zero-tension length from joint values and tensions, without external sensors."""
    import numpy as np

    from wirebayes.errors import InputError
    from wirebayes.io.run_folder import open_run, read_json, stored_results, write_json
    from wirebayes.robot.mechanics import schema
    from wirebayes.robot.self_calibration import session_file
    from wirebayes.robot.self_calibration.answer import answer
    from wirebayes.robot.self_calibration.session import Prior

    _above_zero(("--tension-sd", tension_sd), ("--tilt-sd", tilt_sd), ("--reference-sd", reference_sd))
    if not 0 <= spread < 1:
        raise InputError(f"--specimen-spread: found {spread:g}; expected a number from 0 to 1")
    machine = schema.read(robot)
    session, values = session_file.read(readings, machine, tension_sd, tilt_sd)
    line = read_wires(wires, draws, experiment, own_effects)
    options = (experiment, tension_sd, tilt_sd, reference_sd, spread, _content(readings))
    run = open_run(output, _configuration("calibrate", robot, wires, draws, seed, own_effects, *options))
    file = run.directory / "calibrate.json"
    if run.state != "done":
        prior = Prior(line, 1e-3 * reference_sd, spread)
        with np.errstate(all="ignore"):  # what cannot be computed is not converged, and said so below
            found = answer(machine, prior, session, values, seed)
        write_json(file, found)
        run.finish()
    models = {"with_creep_model": "the creep model", "by_hooke_alone": "Hooke's law alone"}
    with stored_results(file):
        found = read_json(file)
        astray = [words for key, words in models.items() if not found[key]["converged"]]
    if astray:
        advice = "read more poses, or check the readings, --tension-sd and --reference-sd"
        typer.echo(f"not converged with {' and '.join(astray)}: do not use these lengths; {advice}", err=True)


def export(
    robot: RobotFile,
    wires: Wires,
    output: Output,
    tensions: Annotated[str, typer.Option(metavar="N,N,…", help="Tensions of the creep table.")] = "1,2,4,8",
    times: Annotated[str, typer.Option(metavar="T,T,…", help="Times of the creep table, s.")] = "60,600,3600,86400",
    draws: Draws = 1000,
    experiment: ExperimentName = None,
    own_effects: OwnEffects = None,
    seed: Seed = 0,
) -> None:
    """Spring constants and creep in firmware units (Hangprinter), and the robot as a MuJoCo model."""
    from wirebayes.errors import InputError
    from wirebayes.io.run_folder import open_run, write_csv, write_text
    from wirebayes.robot.export import files
    from wirebayes.robot.mechanics import schema

    machine = schema.read(robot)
    loads, moments = numbers("--tensions", tensions), rising_times(times)
    if loads.min() <= 0:
        raise InputError(f"--tensions: found {tensions!r}; expected numbers above 0")
    line = read_wires(wires, draws, experiment, own_effects)
    contents: dict[str, str] = {}
    if files.is_hangprinter(machine):
        contents["reprapfirmware.g"] = files.reprapfirmware(machine, line)
        contents["klipper.cfg"] = files.klipper(machine, line)
    model = files.mujoco(machine, line)
    if model is not None:
        contents["robot.xml"] = model
    table = files.creep_table(machine, line, loads, moments)
    run = open_run(
        output, _configuration("export", robot, wires, draws, seed, own_effects, experiment, tensions, times)
    )
    if run.state == "done":
        return
    write_csv(run.directory / "creep-table.csv", files.TABLE, table)
    for name, text in contents.items():
        write_text(run.directory / name, text)
    if not files.is_hangprinter(machine):
        typer.echo("no firmware settings: they exist for four or five drums with a position-only platform", err=True)
    if model is None:
        typer.echo("no robot.xml: no tensions within the bounds hold the platform at its home pose", err=True)
    run.finish()


def _above_zero(*options: tuple[str, float]) -> None:
    from wirebayes.errors import InputError

    for name, value in options:
        if not 0 < value < float("inf"):
            raise InputError(f"{name}: found {value:g}; expected a finite number above 0")


def _configuration(
    command: str, robot: str, wires: Path, draws: int, seed: int, own_effects: Path | None, *rest: Any
) -> dict[str, Any]:
    """Everything that decides the results; files by their content, not by where they lie."""
    from wirebayes import __version__
    from wirebayes.effects import source_of

    return {
        "command": command,
        "version": __version__,
        "robot": _content(Path(robot)),
        "wires": _content(wires / POSTERIOR),
        "own_effects": source_of(own_effects),
        "draws": draws,
        "seed": seed,
        "options": list(rest),
    }


def _content(path: Path) -> str:
    from hashlib import sha256

    return sha256(path.read_bytes()).hexdigest() if path.is_file() else str(path)

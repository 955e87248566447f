"""The robot's commands: `pose`, `calibrate` and `export`."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from wirebayes.cli.options import Output, Seed

if TYPE_CHECKING:
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
    seed: Seed = 0,
) -> None:
    """Kinematics with creeping wires, drift and pose error with bands."""
    from wirebayes.robot import schema

    machine = schema.read(robot)
    line = read_wires(wires, draws)
    where = machine.home_m if position is None else _numbers("--position", position, 3)
    turn = machine.home_rotation_rad if rotation is None else _numbers("--rotation", rotation, 3)
    moments = _times(times)

    from wirebayes.output import open_run, write_json
    from wirebayes.report import robot as pictures
    from wirebayes.robot.answer import Question, answer
    from wirebayes.robot.rotation import matrix

    asked = Question(where, matrix(turn), moments, seed=seed)
    run = open_run(output, _configuration("pose", robot, wires, draws, seed, position, rotation, times))
    if run.state == "done":
        return
    content, courses = answer(machine, line, asked)
    write_json(run.directory / "pose.json", content)
    pictures.save_pose(run.directory, machine, asked, content, courses)
    run.finish()
    for warning in content.get("warnings", []):
        typer.echo(f"warning: {warning}", err=True)


def read_wires(folder: Path, count: int) -> "WireDraws":
    """Draws of a fitted line, evenly thinned; an `InputError` names what the folder lacks."""
    import numpy as np
    import xarray

    from wirebayes.effects import named
    from wirebayes.errors import InputError
    from wirebayes.robot.draws import CORE, PLACES, WireDraws

    file = folder / "posterior.nc"
    if not file.is_file():
        raise InputError(f"{folder}: no posterior.nc in it; expected a folder written by fit or discover")
    try:
        data = xarray.open_dataset(file, group="posterior", engine="h5netcdf").load()
    except (OSError, KeyError, ValueError) as error:
        raise InputError(f"{file}: cannot be read as a posterior ({type(error).__name__})") from None
    missing = [name for name in CORE if name not in data]
    if missing:
        raise InputError(f"{file}: posterior: missing {', '.join(missing)}; expected {', '.join(CORE)}")
    if "length_mm" not in data.attrs:
        raise InputError(f"{file}: posterior: attribute length_mm missing; expected the tested length")
    effects = tuple(named(str(key)) for key in np.atleast_1d(data.attrs.get("effects", [])) if str(key))
    names = [*CORE, *(c for e in effects if e.scope == "material" and e.place in PLACES for c in e.columns())]
    columns = {name: np.asarray(data[name].transpose("chain", "draw"), float).ravel() for name in names}
    if not all(np.isfinite(v).all() for v in columns.values()):
        raise InputError(f"{file}: posterior: not all draws are finite")
    pick = np.unique(np.linspace(0, len(columns["k1"]) - 1, count).round().astype(int))
    attrs = data.attrs
    return WireDraws(
        {name: value[pick] for name, value in columns.items()},
        float(attrs["length_mm"]),
        attrs.get("elastic_law", "hooke"),
        attrs.get("history", "saturating"),
        effects,
        _pair(attrs.get("tension_range_N")),
        _pair(attrs.get("time_range_s")),
        float(attrs.get("tension_ref_N", 1.0)),
    )


def _pair(value: Any) -> tuple[float, float] | None:
    return None if value is None else (float(value[0]), float(value[1]))


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
    from hashlib import sha256

    from wirebayes import __version__

    def content(path: Path) -> str:
        return sha256(path.read_bytes()).hexdigest() if path.is_file() else str(path)

    return {
        "command": command,
        "version": __version__,
        "robot": content(Path(robot)),
        "wires": content(wires / "posterior.nc"),
        "draws": draws,
        "seed": seed,
        "options": list(rest),
    }

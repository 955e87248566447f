"""A robot with its wires for other programs."""

from collections.abc import Mapping

import numpy as np

from wirebayes.commands.options import Numbers, check_seed, numbers, path_of, rising_times, text_of
from wirebayes.commands.wires import RobotLike, Wires, configuration, content_of, draws_for, robot_of
from wirebayes.errors import InputError
from wirebayes.io.run_folder import open_run, write_csv, write_json, write_text
from wirebayes.json_files.export import ExportSummary
from wirebayes.numeric.typing import Floats
from wirebayes.result_warnings import Notice, to_json
from wirebayes.robot.export import files
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.draws import WireDraws
from wirebayes.robot.mechanics.wire_doubts import wire_warnings
from wirebayes.robot.motion.home import home_notices
from wirebayes.robot.motion.plausible import robot_notices
from wirebayes.strict.files import PathLike
from wirebayes.views.export import Export
from wirebayes.views.result import ResultFolder

TABLE = "creep-table.csv"
TENSIONS_N = (1.0, 2.0, 4.0, 8.0)  # an option; doubling, because creep goes as a power of the tension
# an option; a minute to a day, because creep goes as a power of the time at first
TIMES_S = (60.0, 600.0, 3600.0, 86400.0)


def export(
    robot: RobotLike,
    wires: Wires | None = None,
    *,
    tensions: Numbers = TENSIONS_N,
    times: Numbers = TIMES_S,
    draws: int = 1000,
    experiment: str | None = None,
    own_effects: PathLike | None = None,
    seed: int = 0,
    output: PathLike | None = None,
) -> Export:
    """Spring constants and creep in firmware units (Hangprinter), and the robot as a MuJoCo model.

    Parameters
    ----------
    robot : Robot, name of a shipped robot, or path
    wires : Posterior, Findings, or path of a folder with a ``posterior.nc``; or a mapping of wire name to one of them
        May be left out where the robot's file gives the parameters of all wires.
    tensions : sequence of float
        Tensions of the creep table, N.
    times : sequence of float
        Rising times of the creep table, s.
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
    Export
        ``files`` holds the content of each file by name.

    Raises
    ------
    InputError
        Something that was given is wrong, or the line cannot carry the robot.

    Examples
    --------
    >>> exported = wb.export("hangprinter-4", posterior, draws=100)
    >>> sorted(exported.files)
    ['creep-table.csv', 'klipper.cfg', 'reprapfirmware.g', 'robot.sdf', 'robot.urdf', 'robot.xml']
    """
    own = path_of(own_effects)
    seed = check_seed(seed)
    machine = robot_of(robot)
    loads = numbers("--tensions", tensions)
    moments = rising_times(times)
    if loads.min() <= 0:
        raise InputError(f"--tensions: found {text_of(tensions)!r}, expected numbers above 0")
    line = draws_for(machine, wires, draws, experiment, own)
    contents = _contents(machine, line)
    header, table = files.creep_tables(machine, line, loads, moments)
    warnings = [*_of_table(machine, line, loads, moments), *_warnings(machine, contents)]
    summary: ExportSummary = {
        "files": sorted([*contents, TABLE]),
        "creep_table": [dict(zip(header, row, strict=True)) for row in table],
        "warnings": to_json(warnings),
    }
    place = ResultFolder.at(output)
    options = {"--experiment": experiment, "--tensions": text_of(tensions), "--times": text_of(times)}
    content = content_of(wires, experiment)
    decides = configuration("export", robot, content, draws, seed, own, options)
    with open_run(place.path, decides) as run:
        if run.state != "done":
            folder = run.directory
            write_csv(folder / TABLE, header, table)
            for name, text in contents.items():
                write_text(folder / name, text)
            write_json(folder / Export._content, summary)
            run.finish()
    return Export(place, own, computed=run.state != "done")


def _contents(robot: Robot, line: WireDraws) -> dict[str, str]:
    """The content of each file for firmware and simulators, by its name."""
    contents: dict[str, str] = {}
    if files.is_hangprinter(robot):
        contents["reprapfirmware.g"] = files.reprapfirmware(robot, line)
        contents["klipper.cfg"] = files.klipper(robot, line)
    return contents | files.simulators(robot, line)


def _of_table(robot: Robot, line: WireDraws, loads_N: Floats, times_s: Floats) -> list[Notice]:
    """What speaks against the fits, and where the creep table leaves what was tested."""
    per_leg = np.broadcast_to(loads_N[:, None], (len(loads_N), robot.legs))
    any_length = np.full((1, robot.legs), np.nan)  # the table is of a metre of wire
    return wire_warnings(robot, line, per_leg, float(times_s[-1]), any_length)


def _warnings(robot: Robot, contents: Mapping[str, str]) -> list[Notice]:
    """What speaks against the robot's file, and what could not be exported."""
    out = [*robot_notices(robot), *home_notices(robot)]
    if "klipper.cfg" not in contents:
        text = "no firmware settings: they exist for four or five drums with a position-only platform"
        out.append(Notice("left-out", text))
    if "robot.xml" not in contents:
        out.append(Notice("left-out", "no robot.xml, robot.urdf and robot.sdf, which would start at the home pose"))
    return out

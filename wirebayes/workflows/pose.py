"""A pose of a robot on creeping wires."""

import math

from wirebayes.io.run_folder import open_run, write_json
from wirebayes.robot.mechanics.rotation import matrix
from wirebayes.robot.pose.answer import answer
from wirebayes.robot.pose.request import PoseRequest
from wirebayes.workflows.options import (
    Numbers,
    PathLike,
    above_zero,
    check_seed,
    numbers,
    path_of,
    rising_times,
    text_of,
)
from wirebayes.workflows.results import POSTERIOR, Place, Pose
from wirebayes.workflows.wires import RobotLike, Wires, configuration, content, draws_of, folder_of, robot_of

# an option; closest in the minute that the paper speaks of, and on to an hour
TIMES_S = (0.0, 10.0, 30.0, 60.0, 120.0, 300.0, 600.0, 1800.0, 3600.0)


def pose(
    robot: RobotLike,
    wires: Wires,
    *,
    position: Numbers | None = None,
    rotation: Numbers | None = None,
    times: Numbers = TIMES_S,
    tolerance: float = 0.3,
    tolerance_tilt: float = 0.055,
    specimen_spread: float = 0.05,
    other_fit: Wires | None = None,
    draws: int = 1000,
    experiment: str | None = None,
    own_effects: PathLike | None = None,
    seed: int = 0,
    output: PathLike | None = None,
) -> Pose:
    """Kinematics of a robot on creeping wires; drift and pose error with uncertainty bands.

    Parameters
    ----------
    robot : Robot, name of a shipped robot, or path
    wires : Posterior, Findings, or path of a folder with a ``posterior.nc``
        The line that the wires are cut from; of findings the final model.
    position : (3,) array, optional
        Of the platform in m; the robot's home pose when left out.
    rotation : (3,) array, optional
        Rotation vector in rad; of the home pose when left out.
    times : sequence of float
        Rising times after the command, s.
    tolerance : float
        Allowed pose error, mm.
    tolerance_tilt : float
        Allowed rotation, degrees.
    specimen_spread : float
        Relative difference between wires of one line.
    other_fit : Posterior or path, optional
        Another fit of the line, which one more controller uses.
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
    Pose
        Its `summary` is the content of ``pose.json``.

    Raises
    ------
    InputError
        Something that was given is wrong.

    Examples
    --------
    >>> held = wb.pose("linear-7", posterior, times=[0, 60], draws=40, output="out/pose")
    >>> held.summary()["drift"][0]["times_s"]
    [0.0, 60.0]
    """
    own, seed = path_of(own_effects), check_seed(seed)
    machine = robot_of(robot)
    line = draws_of(wires, draws, experiment, own)
    where = machine.home_m if position is None else numbers("--position", position, 3)
    turn = machine.home_rotation_rad if rotation is None else numbers("--rotation", rotation, 3)
    moments = rising_times(times)
    tolerance, tolerance_tilt, specimen_spread = float(tolerance), float(tolerance_tilt), float(specimen_spread)
    above_zero(("--tolerance", tolerance), ("--tolerance-tilt", tolerance_tilt), ("--specimen-spread", specimen_spread))
    other = None if other_fit is None else draws_of(other_fit, draws, experiment, own)
    asked = PoseRequest(
        where, matrix(turn), moments, 1e-3 * tolerance, math.radians(tolerance_tilt), specimen_spread, seed
    )
    limits = (tolerance, tolerance_tilt, specimen_spread)
    at = (None if values is None else text_of(values) for values in (position, rotation))
    other_draws = None if other_fit is None else content(folder_of(other_fit, experiment) / POSTERIOR)
    options = (experiment, *at, text_of(times), *limits, other_draws)
    place = Place.at(output)
    decides = configuration("pose", robot, folder_of(wires, experiment) / POSTERIOR, draws, seed, own, *options)
    run = open_run(place.path, decides)
    if run.state == "done":
        return Pose(place, own, computed=False)
    found = answer(machine, line, asked, other)
    write_json(run.directory / "pose.json", found.content)
    from wirebayes.report.pictures import robot as pictures  # matplotlib only where it is needed

    pictures.save_pose(run.directory, machine, asked, found)
    run.finish()
    return Pose(place, own)

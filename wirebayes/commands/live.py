"""The pose of a robot while it runs."""

from wirebayes.commands.options import Numbers, check_seed, check_spread, check_whole, numbers, path_of
from wirebayes.commands.pose_history import calibrated_errors, checked_errors
from wirebayes.commands.wires import RobotLike, Wires, draws_for, robot_of
from wirebayes.robot.history.live import LiveEstimator
from wirebayes.robot.mechanics.rotation import matrix
from wirebayes.strict.files import PathLike
from wirebayes.views.calibration import Calibration


def live(
    robot: RobotLike,
    wires: Wires | None = None,
    *,
    position: Numbers | None = None,
    rotation: Numbers | None = None,
    reads: bool = False,
    tension_sd: float = 0.02,
    tilt_sd: float = 1e-3,
    reference_sd: float = 0.0,
    specimen_spread: float = 0.05,
    calibration: PathLike | Calibration | None = None,
    draws: int = 64,
    experiment: str | None = None,
    own_effects: PathLike | None = None,
    seed: int = 0,
) -> LiveEstimator:
    """Make an estimator that is fed with joint values while a robot runs, and says where its platform is.

    Parameters
    ----------
    robot : Robot, name of a shipped robot, or path
    wires : Posterior, Findings, or path of a folder with a ``posterior.nc``; or a mapping of wire name to one of them
        May be left out where the robot's file gives the parameters of all wires.
    position, rotation : (3,) arrays, optional
        About where the platform is at the first step, m, and its rotation vector, rad; the home pose when left out.
    reads : bool
        Whether tensions, or roll and pitch, will be given too.
    tension_sd, tilt_sd : float
        Their standard errors, N and rad.
    reference_sd : float
        Standard error of the lengths that joint values stand for, mm.
    specimen_spread : float
        Relative difference between wires of one line.
    calibration : Calibration or path of its folder, optional
        What `calibrate` found for this robot; the first step goes on where its session ended.
    draws : int
        Posterior draws carried along, evenly thinned.
    experiment : str, optional
        Which one, where several were fitted.
    own_effects : path, optional
        A Python file with effects of your own, where the fit used one and is read from a folder.
    seed : int

    Returns
    -------
    LiveEstimator

    Raises
    ------
    InputError
        Something that was given is wrong.

    Examples
    --------
    >>> running = wb.live("linear-7", posterior, draws=16)
    >>> now = running.step(0.0, held.summary()["inverse"]["joint_value_m"]["q50"])
    >>> now.correction_m.shape
    (7,)
    """
    machine = robot_of(robot)
    where = machine.home_m if position is None else numbers("position", position, 3)
    turn = machine.home_rotation_rad if rotation is None else numbers("rotation", rotation, 3)
    errors = checked_errors(reference_sd, check_spread(specimen_spread), tension_sd, tilt_sd)
    draws = check_whole("draws", draws, 1)
    line = draws_for(machine, wires, draws, experiment, path_of(own_effects))
    errors = calibrated_errors(errors, calibration, machine, line, wires, experiment)
    if errors.calibrated is not None:
        line = errors.calibrated.prior.line
    return LiveEstimator(machine, line, errors, (where, matrix(turn)), reads, check_seed(seed))

"""What both calibrations, of lengths and of a whole robot, report in the same words."""

import numpy as np

from wirebayes.json_files.calibrate import CalibratedPoses, CalibrationPrior, EstimatedLengths
from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics import drums
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.winches import of_each_winch
from wirebayes.robot.self_calibration.session import LengthPrior, Session
from wirebayes.robot.self_calibration.summary import Moment
from wirebayes.robot.self_calibration.trust import interval_about


def with_biases(given: CalibrationPrior, prior: LengthPrior, session: Session) -> CalibrationPrior:
    """What was known before, with the biases of tension sensors where they may have some.

    Parameters
    ----------
    given : dict
        The rest of what was known.
    prior : LengthPrior
    session : Session
    """
    if prior.bias_sd_N > 0:
        given["tension_bias_sd_N"] = prior.bias_sd_N
        given["tension_bias_sign"] = "constant" if session.motion is None else "motion"
    return given


def estimated_lengths(
    *,
    converged: bool,
    misfit: float,
    p_joint: float,
    length_m: Moment,
    creep: Floats,
    reference_m: Moment,
    bias_N: Moment | None,
) -> EstimatedLengths:
    """What one model of the wires makes of the readings.

    Parameters
    ----------
    converged, misfit, p_joint
        How well it describes them.
    length_m, reference_m : Moment
        Of each wire.
    creep : (w,) array
        Strain.
    bias_N : Moment, optional
        Of tension sensors, where they may have one.
    """
    found: EstimatedLengths = {
        "converged": converged,
        "misfit": misfit,
        "p_joint": p_joint,
        "length_m": interval_about(*length_m),
        "creep_strain": creep,
        "reference_error_mm": {"mean": 1e3 * reference_m.mean, "sd": 1e3 * reference_m.sd},
    }
    if bias_N is not None:
        found["tension_bias_N"] = {"mean": bias_N.mean, "sd": bias_N.sd}
    return found


def pose_and_home(robot: Robot, position_m: Floats, turn_rad: Floats, joint_m: Floats) -> CalibratedPoses:
    """Where the robot is, and the joint values of its home.

    Parameters
    ----------
    robot : Robot
    position_m, turn_rad : (3,) arrays
    joint_m : (w,) array
        Of each leg; NaN where the home pose is not held, or nobody should send the robot there.
    """
    held = bool(np.isfinite(joint_m).all())
    found: CalibratedPoses = {
        "pose_now": {"position_m": position_m, "rotation_vector_rad": turn_rad},
        "joint_values_for_home_m": of_each_winch(robot, joint_m) if held else None,
    }
    if robot.drums is not None and held:
        found["motor_angles_for_home_rad"] = of_each_winch(robot, drums.motor_angle(robot.drums, joint_m))
    return found

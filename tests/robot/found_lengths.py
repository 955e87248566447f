"""What a session says of a robot's lengths where all else is exact, and its poses are requests."""

from dataclasses import replace

import numpy as np

from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.self_calibration.answer import holds_of
from wirebayes.robot.self_calibration.posterior import RobotPosterior
from wirebayes.robot.self_calibration.seeds import best, near_requests
from wirebayes.robot.self_calibration.session import LengthPrior, Session
from wirebayes.robot.self_calibration.unknowns import StatedErrors, Unknowns


def found_lengths(robot: Robot, prior: LengthPrior, session: Session, readings: np.ndarray) -> RobotPosterior:
    """The posterior for readings ``(r,)``, standardised."""
    unknowns = Unknowns(robot, prior, StatedErrors(joint_m=0.0))
    sent = holds_of(robot, session, readings)
    holds = replace(sent, session=session.without_poses())
    with np.errstate(all="ignore"):  # as the command has it
        return best(unknowns, holds, np.random.default_rng(0), about=near_requests(unknowns, sent))

"""Whether gravity that leans in the robot's frame would explain what a calibration's readings contradict.

A robot whose frame leans is the same robot turned, and its stated poses with it: gravity stays down. An inclinometer
reads against gravity, and is not turned.
"""

from dataclasses import dataclass, replace

import numpy as np

from wirebayes.numeric.batches import batch_last
from wirebayes.numeric.typing import Floats
from wirebayes.progress import ShareDone
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import GRAVITY, Robot
from wirebayes.robot.mechanics.rotation import matrix, tilt, vector
from wirebayes.robot.self_calibration.equations import Holds, State, by_carried
from wirebayes.robot.self_calibration.one_cause import explained_by
from wirebayes.robot.self_calibration.posterior import RobotPosterior
from wirebayes.robot.self_calibration.unknowns import Unknowns
from wirebayes.sentences import short


@dataclass(frozen=True)
class LeaningFrame:
    """A lean that would explain what contradicts.

    Attributes
    ----------
    gravity : (3,) array
        Unit vector in the frame of the robot's file.
    angle_rad, sd_rad : float
        Between gravity and that frame's vertical.
    evidence : float
        Log density of the readings with it.
    """

    gravity: Floats
    angle_rad: float
    sd_rad: float
    evidence: float

    def in_words(self) -> str:
        """What to do about it."""
        angle, sd = np.degrees([self.angle_rad, self.sd_rad])
        gravity = ", ".join(short(part, 3) for part in self.gravity)
        return (
            f"a frame that leans by {short(angle, 3)} +- {short(sd, 2)} degrees would explain what contradicts, and "
            f"gravity points along ({gravity}) in its coordinates: level the frame, or turn the points of the robot's "
            "file until z is up; do not use these values"
        )


def leaning_frame(found: RobotPosterior, holds: Holds, progress: ShareDone = lambda share: None) -> LeaningFrame | None:
    """The lean with which readings and model do belong together; None where there is none.

    Parameters
    ----------
    found : RobotPosterior
    holds : Holds
    progress : function of a share between 0 and 1
    """
    explained = explained_by(Lean(), found, holds, progress)
    if explained is None:
        return None
    turn = _home(explained.found.unknowns.robot) @ _home(found.unknowns.robot).T
    angle = float(tilt(turn))
    axis = vector(turn)[:2] / np.linalg.norm(vector(turn)[:2])
    sd = float(axis @ explained.covariance @ axis) ** 0.5
    return LeaningFrame(-turn[2], angle, sd, explained.found.evidence)


class Lean:
    """A turn of the robot about the world's x and y axes, rad."""

    usual = 0.1  # of a frame, a table or a ceiling

    def slopes(self, found: RobotPosterior) -> Floats:
        robot = found.unknowns.robot
        rotation = batch_last(found.state.rotation)
        # gravity turns the other way in the robot's own axes
        sideways = robot.mass_kg * GRAVITY * np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])
        wrench = [statics.at_centre_of_mass(robot, rotation, force_N) for force_N in sideways]
        return by_carried(found.equations, robot, found.noise, np.stack(wrench))

    def changed(self, found: RobotPosterior, holds: Holds, by: Floats) -> tuple[Unknowns, Holds, State]:
        """What is fitted with another value, and from where: `one_cause.Cause.changed`.

        Parameters
        ----------
        found : RobotPosterior
        holds : Holds
        by : (2,) array
            Turn about x and y, rad.
        """
        turn = matrix(np.append(by, 0.0))
        unknowns = found.unknowns
        session = holds.session
        there = replace(session, position_m=session.position_m @ turn.T, rotation=turn @ session.rotation)
        state = found.state
        led = replace(
            state,
            white=_turned_white(unknowns, state.white, turn),
            position_m=state.position_m @ turn.T,
            rotation=turn @ state.rotation,
        )
        return replace(unknowns, robot=_turned_robot(unknowns.robot, turn)), replace(holds, session=there), led


def _turned_white(unknowns: Unknowns, white: Floats, turn: Floats) -> Floats:
    """The robot's unknowns with the errors of the exit points turned, whose prior is the same in all directions."""
    out = white.copy()
    part = unknowns.slices["exit"]
    out[part] = (white[part].reshape(-1, 3) @ turn.T).ravel()
    return out


def _turned_robot(robot: Robot, turn: Floats) -> Robot:
    """The robot with all that stands in the world turned about its origin."""
    pulleys = robot.pulleys and replace(robot.pulleys, axis=robot.pulleys.axis @ turn.T)
    plane = robot.plane and replace(robot.plane, normal=turn @ robot.plane.normal)
    changed = replace(
        robot,
        exit_m=robot.exit_m @ turn.T,
        home_m=turn @ robot.home_m,
        home_rotation_rad=vector(turn @ _home(robot)),
        pulleys=pulleys,
        plane=plane,
    )
    changed.__dict__.update(span_m=robot.span_m)  # a measure of length that does not turn
    return changed


def _home(robot: Robot) -> Floats:
    return matrix(robot.home_rotation_rad)

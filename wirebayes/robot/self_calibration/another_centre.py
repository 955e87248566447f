"""Whether another centre of mass of the platform would explain what a calibration's readings contradict."""

from dataclasses import dataclass, replace

import numpy as np

from wirebayes.numeric.batches import batch_last
from wirebayes.numeric.typing import Floats
from wirebayes.progress import ShareDone
from wirebayes.robot.mechanics import statics
from wirebayes.robot.self_calibration.equations import Holds, State, by_carried
from wirebayes.robot.self_calibration.one_cause import explained_by
from wirebayes.robot.self_calibration.posterior import RobotPosterior
from wirebayes.robot.self_calibration.unknowns import Unknowns
from wirebayes.sentences import short


@dataclass(frozen=True)
class OtherCentre:
    """A centre of mass that would explain what contradicts.

    Attributes
    ----------
    centre_m, sd_m : (3,) arrays
        In the platform's frame, from the reference point.
    stated_m : (3,) array
        As the robot's file says.
    evidence : float
        Log density of the readings with it.
    """

    centre_m: Floats
    sd_m: Floats
    stated_m: Floats
    evidence: float

    def in_words(self) -> str:
        """What to do about it."""
        pairs = zip(1e3 * self.centre_m, 1e3 * self.sd_m, strict=True)
        found = [f"{short(at, 3)} +- {short(sd, 2)}" for at, sd in pairs]
        stated = [short(1e3 * at, 3) for at in self.stated_m]
        return (
            f"a centre of mass at ({', '.join(found)}) mm would explain what contradicts, the robot's file says "
            f"({', '.join(stated)}) mm: balance the platform with all that it carries, and look for what pulls at it "
            "beside the wires; do not use these values"
        )


def other_centre(found: RobotPosterior, holds: Holds, progress: ShareDone = lambda share: None) -> OtherCentre | None:
    """The centre of mass with which readings and model do belong together; None where there is none.

    Parameters
    ----------
    found : RobotPosterior
        A point's centre of mass is the point.
    holds : Holds
    progress : function of a share between 0 and 1
    """
    robot = found.unknowns.robot
    if robot.degrees == 3:
        return None
    cause = Centre(robot.size_m)
    explained = explained_by(cause, found, holds, progress)
    if explained is None:
        return None
    centre = explained.found.unknowns.robot.centre_of_mass_m
    sd = np.sqrt(np.diag(explained.covariance))
    return OtherCentre(centre, sd, robot.centre_of_mass_m, explained.found.evidence)


@dataclass(frozen=True)
class Centre:
    """The centre of mass, m; no heavy part of a platform is much farther out than its points."""

    usual: float

    def slopes(self, found: RobotPosterior) -> Floats:
        robot = found.unknowns.robot
        rotation = batch_last(found.state.rotation)
        here = statics.weight(replace(robot, centre_of_mass_m=np.zeros(3)), rotation)
        there = [statics.weight(replace(robot, centre_of_mass_m=axis), rotation) for axis in np.eye(3)]
        return by_carried(found.equations, robot, found.noise, np.stack(there) - here)

    def changed(self, found: RobotPosterior, holds: Holds, by: Floats) -> tuple[Unknowns, Holds, State]:
        """What is fitted with another value, and from where: `one_cause.Cause.changed`.

        Parameters
        ----------
        found : RobotPosterior
        holds : Holds
        by : (3,) array
            Further in the platform's frame, m.
        """
        robot = found.unknowns.robot
        other = replace(robot, centre_of_mass_m=robot.centre_of_mass_m + by)
        return replace(found.unknowns, robot=other), holds, found.state

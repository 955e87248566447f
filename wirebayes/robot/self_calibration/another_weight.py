"""Whether another mass of the platform would explain what a calibration's readings contradict."""

from dataclasses import dataclass, replace

from wirebayes.numeric.batches import batch_last
from wirebayes.numeric.typing import Floats
from wirebayes.progress import ShareDone
from wirebayes.robot.mechanics import statics
from wirebayes.robot.self_calibration.equations import Holds, State, by_carried
from wirebayes.robot.self_calibration.one_cause import explained_by
from wirebayes.robot.self_calibration.posterior import RobotPosterior
from wirebayes.robot.self_calibration.unknowns import Unknowns
from wirebayes.sentences import short

_LEAST = 0.1  # of a mass: a platform that weighs less than a tenth of what was weighed is not the same one


@dataclass(frozen=True)
class OtherMass:
    """A mass that would explain what contradicts.

    Attributes
    ----------
    mass_kg, sd_kg : float
    stated_kg : float
        As the robot's file says.
    evidence : float
        Log density of the readings with it.
    """

    mass_kg: float
    sd_kg: float
    stated_kg: float
    evidence: float

    def in_words(self) -> str:
        """What to do about it."""
        return (
            f"a platform of {short(self.mass_kg, 4)} +- {short(self.sd_kg, 2)} kg would explain what contradicts, the "
            f"robot's file says {short(self.stated_kg, 4)} kg: weigh it with all that it carries, or check the scale "
            "of the tension sensors; do not use these values"
        )


def other_mass(found: RobotPosterior, holds: Holds, progress: ShareDone = lambda share: None) -> OtherMass | None:
    """The mass with which readings and model do belong together; None where there is none.

    Parameters
    ----------
    found : RobotPosterior
    holds : Holds
    progress : function of a share between 0 and 1
    """
    explained = explained_by(Mass(), found, holds, progress)
    if explained is None:
        return None
    mass = explained.found.unknowns.robot.mass_kg
    sd = mass * float(explained.covariance[0, 0]) ** 0.5
    return OtherMass(mass, sd, found.unknowns.robot.mass_kg, explained.found.evidence)


class Mass:
    """The platform's mass; its value is the relative change."""

    usual = 1.0

    def slopes(self, found: RobotPosterior) -> Floats:
        robot = found.unknowns.robot
        weight = statics.weight(robot, batch_last(found.state.rotation))
        return by_carried(found.equations, robot, found.noise, weight[None])

    def changed(self, found: RobotPosterior, holds: Holds, by: Floats) -> tuple[Unknowns, Holds, State]:
        """What is fitted with another value, and from where: `one_cause.Cause.changed`.

        Parameters
        ----------
        found : RobotPosterior
        holds : Holds
        by : (1,) array
            Relative change of the mass.
        """
        robot = found.unknowns.robot
        heavier = replace(robot, mass_kg=robot.mass_kg * max(1.0 + float(by[0]), _LEAST))
        return replace(found.unknowns, robot=heavier), holds, found.state

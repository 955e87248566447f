"""Whether another mass of the platform would explain what a calibration's readings contradict."""

from dataclasses import dataclass, replace

import numpy as np

from wirebayes.numeric.batches import batch_last
from wirebayes.numeric.typing import Floats
from wirebayes.progress import ShareDone, shares_of
from wirebayes.result_warnings import Notice
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import GRAVITY, Robot
from wirebayes.robot.self_calibration.equations import Holds
from wirebayes.robot.self_calibration.estimate import estimate
from wirebayes.robot.self_calibration.posterior import RobotPosterior
from wirebayes.robot.self_calibration.residuals import trust
from wirebayes.robot.self_calibration.sensors import Suspects, sensor_notices
from wirebayes.robot.self_calibration.trust import SIGNIFICANT
from wirebayes.sentences import short

_TRIES = 3  # searches: each mass is found along straight lines from the one before
_STILL = 0.5  # standard deviations: a mass that moves by less is found
_LEAST = 0.1  # of a mass: a platform that weighs less than a tenth of what was weighed is not the same one
_HELD_BY = 1e-3  # of the weight: balance that fails by more was not restored


@dataclass(frozen=True)
class OtherMass:
    """A mass that would explain what contradicts, and its standard deviation, kg."""

    mass_kg: float
    sd_kg: float


def other_mass(found: RobotPosterior, holds: Holds, progress: ShareDone = lambda share: None) -> OtherMass | None:
    """The mass with which readings and model do belong together; None where there is none.

    Parameters
    ----------
    found : RobotPosterior
    holds : Holds
    progress : function of a share between 0 and 1
    """
    for part in shares_of(progress, _TRIES):
        slope = _by_mass(found)
        change, sd = _least_squares(found, slope)
        mass = found.unknowns.robot.mass_kg
        if not abs(change) > _STILL * sd:  # nor where the balance does not tell it
            break
        heavier = replace(found.unknowns.robot, mass_kg=mass * max(1.0 + change, _LEAST))
        found = estimate(replace(found.unknowns, robot=heavier), holds, found.state, part)
    else:
        return None
    if not found.converged or trust(found) < SIGNIFICANT or found.noise.balance > _HELD_BY:
        return None
    return OtherMass(mass, mass * sd)


def _by_mass(found: RobotPosterior) -> Floats:
    """How the residuals ``(p, k)`` follow a relative change of the platform's mass."""
    e = found.equations
    robot = found.unknowns.robot
    carried = statics.weight(robot, batch_last(found.state.rotation)).T * robot.edge_scale
    out = np.zeros_like(e.residual)
    out[:, e.rows["balance"]] = -carried / (found.noise.balance * robot.mass_kg * GRAVITY)
    return out


def _least_squares(found: RobotPosterior, slope: Floats) -> tuple[float, float]:
    """The value of one more unknown on which all residuals depend, and its standard deviation; infinite if unknown.

    Parameters
    ----------
    found : RobotPosterior
        At its mode.
    slope : (p, k) array
        Of the residuals by it.
    """
    e = found.equations
    by_own = np.einsum("pk,pkh->ph", slope, e.by_hold)
    by_robot = np.einsum("pk,pkm->m", slope, e.by_robot) + np.einsum("ph,phm->m", by_own, found.by_robot)
    alone = found.hold_covariance - found.by_robot @ found.covariance @ found.by_robot.mT
    taken_up = np.einsum("pi,pij,pj->", by_own, alone, by_own) + by_robot @ found.covariance @ by_robot
    information = float((slope**2).sum() - taken_up)
    if not information > 0:
        return 0.0, np.inf
    return float(-(slope * e.residual).sum() / information), information**-0.5


def fault_notices(robot: Robot, found: OtherMass | None, sensors: Suspects | None) -> list[Notice]:
    """What to say of masses and sensors that would explain what contradicts.

    Parameters
    ----------
    robot : Robot
        As its file says.
    found : OtherMass or None
    sensors : Suspects or None
        Those that would explain less than the mass does are not named.
    """
    if found is None:
        return sensor_notices(sensors)
    text = (
        f"a platform of {short(found.mass_kg, 4)} +- {short(found.sd_kg, 2)} kg would explain what contradicts, the "
        f"robot's file says {short(robot.mass_kg, 4)} kg: weigh it with all that it carries, or check the scale of "
        "the tension sensors; do not use these values"
    )
    weighed = [Notice("misfit", text)]
    as_well = sensors is not None and sensors.wires and sensors.whole[sensors.wires].all()
    return weighed + sensor_notices(sensors) if as_well else weighed

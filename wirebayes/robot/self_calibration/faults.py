"""What alone would explain all that a calibration's readings contradict, and what to say of it."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from wirebayes.progress import Progress
from wirebayes.result_warnings import Notice
from wirebayes.robot.self_calibration.another_centre import other_centre
from wirebayes.robot.self_calibration.another_weight import other_mass
from wirebayes.robot.self_calibration.equations import Holds
from wirebayes.robot.self_calibration.estimate import progress_of
from wirebayes.robot.self_calibration.leaning_frame import leaning_frame
from wirebayes.robot.self_calibration.posterior import RobotPosterior
from wirebayes.robot.self_calibration.sensors import Suspects, sensor_notices
from wirebayes.robot.self_calibration.trust import SIGNIFICANT

_CAUSES = {"mass": other_mass, "centre of mass": other_centre, "lean": leaning_frame}


class Explanation(Protocol):
    """What would explain all that contradicts."""

    @property
    def evidence(self) -> float:
        """Log density of the readings with it."""

    def in_words(self) -> str:
        """What to do about it."""


def explanations(found: RobotPosterior, holds: Holds, progress: Progress) -> tuple[Explanation, ...]:
    """What of the platform or of the robot's frame would, each by itself, explain what contradicts.

    Parameters
    ----------
    found : RobotPosterior
    holds : Holds
    progress : function of name, done and total
    """
    tried = [search(found, holds, progress_of(progress, name)) for name, search in _CAUSES.items()]
    return tuple(one for one in tried if one is not None)


def fault_notices(explain: Sequence[Explanation], sensors: Suspects | None) -> list[Notice]:
    """Name what explains all that contradicts and is no less likely by far than the likeliest; else sensors, if any.

    Parameters
    ----------
    explain : sequence of Explanation
    sensors : Suspects or None
        Those that would explain only a part are not named beside anything that explains all.
    """
    if not explain:
        return sensor_notices(sensors)
    named = [(one.evidence, [Notice("misfit", one.in_words())]) for one in explain]
    if sensors is not None and sensors_explain(sensors):
        named.append((float(sensors.evidence[sensors.wires].max()), sensor_notices(sensors)))
    likeliest = max(evidence for evidence, _ in named)
    least = likeliest + np.log(SIGNIFICANT)
    return [notice for evidence, notices in named if evidence > least for notice in notices]


def sensors_explain(sensors: Suspects | None) -> bool:
    """Whether any sensor that is named would alone explain all that contradicts.

    Parameters
    ----------
    sensors : Suspects or None
    """
    return sensors is not None and bool(sensors.wires) and bool(sensors.whole[sensors.wires].all())

"""What to say of a mass, a lean and sensors, each of which alone would explain what a calibration contradicts."""

import numpy as np

from wirebayes.result_warnings import Notice
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.self_calibration.another_weight import OtherMass
from wirebayes.robot.self_calibration.leaning_frame import LeaningFrame
from wirebayes.robot.self_calibration.sensors import Suspects, sensor_notices
from wirebayes.robot.self_calibration.trust import SIGNIFICANT


def fault_notices(
    robot: Robot, mass: OtherMass | None, lean: LeaningFrame | None, sensors: Suspects | None
) -> list[Notice]:
    """Name what explains all that contradicts and is no less likely by far than the likeliest; else sensors, if any.

    Parameters
    ----------
    robot : Robot
        As its file says.
    mass : OtherMass or None
    lean : LeaningFrame or None
    sensors : Suspects or None
        Those that would explain only a part are not named beside a mass or a lean that explains all.
    """
    explain: list[tuple[float, list[Notice]]] = []
    if mass is not None:
        explain.append((mass.evidence, [Notice("misfit", mass.in_words(robot))]))
    if lean is not None:
        explain.append((lean.evidence, [Notice("misfit", lean.in_words())]))
    if not explain:
        return sensor_notices(sensors)
    if sensors is not None and sensors.wires and sensors.whole[sensors.wires].all():
        explain.append((float(sensors.evidence[sensors.wires].max()), sensor_notices(sensors)))
    likeliest = max(evidence for evidence, _ in explain)
    least = likeliest + np.log(SIGNIFICANT)
    return [notice for evidence, notices in explain if evidence > least for notice in notices]

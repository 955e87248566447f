"""A robot's file with other exit and platform points, everything else as it stands."""

import re

from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics.description import Robot

_KEY = r"(?m)^(\s*{key}\s*=\s*)\[[^\]]*\]"


def with_points(text: str, robot: Robot) -> str:
    """The text of a robot's file with the points of a robot.

    Parameters
    ----------
    text : str
    robot : Robot
        With as many legs, in the file's order.

    Returns
    -------
    str
    """
    for key, points in (("exit_point_m", robot.exit_m), ("platform_point_m", robot.platform_m)):
        text = _replaced(text, key, points)
    return text


def _replaced(text: str, key: str, points: Floats) -> str:
    rows = iter(points)
    return re.sub(_KEY.format(key=key), lambda match: match[1] + _row(next(rows)), text)


def _row(values: Floats) -> str:
    return "[" + ", ".join(repr(round(float(v), 7) + 0.0) for v in values) + "]"

"""Columns of joint values: zero-tension length paid out, an actuator's displacement, or the angle of a drum's motor."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.drums import paid_out

_MOTOR = "motor_"


def has_motors(names: Sequence[str]) -> bool:
    """Whether a header has motor angles among its columns."""
    return any(name.startswith(_MOTOR) for name in names)


def joint_columns(robot: Robot, motors: bool = False) -> tuple[str, ...]:
    """Names of a column a leg; with `motors`, drums of known radius have their motor's angle."""
    turned = _turned(robot) if motors else np.zeros(robot.legs, bool)
    return tuple(f"{_MOTOR}{i}_rad" if motor else f"joint_{i}_m" for i, motor in enumerate(turned, start=1))


def joint_values(robot: Robot, names: Sequence[str], values: Floats) -> Floats:
    """Joint values of what such columns hold, motor angles as lengths paid out.

    Parameters
    ----------
    robot : Robot
    names : sequence of str
        As `joint_columns` returns them.
    values : (t, w) array

    Returns
    -------
    (t, w) array
        Metres.
    """
    if robot.drums is None or not has_motors(names):
        return values
    return np.where(_turned(robot), paid_out(robot.drums, values)[0], values)


def _turned(robot: Robot) -> NDArray[np.bool_]:
    """Legs whose drum is known."""
    return np.zeros(robot.legs, bool) if robot.drums is None else robot.drums.radius_m > 0

"""Columns of joint values in tables: metres of wire, angles of motors, or straight millimetres as firmware counts."""

from collections.abc import Sequence

import numpy as np

from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.drums import paid_out
from wirebayes.robot.mechanics.firmware import wire_of

_MOTOR, _STRAIGHT = "motor_", "straight_"


def joint_columns(robot: Robot, header: Sequence[str] = ()) -> tuple[str, ...]:
    """The column of every leg, in the units that a header uses.

    Motor angles stand in place of joint values for drums of known radius, straight lengths for all drums.

    Parameters
    ----------
    robot : Robot
    header : sequence of str
        Any column names; units are told by those of joint values among them.
    """
    turned = np.zeros(robot.legs, bool)
    if _has(header, _MOTOR) and robot.drums is not None:
        turned = robot.drums.radius_m > 0
    straight = _has(header, _STRAIGHT) & ~robot.is_linear

    def name(leg: int) -> str:
        if turned[leg]:
            return f"{_MOTOR}{leg + 1}_rad"
        return f"{_STRAIGHT}{leg + 1}_mm" if straight[leg] else f"joint_{leg + 1}_m"

    return tuple(name(leg) for leg in range(robot.legs))


def joint_values(robot: Robot, names: Sequence[str], cells: Floats) -> Floats:
    """Joint values ``(t, w)``, m, of cells ``(t, w)`` in the units of their columns.

    Parameters
    ----------
    robot : Robot
    names : sequence of str
        As `joint_columns` gives them.
    cells : (t, w) array
    """
    joint = np.array(cells, float)
    turned = np.array([name.startswith(_MOTOR) for name in names])
    straight = np.array([name.startswith(_STRAIGHT) for name in names])
    if robot.drums is not None:
        joint = np.where(turned, paid_out(robot.drums, cells)[0], joint)
    return np.where(straight, wire_of(robot, 1e-3 * cells), joint)


def meant(name: str, joint_m: float) -> str:
    """What to add to a cell in a message, where its unit is not that of joint values.

    Parameters
    ----------
    name : str
        Of its column.
    joint_m : float
        What it stands for.
    """
    if name.startswith(_MOTOR):
        return f", which pays out {joint_m:.4g} m"
    return f", which is {joint_m:.4g} m of wire" if name.startswith(_STRAIGHT) else ""


def _has(header: Sequence[str], prefix: str) -> bool:
    return any(str(name).startswith(prefix) for name in header)

"""Columns of poses and of joint values in tables.

Joint values are metres of wire, angles of motors, or straight millimetres as firmware counts.
"""

from collections.abc import Sequence

import numpy as np

from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.drums import paid_out
from wirebayes.robot.mechanics.firmware import wire_of
from wirebayes.robot.mechanics.winches import of_each_leg, of_each_winch
from wirebayes.sentences import short

POSITION = ("x_m", "y_m", "z_m")
TURN = ("rx_rad", "ry_rad", "rz_rad")  # of a rotation vector
_MOTOR, _STRAIGHT = "motor_", "straight_"


def joint_columns(robot: Robot, header: Sequence[str] = ()) -> tuple[str, ...]:
    """The column of every winch or actuator, in the units that a header uses.

    Motor angles stand in place of joint values for drums of known radius, straight lengths for all drums.

    Parameters
    ----------
    robot : Robot
    header : sequence of str
        Any column names; units are told by those of joint values among them.
    """
    turned = np.zeros(robot.joints, bool)
    if _has(header, _MOTOR) and robot.drums is not None:
        turned = of_each_winch(robot, robot.drums.radius_m) > 0
    is_linear = of_each_winch(robot, robot.is_linear)
    straight = _has(header, _STRAIGHT) & ~is_linear
    names = []
    for joint in range(robot.joints):
        number = joint + 1
        if turned[joint]:
            names.append(f"{_MOTOR}{number}_rad")
        elif straight[joint]:
            names.append(f"{_STRAIGHT}{number}_mm")
        else:
            names.append(f"joint_{number}_m")
    return tuple(names)


def column_of_leg(robot: Robot, names: Sequence[str], leg: int) -> str:
    """The column that a leg's joint value stands in.

    Parameters
    ----------
    robot : Robot
    names : sequence of str
        As `joint_columns` gives them.
    leg : int
        From 0.
    """
    return names[leg if robot.winch is None else robot.winch[leg]]


def joint_values(robot: Robot, names: Sequence[str], cells: Floats) -> Floats:
    """Joint values leg by leg, ``(t, w)`` m, of cells ``(t, j)`` in the units of their columns.

    Parameters
    ----------
    robot : Robot
    names : sequence of str
        As `joint_columns` gives them.
    cells : (t, j) array
    """
    joint = of_each_leg(robot, np.array(cells, float))
    turned, straight = (
        of_each_leg(robot, np.array([name.startswith(unit) for name in names])) for unit in (_MOTOR, _STRAIGHT)
    )
    wire = of_each_leg(robot, wire_of(robot, 1e-3 * cells))
    if robot.drums is not None:
        joint = np.where(turned, paid_out(robot.drums, joint)[0], joint)
    return np.where(straight, wire, joint)


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
        return f", which pays out {short(joint_m, 4)} m"
    return f", which is {short(joint_m, 4)} m of wire" if name.startswith(_STRAIGHT) else ""


def joint_unit_told(name: str) -> str:
    """What to add to what is expected of a cell, where its unit is not that of joint values.

    Parameters
    ----------
    name : str
        Of its column.
    """
    if name.startswith(_MOTOR):
        return "; the motor's angle is in radians, zero where no wire is paid out"
    return "; straight lengths are in millimetres" if name.startswith(_STRAIGHT) else ""


def _has(header: Sequence[str], prefix: str) -> bool:
    return any(str(name).startswith(prefix) for name in header)

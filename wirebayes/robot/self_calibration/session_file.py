"""Reads a calibration session from CSV, strictly: one row per hold, errors with line and column."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from wirebayes.errors import InputError
from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.drums import paid_out
from wirebayes.robot.mechanics.rotation import matrix
from wirebayes.robot.motion import plausible
from wirebayes.robot.self_calibration.session import Session
from wirebayes.strict.files import csv_rows, read_text

POSE = ("x_m", "y_m", "z_m", "rx_rad", "ry_rad", "rz_rad")
NORMAL = ("normal_x", "normal_y")


def columns(robot: Robot, tilted: bool, motors: bool = False, moved: bool = False) -> list[str]:
    """The file's header: requested pose, duration, joint values, tensions at the end, and the normal's components.

    With `motors` the legs with a drum of known radius have their motor's angle in place of the joint value; with
    `moved` the directions in which the wires moved last follow the tensions.

    Parameters
    ----------
    robot : Robot
    tilted : bool
        With the two columns of an inclinometer.
    motors : bool

    Returns
    -------
    list of str
    """
    legs = range(1, robot.legs + 1)
    turned = _motors(robot) if motors else np.zeros(robot.legs, bool)
    joints = [f"motor_{i}_rad" if turned[i - 1] else f"joint_{i}_m" for i in legs]
    tensions = [f"tension_{i}_N" for i in legs]
    motions = [f"motion_{i}" for i in legs] if moved else []
    return ["hold", *POSE, "duration_s", *joints, *tensions, *motions, *(NORMAL if tilted else ())]


def has_motors(names: Sequence[str]) -> bool:
    """Whether a header has motor angles among its columns."""
    return any(str(name).startswith("motor_") for name in names)


def has_motion(names: Sequence[str]) -> bool:
    """Whether a header says in which direction the wires moved."""
    return any(str(name).startswith("motion_") for name in names)


def _motors(robot: Robot) -> NDArray[np.bool_]:
    return np.zeros(robot.legs, bool) if robot.drums is None else robot.drums.radius_m > 0


def read(
    path: Path, robot: Robot, tension_sd_N: float, tilt_sd_rad: float, biased: bool = False
) -> tuple[Session, Floats]:
    """A session and its standardised readings ``(r,)``.

    A row without tensions is a hold that was not read; one without a position is a hold at a pose that nobody knows,
    and one without a rotation at an orientation that nobody knows: NaN in the session. With the columns
    ``normal_x,normal_y`` an inclinometer's readings join in. Sensors that may be `biased` may read below zero, and
    directions of motion, ``motion_1`` and so on, may be given for them only.

    Raises
    ------
    InputError
        Naming line and column, what was found and what was expected.

    Parameters
    ----------
    path : Path
    robot : Robot
        Says how many joint values and tensions a row has.
    tension_sd_N : float
        Standard deviation of a tension reading.
    tilt_sd_rad : float
        Standard deviation of an inclinometer's component.

    Returns
    -------
    session : Session
    readings : (r,) array
        In units of their standard deviations.
    """
    text = read_text(path, "the header " + ",".join(columns(robot, False)))
    return parse(str(path), text, robot, tension_sd_N, tilt_sd_rad, biased=biased)


def parse(
    source: str,
    text: str,
    robot: Robot,
    tension_sd_N: float,
    tilt_sd_rad: float,
    place: Callable[[int], str] = "line {}".format,
    biased: bool = False,
) -> tuple[Session, Floats]:
    """A session and its standardised readings from the text of a file.

    Parameters
    ----------
    source : str
        What errors call the file.
    text : str
    robot : Robot
    tension_sd_N, tilt_sd_rad : float
        As for `read`.
    place : callable
        Of a line's number, counted from 1, to what errors call it.

    Returns
    -------
    session : Session
    readings : (r,) array

    Raises
    ------
    InputError
        Naming line and column, what was found and what was expected.
    """
    numbered = csv_rows(source, text, place)
    rows = [row for _, row in numbered]
    tilted = bool(rows) and rows[0][-1] == NORMAL[-1]
    motors, moved = (bool(rows) and given(rows[0]) for given in (has_motors, has_motion))
    wanted = columns(robot, tilted, motors, moved)
    if not rows or rows[0] != wanted:
        found = ",".join(rows[0])[:200] if rows else "nothing"
        raise InputError(f"{source}: {place(1)}: found {found}, expected the header {','.join(wanted)}")
    if moved and not biased:
        raise InputError(
            f"{source}: {place(1)}: found directions of motion, but the sensors have no bias, expected "
            "--tension-bias N, or tension_bias_N under [sensors] in the robot's file"
        )
    cells = [_row(f"{source}: {place(line)}", row, wanted, biased) for line, row in numbered[1:]]
    table = np.array(cells).reshape(-1, len(wanted))
    if not len(table):
        raise InputError(f"{source}: found no holds, expected at least one row")
    numbers = table[:, 0].tolist()
    for i, number in enumerate(numbers):
        if number in numbers[:i]:
            again = f"{source}: {place(numbered[i + 1][0])}, column hold: found {number:g} once more"
            raise InputError(f"{again}, expected a row for each hold")
    w = robot.legs
    joint, tension = table[:, 8 : 8 + w], table[:, 8 + w : 8 + 2 * w]
    if motors and robot.drums is not None:
        joint = np.where(_motors(robot), paid_out(robot.drums, joint)[0], joint)
    unlikely = plausible.wrong(robot, joint)
    if unlikely is not None:
        (row, leg), expected = unlikely
        where = f"{source}: {place(numbered[row + 1][0])}, column {wanted[8 + leg]}"
        raise InputError(f"{where}: found {table[row, 8 + leg]:.10g}, expected {expected}")
    motion = table[:, 8 + 2 * w : 8 + 3 * w] if moved else None
    measured = np.delete(table[:, 8 + w :], np.s_[w : 2 * w], axis=1) if moved else table[:, 8 + w :]
    read_here = np.isfinite(measured).all(1)
    half = ~read_here & np.isfinite(measured).any(1)
    if half.any():
        raise InputError(
            f"{source}: {place(numbered[int(np.argmax(half)) + 1][0])}: found some readings empty, expected all or none"
        )
    _refuse_half(source, place, numbered, table[:, 1:4], "the position")
    _refuse_half(source, place, numbered, table[:, 4:7], "the rotation")
    turn = table[:, 4:7] if robot.degrees == 6 else np.tile(robot.home_rotation_rad, (len(table), 1))
    session = Session(
        table[:, 1:4],
        np.where(np.isfinite(table[:, 1:4]).all(1)[:, None, None], matrix(turn), np.nan),
        joint,
        table[:, 7],
        read_here,
        tension_sd_N,
        tilt_sd_rad if tilted else None,
        motion,
        table[:, 0],
    )
    # without any tension read, what is left is for the calibration of the whole robot
    readings = [(tension[read_here] / tension_sd_N).ravel()]
    if tilted:
        readings.append((table[read_here][:, -2:] / tilt_sd_rad).ravel())
    return session, np.concatenate(readings)


def _refuse_half(
    source: str, place: Callable[[int], str], numbered: Sequence[tuple[int, list[str]]], cells: Floats, name: str
) -> None:
    """Refuse rows with some of three cells empty."""
    given = np.isfinite(cells)
    half = given.any(1) & ~given.all(1)
    if half.any():
        line = numbered[int(np.argmax(half)) + 1][0]
        raise InputError(f"{source}: {place(line)}: found some cells of {name} empty, expected all or none")


_LARGEST = 1e9  # metres, seconds, newtons: nothing that is measured comes near


def _row(place: str, row: list[str], names: list[str], biased: bool) -> list[float]:
    if len(row) != len(names):
        raise InputError(f"{place}: found {len(row)} cells, expected {len(names)}")
    out = []
    for name, cell in zip(names, row, strict=True):
        optional = name.startswith(("tension_", "normal_")) or name in POSE
        if optional and not cell.strip():
            out.append(np.nan)
            continue
        try:
            value = float(cell)
        except ValueError:
            value = np.nan
        allowed, kind = abs(value) < _LARGEST, f"a number below {_LARGEST:.0e} in size"
        if name == "duration_s":
            allowed, kind = 0 < value < _LARGEST, f"a number above 0, below {_LARGEST:.0e}"
        elif name.startswith("motion_"):
            allowed, kind = value in (-1, 0, 1), "1 (pulled in last), -1 (let out) or 0"
        elif name.startswith("tension_") and not biased:
            allowed, kind = 0 <= value < _LARGEST, f"a number of at least 0, below {_LARGEST:.0e}"
        elif name in NORMAL:
            allowed, kind = abs(value) <= 1, "a component of a unit vector, from -1 to 1"
        if not np.isfinite(value) or not allowed:
            raise InputError(f"{place}, column {name}: found {cell[:60]!r}, expected {kind}")
        out.append(value)
    return out

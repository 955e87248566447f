"""Reads a calibration session from CSV, strictly: one row per hold, errors with line and column."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np

from wirebayes.errors import InputError
from wirebayes.numeric.typing import Bools, Floats
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.joint_columns import POSITION, TURN, joint_columns, joint_values
from wirebayes.robot.mechanics.rotation import matrix
from wirebayes.robot.motion import plausible
from wirebayes.robot.self_calibration.mistaken import refuse_mistaken
from wirebayes.robot.self_calibration.session import Session
from wirebayes.strict.files import read_text
from wirebayes.strict.table import LARGEST_READING, CsvTable, Header, Numbers, csv_table

NORMAL = ("normal_x", "normal_y")
_NOISE = 5.0  # standard errors: so far below zero a slack wire may read, once in millions of readings


def columns(robot: Robot, given: Sequence[str] = ()) -> Header:
    """The file's columns: duration and joint values; poses and tensions where some are known; motions, the normal's.

    Joint values are in the units of a header that is given (`joint_columns`).
    """
    return Header(
        ("hold", "duration_s", *joint_columns(robot, given)),
        (POSITION, TURN, _of_legs(robot, "tension_{}_N"), _of_legs(robot, "motion_{}"), NORMAL),
    )


def _of_legs(robot: Robot, name: str) -> tuple[str, ...]:
    return tuple(name.format(i) for i in range(1, robot.legs + 1))


def read_session(
    path: Path, robot: Robot, tension_sd_N: float, tilt_sd_rad: float, biased: bool = False
) -> tuple[Session, Floats]:
    """A session and its standardised readings ``(r,)``.

    A row without tensions is a hold that was not read; where those of some wires are missing, the others count, and the
    readings are NaN for those. A row without a position is a hold at a pose that nobody knows, and one without a
    rotation at an orientation that nobody knows: NaN in the session. So are all rows of a table that leaves these
    columns out. With the columns ``normal_x,normal_y`` an inclinometer's readings join in. Tensions may be below zero
    by their noise, and by any amount where sensors may be `biased`; directions of motion, ``motion_1`` and so on, may
    be given for these only.

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
    text = read_text(path, f"a header of {columns(robot)}")
    return parse_session(csv_table(path, text), robot, tension_sd_N, tilt_sd_rad, biased)


def parse_session(
    table: CsvTable, robot: Robot, tension_sd_N: float, tilt_sd_rad: float, biased: bool = False
) -> tuple[Session, Floats]:
    """A session and its standardised readings from a table whose header is not checked yet.

    Parameters
    ----------
    table : CsvTable
    robot : Robot
    tension_sd_N, tilt_sd_rad : float
        As for `read_session`.

    Returns
    -------
    session : Session
    readings : (r,) array

    Raises
    ------
    InputError
        Naming line and column, what was found and what was expected.
    """
    table.check_header(columns(robot, table.header))
    motions = _of_legs(robot, "motion_{}")
    tensions = _of_legs(robot, "tension_{}_N")
    moved = motions[0] in table.header
    tilted = NORMAL[0] in table.header
    if moved and not biased:
        raise _motions_without_bias(table)
    cells = table.numbers(lambda name: _allowed(name, tension_sd_N, biased))
    if not len(cells):
        raise InputError(f"{table.path}: found no holds, expected at least one row")

    some = partial(_some, table, cells)
    number = some(("hold",))[:, 0]
    _refuse_twice(table, number)
    joints = joint_columns(robot, table.header)
    joint = joint_values(robot, joints, some(joints))
    plausible.refuse(robot, joint, table, joints)
    tension = some(tensions)
    normal = some(NORMAL if tilted else ())
    position = some(POSITION)
    turn = some(TURN)
    plausible.refuse_far(robot, position, table)
    was_read = np.asarray(np.isfinite(tension).any(1))
    if tilted:
        _refuse_half(table, normal, "the normal")
        _refuse_tilt_alone(table, was_read, normal)
    _refuse_half(table, position, "the position")
    _refuse_half(table, turn, "the rotation")
    session = Session(
        position,
        _rotations(robot, position, turn),
        joint,
        some(("duration_s",))[:, 0],
        was_read,
        tension_sd_N,
        tilt_sd_rad if tilted else None,
        some(motions) if moved else None,
        number,
    )
    refuse_mistaken(robot, session, tension, table, joints)
    # without any tension read, what is left is for the calibration of the whole robot
    read_N = tension[was_read].ravel()
    read_normal = normal[was_read].ravel()
    return session, np.concatenate([read_N / tension_sd_N, read_normal / tilt_sd_rad])


def _some(table: CsvTable, cells: Floats, names: tuple[str, ...]) -> Floats:
    """(p, n) cells of some columns, NaN where the table leaves them out."""
    if not set(names) <= set(table.header):
        return np.full((len(cells), len(names)), np.nan)
    return cells[:, [table.header.index(name) for name in names]]


def _rotations(robot: Robot, position: Floats, turn: Floats) -> Floats:
    """Requested orientations (p, 3, 3), NaN at a pose that nobody knows; a platform that cannot turn stays as it is."""
    if robot.degrees != 6:
        turn = np.tile(robot.home_rotation_rad, (len(position), 1))
    known = np.asarray(np.isfinite(position).all(1))
    return np.where(known[:, None, None], matrix(turn), np.nan)


def _motions_without_bias(table: CsvTable) -> InputError:
    """The error for directions of motion that nothing depends on."""
    found = "directions of motion, but the sensors have no bias"
    expected = "--tension-bias N, or tension_bias_N under [sensors] in the robot's file"
    return InputError(f"{table.path}, {table.header_place()}: found {found}, expected {expected}")


def _refuse_twice(table: CsvTable, number: Floats) -> None:
    """Refuse a hold's number that stands there before."""
    for row, value in enumerate(number.tolist()):
        if value in number[:row]:
            raise table.complain(row, "hold", f"{value:g} once more", "a row for each hold")


def _refuse_half(table: CsvTable, cells: Floats, name: str) -> None:
    """Refuse rows with some of several cells empty."""
    given = np.isfinite(cells)
    half = np.logical_and(given.any(1), ~given.all(1))
    if half.any():
        raise _complain_of_row(table, half, f"found some cells of {name} empty, expected all or none")


def _refuse_tilt_alone(table: CsvTable, was_read: Bools, normal: Floats) -> None:
    """Refuse rows with tensions and no normal, or a normal and no tension: both are read when a hold ends."""
    odd = np.logical_xor(was_read, np.isfinite(normal).all(1))
    if odd.any():
        raise _complain_of_row(table, odd, "found tensions or the normal empty, expected both or none")


def _complain_of_row(table: CsvTable, rows: Bools, found: str) -> InputError:
    """The error of the first of some rows (p,)."""
    line = table.place(int(np.argmax(rows)), "hold").partition(", column")[0]
    return InputError(f"{table.path}, {line}: {found}")


def may_be_empty(name: str) -> bool:
    """Whether an empty cell of a column says that nothing is known or was read."""
    return name.startswith(("tension_", "normal_")) or name in (*POSITION, *TURN)


def _allowed(name: str, sd_N: float, biased: bool) -> Numbers:
    """What the cells of a column may hold."""
    empty = may_be_empty(name)
    if name == "duration_s":
        return Numbers(f"a number above 0, at most {LARGEST_READING:.0e}", above=0.0)
    if name.startswith("motion_"):
        return Numbers("1 (pulled in last), -1 (let out) or 0", -1.0, 1.0, whole=True)
    if name.startswith("tension_") and not biased:
        way_out = (
            f"{_NOISE * sd_N:g} N below 0 at most, as noise of --tension-sd; --tension-bias allows for a wrong zero"
        )
        return Numbers(f"a number up to {LARGEST_READING:.0e}, {way_out}", -_NOISE * sd_N, empty=empty)
    if name in NORMAL:
        return Numbers("a component of a unit vector, from -1 to 1", -1.0, 1.0, empty=empty)
    return Numbers(empty=empty)

"""Reads a robot's history from CSV, strictly: a row a time, complaints with line and column."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from wirebayes.errors import InputError
from wirebayes.numeric.typing import Floats
from wirebayes.robot.history.history import History
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.joint_columns import POSITION, TURN, joint_columns, joint_values
from wirebayes.robot.mechanics.rotation import matrix
from wirebayes.robot.motion import plausible
from wirebayes.sentences import counted
from wirebayes.strict.files import read_text
from wirebayes.strict.table import LARGEST_READING, CsvTable, Header, Numbers, csv_table

PAYLOAD, CENTRE = "payload_kg", ("payload_x_m", "payload_y_m", "payload_z_m")
TILT = ("roll_deg", "pitch_deg")


def measured_columns(robot: Robot, given: Sequence[str] = ()) -> Header:
    """Columns of a table of measured joint values, in the units of a header that is given (`joint_columns`)."""
    turn = TURN if robot.degrees == 6 else ()
    tilt = (TILT,) if robot.degrees == 6 else ()
    groups = (("hold",), (*POSITION, *turn), (PAYLOAD,), CENTRE, _tensions(robot), *tilt)
    return Header(("time_s", *joint_columns(robot, given)), groups)


def commanded_columns(robot: Robot, given: Sequence[str] = ()) -> Header:
    """Columns of a table of commanded poses."""
    turn = (TURN,) if robot.degrees == 6 else ()
    return Header(("time_s", *POSITION), (("hold",), *turn, (PAYLOAD,), CENTRE))


def _tensions(robot: Robot) -> tuple[str, ...]:
    return tuple(f"tension_{i}_N" for i in range(1, robot.legs + 1))


def read_log(path: Path, robot: Robot, columns_of: Callable[[Robot, Sequence[str]], Header]) -> History:
    """A history from a file.

    Parameters
    ----------
    path : Path
    robot : Robot
        Says how many joint values and tensions a row has.
    columns_of : callable
        `measured_columns` or `commanded_columns`: which columns the file may and must have.

    Returns
    -------
    History

    Raises
    ------
    InputError
        Naming line and column, what was found and what was expected.
    """
    text = read_text(path, f"a header of {columns_of(robot, ())}")
    return parse_log(csv_table(path, text), robot, columns_of)


def parse_log(table: CsvTable, robot: Robot, columns_of: Callable[[Robot, Sequence[str]], Header]) -> History:
    """A history from a table whose header is not checked yet.

    Parameters
    ----------
    table : CsvTable
    robot : Robot
    columns_of : callable
        `measured_columns` or `commanded_columns`.

    Returns
    -------
    History

    Raises
    ------
    InputError
        Naming line and column, what was found and what was expected.
    """
    names = table.header
    header = columns_of(robot, names)
    table.check_header(header)
    _refuse_centre_alone(table)
    cells = table.numbers(_allowed)
    if len(cells) < 2:
        found = counted(len(cells), "row")
        raise InputError(f"{table.path}: found {found} of values, expected two or more")
    times_s = cells[:, names.index("time_s")]
    _refuse_late(table, times_s)
    joints = header.required[1:]
    if joints[0] in POSITION:
        joints = ()
    history = _history(robot, joints, names, cells)
    _refuse_unlikely(robot, history, table, joints)
    return history


def _refuse_centre_alone(table: CsvTable) -> None:
    """Refuse the place of a payload whose mass no column gives: it would change nothing."""
    if CENTRE[0] in table.header and PAYLOAD not in table.header:
        where = table.header_place(table.header.index(CENTRE[0]))
        raise InputError(f"{table.path}, {where}: found {CENTRE[0]} without {PAYLOAD}, expected both")


def _refuse_unlikely(robot: Robot, history: History, table: CsvTable, joints: Sequence[str]) -> None:
    """Refuse joint values and positions that cannot be meant."""
    if history.joint_m is not None:
        plausible.refuse(robot, history.joint_m, table, joints)
    if history.position_m is not None:
        plausible.refuse_far(robot, history.position_m, table)


def _refuse_late(table: CsvTable, time_s: Floats) -> None:
    """Refuse times that do not rise."""
    late = np.flatnonzero(np.diff(time_s) <= 0)
    if len(late):
        before, row = time_s[late[0]], int(late[0]) + 1
        raise table.complain(row, "time_s", f"{time_s[row]:.10g}", f"a time after {before:.10g} s")


def may_be_unread(name: str) -> bool:
    """Whether a cell of a column says nothing where it is empty: a sensor that was not read."""
    return name.startswith("tension_") or name in TILT


def _allowed(name: str) -> Numbers:
    """What the cells of a column may hold."""
    empty = may_be_unread(name)
    if name in TILT:
        return Numbers("an angle from -180 to 180 degrees", -180.0, 180.0, empty=empty)
    if name == "hold":
        return Numbers(f"a whole number from 0 to {LARGEST_READING:.0e}", 0.0, whole=True)
    if name in ("time_s", PAYLOAD):
        return Numbers(f"a number from 0 to {LARGEST_READING:.0e}", 0.0)
    return Numbers(empty=empty)


def _history(robot: Robot, joints: Sequence[str], names: Sequence[str], cells: Floats) -> History:
    rows = len(cells)

    def some(wanted: Sequence[str]) -> Floats | None:
        if not wanted or wanted[0] not in names:
            return None
        return cells[:, [names.index(name) for name in wanted]]

    joint_m = some(joints)
    if joint_m is not None:
        joint_m = joint_values(robot, joints, joint_m)
    position = some(POSITION)
    turn = some(TURN)
    rotation = None
    if position is not None:
        home = np.tile(robot.home_rotation_rad, (rows, 1))
        rotation = matrix(home if turn is None else turn)
    payload = some((PAYLOAD,))
    centre = some(CENTRE)
    hold = some(("hold",))
    tilt = some(TILT)
    return History(
        times_s=cells[:, names.index("time_s")],
        joint_m=joint_m,
        position_m=position,
        rotation=rotation,
        payload_kg=np.zeros(rows) if payload is None else payload[:, 0],
        payload_m=np.tile(robot.centre_of_mass_m, (rows, 1)) if centre is None else centre,
        hold=None if hold is None else hold[:, 0].astype(np.int64),
        tension_N=some(_tensions(robot)),
        tilt_rad=None if tilt is None else np.radians(tilt),
        rotation_is_stated=turn is not None,
    )

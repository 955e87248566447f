"""Reads a robot's history from CSV, strictly: a row a time, complaints with line and column."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from wirebayes.errors import InputError
from wirebayes.numeric.typing import Floats
from wirebayes.robot.history.history import History
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.drums import paid_out
from wirebayes.robot.mechanics.rotation import matrix
from wirebayes.robot.motion import plausible
from wirebayes.strict.files import csv_rows, read_text
from wirebayes.strict.hint import hint

POSITION, TURN = ("x_m", "y_m", "z_m"), ("rx_rad", "ry_rad", "rz_rad")
PAYLOAD, CENTRE = "payload_kg", ("payload_x_m", "payload_y_m", "payload_z_m")
TILT = ("roll_deg", "pitch_deg")
_LARGEST = 1e9  # metres, seconds, newtons: nothing that is measured comes near


@dataclass(frozen=True)
class Columns:
    """Which columns a file must and may have; groups come whole or not at all."""

    needed: tuple[str, ...]
    groups: tuple[tuple[str, ...], ...]

    @property
    def known(self) -> list[str]:
        """Every name."""
        return [*self.needed, *(name for group in self.groups for name in group)]


def measured(robot: Robot, motors: bool = False) -> Columns:
    """Of a file of measured joint values; with `motors`, drums of known radius have their motor's angle instead."""
    legs = range(1, robot.legs + 1)
    turn = TURN if robot.degrees == 6 else ()
    tension = tuple(f"tension_{i}_N" for i in legs)
    tilt = (TILT,) if robot.degrees == 6 else ()
    turned = _drums(robot) if motors else np.zeros(robot.legs, bool)
    joints = tuple(f"motor_{i}_rad" if turned[i - 1] else f"joint_{i}_m" for i in legs)
    return Columns(("time_s", *joints), (("hold",), (*POSITION, *turn), (PAYLOAD,), CENTRE, tension, *tilt))


def commanded(robot: Robot, motors: bool = False) -> Columns:
    """Of a file of commanded poses."""
    turn = (TURN,) if robot.degrees == 6 else ()
    return Columns(("time_s", *POSITION), (("hold",), *turn, (PAYLOAD,), CENTRE))


def _drums(robot: Robot) -> NDArray[np.bool_]:
    return np.zeros(robot.legs, bool) if robot.drums is None else robot.drums.radius_m > 0


def read(path: Path, robot: Robot, columns_of: Callable[[Robot, bool], Columns]) -> History:
    """A history from a file.

    Parameters
    ----------
    path : Path
    robot : Robot
        Says how many joint values and tensions a row has.
    columns_of : callable
        `measured` or `commanded`: which columns the file may and must have.

    Returns
    -------
    History

    Raises
    ------
    InputError
        Naming line and column, what was found and what was expected.
    """
    text = read_text(path, "the header " + ",".join(columns_of(robot, False).needed))
    return parse(str(path), text, robot, columns_of)


def parse(
    source: str,
    text: str,
    robot: Robot,
    columns_of: Callable[[Robot, bool], Columns],
    place: Callable[[int], str] = "line {}".format,
) -> History:
    """A history from the text of a file.

    Parameters
    ----------
    source : str
        What errors call the file.
    text : str
    robot : Robot
    columns_of : callable
        `measured` or `commanded`.
    place : callable
        Of a line's number, counted from 1, to what errors call it.

    Returns
    -------
    History

    Raises
    ------
    InputError
        Naming line and column, what was found and what was expected.
    """
    rows = csv_rows(source, text, place)
    numbered = [(line, row) for line, row in rows if any(cell.strip() for cell in row)]
    first, header = numbered[0] if numbered else (1, [])
    names = [cell.strip() for cell in header]
    columns = columns_of(robot, any(name.startswith("motor_") for name in names))
    if not numbered:
        raise InputError(f"{source}: {place(1)}: found nothing, expected the header {','.join(columns.needed)}")
    _check_header(f"{source}: {place(first)}", names, columns)
    cells = np.array([_row(f"{source}: {place(line)}", row, names) for line, row in numbered[1:]])
    if len(cells) < 2:
        raise InputError(f"{source}: found {len(cells)} row{'s' * (len(cells) != 1)} of values, expected two or more")
    late = np.flatnonzero(np.diff(cells[:, names.index("time_s")]) <= 0)
    if len(late):
        line, time = numbered[late[0] + 2][0], cells[:, names.index("time_s")]
        found, before = f"{time[late[0] + 1]:.10g}", f"{time[late[0]]:.10g}"
        raise InputError(f"{source}: {place(line)}, column time_s: found {found}, expected a time after {before} s")
    history = _history(robot, columns, names, cells)
    if history.joint_m is not None:
        wrong = plausible.wrong(robot, history.joint_m)
        if wrong is not None:
            (row, leg), expected = wrong
            (line, texts), name = numbered[row + 1], columns.needed[1 + leg]
            found = repr(texts[names.index(name)].strip()[:60])
            if name.startswith("motor_"):
                found += f", which pays out {history.joint_m[row, leg]:.4g} m"
            raise InputError(f"{source}: {place(line)}, column {name}: found {found}, expected {expected}")
    return history


def _check_header(where: str, names: Sequence[str], columns: Columns) -> None:
    known = columns.known
    for i, name in enumerate(names):
        if name not in known:
            raise InputError(f"{where}: found the column {name[:60]!r}{hint(name, known)}, expected {_short(columns)}")
        if name in names[:i]:
            raise InputError(f"{where}: found the column {name} twice, expected it once")
    for group in (columns.needed, *columns.groups):
        missing = [name for name in group if name not in names]
        if missing and (group is columns.needed or len(missing) < len(group)):
            raise InputError(f"{where}: found no column {missing[0]}, expected {_short(columns)}")


def _short(columns: Columns) -> str:
    optional = [group[0] if len(group) == 1 else f"{group[0]}…{group[-1]}" for group in columns.groups]
    return f"{','.join(columns.needed)} and, if you have them, {', '.join(optional)}"


def _row(where: str, row: Sequence[str], names: Sequence[str]) -> list[float]:
    if len(row) != len(names):
        raise InputError(f"{where}: found {len(row)} cells, expected {len(names)}")
    out = []
    for name, cell in zip(names, row, strict=True):
        if not cell.strip() and (name.startswith("tension_") or name in TILT):
            out.append(math.nan)  # a sensor that was not read
            continue
        try:
            value = float(cell)
        except ValueError:
            value = math.nan
        low, high, kind = _bounds(name)
        if not low <= value <= high or (name == "hold" and value != int(value)):
            raise InputError(f"{where}, column {name}: found {cell.strip()[:60]!r}, expected {kind}")
        out.append(value)
    return out


def _bounds(name: str) -> tuple[float, float, str]:
    if name in TILT:
        return -180.0, 180.0, "an angle from -180 to 180 degrees"
    if name == "hold":
        return 0.0, _LARGEST, f"a whole number from 0 to {_LARGEST:.0e}"
    if name in ("time_s", PAYLOAD):
        return 0.0, _LARGEST, f"a number from 0 to {_LARGEST:.0e}"
    return -_LARGEST, _LARGEST, f"a number of at most {_LARGEST:.0e} in size"


def _history(robot: Robot, columns: Columns, names: Sequence[str], cells: Floats) -> History:
    def some(wanted: Sequence[str]) -> Floats | None:
        return cells[:, [names.index(name) for name in wanted]] if wanted[0] in names else None

    t, legs = len(cells), range(1, robot.legs + 1)
    position, turn = some(POSITION), some(TURN)
    payload, centre, hold, tilt = some((PAYLOAD,)), some(CENTRE), some(("hold",)), some(TILT)
    joints = columns.needed[1:] if columns.needed[1] not in POSITION else ()
    joint = some(joints) if joints else None
    if joint is not None and robot.drums is not None and any(name.startswith("motor_") for name in joints):
        joint = np.where(_drums(robot), paid_out(robot.drums, joint)[0], joint)
    vector = np.tile(robot.home_rotation_rad, (t, 1)) if turn is None else turn
    return History(
        cells[:, names.index("time_s")],
        joint,
        position,
        None if position is None else matrix(vector),
        np.zeros(t) if payload is None else payload[:, 0],
        np.tile(robot.centre_of_mass_m, (t, 1)) if centre is None else centre,
        None if hold is None else hold[:, 0].astype(np.int64),
        some([f"tension_{i}_N" for i in legs]),
        None if tilt is None else np.radians(tilt),
    )

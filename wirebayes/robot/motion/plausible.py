"""Joint values that cannot be meant: nothing paid out, millimetres, or straight lengths where the wire is meant."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from wirebayes.errors import shown
from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import GRAVITY, Robot
from wirebayes.robot.mechanics.joint_columns import column_of_leg, meant
from wirebayes.robot.mechanics.rotation import matrix
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion import forward, inverse
from wirebayes.strict.table import CsvTable

_FAR = 10.0  # times the robot's size: no wire is so long, and of millimetres those above a hundredth of it are noticed
_TWICE = 2.0  # times its length: no wire stretches so far, but a wire of two lines looks so where one line was given
_RIGID = 1e6  # times the weight: the wires' stiffness, so that lengths alone decide how far they stretch
_STARTS = 8  # anywhere in the workspace, where the home pose leads to no pose that the lengths allow


def wrong(robot: Robot, joint_m: Floats) -> tuple[tuple[int, int], str] | None:
    """The first joint value that cannot be meant.

    Parameters
    ----------
    robot : Robot
    joint_m : (t, w) array

    Returns
    -------
    (row, leg), expected
        Where it is, from 0, and what was expected there; None where all can be meant.
    """
    home = robot.home_m + robot.platform_m @ matrix(robot.home_rotation_rad).T
    wires = robot.lines * np.maximum(np.linalg.norm(robot.exit_m - home, axis=1), robot.span_m) + robot.beyond_m
    most = _FAR * float(wires.max())
    for bad, expected in (
        (~(joint_m > 0) & ~robot.is_linear, "a length above 0"),
        (np.abs(joint_m) > most, f"metres, at most {most:.3g}, {_FAR:g} times the robot's size"),
    ):
        if bad.any():
            return _first(bad), expected
    short = overstretched(robot, joint_m)
    if short.any():
        whole = "the length of the whole wire, lines x straight + beyond_exit_m"
        return _first(short), f"{whole}: between these lengths no pose stretches every wire by less than 100 %"
    return None


def refuse(robot: Robot, joint_m: Floats, table: CsvTable, columns: Sequence[str]) -> None:
    """Refuse joint values of a table that cannot be meant.

    Parameters
    ----------
    robot : Robot
    joint_m : (t, w) array
    table : CsvTable
        Where they were read, a row a time.
    columns : sequence of str
        The columns of the joint values.

    Raises
    ------
    InputError
        Naming line and column, what was found and what was expected.
    """
    unlikely = wrong(robot, joint_m)
    if unlikely is None:
        return
    (row, leg), expected = unlikely
    column = column_of_leg(robot, columns, leg)
    found = shown(table.cell(row, column)) + meant(column, joint_m[row, leg])
    raise table.complain(row, column, found, expected)


def _first(bad: NDArray[np.bool_]) -> tuple[int, int]:
    row, leg = np.argwhere(bad)[0].tolist()
    return row, leg


def overstretched(robot: Robot, joint_m: Floats) -> NDArray[np.bool_]:
    """Wires that joint values leave stretched by more than 100 % wherever the platform is.

    Parameters
    ----------
    robot : Robot
    joint_m : (t, w) array

    Returns
    -------
    (t, w) bool array
        Of the pose at which rigid wires, all alike, would be stretched least; False where none is found.
    """
    out = np.zeros(joint_m.shape, bool)
    home = robot.home_m, matrix(robot.home_rotation_rad)
    # where the home pose itself does not strain them so far there is nothing to look for
    rows = np.flatnonzero((_stretch_at(robot, joint_m, *home) > _TWICE).any(1))
    if not rows.size:
        return out
    rng = np.random.default_rng(0)
    starts = [robot.home_m, *rng.uniform(robot.lower_m, robot.upper_m, (_STARTS, 3))]
    least = np.full((len(rows), robot.legs), np.inf)
    for start in starts:
        stretch = _stretch(robot, joint_m[rows], start)
        better = stretch.max(1) < least.max(1)
        least[better] = stretch[better]
        if not (least.max(1) > _TWICE).any():
            break
    found = np.isfinite(least).all(1)
    out[rows[found]] = least[found] > _TWICE
    return out


def _stretch_at(robot: Robot, joint_m: Floats, position_m: Floats, rotation: Floats) -> Floats:
    """Stretched by zero-tension length ``(t, w)`` at one pose."""
    zero, offset = inverse.lengths(robot, joint_m)
    shape = statics.geometry(robot, position_m[:, None], rotation[..., None])
    return np.asarray(statics.stretched(robot, shape, offset.T).T / zero)


def _stretch(robot: Robot, joint_m: Floats, start_m: Floats) -> Floats:
    """Stretched by zero-tension length ``(t, w)`` where rigid wires hold the platform; infinite where they do not."""
    zero, offset = inverse.lengths(robot, joint_m)
    stiff = {"k1": np.full((1, 1), _RIGID * robot.mass_kg * GRAVITY)}
    rigid = Wires("hooke", "saturating", stiff, np.full((robot.legs, 1), 1000.0))
    there = forward.solve_equilibrium(robot, rigid, zero, offset, start_m, matrix(robot.home_rotation_rad))
    shape = statics.geometry(robot, there.position_m.T, np.moveaxis(there.rotation, 0, -1))
    stretch = statics.stretched(robot, shape, np.broadcast_to(offset, zero.shape).T).T / zero
    return np.where(there.found[:, None], stretch, np.inf)

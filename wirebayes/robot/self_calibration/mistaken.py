"""Sessions whose columns are not what their header says: another unit of force, two columns in the place of each other.

Where poses are stated, their tensions must carry the platform's weight, and their joint values must be the lengths to
there, whatever the wires are. That is checked before anything is fitted, for no fit would name the mistake.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from wirebayes.errors import InputError
from wirebayes.numeric.batches import batch_last
from wirebayes.numeric.typing import Bools, Floats
from wirebayes.result_warnings import Notice
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.winches import lengths
from wirebayes.robot.self_calibration.session import Session
from wirebayes.sentences import number, short
from wirebayes.strict.table import CsvTable

_ANOTHER_UNIT = 3.0  # times: units of force differ by 3.6 (ounces) and more, masses that were measured badly by less
_OUTSIDE = 2.0  # times: wires whose middle tension is that far outside the robot's range are not under its control
_EVEN = 0.1  # of the weight: tensions that leave so much of it unbalanced are not those of the poses
_BETTER = 5.0  # times smaller: what two columns must leave, put in the place of each other
_FEWEST = 3  # holds: with fewer of them a constant error of each wire explains any lengths
_APART = 0.01  # of the robot's size: joint values that far from the lengths to their poses are not theirs


def refuse_mistaken(robot: Robot, session: Session, tension_N: Floats, table: CsvTable, joints: Sequence[str]) -> None:
    """Refuse columns of a session that contradict its stated poses, and would not in another unit or order.

    Parameters
    ----------
    robot : Robot
    session : Session
    tension_N : (p, w) array
        NaN where they were not read.
    table : CsvTable
        Where it was read.
    joints : sequence of str
        The columns of the joint values.

    Raises
    ------
    InputError
        Naming the columns, what was found and what was expected.
    """
    placed = np.asarray(np.isfinite(session.position_m).all(1) & np.isfinite(session.rotation).all((1, 2)))
    if robot.winch is not None or placed.sum() < _FEWEST:
        return
    _refuse_lengths(robot, session, placed, table, joints)
    read = placed & np.isfinite(tension_N).all(1)  # what carries the platform needs every wire
    if read.sum() >= _FEWEST:
        _refuse_tensions(robot, session, tension_N, read, table)


def tension_notices(robot: Robot, session: Session, readings: Floats) -> list[Notice]:
    """Notices that tensions were read far outside the range of the robot's file; no pose need be known.

    Parameters
    ----------
    robot : Robot
    session : Session
    readings : (r,) array
        Standardised, tensions first.
    """
    count = int(session.read.sum()) * robot.legs
    if not count:
        return []
    usual = float(np.nanmedian(readings[:count])) * session.tension_sd_N
    low = robot.rule.lowest_N
    high = robot.rule.highest_N
    if low / _OUTSIDE <= usual <= _OUTSIDE * high:
        return []
    text = (
        f"tensions were read at {number(usual)} N, in the middle, where the robot's file allows {number(low)} to "
        f"{number(high)} N (tension.lowest_N, highest_N): is the unit of the columns tension_1_N … newtons?"
    )
    return [Notice("data", text)]


def _refuse_lengths(robot: Robot, session: Session, rows: Bools, table: CsvTable, joints: Sequence[str]) -> None:
    """Two columns of joint values that are the lengths of each other's wires."""
    as_read = _apart(robot, session, rows, range(robot.legs))
    for i, j in combinations(range(robot.legs), 2):
        swapped = _apart(robot, session, rows, _swapped(robot.legs, i, j))
        there = swapped[[i, j]].max()
        nearest = as_read[[i, j]].min()
        if nearest <= max(_APART * robot.span_m, _BETTER * there):
            continue
        columns = f"columns {joints[i]} and {joints[j]}"
        found = f"{joints[i]} as far as {number(as_read[i])} m from the lengths to the stated poses"
        expected = _in_place(f"{number(there)} m")
        raise InputError(f"{table.path}, {columns}: found {found}, expected {expected}")


def _apart(robot: Robot, session: Session, rows: Bools, order: Sequence[int]) -> Floats:
    """(w,) How far joint values in an order are from the lengths to stated poses, but for a constant of each wire."""
    bare, offset = lengths(robot, session.joint_m[rows][:, order])
    stretched = statics.stretched_at(robot, session.position_m[rows], session.rotation[rows], offset)
    return (stretched - bare).std(0)  # references may err


def _refuse_tensions(robot: Robot, session: Session, tension_N: Floats, rows: Bools, table: CsvTable) -> None:
    """Tensions in another unit, and two columns that are the tensions of each other's wires."""
    mistake = _tension_mistake(robot, session.position_m[rows], session.rotation[rows], tension_N[rows])
    if mistake is not None:
        columns, found, expected = mistake
        raise InputError(f"{table.path}, {columns}: found {found}, expected {expected}")


def column_notices(robot: Robot, position_m: Floats, rotation: Floats, tension_N: Floats) -> list[Notice]:
    """Notices that tensions are those of another unit or order, by the poses that a calibration has found.

    Parameters
    ----------
    robot : Robot
    position_m : (p, 3) array
    rotation : (p, 3, 3) array
    tension_N : (p, w) array
        As they were read, NaN where they were not.
    """
    read = np.isfinite(tension_N).all(1)
    if robot.winch is not None or read.sum() < _FEWEST:
        return []
    mistake = _tension_mistake(robot, position_m[read], rotation[read], tension_N[read])
    if mistake is None:
        return []
    columns, found, expected = mistake
    return [Notice("data", f"{columns}: found {found} at the poses that were estimated, expected {expected}")]


def _tension_mistake(
    robot: Robot, position_m: Floats, rotation: Floats, tension_N: Floats
) -> tuple[str, str, str] | None:
    """The columns that do not carry the platform at its poses, though in another unit or order they would.

    The columns, what was found and what was expected.
    """
    balance = _Balance.at(robot, position_m, rotation, tension_N, _weight(robot, rotation))
    names = _tension_columns(robot)
    other = _of_another_unit(balance, names)
    if other is not None:
        return other
    if balance.left(balance.pull(range(robot.legs))) < _EVEN:
        return None
    return _mixed_up(balance, names)


def unit_mistake(robots: Sequence[Robot], position_m: Floats, rotation: Floats, tension_N: Floats) -> str | None:
    """What was found and expected of tensions that would carry the platform in another unit only; None where they do.

    Parameters
    ----------
    robots : (p,) sequence of Robot
        With what the platform carries at each pose.
    position_m : (p, 3) array
    rotation : (p, 3, 3) array
    tension_N : (p, w) array
        Of all wires.
    """
    if len(tension_N) < _FEWEST or robots[0].winch is not None:
        return None
    robot = robots[0]
    each = [_weight(loaded, turn[None]) for loaded, turn in zip(robots, rotation, strict=True)]
    balance = _Balance.at(robot, position_m, rotation, tension_N, np.concatenate(each, axis=1))
    mistake = _of_another_unit(balance, _tension_columns(robot))
    if mistake is None:
        return None
    columns, found, expected = mistake
    return f"{columns}: found {found}, expected {expected}"


def _tension_columns(robot: Robot) -> list[str]:
    return [f"tension_{i}_N" for i in range(1, robot.legs + 1)]


def _weight(robot: Robot, rotation: Floats) -> Floats:
    """What the wires shall carry, ``(d, p)``, at rotations ``(p, 3, 3)``."""
    return -statics.weight(robot, batch_last(rotation))


def _of_another_unit(balance: "_Balance", names: Sequence[str]) -> tuple[str, str, str] | None:
    """All columns of tensions, if they carry the weight in another unit only."""
    pull = balance.pull(range(len(names)))
    times = balance.times(pull)
    if 1 / _ANOTHER_UNIT < times < _ANOTHER_UNIT or balance.left(times * pull) >= _EVEN:
        return None
    found = f"tensions that are, all together, {number(1 / times)} times what carries the platform's weight"
    return f"{names[0]} to {names[-1]}", found, "newtons (or another mass_kg)"


def _mixed_up(balance: "_Balance", names: Sequence[str]) -> tuple[str, str, str] | None:
    """Two columns of tensions that would balance better in the place of each other."""
    left = balance.left(balance.pull(range(len(names))))
    for i, j in combinations(range(len(names)), 2):
        other = balance.left(balance.pull(_swapped(len(names), i, j)))
        if _BETTER * other < left:
            found = f"tensions that leave {short(100 * left, 2)} % of {balance.whole} unbalanced"
            return f"columns {names[i]} and {names[j]}", found, _in_place(f"{short(100 * other, 2)} %")
    return None


@dataclass(frozen=True)
class _Balance:
    """Forces and moments in newtons on a platform at ``p`` poses.

    Attributes
    ----------
    structure : (d, w, p) array
        Of 1 N in each wire.
    scale : (d, 1) array
        Of moments.
    load : (d, p) array
        What the wires shall carry.
    tension_N : (p, w) array
    """

    structure: Floats
    scale: Floats
    load: Floats
    tension_N: Floats

    @classmethod
    def at(cls, robot: Robot, position_m: Floats, rotation: Floats, tension_N: Floats, load: Floats) -> "_Balance":
        shape = statics.geometry(robot, position_m.T, batch_last(rotation))
        scale = np.where(np.arange(len(load)) < 3, 1.0, 1.0 / robot.size_m)[:, None]
        return cls(-statics.wire_jacobian(robot, shape), scale, scale * load, tension_N)

    def pull(self, order: Sequence[int]) -> Floats:
        """What wires pull whose tensions stand in this order."""
        return self.scale * (self.structure * self.tension_N[:, order].T).sum(1)

    @property
    def whole(self) -> str:
        """Of what a share is left unbalanced: a level table carries the weight, and wires pull against each other."""
        return "the weight" if self.load.any() else "what they pull"

    def left(self, pull: Floats) -> float:
        """What is left unbalanced, of the load or of what wires pull."""
        of_each = self.scale[:, None] * self.structure * self.tension_N.T
        unit = np.linalg.norm(self.load if self.load.any() else of_each)
        return float(np.linalg.norm(pull - self.load) / max(float(unit), 1e-300))

    def times(self, pull: Floats) -> float:
        """The factor by which a pull is to be multiplied to balance the load best; 1 where any balances no load."""
        if not self.load.any():
            return 1.0
        along = (pull * self.load).sum()
        return float(along / max((pull * pull).sum(), 1e-300))


def _swapped(count: int, i: int, j: int) -> list[int]:
    """The numbers from 0, two of them in the place of each other."""
    order = list(range(count))
    order[i], order[j] = j, i
    return order


def _in_place(otherwise: str) -> str:
    """What is expected of two columns that are mixed up, and what that leaves."""
    return f"the two in the place of each other, which leaves {otherwise}"

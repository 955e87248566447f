"""The orientation of a requested pose: what can be asked for, what balance decides, and both in words."""

from dataclasses import dataclass, replace

import numpy as np

from wirebayes.json_files.pose import OrientationFound
from wirebayes.numeric.typing import Bools, Floats
from wirebayes.result_warnings import Notice
from wirebayes.robot.mechanics import rotation as turning
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.motion import hanging, inverse
from wirebayes.robot.motion.home import nearest_balance, turned_away
from wirebayes.robot.motion.loose_balance import vector_by_turn
from wirebayes.sentences import coordinates, listed

COMPONENTS = ("rx", "ry", "rz")
_COUNT = {1: "one", 2: "two"}  # in words, as sentences have it
_ROUNDING = 1e-6  # of the robot's span: what a position written with six digits may be off
_FIXED = 1e-6  # of a turn: a component that changes by no more in a plane only rounds
_SAME = 5e-5  # rad: a component that balance decides and that was asked for to four decimals is as asked for


@dataclass(frozen=True)
class Orientation:
    """The orientation at a position.

    Attributes
    ----------
    position_m : (3,) array
        The one requested; a position that cannot be chosen freely is cleared of rounding.
    rotation : (3, 3) array
        The one asked for, or the reference, where the platform cannot hang.
    found : OrientationFound or None
        None where it was commanded as a whole.
    sentence : str
        Why the platform cannot hang; empty where it can.
    refused : str
        What was asked for and cannot be had; empty where all was had.
    nearest_m : (3,) array or None
        The nearest position at which the platform hangs, where it cannot at the one requested.
    turned_away : tuple of Notice
        How far the platform hangs from a home orientation that nothing holds.
    """

    position_m: Floats
    rotation: Floats
    found: OrientationFound | None = None
    sentence: str = ""
    refused: str = ""
    turned_away: tuple[Notice, ...] = ()
    nearest_m: Floats | None = None


def balanced_orientation(robot: Robot, position_m: Floats, asked_rad: Floats | None) -> Orientation:
    """The orientation that is asked for as far as it can be had, the rest by balance.

    Parameters
    ----------
    robot : Robot
    position_m : (3,) array
    asked_rad : (3,) array or None
        Components of the rotation vector, NaN where free; None: nothing is asked for, and the home orientation is
        taken where it can be commanded and held.

    Returns
    -------
    Orientation
    """
    asked = np.full(3, np.nan) if asked_rad is None else asked_rad
    near_rad = np.where(np.isfinite(asked), asked, robot.home_rotation_rad)
    near = turning.matrix(near_rad)
    as_it_is = Orientation(position_m, near)
    clear = _clear(robot, position_m, near)
    if robot.freedom == "position":
        must_hang = clear and robot.plane is None
        if must_hang and not _held(robot, position_m, near):
            return _nowhere(robot, position_m, near)
        return as_it_is
    if not clear or _commanded(robot, position_m, near, asked_rad):
        return as_it_is
    there = _hung(robot, position_m, near, asked)
    if there.found is None or asked_rad is not None or _decided_by_balance(robot, there):
        return there
    away = turned_away(robot, there.rotation)
    return replace(there, turned_away=tuple(away))


def _decided_by_balance(robot: Robot, there: Orientation) -> bool:
    """Whether a platform hangs away from home, where its orientation is that of balance in any case."""
    return robot.is_underactuated and bool(np.any(there.position_m != robot.home_m))


def _commanded(robot: Robot, position_m: Floats, near: Floats, asked_rad: Floats | None) -> bool:
    """Whether the wires command the orientation as a whole: all that is asked for, or home where it is held."""
    if robot.is_underactuated:
        return False
    if asked_rad is None:
        return _held(robot, position_m, near)
    return bool(np.isfinite(asked_rad).all())


def _hung(robot: Robot, position_m: Floats, near: Floats, asked: Floats) -> Orientation:
    """The orientation in balance that has the components asked for, or those of them that can be had."""
    had = np.isfinite(asked)
    found = hanging.hang(robot, position_m[None], near, asked)
    if found.held[0]:
        return _described(robot, position_m, found, asked, had)
    position_m = _cleared(robot, position_m, near)
    found = hanging.hang(robot, position_m[None], near)
    if not found.held[0]:
        return _nowhere(robot, position_m, near)
    choice = hanging.chosen(robot, position_m, found.rotation[0], found.tension_N[0])
    had = _to_be_had(choice, had)
    if had.any():
        part_asked = np.where(had, asked, np.nan)
        part = hanging.hang(robot, position_m[None], near, part_asked)
        if not part.held[0]:
            out_of_reach = _out_of_reach(asked, had, found)
            return Orientation(position_m, near, None, out_of_reach)
        found = part
    return _described(robot, position_m, found, asked, had)


def by_lines(robot: Robot, rotation: Floats) -> OrientationFound:
    """What winches command that drive several lines, which leave the orientation to their lengths and to balance.

    Parameters
    ----------
    robot : Robot
        With fewer winches than degrees of freedom.
    rotation : (3, 3) array
    """
    places = min(robot.joints, 2 if robot.plane is not None else 3)
    return {
        "commanded_degrees": robot.joints,
        "of_degrees": robot.freedoms,
        "position_directions": places,
        "rotation_choice": 0,
        "commanded_components": [],
        "free_components": _names(_movable(robot, rotation)),
        "refused_components": [],
        "other_rotation_vectors_rad": np.empty((0, 3)),
        "sentence": f"{robot.joints} winches with {robot.legs} lines command {robot.joints} of {robot.freedoms} "
        "degrees of freedom; the lines' lengths and balance decide the orientation.",
    }


def _clear(robot: Robot, x: Floats, R: Floats) -> bool:
    """Whether every wire runs somewhere: no platform point lies on an exit point or inside a pulley."""
    return bool(statics.geometry_at(robot, x, R).clear[0])


def _cleared(robot: Robot, x: Floats, reference: Floats) -> Floats:
    """The position, or one within rounding of it that has a balance: of two wires in a plane that is along no axis."""
    if robot.legs >= 3:
        return x
    near = hanging.nearest_position(robot, x, reference)
    return x if near is None or np.abs(near - x).max() > _ROUNDING * robot.span_m else near


def _held(robot: Robot, x: Floats, R: Floats) -> bool:
    """Whether tensions within the bounds hold a pose."""
    return bool(np.isfinite(inverse.tensions(robot, x[None], R[None])).all())


def _to_be_had(ways: Floats, asked: Bools) -> Bools:
    """The components asked for that a platform can be given which turns in so many ways (k, 3)."""
    out = np.zeros(3, bool)
    left = ways * asked
    for _ in range(len(ways)):
        size = np.linalg.norm(left, axis=0)
        best = int(size.argmax())
        if size[best] < 1e-3:  # it hardly changes: nobody could set it by that
            break
        out[best] = True
        direction = left[:, best] / size[best]
        left = left - np.outer(direction, direction @ left)
    return out


def _described(robot: Robot, x: Floats, found: hanging.Hanging, asked: Floats, had: Bools) -> Orientation:
    """The orientation that was found, with what was commanded."""
    R, tau = found.rotation[0], found.tension_N[0]
    places, degrees = hanging.commandable(robot, x, R, tau)
    movable = _movable(robot, R)
    had = had & movable
    free = _names(movable & ~had)
    refused = np.isfinite(asked) & movable & ~had
    choice = int(found.choice[0])
    left = choice - int(had.sum())
    others = found.others[0]
    content: OrientationFound = {
        "commanded_degrees": degrees,
        "of_degrees": robot.freedoms,
        "position_directions": len(places),
        "rotation_choice": choice,
        "commanded_components": _names(had),
        "free_components": free,
        "refused_components": _names(refused),
        "other_rotation_vectors_rad": others,
        "sentence": _summary(robot, degrees, len(places), left, free, len(others)),
    }
    turned_rad = turning.vector(R)
    missed = _missed(asked, turned_rad, refused)
    return Orientation(x, R, content, "", missed)


def _missed(asked: Floats, vector: Floats, refused: Bools) -> str:
    """A notice that components asked for cannot be had, where balance makes others of them; else empty."""
    missed = []
    for i in np.flatnonzero(refused):
        if abs(asked[i] - vector[i]) > _SAME:
            missed.append(f"{COMPONENTS[i]} = {asked[i]:g} (it is {vector[i]:.5g})")
    if not missed:
        return ""
    return f"the rotation asked for cannot be had: balance decides {', '.join(missed)}"


def _movable(robot: Robot, rotation: Floats) -> Bools:
    """(3,) which components of the rotation vector change where the platform turns: in a plane, about its normal."""
    if robot.plane is None:
        return np.ones(3, bool)
    change = vector_by_turn(turning.vector(rotation[None]))[0] @ robot.plane.normal
    return np.abs(change) > _FIXED


def _names(components: Bools) -> list[str]:
    return [COMPONENTS[i] for i in np.flatnonzero(components)]


def _summary(robot: Robot, degrees: int, places: int, left: int, free: list[str], others: int) -> str:
    """What is commanded, what is not (`left` of it may be asked for), and which of several solutions this is."""
    said = f"{robot.legs} wires command {degrees} of {robot.freedoms} degrees of freedom; "
    if left == 3:
        said += "this is the rotation nearest to the home orientation that was found to be held"
        said += ", and --rotation may ask for another"
    else:
        said += f"balance decides {listed(free)}" if free else "the orientation is as asked for"
        if left > 0:
            some = f"{'any' if left == len(free) else _COUNT[left]} of them"
            said += f", but --rotation may ask for {some if len(free) > 1 else 'it'}"
    if places < 3:
        said += f", the position can be chosen in {places} directions only"
    if others:
        said += f"; of {others + 1} stable orientations it is the one nearest to the home orientation"
    return said + "."


def _out_of_reach(asked: Floats, had: Bools, found: hanging.Hanging) -> str:
    """A notice that components cannot have the values asked for, and what hangs in balance instead."""
    wanted = ", ".join(f"{COMPONENTS[i]} = {asked[i]:g}" for i in np.flatnonzero(had))
    return (
        f"No tensions within the bounds hold the platform here with {wanted}; without that it hangs with the rotation "
        f"vector ({coordinates(turning.vector(found.rotation)[0], 5)}) rad."
    )


def _nowhere(robot: Robot, x: Floats, reference: Floats) -> Orientation:
    """A notice that no orientation is in balance, and where the nearest position with one is."""
    said = "No orientation hangs in stable balance at this position with tensions within the bounds"
    if robot.freedom == "position":
        said = "No tensions within the bounds hold the platform at this position"
    elif np.ptp(robot.platform_m, axis=0).max() == 0:
        said += ': all wires meet in one point, about which the platform turns freely (freedom = "position").'
        return Orientation(x, reference, None, said)
    near = hanging.nearest_position(robot, x, reference)
    if near is None or np.abs(near - x).max() < _ROUNDING * robot.span_m:
        return Orientation(x, reference, None, f"{said}.")
    return Orientation(x, reference, None, f"{said}; {nearest_balance(x, near)}.", nearest_m=near)

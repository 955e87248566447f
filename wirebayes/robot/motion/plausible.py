"""What cannot be meant: joint values and robots' files in the wrong unit, straight lengths where the wire is meant.

Joint values are refused; of a robot's file, which may describe an unusual robot, there is a warning for each key. Its
rules compare what the file says with what else it says; where a whole file is in millimetres only what is known of
robots that were built shows it: how large, and how heavy for their size, robots, platforms, drums and pulleys are.
"""

from collections.abc import Sequence

import numpy as np

from wirebayes.errors import shown
from wirebayes.numeric.rows import chosen_rows
from wirebayes.numeric.typing import Bools, Floats, Indices
from wirebayes.result_warnings import Notice
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import GRAVITY, Robot
from wirebayes.robot.mechanics.draws import WireDraws, lines_of
from wirebayes.robot.mechanics.joint_columns import POSITION, column_of_leg, joint_unit_told, meant
from wirebayes.robot.mechanics.rotation import matrix
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion import forward, inverse
from wirebayes.sentences import listed, number, short
from wirebayes.strict.table import CsvTable

_FAR = 10.0  # times the robot's size: no wire is so long, and of millimetres those above a hundredth of it are noticed
_TWICE = 2.0  # times its length: no wire stretches so far, but a wire of two lines looks so where one line was given
_RIGID = 1e6  # times the weight: the wires' stiffness, so that lengths alone decide how far they stretch
_LARGEST_M = 1000.0  # the largest cable robot, which carries the receiver of the FAST telescope, spans 600 m
# A desktop robot in millimetres spans hundreds of metres, too, and its platform weighs less than a thin rope of that
# length. Cameras above stadiums weigh ten times the rope and more, what is built in a workshop spans less.
_WIDE_M, _ROPE_KG_M = 50.0, 0.01
_BROAD_M, _FRAME_KG_M = 5.0, 1.0  # a platform so broad is a frame, which weighs more than this for each metre
_WHEEL_M = 5.0  # no winch or ropeway has a drum or pulley of a larger radius
_OUTSIDE = 5.0  # times the platform's radius: a mass so far out hangs on a pole, not in a platform
_ROUNDED = 1e-6  # of the span: so far outside its workspace a home position is rounded
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
    reach = np.maximum(_straight_at_home(robot), robot.span_m)
    wires = robot.lines * reach + robot.beyond_m
    most = _FAR * float(wires.max())
    not_positive = ~(joint_m > 0) & ~robot.is_linear
    if not_positive.any():
        return _first(not_positive), "a length above 0"
    far = np.abs(joint_m) > most
    if far.any():
        return _first(far), f"metres, at most {short(most, 3)}, {_FAR:g} times the robot's size"
    stretching = overstretched(robot, joint_m)
    if stretching.any():
        whole = "the length of the whole wire, lines x straight + beyond_exit_m"
        apart = "between these lengths no pose stretches every wire by less than 100 %; is the robot's file in metres?"
        return _first(stretching), f"{whole}: {apart}"
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
    raise table.complain(row, column, found, expected + joint_unit_told(column))


def refuse_far(robot: Robot, position_m: Floats, table: CsvTable) -> None:
    """Refuse positions of a table that lie far outside the robot.

    Parameters
    ----------
    robot : Robot
    position_m : (t, 3) array
        NaN where they are not known.
    table : CsvTable
        Where they were read, a row a time.

    Raises
    ------
    InputError
        Naming line and column, what was found and what was expected.
    """
    most = _FAR * robot.span_m
    far = np.nan_to_num(np.abs(position_m - robot.home_m)) > most
    if far.any():
        row, axis = _first(far)
        expected = f"metres, at most {number(most)} from home, {_FAR:g} times the robot's size"
        column = POSITION[axis]
        raise table.complain(row, column, shown(table.cell(row, column)), expected)


def robot_notices(robot: Robot) -> list[Notice]:
    """A warning for each key of a robot's file whose value looks like one in another unit.

    Parameters
    ----------
    robot : Robot
    """
    found = [
        _exit_points(robot), _platform_points(robot), _centre_of_mass(robot), _home(robot), *_lengths_of_legs(robot),
        _short_wires(robot, robot.home_m, matrix(robot.home_rotation_rad), "home"),
    ]  # fmt: skip
    out = [Notice("geometry", f"{text}; is the unit of the robot's file metres?") for text in found if text]
    return out + _outside(robot) + _copies(robot)


def pose_notices(robot: Robot, position_m: Floats, rotation: Floats) -> list[Notice]:
    """A warning that linear actuators' wires are too short for a pose, unless the file's home pose already has it.

    Parameters
    ----------
    robot : Robot
    position_m, rotation : (3,), (3, 3) arrays
    """
    if _short_wires(robot, robot.home_m, matrix(robot.home_rotation_rad), "home"):
        return []
    text = _short_wires(robot, position_m, rotation, "this pose")
    return [Notice("geometry", text)] if text else []


def _short_wires(robot: Robot, position_m: Floats, rotation: Floats, where: str) -> str:
    """The first linear actuator whose wire is shorter than its lines are at a pose, which no joint value changes."""
    lines_m = robot.lines * statics.geometry_at(robot, position_m, rotation).distance_m[:, 0]
    legs = np.flatnonzero(robot.is_linear & (lines_m > robot.wire_m))
    if not legs.size:
        return ""
    first = legs[0]
    return (
        f"leg.wire_length_m of wire {first + 1}{_and_more(legs)}: {number(robot.wire_m[first])} m, less than the "
        f"{number(lines_m[first])} m of its lines from exit point to platform at {where}"
    )


def _outside(robot: Robot) -> list[Notice]:
    """A notice that the home position is outside the workspace of the same file, unless it is far from everything."""
    if _home(robot):
        return []
    beyond = np.maximum(robot.lower_m - robot.home_m, robot.home_m - robot.upper_m)
    axis = int(beyond.argmax())
    if not beyond[axis] > _ROUNDED * robot.span_m:
        return []
    return [Notice("geometry", _outside_in_words(robot, axis, beyond[axis]))]


def _outside_in_words(robot: Robot, axis: int, beyond_m: float) -> str:
    low, high, here = (number(v[axis]) for v in (robot.lower_m, robot.upper_m, robot.home_m))
    return (
        f"pose.position_m: the home position is {number(beyond_m)} m outside the workspace, {'xyz'[axis]} = {here} "
        f"m, where workspace.lower_m and upper_m say {low} to {high} m"
    )


def _copies(robot: Robot) -> list[Notice]:
    """A warning for each group of legs that run between the same points."""
    ends = np.hstack([robot.exit_m, robot.platform_m])
    alike: dict[tuple[float, ...], list[str]] = {}
    for leg, points in enumerate(ends.tolist(), 1):
        alike.setdefault(tuple(points), []).append(str(leg))
    return [
        Notice(
            "geometry",
            f"leg.exit_point_m and leg.platform_point_m of wires {listed(legs)}: the same points; is any a copy "
            f"that was not changed? Parallel lines of one drum are one leg with lines = {len(legs)}",
        )
        for legs in alike.values()
        if len(legs) > 1
    ]


def _exit_points(robot: Robot) -> str:
    key = f"leg.exit_point_m: the exit points span {number(robot.span_m)} m"
    if robot.span_m > _LARGEST_M:
        return f"{key}, and no cable robot spans {_LARGEST_M:g} m"
    if robot.span_m > _WIDE_M and robot.mass_kg < _ROPE_KG_M * robot.span_m:
        return f"{key}, and the platform, {number(robot.mass_kg)} kg, weighs less than a thin rope of that length"
    return ""


def _platform_points(robot: Robot) -> str:
    arms = _arms(robot)
    if not arms > _BROAD_M or robot.mass_kg > _FRAME_KG_M * arms:
        return ""
    return (
        f"leg.platform_point_m: the platform points lie within {number(arms)} m of their middle, and a platform that "
        f"broad weighs more than {number(robot.mass_kg)} kg"
    )


def _arms(robot: Robot) -> float:
    """The platform's radius, m."""
    return float(np.linalg.norm(robot.platform_m - robot.platform_m.mean(0), axis=1).max())


def _centre_of_mass(robot: Robot) -> str:
    arms, mass_at = _arms(robot), float(np.linalg.norm(robot.centre_of_mass_m - robot.platform_m.mean(0)))
    if not 0 < _OUTSIDE * arms < mass_at:
        return ""
    return (
        f"platform.centre_of_mass_m: the centre of mass is {number(mass_at)} m from the middle of the platform points, "
        f"which lie within {number(arms)} m of it"
    )


def _home(robot: Robot) -> str:
    span, farthest = robot.span_m, float(np.linalg.norm(robot.exit_m - robot.home_m, axis=1).max())
    if not 0 < _FAR * span < farthest:
        return ""
    return f"pose.position_m: the home position is {number(farthest)} m from an exit point, {_beyond(span, _FAR)}"


def _lengths_of_legs(robot: Robot) -> list[str]:
    """For each length of a leg that is longer than the robot or any such part allows, the first such leg."""
    size = max(robot.span_m, min(float(_straight_at_home(robot).max()), _FAR * robot.span_m))
    half = 0.5 * size  # a drum as wide as the robot
    wheel = min(half, _WHEEL_M)
    said = _beyond(size, 0.5) if half < _WHEEL_M else f"and none has a radius of more than {_WHEEL_M:g} m"
    out = _longer("beyond_exit_m", robot.beyond_m, _FAR * size, _beyond(size, _FAR))
    if robot.drums is not None:
        out += _longer("drum_radius_m", robot.drums.radius_m, wheel, said)
    if robot.pulleys is not None:
        out += _longer("pulley_radius_m", robot.pulleys.radius_m, wheel, said)
    return out


def _longer(key: str, length_m: Floats, most_m: float, said: str) -> list[str]:
    """The first leg whose value of a key is larger than it can be, and how many more there are."""
    legs = np.flatnonzero(length_m > most_m)
    if not legs.size:
        return []
    return [f"leg.{key} of wire {legs[0] + 1}{_and_more(legs)}: {number(length_m[legs[0]])} m, {said}"]


def _and_more(legs: Indices) -> str:
    return f" and {legs.size - 1} more" if legs.size > 1 else ""


def _straight_at_home(robot: Robot) -> Floats:
    """(w,) distances of the platform points from their exit points at the home pose, m."""
    points = robot.home_m + robot.platform_m @ matrix(robot.home_rotation_rad).T
    return np.linalg.norm(robot.exit_m - points, axis=1)


def _beyond(size_m: float, times: float) -> str:
    """A sentence that something is larger than it can be for the robot's size."""
    many = "half" if times == 0.5 else f"{times:g} times"
    return f"more than {many} the robot's size, {number(size_m)} m"


def strain_notices(robot: Robot, line: WireDraws, tension_N: Floats) -> list[Notice]:
    """A warning for each kind of wire that tensions would stretch, or let creep, by more than its own length.

    Parameters
    ----------
    robot : Robot
    line : WireDraws
        For every leg whose wire is not given in the robot's file.
    tension_N : (w,) array
    """
    out: dict[str, str] = {}
    for leg, wire in enumerate(lines_of(robot, line)):
        name, pull = robot.wire[leg], float(tension_N[leg])
        place = f"[wires.{name}]" if name in robot.given else "the fitted wire"
        if pull > 0 and place not in out:
            said = _strained(wire, leg, pull)
            if said:
                out[place] = said
    rest = "expected less than 100 %; are the units those of the keys?"
    return [Notice("geometry", f"{place}, {text}, {rest}") for place, text in out.items()]


def _strained(wire: WireDraws, leg: int, pull_N: float) -> str:
    """A sentence that a tension stretches a wire, or lets it creep, by more than its length; empty if it does not."""
    mean = {name: values[0] for name, values in wire.centre().parameters.items()}
    stretch = pull_N / mean["k1"]
    if stretch > _TWICE - 1:
        return (
            f"k1_N = {short(mean['k1'], 4)}: {short(pull_N, 3)} N stretch wire {leg + 1} by {number(100 * stretch)} %"
        )
    creep = mean["B"] * pull_N ** mean["U"] / wire.length_mm
    if creep > _TWICE - 1:
        keys = f"B_mm = {short(mean['B'], 4)}, length_mm = {short(wire.length_mm, 4)}"
        return f"{keys}: wire {leg + 1} creeps by {number(100 * creep)} % at {short(pull_N, 3)} N"
    return ""


def _first(bad: Bools) -> tuple[int, int]:
    row, leg = np.argwhere(bad)[0].tolist()
    return row, leg


def overstretched(robot: Robot, joint_m: Floats) -> Bools:
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
    strained = _stretch_at(robot, joint_m, *home) > _TWICE
    rows = np.flatnonzero(strained.any(1))
    if not rows.size:
        return out
    least = _least_stretch(robot, joint_m[rows])
    found = np.isfinite(least).all(1)
    out[rows[found]] = least[found] > _TWICE
    return out


def _least_stretch(robot: Robot, joint_m: Floats) -> Floats:
    """Stretched by zero-tension length ``(t, w)`` where rigid wires are stretched least; infinite where none hold."""
    rng = np.random.default_rng(0)
    starts = [robot.home_m, *rng.uniform(robot.lower_m, robot.upper_m, (_STARTS, 3))]
    least = np.full(joint_m.shape, np.inf)
    for start in starts:
        stretch = _stretch(robot, joint_m, start)
        better = stretch.max(1) < least.max(1)
        least[better] = stretch[better]
        if not (least.max(1) > _TWICE).any():
            break
    return least


def _stretch_at(robot: Robot, joint_m: Floats, position_m: Floats, rotation: Floats) -> Floats:
    """Stretched by zero-tension length ``(t, w)`` at one pose."""
    zero, offset = inverse.lengths(robot, joint_m)
    shape = statics.geometry_at(robot, position_m, rotation)
    return statics.stretched(robot, shape, offset.T).T / zero


def _stretch(robot: Robot, joint_m: Floats, start_m: Floats) -> Floats:
    """Stretched by zero-tension length ``(t, w)`` where rigid wires hold the platform; infinite where they do not."""
    zero, offset = inverse.lengths(robot, joint_m)
    stiff = {"k1": np.full((1, 1), _RIGID * robot.mass_kg * GRAVITY)}
    rigid = Wires("hooke", "saturating", stiff, np.full((robot.legs, 1), 1000.0))
    there = forward.solve_equilibrium(robot, rigid, zero, offset, start_m, matrix(robot.home_rotation_rad))
    beyond = np.broadcast_to(offset, zero.shape)
    stretch = statics.stretched_at(robot, there.position_m, there.rotation, beyond) / zero
    return chosen_rows(there.found, stretch, np.inf)

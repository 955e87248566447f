"""A fitted wire for people who run such robots: firmware settings with intervals, and a table of creep.

Hangprinter firmware models a line as a spring of ``constant / length`` with the length in mm, so its constant is k1 in
newtons. It ignores creep: the table beside it says how much each line will have grown. Where the line's stiffness
changes with its tension, firmware and simulator get the tangent at the tensions at which the robot works. Of legs that
hang on several lines, firmware gets the one constant it takes, with those of the others in comments. Of a winch that
drives several lines it knows the middle.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from wirebayes.numeric.typing import Floats
from wirebayes.robot.export.mujoco_model import mjcf
from wirebayes.robot.export.robot_models import cut_from, sdf, urdf
from wirebayes.robot.export.working_spring import WorkingSpring, first_fitted, fresh_sample_of, working_spring
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import Drums, Robot
from wirebayes.robot.mechanics.draws import WireDraws, for_robot, lines_of
from wirebayes.robot.mechanics.drums import motor_angle, paid_out
from wirebayes.robot.mechanics.rotation import matrix, vector
from wirebayes.robot.mechanics.winches import mean_of_each_winch, of_each_leg, of_each_winch, turned_by
from wirebayes.robot.mechanics.wire_doubts import doubts
from wirebayes.robot.mechanics.wires import Wires, stretched_length, tension
from wirebayes.robot.motion import inverse
from wirebayes.sentences import short

ANCHORS = "ABCDI"  # as M669 of RepRapFirmware names them, at most five: its E is an extruder
ANCHORS_UNLESS_SAID = 4  # what that firmware assumes without N
STEPPERS = "abcde"  # Klipper's winches
TABLE = ("tension_N", "time_s", "mean_mm_per_m", "sd_mm_per_m", "q05_mm_per_m", "q50_mm_per_m", "q95_mm_per_m")


def is_hangprinter(robot: Robot) -> bool:
    """Whether Hangprinter firmware can describe it: four or five drums, orientation held by parallel lines."""
    parallel = robot.freedom == "position" or (robot.freedom == "pose" and robot.winch is not None)
    return parallel and not robot.is_linear.any() and 4 <= robot.joints <= 5


def _anchors(robot: Robot) -> Floats:
    """(j, 3) Where firmware sees each winch's anchor from the reference point, m: the middle of its lines.

    Firmware takes the platform for a point, so a platform point counts as if its exit point were moved the other way.
    """
    apart = robot.exit_m - robot.platform_m @ matrix(robot.home_rotation_rad).T
    return mean_of_each_winch(robot, apart.T).T


class _Winches(NamedTuple):
    """What firmware is told of each winch ``(j,)``: parts of line, wire beyond its anchor, planned forces."""

    parts: Floats
    beyond_mm: Floats
    lowest_N: Floats
    highest_N: Floats

    @classmethod
    def of(cls, robot: Robot) -> "_Winches":
        parts = mean_of_each_winch(robot, robot.lines)
        beyond_mm = 1e3 * mean_of_each_winch(robot, robot.beyond_m)
        lowest = np.full(robot.joints, robot.rule.lowest_N)
        highest = np.full(robot.joints, robot.rule.highest_N)
        return cls(parts, beyond_mm, lowest, highest)


def reprapfirmware(robot: Robot, line: WireDraws) -> str:
    """Lines for ``config.g`` of RepRapFirmware (M669 and M666), each value with its 90 % interval in a comment."""
    count = "" if robot.joints == ANCHORS_UNLESS_SAID else f"N{robot.joints} "
    anchors = ""
    for letter, anchor in zip(ANCHORS, _anchors(robot), strict=False):
        anchors += f" {letter}{_joined(1e3 * anchor, '.2f')}"
    winches = _Winches.of(robot)
    spring = working_spring(robot, line)
    rows = [
        (f"M669 K6 {count}{anchors.lstrip()}", "anchors, mm"),
        (f"M666 U{_joined(winches.parts, '.0f')}", "mechanical advantages"),
        (f"M666 W{robot.mass_kg:g}", "mover, kg"),
        (f"M666 S{spring.mean_N:.0f}", f"spring constant per unit length, N: {spring.described}"),
        (f"M666 Y{_joined(winches.beyond_mm, '.0f')}", "wire beyond each anchor, mm"),
        (f"M666 I{_joined(winches.lowest_N, 'g')}", "smallest planned force, N"),
        (f"M666 X{_joined(winches.highest_N, 'g')}", "largest planned force, N"),
    ]
    on_spool = turned_by(robot).sum(0)
    if robot.winch is not None:
        said = "lines on each spool; anchors are the middle of their points"
        rows.append((f"M666 O{_joined(on_spool, '.0f')}", said))
    drums = _measured_drums(robot)
    if drums is not None:
        rows += _reprapfirmware_spools(robot, drums, on_spool)
    text = _head(robot, line, spring, ";")
    for code, comment in rows:
        text += f"{code} ; {comment}\n".lstrip()
    return text


def _reprapfirmware_spools(robot: Robot, drums: Drums, on_spool: Floats) -> list[tuple[str, str]]:
    """Codes and comments of spools, on each of which so many lines are wound."""
    radius, growth = _spools(robot, drums)
    growth_mm = 1e3 * growth / on_spool
    gear = of_each_winch(robot, drums.gear)
    return [
        (f"M666 R{_joined(1e3 * radius, '.3f')}", "spool radii at the origin, mm"),
        (f"M666 Q{growth_mm.mean():.5f}", f"buildup of one line, mm: {_joined(growth_mm, '.5f', ', ')}"),
        ("", f"M666 L and H, teeth of motor and spool: their ratio is {_joined(gear, 'g', ', ')}"),
    ]


def klipper(robot: Robot, line: WireDraws) -> str:
    """Sections for ``printer.cfg``: anchors for every Klipper, spring settings for the Hangprinter branch."""
    spring = working_spring(robot, line)
    winches = _Winches.of(robot)
    text = _head(robot, line, spring, "#")
    text += (
        "[printer]\nkinematics: winch\n"
        "# The next options are those of the Hangprinter branch of Klipper; upstream does not know them.\n"
        f"winch_mover_weight: {robot.mass_kg:g}  # kg\n"
        f"winch_spring_constant: {spring.mean_N:.0f}  # N per unit strain: {spring.described}\n"
        f"winch_mechanical_advantage: {_joined(winches.parts, '.0f', ', ')}\n"
        f"winch_guy_wire_lengths: {_joined(winches.beyond_mm, '.0f', ', ')}  # mm\n"
        f"winch_min_force: {_joined(winches.lowest_N, 'g', ', ')}  # N\n"
        f"winch_max_force: {_joined(winches.highest_N, 'g', ', ')}  # N\n"
    )
    drums = _measured_drums(robot)
    of_spools = [""] * robot.joints
    if drums is not None:
        radius, growth = _spools(robot, drums)
        growth_mm = 1e3 * growth
        text += f"winch_buildup_factor: {growth_mm.mean():.5f}  # mm: {_joined(growth_mm, '.5f', ', ')}\n"
        of_spools = _klipper_spools(robot, drums, 2 * np.pi * (1e3 * radius) / winches.parts)
    anchors_mm = 1e3 * _anchors(robot)
    for letter, anchor, spool in zip(STEPPERS, anchors_mm, of_spools, strict=False):
        x, y, z = anchor
        text += f"\n[stepper_{letter}]\nanchor_x: {x:.2f}\nanchor_y: {y:.2f}\nanchor_z: {z:.2f}\n{spool}"
    return text


def _klipper_spools(robot: Robot, drums: Drums, turn_mm: Floats) -> list[str]:
    """What each winch's section says of its spool."""
    out = []
    for turn, gear in zip(turn_mm, of_each_winch(robot, drums.gear), strict=True):
        distance = f"rotation_distance: {turn:.4f}  # straight mm a turn of the spool, at the origin\n"
        out.append(f"{distance}gear_ratio: {gear:g}:1\n")
    return out


def _measured_drums(robot: Robot) -> Drums | None:
    """The drums, where the radius of each is known."""
    drums = robot.drums
    return drums if drums is not None and drums.radius_m.all() else None


def _spools(robot: Robot, drums: Drums) -> tuple[Floats, Floats]:
    """Wire per radian of each drum with the platform at the origin, and growth of the radius squared by the wire, m.

    A layer of ``n`` turns raises the radius by its height ``t`` once for about ``2 pi r n`` of wire, so that the radius
    squared grows by ``t / (pi n)`` per length: the firmware's buildup factor.
    """
    shape = statics.geometry(robot, np.zeros((3, 1)), np.eye(3)[..., None])
    joint = statics.stretched(robot, shape, robot.beyond_m[:, None])[:, 0] - robot.beyond_joint_m
    joint = of_each_leg(robot, mean_of_each_winch(robot, joint))
    slope = paid_out(drums, motor_angle(drums, joint))[1] * drums.gear
    return of_each_winch(robot, slope), of_each_winch(robot, drums.layer_m / (np.pi * drums.layer_turns))


def creep_table(
    robot: Robot, line: WireDraws, tensions_N: Sequence[float], times_s: Sequence[float], wire: str | None = None
) -> list[tuple[float, ...]]:
    """Growth of a new line under constant tension, rows of `TABLE`: mm per metre of line with a 90 % interval.

    Parameters
    ----------
    robot : Robot
        Which of its wires' law and length are used.
    line : WireDraws
    tensions_N, times_s : sequence of float
    wire : str, optional
        Of which of the legs' wires; default: the first that is fitted.

    Returns
    -------
    list of tuples
        Tension, N; time, s; mean, standard deviation and 5, 50 and 95 % quantiles of the growth, mm/m.
    """
    rows: list[tuple[float, ...]] = []
    sample = fresh_sample_of(robot, for_robot(robot, line), wire or first_fitted(robot))
    for load in tensions_N:
        for time, creep in zip(times_s, sample.creep_mm(load, np.asarray(times_s, float)), strict=True):
            growth = 1e3 * creep / sample.length_mm
            low, mid, high = np.quantile(growth, [0.05, 0.5, 0.95])
            rows.append((float(load), float(time), float(growth.mean()), float(growth.std()), low, mid, high))
    return rows


def creep_tables(
    robot: Robot, line: WireDraws, tensions_N: Sequence[float], times_s: Sequence[float]
) -> tuple[tuple[str, ...], list[tuple[float | str, ...]]]:
    """Header and rows of ``creep-table.csv``: `creep_table`, with the wire's name first where the legs have several.

    Parameters
    ----------
    robot : Robot
    line : WireDraws
    tensions_N, times_s : sequence of float
    """
    names = list(dict.fromkeys(robot.wire))
    if len(names) == 1:
        return TABLE, list(creep_table(robot, line, tensions_N, times_s))
    of_each = {name: creep_table(robot, line, tensions_N, times_s, name) for name in names}
    return ("wire", *TABLE), [(name, *row) for name, rows in of_each.items() for row in rows]


def simulators(robot: Robot, line: WireDraws) -> dict[str, str]:
    """The robot for simulators by file name: MuJoCo, URDF and SDF; empty where no tensions hold the home pose.

    Parameters
    ----------
    robot : Robot
    line : WireDraws
    """
    model = mujoco(robot, line)
    if model is None:
        return {}
    wires, commands = _at_home(robot, line)
    zero = commands.zero_m[0]
    k1 = np.broadcast_to(wires.theta["k1"], (robot.legs, 1))[:, 0]
    return {"robot.xml": model, "robot.urdf": urdf(robot, k1, zero), "robot.sdf": sdf(robot, k1, zero)}


def _at_home(robot: Robot, line: WireDraws) -> tuple[Wires, inverse.Commands]:
    """The mean line, and its lengths and tensions at the home pose."""
    wires = for_robot(robot, line.centre())
    x, R = robot.home_m[None], matrix(robot.home_rotation_rad)[None]
    return wires, inverse.commands(robot, wires, x, R, inverse.tensions(robot, x, R))


def mujoco(robot: Robot, line: WireDraws) -> str | None:
    """MuJoCo model of the robot at its home pose with the mean line; None where no tensions hold that pose.

    Each tendon is a linear spring with the tension and the tangent stiffness that the line has there: under law (1)
    without effects on the strain that is the line itself.
    """
    wires, commands = _at_home(robot, line)
    if not commands.feasible.all():
        return None
    if robot.winch is not None:
        turn = vector(commands.rotation)[0]
        robot = replace(robot, home_rotation_rad=turn)
    remark = cut_from(robot)
    offset = commands.offset_m[0]
    if wires.law == "hooke" and not wires.at("strain"):
        k1 = np.broadcast_to(wires.theta["k1"], (robot.legs, 1))[:, 0]
        return mjcf(robot, k1, commands.zero_m[0], offset, remark=remark)
    tangents = _of_tangents(commands.tension_N[0])
    remark = f"{tangents}; {remark}" if remark else tangents
    stiffness, zero = _tangent_springs(wires, commands)
    return mjcf(robot, stiffness, zero, offset, remark=remark)


def _of_tangents(tension_N: Floats) -> str:
    pulls = ", ".join(f"{short(value, 4)}" for value in tension_N)
    return f"linear springs with the tension and tangent stiffness of the home pose, where the wires carry {pulls} N"


def _tangent_springs(wires: Wires, commands: inverse.Commands) -> tuple[Floats, Floats]:
    """(w,) stiffness, N per unit strain, and rest length of springs that are tangent to wires at their commands."""
    zero, tau = commands.zero_m.T, commands.tension_N.T
    stretched = stretched_length(wires, zero, tau)
    _, slope = tension(wires, stretched, zero)
    rest = stretched - tau / slope
    return (slope * rest)[:, 0], rest[:, 0]


def _head(robot: Robot, line: WireDraws, spring: WorkingSpring, mark: str) -> str:
    """What the numbers belong to, as comments."""
    of_leg = lines_of(robot, line)
    about = {}
    for name in dict.fromkeys(robot.wire):
        own = of_leg[robot.wire.index(name)]
        about[name] = _origin(name in robot.given, own)
    several = len(about) > 1
    if several:
        of_wires = cut_from(robot)
        numbers = _wires_in_words(robot, line, about, spring)
    else:
        of_wires = f"line {about[robot.wire[0]]}"
        numbers = [spring.remark]
    lines = [f"{robot.name}: {of_wires}."]
    lines.append("The firmware knows no creep; creep-table.csv says how much a line grows under load.")
    for doubt in doubts(robot, line):
        lines.append(f"Beware: {doubt.text}.")
    lines += numbers
    lines.append(_pulleys_left_out(robot))
    return "".join(f"{mark} {text}\n" for text in lines if text)


def _wires_in_words(robot: Robot, line: WireDraws, about: dict[str, str], spring: WorkingSpring) -> list[str]:
    """Each wire with where its numbers come from, and which of them the firmware gets."""
    out = []
    for name, origin in about.items():
        own = working_spring(robot, line, name)
        said = f"Wire {name}: {origin}; spring constant {own.mean_N:.0f} N, {own.band}."
        out.append(f"{said} {own.remark}".strip())
    out.append(f"The firmware takes one spring constant for all wires: here that of wire {spring.of}.")
    return out


def _origin(is_given: bool, line: WireDraws) -> str:
    """Where a line's numbers come from; only a fit has tests."""
    if is_given:
        return "as the robot's file gives it"
    tested = ""
    if line.tension_range_N is not None:
        tested = f", tested from {line.tension_range_N[0]:g} to {line.tension_range_N[1]:g} N"
    return f"fitted at {line.length_mm:g} mm{tested}"


def _pulleys_left_out(robot: Robot) -> str:
    if robot.pulleys is None:
        return ""
    radii = _joined(1e3 * robot.pulleys.radius_m, "g", ", ")
    return f"Left out: the pulleys at the anchors (radii {radii} mm); the firmware takes an anchor for a point."


def _joined(values: Floats, form: str, between: str = ":") -> str:
    return between.join(format(float(v) + 0.0, form) for v in values)

"""A robot as another program describes it, and the robot file that it becomes."""

import json
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics.description import Freedom

_SHARE = 0.15  # of the exit points' extent, to each side of the home pose: the box of workspace figures


@dataclass(frozen=True)
class ImportedRobot:
    """What a file of another program says of a robot; lengths in metres.

    Attributes
    ----------
    name, source : str
    freedom : {"pose", "position", "orientation"}
    mass_kg : float
    centre_of_mass_m : (3,) array
    exit_m, platform_m : (w, 3) arrays
    pulley_m, axis : (w,) and (w, 3) arrays
        Radius, 0 without a pulley, and swivel axis.
    tension_N : (lowest, highest) or None
    home_m, home_rotation_rad : (3,) arrays, the first or None
    notes : tuple of str
        What was left out or decided on the way, a sentence each.
    lines, beyond_m : (w,) arrays or None
        Parallel lines of each wire, and wire beyond its exit point, where the file says so.
    normal : (3,) array or None
        Of the plane in which a rail holds the platform.
    winch : tuple of str or None
        Name of each leg's winch, where some drive several lines.
    on_bed : bool
        Whether the workspace begins at the home pose's height, as above a printer's bed.
    """

    name: str
    source: str
    freedom: Freedom
    mass_kg: float
    centre_of_mass_m: Floats
    exit_m: Floats
    platform_m: Floats
    pulley_m: Floats
    axis: Floats
    tension_N: tuple[float, float] | None
    home_m: Floats | None
    home_rotation_rad: Floats
    notes: tuple[str, ...]
    lines: Floats | None = None
    beyond_m: Floats | None = None
    normal: Floats | None = None
    winch: tuple[str, ...] | None = None
    on_bed: bool = False


def robot_file(robot: ImportedRobot, tension_N: tuple[float, float], home_m: Floats) -> str:
    """The robot's file (TOML) as text, with comments on what is not from the other program.

    Parameters
    ----------
    robot : ImportedRobot
    tension_N : (lowest, highest)
    home_m : (3,) array
    """
    lower, upper = _workspace(robot, home_m)
    beyond = ", beyond_exit_m" if robot.beyond_m is None else ""
    space = "" if robot.freedom == "orientation" else ", the workspace"
    ours = f"Ours: the choice of tensions{space}{beyond}" + _given(robot, tension_N, home_m)
    source = [_text(line)[1:-1] for line in (robot.source, *robot.notes, ours + ".")]
    lines = [
        "version = 1",
        f"name = {_text(robot.name)}",
        f"description = {_text(f'{robot.name}, imported')}",
        'source = """',
        *source,
        '"""',
        f'freedom = "{robot.freedom}"',
        "",
        "[platform]",
        f"mass_kg = {robot.mass_kg!r}",
        f"centre_of_mass_m = {_row(robot.centre_of_mass_m)}",
        "",
        "[tension]",
        'choice = "minimum_norm"   # or "middle"',
        f"lowest_N = {float(tension_N[0])!r}",
        f"highest_N = {float(tension_N[1])!r}",
        "",
        "[pose]",
        f"position_m = {_row(home_m)}",
        f"rotation_vector_rad = {_row(robot.home_rotation_rad)}",
        "",
        "[workspace]   # about the pose, to be replaced by yours",
        f"lower_m = {_row(lower)}",
        f"upper_m = {_row(upper)}",
    ]
    if robot.normal is not None:
        lines += ["", "[plane]", f"normal = {_row(robot.normal)}", 'contact = "rail"']
    legs = zip(robot.exit_m, robot.platform_m, robot.pulley_m, robot.axis, strict=True)
    for i, (exit_m, point, radius, axis) in enumerate(legs):
        lines += ["", "[[leg]]"]
        if robot.winch is not None:
            lines.append(f"winch = {_text(robot.winch[i])}")
        lines += [f"exit_point_m = {_row(exit_m)}", f"platform_point_m = {_row(point)}"]
        if radius:
            lines += [f"pulley_radius_m = {float(radius)!r}", f"swivel_axis = {_row(axis)}"]
        if robot.lines is not None:
            lines.append(f"lines = {int(robot.lines[i])}")
        wire = 0.0 if robot.beyond_m is None else float(robot.beyond_m[i])
        lines.append(f"beyond_exit_m = {wire!r}   # wire from here to the drum: it stretches and creeps too")
    return "\n".join(lines) + "\n"


def _workspace(robot: ImportedRobot, home_m: Floats) -> tuple[Floats, Floats]:
    """Corners of the box of workspace figures, about the home pose as far as the platform can leave it."""
    if robot.freedom == "orientation":
        return home_m, home_m
    extent = np.ptp(robot.exit_m, axis=0)
    half = _SHARE * np.where((np.arange(3) == 2) & (extent == 0), extent.max(), extent)
    if robot.normal is not None:
        half = half * (robot.normal == 0)
    middle = home_m + half * [0.0, 0.0, 1.0] * robot.on_bed
    return (middle - half).round(6), (middle + half).round(6)


def _given(robot: ImportedRobot, tension_N: tuple[float, float], home_m: Floats) -> str:
    """What else was given beside the file."""
    out = ""
    if robot.tension_N != tension_N:
        out += ", the tension bounds"
    if robot.home_m is None or np.any(robot.home_m != home_m):
        out += ", the position of the home pose"
    return out


def _text(text: str) -> str:
    """A TOML string: those of JSON are, with letters as they are."""
    return json.dumps(text, ensure_ascii=False)


def _row(values: Floats | Sequence[float]) -> str:
    return "[" + ", ".join(repr(float(v) + 0.0) for v in values) + "]"

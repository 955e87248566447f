"""A fitted wire for people who run such robots: firmware settings with intervals, and a table of creep.

Hangprinter firmware thinks of a line as a spring of ``constant / length`` with the length in mm, so its constant is k1
in newtons. It knows no creep: the table beside it says how much each line will have grown.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from wirebayes.robot.creep import HoldCreep, fresh
from wirebayes.robot.description import Robot
from wirebayes.robot.draws import WireDraws, for_robot

Floats = NDArray[np.float64]
LETTERS = "ABCDEFGHI"
TABLE = ("tension_N", "time_s", "mean_mm_per_m", "sd_mm_per_m", "q05_mm_per_m", "q50_mm_per_m", "q95_mm_per_m")


def is_hangprinter(robot: Robot) -> bool:
    """Whether Hangprinter firmware can be told of it: four or five drums, orientation held by parallel lines."""
    return robot.freedom == "position" and not robot.is_linear.any() and 4 <= robot.legs <= 5


def reprapfirmware(robot: Robot, line: WireDraws) -> str:
    """Lines for ``config.g`` of RepRapFirmware (M669 and M666), each value with its 90 % interval in a comment."""
    anchors = " ".join(f"{letter}{_joined(1e3 * a, '.2f')}" for letter, a in zip(LETTERS, robot.exit_m, strict=False))
    stretch, mean = _stiffness(line), float(line.parameters["k1"].mean())
    rows = [
        (f"M669 K6 {anchors}", "anchors, mm"),
        (f"M666 U{_joined(robot.lines, '.0f')}", "mechanical advantages"),
        (f"M666 W{robot.mass_kg:g}", "mover, kg"),
        (f"M666 S{mean:.0f}", f"spring constant per unit length, N: {stretch}"),
        (f"M666 Y{_joined(1e3 * robot.beyond_m, '.0f')}", "wire beyond each anchor, mm"),
        (f"M666 I{_joined(np.full(robot.legs, robot.rule.lowest_N), 'g')}", "smallest planned force, N"),
        (f"M666 X{_joined(np.full(robot.legs, robot.rule.highest_N), 'g')}", "largest planned force, N"),
    ]
    return _head(robot, line, ";") + "".join(f"{code} ; {comment}\n" for code, comment in rows)


def klipper(robot: Robot, line: WireDraws) -> str:
    """Sections for ``printer.cfg``: anchors for every Klipper, spring settings for the Hangprinter branch."""
    mean = float(line.parameters["k1"].mean())
    text = _head(robot, line, "#") + (
        "[printer]\nkinematics: winch\n"
        "# The next options are those of the Hangprinter branch of Klipper; upstream does not know them.\n"
        f"winch_mover_weight: {robot.mass_kg:g}  # kg\n"
        f"winch_spring_constant: {mean:.0f}  # N per unit strain: {_stiffness(line)}\n"
        f"winch_mechanical_advantage: {_joined(robot.lines, '.0f', ', ')}\n"
        f"winch_guy_wire_lengths: {_joined(1e3 * robot.beyond_m, '.0f', ', ')}  # mm\n"
        f"winch_min_force: {_joined(np.full(robot.legs, robot.rule.lowest_N), 'g', ', ')}  # N\n"
        f"winch_max_force: {_joined(np.full(robot.legs, robot.rule.highest_N), 'g', ', ')}  # N\n"
    )
    for letter, anchor in zip(LETTERS.lower(), 1e3 * robot.exit_m, strict=False):
        x, y, z = anchor
        text += f"\n[stepper_{letter}]\nanchor_x: {x:.2f}\nanchor_y: {y:.2f}\nanchor_z: {z:.2f}\n"
    return text


def creep_table(
    robot: Robot, line: WireDraws, tensions_N: Sequence[float], times_s: Sequence[float]
) -> list[tuple[float, ...]]:
    """Growth of a new line under constant tension, rows of `TABLE`: mm per metre of line with a 90 % interval."""
    rows: list[tuple[float, ...]] = []
    wires = for_robot(robot, line)
    for load in tensions_N:
        pull = np.full((robot.legs, line.count), float(load))
        creep = HoldCreep(wires, fresh(robot.legs, line.count), pull)
        for time in times_s:
            state = creep.advance(float(time), pull)
            growth = 1e3 * np.broadcast_to(state.strain(wires), pull.shape)[0]
            low, mid, high = np.quantile(growth, [0.05, 0.5, 0.95])
            rows.append((float(load), float(time), float(growth.mean()), float(growth.std()), low, mid, high))
    return rows


def _stiffness(line: WireDraws) -> str:
    low, high = np.quantile(line.parameters["k1"], [0.05, 0.95])
    return f"90 % interval {low:.0f} to {high:.0f}"


def _head(robot: Robot, line: WireDraws, mark: str) -> str:
    tested = ""
    if line.tension_range_N is not None:
        tested = f", tested from {line.tension_range_N[0]:g} to {line.tension_range_N[1]:g} N"
    return (
        f"{mark} {robot.name}: line fitted at {line.length_mm:g} mm{tested}.\n"
        f"{mark} The firmware knows no creep; creep-table.csv says how much a line grows under load.\n"
    )


def _joined(values: Floats, form: str, between: str = ":") -> str:
    return between.join(format(float(v) + 0.0, form) for v in values)

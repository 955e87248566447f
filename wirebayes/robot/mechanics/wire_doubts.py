"""What speaks against using a line's posterior for a robot: doubts about its fit, and uses beyond what was tested."""

from collections.abc import Callable
from functools import partial

import numpy as np

from wirebayes.numeric.typing import Floats
from wirebayes.result_warnings import Notice
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.draws import LENGTH_EXPONENT, WireDraws, lines_of
from wirebayes.sentences import lasting, short

_VANISHES = 1e-3  # share of the largest value: its third digit


def doubts(robot: Robot, line: WireDraws) -> list[Notice]:
    """What the fits of the lines that legs hang on say against using them."""
    of_leg = lines_of(robot, line)
    out = []
    for name, one in line.each.items():
        if any(leg is one for leg in of_leg):
            out += [doubt.of(f"wire {name}") if line.others else doubt for doubt in one.doubts]
    return out


def wire_warnings(robot: Robot, line: WireDraws, tension_N: Floats, time_s: float, zero_m: Floats) -> list[Notice]:
    """A warning for each doubt about a line's fit, and for each way in which a use leaves what was tested.

    Parameters
    ----------
    robot : Robot
    line : WireDraws
        Knows the tensions, hold durations and length that were tested.
    tension_N : (..., w) array
        Tensions of the use; slack and failed ones do not count.
    time_s : float
        Longest time of the use.
    zero_m : (..., w) array
        Zero-tension lengths of the use.

    Returns
    -------
    list of Notice
    """
    out = doubts(robot, line)
    if not line.others and not robot.given:
        return out + _of_one(line, tension_N, time_s, zero_m)
    of_leg = lines_of(robot, line)
    for name, one in line.each.items():
        own = np.array([leg is one for leg in of_leg])
        if own.any():  # a wire that the robot's file gives was not tested at all
            found = _of_one(one, tension_N[..., own], time_s, zero_m[..., own])
            out += [notice.of(f"wire {name}") for notice in found] if line.others else found
    return out


def _span(values: Floats, written: Callable[[float], str]) -> str:
    """The least and the largest of positive values, once where they look alike; 0 for one that vanishes beside it."""
    least, largest = float(values.min()), float(values.max())
    ends = [written(end if end >= _VANISHES * largest else 0.0) for end in (least, largest)]
    return " to ".join(dict.fromkeys(ends))


def _of_one(line: WireDraws, tension_N: Floats, time_s: float, zero_m: Floats) -> list[Notice]:
    out = []
    for text in _beyond(line, tension_N, time_s, zero_m):
        out.append(Notice("extrapolation", text))
    kept = line.material()
    for effect in kept:
        if effect.place == "zero_length":
            text = f"the robot knows no temperature: the effect {effect.name} sees none, as at the first reading of"
            out.append(Notice("left-out", f"{text} the test"))
    for effect in line.effects:
        if effect.scope == "material" and effect not in kept:
            text = f"the material effect {effect.name} has no place in the robot and is left out"
            out.append(Notice("left-out", text))
    if any(effect.name == "discrepancy" for effect in line.effects):
        text = "what the fit could not name is not in the robot: its wires follow the named model only"
        out.append(Notice("left-out", text))
    return out


def _beyond(line: WireDraws, tension_N: Floats, time_s: float, zero_m: Floats) -> list[str]:
    """The ways in which a use leaves what was tested."""
    out = _other_tensions(line, tension_N[np.isfinite(tension_N) & (tension_N > 0)])
    if line.time_range_s is not None and time_s > line.time_range_s[1]:
        out.append(f"{lasting(time_s)} is longer than the longest tested hold, {lasting(line.time_range_s[1])}")
    lengths = 1e3 * zero_m[np.isfinite(zero_m)]
    return out + _other_lengths(line, lengths) if lengths.size else out


def _other_lengths(line: WireDraws, length_mm: Floats) -> list[str]:
    """A notice that wires are much shorter or longer than what was tested, and what is then taken of creep."""
    if length_mm.min() >= 0.5 * line.length_mm and length_mm.max() <= 2.0 * line.length_mm:
        return []
    rule = "is taken to be a strain of the whole wire"
    if LENGTH_EXPONENT in line.parameters:
        rule = "grows with length by the exponent fitted to the tested lengths"
    return [f"wires of {_span(length_mm, '{:.0f}'.format)} mm, tested at {line.length_mm:.0f} mm: creep {rule}"]


def _other_tensions(line: WireDraws, loads: Floats) -> list[str]:
    """A notice that tensions leave the tested range."""
    if line.tension_range_N is None or not loads.size:
        return []
    low, high = line.tension_range_N
    if loads.min() >= low and loads.max() <= high:
        return []
    span = _span(loads, partial(short, digits=3))
    return [f"tensions {span} N leave the tested range {short(low, 3)} to {short(high, 3)} N"]

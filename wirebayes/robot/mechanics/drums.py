"""Drums that wind wire in helices and layers: motor angle to zero-tension length paid out, its slope, and back.

Wire lies on a layer with ``sqrt((2 pi r)^2 + pitch^2)`` a turn; every layer's radius is larger by the layer height. The
motor's angle is counted from nothing paid out: the whole wire on the drum.
"""

from dataclasses import dataclass

import numpy as np

from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics.description import Drums


@dataclass(frozen=True)
class _Winding:
    """One drum's layers: drum angle and wire where each begins, and wire per radian on it; ``full_rad`` holds all."""

    angle_rad: Floats
    wire_m: Floats
    per_rad_m: Floats
    full_rad: float


def _winding(drums: Drums, leg: int) -> _Winding:
    radius, pitch, turns = drums.radius_m[leg], drums.pitch_m[leg], drums.layer_turns[leg]
    layers = 1
    if np.isfinite(turns):
        layers = max(int(np.ceil(drums.wire_m[leg] / (2 * np.pi * radius * turns))), 1)
    per_turn = np.hypot(2 * np.pi * (radius + drums.layer_m[leg] * np.arange(layers)), pitch)
    wire, angle = np.zeros(layers), np.zeros(layers)
    if layers > 1:
        wire[1:], angle[1:] = np.cumsum(turns * per_turn)[:-1], 2 * np.pi * turns * np.arange(1, layers)
    per_rad = per_turn / (2 * np.pi)
    last = int(np.searchsorted(wire, drums.wire_m[leg], side="right")) - 1
    full = angle[last] + (drums.wire_m[leg] - wire[last]) / per_rad[last]
    return _Winding(angle, wire, per_rad, float(full))


def paid_out(drums: Drums, motor_rad: Floats) -> tuple[Floats, Floats]:
    """Zero-tension lengths of motor angles.

    Parameters
    ----------
    drums : Drums
    motor_rad : (..., w) array

    Returns
    -------
    length_m, slope_m : (..., w) arrays
        Length paid out and its slope by the motor's angle, m/rad; NaN for legs without a drum of known radius.
    """
    length, slope = np.full((2, *motor_rad.shape), np.nan)
    for leg in np.flatnonzero(drums.radius_m):
        on, gear = _winding(drums, int(leg)), drums.gear[leg]
        angle = on.full_rad - motor_rad[..., leg] / gear
        layer = np.clip(np.searchsorted(on.angle_rad, angle, side="right") - 1, 0, None)
        wound = on.wire_m[layer] + (angle - on.angle_rad[layer]) * on.per_rad_m[layer]
        length[..., leg], slope[..., leg] = drums.wire_m[leg] - wound, on.per_rad_m[layer] / gear
    return length, slope


def motor_angle(drums: Drums, length_m: Floats) -> Floats:
    """Motor angles ``(..., w)``, rad, that pay out zero-tension lengths ``(..., w)``; NaN for legs without a drum."""
    out = np.full(length_m.shape, np.nan)
    for leg in np.flatnonzero(drums.radius_m):
        on = _winding(drums, int(leg))
        wound = drums.wire_m[leg] - length_m[..., leg]
        layer = np.clip(np.searchsorted(on.wire_m, wound, side="right") - 1, 0, None)
        angle = on.angle_rad[layer] + (wound - on.wire_m[layer]) / on.per_rad_m[layer]
        out[..., leg] = drums.gear[leg] * (on.full_rad - angle)
    return out


def emptied(drums: Drums, length_m: Floats) -> list[int]:
    """Legs, from 0, whose layered drums would need more wire, ``(..., w)`` m, than there is."""
    most = length_m.reshape(-1, len(drums.radius_m)).max(0)
    return [int(i) for i in np.flatnonzero(np.isfinite(drums.layer_turns) & (most > drums.wire_m))]

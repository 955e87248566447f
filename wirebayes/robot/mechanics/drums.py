"""Drums that wind wire in helices and layers: motor angle to zero-tension length paid out, its slope, and back.

Wire lies on a layer with ``sqrt((2 pi r)^2 + pitch^2)`` a turn; every layer's radius is larger by the layer height. The
motor's angle is counted from nothing paid out: the whole wire on the drum.
"""

from dataclasses import dataclass

import numpy as np

from wirebayes.numeric.typing import Floats, Indices
from wirebayes.robot.mechanics.description import Drums


@dataclass(frozen=True)
class _Winding:
    """One drum's layers: drum angle and wire where each begins, and wire per radian on it; ``full_rad`` holds all."""

    angle_rad: Floats
    wire_m: Floats
    per_rad_m: Floats
    full_rad: float

    def wound(self, angle: Floats) -> tuple[Floats, Floats]:
        """Wire on the drum at drum angles, m, and its slope, m/rad."""
        layer = _layer_of(self.angle_rad, angle)
        per_rad = self.per_rad_m[layer]
        return self.wire_m[layer] + (angle - self.angle_rad[layer]) * per_rad, per_rad

    def angle(self, wound: Floats) -> Floats:
        """Drum angles, rad, at which so much wire is on the drum, m."""
        layer = _layer_of(self.wire_m, wound)
        return self.angle_rad[layer] + (wound - self.wire_m[layer]) / self.per_rad_m[layer]


def _winding(drums: Drums, leg: int) -> _Winding:
    per_turn = _wire_per_turn(drums, leg)
    per_rad = per_turn / (2 * np.pi)
    turns = drums.layer_turns[leg]
    wound_m = drums.wire_m[leg]
    layers = len(per_turn)
    wire, angle = np.zeros(layers), np.zeros(layers)
    if layers > 1:
        filled = np.cumsum(turns * per_turn)
        wire[1:] = filled[:-1]
        angle[1:] = 2 * np.pi * turns * np.arange(1, layers)
    last = _layer_of(wire, wound_m)
    beyond = (wound_m - wire[last]) / per_rad[last]
    full = angle[last] + beyond
    return _Winding(angle, wire, per_rad, float(full))


def _wire_per_turn(drums: Drums, leg: int) -> Floats:
    """Length of a turn on every layer, m."""
    layer = np.arange(_layers(drums, leg))
    radius = drums.radius_m[leg] + drums.layer_m[leg] * layer
    return np.hypot(2 * np.pi * radius, drums.pitch_m[leg])


def _layers(drums: Drums, leg: int) -> int:
    """How many layers the whole wire of a leg fills."""
    turns = drums.layer_turns[leg]
    if not np.isfinite(turns):
        return 1
    innermost = 2 * np.pi * drums.radius_m[leg] * turns
    return max(int(np.ceil(drums.wire_m[leg] / innermost)), 1)


def _layer_of(begins: Floats, values: Floats) -> Indices:
    """The layer in which values lie, of layers that begin at these places."""
    layer = np.searchsorted(begins, values, side="right") - 1
    return np.clip(layer, 0, None)


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
    length = np.full(motor_rad.shape, np.nan)
    slope = np.full(motor_rad.shape, np.nan)
    for leg in np.flatnonzero(drums.radius_m):
        drum = _winding(drums, int(leg))
        gear = drums.gear[leg]
        wound, per_rad = drum.wound(drum.full_rad - motor_rad[..., leg] / gear)
        length[..., leg] = drums.wire_m[leg] - wound
        slope[..., leg] = per_rad / gear
    return length, slope


def motor_angle(drums: Drums, length_m: Floats) -> Floats:
    """Motor angles ``(..., w)``, rad, that pay out zero-tension lengths ``(..., w)``; NaN for legs without a drum."""
    out = np.full(length_m.shape, np.nan)
    for leg in np.flatnonzero(drums.radius_m):
        drum = _winding(drums, int(leg))
        angle = drum.angle(drums.wire_m[leg] - length_m[..., leg])
        out[..., leg] = drums.gear[leg] * (drum.full_rad - angle)
    return out


def emptied(drums: Drums, length_m: Floats) -> list[int]:
    """Legs, from 0, whose layered drums would need more wire, ``(..., w)`` m, than there is."""
    most = length_m.reshape(-1, len(drums.radius_m)).max(0)
    short = np.isfinite(drums.layer_turns) & (most > drums.wire_m)
    return np.flatnonzero(short).tolist()

"""From position to tension: what the machine does to the stretched length, and the wire's elastic answer."""

from __future__ import annotations

import numpy as np

from .rig import Array, Bench
from .state import Effects


def positions(bench: Bench, fx: Effects) -> Array:
    """True displacements (mm) before the setting error, shape (n, holds).

    Lost motion is a play: going up the carriage follows at once, going down it stays until the play `w` is used up.
    """
    x = np.tile(bench.displacements_mm, (fx.n, 1))
    at = bench.displacements_mm
    if fx.on("screw_error"):
        turns = at / fx.shape("screw_error.period")[:, None]
        x = x + fx["screw_error"][:, None] * np.sin(2 * np.pi * turns + fx.shape("screw_error.phase")[:, None])
    if fx.on("worn_thread"):
        centre, width = fx.shape("worn_thread.centre")[:, None], fx.shape("worn_thread.width")[:, None]
        x = x + fx["worn_thread"][:, None] * np.exp(-0.5 * ((at - centre) / width) ** 2)
    if fx.on("lost_motion"):
        w = fx["lost_motion"]
        carriage = x[:, 0].copy()
        for j in range(1, x.shape[1]):
            carriage = np.clip(carriage, x[:, j], x[:, j] + w)
            x[:, j] = carriage
    return x


def natural_length(bench: Bench, fx: Effects, hold: int, creep: Array, warmth: Array | float) -> Array:
    """Zero-tension length (mm) with creep (n, G), slip and warmth (K above the first logged reading), shape (n, G)."""
    length = bench.length_mm + creep
    if fx.on("grip_slip"):
        length = length + (fx["grip_slip"] * (hold >= fx.shape("grip_slip.hold")))[:, None]
    if fx.on("thermal_expansion"):
        length = length * (1 + fx["thermal_expansion"][:, None] * warmth)
    return length


def tension(k1: Array, stretched: Array, natural: Array, fx: Effects, hold: int) -> Array:
    """Tension (N), shape (n, G), of wires of `stretched` (n, 1) and `natural` (n, G) length in mm; 0 when slack."""
    if not fx.on("fixture_compliance"):
        return _tension_of_strain(k1, stretched / natural - 1, natural, fx, hold)
    give = fx["fixture_compliance"][:, None]
    answer = _tension_of_strain(k1, stretched / natural - 1, natural, fx, hold)
    for _ in range(60):  # damped fixed point: the fixture gives way under the very tension sought
        slope = k1[:, None] / natural
        nearer = _tension_of_strain(k1, (stretched - give * answer) / natural - 1, natural, fx, hold)
        answer = answer + (nearer - answer) / (1 + give * slope)
    return answer


def _tension_of_strain(k1: Array, strain: Array, natural: Array, fx: Effects, hold: int) -> Array:
    s = np.maximum(strain, 0.0)
    if fx.on("toe"):  # millimetres of the ends that straighten, whatever the sample's length
        width = np.maximum(fx["toe"][:, None], 1e-12)
        s = s - width / natural * -np.expm1(-s * natural / width)
    if fx.on("power_strain"):
        typical = fx.shape("power_strain.typical")[:, None]
        s = typical * (s / typical) ** (1 + fx["power_strain"][:, None])
    stiffness = k1[:, None]
    if fx.on("hold_softening"):
        stiffness = stiffness * (1 - fx["hold_softening"][:, None] * hold)
    result = stiffness * s
    if fx.on("strain_stiffening"):
        result = result * (1 + fx["strain_stiffening"][:, None] * s)
    if fx.on("yield"):
        beyond = np.maximum(s - fx.shape("yield.strain")[:, None], 0.0)
        result = result - stiffness * fx["yield"][:, None] * beyond
    return np.maximum(result, 0.0)

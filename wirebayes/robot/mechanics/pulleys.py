"""Wires over swivelling pulleys: tangent point, length with the wrapped arc, direction, and curvature of the length.

The wire comes along the swivel axis, meets the rim at the exit point, lies on the rim for an arc and leaves along a
tangent. The pulley turns about the axis towards the platform point, so that all of this happens in one plane (A. Pott,
*Influence of pulley kinematics on cable-driven parallel robots*, Advances in Robot Kinematics 2012).

In that plane, with the pulley's centre as origin, the platform point is ``(h, z)``: away from the axis and along it.
Its straight part is ``L = sqrt(h^2 + z^2 - rho^2)`` and its arc follows from ``z + i h = (L - i rho) exp(i wrap)``.
"""

from dataclasses import dataclass

import numpy as np

from wirebayes.numeric.typing import Bools, Floats
from wirebayes.robot.mechanics.description import Pulleys
from wirebayes.robot.mechanics.vectors import cross, dot, norm

_LEAST = 1e-3  # of the radius: a point nearer to the rim has no tangent worth the name, and nearer to the axis no plane


@dataclass(frozen=True)
class WireRun:
    """How wires run from exit points over their pulleys.

    Attributes
    ----------
    length_m : (w, n) array
        From exit point to platform point: arc and straight part.
    straight_m : (w, n) array
        From tangent point to platform point.
    direction : (3, w, n) array
        Unit vectors from the tangent point to the platform point: the gradient of the length.
    across : (3, w, n) array
        Unit vectors across the pulley's plane.
    swing_1_m : (w, n) array
        Curvature of the length across the plane beyond that of the straight part: the pulley swivels, its centre moves.
    wrap_rad : (w, n) array
        Arc on the rim.
    clear : (w, n) bool array
        False where the platform point lies inside the pulley, or on its swivel axis, where the pulley turns anyhow:
        there the other values mean nothing.
    """

    length_m: Floats
    straight_m: Floats
    direction: Floats
    across: Floats
    swing_1_m: Floats
    wrap_rad: Floats
    clear: Bools


def wire_run(pulleys: Pulleys, line_m: Floats) -> WireRun:
    """The way of wires to platform points that lie at ``(3, w, n)`` from their exit points."""
    rho = pulleys.radius_m[:, None]
    s = pulleys.axis.T[:, :, None]
    along = dot(line_m, s)
    beside = line_m - along * s
    tiny = 1e-12 * (rho + 1e-300)
    away = np.maximum(norm(beside), tiny)
    outward = beside / away
    tangent = _tangent(away - rho, along, rho, tiny)
    straight, wrap = tangent.straight_m, tangent.wrap_rad
    leaves = tangent.sine * outward + tangent.cosine * s
    swing = tangent.sine / away - 1.0 / straight
    clear = tangent.clear & (away > _LEAST * rho)
    # A leg without a pulley is a straight line, whatever its axis.
    point = rho == 0
    distance = norm(line_m)
    towards = line_m / np.maximum(distance, 1e-300)
    return WireRun(
        np.where(point, distance, rho * wrap + straight),
        np.where(point, distance, straight),
        np.where(point, towards, leaves),
        cross(s, outward),
        np.where(point, 0.0, swing),
        np.where(point, 0.0, wrap),
        clear | point,
    )


@dataclass(frozen=True)
class _Tangent:
    """The tangent from a rim to a point in the pulley's plane: its length, its angle, and whether there is one."""

    straight_m: Floats
    sine: Floats
    cosine: Floats
    wrap_rad: Floats
    clear: Bools


def _tangent(h: Floats, along: Floats, rho: Floats, tiny: Floats) -> _Tangent:
    """The tangent to the point ``(h, along)``, seen from the pulley's centre."""
    square = h * h + along * along - rho * rho
    least = _LEAST * rho
    straight = np.sqrt(np.maximum(square, least**2 + tiny * tiny))
    to_point = np.maximum(np.sqrt(h * h + along * along), tiny)
    size = to_point * np.sqrt(straight * straight + rho * rho)
    cosine = (along * straight - h * rho) / size
    sine = (along * rho + h * straight) / size
    angle = np.arctan2(sine, cosine)
    wrap = np.where(angle < -1e-9, angle + 2 * np.pi, angle)
    return _Tangent(straight, sine, cosine, wrap, square > least**2)


def traced(pulleys: Pulleys | None, leg: int, line_m: Floats, points: int = 12) -> Floats:
    """One wire from its exit point on, as a line for pictures: ``(p, 3)`` m from the exit point.

    Parameters
    ----------
    pulleys : Pulleys or None
    leg : int
    line_m : (3,) array
        From exit point to platform point.
    points : int
        On the arc.
    """
    if pulleys is None or not pulleys.radius_m[leg]:
        return np.stack([np.zeros(3), line_m])
    own = Pulleys(pulleys.radius_m[leg : leg + 1], pulleys.axis[leg : leg + 1])
    way = wire_run(own, line_m[:, None, None])
    axis = own.axis[0]
    outward = np.cross(way.across[:, 0, 0], axis)
    turn = np.linspace(0.0, way.wrap_rad[0, 0], points)[:, None]
    arc = (1 - np.cos(turn)) * outward + np.sin(turn) * axis
    return np.vstack([own.radius_m[0] * arc, line_m])
